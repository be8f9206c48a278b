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
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.errors import SpecError, suggest
from adeye.kernel import storyboard
from adeye.kernel.elementary import asin, atan
from adeye.kernel.jit import compiled
from adeye.kernel.road import local, mark_on_road, offset_curvature, position
from adeye.kernel.storyboard import Script
from adeye.signals import (
    ILLUMINANCE,
    ROAD_EDGE,
    Bools,
    Floats,
    RoadMap,
    SceneContext,
    Surroundings,
)
from adeye.simulate.world.formulas import BELOW_ZERO, Formulas, Pick, Situation
from adeye.simulate.world.objects import DEFAULT_REFLECTIVITY, DEFAULT_SIZES, class_indices
from adeye.simulate.world.roads import build_roads
from adeye.simulate.world.storyboard import (
    WALKER,
    TriggerTable,
    centers,
    check_lanes,
    compile_script,
)
from adeye.spec.expression import Expression

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.spec.scenario import LogicalScenario

# --- Where everything starts: sizes, lanes, and bumper-to-bumper gaps resolved to places ----------

EGO = "ego"
NEAR_ROAD_M: Final = 500.0
"""Farthest that a static object is before or behind the road [m]: as far as beside it."""


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
    ego_s = formulas.values("ego.s", lambda s: s.ego.s)
    starts = Starts(
        s=np.zeros(shape),
        d=np.zeros(shape),
        heading=np.zeros(shape),
        speed=np.zeros(shape),
        reflectivity=np.zeros(shape),
        sizes=np.zeros((*shape, 3)),
        ego_s=ego_s,
        ego_d=_lateral(
            formulas, road, ego_s, ("ego", lambda s: s.ego.lane, lambda s: s.ego.offset)
        ),
        ego_speed=formulas.limited(
            "ego.speed", lambda s: s.ego.speed, above=BELOW_ZERO, unit="m/s"
        ),
    )
    for column, name in enumerate(actors):
        _fill_actor(starts, column, name, formulas, road)
    for column, name in enumerate(statics, start=len(actors)):
        _fill_static(starts, column, name, formulas)
        _check_near_road(f"world.objects.{name}", starts.s[:, column], road)
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
        oncoming = scenario.actors[name].start.oncoming
        lane = _start_lane(name)
        beside[name][:] = _lateral(formulas, road, places[name], lane, oncoming=oncoming)
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
    at, beside = (np.ascontiguousarray(part)[:, np.newaxis] for part in (s, d))
    outside = ~mark_on_road(road.grounds(), ROAD_EDGE, at, beside)[:, 0]
    if outside.any():
        raise SpecError(
            f"{where}.offset: {d[outside][0]:g} m from the right edge of the road is neither on a "
            "lane nor on the ground beside that carries a vehicle",
            remedy=remedy.replace("longer", "wider"),
        )


def _check_near_road(where: str, s: Floats, road: RoadMap) -> None:
    """Refuse a static object (B,) that is as far before or behind the road as none is beside it."""
    outside = ~((s >= -NEAR_ROAD_M) & (s <= road.length + NEAR_ROAD_M))
    if outside.any():
        raise SpecError(
            f"{where}.s: {s[outside][0]:g} m is more than {NEAR_ROAD_M:g} m off the road, which is "
            f"from 0 m to {road.length[outside][0]:g} m",
            remedy="Move it, or make the road longer.",
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


def _lateral(
    formulas: Formulas,
    road: RoadMap,
    s: Floats,
    start: tuple[str, Pick, Pick],
    *,
    oncoming: bool = False,
) -> Floats:
    """Return d of a start (B,) [m]: from a lane's centre at s, or from the edge of the road."""
    where, lane, offset = start
    beside = formulas.values(f"{where}.offset", offset, 0.0)
    if lane(formulas.scenario) is None:
        return beside
    number = formulas.values(f"{where}.lane", lane)
    if not oncoming:
        check_lanes(f"{where}.lane", number, road.lanes)
    return centers(f"{where}.lane", road, number, s, oncoming=oncoming) + beside


def _start_lane(name: str) -> tuple[str, Pick, Pick]:
    return f"actors.{name}.start", _start(name, "lane"), _start(name, "offset")


def _fill_actor(starts: Starts, column: int, name: str, formulas: Formulas, road: RoadMap) -> None:
    where = f"actors.{name}"
    start = formulas.scenario.actors[name].start
    starts.s[:, column] = formulas.values(f"{where}.start.s", _start(name, "s"), 0.0)
    if start.ahead_of is None:
        starts.d[:, column] = _lateral(
            formulas, road, starts.s[:, column], _start_lane(name), oncoming=start.oncoming
        )
    starts.heading[:, column] = formulas.values(
        f"{where}.start.heading", _start(name, "heading"), np.pi if start.oncoming else 0.0
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
        scripted: (A,) which actors the stage moves, by the storyboard or as an FMU drives them;
            the others are reactive.
        lane_changes: (A,) which reactive actors may change lanes.
        desired_speed: (B, A) speed that reactive and driven actors want to drive [m/s].
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
    begins = {name: starts.s[:, column] for column, name in enumerate(scenario.actors)}
    script = compile_script(formulas, road, begins, triggers.index, context.step)
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


_LEAST_WAY_S: Final = 1.0
"""From the start to a goal, at the speed of the start [s]. Our choice."""


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
    near = goal - starts.ego_s < _LEAST_WAY_S * starts.ego_speed
    if near.any():
        way, speed = (column[near][0] for column in (goal - starts.ego_s, starts.ego_speed))
        raise SpecError(
            f"ego.goal.s: {way:g} m ahead of the start is less than {_LEAST_WAY_S:g} s of driving "
            f"at {speed:g} m/s, so that the run would be over before anything could be seen",
            remedy="Put the goal further ahead.",
        )
    return goal


def _surroundings(formulas: Formulas) -> Surroundings:
    # In the mirror the sun stands on the other side.
    turn = -1.0 if formulas.scenario.world.road.traffic == "left" else 1.0
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
        sun_azimuth=turn
        * formulas.values("environment.sun_azimuth", lambda s: s.environment.sun_azimuth, 0.0),
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
    for wrong, said, remedy in (
        ((elevation > 0.0) & ~day, "up, but the illumination is not day", "below the horizon"),
        ((elevation < 0.0) & day, "down, but the illumination is day", "above the horizon"),
    ):
        if wrong.any():
            raise SpecError(
                f"{where}: at {degrees[wrong][0]:g} deg the sun is {said}",
                remedy=f"Leave it out, let the sun be {remedy}, or set another illumination.",
            )
    return elevation


def _desired_speeds(formulas: Formulas, starts: Starts, actors: int) -> Floats:
    speeds = starts.speed[:, :actors].copy()
    for scenario, rows, columns in formulas.parts:
        for number, actor in enumerate(scenario.actors.values()):
            mover = actor.driver if actor.reactive is None else actor.reactive
            if mover is not None and mover.desired_speed is not None:
                speeds[rows, number] = mover.desired_speed.evaluate(columns)
    if not np.isfinite(speeds).all() or (speeds < 0.0).any():
        raise SpecError(
            "actors.*.desired_speed: a desired speed is negative or not finite",
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
