"""Keep the traces of runs as files beside the database, and judge from them.

A file holds the traces of a block. Its name is a hash of its content, and a trace is judged only if
its arrays still have the digest that the result was stored with.
"""

from __future__ import annotations

import json
import math
import os
import tempfile
import zipfile
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from adeye.errors import IntegrityError, PlatformError
from adeye.identity import file_digest
from adeye.judge.evaluate import Evaluation, JudgementColumns, evaluate_trace
from adeye.judge.metrics import METRICS
from adeye.judge.trace_signals import TraceSignals
from adeye.judge.verdict import ERROR as JUDGED_ERROR
from adeye.judge.verdict import FAIL, INCONCLUSIVE
from adeye.outputs import BESIDE_DATABASE
from adeye.simulate.engine import layout_of
from adeye.simulate.mirror import as_driven
from adeye.simulate.traffic import make_traffic
from adeye.store.evidence import roots
from adeye.store.evidence.roots import SUFFIX
from adeye.store.location import Place, locate
from adeye.store.records import Finding
from adeye.store.repository import Repository
from adeye.trace import COLUMNS, DRAWN, Trace

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from adeye.campaign.plan import CampaignPlan
    from adeye.signals import Ints
    from adeye.store.read.rejudging import Again, Gap
    from adeye.store.write.merge import Copied
    from adeye.sweep.case import TestCase

# --- Keep the traces of runs as files beside the database, and judge from them --------------------

Wanted = Literal["none", "failures", "all"]
"""Which traces are kept: of no run, of those that an FSR fails or stays open in, of all."""

_META: Final = "meta"
_KEPT: Final = ("length", "horizon_row", "complete")
_NOT_KEPT: Final = (
    *(OSError, ValueError, KeyError, EOFError, TypeError, AttributeError, IndexError),
    *(MemoryError, RecursionError, NotImplementedError, zipfile.BadZipFile),
)
"""What reading a file that is none of ours can end with."""
MOST_BYTES: Final = 2**30
"""Largest file of traces [bytes]; a block holds a fifth of that."""


@dataclass(frozen=True)
class Keep:
    """Which traces are kept, and where.

    Attributes:
        wanted: Which.
        folder: Where the files are.
    """

    wanted: Wanted
    folder: Path


def keep_traces(
    trace: Trace, evaluation: Evaluation, keep: Keep | None
) -> tuple[tuple[str, int] | None, ...]:
    """Write the wanted traces of a batch to a file.

    Args:
        trace: The batch.
        evaluation: Of it.
        keep: Which are wanted; None for none.

    Returns:
        For each run the name of the file and the place in it, None where it is not kept; nothing
        if no run is.

    Raises:
        PlatformError: The file cannot be written.
    """
    if keep is None or keep.wanted == "none":
        return ()
    runs = np.arange(trace.runs)
    if keep.wanted == "failures":
        found = [
            item.runs[np.isin(item.verdict, (FAIL, JUDGED_ERROR, INCONCLUSIVE))]
            for item in evaluation.judged
        ]
        runs = np.unique(np.concatenate([runs[:0], *found]))
    if not len(runs):
        return ()
    chosen = trace if len(runs) == trace.runs else trace.select(runs.tolist())
    name = _write(chosen, keep.folder)
    files: list[tuple[str, int] | None] = [None] * trace.runs
    for place, run in enumerate(runs.tolist()):
        files[run] = (name, place)
    return tuple(files)


def _write(trace: Trace, folder: Path) -> str:
    """Write a file and name it after its content, so that it cannot be altered unseen."""
    layout = trace.layout
    meta: dict[str, Any] = {
        "monitors": layout.monitors,
        "faults": layout.faults,
        "cases": trace.case_digests,
        "empty": {},
    }
    arrays: dict[str, Any] = {item: getattr(trace, item) for item in _KEPT}
    arrays["time"] = trace.time
    for column in COLUMNS:
        values = np.ascontiguousarray(trace.columns[column])
        if column in DRAWN or not values.view(np.uint8).any():
            # A column without content takes no room.
            shape = (*values.shape[:2], *values.shape[2:])
            meta["empty"][column] = [values.dtype.str, *shape]
        else:
            arrays[column] = values
    arrays[_META] = np.frombuffer(json.dumps(meta).encode(), dtype=np.uint8)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        descriptor, temporary = tempfile.mkstemp(suffix=".tmp", dir=folder)
        try:
            with os.fdopen(descriptor, "wb") as stream:
                np.savez(stream, **arrays)
            name = file_digest(Path(temporary))
            Path(temporary).replace(folder / f"{name}{SUFFIX}")
        finally:
            # What came to its place is no more where it was written.
            Path(temporary).unlink(missing_ok=True)
    except OSError as error:
        raise PlatformError(
            f"traces in {folder} cannot be written: {error.strerror}. "
            "Free space or run without --traces."
        ) from error
    return name


@dataclass(frozen=True)
class Kept:
    """Traces of a file, without the names behind their axes.

    Attributes:
        arrays: Columns and ends by name.
        meta: Monitors, faults and digests of the test cases.
    """

    arrays: dict[str, Any]
    meta: dict[str, Any]


def read_kept(folder: Path, name: str) -> Kept | None:
    """Read a file; None if it is not there or not a file of traces any more.

    Other people's files are read, too. So nothing is unpacked or made that is larger than what it
    says, than its file, or than ``MOST_BYTES``, and what is read has the form that is written.
    """
    path = roots.kept_path(folder, name)
    if path is None:
        return None
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as stored:
            if not _is_as_large_as_its_file(stored.zip.infolist(), path.stat().st_size):
                return None
            arrays = {item: stored[item] for item in stored.files}
        meta = json.loads(arrays.pop(_META).tobytes())
        empty = meta["empty"].items()
        kinds = {column: (np.dtype(kind), tuple(shape)) for column, (kind, *shape) in empty}
        if sum(kind.itemsize * math.prod(shape) for kind, shape in kinds.values()) > MOST_BYTES:
            return None
        arrays |= {column: np.zeros(shape, dtype=kind) for column, (kind, shape) in kinds.items()}
    except _NOT_KEPT:
        return None
    return Kept(arrays, meta) if _has_the_form(arrays, meta) else None


def _is_as_large_as_its_file(members: Sequence[zipfile.ZipInfo], bytes_of_file: int) -> bool:
    """Tell whether an archive is stored as it is: neither packed nor one member within another."""
    return (
        all(item.compress_type == zipfile.ZIP_STORED for item in members)
        and sum(item.file_size for item in members) <= bytes_of_file <= MOST_BYTES
    )


def _has_the_form(arrays: dict[str, Any], meta: dict[str, Any]) -> bool:
    """Tell whether B runs of T ticks have every column, of numbers, and their names."""
    if arrays.keys() != {*_KEPT, "time", *COLUMNS}:
        return False
    names = [meta.get(item) for item in ("monitors", "faults", "cases")]
    runs, ticks = arrays["length"].shape, arrays["time"].shape
    return (
        len(runs) == len(ticks) == 1
        and all(array.dtype.kind in "biuf" for array in arrays.values())
        and all(arrays[item].shape == runs for item in _KEPT)
        and all(arrays[item].shape[:2] == (*runs, *ticks) for item in COLUMNS)
        and all(isinstance(item, list) and all(isinstance(n, str) for n in item) for item in names)
        and len(meta["cases"]) == runs[0]
    )


def trace_of(
    kept: Kept, places: Ints, cases: Sequence[TestCase], backend: str, variant: str | None
) -> Trace:
    """Make the trace of some runs of a file.

    Args:
        kept: The file.
        places: (R,) places in it.
        cases: R test cases.
        backend: Traffic implementation that executed them.
        variant: Arithmetic of it.
    """
    is_whole = len(places) == len(kept.arrays["length"]) and bool(
        (places == np.arange(len(places))).all()
    )

    def of(name: str) -> Any:
        return kept.arrays[name] if is_whole else kept.arrays[name][places]

    # The axes that their trace had; nothing is executed.
    cases = as_driven(cases)
    context, _ = make_traffic(backend, variant).reset(cases)
    monitors, faults = (tuple(kept.meta[name]) for name in ("monitors", "faults"))
    return Trace(
        layout=layout_of(cases, context, monitors, faults),
        time=kept.arrays["time"],
        **{name: of(name) for name in _KEPT},
        columns={name: of(name) for name in COLUMNS},
        channel_events=(None,) * len(places),
        case_digests=tuple(case.digest for case in cases),
    )


def kept_trace(
    repository: Repository, result: str, case: TestCase, backend: str, variant: str | None
) -> Trace | None:
    """Read the trace of one run from its file; None if none is kept or the file is gone.

    Args:
        repository: The database.
        result: Digest of the run's result.
        case: Its test case.
        backend: Traffic implementation that executed it.
        variant: Arithmetic of it.

    Raises:
        IntegrityError: The trace does not have the digest that the result was stored with.
    """
    folders = roots.folders_of(repository.location.beside)
    for name, place, digest in repository.evidence.kept_places(result):
        kept = _read_found(folders, name)
        if kept is not None:
            _require_places(kept, name, np.array([place]))
            trace = trace_of(kept, np.array([place]), [case], backend, variant)
            _require_recorded(folders, name, trace, [(result, digest)])
            return trace
    return None


def _require_places(kept: Kept, name: str, places: Ints) -> None:
    """Refuse a file that has fewer runs than results refer to.

    Raises:
        IntegrityError: It is one.
    """
    if not bool(((places >= 0) & (places < len(kept.meta["cases"]))).all()):
        raise IntegrityError(f"{name[:12]}{SUFFIX} has fewer runs than results refer to")


def _require_recorded(
    folders: Sequence[Path], name: str, trace: Trace, results: Sequence[tuple[str, str]]
) -> None:
    """Refuse kept traces that are not those that were recorded.

    Args:
        folders: Where files of traces are.
        name: Of the file.
        trace: What was read.
        results: Digest of the result and of the trace of each run.

    Raises:
        IntegrityError: Names the run.
    """
    path = roots.find_kept(folders, name)
    # The names of faults and monitors are in no digest of a trace, but in that of the file.
    is_altered = path is None or bool(_problem(path, name))
    for (result, recorded), digest in zip(results, trace.digests(), strict=True):
        if is_altered or digest != recorded:
            raise _not_recorded(f"the kept trace of run {result[:12]} in {name[:12]}{SUFFIX}")


def _read_found(folders: Sequence[Path], name: str) -> Kept | None:
    """Read a file of traces; None if it is gone.

    Raises:
        IntegrityError: It is there, and no file of traces any more.
    """
    path = roots.find_kept(folders, name)
    kept = None if path is None else read_kept(path.parent, name)
    if kept is None and path is not None:
        raise _not_recorded(f"the file of kept traces {name[:12]}{SUFFIX}")
    return kept


def _not_recorded(what: str) -> IntegrityError:
    return IntegrityError(
        f"{what} is not the one that was recorded. Restore the file from a copy; without it the "
        "run is replayed, and 'adeye db verify' names it as missing."
    )


@dataclass(frozen=True)
class FromTraces:
    """Verdicts from the traces of one file.

    Attributes:
        places: Which of the results were judged.
        columns: Verdicts, whose runs number these.
        trace_digests: Of their traces, in the same order.
    """

    places: tuple[int, ...]
    columns: tuple[JudgementColumns, ...]
    trace_digests: tuple[str, ...]


def judge_kept(
    again: Again, plan: CampaignPlan, gaps: Sequence[Gap], database: Path
) -> Iterator[FromTraces]:
    """Judge results from kept traces, file by file.

    Args:
        again: Tells where the traces are kept.
        plan: What the results are planned in.
        gaps: Results of one scenario and architecture, with the FSRs that are wanted.
        database: The database.

    Raises:
        IntegrityError: A trace does not have the digest that its result was stored with.
    """
    by_number = {gap.number: place for place, gap in enumerate(gaps)}
    files: dict[str, list[tuple[int, int]]] = {}
    for number, name, where in again.files(list(by_number)):
        files.setdefault(name, []).append((by_number[number], where))
    done: set[int] = set()
    folders = roots.folders_of(database)
    for name, kept in _read_ahead(folders, list(files)):
        wanted = [(place, where) for place, where in files[name] if place not in done]
        if kept is None or not wanted:
            continue
        done.update(place for place, _ in wanted)
        places = tuple(place for place, _ in wanted)
        cases = [plan.cases[gaps[place].ordinal] for place in places]
        at = np.array([where for _, where in wanted])
        _require_places(kept, name, at)
        trace = trace_of(kept, at, cases, plan.engine.backend, plan.work.variant)
        recorded = [(gaps[place].result, gaps[place].trace_digest) for place in places]
        _require_recorded(folders, name, trace, recorded)
        yield FromTraces(places, _judge(plan, [gaps[place] for place in places], trace, cases),
                         tuple(trace.digests()))  # fmt: skip


def _read_ahead(folders: Sequence[Path], names: Sequence[str]) -> Iterator[tuple[str, Kept | None]]:
    """Read files one after the other, the next one while one is judged."""
    read = partial(_read_found, folders)
    with ThreadPoolExecutor(1) as reader:
        ahead = [reader.submit(read, name) for name in names[:1]]
        for place, name in enumerate(names):
            kept = ahead.pop().result()
            ahead += [reader.submit(read, item) for item in names[place + 1 :][:1]]
            yield name, kept


def _judge(
    plan: CampaignPlan, gaps: Sequence[Gap], trace: Trace, cases: Sequence[TestCase]
) -> tuple[JudgementColumns, ...]:
    asked = {fsr for gap in gaps for fsr in gap.fsrs}
    wanted = [item for item in plan.requirements if item.requirement.id in asked]
    inside = np.array([case.inside_odd for case in cases], dtype=np.bool_)
    signals = TraceSignals(trace, inside, plan.files.odd.spec.attributes, plan.faults)
    bounds = {item.bound.column for item in wanted if item.bound is not None}
    metrics = {name: METRICS[name] for name in METRICS if name in bounds}
    found = evaluate_trace(signals, wanted, metrics=metrics).judged
    return tuple(_asked(item, gaps) for item in found)


def _asked(item: JudgementColumns, gaps: Sequence[Gap]) -> JudgementColumns:
    """Leave out the runs that have a verdict of the FSR already."""
    is_asked = np.array([item.fsr_id in gaps[run].fsrs for run in item.runs.tolist()], dtype=bool)
    if is_asked.all():
        return item
    return replace(
        item,
        **{
            name: getattr(item, name)[is_asked]
            for name in ("runs", "verdict", "exercised", "numbers", "actor", "binding", "detail")
        },
    )


# --- The files beside a database: kept traces that are altered, gone, or of no run; and their
# copy.

_PLACE = "trace"


def altered_files(repository: Repository) -> Iterator[Finding]:
    """Name kept traces that are gone, altered, or not what adeye writes there.

    A file is named after its content. One of no run that has its name is left over from a block
    that was interrupted, see ``left_files``.
    """
    folders = roots.folders_of(repository.location.beside)
    known = repository.evidence.kept_files()
    present = _present(folders[0])
    missing = f"is missing (bring it to {folders[0]} from where the database was, or from a copy)"
    for name, runs in known.items():
        path = present.pop(f"{name}{SUFFIX}", None) or roots.find_kept(folders[1:], name)
        if problem := missing if path is None else _problem(path, name):
            more = f" and {len(runs) - 1} more" if len(runs) > 1 else ""
            of_runs = f"which has the traces of run {runs[0][0][:12]}{more}"
            yield Finding(_PLACE, f"{name}{SUFFIX}", f"{problem}, {of_runs}")
    for own_name, path in sorted(present.items()):
        if not _is_left(path):
            yield Finding(_PLACE, own_name, "was not written by adeye, or is altered")


def copy_campaigns(source: Repository, names: Sequence[str], to: Place) -> Copied:
    """Copy campaigns with all that they refer to, kept traces too, into a database of their own.

    The other database is only read. What was begun is removed where anything fails.

    Args:
        source: The database that has them.
        names: Their ids, the beginnings of them, or their numbers.
        to: A new database, or an empty one of a server.

    Raises:
        InputError: There is no such campaign, or the new database has campaigns already.
        IntegrityError: What is to be copied is not as it was written.
        PlatformError: A database or the disk refuses.
    """
    chosen = tuple(dict.fromkeys(source.find_campaign(name).id for name in names))
    place = locate(to)
    folders, folder = roots.folders_of(source.location.beside), roots.folder_of(place.beside)
    names_of = [source.evidence.kept_files(item) for item in chosen]
    kept = dict.fromkeys(name for item in names_of for name in item)
    for wrong in altered_files(source):
        if wrong.row.removesuffix(SUFFIX) in kept:
            raise IntegrityError(f"{wrong}. Nothing was copied; see 'adeye db verify'.")
    with ExitStack() as undoing:
        undoing.callback(_remove_empty, folder)
        if place.path is not None and not place.path.exists():
            real = place.path.resolve()
            for end in ("", *BESIDE_DATABASE):
                undoing.callback(real.with_name(real.name + end).unlink, missing_ok=True)
        with Repository.open(place) as into:
            # Before the rows that name them are there; without those, files are only left over.
            for name in kept:
                if (file := roots.copy_kept(name, folders, folder)) is not None:
                    undoing.callback(file.unlink, missing_ok=True)
            copied = into.copy(source.location, chosen)
        undoing.pop_all()
    return copied


def _remove_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()


def left_files(repository: Repository) -> tuple[str, ...]:
    """Name whole files of traces that no run of the database refers to.

    A run of another one may, which was copied from it or had its name before.
    """
    folder = roots.folder_of(repository.location.beside)
    known = repository.evidence.kept_files()
    return tuple(
        sorted(
            name
            for name, path in _present(folder).items()
            if path.stem not in known and _is_left(path)
        )
    )


def _present(folder: Path) -> dict[str, Path]:
    return {path.name: path for path in folder.iterdir()} if folder.is_dir() else {}


def _problem(path: Path, name: str) -> str:
    try:
        return (
            "" if roots.kept_path(path.parent, name) and file_digest(path) == name else "is altered"
        )
    except OSError as error:
        return f"cannot be read ({error.strerror})"


def _is_left(path: Path) -> bool:
    """Tell whether a file is what an interrupted block leaves: whole, or not finished."""
    if path.suffix == ".tmp":
        return path.is_file() and not path.is_symlink()
    return path.suffix == SUFFIX and not _problem(path, path.stem)
