"""Check a concept and its evidence: an ODD with what is stored of it, or a stored campaign."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Final

from adeye.store.check_views import RULES
from adeye.store.checking import (
    EVIDENCE_RULES,
    PLAN_RULES,
    Checked,
    CheckFinding,
    Violation,
    check_campaign,
    check_plan,
    count_unknown,
    idle_violations,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from adeye.campaign.plan import CampaignPlan
    from adeye.errors import SourceLocation
    from adeye.spec.concept import Concept
    from adeye.spec.load import OddFiles
    from adeye.spec.misplaced import Loc
    from adeye.store.checking import CampaignViolations

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

_STALE: Final = "stale_evidence"


def check_stored(db: str | Path | None, name: str | None = None) -> Checked | None:
    """Check a stored campaign, the newest unless named.

    Returns:
        None where there is nothing to check.

    Raises:
        InputError: There is no campaign of the name.
        PlatformError: The database cannot be read.
    """
    stored = check_campaign(db, name)
    if stored is None:
        return None
    findings = tuple(_placed(item, None) for item in stored.violations)
    return Checked(stored.campaign.odd, None, stored.campaign, RULES, findings)


def check_odd(path: str | Path, db: str | Path | None = None) -> Checked:
    """Check an ODD with its concept, and the newest evidence of it that a database holds.

    Args:
        path: The ODD's file.
        db: The database; without one only the files are checked.

    Raises:
        InputError: A file does not say what it must; the message has its line.
        PlatformError: The database cannot be read.
    """
    # What is stored is checked without what simulates.
    from adeye.campaign.plan import make_plan

    plan = make_plan(path)
    record = plan.record()
    found = [*check_plan(record, _counted(plan)), *idle_violations(plan.faults, plan.injected)]
    odd = plan.files.odd.spec.odd
    stored = check_campaign(db, odd=odd, rules=EVIDENCE_RULES)
    if stored is not None:
        found += stored.violations
        results = (part.engine.result_digests(part.test_cases) for part in plan.planned())
        unknown, planned = count_unknown(db, stored.campaign.id, results)
        if unknown:
            text = f"{unknown:,} of {planned:,} test cases that it asks for now have no result"
            found.append(Violation(_STALE, "odd", odd, text))
        found += _stale(stored, {item.id: item.digest for item in record.fsrs})
    order = [rule.name for rule in RULES]
    found.sort(key=lambda item: order.index(item.rule))
    findings = tuple(_placed(item, plan.files) for item in found)
    if stored is None:
        return Checked(odd, plan.path, None, PLAN_RULES, findings)
    return Checked(odd, plan.path, stored.campaign, RULES, findings)


def _counted(plan: CampaignPlan) -> Counter[tuple[str, str, bool]]:
    counted: Counter[tuple[str, str, bool]] = Counter()
    for part in plan.planned():
        for inside, count in Counter(map(bool, part.inside_odd)).items():
            counted[part.architecture, part.scenario, inside] += count
    return counted


def _stale(stored: CampaignViolations, digests: Mapping[str, str]) -> Iterator[Violation]:
    """Say which FSRs of the files are not those by which the newest evidence is judged."""
    for name, digest in digests.items():
        if stored.fsr_digests.get(name) != digest:
            known = "judges otherwise than" if name in stored.fsr_digests else "is not in"
            yield Violation(_STALE, "fsr", name, f"{known} campaign {stored.campaign.number}")


def _placed(item: Violation, files: OddFiles | None) -> CheckFinding:
    where = None if files is None else _where(item, files)
    return CheckFinding(item.rule, item.part, item.id, item.detail, where)


def _where(item: Violation, files: OddFiles) -> SourceLocation | None:
    if item.part == "odd":
        return files.odd.locate(("odd",))
    if item.part == "scenario":
        names = [use.name for use in files.odd.spec.scenarios]
        at = names.index(item.id) if item.id in names else None
        return None if at is None else files.odd.locate(("scenarios", at))
    if item.part == "architecture":
        known = files.architectures.get(item.id)
        return None if known is None else known.locate(("architecture",))
    if item.part == "fault":
        at = [fault.id for fault in files.odd.spec.faults].index(item.id)
        return files.odd.locate(("faults", at, _KEYS[item.rule]))
    place = _place(item, files.concept.spec)
    return None if place is None else files.concept.locate((*place, _KEYS.get(item.rule, "id")))


def _place(item: Violation, concept: Concept) -> Loc | None:
    ids = {
        "hazardous_event": ("hazardous_events", [part.id for part in concept.hazardous_events]),
        "safety_goal": ("safety_goals", [part.id for part in concept.safety_goals]),
        "fsr": ("requirements", [part.id for part in concept.requirements]),
        "element": ("elements", [part.id for part in concept.elements]),
        "assumption": ("assumptions", [part.id for part in concept.assumptions]),
        "waiver": ("waivers", [part.requirement for part in concept.waivers]),
        "decomposition": ("decompositions", [part.requirement for part in concept.decompositions]),
        "dependent_failure": ("dependent_failures", [p.id for p in concept.dependent_failures]),
    }
    key, names = ids[item.part]
    return (key, names.index(item.id)) if item.id in names else None
