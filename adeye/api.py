"""The public functions: what the verbs of the command line do, which call the same."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, cast

from adeye.answers import gate_campaign
from adeye.campaign.executor_names import asked_executor
from adeye.campaign.naming import find_called
from adeye.campaign.plan import CampaignPlan, make_plan
from adeye.campaign.replay import Replayed, replay_run
from adeye.campaign.run import Progress, run_campaign
from adeye.errors import UsageError
from adeye.judge.stl.table import JudgedTable, Reading, judge_table, read_table, table_of
from adeye.report.comparison.compare import compare as compare_architectures
from adeye.report.comparison.records import CompareOptions
from adeye.report.gate.changes import Tolerances
from adeye.report.gate.decide import GateOptions
from adeye.reporting import trace_run, write_reports
from adeye.simulate.engine import DEFAULT_BACKEND
from adeye.store.read.export import open_export
from adeye.store.read.query import DEFAULT_ROWS, DEFAULT_SECONDS, run_query
from adeye.store.read.saved import SAVED
from adeye.store.repository import Repository
from adeye.units import MOST_TOLERANCE, shown

if TYPE_CHECKING:
    from collections.abc import Callable

    import pandas as pd

    from adeye.campaign.summary import CampaignSummary
    from adeye.report.comparison.records import Comparison
    from adeye.report.gate.decide import GateResult
    from adeye.report.model.report import Report

__all__ = [
    "CompareOptions",
    "compare",
    "gate",
    "plan",
    "query",
    "replay",
    "report",
    "results",
    "run",
    "stl",
    "trace",
]


_DTYPES: Final = {"text": "string", "number": "Float64", "count": "Int64", "flag": "boolean"}
_MOST_BITS: Final = 63
"""Of whole numbers: more fit neither into the database nor, exactly, into a computation."""


def plan(
    odd: str | Path, *, backend: str = DEFAULT_BACKEND, variant: str | None = None
) -> CampaignPlan:
    """Load an ODD, check everything that can be checked, and count its test cases.

    Args:
        odd: The ODD's file.
        backend: Traffic implementation that would execute it: ``batch`` or ``highway``.
        variant: Arithmetic of it, by default its first: ``reference`` of ``batch``.

    Raises:
        adeye.errors.InputError: Anything is wrong; the message has file, line and column.
    """
    if not isinstance(odd, str | Path):
        raise UsageError(f"{shown(odd)} is no ODD", remedy="Give its file, as text or as a path.")
    _require_texts(variant=variant)
    _require_text("backend", backend)
    return make_plan(odd, backend=backend, variant=variant)


def run(  # noqa: PLR0913 - as the verb
    odd: str | Path | CampaignPlan,
    *,
    db: str | Path | None = None,
    workers: int = 1,
    threads: int = 1,
    executor: str | None = None,
    scheduler: str | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> CampaignSummary:
    """Execute what a plan lacks in the database, judge it and return the verdicts.

    Args:
        odd: The ODD's file, or a plan of it.
        db: Database, by default ``.adeye/adeye.db``.
        workers: Processes; 1 runs in this one.
        threads: Threads over blocks of runs, in this process.
        executor: What executes blocks in place of both: ``dask``, one of an installed package, or
            ``module:Class``.
        scheduler: Address of its scheduler.
        progress: Called after each block of runs.

    Raises:
        adeye.errors.AdeyeError: Its ``exit_code`` tells of what kind.
    """
    _require_texts(executor=executor, scheduler=scheduler)
    if progress is not None and not callable(progress):
        raise UsageError(f"progress is {shown(progress)}", remedy="Give a function, or None.")
    checked = odd if isinstance(odd, CampaignPlan) else plan(odd)
    asked = asked_executor(
        executor,
        None if threads == 1 else threads,
        None if workers == 1 else workers,
        scheduler,
    )
    return run_campaign(
        checked, db=db, workers=workers, threads=threads, executor=asked, progress=progress
    )


def replay(run: str, *, db: str | Path | None = None) -> Replayed:
    """Execute a stored run again and compare every bit of its trace.

    Args:
        run: Beginning of its result digest.
        db: Database, by default ``.adeye/adeye.db``.
    """
    _require_run(run)
    return replay_run(db, run)


def _require_run(run: object) -> None:
    """Refuse what is no beginning of a digest.

    Raises:
        UsageError: It is no text.
    """
    if not isinstance(run, str):
        raise UsageError(
            f"{shown(run)} is no run",
            remedy="Give the beginning of its result digest as text, at least 4 characters.",
        )


def _require_texts(**given: object) -> None:
    """Refuse what is neither text nor None.

    Raises:
        UsageError: Names the argument.
    """
    for name, value in given.items():
        if value is not None:
            _require_text(name, value)


def _require_text(name: str, value: object) -> None:
    if not isinstance(value, str):
        raise UsageError(f"{name} is {shown(value)}", remedy="Give text.")


def _require_by_name(**given: object) -> None:
    """Refuse what is no mapping.

    Raises:
        UsageError: Names the argument.
    """
    for name, value in given.items():
        if not isinstance(value, Mapping):
            raise UsageError(
                f"{name} is {shown(value)}", remedy="Give a mapping by name, such as a dict."
            )


def _require_words(column: str, words: object) -> None:
    """Refuse what is no sequence of texts; a text would be taken letter by letter.

    Raises:
        UsageError: Names the column.
    """
    if isinstance(words, str | bytes) or not isinstance(words, Sequence):
        raise UsageError(
            f"words of {shown(column)} are {shown(words)}", remedy="Give a list of texts."
        )
    for word in words:
        _require_text(f"a word of {shown(column)}", word)


def _name_of(campaign: Any) -> str | None:
    """Write a campaign's number as the text that every verb takes."""
    if campaign is None or isinstance(campaign, str):
        return campaign
    is_number = isinstance(campaign, int) and not isinstance(campaign, bool)
    if not is_number or campaign.bit_length() > _MOST_BITS:
        raise UsageError(
            f"{shown(campaign)} is no campaign",
            remedy="Give its number, or its id or the beginning of it as text.",
        )
    return str(campaign)


def results(campaign: str | int | None = None, *, db: str | Path | None = None) -> pd.DataFrame:
    """Return the runs of a campaign as a typed table, one row a run that has a result.

    Every parameter and the verdict on every FSR has a column. A metric without a value is NA and
    says why in its ``<metric>_status`` column. Units are in ``attrs["units"]``, by column.

    Args:
        campaign: Id, its beginning or its number; None for the newest.
        db: Database, by default ``.adeye/adeye.db``.
    """
    import pandas as pd

    name = _name_of(campaign)
    with open_export(db, name, ["runs"], with_provenance=True) as source:
        columns = source.tables["runs"].columns
        values: list[list[Any]] = [[] for _ in columns]
        for chunk in source.chunks():
            for found, more in zip(values, chunk.columns, strict=True):
                found.extend(more)
    frame = pd.DataFrame(
        {
            column.name: pd.Series(found, dtype=cast("Any", _DTYPES[column.kind]))
            for column, found in zip(columns, values, strict=True)
        }
    )
    frame.attrs["units"] = {column.name: column.unit for column in columns if column.unit}
    return frame


def query(
    sql: str,
    *,
    campaign: str | int | None = None,
    db: str | Path | None = None,
    max_rows: int = DEFAULT_ROWS,
    timeout_s: float = DEFAULT_SECONDS,
) -> pd.DataFrame:
    """Ask the database in SQL; nothing can be changed by it.

    Args:
        sql: One SELECT, or the name of a saved query.
        campaign: What it has as ``:campaign``: id, its beginning or its number; None: it does not
            ask, and saved queries are about the newest.
        db: Database, by default ``.adeye/adeye.db``.
        max_rows: Most rows to return.
        timeout_s: Longest time that it may run [s].

    Raises:
        adeye.errors.InputError: The statement is wrong, not allowed, ran too long, or has more
            rows than ``max_rows``.
    """
    import pandas as pd

    if not isinstance(sql, str):
        raise UsageError(f"{shown(sql)} is no query", remedy="Give SQL as text.")
    name, about = _name_of(campaign), dict[str, str]()
    if name is not None:
        with Repository.open(db, create=False) as repository:
            about["campaign"] = repository.find_campaign(name).id
    saved = SAVED.get(sql)
    if saved is not None:
        sql = saved.about_one().sql if about else saved.sql
    found = run_query(db, sql, parameters=about, max_rows=max_rows, timeout_s=timeout_s)
    if found.is_cut:
        raise UsageError(
            f"the query has more than {max_rows} rows", remedy="Raise max_rows, or ask for fewer."
        )
    return pd.DataFrame(list(found.rows), columns=list(found.columns)).convert_dtypes()


def trace(
    run: str, signals: str | Sequence[str] = (), *, db: str | Path | None = None
) -> pd.DataFrame:
    """Return the signals of a stored run over time, a row a tick.

    A kept trace is read; without one the run is executed again, and has to come out as it was
    stored. Columns are called as in formulas; a column ``<signal>.status`` says why samples are no
    values. Units, words and the horizon are in ``attrs``, by which ``stl`` judges the frame as the
    run was judged.

    Args:
        run: Beginning of its result digest.
        signals: Names, in which ``*`` and ``?`` stand for others; none means every signal.
        db: Database, by default ``.adeye/adeye.db``.

    Raises:
        adeye.errors.AdeyeError: There is no such run or signal, or the trace is another one now.
    """
    _require_run(run)
    patterns = [signals] if isinstance(signals, str) else signals
    _require_texts(**{f"signal {at}": name for at, name in enumerate(patterns, start=1)})
    return trace_run(db, run, patterns).frame()


def gate(
    campaign: str | int | None = None,
    *,
    baseline: str | Path | None = None,
    tolerances: Mapping[str, float] = MappingProxyType({}),
    db: str | Path | None = None,
) -> GateResult:
    """Judge a campaign by its verdicts and against a baseline; nothing is executed.

    Args:
        campaign: An ODD's file or id, or a campaign's id, its beginning or its number; None for
            the newest.
        baseline: File to compare with; None for the verdicts of the campaign alone.
        tolerances: Losses of margin that do not count, by unit or by id of an FSR.
        db: Database, by default ``.adeye/adeye.db``.

    Raises:
        adeye.errors.AdeyeError: There is no such campaign or baseline, or it was edited; or a
            tolerance is none, or there is no baseline that it could be about.
    """
    written: Mapping[Any, Any] = tolerances
    for name, size in written.items():
        is_size = isinstance(size, int | float) and not isinstance(size, bool)
        if not (isinstance(name, str) and is_size and 0.0 <= size <= MOST_TOLERANCE):
            raise UsageError(
                f"the tolerance of {name!r} is no size from 0 to {MOST_TOLERANCE:,}",
                remedy="Give numbers by unit or by id of an FSR, such as {'m': 0.05}.",
            )
    if tolerances and baseline is None:
        raise UsageError("tolerances are about a baseline", remedy="Give baseline=FILE, too.")
    options = GateOptions(
        baseline=None if baseline is None else Path(baseline),
        tolerances=Tolerances.given(tolerances),
    )
    return gate_campaign(db, _name_of(campaign), options)


def report(
    campaign: str | int | None = None,
    *,
    html: str | Path | None = None,
    junit: str | Path | None = None,
    json: str | Path | None = None,
    baseline: str | Path | None = None,
    db: str | Path | None = None,
) -> Report:
    """Build the report of a campaign, and write it in the forms that are asked for.

    Args:
        campaign: Id, its beginning or its number; None for the newest.
        html: Page to write; the runs that it draws are executed again.
        junit: JUnit XML to write.
        json: Machine-readable report to write.
        baseline: File to tell the changes since.
        db: Database, by default ``.adeye/adeye.db``.

    Raises:
        adeye.errors.AdeyeError: There is no such campaign or baseline, or a file cannot be written.
    """
    files = {"html": html, "junit": junit, "json": json, "baseline": baseline}
    paths = {form: Path(file) for form, file in files.items() if file is not None}
    return write_reports(db, _name_of(campaign), **cast("Any", paths))


def compare(
    campaign: str | int | None = None,
    options: CompareOptions | None = None,
    *,
    db: str | Path | None = None,
) -> Comparison:
    """Compare the architectures of a campaign on the test cases that they share.

    Nothing is executed. ``adeye compare --json`` prints the same record.

    Args:
        campaign: An ODD's file or id, or a campaign's id, its beginning or its number; None for
            the newest.
        options: Which architectures, the baseline, the objectives; by default all, every pair.
        db: Database, by default ``.adeye/adeye.db``.

    Raises:
        adeye.errors.InputError: There is no such campaign or architecture, or nothing to compare.
    """
    if not isinstance(options, CompareOptions | None):
        raise UsageError(
            f"options are {shown(options)}", remedy="Give adeye.CompareOptions(…), or None."
        )
    with Repository.open(db, create=False) as repository:
        return compare_architectures(
            repository, find_called(repository, _name_of(campaign)), options
        )


def stl(  # noqa: PLR0913 - as the verb
    formula: str,
    table: str | Path | Mapping[str, Any] | pd.DataFrame,
    *,
    time: str | None = None,
    units: Mapping[str, str] = MappingProxyType({}),
    words: Mapping[str, Sequence[str]] = MappingProxyType({}),
    parameters: Mapping[str, str | float] = MappingProxyType({}),
    horizon: str | None = None,
) -> JudgedTable:
    """Evaluate a formula of signal temporal logic on a table with a column of times.

    Args:
        formula: The formula, over the columns of the table.
        table: File (CSV or Parquet), data frame, or columns by name.
        time: Column of the times; by default ``time``, ``time_s`` or ``t``.
        units: Unit of a column's numbers, by column; without one they are plain numbers.
        words: Words that a column may have, by column; by default those that occur.
        parameters: Values of what the formula names beside columns: text with a unit, or numbers.
        horizon: Time after the first row until which obligations begin; None: to the last row.

    Raises:
        adeye.errors.InputError: The formula, the table or what is told of it cannot be used.
    """
    if not isinstance(formula, str):
        raise UsageError(f"{shown(formula)} is no formula", remedy="Give it as text.")
    _require_by_name(units=units, words=words, parameters=parameters)
    _require_texts(time=time, **{f"unit of {shown(name)}": units[name] for name in units})
    for name, value in parameters.items():
        if isinstance(value, int) and value.bit_length() > _MOST_BITS:
            raise UsageError(f"parameter {shown(name)} is {shown(value)}", remedy="Give another.")
    for name in words:
        _require_words(name, words[name])
    read = read_table(Path(table)) if isinstance(table, str | Path) else table_of(table)
    return judge_table(formula, read, Reading(time, units, words, parameters, horizon))
