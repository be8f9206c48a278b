"""An ODD: attributes, scenarios with their sweeps, faults, architectures, concept and gate."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Final, Literal

from pydantic import (
    AfterValidator,
    Field,
    StringConstraints,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
)

from adeye.errors import UsageError, suggest
from adeye.spec import quantity as q
from adeye.spec.document import Loc, Problem, finds, repeated
from adeye.spec.fault import AnyFault
from adeye.spec.plausible import FileRecord
from adeye.spec.scenario import ActorKind, Illumination, Value
from adeye.units import MOST_TOLERANCE, UNITS, shown

# --- Bins in which the coverage of an ODD is counted ----------------------------------------------


class CoverageBins(q.SparseRecord):
    """Edges of the bins of an attribute, in ascending order; without them there are default ones.

    A bin has its lower edge and not its upper one; the last one has both. Radius, sun and actors
    are counted only where edges or kinds stand here, or the attributes of the ODD limit them.
    """

    ego_speed: Annotated[q.Many[q.Speed], Field(min_length=2)] | None = None
    rain: Annotated[q.Many[q.RainRate], Field(min_length=2)] | None = None
    fog_visibility: Annotated[q.Many[q.Length], Field(min_length=2)] | None = None
    friction: Annotated[q.Many[q.Number], Field(min_length=2)] | None = None
    radius: Annotated[q.Many[q.Length], Field(min_length=2)] | None = None
    """Of a curve, to the left or to the right; a straight road is a bin of its own."""
    sun_elevation: Annotated[q.Many[q.Angle], Field(min_length=2)] | None = None
    """Of a sun above the horizon; no sun is a bin of its own."""
    actors: Annotated[q.Many[ActorKind], Field(min_length=1)] | None = None
    """Kinds, each a bin; a situation has those of all its actors."""

    @finds
    def _ascending(self) -> Iterator[Problem]:
        kinds = self.actors or ()
        for at in repeated(kinds):
            yield ("actors", at), f"{kinds[at]!r} occurs twice"
        text = "edges of bins must ascend, and this is not above the one before"
        for name in type(self).model_fields:
            edges = () if name == "actors" else getattr(self, name) or ()
            for at in range(len(edges) - 1):
                if not edges[at] < edges[at + 1]:
                    yield (name, at + 1), text


# --- What a sweep declares about how a quantity is distributed ------------------------------------

WEIGHT_SLACK: Final = 1e-9
"""How far the weights of a choice may sum up beside 1, so that thirds can be written."""


class Normal(q.SparseRecord):
    """A normal distribution, cut off at the ends that are given."""

    mean: Value
    sd: Value
    min: Value | None = None
    max: Value | None = None


class Lognormal(q.SparseRecord):
    """A quantity whose logarithm is normal, cut off at the ends that are given."""

    median: Value
    sigma: Annotated[float, Field(gt=0.0, le=10.0)]
    """Standard deviation of the logarithm."""
    min: Value | None = None
    max: Value | None = None


class Distribution(q.SparseRecord):
    """How an axis of a sample is distributed: exactly one of the kinds."""

    uniform: Annotated[q.Many[Value], Field(min_length=2, max_length=2)] | None = None
    normal: Normal | None = None
    lognormal: Lognormal | None = None
    empirical: q.Text | None = None
    """File with a line of headers, relative to the ODD; each of its values is as likely."""
    column: q.Text | None = None
    unit: str | None = None
    """Unit of the numbers in the file; without it they are plain numbers."""
    choice: Annotated[dict[str, Annotated[float, Field(gt=0.0, le=1.0)]], Field(min_length=1)] | (
        None
    ) = None
    """Weight of each value; they sum up to 1."""

    @property
    def kind(self) -> str:
        """Which one it is."""
        return next(name for name in KINDS if getattr(self, name) is not None)

    @finds
    def _one_kind(self) -> Iterator[Problem]:
        given = [name for name in KINDS if getattr(self, name) is not None]
        total = sum(self.choice.values()) if self.choice is not None else 1.0
        if len(given) != 1:
            yield (), f"give exactly one of {', '.join(KINDS)}, not {', '.join(given) or 'none'}"
        elif (self.empirical is None) != (self.column is None):
            yield (), "empirical and column go together"
        elif self.unit is not None and self.empirical is None:
            yield ("unit",), "unit belongs to empirical"
        elif abs(total - 1.0) > WEIGHT_SLACK:
            yield ("choice",), f"the weights sum up to {total:.10g}, not to 1"


KINDS: Final = ("uniform", "normal", "lognormal", "empirical", "choice")
"""Kinds of distribution, as a sweep writes them."""


# --- An ODD: attributes, scenarios with their sweeps, faults, architectures, concept and gate -----


class LaneLimits(q.Record):
    """Fewest and most lanes."""

    min: Annotated[int, Field(ge=1)] = 1
    max: Annotated[int, Field(ge=1)] = 8

    @finds
    def _not_empty(self) -> Iterator[Problem]:
        if self.min > self.max:
            yield (), f"from {self.min} to {self.max} lanes is empty"


def _names_some(values: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
    """Refuse an empty list that somebody wrote: it might mean none, and might mean all."""
    if not values and not (info.context or {}).get("si"):
        raise ValueError("it names none: leave the key out for all")
    return values


Some = AfterValidator(_names_some)


class Scenery(q.Record):
    """Scenery attributes (ISO 34503)."""

    road_type: Annotated[q.Many[Literal["motorway", "rural", "urban"]], Some] = (
        "motorway",
        "rural",
        "urban",
    )
    lanes: LaneLimits = LaneLimits()
    min_radius: q.Length | None = None


class RainLimits(q.Record):
    """Heaviest rain."""

    max: q.RainRate


class FrictionLimits(q.Record):
    """Lowest friction coefficient."""

    min: q.Number


class FogLimits(q.Record):
    """Shortest visibility."""

    min_visibility: q.Length


class SunLimits(q.Record):
    """Lowest sun that may stand above the horizon; one below it blinds nobody."""

    min: Annotated[q.Angle, Field(ge=0.0, le=1.5707963267948966)]


class EnvironmentalConditions(q.Record):
    """Environmental attributes (ISO 34503)."""

    rain: RainLimits | None = None
    fog: FogLimits | None = None
    friction: FrictionLimits | None = None
    illumination: Annotated[q.Many[Illumination], Some] = ("day", "dusk", "lit_night", "night")
    sun_elevation: SunLimits | None = None


class SpeedLimits(q.Record):
    """Highest speed."""

    max: q.Speed


class DynamicElements(q.Record):
    """Attributes of the ego and other participants (ISO 34503)."""

    ego_speed: SpeedLimits | None = None
    actors: Annotated[q.Many[ActorKind], Some] = ()
    """Kinds of actor that may occur; without it all."""


class Attributes(q.Record):
    """The operating conditions that the automation is meant for."""

    scenery: Scenery = Scenery()
    environment: EnvironmentalConditions = EnvironmentalConditions()
    dynamic_elements: DynamicElements = DynamicElements()


class Steps(q.Record):
    """An evenly spaced axis, both ends included."""

    start: Annotated[Value, Field(alias="from")]
    to: Value
    step: Value


Level = Value | bool | q.Many[Value]
"""What an axis may write at a place of a file: a value, true or false, or a list, as of links."""

PlaceChoice = Annotated[str, StringConstraints(pattern=q.CHOICE)]
"""Which of the places that a scenario asks its maps for."""

Axis = q.Many[Level] | Steps | Distribution | PlaceChoice

DesignKind = Literal[
    "full_factorial", "zip", "list", "random", "pairwise", "t_wise", "lhs", "sobol"
]
SAMPLED: Final = ("random", "lhs", "sobol")
"""Designs that take ``samples``, and a distribution for an axis."""


class Sweep(q.GrownRecord):
    """A design over parameters, with relations that exclude points."""

    later: ClassVar[tuple[str, ...]] = ("strength",)

    design: DesignKind = "full_factorial"
    parameters: dict[str, Axis] = {}
    points: q.Many[dict[str, Level]] = ()
    """The points of a ``list`` design, each with its own values."""
    samples: Annotated[int, Field(ge=1)] | None = None
    """How many points a sample has: from the distribution of each axis, or between its ends."""
    strength: Annotated[int, Field(ge=1, le=6)] | None = None
    """Of ``t_wise``: how many axes at a time have all feasible combinations of their levels."""
    where: q.Many[q.Condition] = ()

    @finds
    def _fits_design(self) -> Iterator[Problem]:
        for designs, key, given in (
            (("list",), "points", bool(self.points)),
            (SAMPLED, "samples", self.samples is not None),
            (("t_wise",), "strength", self.strength is not None),
        ):
            if self.design in designs and not given:
                yield (), f"design: {self.design} needs {key}"
                return
            if self.design not in designs and given:
                wanted = " or ".join(designs)
                verb = "belong" if key.endswith("s") else "belongs"
                yield (), f"{key} {verb} to design: {wanted}, and this is design: {self.design}"
                return
        if self.design == "list" and self.parameters:
            yield (), "design: list takes points, no parameters"
        elif self.design not in SAMPLED:
            text = f"a distribution belongs to design: {', '.join(SAMPLED)}, not {self.design}"
            for name, axis in self.parameters.items():
                if isinstance(axis, Distribution):
                    yield ("parameters", name), text


FaultEntry = q.Identifier | Annotated[q.Many[q.Identifier], Field(min_length=2)]


class ScenarioUse(q.Record):
    """One scenario of the catalogue in this ODD, with its exposure, faults and sweep."""

    use: q.Identifier
    as_id: Annotated[q.Identifier | None, Field(alias="as")] = None
    """Another id for it, when the same scenario is used twice."""
    exposure: Annotated[q.Frequency, Field(ge=1e-15)] | None = None
    """How often situations of it occur; once in 30 million years is the least that counts."""
    faults: q.Many[FaultEntry] | None = None
    sweep: Sweep = Sweep()
    parameters: dict[str, Level] = {}
    """Fixed values that replace the scenario's defaults, by parameter or dotted path."""

    @property
    def name(self) -> str:
        """The id under which the scenario stands in this ODD."""
        return self.as_id or self.use


class Gate(q.GrownRecord):
    """Architectures whose verdicts decide the exit code."""

    later: ClassVar[tuple[str, ...]] = ("preventable_by", "channel_failures", "tolerance")

    architectures: Annotated[q.Many[q.Identifier], Field(min_length=1)]
    preventable_by: q.Many[Literal["cc", "fsm", "rss", "reg157"]] = ()
    """Reference drivers: a contact that none of them avoids does not block. The verdict stays; what
    is not known to be unpreventable blocks."""
    channel_failures: Literal["refuse", "allow"] = "refuse"
    """Whether a channel that raises, dies, hangs or answers nonsense blocks. It never does in a run
    in which a mandatory FSR about its silence passes; with ``allow`` the FSRs alone decide."""
    tolerance: dict[str, Annotated[float, Field(ge=0.0, le=MOST_TOLERANCE)]] = {}
    """Loss of margin against a baseline that does not block, by the SI unit of the margin; what is
    not named has that of ``units.TOLERANCES``."""

    @finds
    def _tolerates_units(self) -> Iterator[Problem]:
        known = [name for name, unit in UNITS.items() if unit.numerator == unit.denominator]
        for name in self.tolerance:
            if name not in {*known, "1"}:
                hint = suggest(name, [*known, "1"])
                yield ("tolerance", name), f"{shown(name)} is no SI unit of a margin. {hint}"


class Uncertainty(q.Record):
    """Runs that are executed with half the step too, to tell what the step is worth."""

    situations: Annotated[int, Field(ge=10, le=10_000)] = 20
    """Fault-free situations for each scenario and architecture; fewer than 10 would tell nothing.
    """


class Odd(FileRecord):
    """One file of ``odd/``."""

    later: ClassVar[tuple[str, ...]] = ("beyond_plausible", "coverage", "tags")

    odd: q.Identifier
    title: str = ""
    text: str = ""
    tags: q.Tags = {}
    attributes: Attributes = Attributes()
    scenarios: Annotated[q.Many[ScenarioUse], Field(min_length=1)]
    faults: q.Many[AnyFault] = ()
    architectures: Annotated[q.Many[q.Text], Field(min_length=1)]
    concept: q.Text
    gate: Gate | None = None
    step: Annotated[q.Duration, Field(gt=0.0, le=1.0)] = 0.05
    uncertainty: Uncertainty | None = None
    """Judge with the numeric uncertainty of the step; without it a margin is taken as exact."""
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0
    replicates: Annotated[int, Field(ge=1)] = 1
    max_test_cases: Annotated[int, Field(ge=1)] = 100_000
    outside: Literal["refuse", "robustness"] = "refuse"
    catalogue: q.Text | None = None
    """Folder of scenarios, relative to this file; default: ``scenarios_db`` beside its folder, and
    the scenarios of the package."""
    plugins: q.Many[q.Text] = ()
    """Metrics from outside the package, by entry point; files are relative to this one."""
    coverage: CoverageBins | None = None
    """Bins of attributes for ``adeye coverage``; they change no test case."""

    @finds
    def _names_resolve(self) -> Iterator[Problem]:
        names = [use.name for use in self.scenarios]
        faults = [fault.id for fault in self.faults]
        if self.odd == "latest":
            yield ("odd",), "latest is the campaign that was planned last, of whichever ODD"
        for at in repeated(names):
            text = f"scenario {names[at]!r} occurs twice. Give one of them another id with `as:`"
            yield ("scenarios", at, "use"), text
        for at in repeated(faults):
            yield ("faults", at, "id"), f"fault {faults[at]!r} occurs twice"
        for at in repeated(self.plugins):
            yield ("plugins", at), f"{self.plugins[at]!r} is listed twice. Remove one"
        for at, name in enumerate(faults):
            if name == "none":
                yield ("faults", at, "id"), "'none' is the fault-free entry and cannot name a fault"
        for at, use in enumerate(self.scenarios):
            for loc, text in _entries(use, faults):
                yield ("scenarios", at, *loc), text


def value_of_key(name: str, value: Any) -> Any:
    """Read what an option is given as the key of an ODD that is called like it.

    Raises:
        UsageError: An ODD would be refused for it.
    """
    field = Odd.model_fields[name]
    kind: Any = Annotated[field.annotation, *field.metadata]
    try:
        return TypeAdapter(kind).validate_python(value)
    except ValidationError as error:
        said = error.errors()[0]["msg"].replace("Input should be", "must be")
        raise UsageError(f"--{name} {value}: {said}", remedy="As in an ODD.") from error


def _entries(use: ScenarioUse, faults: list[str]) -> Iterator[Problem]:
    """Find what is wrong with the fault entries of a scenario."""
    for number, entry in enumerate(use.faults or ()):
        loc: Loc = ("faults", number)
        ids = (entry,) if isinstance(entry, str) else entry
        for name in ids:
            if name not in faults and (name != "none" or len(ids) > 1):
                hint = suggest(name, ["none", *faults] if len(ids) == 1 else faults)
                yield loc, f"scenario {use.name!r} names fault {name!r}, which is not there. {hint}"
        if repeated(ids):
            yield loc, f"a fault occurs twice in {list(ids)}"
