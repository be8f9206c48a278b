"""What changed since a baseline: the gate's comparison, and the evidence that became stale."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from adeye.campaign.lookup import planned_as
from adeye.campaign.staleness import find_stale
from adeye.errors import InputError
from adeye.report.baseline import read_baseline
from adeye.report.gating import judge_campaign
from adeye.report.impact import impact_of
from adeye.report.impact_parts import StaleEvidence, StaleFiles
from adeye.report.margins import Tolerances
from adeye.store.location import option

if TYPE_CHECKING:
    from adeye.campaign.staleness import Staleness
    from adeye.report.impact_parts import Impact
    from adeye.store.repository import Repository
    from adeye.store.stored import CampaignInfo

_SHOWN = 12
"""Characters of a digest that a command names."""


def change_since(
    repository: Repository, campaign: CampaignInfo, baseline: Path, db: str | Path | None
) -> Impact:
    """Tell what changed since a baseline, without executing anything.

    Which evidence became stale depends on the files as they are now, which a campaign alone does
    not; the gate's part depends on the database and the baseline only.

    Args:
        repository: The database.
        campaign: The campaign.
        baseline: File that it is compared with.
        db: How commands name the database; None for the default.

    Raises:
        InputError: There is no such baseline, or it is of another ODD.
        IntegrityError: The baseline was edited.
    """
    # First, so that a wrong file is said before every row is verified.
    former = read_baseline(baseline).campaign
    result = judge_campaign(repository, campaign, baseline, Tolerances())
    end = option(db)
    file = shlex.quote(str(baseline))
    return impact_of(
        result,
        former,
        stale_now(repository, campaign),
        (
            f"adeye gate {campaign.id[:_SHOWN]} --baseline {file}{end}",
            lambda run: f"adeye show {run[:_SHOWN]}{end}",
        ),
    )


def stale_now(repository: Repository, campaign: CampaignInfo) -> StaleFiles | str:
    """Tell which evidence still counts under the files as they are, or why that is not known.

    Args:
        repository: The database.
        campaign: The campaign; its ODD is looked for where it was when it ran.
    """
    path = Path(str(campaign.provenance.get("odd_path", "")))
    if not path.is_file():
        return f"The ODD of the campaign is no longer at {path}."
    try:
        plan = planned_as(campaign, path)
    except InputError as error:
        return f"The files cannot be planned as they are now: {error}"
    return _told(find_stale(repository, plan, campaign), path)


def _told(found: Staleness, path: Path) -> StaleFiles:
    return StaleFiles(
        odd=str(path),
        evidence=found.evidence,
        counts=found.counts,
        causes=tuple(
            StaleEvidence(
                cause=item.cause,
                subject=item.subject,
                text=item.text,
                evidence=item.evidence,
                runs=item.runs,
                fsrs=item.fsrs,
                architectures=item.architectures,
            )
            for item in found.stale
        ),
        to_judge=found.to_judge,
        to_replay=found.to_replay,
        to_execute=found.to_execute,
    )
