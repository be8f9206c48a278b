"""What a campaign came to, read from the database."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from adeye.errors import amount
from adeye.judge.verdict import ExitCode, Verdict, exercised_of
from adeye.store.read.totals import ChannelFailure, Total, channel_failures, gate_code, totals
from adeye.store.records import of_fields

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.campaign.plan import CampaignPlan
    from adeye.store.records import CampaignInfo, Plan
    from adeye.store.repository import Repository


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
        min_exercised: Runs that must PASS.
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
    min_exercised: int = 1

    @property
    def exercised_text(self) -> str:
        """Of how many runs, or of how many that are needed, it was exercised."""
        return exercised_of(self.verdict, self.exercised, self.runs, self.min_exercised)


@dataclass(frozen=True, slots=True)
class CampaignSummary:
    """What came out of a campaign.

    Attributes:
        campaign: Its id.
        planned: Test cases.
        executed: Executed now, here.
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
        channel_failures: How channels failed, also where that is mastered.
        contacts: Runs that a contact ended, by architecture.
        elsewhere: Test cases that other runners executed meanwhile.
        never_began: Storyboard events that need not begin, and did in no run.
        idle_events: Storyboard events that changed nothing in each run in which they began.
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
    channel_failures: tuple[ChannelFailure, ...] = ()
    contacts: Mapping[str, int] = field(default_factory=dict)
    never_began: tuple[str, ...] = ()
    idle_events: tuple[str, ...] = ()
    elsewhere: int = 0

    def __repr__(self) -> str:
        """Name the campaign, and what came out."""
        done = f"{self.executed:,} executed and {self.reused:,} reused of {self.planned:,}"
        touching = sum(self.contacts.values())
        also = f", contact in {amount(touching, 'run')}" if touching else ""
        return f"<CampaignSummary {self.campaign[:10]}: {done}, {self.exit_code.name}{also}>"

    def __bool__(self) -> bool:
        """Be as true as the gate, so that asserting what a run came to asserts something."""
        return self.exit_code == ExitCode.OK


def summarise(
    repository: Repository, campaign: CampaignInfo, plan: CampaignPlan, stored: Plan
) -> CampaignSummary:
    """Read what a campaign came to from the database."""
    code, message = gate_code(repository, campaign, has_old=stored.reused > 0)
    texts = {item.id: item.text.strip() for item in plan.files.concept.spec.requirements}
    fsrs, architectures = list(texts), list(plan.files.architectures)

    def place(item: Total) -> tuple[int, int]:
        """Return where ODD and concept list what a verdict is about."""
        return architectures.index(item.architecture), fsrs.index(item.fsr)

    lines = [
        of_fields(
            VerdictLine,
            item,
            is_gate=item.is_in_gate,
            mandatory=item.is_mandatory,
            margin=item.worst[1].margin if item.worst else None,
            unit=(item.worst[1].unit or "") if item.worst else "",
            worst_run=item.worst[0].result_digest if item.worst else "",
            text=texts[item.fsr],
        )
        for item in sorted(totals(repository, campaign), key=place)
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
        channel_failures=channel_failures(repository, campaign),
        contacts=repository.contacts(campaign.id),
        never_began=tuple(
            f"{event} of {scenario}"
            for scenario, event, _ in repository.unbegun_events(campaign.id)
        ),
        idle_events=tuple(
            f"{event} of {scenario}" for scenario, event in repository.idle_events(campaign.id)
        ),
    )
