"""What a report repeats from the files of a campaign: concept, architectures, scenarios, counts.

The database holds what the files said, not their lines. A line is told only where the file still
says what the campaign was judged by; otherwise it would point at something else.
"""

from __future__ import annotations

import math
import os
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from adeye.analysis.dependence import Dependencies, dependencies
from adeye.analysis.suite.analyse import analyse
from adeye.analysis.suite.conditions import conditions_of
from adeye.analysis.suite.records import Suite
from adeye.errors import InputError
from adeye.judge.verdict import Verdict
from adeye.report.claims import uses_of
from adeye.report.model import concept as model
from adeye.report.model.part import Label, Place
from adeye.report.model.report import Architecture, Cell, Factors, Fsr, Scenario
from adeye.spec import architecture
from adeye.spec.concept import Concept, Requirement, scheme
from adeye.spec.load import OddFiles, find_odd, load_odd, repository_of
from adeye.spec.odd import Attributes
from adeye.spec.quantity import SI
from adeye.store.read.checking import Violation
from adeye.store.records import CampaignInfo
from adeye.store.rules import RULES

# --- Where the FSRs and scenarios of a campaign stand in the user's files -------------------------


@dataclass(frozen=True)
class Places:
    """Lines of the files.

    Attributes:
        fsrs: In the concept, by id.
        scenarios: In the ODD, by the id under which it uses them.
        odd: Beginning of the ODD's file; None if nobody knows which.
    """

    odd: Place | None = None
    fsrs: Mapping[str, Place] = field(default_factory=dict)
    scenarios: Mapping[str, Place] = field(default_factory=dict)


def places_of(
    path: str, odd: Mapping[str, Any], concept: Concept, near: Path | None = None
) -> Places:
    """Find the lines of what a campaign was planned from.

    Args:
        path: The ODD's file as the campaign was given it; empty if nobody knows.
        odd: Stored content of the ODD and everything that it names.
        concept: The concept that judged the campaign.
        near: Folder of the database.

    Returns:
        No lines where the file is not there or cannot be read any more.
    """
    if not path:
        return Places()
    found = find_odd(path, near)
    place = Place(path=str(found), line=1, column=1)
    try:
        files = load_odd(found)
    except (InputError, OSError):
        return Places(place)
    return Places(place, _fsrs(files, concept), _scenarios(files, odd))


def uri_of(path: str) -> str:
    """Write a path as a code host looks it up: from the root of its repository, percent-encoded.

    Outside of a repository it is from the innermost folder that holds both the file and the folder
    where adeye was called, so that it never leads upwards.

    Args:
        path: From the folder where adeye was called, or absolute; nothing has to be there.
    """
    asked = Path(path)
    whole = asked.parent.resolve() / asked.name
    root = repository_of(whole.parent) or os.path.commonpath([whole.parent, Path.cwd()])
    return quote(os.fsencode(whole.relative_to(root).as_posix()))


def _fsrs(files: OddFiles, concept: Concept) -> dict[str, Place]:
    judged = {item.id: item.model_dump(mode="json") for item in concept.requirements}
    return {
        item.id: Place.of(files.concept.locate(("requirements", at, "id")))
        for at, item in enumerate(files.concept.spec.requirements)
        if judged.get(item.id) == item.model_dump(mode="json")
    }


def _scenarios(files: OddFiles, odd: Mapping[str, Any]) -> dict[str, Place]:
    ran = uses_of(odd)
    return {
        use.name: Place.of(files.odd.locate(("scenarios", at)))
        for at, use in enumerate(files.odd.spec.scenarios)
        if ran.get(use.name) == use.model_dump(mode="json", by_alias=True)
    }


# --- What a report repeats from the files of a campaign: concept, architectures, scenarios,
# counts.


@dataclass(frozen=True, slots=True)
class CampaignContent:
    """The files behind a campaign.

    Attributes:
        campaign: The campaign.
        concept: The concept that judged it.
        odd: Stored content of the ODD and everything that it names.
        places: Lines of the files.
        fsr_digests: Digest by which each FSR is judged, by id.
    """

    campaign: CampaignInfo
    concept: Concept
    odd: Mapping[str, Any]
    places: Places = field(default_factory=Places)
    fsr_digests: Mapping[str, str] = field(default_factory=dict)


_UNITS: Final[Mapping[str, tuple[float, str]]] = {
    "ego_speed": (3.6, " km/h"),
    "rain": (3.6e6, " mm/h"),
    "sun_elevation": (180.0 / math.pi, " deg"),
    "fog": (1.0, " m"),
    "min_radius": (1.0, " m"),
}
"""What the bounds of an ODD are written in, by attribute: factor and unit."""


def attributes_of(content: CampaignContent) -> Iterator[Label]:
    """List the bounds of the ODD; what it does not bound is left out."""
    for group in content.odd["odd"].get("attributes", {}).values():
        for name, bound in group.items():
            text = _bound_text(bound, *_UNITS.get(name, (1.0, "")))
            if text:
                yield Label(label=name.replace("_", " "), value=text)


def _bound_text(bound: Any, factor: float, unit: str) -> str:
    if isinstance(bound, list):
        return ", ".join(map(str, bound))
    if isinstance(bound, dict):
        low, high = bound.get("min", bound.get("min_visibility")), bound.get("max")
        ends = [
            f"{word} {value * factor:.6g}{unit}"
            for word, value in (("at least", low), ("at most", high))
            if value is not None
        ]
        return ", ".join(ends)
    return "" if bound is None else f"{bound * factor:.6g}{unit}"


def architectures_of(content: CampaignContent) -> Iterable[Architecture]:
    """List the architectures with what they are made of."""
    for name, part_of in content.odd["architectures"].items():
        parts = [
            Label(label=f"sensor {key}", value=sensor["kind"])
            for key, sensor in part_of["sensors"].items()
        ]
        parts += [
            Label(label=f"channel {key}", value=f"{item['kind']} ← {', '.join(item['links'])}")
            for key, item in part_of["channels"].items()
        ]
        switch = part_of["switch"]
        policy = f"{switch['policy']}: {' > '.join(switch['priority'])}"
        yield Architecture(
            id=name,
            title=part_of["title"],
            is_gate=name in content.campaign.gate,
            cost=part_of["cost"] or None,
            parts=(*parts, Label(label="switch", value=policy)),
        )


def suites_of(content: CampaignContent) -> Iterable[Suite]:
    """Analyse the sensors of each architecture in the ODD's conditions, as they are written.

    A sweep that varies an architecture varies what its runs had, not this.
    """
    attributes = Attributes.model_validate(content.odd["odd"].get("attributes", {}), context=SI)
    limit = attributes.dynamic_elements.ego_speed
    resources = {element.id: element.resources for element in content.concept.elements}
    for part_of in content.odd["architectures"].values():
        yield analyse(
            architecture.Architecture.model_validate(part_of, context=SI),
            conditions_of(attributes.environment),
            odd_speed=None if limit is None else limit.max,
            resources=resources,
        )


def dependencies_of(content: CampaignContent) -> Iterable[Dependencies]:
    """List what the channels of each architecture share, as the architectures are written."""
    for part_of in content.odd["architectures"].values():
        yield dependencies(
            architecture.Architecture.model_validate(part_of, context=SI), content.concept.elements
        )


def scenarios_of(content: CampaignContent) -> Iterable[Scenario]:
    """List the scenarios with where they stand in the field's catalogues."""
    uses = uses_of(content.odd)
    for name, part_of in content.odd["scenarios"].items():
        exposure = uses[name].get("exposure")
        yield Scenario(
            id=name,
            title=part_of["title"],
            text=part_of["text"],
            tags=tuple(
                Label(label=key, value=value) for key, value in part_of["tags"].items() if value
            ),
            exposure=f"{exposure * 3600.0:.4g} /h" if exposure else "",
            where=content.places.scenarios.get(name),
        )


def factors_of(content: CampaignContent) -> Iterable[Factors]:
    """Say how the test cases of each scenario were counted."""
    by_scenario: dict[str, list[Mapping[str, Any]]] = defaultdict(list)
    for factor in content.campaign.factors:
        by_scenario[factor["scenario"]].append(factor)
    for name, factors in by_scenario.items():
        entries = dict.fromkeys(entry for item in factors for entry in item["fault_entries"])
        yield Factors(
            scenario=name,
            points=max(item["points"] for item in factors),
            fault_entries=tuple(entries),
            architectures=len(factors),
            replicates=factors[0]["replicates"],
            test_cases=sum(item["test_cases"] for item in factors),
            axes=tuple(
                Label(label=axis, value=values) for axis, values in factors[0]["axes"].items()
            ),
            command=f"adeye plan {content.campaign.provenance.get('odd_path', '')}".strip(),
        )


def fsr_of(content: CampaignContent, item: Requirement) -> Fsr:
    """Describe an FSR in its measurable form."""
    goals = [goal for goal in content.concept.safety_goals if goal.id in item.goals]
    return Fsr.of(
        item,
        formula=item.measure,
        ftti_s=min(goal.ftti for goal in goals),
        fdti_s=item.fdti,
        frti_s=item.frti,
        digest=content.fsr_digests.get(item.id, ""),
        where=content.places.fsrs.get(item.id),
    )


def concept_of(content: CampaignContent, cells: Sequence[Cell]) -> dict[str, Any]:
    """List what the concept says, by the names that a report has for it.

    Args:
        content: The files of the campaign.
        cells: With the runs that waivers accept.
    """
    concept, day = content.concept, today()

    def dated(items: Iterable[Any]) -> list[tuple[Any, dict[str, Any]]]:
        """Say of each until when it holds."""
        return [
            (
                item,
                {"valid_until": item.valid_until.isoformat(), "is_expired": item.valid_until < day},
            )
            for item in items
        ]

    return {
        "hazards": tuple(
            model.Hazard.of(
                event,
                text=f"{event.malfunction} ({event.situation})",
                exposure_method=event.exposure_method or "",
            )
            for event in concept.hazardous_events
        ),
        "goals": tuple(
            model.SafetyGoal.of(
                goal,
                asil=concept.goal_asil(goal.id),
                hazards=goal.hazardous_events,
                ftti_s=goal.ftti,
            )
            for goal in concept.safety_goals
        ),
        "elements": _elements(content),
        "assumptions": tuple(
            model.Assumption.of(item, **until) for item, until in dated(concept.assumptions)
        ),
        "waivers": tuple(
            model.Waiver.of(
                item,
                fsr=item.requirement,
                expires=item.expires.isoformat(),
                runs=_missing(cells, item.requirement),
                is_expired=item.expires < day,
            )
            for item in concept.waivers
        ),
        "decompositions": tuple(
            model.Decomposition.of(item, fsr=item.requirement, scheme=scheme(concept, item))
            for item in concept.decompositions
        ),
        "dependent_failures": tuple(
            model.DependentFailure.of(item, **until)
            for item, until in dated(concept.dependent_failures)
        ),
    }


def _missing(cells: Sequence[Cell], fsr: str) -> int:
    """Count the runs of an FSR without a verdict that decides."""
    return sum(
        count
        for cell in cells
        if cell.fsr == fsr and cell.scenario is None
        for verdict, count in cell.counts.items()
        if verdict not in {Verdict.PASS, Verdict.VACUOUS, Verdict.FAIL}
    )


def _elements(content: CampaignContent) -> tuple[model.Element, ...]:
    """List the elements and the parts that realise them."""
    realised: dict[str, list[str]] = defaultdict(list)
    for name, part_of in content.odd["architectures"].items():
        # A sensor and a channel may have one name.
        parts = [*part_of["sensors"].items(), *part_of["channels"].items()]
        for key, part in (*parts, ("switch", part_of["switch"])):
            if part.get("realises"):
                realised[part["realises"]].append(f"{name}.{key}")
    return tuple(
        model.Element.of(element, realised_by=tuple(realised[element.id]))
        for element in content.concept.elements
    )


def today() -> date:
    """Return the date by which validity is judged, in UTC."""
    return datetime.now(UTC).date()


def findings_of(violations: Iterable[Violation]) -> Iterator[model.IntegrityFinding]:
    """Return what breaks an integrity rule, and what to do about it."""
    rules = {rule.name: rule for rule in RULES}
    for item in violations:
        rule = rules[item.rule]
        yield model.IntegrityFinding.of(item, text=rule.text, remedy=rule.remedy)
