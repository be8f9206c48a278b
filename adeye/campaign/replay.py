"""Show a stored run, and run it again to compare every bit of its trace.

A recalled run holds its whole architecture and scenario. Only one part of the runs is recalled at a
time, so memory does not grow with the campaign.
"""

from __future__ import annotations

import collections
from collections.abc import Callable
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, BinaryIO, Final, TypeVar

from adeye.campaign.parts import (
    Source,
    Unchanged,
    driver_sources,
    parts_now,
    sources_of,
    use_plugin_metrics,
)
from adeye.campaign.plan import folder_of_plugins, recreate
from adeye.campaign.run import Progress, fitting
from adeye.campaign.traces import kept_trace
from adeye.campaign.work import WorkContext, evaluate, grouped, signals_of
from adeye.errors import InputError, IntegrityError, SpecError, UsageError, amount, suggest
from adeye.identity import file_digest
from adeye.outputs import replacing
from adeye.plugins import locate_file
from adeye.simulate.channels.process.protocol import Witness
from adeye.simulate.engine import identity
from adeye.simulate.traffic import VARIANTS
from adeye.spec.concept import Concept
from adeye.spec.load import odd_of
from adeye.spec.quantity import SI
from adeye.store.records import EngineKey, of_row
from adeye.store.repository import Repository
from adeye.sweep.case import TestCase, structure_key
from adeye.trace import LINK_TICKS, Trace
from adeye.units import shown

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from adeye.judge.evaluate import Evaluation
    from adeye.judge.trace_signals import TraceSignals
    from adeye.judge.uncertainty import NumericUncertainty
    from adeye.spec.concept import Requirement
    from adeye.spec.scenario import Driver
    from adeye.store.records import CampaignInfo, RunRef, StoredRun
    from adeye.trace import Album, ChannelEvent

# --- Show a stored run, and run it again to compare every bit of its trace ------------------------

CHANGED: Final = (
    "other code or another machine executed it first, or it keeps state from call to call"
)
"""Why a run is not as stored that comes out alike whenever it is executed now."""
UNSTEADY: Final = (
    "something in it is not deterministic: look for time, process ids, threads, unseeded "
    "randomness, and state that is kept from call to call"
)
"""Why a run is not as stored that comes out in more than one way now."""


Report = Callable[[Progress], None]

Dump = tuple[str | None, Path | BinaryIO]
"""Whose observations are taken down, and where: a file's name, or an open file."""


@dataclass(frozen=True)
class Execution:
    """A stored run, executed again.

    Attributes:
        run: Where it stands.
        stored: What the database holds.
        case: Its test case.
        trace: The trace of this one run.
        signals: Its signals by name.
        evaluation: Metrics and judgements of the trace.
    """

    run: RunRef
    stored: StoredRun
    case: TestCase
    trace: Trace
    signals: TraceSignals
    evaluation: Evaluation


@dataclass(frozen=True, slots=True)
class Replayed:
    """What running a stored run again came to.

    Attributes:
        run: Result digest.
        scenario: Id in the ODD.
        architecture: Id.
        fault_entry: ``none``, a fault's id, or ids joined by ``+``.
        stored_digest: Trace digest in the database.
        trace_digest: Trace digest now.
        identical: Whether the two are equal.
        rows: Ticks of the trace.
        outcome: What happened.
        verdicts: Verdict by FSR.
        note: Why a difference may be expected; empty if none is.
        same_ticks: Ticks at the beginning that are as recorded, in steps of ``LINK_TICKS``; None
            where that was not recorded.
        cause: Why the two differ, as far as executing it once more tells; empty if they do not.
    """

    run: str
    scenario: str
    architecture: str
    fault_entry: str
    stored_digest: str
    trace_digest: str
    identical: bool
    rows: int
    outcome: str
    verdicts: Mapping[str, str]
    note: str
    same_ticks: int | None = None
    cause: str = ""

    def __repr__(self) -> str:
        """Name the run, and whether its trace is the stored one."""
        return f"<Replayed {self.run[:10]}: {'identical' if self.identical else 'different'}>"

    def __bool__(self) -> bool:
        """Be true if the trace is the stored one."""
        return self.identical


@dataclass(frozen=True)
class Recalled:
    """A stored run with all that it takes to execute and judge it again.

    Attributes:
        run: Where it stands.
        stored: What the database holds.
        case: Its test case.
        work: What it was made and judged with.
        uncertainty: Numeric uncertainty that it was judged with, by FSR.
    """

    run: RunRef
    stored: StoredRun
    case: TestCase
    work: WorkContext
    uncertainty: Mapping[str, NumericUncertainty]

    def evaluate(
        self,
        trace: Trace,
        cases: Sequence[TestCase],
        uncertainty: Mapping[str, NumericUncertainty] = MappingProxyType({}),
    ) -> Evaluation:
        """Measure and judge executions of its structure as its campaign does.

        Raises:
            InputError: A metric of the ODD is not there any more.
        """
        use_plugin_metrics(self.work.metrics, self.work.odd_folder)
        return evaluate(trace, cases, self.work.requirements, self.work.faults, uncertainty)


def recall(repository: Repository, run: RunRef) -> Recalled:
    """Make a stored run ready to be executed again.

    Args:
        repository: The database.
        run: A run that has a result.

    Raises:
        InputError: It was planned, but not executed yet.
        IntegrityError: Its test case does not come out of the database as it went in.
    """
    stored = repository.run_row(run.result_digest)
    if stored is None:
        raise InputError(
            f"run {run.result_digest[:12]} was planned, but not executed yet",
            remedy="Run the campaign first.",
        )
    campaign = repository.find_campaign(run.campaign)
    odd = repository.content("odd", campaign.odd_digest)
    row = repository.test_case_row(run.test_case)
    case = recreate(row, run.scenario, odd["odd"], inside_odd=run.inside_odd)
    concept = Concept.model_validate(
        repository.content("concept", campaign.concept_digest), context=SI
    )
    name = case.architecture.architecture
    keys = (name, *((case.place_key,) if case.scenario.drivers else ()))
    near, known = repository.location.beside.parent, list(_provenances(repository, campaign))
    folders = {key: folder_of_plugins(row, known, key, near) for key in keys}
    work = WorkContext(
        backend=str(stored.row["backend"]),
        variant=_known_variant(stored.row),
        # What is executed beside it is of the same engine, see ``require_same_code``.
        engines={name: of_row(EngineKey, stored.row)},
        folders=folders,
        requirements=() if run.is_drive else concept.requirements,
        faults=tuple(fault["id"] for fault in odd["odd"]["faults"]),
        metrics=tuple(odd["odd"].get("plugins", ())),
        odd_folder=odd_of(campaign.provenance, near).parent,
    )
    uncertainty = repository.hindsight.half_steps.judged_with(run, stored)
    return Recalled(run, stored, case, work, uncertainty)


def _provenances(repository: Repository, campaign: CampaignInfo) -> Iterator[Mapping[str, Any]]:
    """Tell where a campaign was planned, and then where it was executed, the latest first."""
    yield campaign.provenance
    for session in reversed(repository.evidence.sessions(campaign.id)):
        yield session.provenance


@contextmanager
def _witness(dump: Dump | None, case: TestCase) -> Iterator[Witness | None]:
    """Open the file that gets what a channel is shown.

    Raises:
        UsageError: There is no such channel, or the file is not to be written over.
        PlatformError: The file cannot be written.
    """
    if dump is None:
        yield None
        return
    channels = case.architecture.channels
    channel, path = dump[0] or case.architecture.switch.default, dump[1]
    if channel not in channels:
        raise UsageError(
            f"architecture {case.architecture.architecture} has no channel {shown(channel)}",
            remedy=suggest(channel, channels),
        )
    if not isinstance(path, Path):
        yield Witness(channel, path)
        return
    with replacing(path) as place, place.open("wb") as stream:
        yield Witness(channel, stream)


def rerun(
    repository: Repository, run: RunRef, dump: Dump | None = None, album: Album | None = None
) -> Execution:
    """Execute a stored run again, alone.

    Args:
        repository: The database.
        run: A run that has a result.
        dump: Channel, or None for the default of the switch, and the file that gets what it is
            shown.
        album: Gets the images that physical cameras take.

    Raises:
        InputError: It was planned, but not executed yet.
        IntegrityError: Its test case does not come out of the database as it went in.
    """
    recalled = recall(repository, run)
    case = recalled.case
    with _witness(dump, case) as witness:
        trace = recalled.work.drive([case], drawn=True, witness=witness, album=album)
    return _execution(recalled, trace)


def _execution(recalled: Recalled, trace: Trace) -> Execution:
    """Judge the trace of a run that was executed again."""
    case, work = recalled.case, recalled.work
    return Execution(
        run=recalled.run,
        stored=recalled.stored,
        case=case,
        trace=trace,
        signals=signals_of(trace, [case], work.faults),
        evaluation=recalled.evaluate(trace, [case], recalled.uncertainty),
    )


@dataclass(frozen=True)
class Recorded:
    """The signals of a stored run, as they were recorded.

    Attributes:
        run: Where it stands.
        stored: What the database holds.
        case: Its test case.
        signals: Its signals by name, of this one run.
        requirements: FSRs that its campaign judges it on.
        is_kept: Whether they come from a kept file; else it was executed again.
    """

    run: RunRef
    stored: StoredRun
    case: TestCase
    signals: TraceSignals
    requirements: tuple[Requirement, ...]
    is_kept: bool


def recorded(repository: Repository, run: RunRef) -> Recorded:
    """Read the signals of a stored run: from its kept trace, else by executing it again.

    Args:
        repository: The database.
        run: A run that has a result.

    Raises:
        InputError: It was planned, but not executed yet.
        IntegrityError: Its trace is not the one that was recorded.
    """
    recalled = recall(repository, run)
    case, work, stored = recalled.case, recalled.work, recalled.stored
    kept = kept_trace(repository, run.result_digest, case, work.backend, work.variant)
    trace = work.drive([case]) if kept is None else kept
    if trace.digests() != [stored.trace_digest]:
        name = run.result_digest[:12]
        raise IntegrityError(
            f"run {name} does not come out as it was recorded, so what it looked like is not "
            f"known. 'adeye replay {name}' tells why."
        )
    signals = signals_of(trace, [case], work.faults)
    return Recorded(run, stored, case, signals, tuple(work.requirements), kept is not None)


def same_ticks(stored: StoredRun, chain: Sequence[str]) -> int | None:
    """Count the ticks in which an execution is known to be as it was recorded.

    Args:
        stored: With the digest chain that was recorded.
        chain: Of the execution.

    Returns:
        Ticks before the first link that differs; None where no chain was recorded.
    """
    if stored.links is None:
        return None
    parts = int(stored.row["trace_rows"]) // LINK_TICKS
    same = zip(stored.links[:parts], chain, strict=False)
    return LINK_TICKS * sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], same))


def require_as_recorded(recalled: Recalled, trace: Trace, run: int) -> None:
    """Refuse an execution that is not the recorded run.

    Raises:
        IntegrityError: It differs; the message says from where on.
    """
    if trace.digests()[run] == recalled.stored.trace_digest:
        return
    same = same_ticks(recalled.stored, trace.chains()[run])
    where = "" if same is None else f": the first {same} ticks are as recorded, not the whole run"
    raise IntegrityError(
        f"run {recalled.run.result_digest[:12]} does not come out as it was recorded{where}. "
        "What stands beside it would be of another run; `adeye replay` says why it may differ."
    )


def _known_variant(row: Mapping[str, Any]) -> str | None:
    """Give the arithmetic that a run was made with; None if this version has another in its place.

    The version of an arithmetic changes with its bits; its name stays.
    """
    backend, name = str(row["backend"]), str(row["variant"])
    short = name.rpartition("-")[0]
    return short if short in VARIANTS.get(backend, ()) else None


def replay_run(
    db: str | Path | None,
    run: str,
    dump: Dump | None = None,
    look: Callable[[Trace], None] | None = None,
    album: Album | None = None,
    hand_out: Callable[[Execution], None] | None = None,
) -> Replayed:
    """Execute a stored run again and compare trace digests.

    Where they differ it is executed once more: what changed and what is never the same are two
    causes.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        run: Beginning of its result digest.
        dump: Channel, or None for the default of the switch, and the file that gets what it is
            shown, a line for each observation.
        look: Is shown the trace of the run.
        album: Gets the images that physical cameras take.
        hand_out: Is shown its whole execution, after that.
    """
    with Repository.open(db, create=False) as repository:
        ref = repository.find_run(run)
        done = rerun(repository, ref, dump, album)
        trace_digest = done.trace.digests()[0]
        cause = ""
        if trace_digest != done.stored.trace_digest:
            (once_more,) = rerun(repository, ref).trace.digests()
            cause = CHANGED if once_more == trace_digest else UNSTEADY
    if look is not None:
        look(done.trace)
    if hand_out is not None:
        hand_out(done)
    row = done.stored.row
    now = identity(str(row["backend"]), _known_variant(row))
    note = ""
    if (row["variant"], row["numerics_version"]) != (now.variant, now.numerics_version):
        note = (
            f"it was made by {row['variant']}, numerics version {row['numerics_version']}; "
            f"this is {now.variant}, numerics version {now.numerics_version}"
        )
    if row["machine_dependent"]:
        why = (
            "it depends on the machine: on a deadline or limit that stopped a channel, on what is "
            "at an address, or on the pace that it was run at"
        )
        note = f"{note}; {why}" if note else why
    return Replayed(
        run=done.run.result_digest,
        scenario=done.run.scenario,
        architecture=done.run.architecture,
        fault_entry=done.case.fault_entry,
        stored_digest=done.stored.trace_digest,
        trace_digest=trace_digest,
        identical=trace_digest == done.stored.trace_digest,
        rows=int(done.trace.length[0]),
        outcome=done.evaluation.outcomes[0].outcome.value,
        verdicts={item.fsr_id: item.verdict.value for item in done.evaluation.judgements[0]},
        note=note,
        same_ticks=same_ticks(done.stored, done.trace.chains()[0]),
        cause=cause,
    )


# --- Recall the runs of a campaign part by part, and say how many are done ------------------------

PART_RUNS: Final = 512
"""Runs that are recalled at a time."""
MOST_TOGETHER: Final = 128
"""Runs that are executed together with their twins or forks."""

T = TypeVar("T")


def recalled_parts(repository: Repository, runs: Sequence[RunRef]) -> Iterator[list[Recalled]]:
    """Make stored runs ready to be executed again, a part at a time.

    Args:
        repository: The database.
        runs: In any order.

    Yields:
        Parts in the order of the plan, in which runs of one structure stand together.

    Raises:
        InputError: A run was planned, but not executed yet.
        IntegrityError: A test case does not come out of the database as it went in.
    """
    ordered = sorted(runs, key=lambda run: (run.campaign, run.ordinal))
    for first in range(0, len(ordered), PART_RUNS):
        yield [recall(repository, run) for run in ordered[first : first + PART_RUNS]]


def require_same_code(runs: Iterable[Recalled]) -> Unchanged:
    """Refuse to execute anything beside runs with other plug-ins, programs, FMUs or files.

    That its own bits come again does not tell: code that changed may differ only where a run has
    never been.

    Returns:
        Tells, once something was executed, whether all of that stayed as it is; ask it before
        anything is kept.

    Raises:
        IntegrityError: What executed one is not here.
    """
    looked: dict[tuple[str, ...], str] = {}
    sources: dict[Source, None] = {}
    for item in runs:
        architecture, drivers = item.case.architecture, item.case.scenario.drivers
        name, then = architecture.architecture, str(item.stored.row["plugins_digest"])
        is_same = True
        if then:
            folder = item.work.folders[name]
            metrics = use_plugin_metrics(item.work.metrics, item.work.odd_folder)
            key = (name, str(folder), then, *(part.source_digest for part in metrics))
            if key not in looked:
                looked[key] = ""
                with suppress(SpecError):
                    parts = parts_now(architecture, folder, metrics)
                    looked[key] = parts.digest
                    found = sources_of(parts, name, folder, item.work.odd_folder)
                    sources |= dict.fromkeys(found)
            is_same = looked[key] == then
        folder = item.work.folders.get(item.case.place_key, Path())
        if not is_same or not all(_is_there(driver, folder) for driver in drivers.values()):
            raise IntegrityError(
                f"run {item.run.result_digest[:12]}: a plug-in, program or FMU that executed it, "
                "or a file that one reads, is no longer what it was. Run the campaign again with "
                "what is here, and ask again"
            )
        found = driver_sources(item.case.scenario, item.run.scenario, folder)
        sources |= dict.fromkeys(found)
    return Unchanged(sources)


def _is_there(driver: Driver, folder: Path) -> bool:
    try:
        return file_digest(locate_file(driver.file, folder)) == driver.digest
    except (SpecError, OSError):
        return False


def together(items: Iterable[T], recalled_of: Callable[[T], Recalled]) -> Iterator[list[T]]:
    """Group what can be executed in one batch, in groups of ``MOST_TOGETHER`` at most.

    Args:
        items: Recalled runs, or what holds one each.
        recalled_of: Gives the run of an item.
    """

    def structure(item: T) -> object:
        run = recalled_of(item)
        folders = tuple(run.work.folders.values())
        context = (run.run.campaign, folders, run.work.backend, run.work.variant)
        return structure_key(run.case), context

    return grouped(items, structure, MOST_TOGETHER)


def rerun_together(
    repository: Repository, runs: Sequence[RunRef], report: Report | None = None
) -> Iterator[Execution]:
    """Execute stored runs again, in batches of what fits into memory.

    Args:
        repository: The database.
        runs: Runs that have a result, in any order.
        report: Called with how many are done.

    Yields:
        Each as ``rerun`` gives it; in the order of the plan, but runs of one structure together.

    Raises:
        InputError: A run was planned, but not executed yet.
        IntegrityError: A test case does not come out of the database as it went in, or a run as it
            was recorded.
    """
    counter = Counter("replay", len(runs), report)
    for part in recalled_parts(repository, runs):
        for group in together(part, lambda item: item):
            most = max(1, fitting([item.case for item in group]))
            for first in range(0, len(group), most):
                batch = group[first : first + most]
                trace = batch[0].work.drive([item.case for item in batch], drawn=True)
                for run, item in enumerate(batch):
                    require_as_recorded(item, trace, run)
                    yield _execution(item, trace.select([run]))
                    counter.add(1)


def failed_beside(run: RunRef, own: ChannelEvent | None, *others: ChannelEvent | None) -> str:
    """Say which channels failed in what was executed beside a run, and not in the run; else "".

    Args:
        run: The run.
        own: What failed in it.
        others: What failed in a fork or in twins of it.
    """
    known = {item.channel for item in _failures(own)}
    found = {
        f"{item.outcome} of channel {item.channel}": None
        for event in others
        for item in _failures(event)
        if item.channel not in known
    }
    return f"{' and '.join(found)} of {run.architecture}" if found else ""


def _failures(event: ChannelEvent | None) -> tuple[ChannelEvent, ...]:
    return () if event is None else (event, *event.later)


def failures_beside(found: Iterable[str], where: str) -> tuple[str, ...]:
    """Say of some runs what ``failed_beside`` says of each.

    Args:
        found: What it says of each run.
        where: What was executed beside a run, such as ``the fork``.
    """
    return tuple(
        f"{text} in {where} of {amount(count, 'run')}, and not in the run itself: what is said of "
        "that is said of a channel that failed"
        for text, count in sorted(collections.Counter(filter(None, found)).items())
    )


class Counter:
    """Counts runs that are done, and reports each time.

    Attributes:
        done: Runs so far.
    """

    def __init__(self, phase: str, total: int, report: Report | None) -> None:
        """Report that nothing is done yet.

        Args:
            phase: What is being done.
            total: Runs that there are.
            report: Who is told; None for nobody.
        """
        self.done = 0
        self._phase, self._total, self._report = phase, total, report
        self.add(0)

    def add(self, runs: int) -> None:
        """Count more runs."""
        self.done += runs
        if self._report is not None:
            self._report(Progress(self._phase, self.done, self._total, 0))
