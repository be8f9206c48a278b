"""A functional safety concept: hazardous events, safety goals, elements and requirements.

The ASIL of a hazardous event is derived from severity, exposure and controllability
(ISO 26262-3:2018, table 4) and never typed in; a safety goal has the highest of its events.

A requirement that came of a decomposition keeps the ASIL of its safety goal in brackets: ``B(D)``.

An element depends on its resources, its software and its supplier, on every element that provides
what it consumes, and on all that those depend on. The store follows these relations to see whether
two elements are independent.

Two children take the place of a requirement, each with a lower ASIL of its own (ISO 26262-9:2018,
clause 5). The scheme follows from the children's ASIL and has to be one of the table; that their
elements are independent is checked in the database, where the relations of elements are followed.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Final, Literal, Self

from pydantic import (
    BeforeValidator,
    Field,
    PrivateAttr,
    WithJsonSchema,
    model_validator,
)
from pydantic.functional_validators import ModelWrapValidatorHandler

from adeye.errors import UnitError, suggest
from adeye.fields import fields_of
from adeye.spec import quantity as q
from adeye.spec.asil import (
    ASIL_ORDER,
    CHILDREN,
    Asil,
    RequirementAsil,
    determine_asil,
    goal_of,
    own_asil,
    rank,
    scheme_text,
    schemes,
)
from adeye.spec.document import Loc, Problem, finds, misplaced, repeated
from adeye.spec.plausible import FileRecord
from adeye.units import read_quantity, shown, si_unit

# --- Elements of the preliminary architectural assumptions (PAA), and what they depend on ---------

ElementKind = Literal[
    "sensor",
    "perception",
    "planner",
    "arbiter",
    "actuator",
    "network",
    "compute",
    "power",
    "human",
    "external",
    "other",
]


class Element(q.GrownRecord):
    """An element of the preliminary architectural assumptions (PAA)."""

    later: ClassVar[tuple[str, ...]] = ("supplier", "software", "provides", "consumes")

    id: q.Identifier
    kind: ElementKind
    text: q.Text
    asil_capability: Asil
    legacy: bool = False
    resources: q.Many[str] = ()
    """Power, computers, clocks, buses, mountings; one that is an element has its own."""
    supplier: q.Text | None = None
    software: q.Many[q.Text] = ()
    """Code that it is made of and others may be made of, too: libraries, compilers, models."""
    provides: q.Many[q.Text] = ()
    consumes: q.Many[q.Text] = ()
    """What it needs of what others provide."""

    @property
    def relations(self) -> tuple[tuple[str, str], ...]:
        """What it has and needs, as kind and name, each once."""
        found = {
            "supplier": (self.supplier,) if self.supplier else (),
            "resource": self.resources,
            **fields_of(self, "software", "provides", "consumes"),
        }
        return tuple(dict.fromkeys((kind, name) for kind in found for name in found[kind]))


CAUSES: Final = ("resource", "software", "supplier")
"""Kinds of relations to something that can fail, or be wrong, for several elements at once."""


def causes(elements: Iterable[Element]) -> tuple[str, ...]:
    """List what several elements can fail by: themselves, resources, software and suppliers."""
    found: dict[str, None] = {}
    for element in elements:
        found[element.id] = None
        found |= {name: None for kind, name in element.relations if kind in CAUSES}
    return tuple(found)


def unprovided(elements: Iterable[Element]) -> Iterator[Problem]:
    """Find what is consumed and provided by nobody.

    Args:
        elements: All of a concept.

    Yields:
        Place below the concept, and what is wrong.
    """
    known = tuple(elements)
    provided = sorted({name for element in known for name in element.provides})
    for number, element in enumerate(known):
        for at, name in enumerate(element.consumes):
            if name not in provided:
                allowed = f"Provided are {', '.join(provided)}" if provided else "Nothing is"
                yield (
                    ("elements", number, "consumes", at),
                    f"nobody provides {name!r}. {allowed}",
                )


def spelled_twice(elements: Iterable[Element]) -> Iterator[Problem]:
    """Find what is named in two spellings: read as two things, it would be no common cause.

    Args:
        elements: All of a concept.

    Yields:
        Place below the concept, and what is wrong.
    """
    known: dict[tuple[str, str], str] = {}
    kinds: dict[str, str] = {}
    for number, element in enumerate(elements):
        # A resource may be an element.
        named: list[tuple[str, Loc, str]] = [
            ("resource", ("id",), element.id),
            ("supplier", ("supplier",), element.supplier or ""),
        ]
        for kind, key in (("resource", "resources"), ("software", "software")):
            named += [(kind, (key, at), name) for at, name in enumerate(getattr(element, key))]
        for kind, place, name in named:
            plain = _plain(name)
            first = known.setdefault((kind, plain), name) if plain else name
            if first != name:
                what = f"{_letters(name)} is spelled {_letters(first)} elsewhere"
                yield ("elements", number, *place), f"{what}. Spell one thing in one way"
            other = kinds.setdefault(plain, kind) if plain and kind != "supplier" else kind
            if other != kind:
                there = {"resource": "a resource or an element", "software": "software"}[other]
                what = f"{shown(name)} is {there} elsewhere"
                yield ("elements", number, *place), f"{what}. Name one thing under one key"


def _letters(name: str) -> str:
    """Show a name, and which letters it has where that cannot be seen."""
    return shown(name) if name.isascii() else f"{shown(name)} ({ascii(name)[1:-1]})"


def _unmarked(text: str) -> str:
    return "".join(item for item in text if unicodedata.category(item) != "Cf")


_LOOKS_LIKE: Final = str.maketrans(
    "авекмнорстухіјѕԁԛԝһӏαβεικνορτυχ",
    "abekmhopctyxijsdqwhlabeikvoptux",
)
"""Letters of other alphabets that look like Latin ones, small or as capitals."""


def _plain(name: str) -> str:
    """Return what a name is without its spelling: marks that nobody sees, case, spaces, hyphens.

    Nor does it matter of which alphabet a letter is that looks like one of another.
    """
    seen = unicodedata.normalize("NFKC", _unmarked(name))
    folded = unicodedata.normalize("NFKC", seen.casefold())
    return re.sub(r"[\s_-]+", "", folded).translate(_LOOKS_LIKE)


_PLACEHOLDER: Final = re.compile(
    r"[\W_]*((t[\W_]*b[\W_]*[adc]|todo|fixme|x{3,})([\W_].*)?|to do[\W_]*)?", re.S
)
_HELD: Final = re.compile(
    r"(tobe|pending|placeholder)[a-z]{0,12}|wip|open(point|issue)?|draft|later|dummy|asdf[a-z]*"
    r"|loremipsum.*|(fil{2}in|insert|add)(text|argument|reason|rationale)?(here|later)"
    r"|fil{2}(me)?in|notyet[a-z]{0,12}"
)
"""Of what is left without marks and spaces."""
_TEMPLATE: Final = re.compile(r"\s*(<[^<>]*>|\$?\{+[^{}]*\}+|\[\[[^\[\]]*\]\])\s*")
"""What a template has where a text is to stand."""
_NO_ARGUMENT: Final = frozenset({"none", "no", "na", "unknown"})


def is_placeholder(key: str, text: str) -> bool:
    """Tell whether a text only holds the place of one; of an argument also whether it is none.

    >>> texts = "T. B. D.", "…", "to be determined", "n/a", "TBD (X)", "lorem ipsum", "", "To do so"
    >>> [is_placeholder("argument", text) for text in texts]
    [True, True, True, True, True, True, False, False]
    >>> is_placeholder("safe_state", "none"), is_placeholder("threshold_source", "n.a.")
    (False, True)
    >>> [is_placeholder("text", text) for text in ("<source>", "{{ why }}", "not yet defined")]
    [True, True, True]
    """
    plain = unicodedata.normalize("NFKC", _unmarked(text)).casefold()
    bare = re.sub(r"[\W_]+", "", plain)
    argues = key in {"independence", "argument", "reason"} or key.endswith(("_source", "rationale"))
    held = _HELD.fullmatch(bare) or _PLACEHOLDER.fullmatch(plain) or _TEMPLATE.fullmatch(text)
    return text != "" and ((argues and bare in _NO_ARGUMENT) or held is not None)


# --- Decomposition of requirements over independent elements, and what argues for independence ----


class Decomposition(q.Record):
    """Two requirements that together stand for one, on elements that are independent."""

    requirement: q.Reference
    """The one that is decomposed."""
    into: Annotated[q.Many[q.Reference], Field(min_length=CHILDREN, max_length=CHILDREN)]
    """Its children; more of them in further steps."""
    independence: q.Text
    """Why one cannot fail with the other."""
    dfa: q.Many[q.Reference] = ()
    """Dependent-failure records that cover what their elements share."""


class DependentFailure(q.Record):
    """A record of the dependent-failure analysis (DFA): why something shared is no common cause."""

    id: q.Reference
    covers: Annotated[q.Many[q.Text], Field(min_length=1)]
    """Resources, software, suppliers and elements that it argues about."""
    argument: q.Text
    owner: q.Text
    valid_until: q.Date


def parents(concept: Concept) -> dict[str, str]:
    """Return the decomposed requirement by each of its children."""
    return {child: item.requirement for item in concept.decompositions for child in item.into}


def scheme(concept: Concept, item: Decomposition) -> str:
    """Write the scheme that the children of a decomposition make."""
    known = {requirement.id: requirement for requirement in concept.requirements}
    children = tuple(known[child].asil for child in item.into)
    return scheme_text(children, _goal_asil(concept, known[item.requirement]))


def reference_problems(concept: Concept) -> Iterator[Problem]:
    """Find decompositions and dependent-failure records that name what is not there.

    Yields:
        Place below the concept; what is wrong and what is allowed.
    """
    known = {item.id: item for item in concept.requirements}
    decomposed = [item.requirement for item in concept.decompositions]
    for number in repeated(decomposed):
        text = (
            f"{decomposed[number]!r} is decomposed twice. Decompose its children in further steps"
        )
        yield ("decompositions", number, "requirement"), text
    records = [record.id for record in concept.dependent_failures]
    for number in repeated(records):
        yield ("dependent_failures", number, "id"), f"{records[number]!r} is defined twice"
    of: dict[str, str] = {}
    for number, item in enumerate(concept.decompositions):
        loc: Loc = ("decompositions", number)
        yield from _unknown_part((*loc, "requirement"), (item.requirement,), known, "requirement")
        yield from _unknown_part((*loc, "into"), item.into, known, "requirement")
        yield from _unknown_part((*loc, "dfa"), item.dfa, records, "record in dependent_failures")
        for at, child in enumerate(item.into):
            if child in of:
                yield (*loc, "into", at), f"{child!r} is a child of {of[child]!r} already"
            of[child] = item.requirement
            if _is_above(child, item.requirement, of):
                yield (*loc, "into", at), f"{child!r} is decomposed into itself"
    shared = causes(concept.elements)
    for number, record in enumerate(concept.dependent_failures):
        place: Loc = ("dependent_failures", number, "covers")
        yield from _unknown_part(
            place, record.covers, shared, "resource, software, supplier or element"
        )


def asil_problems(concept: Concept) -> Iterator[Problem]:
    """Find decompositions that are none, and requirements that lost the ASIL of a goal.

    Args:
        concept: Its references resolve.

    Yields:
        Place below the concept; what is wrong and what is allowed.
    """
    known = {item.id: item for item in concept.requirements}
    for number, item in enumerate(concept.decompositions):
        yield from _step(concept, known, number, item)
    of = parents(concept)
    for number, requirement in enumerate(concept.requirements):
        yield from _lost(concept, known, of, number, requirement)


def _is_above(name: str, start: str, of: Mapping[str, str]) -> bool:
    seen: set[str] = set()
    current: str | None = start
    while current is not None and current not in seen:
        if current == name:
            return True
        seen.add(current)
        current = of.get(current)
    return False


def _unknown_part(
    loc: Loc, names: Sequence[str], known: Mapping[str, object] | Sequence[str], kind: str
) -> Iterator[Problem]:
    for at, name in enumerate(names):
        if name not in known:
            place = loc if loc[-1] == "requirement" else (*loc, at)
            yield place, f"there is no {kind} {name!r}. {suggest(name, known)}"


def _goal_asil(concept: Concept, requirement: Requirement) -> str:
    """Highest ASIL of the goals of a requirement."""
    return max(map(concept.goal_asil, requirement.goals), key=ASIL_ORDER.index)


def _step(
    concept: Concept, known: Mapping[str, Requirement], number: int, item: Decomposition
) -> Iterator[Problem]:
    """Check one decomposition: goals of the children, what is in brackets, and the scheme."""
    loc: Loc = ("decompositions", number, "into")
    parent = known[item.requirement]
    goal = _goal_asil(concept, parent)
    children = [known[child] for child in item.into]
    for at, child in enumerate(children):
        missing = [name for name in parent.goals if name not in child.goals]
        if missing:
            text = f"{child.id} does not serve {', '.join(missing)}, as {parent.id} does"
            yield (*loc, at), f"{text}. Each child alone has to meet what it is a child of"
        if parent.mandatory and not child.mandatory:
            optional: Loc = ("requirements", concept.requirements.index(child), "mandatory")
            text = f"{child.id} takes the place of {parent.id}, which is mandatory"
            yield optional, f"{text}. Leave mandatory out, or make {parent.id} optional as well"
        if goal_of(child.asil) != goal:
            place: Loc = ("requirements", concept.requirements.index(child), "asil")
            text = f"{child.id} comes of a decomposition of ASIL {goal}, and has {child.asil}"
            yield (
                place,
                f"{text}. Write the goal's in brackets, as in {own_asil(child.asil)}({goal})",
            )
    pair = tuple(sorted((rank(child.asil) for child in children), reverse=True))
    allowed = schemes(parent.asil)
    if pair not in [tuple(map(rank, scheme)) for scheme in allowed]:
        made = scheme_text(tuple(child.asil for child in children), goal)
        legal = ", ".join(scheme_text(scheme, goal) for scheme in allowed) or "nothing"
        yield loc, f"{made} is no decomposition of {parent.id} ({parent.asil}). Allowed: {legal}"


def _lost(
    concept: Concept,
    known: Mapping[str, Requirement],
    of: Mapping[str, str],
    number: int,
    item: Requirement,
) -> Iterator[Problem]:
    loc: Loc = ("requirements", number, "asil")
    if goal_of(item.asil) and item.id not in of:
        text = f"requirement {item.id} has ASIL {item.asil} and comes of no decomposition"
        yield loc, f"{text}. Write {own_asil(item.asil)}, or list it under decompositions"
    inherited = known[of[item.id]].goals if item.id in of else ()
    for goal in item.goals:
        needed = concept.goal_asil(goal)
        if rank(item.asil) < rank(needed) and goal not in inherited:
            text = f"requirement {item.id} has ASIL {item.asil}, below {needed} of {goal}"
            yield loc, f"{text}. Set it to {needed}, or decompose a requirement of {needed} into it"


# --- A functional safety concept: hazardous events, safety goals, elements and requirements -------

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


class HazardousEvent(q.GrownRecord):
    """A malfunction in an operational situation, with its classification."""

    later: ClassVar[tuple[str, ...]] = ("exposure_method", "people_at_risk", "scenarios")

    id: q.Reference
    function: q.Text
    malfunction: q.Text
    situation: q.Text
    severity: Literal["S0", "S1", "S2", "S3"]
    exposure: Literal["E0", "E1", "E2", "E3", "E4"]
    controllability: Literal["C0", "C1", "C2", "C3"]
    severity_rationale: q.Text
    exposure_rationale: q.Text
    controllability_rationale: q.Text
    exposure_method: Literal["duration", "frequency"] | None = None
    """Whether the exposure is a share of the operating time or a number of occurrences."""
    people_at_risk: q.Text | None = None
    scenarios: q.Many[q.Identifier] = ()
    """Scenarios that stand for it; empty: those in which the FSRs of its goals are judged."""

    @property
    def asil(self) -> Asil | None:
        """The derived ASIL, or None where none is assigned."""
        return determine_asil(self.severity, self.exposure, self.controllability)


class SafetyGoal(q.GrownRecord):
    """A top-level safety requirement against hazardous events."""

    later: ClassVar[tuple[str, ...]] = ("emergency_operation", "eotti", "eotti_rationale")

    id: q.Reference
    text: q.Text
    hazardous_events: Annotated[q.Many[q.Reference], Field(min_length=1)]
    safe_state: q.Text
    ftti: Annotated[q.Duration, Field(gt=0.0)]
    ftti_rationale: q.Text
    emergency_operation: q.Text | None = None
    """What bridges the time to the safe state where that is not reached within the FTTI."""
    eotti: Annotated[q.Duration, Field(gt=0.0)] | None = None
    """Emergency operation tolerance time interval [s]."""
    eotti_rationale: q.Text | None = None

    @finds
    def _emergency_operation_is_whole(self) -> Iterator[Problem]:
        given = [self.emergency_operation, self.eotti, self.eotti_rationale]
        if any(item is None for item in given) and any(item is not None for item in given):
            text = "give emergency_operation, eotti and eotti_rationale together, or none of them"
            yield (), text


Limit = Annotated[
    float | int | q.Identifier,
    WithJsonSchema({"type": ["string", "number"], "examples": ["1.5 s", 1.5, "tau"]}),
]


def _read_parameter(value: Any) -> str | float:
    """Write a parameter in SI, so that `1.5 s` and `1500 ms` are one; a plain number stays one."""
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise ValueError(f"{shown(value)} is not a quantity")
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


class MetricBound(q.GrownRecord):
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
                    if re.fullmatch(q.IDENTIFIER, content[side]):
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

    @finds
    def _one_bound(self) -> Iterator[Problem]:
        if (self.at_least is None) == (self.at_most is None):
            yield (), "give either at_least or at_most"


class Requirement(q.GrownRecord):
    """A functional safety requirement (FSR) with its measurable form."""

    later: ClassVar[tuple[str, ...]] = (
        "parameters",
        "type",
        "operating_modes",
        "safe_state",
        "emergency_operation_interval",
        "redundancy",
        "assumptions",
        "unusual_formula",
        "tags",
    )

    id: q.Reference
    goals: Annotated[q.Many[q.Reference], Field(min_length=1)]
    text: q.Text
    tags: q.Tags = {}
    formula: str | None = None
    """Signal temporal logic over the signal dictionary."""
    bound: MetricBound | None = None
    parameters: q.ById[ParameterValue] = Field(default_factory=dict)
    """Constants that the formula or the bound names."""
    threshold_source: q.Text
    asil: RequirementAsil
    mandatory: bool = True
    min_exercised: Annotated[int, Field(ge=1)] = 1
    on_contact: Literal["inconclusive", "fail"] = "inconclusive"
    applies: Literal["inside", "outside", "everywhere"] = "inside"
    scenarios: q.Many[q.Identifier] = ()
    """Scenarios that it is judged in; empty: all."""
    fdti: Annotated[q.Duration, Field(gt=0.0)] | None = None
    frti: Annotated[q.Duration, Field(gt=0.0)] | None = None
    allocation: Annotated[q.Many[q.Identifier], Field(min_length=1)]
    type: FsrType | None = None
    operating_modes: q.Many[q.Text] = ()
    safe_state: q.Text | None = None
    """Its own, where it differs from that of the goal."""
    emergency_operation_interval: Annotated[q.Duration, Field(gt=0.0)] | None = None
    redundancy: q.Text | None = None
    """Functional redundancy that it relies on."""
    assumptions: q.Many[q.Reference] = ()
    """What it holds under only."""
    unusual_formula: bool = False
    """It is meant, although no run was found that decides it, or a part of it."""

    @finds
    def _one_measure(self) -> Iterator[Problem]:
        if (self.formula is None) == (self.bound is None):
            yield (), "give either a formula or a bound"
        if self.unusual_formula and self.formula is None:
            yield ("unusual_formula",), "there is no formula"

    @finds
    def _bound_names_parameters(self) -> Iterator[Problem]:
        if self.bound is None:
            return
        side, name = self.bound.side, self.bound.limit
        if isinstance(name, str) and name not in self.parameters:
            text = f"there is no parameter {name!r}. {suggest(name, self.parameters)}".rstrip()
            yield ("bound", side), text
            return
        for item in self.parameters:
            if item != name:
                text = f"the bound does not name {item!r}. Remove it or name it"
                yield ("parameters", item), text

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
        if self.unusual_formula:
            text = f"{text.rstrip()} (meant, although no run was found that decides all of it)"
        values = ", ".join(f"{name} = {value}" for name, value in self.parameters.items())
        return f"{text.rstrip()} where {values}" if values else text

    def judged(self) -> dict[str, object]:
        """The part that a verdict depends on: a new threshold is a new FSR digest."""
        parts = {"id", "formula", "bound", "parameters", "on_contact", "applies", "scenarios"}
        return self.model_dump(mode="json", include=parts)


class Assumption(q.Record):
    """Something the concept relies on, with its owner and the date until which it is valid."""

    id: q.Reference
    text: q.Text
    owner: q.Text
    valid_until: q.Date


class Waiver(q.Record):
    """Accept a missing verdict of one FSR until a date; a FAIL cannot be waived."""

    requirement: q.Reference
    reason: q.Text
    author: q.Text
    expires: q.Date


class Concept(FileRecord):
    """One file of ``odd/concepts``."""

    later: ClassVar[tuple[str, ...]] = (
        "beyond_plausible",
        "decompositions",
        "dependent_failures",
        "tags",
    )

    concept: q.Identifier
    title: q.Text
    tags: q.Tags = {}
    hazardous_events: Annotated[q.Many[HazardousEvent], Field(min_length=1)]
    safety_goals: Annotated[q.Many[SafetyGoal], Field(min_length=1)]
    elements: Annotated[q.Many[Element], Field(min_length=1)]
    requirements: Annotated[q.Many[Requirement], Field(min_length=1)]
    assumptions: q.Many[Assumption] = ()
    waivers: q.Many[Waiver] = ()
    decompositions: q.Many[Decomposition] = ()
    dependent_failures: q.Many[DependentFailure] = ()

    @finds
    def _references_resolve(self) -> Iterator[Problem]:
        ids = {
            part: [item.id for item in getattr(self, part)]
            for part in ("hazardous_events", "safety_goals", "elements", "requirements")
        }
        for part, names in ids.items():
            for at in repeated(names):
                yield (part, at, "id"), f"{names[at]!r} is defined twice"
        for at, goal in enumerate(self.safety_goals):
            loc: Loc = ("safety_goals", at, "hazardous_events")
            yield from _unknown(loc, goal.hazardous_events, ids["hazardous_events"])
        for at, item in enumerate(self.requirements):
            assumed = [assumption.id for assumption in self.assumptions]
            for key, named, known in (
                ("goals", item.goals, ids["safety_goals"]),
                ("allocation", item.allocation, ids["elements"]),
                ("assumptions", item.assumptions, assumed),
            ):
                yield from _unknown(("requirements", at, key), named, known)
        for at, waiver in enumerate(self.waivers):
            for key in ("reason", "author"):
                if is_placeholder(key, text := getattr(waiver, key)):
                    yield ("waivers", at, key), f"{shown(text)} holds the place of one. Write it"
            loc = ("waivers", at, "requirement")
            yield from _unknown_part(loc, (waiver.requirement,), ids["requirements"], "requirement")
        yield from unprovided(self.elements)
        yield from spelled_twice(self.elements)
        yield from reference_problems(self)

    @finds
    def _requirements_have_columns(self) -> Iterator[Problem]:
        names = [item.id for item in self.requirements]
        folded = [re.sub(r"[^a-z0-9]+", "_", name.lower()) for name in names]
        for at in repeated(folded):
            first = names[folded.index(folded[at])]
            if names[at] != first:
                what = f"{names[at]!r} and {first!r} would be one column of results"
                yield ("requirements", at, "id"), f"{what}. Name one otherwise"

    def goal_asil(self, goal_id: str) -> Asil:
        """Highest ASIL of the hazardous events behind a safety goal (QM where none has one)."""
        goal = next(item for item in self.safety_goals if item.id == goal_id)
        asils = [event.asil for event in self.hazardous_events if event.id in goal.hazardous_events]
        return max((asil or "QM" for asil in asils), key=ASIL_ORDER.index)


def _unknown(loc: Loc, names: Sequence[str], known: Sequence[str]) -> Iterator[Problem]:
    for at, name in enumerate(names):
        if name not in known:
            yield (*loc, at), f"{name!r} is none of {', '.join(known) or 'nothing'}"


# --- Timing budgets of a safety goal: what its FSRs allow for detection and for reaction ----------

_ROUNDING_S: Final = 1e-9


@dataclass(frozen=True, slots=True)
class Budget:
    """What is allowed for handling a fault.

    Attributes:
        fsrs: Ids of the FSRs that state it, each once.
        fdti: For its detection [s]; None if no FSR states it.
        frti: For the reaction [s]; None if no FSR states it.
    """

    fsrs: tuple[str, ...]
    fdti: float | None
    frti: float | None

    @property
    def total(self) -> float:
        """What is stated, together [s]; at least that much is allowed for handling."""
        return (self.fdti or 0.0) + (self.frti or 0.0)

    @property
    def is_complete(self) -> bool:
        """Whether detection and reaction are both stated, so that the total is the FHTI."""
        return self.fdti is not None and self.frti is not None

    def exceeds(self, ftti: float) -> bool:
        """Tell whether it is more than a fault-tolerant time interval [s]."""
        return self.total > ftti + _ROUNDING_S


def budgets_of(requirements: Sequence[Requirement], goal: str) -> list[Budget]:
    """List the budgets of a safety goal.

    An FSR with both parts is a budget of its own. The largest detection and the largest reaction
    that stand alone are one together: one FSR detects, another one reacts.

    Args:
        requirements: Of the concept.
        goal: Id of the safety goal.
    """
    own = [item for item in requirements if goal in item.goals]
    found = [Budget((i.id,), i.fdti, i.frti) for i in own if i.fdti and i.frti]
    detect = max(((i.fdti, i.id) for i in own if i.fdti and not i.frti), default=None)
    react = max(((i.frti, i.id) for i in own if i.frti and not i.fdti), default=None)
    if detect is not None or react is not None:
        names = tuple(part[1] for part in (detect, react) if part is not None)
        fdti = None if detect is None else detect[0]
        frti = None if react is None else react[0]
        found.append(Budget(names, fdti, frti))
    return found
