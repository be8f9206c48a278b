"""Compile a batch of test cases into the arrays that a run begins with.

A storyboard becomes actions as rows of numbers, and triggers as postfix programs of these
variables: ``time``; ``ego.speed``, ``ego.s``, ``ego.d``; for every actor and static object
``speed``, ``s``, ``d``, ``gap``, ``ttc`` and ``distance``; ``<event>.begun`` and ``ended(<event>)``
as 1 or 0, ``<event>.begun_at`` and ``since(<event>)``, undefined before it begins; the scenario's
parameters. Gaps run along the lane that the ego drives, see ``kernel.road.lane_way``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye import signals
from adeye.errors import SpecError, suggest
from adeye.kernel import storyboard
from adeye.kernel.boxes import box_distance
from adeye.kernel.elementary import asin, atan, cos, sin_cos
from adeye.kernel.jit import compiled
from adeye.kernel.postfix import PUSH_VARIABLE, Programs
from adeye.kernel.road import lane_way, local, mark_on_road, offset_curvature, position
from adeye.kernel.storyboard import Script
from adeye.signals import (
    ILLUMINANCE,
    ROAD_EDGE,
    Bools,
    Floats,
    Ints,
    RoadMap,
    Scene,
    SceneContext,
    Surroundings,
)
from adeye.simulate.world.formulas import BELOW_ZERO, Formulas, Pick, Situation
from adeye.simulate.world.objects import DEFAULT_REFLECTIVITY, DEFAULT_SIZES, class_indices
from adeye.simulate.world.roads import build_roads
from adeye.spec.expression import Expression, Program, parse, to_program
from adeye.units import Dimension

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from adeye.spec.scenario import LogicalScenario, Parameter

# --- Compile a storyboard: actions as rows of numbers, triggers as postfix programs ---------------


WALKER: Final = "pedestrian"
"""The kind of actor that goes where it likes and stands beside roads; the others have wheels."""

STEEPEST_START: Final = math.radians(45.0)
"""Angle to the road at which a vehicle that starts may change lanes [rad]. Our choice."""

_ROUNDING: Final = 1e-9
"""Of a number of ticks, and of a sine."""


def compile_script(
    formulas: Formulas, road: RoadMap, index: Mapping[str, int], step: float
) -> Script:
    """Compile the storyboard of each run.

    Args:
        formulas: Scenarios of the batch with their parameters.
        road: The road of each run.
        index: Column of each trigger variable.
        step: Master clock [s].

    Raises:
        SpecError: A target lane does not exist, a rate is not positive, a delay is negative, or a
            vehicle is to do what only walkers can.
    """
    scenario = formulas.scenario
    actors = list(scenario.actors)
    actions = np.zeros((formulas.runs, len(scenario.storyboard), storyboard.ACTION_WIDTH))
    for number, (name, event) in enumerate(scenario.storyboard.items()):
        row = actions[:, number]
        row[:, storyboard.ACTION_ACTOR] = actors.index(event.actor)
        row[:, storyboard.ACTION_JERK] = math.inf
        row[:, storyboard.ACTION_RELATIVE] = -1.0
        delay = formulas.limited(
            f"storyboard.{name}.delay",
            lambda s, name=name: s.storyboard[name].delay,  # type: ignore[misc]
            above=BELOW_ZERO,
            default=0.0,
            unit="s",
        )
        row[:, storyboard.ACTION_DELAY] = np.ceil(delay / step - _ROUNDING)
        _fill_action(row, name, formulas, road)
        if event.speed is not None and event.speed.relative_to is not None:
            row[:, storyboard.ACTION_RELATIVE] = index[f"{event.speed.relative_to}.speed"]
    events = list(scenario.storyboard)
    order = np.array([events.index(name) for name in scenario.acting_order], dtype=np.int64)
    numbers = np.zeros(actions.shape[:2], dtype=np.int64)
    programs = compile_conditions(_triggers(formulas), index, numbers)
    return Script(actions, programs, numbers, order)


def _fill_action(row: Floats, name: str, formulas: Formulas, road: RoadMap) -> None:
    event = formulas.scenario.storyboard[name]
    where = f"storyboard.{name}"
    if event.lane_change is not None:
        _fill_lane_change(row, name, formulas, road)
    elif event.cross is not None:
        if formulas.scenario.actors[event.actor].kind != WALKER:
            raise SpecError(
                f"{where}.cross: {event.actor} has wheels and cannot turn on the spot",
                remedy="Let it start with heading: 90 deg, and drive across by its speed.",
            )
        row[:, storyboard.ACTION_KIND] = storyboard.CROSS
        row[:, storyboard.ACTION_TARGET] = formulas.values(
            f"{where}.cross.to", _field(name, "cross", "to")
        )
        row[:, storyboard.ACTION_RATE] = formulas.limited(
            f"{where}.cross.speed", _field(name, "cross", "speed"), above=0.0, unit="m/s"
        )
    else:
        row[:, storyboard.ACTION_KIND] = storyboard.CHANGE_SPEED
        action = "stop" if event.speed is None else "speed"
        row[:, storyboard.ACTION_RATE] = formulas.limited(
            f"{where}.{action}.rate", _field(name, action, "rate"), above=0.0, unit="m/s^2"
        )
        row[:, storyboard.ACTION_JERK] = formulas.limited(
            f"{where}.{action}.jerk",
            _field(name, action, "jerk"),
            above=0.0,
            default=math.inf,
            unit="m/s^3",
        )
        if event.speed is not None:
            row[:, storyboard.ACTION_TARGET] = formulas.limited(
                f"{where}.speed.to",
                _field(name, "speed", "to"),
                above=BELOW_ZERO if event.speed.relative_to is None else -math.inf,
                unit="m/s",
            )


def _fill_lane_change(row: Floats, name: str, formulas: Formulas, road: RoadMap) -> None:
    event = formulas.scenario.storyboard[name]
    action, actor = event.lane_change, event.actor
    if formulas.scenario.actors[actor].kind != WALKER:
        where = f"actors.{actor}.start.heading"
        heading = formulas.values(where, lambda s: s.actors[actor].start.heading, 0.0)
        across = np.abs(np.sin(heading)) > np.sin(STEEPEST_START) + _ROUNDING
        if across.any():
            raise SpecError(
                f"{where}: {np.degrees(heading[across][0]):g} deg is across the road, and "
                f"storyboard.{name} is a lane change along it",
                remedy=f"Start within {np.degrees(STEEPEST_START):g} deg of the road's direction.",
            )
    part = f"storyboard.{name}.lane_change"
    row[:, storyboard.ACTION_RATE] = formulas.limited(
        f"{part}.lateral_speed",
        _field(name, "lane_change", "lateral_speed"),
        above=0.0,
        unit="m/s",
    )
    linear = action is not None and action.shape == "linear"
    row[:, storyboard.ACTION_SHAPE] = storyboard.LINEAR if linear else storyboard.SINUSOIDAL
    if action is None or action.to_lane is None:
        row[:, storyboard.ACTION_KIND] = storyboard.CHANGE_BY
        row[:, storyboard.ACTION_TARGET] = formulas.values(
            f"{part}.by", _field(name, "lane_change", "by")
        )
        return
    row[:, storyboard.ACTION_KIND] = storyboard.CHANGE_TO
    lane = formulas.values(f"{part}.to_lane", _field(name, "lane_change", "to_lane"))
    check_lanes(f"{part}.to_lane", lane, road.lanes)
    row[:, storyboard.ACTION_TARGET] = (lane + 0.5) * road.lane_width


def check_lanes(what: str, lane: Floats, lanes: int) -> None:
    """Refuse lane numbers that the road does not have.

    Args:
        what: Name of the field, for the message.
        lane: (B,) numbers.
        lanes: How many the road has.

    Raises:
        SpecError: A number is broken, negative or too large.
    """
    bad = (lane != np.floor(lane)) | (lane < 0) | (lane >= lanes)
    if bad.any():
        raise SpecError(
            f"{what}: {lane[bad][0]:g} is no lane of a road with lanes 0 to {lanes - 1}",
            remedy="Lanes are counted from 0 at the right.",
        )


def _field(event: str, action: str, field: str) -> Pick:
    """Take a formula of an event's action; scenarios of one structure have the same actions."""

    def pick(scenario: LogicalScenario) -> Expression | None:
        found: Expression | None = getattr(getattr(scenario.storyboard[event], action), field)
        return found

    return pick


def _triggers(formulas: Formulas) -> Iterator[tuple[Any, Expression]]:
    """List where each trigger belongs, and itself."""
    for scenario, rows, _ in formulas.parts:
        for column, event in enumerate(scenario.storyboard.values()):
            yield (rows, column), event.when


def compile_conditions(
    conditions: Iterable[tuple[Any, Expression]], index: Mapping[str, int], numbers: Ints
) -> Programs:
    """Compile each different condition once.

    Args:
        conditions: Where in the numbers each belongs, and itself.
        index: Column of each variable.
        numbers: Out: which program each has.
    """
    known: dict[str, int] = {}
    compiled: list[Program] = []
    for place, when in conditions:
        if when.text not in known:
            known[when.text] = len(compiled)
            compiled.append(to_program(when, index))
        numbers[place] = known[when.text]
    lengths = [len(program.ops) for program in compiled] or [0]
    ops = np.zeros((len(lengths), max(lengths)), dtype=np.int64)
    args = np.zeros(ops.shape)
    for number, program in enumerate(compiled):
        ops[number, : len(program.ops)] = program.ops
        args[number, : len(program.args)] = program.args
    return Programs(ops, args, np.array(lengths, dtype=np.int64))


# --- Trigger variables: what a condition of a storyboard or of a fault's onset may name -----------

EGO_VARIABLES: Final = {
    "speed": Dimension.SPEED,
    "s": Dimension.LENGTH,
    "d": Dimension.LENGTH,
}
OBJECT_VARIABLES: Final = {
    "speed": Dimension.SPEED,
    "s": Dimension.LENGTH,
    "d": Dimension.LENGTH,
    "gap": Dimension.LENGTH,
    "ttc": Dimension.TIME,
    "distance": Dimension.LENGTH,
}
FIRST_OBJECT: Final = 1 + len(EGO_VARIABLES)
"""Column of the first object's variables, after ``time`` and the ego's."""


def trigger_variables(scenario: LogicalScenario) -> dict[str, Dimension]:
    """List the names that conditions may use, with their dimensions, in the order of the columns.

    Args:
        scenario: Its actors, static objects, events and parameters give the names.

    Raises:
        ExpressionError: A parameter's default is no quantity.
    """
    names = {"time": Dimension.TIME}
    names |= {f"ego.{what}": dimension for what, dimension in EGO_VARIABLES.items()}
    for thing in (*scenario.actors, *scenario.world.objects):
        names |= {f"{thing}.{what}": unit for what, unit in OBJECT_VARIABLES.items()}
    for what in storyboard.EVENT_VARIABLES:
        unit = Dimension.TIME if what in {"begun_at", "since"} else Dimension.NONE
        names |= {f"{event}.{what}": unit for event in scenario.storyboard}
    return names | parameter_dimensions(scenario)


def parameter_dimensions(scenario: LogicalScenario) -> dict[str, Dimension]:
    """Dimension of each parameter, from the unit of its default value."""
    return {name: parameter_dimension(item) for name, item in scenario.parameters.items()}


def parameter_dimension(parameter: Parameter) -> Dimension:
    """Dimension of a parameter, from the unit of its default value.

    Raises:
        ExpressionError: The default is no quantity.
    """
    if not isinstance(parameter.default, str):
        return Dimension.NONE
    found = parse(parameter.default).dimension({})
    return Dimension.NONE if found is None else found


class TriggerTable:
    """The trigger variables of a batch as columns, filled for each scene.

    Attributes:
        index: Column of each variable.
        first_event: Column of the first event's first variable.
    """

    def __init__(self, context: SceneContext, parameters: Mapping[str, Floats]) -> None:
        """Lay out the columns.

        Args:
            context: Objects, events and sizes.
            parameters: (B,) column of each scenario parameter in SI.
        """
        names = ["time", *(f"ego.{what}" for what in EGO_VARIABLES)]
        names += [f"{thing}.{what}" for thing in context.object_ids for what in OBJECT_VARIABLES]
        self.first_event = len(names)
        names += [
            f"{event}.{what}" for what in storyboard.EVENT_VARIABLES for event in context.event_ids
        ]
        self._first_parameter = len(names)
        names += list(parameters)
        self.index: dict[str, int] = {name: column for column, name in enumerate(names)}
        self._context = context
        self._wanted: Bools = np.ones(len(names), dtype=np.bool_)
        self._table = np.zeros((context.runs, len(names)))
        for name, column in parameters.items():
            self._table[:, self.index[name]] = column

    @classmethod
    def of(cls, cases: Sequence[Situation], context: SceneContext) -> TriggerTable:
        """Lay out the columns for a batch of test cases."""
        names = cases[0].parameters
        columns = {name: np.array([case.parameters[name] for case in cases]) for name in names}
        return cls(context, columns)

    def watch(self, programs: Programs, also: Ints | None = None) -> None:
        """Fill from now on only what some programs read: most conditions name few of the variables.

        Args:
            programs: Conditions.
            also: (N,) variables that something else reads.
        """
        self._wanted[:] = False
        self._wanted[programs.args[programs.ops == PUSH_VARIABLE].astype(np.int64)] = True
        if also is not None:
            self._wanted[also] = True

    def values(self, scene: Scene) -> Floats:
        """Fill the variables with what is true in a scene.

        Args:
            scene: Ground truth at a tick.

        Returns:
            (B, V) in SI; the array is filled anew by the next call, in runs that have not ended.
        """
        table = self._table
        table[:, 0] = scene.time
        first, events = self.first_event, scene.begun.shape[1]
        if events:
            has_begun = np.isfinite(scene.begun)
            table[:, first : first + events] = has_begun
            if self._wanted[first + events : self._first_parameter].any():
                at = np.where(has_begun, scene.begun, np.nan)
                step = self._context.step
                table[:, first + events : first + 2 * events] = at
                # In whole ticks: a difference of times is not the time of a number of ticks.
                since = (scene.tick - np.rint(at / step)) * step
                table[:, first + 2 * events : first + 3 * events] = since
                table[:, first + 3 * events : self._first_parameter] = scene.ended
        if not self._wanted[1:first].any():
            return table
        fill_motion(
            scene.running,
            self._wanted,
            scene.ego,
            scene.ego_place,
            self._context.ego_size,
            scene.objects,
            scene.object_places,
            self._context.object_sizes,
            table,
        )
        return table


@compiled
def road_gap(apart: float, ego_extent: float, other_extent: float) -> float:
    """Bumper-to-bumper gap along a lane [m]: positive ahead, negative behind, 0 side by side.

    Args:
        apart: From the ego's centre to that of the other, as of ``lane_way`` [m].
        ego_extent: Half of the length that the ego takes along the road [m].
        other_extent: Half of the length that the other takes [m].
    """
    free = max(0.0, abs(apart) - ego_extent - other_extent)
    return math.copysign(free, apart)


@compiled
def road_ttc(gap: float, ego_speed: float, other_speed: float) -> float:
    """Time to collision along the road at constant speeds [s], inf if the gap does not close.

    Args:
        gap: As of ``road_gap`` [m].
        ego_speed: Along the lane [m/s].
        other_speed: Along the same lane, see ``lane_share`` [m/s].
    """
    closing = (ego_speed - other_speed) * math.copysign(1.0, gap)
    return abs(gap) / closing if closing > 0.0 else math.inf


@compiled
def lane_share(place: Floats, d: float) -> float:
    """Way along a lane over the way that somebody drives beside it, 1 on a straight road.

    It is the rate of ``kernel.road.lane_way``; beyond the centre of a bend it is kept finite.

    Args:
        place: (6,) of who drives.
        d: Lateral place of the lane [m].
    """
    bend = place[signals.PLACE_CURVATURE]
    return float(max(0.0, 1.0 - bend * d) / max(1e-3, 1.0 - bend * place[signals.PLACE_D]))


@compiled
def road_extent(size: Floats, angle: float) -> float:
    """Half of the length that a box takes along the road [m].

    Args:
        size: (3,) length, width, height [m].
        angle: Heading relative to the road [rad].
    """
    sine, cosine = sin_cos(angle)
    return float(0.5 * (size[0] * abs(cosine) + size[1] * abs(sine)))


@compiled
def fill_motion(  # noqa: PLR0913, PLR0917 - a kernel over the whole scene
    running: Bools,
    wanted: Bools,
    ego: Floats,
    ego_place: Floats,
    ego_size: Floats,
    objects: Floats,
    places: Floats,
    sizes: Floats,
    table: Floats,
) -> None:
    """Fill the variables that change with the motion of ego and objects.

    Args:
        running: (B,) runs to do it in.
        wanted: (V,) variables that somebody reads.
        ego: (B, 7).
        ego_place: (B, 6).
        ego_size: (B, 3).
        objects: (B, M, 5).
        places: (B, M, 6).
        sizes: (B, M, 3).
        table: (B, V) out.
    """
    for run in range(ego.shape[0]):
        if not running[run]:
            continue
        ego_s = ego_place[run, signals.PLACE_S]
        road = ego_place[run, signals.PLACE_HEADING]
        angle = ego[run, signals.EGO_HEADING] - road
        extent = road_extent(ego_size[run], angle)
        along = ego[run, signals.EGO_SPEED] * cos(angle)
        table[run, 1] = ego[run, signals.EGO_SPEED]
        table[run, 2] = ego_s
        table[run, 3] = ego_place[run, signals.PLACE_D]
        for thing in range(objects.shape[1]):
            first = FIRST_OBJECT + 6 * thing
            row = table[run, first : first + 6]
            heading = objects[run, thing, signals.OBJECT_HEADING]
            turned = heading - places[run, thing, signals.PLACE_HEADING]
            speed = objects[run, thing, signals.OBJECT_SPEED]
            row[0] = speed
            row[1] = places[run, thing, signals.PLACE_S]
            row[2] = places[run, thing, signals.PLACE_D]
            if wanted[first + 3] or wanted[first + 4]:
                there = places[run, thing, signals.PLACE_HEADING]
                apart = lane_way(ego_s, road, ego_place[run, signals.PLACE_D], row[1], there)
                row[3] = road_gap(apart, extent, road_extent(sizes[run, thing], turned))
                # What drives beside gains on the ego's lane by the radii of the two.
                carried = lane_share(places[run, thing], ego_place[run, signals.PLACE_D])
                row[4] = road_ttc(row[3], along, carried * speed * cos(turned))
            if wanted[first + 5]:
                row[5] = box_distance(
                    ego[run, signals.EGO_X],
                    ego[run, signals.EGO_Y],
                    ego[run, signals.EGO_HEADING],
                    ego_size[run, 0],
                    ego_size[run, 1],
                    objects[run, thing, signals.OBJECT_X],
                    objects[run, thing, signals.OBJECT_Y],
                    heading,
                    sizes[run, thing, 0],
                    sizes[run, thing, 1],
                )


# --- Where everything starts: sizes, lanes, and bumper-to-bumper gaps resolved to places ----------

EGO = "ego"


@dataclass(frozen=True, slots=True)
class Starts:
    """Initial places on the road, in the order of the objects (actors, then static objects).

    Attributes:
        s: (B, M) centre along the road [m].
        d: (B, M) centre from the right edge to the left [m].
        heading: (B, M) relative to the road [rad].
        speed: (B, M) [m/s].
        sizes: (B, M, 3) length, width, height [m].
        reflectivity: (B, M) share of light that the surface returns, for lidar.
        ego_s: (B,) [m].
        ego_d: (B,) [m].
        ego_speed: (B,) [m/s].
    """

    s: Floats
    d: Floats
    heading: Floats
    speed: Floats
    sizes: Floats
    reflectivity: Floats
    ego_s: Floats
    ego_d: Floats
    ego_speed: Floats


def resolve_starts(formulas: Formulas, road: RoadMap, ego_length: Floats) -> Starts:
    """Evaluate where everything starts.

    ``ahead_of`` with a positive gap puts an actor ahead, with a negative one behind; the gap is
    from bumper to bumper along the lane of the one named, at that one's lateral place.

    Args:
        formulas: Scenarios of the batch with their parameters.
        road: The road of each run.
        ego_length: (B,) [m].

    Raises:
        SpecError: A lane does not exist, a size is not positive, ``ahead_of`` runs in a circle, or
            something starts where there is no road.
    """
    scenario = formulas.scenario
    actors, statics = list(scenario.actors), list(scenario.world.objects)
    shape = (formulas.runs, len(actors) + len(statics))
    starts = Starts(
        s=np.zeros(shape),
        d=np.zeros(shape),
        heading=np.zeros(shape),
        speed=np.zeros(shape),
        reflectivity=np.zeros(shape),
        sizes=np.zeros((*shape, 3)),
        ego_s=formulas.values("ego.s", lambda s: s.ego.s),
        ego_d=_lateral(formulas, road, "ego", lambda s: s.ego.lane, lambda s: s.ego.offset),
        ego_speed=formulas.limited(
            "ego.speed", lambda s: s.ego.speed, above=BELOW_ZERO, unit="m/s"
        ),
    )
    for column, name in enumerate(actors):
        _fill_actor(starts, column, name, formulas, road)
    for column, name in enumerate(statics, start=len(actors)):
        _fill_static(starts, column, name, formulas)
    places = {name: starts.s[:, column] for column, name in enumerate([*actors, *statics])}
    lengths = {name: starts.sizes[:, column, 0] for column, name in enumerate([*actors, *statics])}
    beside = {name: starts.d[:, column] for column, name in enumerate([*actors, *statics])}
    places[EGO], lengths[EGO], beside[EGO] = starts.ego_s, ego_length, starts.ego_d
    for name in gap_order(scenario):
        base = scenario.actors[name].start.ahead_of
        if base not in places:
            raise SpecError(
                f"actors.{name}.start.ahead_of: there is no {base!r}",
                remedy=suggest(str(base), places),
            )
        gap = formulas.values(f"actors.{name}.start.gap", _start(name, "gap"))
        half = 0.5 * (lengths[name] + lengths[base])
        half = np.where(gap < 0.0, -half, half)
        bend = [
            storyboard.advance(line, s, d, way) - storyboard.advance(line, s, 0.0, way)
            for line, s, d, way in zip(
                road.segments, places[base], beside[base], gap + half, strict=True
            )
        ]
        # The way along the lane less that along the reference line: nothing on a straight.
        places[name][:] = places[base] + gap + half + bend
    _check_on_road("ego", "s", starts.ego_s, starts.ego_d, road, is_beside=False)
    for column, (name, actor) in enumerate(scenario.actors.items()):
        if not actor.start.off_road:
            _check_on_road(
                f"actors.{name}.start",
                "s" if actor.start.ahead_of is None else "gap",
                starts.s[:, column],
                starts.d[:, column],
                road,
                is_beside=actor.kind == WALKER,
            )
    return starts


def _check_on_road(
    where: str, field: str, s: Floats, d: Floats, road: RoadMap, *, is_beside: bool
) -> None:
    """Refuse a start (B,) that is before, behind or, unless it may be, beside the road."""
    remedy = "Move it, or make the road longer."
    if where != EGO:
        remedy += " Who shall stand where there is no road says start.off_road: true."
    outside = ~road.covers(s)
    if outside.any():
        raise SpecError(
            f"{where}.{field}: {s[outside][0]:g} m is not on the road, which is from 0 m to "
            f"{road.length[outside][0]:g} m",
            remedy=remedy,
        )
    if is_beside:
        return
    at, left = s[:, np.newaxis], road.lanes * road.lane_width
    edges = road.shoulder + ROAD_EDGE, road.verge, left + ROAD_EDGE
    outside = ~mark_on_road(road.refuges, *edges, at, d[:, np.newaxis])[:, 0]
    if outside.any():
        raise SpecError(
            f"{where}.offset: {d[outside][0]:g} m from the right edge of the road is neither on a "
            "lane nor on the ground beside that carries a vehicle",
            remedy=remedy.replace("longer", "wider"),
        )


def gap_order(scenario: LogicalScenario) -> list[str]:
    """Order the actors that start relative to others so that each comes after its base.

    Raises:
        SpecError: The starts form a circle.
    """
    circle = gap_circle(scenario)
    if circle:
        raise SpecError(
            f"actors.{circle[0]}.start.ahead_of: the starts form a circle: {' → '.join(circle)}",
            remedy="Give one of them an s.",
        )
    order: list[str] = []
    for name in scenario.actors:
        order += [link for link in reversed(_chain(scenario, name)) if link not in order]
    return order


def gap_circle(scenario: LogicalScenario) -> tuple[str, ...]:
    """Name the actors of a circle of ``ahead_of``, first and last the same; empty for none."""
    for name in scenario.actors:
        chain = _chain(scenario, name)
        last = scenario.actors[chain[-1]].start.ahead_of if chain else None
        if last in chain:
            return (*chain[chain.index(last) :], last)
    return ()


def _chain(scenario: LogicalScenario, first: str) -> list[str]:
    """Follow ``ahead_of`` from an actor over those that start relative to others, each once."""
    chain: list[str] = []
    name: str | None = first
    while name in scenario.actors and name not in chain:
        base = scenario.actors[name].start.ahead_of
        if base is None:
            break
        chain.append(name)
        name = base
    return chain


def _lateral(formulas: Formulas, road: RoadMap, where: str, lane: Pick, offset: Pick) -> Floats:
    beside = formulas.values(f"{where}.offset", offset, 0.0)
    if lane(formulas.scenario) is None:
        return beside
    number = formulas.values(f"{where}.lane", lane)
    check_lanes(f"{where}.lane", number, road.lanes)
    return (number + 0.5) * road.lane_width + beside


def _fill_actor(starts: Starts, column: int, name: str, formulas: Formulas, road: RoadMap) -> None:
    where = f"actors.{name}"
    lateral = _lateral(
        formulas, road, f"{where}.start", _start(name, "lane"), _start(name, "offset")
    )
    starts.d[:, column] = lateral
    starts.s[:, column] = formulas.values(f"{where}.start.s", _start(name, "s"), 0.0)
    starts.heading[:, column] = formulas.values(
        f"{where}.start.heading", _start(name, "heading"), 0.0
    )
    starts.speed[:, column] = formulas.limited(
        f"{where}.start.speed", _start(name, "speed"), above=BELOW_ZERO, unit="m/s"
    )
    kind = formulas.scenario.actors[name].kind
    starts.reflectivity[:, column] = _share(
        formulas,
        f"{where}.reflectivity",
        lambda s: s.actors[name].reflectivity,
        DEFAULT_REFLECTIVITY[kind],
    )
    for axis, what in enumerate(("length", "width", "height")):
        starts.sizes[:, column, axis] = formulas.limited(
            f"{where}.size.{what}", _size(name, what), above=0.0, default=DEFAULT_SIZES[kind][axis]
        )


def _share(formulas: Formulas, what: str, pick: Pick, default: float) -> Floats:
    """Evaluate a formula that must be above 0 and at most 1."""
    column = formulas.limited(what, pick, above=0.0, default=default, unit="")
    if (column > 1.0).any():
        raise SpecError(
            f"{what}: {column.max():g} is above 1",
            remedy="It is a share: above 0, at most 1.",
        )
    return column


def _size(name: str, what: str) -> Pick:
    def pick(scenario: LogicalScenario) -> Expression | None:
        size = scenario.actors[name].size
        return None if size is None else _formula(size, what)

    return pick


def _start(name: str, what: str) -> Pick:
    return lambda scenario: _formula(scenario.actors[name].start, what)


def _static(name: str, what: str) -> Pick:
    return lambda scenario: _formula(scenario.world.objects[name], what)


def _formula(record: object, field: str) -> Expression | None:
    found: Expression | None = getattr(record, field)
    return found


def _fill_static(starts: Starts, column: int, name: str, formulas: Formulas) -> None:
    where = f"world.objects.{name}"
    starts.s[:, column] = formulas.values(f"{where}.s", _static(name, "s"))
    starts.d[:, column] = formulas.values(f"{where}.offset", _static(name, "offset"))
    starts.heading[:, column] = formulas.values(f"{where}.heading", _static(name, "heading"), 0.0)
    starts.reflectivity[:, column] = _share(
        formulas,
        f"{where}.reflectivity",
        _static(name, "reflectivity"),
        DEFAULT_REFLECTIVITY[formulas.scenario.world.objects[name].kind],
    )
    for axis, what in enumerate(("length", "width", "height")):
        starts.sizes[:, column, axis] = formulas.limited(
            f"{where}.{what}", _static(name, what), above=0.0
        )


# --- Compile a batch of test cases into the arrays that a run begins with -------------------------


@dataclass(frozen=True, slots=True)
class World:
    """Everything that a batch of B runs begins with; A of the M objects are actors.

    Attributes:
        context: What does not change during the runs.
        ego: (B, 7) initial states, see ``signals.EGO_COLUMNS``.
        objects: (B, M, 5) initial states, see ``signals.OBJECT_COLUMNS``.
        actors: (B, A, ACTOR_WIDTH) initial states, see ``kernel.storyboard``.
        scripted: (A,) which actors follow the storyboard; the others are reactive.
        lane_changes: (A,) which reactive actors may change lanes.
        desired_speed: (B, A) speed that reactive actors want to drive [m/s].
        ego_desired_speed: (B,) speed that the ego is asked to drive [m/s].
        goal: (B,) place along the road where the ego is to arrive [m], inf for none.
        script: The storyboard.
        triggers: The trigger variables.
        horizon: Obligations start within it [s].
        tail: What is simulated after it [s].
    """

    context: SceneContext
    ego: Floats
    objects: Floats
    actors: Floats
    scripted: Bools
    lane_changes: Bools
    desired_speed: Floats
    ego_desired_speed: Floats
    goal: Floats
    script: Script
    triggers: TriggerTable
    horizon: float
    tail: float


def compile_world(cases: Sequence[Situation], formulas: Formulas | None = None) -> World:
    """Evaluate the formulas of a batch of test cases.

    Args:
        cases: Test cases whose scenarios have one structure, and one step.
        formulas: Theirs, if they are sorted already.

    Returns:
        Arrays with the run as leading axis, in the order of the cases.

    Raises:
        SpecError: A value is not possible, or the test cases do not fit into one batch.
    """
    if len({case.step for case in cases}) != 1:
        raise SpecError(
            "a batch needs test cases of one step",
            remedy="Group the test cases by their step.",
        )
    formulas = formulas or Formulas.of(cases)
    scenario = formulas.scenario
    road = build_roads(formulas)
    vehicles = [case.architecture.vehicle for case in cases]
    ego_size = np.array([[v.length, v.width, v.height] for v in vehicles])
    starts = resolve_starts(formulas, road, ego_size[:, 0])
    actors = tuple(scenario.actors.values())
    kinds = (*(a.kind for a in actors), *(o.kind for o in scenario.world.objects.values()))
    context = SceneContext(
        step=cases[0].step,
        object_ids=(*scenario.actors, *scenario.world.objects),
        object_classes=class_indices(kinds),
        actor_count=len(actors),
        object_sizes=starts.sizes,
        object_reflectivity=starts.reflectivity,
        ego_size=ego_size,
        road=road,
        surroundings=_surroundings(formulas),
        stream_seeds=np.array([case.stream_seed for case in cases], dtype=np.uint64),
        event_ids=tuple(scenario.storyboard),
    )
    triggers = TriggerTable.of(cases, context)
    script = compile_script(formulas, road, triggers.index, context.step)
    speeds = script.actions[..., storyboard.ACTION_RELATIVE]
    triggers.watch(script.programs, speeds[speeds >= 0.0].astype(np.int64))
    wheelbase = np.array([vehicle.wheelbase for vehicle in vehicles])
    return World(
        context=context,
        ego=_ego_states(starts, road, wheelbase),
        objects=_object_states(starts, road),
        actors=_actor_states(starts, np.array([actor.kind == WALKER for actor in actors])),
        scripted=np.array([actor.reactive is None for actor in actors], dtype=np.bool_),
        lane_changes=np.array(
            [actor.reactive is not None and actor.reactive.lane_changes for actor in actors],
            dtype=np.bool_,
        ),
        desired_speed=_desired_speeds(formulas, starts, len(actors)),
        ego_desired_speed=_ego_desired_speed(formulas),
        goal=_goal(formulas, starts, road),
        script=script,
        triggers=triggers,
        horizon=scenario.horizon,
        tail=scenario.tail,
    )


def ego_desired_speeds(cases: Sequence[Situation]) -> Floats:
    """Speed that the ego is asked to drive (B,) [m/s]: ``desired_speed``, else its first speed."""
    return _ego_desired_speed(Formulas.of(cases))


def _ego_desired_speed(formulas: Formulas) -> Floats:
    return formulas.limited(
        "ego.desired_speed",
        lambda s: s.ego.speed if s.ego.desired_speed is None else s.ego.desired_speed,
        above=BELOW_ZERO,
        unit="m/s",
    )


def _goal(formulas: Formulas, starts: Starts, road: RoadMap) -> Floats:
    """Place along the road where the ego is to arrive (B,) [m], inf for none."""
    goal = formulas.values(
        "ego.goal.s", lambda s: None if s.ego.goal is None else s.ego.goal.s, np.inf
    )
    bad = np.isfinite(goal) & ~((goal > starts.ego_s) & road.covers(goal))
    if bad.any():
        start, length = (f"{column[bad][0]:g} m" for column in (starts.ego_s, road.length))
        raise SpecError(
            f"ego.goal.s: {goal[bad][0]:g} m is not on the way from the start at {start} to the "
            f"end of the road at {length}",
            remedy="Put the goal ahead of the start, and on the road.",
        )
    return goal


def _surroundings(formulas: Formulas) -> Surroundings:
    night = np.zeros(formulas.runs, dtype=np.bool_)
    day = np.zeros(formulas.runs, dtype=np.bool_)
    illuminance = np.zeros(formulas.runs)
    for scenario, rows, _ in formulas.parts:
        light = scenario.environment.illumination
        night[rows] = light in {"lit_night", "night"}
        day[rows] = light == "day"
        illuminance[rows] = ILLUMINANCE[light]
    return Surroundings(
        rain=formulas.limited(
            "environment.rain", lambda s: s.environment.rain, above=BELOW_ZERO, unit="m/s"
        ),
        fog_visibility=formulas.limited(
            "environment.fog_visibility", lambda s: s.environment.fog_visibility, above=0.0
        ),
        friction=formulas.limited(
            "environment.friction", lambda s: s.environment.friction, above=0.0, unit=""
        ),
        night=night,
        illuminance=illuminance,
        sun_elevation=_sun_elevation(formulas, day),
        sun_azimuth=formulas.values(
            "environment.sun_azimuth", lambda s: s.environment.sun_azimuth, 0.0
        ),
    )


def _sun_elevation(formulas: Formulas, day: Bools) -> Floats:
    """Elevation of the sun (B,) [rad], NaN where nobody looks into it."""
    where = "environment.sun_elevation"
    elevation = formulas.values(where, lambda s: s.environment.sun_elevation)
    degrees = np.degrees(elevation)
    outside = np.abs(degrees) > 90.0 + 1e-9
    if outside.any():
        raise SpecError(
            f"{where}: {degrees[outside][0]:g} deg is beyond the zenith or the nadir",
            remedy="Allowed: -90 deg to 90 deg.",
        )
    risen = (elevation > 0.0) & ~day
    if risen.any():
        raise SpecError(
            f"{where}: at {degrees[risen][0]:g} deg the sun is up, but the illumination is not day",
            remedy="Leave it out, let the sun be below the horizon, or set illumination: day.",
        )
    return elevation


def _desired_speeds(formulas: Formulas, starts: Starts, actors: int) -> Floats:
    speeds = starts.speed[:, :actors].copy()
    for scenario, rows, columns in formulas.parts:
        for number, actor in enumerate(scenario.actors.values()):
            if actor.reactive is not None and actor.reactive.desired_speed is not None:
                speeds[rows, number] = actor.reactive.desired_speed.evaluate(columns)
    if not np.isfinite(speeds).all() or (speeds < 0.0).any():
        raise SpecError(
            "actors.*.reactive.desired_speed: a desired speed is negative or not finite",
            remedy="Narrow the range of the parameters that it is computed from.",
        )
    return speeds


def _ego_states(starts: Starts, road: RoadMap, wheelbase: Floats) -> Floats:
    """The ego drives along its lane; in a curve its wheels are turned already."""
    states = np.zeros((len(wheelbase), 7))
    place_ego(starts.ego_s, starts.ego_d, starts.ego_speed, wheelbase, road.segments, states)
    return states


@compiled
def place_ego(
    s: Floats, d: Floats, speed: Floats, wheelbase: Floats, segments: Floats, states: Floats
) -> None:
    """Place the ego of each run along the road, steered to follow it.

    Args:
        s: (B,) along the road [m].
        d: (B,) from the right edge [m].
        speed: (B,) [m/s].
        wheelbase: (B,) [m].
        segments: (B, K, 5) reference lines.
        states: (B, 7) out.
    """
    for run in range(s.shape[0]):
        row = states[run]
        row[0], row[1], row[2] = position(segments[run], s[run], d[run])
        _, _, _, curvature = local(segments[run], row[0], row[1])
        bend = offset_curvature(curvature, d[run])
        # The rear axle, half a wheelbase behind, runs on a smaller circle and turns the body in.
        turned_in = 0.5 * wheelbase[run] * bend
        row[2] -= asin(turned_in)
        bend /= math.sqrt(1.0 - turned_in * turned_in)
        row[3] = speed[run]
        row[5] = atan(wheelbase[run] * bend)
        row[6] = speed[run] * bend


def _object_states(starts: Starts, road: RoadMap) -> Floats:
    states = np.zeros((*starts.s.shape, 5))
    place_objects(starts.s, starts.d, starts.heading, starts.speed, road.segments, states)
    return states


@compiled
def place_objects(
    s: Floats, d: Floats, heading: Floats, speed: Floats, segments: Floats, states: Floats
) -> None:
    """Place the objects of each run in the map.

    Args:
        s: (B, M) along the road [m].
        d: (B, M) from the right edge [m].
        heading: (B, M) relative to the road [rad].
        speed: (B, M) [m/s].
        segments: (B, K, 5) reference lines.
        states: (B, M, 5) out.
    """
    for run in range(s.shape[0]):
        for thing in range(s.shape[1]):
            row = states[run, thing]
            row[0], row[1], along = position(segments[run], s[run, thing], d[run, thing])
            row[2] = along + heading[run, thing]
            row[3] = speed[run, thing]


def _actor_states(starts: Starts, walks: Bools) -> Floats:
    states = np.zeros((starts.s.shape[0], len(walks), storyboard.ACTOR_WIDTH))
    place_actors(starts.s, starts.d, starts.heading, starts.speed, states)
    states[..., storyboard.WALKS] = walks
    return states


@compiled
def place_actors(s: Floats, d: Floats, heading: Floats, speed: Floats, states: Floats) -> None:
    """Place the actors of each run, the first objects, before they have moved.

    Args:
        s: (B, M) along the road [m].
        d: (B, M) from the right edge [m].
        heading: (B, M) relative to the road [rad].
        speed: (B, M) [m/s].
        states: (B, A, ACTOR_WIDTH) out.
    """
    for run in range(states.shape[0]):
        for actor in range(states.shape[1]):
            storyboard.place_actor(
                states[run, actor],
                s[run, actor],
                d[run, actor],
                heading[run, actor],
                speed[run, actor],
            )
