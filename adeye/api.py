"""The public functions: plan, run, replay, results, compare; the command line calls the same."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.campaign.plan import CampaignPlan, make_plan
from adeye.campaign.reproduce import Replayed, replay_run
from adeye.campaign.runner import Progress, run_campaign
from adeye.engine import DEFAULT_BACKEND
from adeye.report.compare import compare as compare_architectures
from adeye.report.options import CompareOptions
from adeye.reporting import find_campaign, find_compared
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    import pandas as pd

    from adeye.campaign.summary import CampaignSummary
    from adeye.report.comparison import Comparison

__all__ = ["CompareOptions", "compare", "plan", "replay", "results", "run"]


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
    return make_plan(odd, backend=backend, variant=variant)


def run(
    odd: str | Path | CampaignPlan,
    *,
    db: str | Path | None = None,
    workers: int = 1,
    threads: int = 1,
    progress: Callable[[Progress], None] | None = None,
) -> CampaignSummary:
    """Execute what a plan lacks in the database, judge it and return the verdicts.

    Args:
        odd: The ODD's file, or a plan of it.
        db: Database, by default ``.adeye/adeye.db``.
        workers: Processes; 1 runs in this one.
        threads: Threads over blocks of runs, in this process.
        progress: Called after each block of runs.

    Raises:
        adeye.errors.AdeyeError: Its ``exit_code`` tells of what kind.
    """
    checked = odd if isinstance(odd, CampaignPlan) else plan(odd)
    return run_campaign(checked, db=db, workers=workers, threads=threads, progress=progress)


def replay(run: str, *, db: str | Path | None = None) -> Replayed:
    """Execute a stored run again and compare every bit of its trace.

    Args:
        run: Beginning of its result digest.
        db: Database, by default ``.adeye/adeye.db``.
    """
    return replay_run(db, run)


def results(campaign: str | None = None, *, db: str | Path | None = None) -> pd.DataFrame:
    """Return the runs of a campaign as a typed table, one row a run.

    Parameters and points are JSON text; a metric without a value is NaN and says why in its
    ``<metric>_status`` column where the view has one.

    Args:
        campaign: Id, its beginning or its number; None for the newest.
        db: Database, by default ``.adeye/adeye.db``.
    """
    import pandas as pd

    with Repository.open(db, create=False) as repository:
        table = repository.results(find_campaign(repository, campaign).id)
    frame = pd.DataFrame(list(table.rows), columns=list(table.columns))
    return frame.convert_dtypes()


def compare(
    campaign: str | None = None,
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
    with Repository.open(db, create=False) as repository:
        return compare_architectures(repository, find_compared(repository, campaign), options)
