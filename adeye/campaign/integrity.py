"""Check a concept and its evidence: an ODD with what is stored of it, or a stored campaign."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from itertools import chain
from typing import TYPE_CHECKING, Any, Final

from adeye.campaign.plan import CampaignPlan, make_plan
from adeye.errors import SourceLocation, SpecError
from adeye.store.read import checking
from adeye.store.read.bulk import coverage_of_runs, executed_runs
from adeye.store.records import of_fields
from adeye.store.repository import Repository
from adeye.store.rules import PLACEHOLDER, RULES
from adeye.sweep.coverage import Coverage, Situations, bins_of, coverage_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from adeye.spec.load import Loaded, OddFiles
    from adeye.sweep.expand import Expansion

# --- Check a concept and its evidence: an ODD with what is stored of it, or a stored campaign -----

_KEYS: Final[Mapping[str, str]] = {
    "hazard_asil": "severity",
    "asil_lost": "asil",
    "fsr_without_allocation": "allocation",
    "element_capability": "allocation",
    "threshold_without_source": "threshold_source",
    "fsr_without_scenario": "scenarios",
    "hazard_without_scenario": "scenarios",
    "illegal_decomposition": "into",
    "decomposition_elements": "into",
    "common_cause": "into",
    "independence_argument": "independence",
    "independence_unknown": "resources",
    "expired_dfa": "valid_until",
    "expired_assumption": "valid_until",
    "expired_waiver": "expires",
    "fhti_budget": "fdti",
    "response_beyond_budget": "formula",
    "idle_fault": "model",
    "emergency_operation": "emergency_operation_interval",
}
"""Key of what breaks a rule that has to be looked at."""

_LISTS: Final[Mapping[str, tuple[str, str]]] = {
    "scenario": ("scenarios", "name"),
    "fault": ("faults", "id"),
    "hazardous_event": ("hazardous_events", "id"),
    "safety_goal": ("safety_goals", "id"),
    "fsr": ("requirements", "id"),
    "element": ("elements", "id"),
    "assumption": ("assumptions", "id"),
    "waiver": ("waivers", "requirement"),
    "decomposition": ("decompositions", "requirement"),
    "dependent_failure": ("dependent_failures", "id"),
}
"""List of an ODD or a concept that has a kind of part, and what its parts are called by."""

_STALE: Final = "stale_evidence"


def check_stored(db: str | Path | None, name: str | None = None) -> checking.Checked | None:
    """Check a stored campaign, the newest unless named.

    Returns:
        None where there is nothing to check.

    Raises:
        InputError: There is no campaign of the name.
        IntegrityError: Its evidence is not as it was written.
        PlatformError: The database cannot be read.
    """
    stored = checking.check_campaign(db, name, must_be_sound=True)
    if stored is None:
        return None
    return checking.Checked(stored.campaign.odd, None, stored.campaign, RULES, stored.violations)


def check_odd(path: str | Path, db: str | Path | None = None) -> checking.Checked:
    """Check an ODD with its concept, and the newest evidence of it that a database holds.

    Args:
        path: The ODD's file.
        db: The database; without one only the files are checked.

    Raises:
        InputError: A file does not say what it must; the message has its line.
        IntegrityError: The evidence is not as it was written.
        PlatformError: The database cannot be read.
    """
    plan = make_plan(path)
    record = plan.record()
    found = [
        *checking.check_plan(record, _counted(plan)),
        *checking.idle_violations(plan.faults, plan.injected),
    ]
    odd = plan.files.odd.spec.odd
    stored = checking.check_campaign(db, odd=odd, rules=checking.EVIDENCE_RULES, must_be_sound=True)
    if stored is not None:
        found += stored.violations
        results = (part.engine.result_digests(part.test_cases) for part in plan.planned())
        unknown, planned = checking.count_unknown(db, stored.campaign.id, results)
        if unknown:
            text = f"{unknown:,} of {planned:,} test cases that it asks for now have no result"
            found.append(checking.Violation(_STALE, "odd", odd, text))
        for item in record.fsrs:
            if stored.fsr_digests.get(item.id) != item.digest:
                # The newest evidence is judged by another FSR than that of the files.
                known = "judges otherwise than" if item.id in stored.fsr_digests else "is not in"
                text = f"{known} campaign {stored.campaign.number}"
                found.append(checking.Violation(_STALE, "fsr", item.id, text))
    order = [rule.name for rule in RULES]
    found.sort(key=lambda item: order.index(item.rule))
    findings = tuple(replace(item, where=_where(item, plan.files)) for item in found)
    if stored is None:
        return checking.Checked(odd, plan.path, None, checking.PLAN_RULES, findings)
    return checking.Checked(odd, plan.path, stored.campaign, RULES, findings)


def _counted(plan: CampaignPlan) -> Counter[tuple[str, str, bool]]:
    counted: Counter[tuple[str, str, bool]] = Counter()
    for part in plan.planned():
        for inside, count in Counter(map(bool, part.inside_odd)).items():
            counted[part.architecture, part.scenario, inside] += count
    return counted


def _where(item: checking.Violation, files: OddFiles) -> SourceLocation | None:
    if item.part == "odd":
        return files.odd.locate(("odd",))
    if item.part == "architecture":
        known = files.architectures.get(item.id)
        return None if known is None else known.locate(("architecture",))
    list_, id_ = _LISTS[item.part]
    of_odd = item.part in {"scenario", "fault"}
    loaded: Loaded[Any] = files.odd if of_odd else files.concept
    names = [getattr(part, id_) for part in getattr(loaded.spec, list_)]
    if item.id not in names:
        return None
    told = item.detail.split()[0] if item.rule == PLACEHOLDER.name else "id"
    key = () if item.part == "scenario" else (_KEYS.get(item.rule, told),)
    return loaded.locate((list_, names.index(item.id), *key))


# --- What the plan of an ODD covers of it, and what the runs of a campaign do ---------------------

_CHUNK: Final = 65_536
"""Test cases that are looked at together."""


@dataclass(frozen=True)
class CoverageTable:
    """What is covered, and of what.

    Attributes:
        odd: Id of the ODD.
        campaign: Id of the campaign; None for a plan.
        planned: Test cases.
        counted: Those that count: planned inside the ODD, and of a campaign with a result.
        outside_odd: Those whose planned attributes lie outside the ODD.
        without_result: Planned ones that were not executed; none of a plan.
        not_judged: Runs in which the scenario did not come about, or that could not be executed.
        coverage: The combinations.
    """

    odd: str
    campaign: str | None
    planned: int
    counted: int
    outside_odd: int
    without_result: int
    not_judged: int
    coverage: Coverage


def planned_coverage(path: Path, strength: int) -> CoverageTable:
    """Count what the test cases of an ODD would cover. Nothing is executed.

    Args:
        path: The ODD's file.
        strength: Most attributes that are combined.

    Raises:
        InputError: Anything is wrong with the ODD.
    """
    plan = make_plan(path)
    odd = plan.files.odd.spec
    for name, own in bins_of(odd.attributes, odd.coverage).items():
        if not own:
            raise SpecError(
                f"coverage.{name}: no bin lies within the attributes of the ODD",
                where=plan.files.odd.locate(("coverage", name)),
                remedy="Give edges on both sides of its limit.",
            )
    written = (Situations(item.spec, {}, 0) for item in plan.files.scenarios.values())
    situations = chain(_planned(plan.expansion), written)
    found = coverage_of(odd.attributes, odd.coverage, strength, situations)
    count = plan.expansion.count
    outside = count - found.situations
    return CoverageTable(odd.odd, None, count, found.situations, outside, 0, 0, found)


def executed_coverage(db: str | Path | None, campaign: str | None, strength: int) -> CoverageTable:
    """Count what the runs of a campaign that have a result cover of its ODD.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        campaign: Number or id; None for the newest.
        strength: Most attributes that are combined.

    Raises:
        InputError: There is no such campaign.
        IntegrityError: Results are not as they were written.
    """
    with Repository.open(db, create=False) as repository:
        info = repository.find_campaign(campaign)
        repository.require_sound(info.id, has_figures=False)
        stored = repository.content("odd", info.odd_digest)
        runs = executed_runs(repository.location, info.id)
    found = coverage_of_runs(runs, stored, strength)
    counted = found.situations
    return of_fields(
        CoverageTable, runs, odd=info.odd, campaign=info.id, counted=counted, coverage=found
    )


def _planned(expansion: Expansion) -> Iterator[Situations]:
    for part in expansion.columns(size=_CHUNK):
        rows = part.points[part.is_inside[part.points]]
        columns: dict[str, Any] = dict(part.shared.parameters)
        for axis in part.section.group.axes:
            if axis.kind == "parameter":
                columns[axis.name] = part.section.group.points.column(axis.name, part.rows[rows])
        yield Situations(part.shared.scenario, columns, len(rows))
