"""The public functions: plan, run, replay, results, compare; the command line calls the same."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from adeye.campaign.executor_names import asked_executor
from adeye.campaign.plan import CampaignPlan, make_plan
from adeye.campaign.replay import Replayed, replay_run
from adeye.campaign.run import Progress, run_campaign
from adeye.campaign.summary import find_called
from adeye.errors import UsageError
from adeye.judge.stl.table import JudgedTable, Reading, judge_table, read_table, table_of
from adeye.report.comparison.compare import compare as compare_architectures
from adeye.report.comparison.records import CompareOptions
from adeye.simulate.engine import DEFAULT_BACKEND
from adeye.store.repository import Repository
from adeye.units import shown

if TYPE_CHECKING:
    from collections.abc import Callable

    import pandas as pd

    from adeye.campaign.summary import CampaignSummary
    from adeye.report.comparison.records import Comparison

__all__ = ["CompareOptions", "compare", "plan", "replay", "results", "run", "stl"]


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
    if not isinstance(run, str):
        raise UsageError(
            f"{shown(run)} is no run",
            remedy="Give the beginning of its result digest as text, at least 4 characters.",
        )
    return replay_run(db, run)


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
    """Return the runs of a campaign as a typed table, one row a run.

    Parameters and points are JSON text; a metric without a value is NaN and says why in its
    ``<metric>_status`` column where the view has one.

    Args:
        campaign: Id, its beginning or its number; None for the newest.
        db: Database, by default ``.adeye/adeye.db``.
    """
    import pandas as pd

    with Repository.open(db, create=False) as repository:
        table = repository.results(repository.find_campaign(_name_of(campaign)).id)
    frame = pd.DataFrame(list(table.rows), columns=list(table.columns))
    return frame.convert_dtypes()


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
