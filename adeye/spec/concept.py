"""A functional safety concept: hazardous events, safety goals, elements and requirements.

The ASIL of a hazardous event is derived from severity, exposure and controllability
(ISO 26262-3:2018, table 4) and never typed in; a safety goal has the highest of its events.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import (
    BeforeValidator,
    Field,
    ModelWrapValidatorHandler,
    PrivateAttr,
    WithJsonSchema,
    model_validator,
)

from adeye.errors import UnitError, suggest
from adeye.spec.asil import ASIL_ORDER as ASIL_ORDER
from adeye.spec.asil import Asil, RequirementAsil
from adeye.spec.asil import determine_asil as determine_asil
from adeye.spec.decomposition import Decomposition, DependentFailure, reference_problems
from adeye.spec.elements import Element as Element
from adeye.spec.elements import unprovided
from adeye.spec.misplaced import Loc, misplaced, repeated
from adeye.spec.plausible import FileRecord
from adeye.spec.quantity import (
    IDENTIFIER,
    ById,
    Date,
    Duration,
    GrownRecord,
    Identifier,
    Many,
    Record,
    Reference,
    Text,
)
from adeye.units import read_quantity, shown, si_unit

FsrType = Literal[
    "fault_avoidance",
    "fault_detection",
    "safe_state_transition",
    "fault_tolerance",
    "degradation",
    "warning",
    "timing",
    "arbitration",
]
"""Strategies that an FSR can follow (ISO 26262-3:2018, 7.4.2.3, a to i; both kinds of warnings)."""


class HazardousEvent(GrownRecord):
    """A malfunction in an operational situation, with its classification."""

    later: ClassVar[tuple[str, ...]] = ("exposure_method", "people_at_risk", "scenarios")

    id: Reference
    function: Text
    malfunction: Text
    situation: Text
    severity: Literal["S0", "S1", "S2", "S3"]
    exposure: Literal["E0", "E1", "E2", "E3", "E4"]
    controllability: Literal["C0", "C1", "C2", "C3"]
    severity_rationale: Text
    exposure_rationale: Text
    controllability_rationale: Text
    exposure_method: Literal["duration", "frequency"] | None = None
    """Whether the exposure is a share of the operating time or a number of occurrences."""
    people_at_risk: Text | None = None
    scenarios: Many[Identifier] = ()
    """Scenarios that stand for it; empty: those in which the FSRs of its goals are judged."""

    @property
    def asil(self) -> Asil | None:
        """The derived ASIL, or None where none is assigned."""
        return determine_asil(self.severity, self.exposure, self.controllability)


class SafetyGoal(GrownRecord):
    """A top-level safety requirement against hazardous events."""

    later: ClassVar[tuple[str, ...]] = ("emergency_operation", "eotti", "eotti_rationale")

    id: Reference
    text: Text
    hazardous_events: Annotated[Many[Reference], Field(min_length=1)]
    safe_state: Text
    ftti: Annotated[Duration, Field(gt=0.0)]
    ftti_rationale: Text
    emergency_operation: Text | None = None
    """What bridges the time to the safe state where that is not reached within the FTTI."""
    eotti: Annotated[Duration, Field(gt=0.0)] | None = None
    """Emergency operation tolerance time interval [s]."""
    eotti_rationale: Text | None = None

    @model_validator(mode="after")
    def _emergency_operation_is_whole(self) -> Self:
        given = [self.emergency_operation, self.eotti, self.eotti_rationale]
        if any(item is None for item in given) and any(item is not None for item in given):
            msg = "give emergency_operation, eotti and eotti_rationale together, or none of them"
            raise ValueError(msg)
        return self


Limit = Annotated[
    float | int | Identifier,
    WithJsonSchema({"type": ["string", "number"], "examples": ["1.5 s", 1.5, "tau"]}),
]


def _read_parameter(value: Any) -> str | float:
    """Write a parameter in SI, so that `1.5 s` and `1500 ms` are one; a plain number stays one."""
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        msg = f"{shown(value)} is not a quantity"
        raise ValueError(msg)
    try:
        number, exponents = read_quantity(value if isinstance(value, str) else repr(value))
    except UnitError as error:
        raise ValueError(str(error)) from error
    unit = si_unit(exponents)
    return f"{number!r} {unit}" if unit else number


ParameterValue = Annotated[
    str | float,
    BeforeValidator(_read_parameter),
    WithJsonSchema({"type": ["string", "number"], "examples": ["1.5 s", 2]}),
]


class MetricBound(GrownRecord):
    """A bound on a metric of the run: a number in the metric's own unit, or text with a unit.

    Text becomes a number in SI, so that both ways to write it are one FSR; whether its unit is
    one of the metric's is checked where the metric is known. The name of a parameter stays a name.
    """

    later: ClassVar[tuple[str, ...]] = ("unusual_side",)

    metric: str
    at_least: Limit | None = None
    at_most: Limit | None = None
    unusual_side: bool = False
    """It is meant, although it bounds what the metric declares harmless, or cannot fail."""

    _written: str | None = PrivateAttr(default=None)

    @property
    def side(self) -> Literal["at_least", "at_most"]:
        """Which of the two is given."""
        return "at_least" if self.at_least is not None else "at_most"

    @property
    def limit(self) -> float | str | None:
        """The one that is given: a number, or the name of a parameter."""
        return self.at_least if self.at_least is not None else self.at_most

    @property
    def written(self) -> str | None:
        """The bound with its unit, where it was written with one; a stored concept has it in SI."""
        return self._written

    @model_validator(mode="wrap")
    @classmethod
    def _read_text(cls, content: Any, read: ModelWrapValidatorHandler[Self]) -> Self:
        text = None
        if isinstance(content, dict):
            content = dict(content)
            for side in ("at_least", "at_most"):
                if isinstance(content.get(side), str):
                    if re.fullmatch(IDENTIFIER, content[side]):
                        continue
                    text = content[side]
                    try:
                        content[side], _ = read_quantity(text)
                    except UnitError as error:
                        raise misplaced([((side,), str(error))]) from error
        made = read(content)
        if text is not None:
            made._written = text
        return made

    @model_validator(mode="after")
    def _one_bound(self) -> Self:
        if (self.at_least is None) == (self.at_most is None):
            msg = "give either at_least or at_most"
            raise ValueError(msg)
        return self


class Requirement(GrownRecord):
    """A functional safety requirement (FSR) with its measurable form."""

    later: ClassVar[tuple[str, ...]] = (
        "parameters",
        "type",
        "operating_modes",
        "safe_state",
        "emergency_operation_interval",
        "redundancy",
        "assumptions",
    )

    id: Reference
    goals: Annotated[Many[Reference], Field(min_length=1)]
    text: Text
    formula: str | None = None
    """Signal temporal logic over the signal dictionary."""
    bound: MetricBound | None = None
    parameters: ById[ParameterValue] = Field(default_factory=dict)
    """Constants that the formula or the bound names."""
    threshold_source: Text
    asil: RequirementAsil
    mandatory: bool = True
    min_exercised: Annotated[int, Field(ge=1)] = 1
    on_contact: Literal["inconclusive", "fail"] = "inconclusive"
    applies: Literal["inside", "outside", "everywhere"] = "inside"
    scenarios: Many[Identifier] = ()
    """Scenarios that it is judged in; empty: all."""
    fdti: Annotated[Duration, Field(gt=0.0)] | None = None
    frti: Annotated[Duration, Field(gt=0.0)] | None = None
    allocation: Annotated[Many[Identifier], Field(min_length=1)]
    type: FsrType | None = None
    operating_modes: Many[Text] = ()
    safe_state: Text | None = None
    """Its own, where it differs from that of the goal."""
    emergency_operation_interval: Annotated[Duration, Field(gt=0.0)] | None = None
    redundancy: Text | None = None
    """Functional redundancy that it relies on."""
    assumptions: Many[Reference] = ()
    """What it holds under only."""

    @model_validator(mode="after")
    def _one_measure(self) -> Self:
        if (self.formula is None) == (self.bound is None):
            msg = "give either a formula or a bound"
            raise ValueError(msg)
        return self

    @model_validator(mode="after")
    def _bound_names_parameters(self) -> Self:
        if self.bound is None:
            return self
        side, name = self.bound.side, self.bound.limit
        if isinstance(name, str) and name not in self.parameters:
            text = f"there is no parameter {name!r}. {suggest(name, self.parameters)}".rstrip()
            raise misplaced([(("bound", side), text)])
        unused = [
            (("parameters", item), f"the bound does not name {item!r}. Remove it or name it")
            for item in self.parameters
            if item != name
        ]
        if unused:
            raise misplaced(unused)
        return self

    @property
    def constants(self) -> dict[str, tuple[float, tuple[int, int, int]]]:
        """Parameters in SI with their exponents of length, time and angle."""
        return {name: read_quantity(str(value)) for name, value in self.parameters.items()}

    @property
    def measure(self) -> str:
        """The formula or the bound with the values of its parameters, for people."""
        text = self.formula or ""
        if self.bound is not None:
            relation = ">=" if self.bound.at_least is not None else "<="
            text = f"{self.bound.metric} {relation} {self.bound.limit}"
        values = ", ".join(f"{name} = {value}" for name, value in self.parameters.items())
        return f"{text.rstrip()} where {values}" if values else text

    def judged(self) -> dict[str, object]:
        """The part that a verdict depends on: a new threshold is a new FSR digest."""
        parts = {"id", "formula", "bound", "parameters", "on_contact", "applies", "scenarios"}
        return self.model_dump(mode="json", include=parts)


class Assumption(Record):
    """Something the concept relies on, with its owner and the date until which it is valid."""

    id: Reference
    text: Text
    owner: Text
    valid_until: Date


class Waiver(Record):
    """Accept a missing verdict of one FSR until a date; a FAIL cannot be waived."""

    requirement: Reference
    reason: Text
    author: Text
    expires: Date


class Concept(FileRecord):
    """One file of ``odd/concepts``."""

    later: ClassVar[tuple[str, ...]] = (
        "beyond_plausible",
        "decompositions",
        "dependent_failures",
    )

    concept: Identifier
    title: Text
    hazardous_events: Annotated[Many[HazardousEvent], Field(min_length=1)]
    safety_goals: Annotated[Many[SafetyGoal], Field(min_length=1)]
    elements: Annotated[Many[Element], Field(min_length=1)]
    requirements: Annotated[Many[Requirement], Field(min_length=1)]
    assumptions: Many[Assumption] = ()
    waivers: Many[Waiver] = ()
    decompositions: Many[Decomposition] = ()
    dependent_failures: Many[DependentFailure] = ()

    @model_validator(mode="after")
    def _references_resolve(self) -> Self:
        ids = {
            part: [item.id for item in getattr(self, part)]
            for part in ("hazardous_events", "safety_goals", "elements", "requirements")
        }
        found: list[tuple[Loc, str]] = []
        for part, names in ids.items():
            found += [
                ((part, at, "id"), f"{names[at]!r} is defined twice") for at in repeated(names)
            ]
        for at, goal in enumerate(self.safety_goals):
            loc: Loc = ("safety_goals", at, "hazardous_events")
            found += _unknown(loc, goal.hazardous_events, ids["hazardous_events"])
        for at, item in enumerate(self.requirements):
            found += _unknown(("requirements", at, "goals"), item.goals, ids["safety_goals"])
            found += _unknown(("requirements", at, "allocation"), item.allocation, ids["elements"])
            assumed = [assumption.id for assumption in self.assumptions]
            found += _unknown(("requirements", at, "assumptions"), item.assumptions, assumed)
        for at, waiver in enumerate(self.waivers):
            if waiver.requirement not in ids["requirements"]:
                text = f"there is no requirement {waiver.requirement!r}. "
                text += suggest(waiver.requirement, ids["requirements"])
                found.append((("waivers", at, "requirement"), text))
        found += unprovided(self.elements)
        found += reference_problems(self)
        if found:
            raise misplaced(found)
        return self

    def goal_asil(self, goal_id: str) -> Asil:
        """Highest ASIL of the hazardous events behind a safety goal (QM where none has one)."""
        goal = next(item for item in self.safety_goals if item.id == goal_id)
        asils = [event.asil for event in self.hazardous_events if event.id in goal.hazardous_events]
        return max((asil or "QM" for asil in asils), key=ASIL_ORDER.index)


def _unknown(loc: Loc, names: Sequence[str], known: Sequence[str]) -> Iterator[tuple[Loc, str]]:
    for at, name in enumerate(names):
        if name not in known:
            yield (*loc, at), f"{name!r} is none of {', '.join(known) or 'nothing'}"
