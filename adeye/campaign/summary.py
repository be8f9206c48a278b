"""Which campaign is meant: by an ODD's file or id, a number or a digest, and what was edited."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from adeye.campaign.plan import CampaignPlan, make_plan
from adeye.errors import UsageError
from adeye.judge.verdict import ExitCode, Verdict, exercised_of
from adeye.spec.load import load_odd
from adeye.store.read.campaigns import LATEST
from adeye.store.read.totals import ChannelFailure, Total, channel_failures, gate_code, totals
from adeye.store.records import of_fields
from adeye.store.write.planning import identify

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from adeye.store.records import CampaignInfo, Plan
    from adeye.store.repository import Repository

# --- Which campaign is meant: by an ODD's file or id, a number or a digest, and what was edited ---

_WORDS: Final = {"plugins": "plug-ins", "scenarios": "scenarios and sweeps"}
"""Keys of an ODD that people call otherwise."""


@dataclass(frozen=True)
class Meant:
    """The campaign that a file means.

    Attributes:
        campaign: The campaign.
        edits: Why it is not what the file plans now; empty if it is.
    """

    campaign: CampaignInfo
    edits: str = ""


def is_file_name(name: str) -> bool:
    """Tell whether a name is that of an ODD's file.

    >>> is_file_name("odd/first.yaml"), is_file_name("first")
    (True, False)
    """
    return Path(name).suffix in {".yaml", ".yml"}


def is_campaign_name(text: str) -> bool:
    """Tell whether a word can be the number or digest of a campaign, or its place in time.

    >>> is_campaign_name("3"), is_campaign_name("3f2a91"), is_campaign_name("@{-1}")
    (True, True, True)
    >>> is_campaign_name("camera_radar")
    False
    """
    is_number = text.isascii() and text.isdecimal()
    return (
        is_number
        or text == LATEST
        or text.startswith("@{-")
        or (len(text) >= 4 and set(text) <= set("0123456789abcdef"))
    )


def campaign_called(repository: Repository, name: str) -> CampaignInfo | None:
    """Find a campaign by its ODD, number or digest; None for a word that can be none of them.

    Raises:
        InputError: The ODD's file is wrong, has no campaign, or was edited since: what is told of
            the old one would be taken for what the file asks for.
    """
    if is_file_name(name):
        meant = campaign_of_file(repository, name)
        if meant.edits:
            number = meant.campaign.number
            raise UsageError(
                f"{name} plans something else than campaign {number}; edited: {meant.edits}",
                remedy=f"Run adeye run {name} first, or name campaign {number}, not the file.",
            )
        return meant.campaign
    of_odd = repository.latest_campaign(name)
    if of_odd is None and is_campaign_name(name):
        return repository.find_campaign(name)
    return of_odd


def find_called(
    repository: Repository, name: str | None, *, may_be_edited: bool = False
) -> CampaignInfo:
    """Find a campaign by its ODD's file or id, its number or digest, or the latest.

    Args:
        repository: The database.
        name: What it is called.
        may_be_edited: Whether the file need not plan what it has planned: the latest campaign of
            its ODD is meant then.

    Raises:
        InputError: There is none, or it is not what the file plans.
    """
    if may_be_edited and name is not None and is_file_name(name):
        return _latest_of_file(repository, name)
    found = None if name is None else campaign_called(repository, name)
    return repository.find_campaign(name) if found is None else found


def planned_as(campaign: CampaignInfo, path: str | Path) -> CampaignPlan:
    """Plan an ODD's file as it is now, with the traffic that a campaign was planned with.

    Raises:
        InputError: Anything is wrong in the files.
    """
    made = {name: campaign.provenance.get(name) for name in ("backend", "variant")}
    given: dict[str, Any] = {name: str(value) for name, value in made.items() if value}
    return make_plan(path, **given)


def _latest_of_file(repository: Repository, path: str | Path) -> CampaignInfo:
    latest = repository.latest_campaign(load_odd(path).odd.spec.odd)
    if latest is None:
        repository.require_no_campaign_gone()
        raise UsageError(
            f"{path} has no campaign in the database", remedy=f"Run adeye run {path} first."
        )
    return latest


def campaign_of_file(repository: Repository, path: str | Path) -> Meant:
    """Find the campaign that an ODD's file plans, by the traffic that its latest campaign has.

    Args:
        repository: The database.
        path: The ODD's file.

    Returns:
        The latest campaign of the ODD, and what was edited, if none is what the file plans.

    Raises:
        InputError: Anything is wrong in the files, or the ODD has no campaign.
    """
    latest = _latest_of_file(repository, path)
    plan = planned_as(latest, path)
    record = plan.record()
    wanted = identify(record, plan.planned())
    for campaign in (latest, *repository.campaigns()):
        if campaign.id == wanted:
            return Meant(campaign)
    concept = record.concept.model_dump(mode="json")
    then = repository.content("odd", latest.odd_digest)
    before = repository.content("concept", latest.concept_digest)
    edits = [*_odd_edits(then, record.odd.content), *_concept_edits(before, concept)]
    if not edits and len(plan.cases) != latest.planned:
        edits = [
            f"a map, of which {len(plan.cases):,} test cases are planned for {latest.planned:,}"
        ]
    return Meant(latest, "; ".join(edits) or "the code of adeye or of a plug-in")


def _odd_edits(then: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    for key in _edited(then["odd"], now["odd"]):
        yield _WORDS.get(key, key)
    for kind in ("scenarios", "architectures", "data"):
        edited = _edited(then.get(kind, {}), now.get(kind, {}))
        if edited:
            yield f"{kind} {', '.join(edited)}"


def _concept_edits(then: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    fsrs = [{item["id"]: item for item in side["requirements"]} for side in (then, now)]
    edited = _edited(*fsrs)
    if edited:
        yield f"requirements {', '.join(edited)}"
    others = {key for key in {*then, *now} - {"requirements"} if then.get(key) != now.get(key)}
    if others:
        yield f"concept ({', '.join(sorted(others))})"


def _edited(then: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    return sorted(name for name in {*then, *now} if then.get(name) != now.get(name))


# --- What a campaign came to, read from the database ----------------------------------------------


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
    elsewhere: int = 0

    def __repr__(self) -> str:
        """Name the campaign, and what came out."""
        done = f"{self.executed:,} executed and {self.reused:,} reused of {self.planned:,}"
        return f"<CampaignSummary {self.campaign[:10]}: {done}, {self.exit_code.name}>"

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
    )
