"""What a report tells of a campaign beyond its verdicts, read from the database."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.report.assessment_parts import Assessment
from adeye.report.avoidable import preventability_of
from adeye.report.stops import safe_stops_of
from adeye.report.timing import timing_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from adeye.spec.concept import Concept
    from adeye.store.figures import Figures
    from adeye.store.repository import Repository
    from adeye.store.stored import CampaignInfo


def assessment_of(
    repository: Repository,
    campaign: CampaignInfo,
    concept: Concept,
    figures: Figures,
    commands: tuple[Callable[[str], str], Callable[[str], str]],
) -> Assessment:
    """Put together preventability, timing and safe stops.

    Args:
        repository: The database.
        campaign: The campaign.
        concept: That judged it.
        figures: Its executed runs.
        commands: Complete a command line, and reproduce a run.
    """
    complete, replay = commands
    known, short = repository.hindsight, campaign.id[:10]
    budgeted = [item.id for item in concept.requirements if item.fdti or item.frti]
    exercised = known.exercised(campaign.id, budgeted)
    return Assessment(
        preventability=preventability_of(
            known.benchmarks.comparisons(campaign.id),
            (len(figures), known.benchmarks.open_contacts(campaign.id)),
            (complete(f"adeye preventability {short}"), replay),
        ),
        timing=timing_of(
            concept,
            figures,
            (known.injections(campaign.id), exercised),
            (complete(f"adeye faults {short} --sample 0"), replay),
        ),
        safe_stops=safe_stops_of(
            figures,
            lambda ordinal: repository.find_run(str(ordinal), campaign=campaign.id).result_digest,
            replay,
        ),
    )
