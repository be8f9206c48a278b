"""What a campaign came to, read from the database."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from adeye.store.totals import gate_code, totals

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.campaign.plan import CampaignPlan
    from adeye.evaluation.verdict import ExitCode, Verdict
    from adeye.store.repository import Repository
    from adeye.store.stored import CampaignInfo, Plan


@dataclass(frozen=True, slots=True)
class VerdictLine:
    """The verdict of one FSR for one architecture.

    Attributes:
        architecture: Id.
        is_gate: Whether the architecture decides the exit code.
        fsr: Id.
        asil: ASIL of the FSR.
        mandatory: Whether the gate needs it.
        verdict: Folded over all runs; None where the FSR is not applicable.
        exercised: Runs in which its precondition held.
        runs: Runs planned.
        margin: Of the worst run, in ``unit``.
        unit: Of the margin.
        worst_run: Result digest of the worst run.
        text: Text of the requirement.
    """

    architecture: str
    is_gate: bool
    fsr: str
    asil: str
    mandatory: bool
    verdict: Verdict | None
    exercised: int
    runs: int
    margin: float | None
    unit: str
    worst_run: str
    text: str


@dataclass(frozen=True, slots=True)
class CampaignSummary:
    """What came out of a campaign.

    Attributes:
        campaign: Its id.
        planned: Test cases.
        executed: Executed now.
        judged: Results that existed and were judged again now.
        reused: Results that existed.
        exit_code: Of the gate.
        message: Why.
        verdicts: One line per FSR and architecture.
        replayed: Of the results that were judged again, those that were executed for it.
        ways: The others by what told a verdict of theirs, see ``rejudging.WAYS``.
        to_replay: Results that have to be executed again to be judged, and were not.
        to_execute: Test cases without a result.
        twins: Twins with half the step that were executed now.
        selected: Test cases that were to be executed if they lacked a result; None for all.
        never_began: Storyboard events that need not begin, and did in no run.
    """

    campaign: str
    planned: int
    executed: int
    judged: int
    reused: int
    exit_code: ExitCode
    message: str
    verdicts: tuple[VerdictLine, ...]
    replayed: int = 0
    ways: Mapping[str, int] = field(default_factory=dict)
    to_replay: int = 0
    to_execute: int = 0
    twins: int = 0
    selected: int | None = None
    never_began: tuple[str, ...] = ()


def failed_channels(repository: Repository, campaign: str) -> str:
    """Say in how many runs which channel failed; empty if none did.

    A mastered failure of a channel can PASS, but it never goes unmentioned.

    Args:
        repository: The database.
        campaign: Id of the campaign.
    """
    return "; ".join(
        f"{outcome} of channel {channel} in {count:,} runs of {architecture}"
        for architecture, channel, outcome, count in repository.failed_channels(campaign)
    )


def summarise(
    repository: Repository, campaign: CampaignInfo, plan: CampaignPlan, stored: Plan
) -> CampaignSummary:
    """Read what a campaign came to from the database."""
    code, message = gate_code(repository, campaign)
    texts = {item.id: item.text.strip() for item in plan.files.concept.spec.requirements}
    lines = [
        VerdictLine(
            architecture=item.architecture,
            is_gate=item.is_in_gate,
            fsr=item.fsr,
            asil=item.asil,
            mandatory=item.is_mandatory,
            verdict=item.verdict,
            exercised=item.exercised,
            runs=item.runs,
            margin=item.worst[1].margin if item.worst else None,
            unit=(item.worst[1].unit or "") if item.worst else "",
            worst_run=item.worst[0].result_digest if item.worst else "",
            text=texts[item.fsr],
        )
        for item in totals(repository, campaign)
    ]
    return CampaignSummary(
        campaign=campaign.id,
        planned=stored.planned,
        executed=repository.progress(campaign.id).executed - stored.reused,
        judged=stored.to_judge,
        reused=stored.reused,
        exit_code=code,
        message=message,
        verdicts=tuple(lines),
        never_began=tuple(
            f"{event} of {scenario}"
            for scenario, event, _ in repository.unbegun_events(campaign.id)
        ),
    )
