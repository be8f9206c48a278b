"""Which evidence of a campaign no longer counts under the files as they are now, and why.

Evidence is a run with a verdict of an FSR. It counts as long as the files still ask for that run
and for that FSR: the same result, judged by the same measure, at a place in the plan where the FSR
applies. Nothing is executed, judged or saved.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

from adeye.campaign.plan import judged_with
from adeye.campaign.studies.half_step import pairs_of
from adeye.judge.extremes import measure_of
from adeye.judge.metrics import METRICS
from adeye.judge.outcome import bars
from adeye.judge.requirements import JUDGE_VERSION, CheckedRequirement, measured, reads_odd
from adeye.spec.concept import Concept, Requirement
from adeye.spec.odd import Attributes
from adeye.spec.quantity import SI
from adeye.store.evidence.roots import find_kept, folders_of
from adeye.store.texts import json_text
from adeye.store.write.content import executable_digest
from adeye.store.write.results import CHUNK

if TYPE_CHECKING:
    from collections.abc import Container, Iterator, Mapping, Sequence
    from pathlib import Path

    from adeye.campaign.plan import CampaignPlan
    from adeye.store.block import PlannedCases
    from adeye.store.read.rejudging import Again, StoredEvidence
    from adeye.store.records import CampaignInfo
    from adeye.store.repository import Repository

CAUSES: Final = {
    "withdrawn": "results are withdrawn by {subject}",
    "scenario": "scenario {subject} has changed",
    "parameters": "a default value of scenario {subject} has changed",
    "architecture": "the executable part of architecture {subject} has changed",
    "faults": "fault entry {subject} has changed",
    "seed": "the seed of the ODD has changed",
    "step": "the step of the ODD has changed",
    "plugins": "code or files of a plug-in of architecture {subject} have changed",
    "numerics": "traffic or numerics are of another version: {subject}",
    "not_planned": "the plan no longer has these test cases: {subject}",
    "requirement": "requirement {subject} is measured otherwise",
    "judging": "requirement {subject}: its metric or judging is of another version",
    "attributes": "the attributes of the ODD have changed, on which {subject} depends",
    "uncertainty": "requirement {subject} is judged with another numeric uncertainty, or without",
    "not_asked": "requirement {subject} is no longer asked for there",
}
"""Why evidence no longer counts, in words, by the word of the JSON document."""


@dataclass(frozen=True, slots=True)
class Stale:
    """Evidence that no longer counts for one reason.

    Attributes:
        cause: A word of ``CAUSES``.
        subject: What has changed.
        evidence: Runs with a verdict of an FSR, each pair once.
        runs: The runs among them.
        fsrs: The FSRs among them.
        architectures: The architectures among them.
    """

    cause: str
    subject: str
    evidence: int
    runs: int
    fsrs: tuple[str, ...]
    architectures: tuple[str, ...]

    @property
    def text(self) -> str:
        """For people."""
        return CAUSES[self.cause].format(subject=self.subject)


@dataclass(frozen=True, slots=True)
class Staleness:
    """What of the evidence of a campaign counts under the files as they are now.

    Attributes:
        campaign: Its id.
        number: Its number.
        odd: Id of its ODD.
        evidence: Runs with a verdict of an FSR.
        counts: Of these, the ones that count.
        stale: The others by reason, the most first.
        pairs: For each stale pair of result digest and FSR why it is.
        planned: Pairs that the files ask for now.
        there: Of these, the ones that the database has, and nobody has withdrawn.
        to_judge: Results that judging again can complete, at most.
        to_replay: Results that have to be executed again to be judged.
        to_execute: Test cases, and twins with half the step, without a result.
    """

    campaign: str
    number: int
    odd: str
    evidence: int
    counts: int
    stale: tuple[Stale, ...]
    pairs: Mapping[tuple[str, str], tuple[str, str]]
    planned: int
    there: int
    to_judge: int
    to_replay: int
    to_execute: int

    @property
    def is_complete(self) -> bool:
        """Whether nothing is stale, and all that the files ask for is there."""
        left = self.to_judge + self.to_replay + self.to_execute
        return not self.stale and self.there == self.planned and not left


@dataclass(frozen=True, slots=True)
class _Case:
    """What a test case is made of, by what may change."""

    result: str
    inside: bool
    parts: Mapping[str, str]


_ORDER: Final = (
    "scenario", "parameters", "architecture", "faults", "seed", "step", "plugins", "numerics"
)  # fmt: skip

_Asked = tuple[str, CheckedRequirement]
"""An FSR with the digest of what it is judged by, numeric uncertainty included."""
_Place = tuple[str, str, str, str, int]
"""Scenario, architecture, fault entry, swept values and replicate: where a test case stands."""
_Reason = tuple[str, str]
"""A word of ``CAUSES`` and its subject."""


def find_stale(repository: Repository, plan: CampaignPlan, campaign: CampaignInfo) -> Staleness:
    """Compare the evidence of a campaign with what a plan asks for.

    Args:
        repository: The database.
        plan: Of the files as they are now.
        campaign: Of the same ODD, as a rule.
    """
    now, by_place = _planned(plan)
    entries: dict[str, set[tuple[str, str]]] = defaultdict(set)
    for scenario, architecture, fault_entry, _, _ in by_place:
        entries[scenario].add((architecture, fault_entry))
    requirements = _Requirements(repository, plan, campaign)
    pairs: dict[tuple[str, str], tuple[str, str]] = {}
    withdrawn = {
        item.result_digest: ("withdrawn", f"{item.author}: {item.reason}")
        for item in repository.evidence.withdrawals()
    }
    voided = _voided(plan, withdrawn)
    evidence = 0
    groups: dict[tuple[str, str], list[tuple[str, str, str]]] = defaultdict(list)
    for stored in repository.again.evidence(campaign.id):
        key = stored.scenario, stored.architecture, stored.result
        here = now.get(key)
        why = None if here is not None else _why(stored, by_place, entries)
        why = withdrawn.get(stored.result, why)
        for fsr in stored.fsrs:
            evidence += 1
            reason = why or requirements.why(stored, fsr, voided, is_inside=bool(here))
            if reason is not None:
                # Of two places with one result one may still count, so that the pair does.
                pairs[stored.result, fsr] = reason
                groups[reason].append((stored.result, fsr, stored.architecture))
    stale = [
        Stale(
            cause,
            subject,
            len(items),
            len({result for result, _, _ in items}),
            tuple(sorted({fsr for _, fsr, _ in items})),
            tuple(sorted({name for _, _, name in items})),
        )
        for (cause, subject), items in groups.items()
    ]
    stale.sort(key=lambda item: (-item.evidence, item.cause, item.subject))
    return Staleness(
        campaign=campaign.id,
        number=campaign.number,
        odd=campaign.odd,
        evidence=evidence,
        counts=evidence - sum(item.evidence for item in stale),
        stale=tuple(stale),
        pairs=pairs,
        **_needs(repository.again, plan, now, withdrawn, voided, repository.location.beside),
    )


def _voided(plan: CampaignPlan, withdrawn: Mapping[str, _Reason]) -> dict[tuple[str, str], _Reason]:
    """Find where the numeric uncertainty is unknown for a withdrawn run of its sample, and why."""
    return {
        (sample.architecture, sample.scenario): withdrawn[result]
        for sample in plan.samples
        for pair in pairs_of(plan, sample)
        for result in (pair.result, pair.twin_result)
        if result in withdrawn
    }


def _planned(
    plan: CampaignPlan,
) -> tuple[dict[tuple[str, str, str], bool], dict[_Place, _Case]]:
    """Find the test cases that the files ask for now, by result and by place."""
    results: dict[tuple[str, str, str], bool] = {}
    places: dict[_Place, _Case] = {}
    for part in plan.planned():
        shared = _parts(
            part,
            json_text(part.scenario_content.content),
            json_text(part.architecture_content.content),
            json_text([dict(fault) for fault in part.faults]),
        )
        digests = part.engine.result_digests(part.test_cases)
        for result, parameters, point, replicate, inside in zip(
            digests, part.parameters, part.points, part.replicates, part.inside_odd, strict=True
        ):
            key = part.scenario, part.architecture, result
            results[key] = bool(inside) or results.get(key, False)
            place = part.scenario, part.architecture, part.fault_entry, point, int(replicate)
            places[place] = _Case(result, bool(inside), {**shared, "parameters": parameters})
    return results, places


def _parts(
    of: PlannedCases | StoredEvidence, scenario: str, architecture: str, faults: str
) -> dict[str, str]:
    """List what test cases are made of but their parameters; contents are given as JSON."""
    engine = of.engine
    version = f"{engine.variant}, numerics version {engine.numerics_version}"
    return {
        "scenario": _executed("scenario", scenario),
        "architecture": _executed("architecture", architecture),
        "faults": _executed("faults", faults),
        "seed": str(of.seed),
        "step": repr(float(of.step_s)),
        "plugins": engine.plugins_digest,
        "numerics": f"{engine.backend} {version}",
    }


_executed = lru_cache(maxsize=512)(executable_digest)


def _why(
    stored: StoredEvidence,
    places: Mapping[_Place, _Case],
    entries: Mapping[str, set[tuple[str, str]]],
) -> tuple[str, str]:
    """Say why a result is no longer asked for."""
    where = (stored.scenario, stored.architecture, stored.fault_entry)
    here = places.get((*where, stored.point, stored.replicate))
    if here is None:
        return "not_planned", _gone(stored, entries)
    contents = stored.scenario_content, stored.architecture_content, stored.faults
    parts = {**_parts(stored, *contents), "parameters": stored.parameters}
    for cause in _ORDER:
        if parts[cause] != here.parts[cause]:
            subjects = {
                "scenario": stored.scenario,
                "parameters": stored.scenario,
                "architecture": stored.architecture,
                "faults": stored.fault_entry,
                "plugins": stored.architecture,
                "numerics": here.parts[cause],
            }
            return cause, subjects.get(cause, "")
    # Two places of the plan may share what tells them apart; which one it was is not known.
    return "not_planned", f"scenario {stored.scenario}"


def _gone(stored: StoredEvidence, entries: Mapping[str, set[tuple[str, str]]]) -> str:
    """Name the first thing of a place in the plan that is not planned any more."""
    if stored.scenario not in entries:
        return f"scenario {stored.scenario} is not used"
    if all(stored.architecture != name for of in entries.values() for name, _ in of):
        return f"architecture {stored.architecture} is not compared"
    if all(stored.fault_entry != entry for _, entry in entries[stored.scenario]):
        return f"fault entry {stored.fault_entry} of scenario {stored.scenario}"
    return f"points of scenario {stored.scenario}"


class _Requirements:
    """Compares the FSRs of a campaign with those of a plan."""

    def __init__(self, repository: Repository, plan: CampaignPlan, campaign: CampaignInfo) -> None:
        concept = repository.content("concept", campaign.concept_digest)
        stored = Concept.model_validate(concept, context=SI).requirements
        odd = repository.content("odd", campaign.odd_digest)["odd"]
        self._before: dict[str, Requirement] = {item.id: item for item in stored}
        self._digests = repository.again.fsr_digests(campaign.id)
        self._now: dict[str, CheckedRequirement] = {
            item.requirement.id: item for item in plan.requirements
        }
        before = Attributes.model_validate(odd["attributes"], context=SI)
        self._judged = {
            item.requirement.id: judged_with(item, plan.samples) for item in plan.requirements
        }
        self._has_same_attributes = before == plan.files.odd.spec.attributes

    def why(
        self,
        stored: StoredEvidence,
        fsr: str,
        voided: Mapping[tuple[str, str], _Reason],
        *,
        is_inside: bool,
    ) -> _Reason | None:
        """Say why a verdict on a run that is still asked for does not count; None if it does."""
        now = self._now.get(fsr)
        place = stored.architecture, stored.scenario
        if now is None or stored.architecture in now.not_applicable:
            return "not_asked", fsr
        if now.digest != self._digests[fsr]:
            if measured(now.requirement) != measured(self._before[fsr]):
                return "requirement", fsr
            if not self._has_same_attributes and reads_odd(now.requirement):
                return "attributes", fsr
            return "judging", fsr
        if not now.concerns(stored.scenario, is_inside=is_inside):
            return "attributes", fsr
        is_same = stored.fsrs[fsr] == self._judged[fsr].get(place, now.digest)
        void = voided.get(place) if place in self._judged[fsr] else None
        return void if is_same else ("uncertainty", fsr)


def _needs(
    again: Again,
    plan: CampaignPlan,
    now: Mapping[tuple[str, str, str], bool],
    withdrawn: Container[str],
    voided: Container[tuple[str, str]],
    database: Path,
) -> dict[str, Any]:
    """Count what the files ask for, what is there, and what would bring the rest."""
    groups: dict[tuple[str, str, bool], list[str]] = defaultdict(list)
    for (scenario, architecture, result), inside in now.items():
        groups[scenario, architecture, inside].append(result)
    names = ("planned", "there", "to_judge", "to_replay", "to_execute")
    count: Counter[str] = Counter(dict.fromkeys(names, 0))
    twins = [pair.twin_result for sample in plan.samples for pair in pairs_of(plan, sample)]
    count["to_execute"] = len(twins) - len(again.numbers(twins))
    judged = {item.digest: judged_with(item, plan.samples) for item in plan.requirements}
    for (scenario, architecture, inside), results in groups.items():
        asked = [
            (judged[item.digest].get((architecture, scenario), item.digest), item)
            for item in plan.requirements
            if architecture not in item.not_applicable and item.concerns(scenario, is_inside=inside)
        ]
        count["planned"] += len(asked) * len(results)
        if (architecture, scenario) in voided:
            # Nor is one that rests on a withdrawn twin.
            at = architecture, scenario
            asked = [(digest, item) for digest, item in asked if at not in judged[item.digest]]
        for first in range(0, len(results), CHUNK):
            part = results[first : first + CHUNK]
            numbers = again.numbers(part)
            count["to_execute"] += len(part) - len(numbers)
            # A verdict on a withdrawn result is there no more, and nothing here brings it back.
            counting = [number for item, number in numbers.items() if item not in withdrawn]
            count.update(_judgeable(again, asked, counting, database))
    return dict(count)


def _judgeable(
    again: Again, asked: Sequence[_Asked], numbers: Sequence[int], database: Path
) -> Iterator[str]:
    """Tell of each run what it has, and what its missing verdicts take."""
    judged = again.judged(numbers)
    missing = {
        number: [item for of, item in asked if of not in judged.get(number, ())]
        for number in numbers
    }
    yield from ("there" for items in missing.values() for _ in range(len(asked) - len(items)))
    lacking = [number for number, items in missing.items() if items]
    bases = again.bases(lacking, JUDGE_VERSION)
    measures = {
        item.digest: {*again.extremes(lacking, measure.text, JUDGE_VERSION)}
        for _, item in asked
        if (measure := measure_of(item.formula)) is not None
    }
    folders = folders_of(database)
    kept = {
        number for number, name, _ in again.files(lacking) if find_kept(folders, name) is not None
    }

    def is_known(number: int, item: CheckedRequirement) -> bool:
        # What lacks the uncertainty alone is judged from the verdict without it.
        if item.digest in judged.get(number, ()):
            return True
        if number not in bases:
            return False
        if bars(bases[number][1]):
            return True
        if item.bound is not None:
            name = item.bound.column
            return bases[number][2].get(name) == METRICS[name].uid
        return number in measures.get(item.digest, ())

    for number in lacking:
        enough = number in kept or all(is_known(number, item) for item in missing[number])
        yield "to_judge" if enough else "to_replay"
