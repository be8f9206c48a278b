"""A logical scenario: world, environment, actors and storyboard over parameters with ranges.

A scenario knows no sensor, no channel and no switch; it meets an architecture only in a test case.
Numbers are formulas over the scenario's own parameters, so one file describes every variation.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from typing import Annotated, Any, ClassVar, Final, Literal

from pydantic import AfterValidator, ConfigDict, Field, StringConstraints, model_validator

from adeye.errors import InputError, suggest
from adeye.kernel.strips import STRIP_LANE, STRIP_LIMIT
from adeye.maps.opendrive import FASTEST, STEEPEST
from adeye.spec import quantity as q
from adeye.spec.document import Loc, Problem, finds, misplaced
from adeye.spec.expression import parse
from adeye.spec.plausible import FileRecord
from adeye.spec.programs import DRIVER_SIGNALS, FmuUse, VariableName
from adeye.units import Dimension, shown

ActorKind = Literal["car", "van", "truck", "bus", "motorcycle", "cyclist", "pedestrian"]
ObjectKind = Literal["parked_truck", "parked_car", "barrier", "building"]
Illumination = Literal["day", "dusk", "lit_night", "night"]
"""Daylight, twilight, night with street lighting, night without."""

Value = str | int | float
"""A parameter value as written: a quantity with its unit, or a plain number."""


class Parameter(q.Record):
    """A varied quantity of the scenario with its default and the range it is meant for."""

    default: Value
    range: Annotated[q.Many[Value], Field(min_length=2, max_length=2)] | None = None
    text: str = ""

    @finds
    def _default_in_range(self) -> Iterator[Problem]:
        default, dimension = _quantity(self.default, ("default",))
        if self.range is None:
            return
        ends: list[float] = []
        for at, text in enumerate(self.range):
            end, found = _quantity(text, ("range", at))
            if found.exponents != dimension.exponents:
                what = f"{text!r} is {found.label}, the default {self.default!r} is "
                yield ("range", at), what + dimension.label
                return
            ends.append(end)
        low, high = self.range
        if not ends[0] <= ends[1]:
            yield ("range",), f"the range from {low} to {high} is empty"
        elif not ends[0] <= default <= ends[1]:
            yield ("default",), f"{self.default} is outside the range [{low}, {high}]"


def _quantity(text: Value, loc: Loc) -> tuple[float, Dimension]:
    """Read a constant as SI with its dimension."""
    try:
        expression = parse(str(text))
        dimension = expression.dimension({}) if isinstance(text, str) else Dimension.NONE
        if dimension is not None and expression.is_constant:
            return float(expression.evaluate({})), dimension
    except (InputError, TypeError, ValueError) as error:
        raise misplaced([(loc, f"{shown(text)} is not a quantity like '15 m'")]) from error
    raise misplaced([(loc, f"{shown(text)} is not a quantity like '15 m'")])


class Bay(q.Record):
    """A place to stand in beside lanes and shoulder, on the right.

    It begins at the outer edge of the shoulder. Tapers before and after it widen from nothing to
    its depth, linearly. A rest area is a larger one: lanes and parking apart from the road are not
    modelled.
    """

    kind: Literal["parking_bay", "rest_area"]
    s: q.LengthFormula
    """Where its full depth begins along the road [m], after the taper."""
    length: q.LengthFormula
    """How long it has its full depth [m]."""
    depth: q.LengthFormula
    """From the outer edge of the shoulder to its own [m]."""
    taper: q.LengthFormula
    """Length of each taper [m]."""


class LaneEnd(q.Record):
    """Where the outermost lane on one side ends: it narrows to nothing, linearly."""

    side: Literal["right", "left"]
    s: q.LengthFormula
    """Where it begins to narrow [m]."""
    taper: q.LengthFormula
    """How long it does [m]."""


class Road(q.GrownRecord):
    """A road with parallel lanes, numbered from 0 at the right, where traffic keeps to."""

    later: ClassVar[tuple[str, ...]] = (
        "verge",
        "bays",
        "opposite_lanes",
        "lane_ends",
        "traffic",
        "place",
        "heading",
        "line",
        "slabs",
        "grades",
    )

    kind: Literal["straight", "curve", "s_curve", "imported"] = "straight"
    """An imported road is that of a place of a map; adeye writes it."""
    length: q.LengthFormula
    radius: q.LengthFormula | None = None
    """Radius of the curve [m], positive to the left; an S-curve continues with its negative. Of an
    imported road that of its narrowest bend, always positive."""
    lanes: Annotated[int, Field(ge=1, le=8)]
    lane_width: q.LengthFormula
    shoulder: q.LengthFormula
    speed_limit: q.SpeedFormula
    markings: Literal["full", "worn", "none"] = "full"
    road_type: Literal["motorway", "rural", "urban"] = "motorway"
    verge: q.LengthFormula | None = None
    """Width of free ground on the right beside the shoulder, which carries a vehicle [m], default
    0; bays lie in it."""
    bays: q.ById[Bay] = {}
    opposite_lanes: Annotated[int, Field(ge=0, le=4)] = 0
    """Lanes of the other way, to the left of the others."""
    lane_ends: q.ById[LaneEnd] = {}
    traffic: Literal["right", "left"] = "right"
    """The side that it keeps to. On the left, the scenario takes place in the mirror: what it says
    is to the right is to the left, and the other way round. Vehicle, faults and sun are none of
    it."""
    place: str = ""
    """Of an imported road: its key in the map."""
    heading: float = 0.0
    """Of an imported road: that of its start in the map [rad], with the other sign in left-hand
    traffic, as line and slabs are those of the mirror image."""
    line: q.Pairs = ()
    """Of an imported road: length [m] and curvature [1/m] of each piece of its reference line."""
    slabs: q.Many[q.Slab] = ()
    """Of an imported road: what lies across it, see ``kernel.strips``: where each slab begins [m],
    and its strips from right to left."""
    grades: q.Pairs = ()
    """Of an imported road: from where on [m] it rises how much for each metre."""

    @finds
    def _radius_fits_kind(self) -> Iterator[Problem]:
        if self.kind != "imported" and (self.radius is None) != (self.kind == "straight"):
            yield (), f"a {self.kind} road takes {'no' if self.kind == 'straight' else 'a'} radius"
        if bool(self.line and self.slabs) != (self.kind == "imported"):
            yield (), "a place of a map gives a road its line; write world.map instead of it"
        if self.kind != "imported" and (self.place or self.heading or self.grades):
            yield (), "a place of a map says where a road is and how it rises; write world.map"
        numbers = [number for piece in self.line for number in piece]
        numbers += [number for _, strips in self.slabs for strip in strips for number in strip]
        begins = [begin for begin, _ in self.slabs]
        is_sound = (
            all(map(math.isfinite, [*numbers, *begins, self.heading]))
            and all(length > 0.0 for length, _ in self.line)
            and begins == sorted(set(begins))
            and all(len(strip) == 8 for _, strips in self.slabs for strip in strips)
            and all(strip[STRIP_LIMIT] <= FASTEST for _, strips in self.slabs for strip in strips)
            and all(abs(grade) <= STEEPEST for _, grade in self.grades)
        )
        if not is_sound:
            yield (), "these are no numbers of a road that adeye has imported"
        if self.kind == "imported" and (self.opposite_lanes or self.lane_ends):
            yield (), "the lanes of an imported road are those of its map"
        if len(self.lane_ends) >= self.lanes:
            yield (
                ("lane_ends",),
                f"{len(self.lane_ends)} of {self.lanes} lanes end, and none is left",
            )
        if self.bays and any(end.side == "right" for end in self.lane_ends.values()):
            yield ("lane_ends",), "a road with bays keeps its right lane"

    @property
    def lane_counts(self) -> tuple[int, int]:
        """Fewest and most lanes of the ego's way along it."""
        counts = [sum(strip[STRIP_LANE] >= 0.0 for strip in strips) for _, strips in self.slabs]
        return (
            (min(counts), max(counts)) if counts else (self.lanes - len(self.lane_ends), self.lanes)
        )

    @property
    def has_strips(self) -> bool:
        """Whether what lies across it is told strip by strip."""
        return self.kind == "imported" or bool(self.opposite_lanes or self.lane_ends)


class StaticObject(q.Record):
    """A box that does not move: it blocks sight and can be hit."""

    kind: ObjectKind
    reflectivity: q.NumberFormula | None = None
    s: q.LengthFormula
    offset: q.LengthFormula
    """Lateral place of its centre from the right edge of the road [m], positive to the left."""
    heading: q.AngleFormula | None = None
    length: q.LengthFormula
    width: q.LengthFormula
    height: q.LengthFormula


class MapUse(q.Record):
    """Maps that the scenario takes place in."""

    file: q.Text | q.Many[q.Text]
    """One or several, beside the scenario's file."""

    @property
    def files(self) -> tuple[str, ...]:
        """Each of them."""
        return (self.file,) if isinstance(self.file, str) else self.file


class PlaceQuery(q.GrownRecord):
    """Which places of the maps."""

    later: ClassVar[tuple[str, ...]] = ("route",)

    anchor: Literal["carriageway", "entry", "exit", "lane_begin", "lane_end", "work_zone"]
    """What is at the place: one every 50 m of carriageway, the lane of a ramp that comes in or
    leaves, a lane that begins or ends beside others, one that is closed for works."""
    before: Annotated[q.Length, Field(ge=0.0)] = 0.0
    """How far before the place its road begins [m]: where s is 0."""
    after: Annotated[q.Length, Field(gt=0.0)]
    """How far behind it the road ends [m]."""
    lanes: Annotated[int, Field(ge=1, le=8)] | None = None
    """In the direction of travel, at the place."""
    two_way: bool | None = None
    """Whether traffic comes towards one right beside, at the place."""
    road_type: Literal["motorway", "rural", "urban"] | None = None
    min_radius: Annotated[q.Length, Field(gt=0.0)] | None = None
    """No bend is narrower than this [m]."""
    max_radius: Annotated[q.Length, Field(gt=0.0)] | None = None
    """Some bend is not wider than this [m]."""
    min_speed_limit: q.Speed | None = None
    max_speed_limit: q.Speed | None = None
    route: Literal["entry", "exit"] | None = None
    """Over which ramp the road of the place leads: it begins on the one that comes in, or ends on
    the one that leaves. Without, it goes on where most lanes do."""

    @finds
    def _route_has_its_anchor(self) -> Iterator[Problem]:
        if self.route not in {None, self.anchor}:
            yield ("route",), f"a road over the ramp of an {self.route} takes anchor: {self.route}"


def _road_or_place(schema: dict[str, Any]) -> None:
    """Ask a file for a road or for places of a map: adeye fills in the road of these."""
    schema["required"] = [name for name in schema["required"] if name != "road"]
    schema["oneOf"] = [{"required": ["road"]}, {"required": ["map", "place"]}]


class World(q.GrownRecord):
    """The road and what stands beside or on it."""

    model_config = ConfigDict(json_schema_extra=_road_or_place)

    later: ClassVar[tuple[str, ...]] = ("map", "place")

    map: MapUse | None = None
    place: PlaceQuery | None = None
    """With a map, instead of a road: each place gives one."""
    road: Road
    objects: q.ById[StaticObject] = {}

    @finds
    def _place_has_a_map(self) -> Iterator[Problem]:
        if self.place is not None and self.map is None:
            yield ("place",), "a place is one of a map, and no map is named"


class Environment(q.Record):
    """Environmental conditions during the scenario (ISO 34503 names)."""

    rain: q.RainFormula = Field(default="0 mm/h", validate_default=True)
    fog_visibility: q.LengthFormula = Field(default="10 km", validate_default=True)
    """Clear air, unless there is fog [m]."""
    friction: q.NumberFormula
    """Of the road; it decides every braking distance, so that nobody gets one unseen."""
    illumination: Illumination = "day"
    sun_elevation: q.AngleFormula | None = None
    """Of the sun above the horizon; without it nobody looks into the sun."""
    sun_azimuth: q.AngleFormula | None = None
    """Where the sun stands in the map, counter-clockwise from its x axis; default 0."""


class Goal(q.Record):
    """Where the ego is to arrive: a distance along the road [m]."""

    s: q.LengthFormula


class EgoStart(q.Record):
    """Where and how fast the ego starts, and the speed that it is asked to drive."""

    lane: q.NumberFormula
    s: q.LengthFormula
    offset: q.LengthFormula | None = None
    speed: q.SpeedFormula
    desired_speed: q.SpeedFormula | None = None
    goal: Goal | None = None


class Size(q.Record):
    """Outer dimensions of an actor [m]."""

    length: q.LengthFormula
    width: q.LengthFormula
    height: q.LengthFormula


class Start(q.GrownRecord):
    """Initial place of an actor: along the road, or by a bumper-to-bumper gap to another."""

    later: ClassVar[tuple[str, ...]] = ("off_road", "oncoming")

    lane: q.NumberFormula | None = None
    offset: q.LengthFormula | None = None
    """With a lane: from its centre; without: from the right edge of the road. Positive left."""
    s: q.LengthFormula | None = None
    ahead_of: q.Identifier | None = None
    gap: q.LengthFormula | None = None
    heading: q.AngleFormula | None = None
    """Relative to the road; default along it."""
    speed: q.SpeedFormula
    off_road: bool = False
    """It is meant to start where there is no road: before the begin, behind the end, or a vehicle
    beside lanes, shoulder, bay and verge."""
    oncoming: bool = False
    """The lane is one of the other way, counted from the right of who drives there, and the heading
    is against the road's."""

    @finds
    def _one_place(self) -> Iterator[Problem]:
        if (self.s is None) == (self.ahead_of is None):
            yield (), "give either s or ahead_of with gap"
        elif (self.ahead_of is None) != (self.gap is None):
            yield (), "ahead_of and gap go together"
        elif self.lane is None and self.offset is None:
            yield (), "give a lane, or an offset from the right edge of the road"


class Idm(q.Record):
    """Reactive driving: Intelligent Driver Model, with MOBIL lane changes if asked."""

    desired_speed: q.SpeedFormula | None = None
    lane_changes: bool = False


def _require_driver_signal(text: str) -> str:
    if text not in DRIVER_SIGNALS:
        raise ValueError(f"there is no signal {shown(text)}. {suggest(text, DRIVER_SIGNALS)}")
    return text


class DriverCommand(q.SparseRecord):
    """Which outputs of an FMU are what the driver of an actor does."""

    acceleration: VariableName
    """[m/s²]; nobody drives backwards."""
    lateral_speed: VariableName | None = None
    """Across its lane, to its own left [m/s]; where it is left out it keeps its offset."""


class Driver(FmuUse):
    """An FMU that drives an actor."""

    inputs: Annotated[
        dict[VariableName, Annotated[str, AfterValidator(_require_driver_signal)]],
        Field(min_length=1),
    ]
    """Which signal each input variable gets; it is converted to the unit that the variable has."""
    outputs: DriverCommand
    desired_speed: q.SpeedFormula | None = None
    """What it is told that it wants to drive; as fast as it starts unless given."""
    digest: Annotated[str, StringConstraints(pattern="^([0-9a-f]{64})?$")] = ""
    """sha256 of the file, which adeye fills in; if it is given, another file is refused."""


class Actor(q.GrownRecord):
    """A participant other than the ego: scripted by the storyboard, reactive, or driven."""

    later: ClassVar[tuple[str, ...]] = ("driver",)

    kind: ActorKind
    size: Size | None = None
    reflectivity: q.NumberFormula | None = None
    """Share of light that its surface returns, for lidar; default: typical of its kind."""
    start: Start
    reactive: Idm | None = None
    driver: Driver | None = None

    @property
    def takes_actions(self) -> bool:
        """Whether the storyboard moves it: what is reactive or driven moves by itself."""
        return self.reactive is None and self.driver is None

    @finds
    def _one_moves_it(self) -> Iterator[Problem]:
        if self.reactive is not None and self.driver is not None:
            yield ("driver",), "it is reactive already; keep one of reactive and driver"


class LaneChange(q.Record):
    """Move to another lane or by a lateral distance, on a sinusoidal or linear profile."""

    to_lane: q.NumberFormula | None = None
    by: q.LengthFormula | None = None
    lateral_speed: q.SpeedFormula
    """Greatest lateral speed of the manoeuvre [m/s]."""
    shape: Literal["sinusoidal", "linear"] = "sinusoidal"

    @finds
    def _one_target(self) -> Iterator[Problem]:
        if (self.to_lane is None) == (self.by is None):
            yield (), "give either to_lane or by"


class SpeedChange(q.GrownRecord):
    """Change to a target speed with a rate and, if given, a limit on jerk."""

    later: ClassVar[tuple[str, ...]] = ("relative_to",)

    to: q.SpeedFormula
    relative_to: q.Identifier | None = None
    """Whose speed, when the action begins, ``to`` is added to; the target is never below 0."""
    rate: q.AccelerationFormula
    jerk: q.JerkFormula | None = None


class Stop(q.Record):
    """Brake to standstill with a deceleration and, if given, a limit on jerk."""

    rate: q.AccelerationFormula
    jerk: q.JerkFormula | None = None


class Cross(q.Record):
    """Walk across the road to a lateral place, in a straight line at a constant speed.

    Only pedestrians do: what has wheels cannot turn on the spot.
    """

    to: q.LengthFormula
    """Lateral place from the right edge of the road [m], positive to the left."""
    speed: q.SpeedFormula


_ALONG: Final = frozenset({"speed", "stop", "cross"})
_ACROSS: Final = frozenset({"lane_change", "cross"})
"""Actions about how fast an actor goes along the road, and about where it is across it."""


class Event(q.GrownRecord):
    """When a condition first holds, an actor begins one action."""

    later: ClassVar[tuple[str, ...]] = ("optional", "delay")

    actor: q.Identifier
    when: q.Condition
    delay: q.DurationFormula | None = None
    """From when the condition first holds to the begin, as OpenSCENARIO's delay of a condition."""
    lane_change: LaneChange | None = None
    speed: SpeedChange | None = None
    stop: Stop | None = None
    cross: Cross | None = None
    optional: bool = False
    """It need not begin in a run; of an event that is neither optional nor under ``realised``,
    ``adeye scenario lint`` asks for one of both."""

    @finds
    def _one_action(self) -> Iterator[Problem]:
        actions = [self.lane_change, self.speed, self.stop, self.cross]
        if sum(action is not None for action in actions) != 1:
            yield (), "an event has exactly one of lane_change, speed, stop, cross"

    @property
    def action(self) -> LaneChange | SpeedChange | Stop | Cross:
        """The one action of the event."""
        chosen = self.lane_change or self.speed or self.stop or self.cross
        assert chosen is not None
        return chosen

    @property
    def is_along(self) -> bool:
        """Whether it is about how fast its actor goes along the road."""
        return any(getattr(self, name) is not None for name in _ALONG)

    @property
    def is_across(self) -> bool:
        """Whether it is about where its actor is across the road."""
        return any(getattr(self, name) is not None for name in _ACROSS)


def _domain(event: Any) -> tuple[object, frozenset[str]]:
    """Say whom an event as written moves, and whether along the road, across it or both."""
    if not isinstance(event, Mapping):
        return None, frozenset()
    along, across = _ALONG & event.keys(), _ACROSS & event.keys()
    return event.get("actor"), frozenset(
        (["along"] if along else []) + (["across"] if across else [])
    )


class Tags(q.Record):
    """Where the scenario stands in the field's catalogues, and what else people find it by."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, q.Text]

    iso34502: str = ""
    nhtsa: str = ""
    r157: str = ""

    @finds
    def _own_names(self) -> Iterator[Problem]:
        for name in self.own:
            if not re.fullmatch(q.IDENTIFIER, name):
                yield (name,), f"{shown(name)} is no name: lower case letters, digits, underscores"
            elif near := get_close_matches(name, type(self).model_fields, n=1, cutoff=0.75):
                yield (name,), f"{name!r} is nearly {near[0]!r}. Write that, or another name"

    @property
    def own(self) -> dict[str, str]:
        """Those that are in no catalogue, by the names that their author gave."""
        return self.__pydantic_extra__

    @property
    def by_name(self) -> dict[str, str]:
        """All that say something."""
        return {name: text for name, text in self.model_dump().items() if text}


class Provenance(q.Record):
    """Who wrote the scenario and from what."""

    source: q.Text
    author: str = ""
    version: str = "1"


class LogicalScenario(FileRecord):
    """One file of the scenario database."""

    scenario: q.Identifier
    title: q.Text
    text: str = ""
    tags: Tags = Tags()
    provenance: Provenance
    parameters: q.ById[Parameter] = {}
    constraints: q.Many[q.Condition] = ()
    world: World
    environment: Environment
    ego: EgoStart
    actors: q.ById[Actor] = {}
    storyboard: q.ById[Event] = {}
    order: q.Many[q.Identifier] = ()
    """Events in the order of the file, which is noted where it decides: of two events that begin at
    one tick, and of which one takes the place of the other, the later acts."""
    realised: q.Many[q.Identifier] = ()
    """Events that must have begun within the horizon, else the run is not realised."""
    horizon: Annotated[q.Duration, Field(gt=0.0)]
    tail: Annotated[q.Duration, Field(ge=0.0)] = 5.0

    later: ClassVar[tuple[str, ...]] = ("beyond_plausible", "order")

    @property
    def drivers(self) -> dict[str, Driver]:
        """FMUs that drive actors, by actor."""
        found = {name: actor.driver for name, actor in self.actors.items()}
        return {name: driver for name, driver in found.items() if driver is not None}

    @model_validator(mode="before")
    @classmethod
    def _note_order(cls, content: Any) -> Any:
        """Note the order of the events where names would decide which of two acts."""
        board = content.get("storyboard") if isinstance(content, Mapping) else None
        if not isinstance(board, Mapping) or content.get("order"):
            return content
        domains = [(str(name), _domain(event)) for name, event in board.items()]
        decides = any(
            actor == other and mine & theirs and before > name
            for at, (name, (actor, mine)) in enumerate(domains)
            for before, (other, theirs) in domains[:at]
        )
        return {**content, "order": list(board)} if decides else content

    @property
    def acting_order(self) -> tuple[str, ...]:
        """Every event, in the order in which those of one tick act."""
        noted = [name for name in self.order if name in self.storyboard]
        return (*noted, *(name for name in self.storyboard if name not in noted))

    def executable(self) -> dict[str, object]:
        """The part of the scenario that a run depends on: no titles, tags or provenance.

        Default values and ranges of parameters are left out, because the resolved values are part
        of a test case's identity beside this content.
        """
        left_out = "beyond_plausible title text tags provenance parameters constraints"
        part = self.model_dump(
            mode="json",
            exclude={
                **dict.fromkeys(left_out.split(), True),
                # The road of its place is what a run depends on.
                "world": {"map", "place"},
            },
        )
        for event in part["storyboard"].values():
            # What a run must bring about says ``realised``.
            event.pop("optional", None)
        return part
