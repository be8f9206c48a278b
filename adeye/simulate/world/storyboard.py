"""A storyboard compiled: actions as rows of numbers, triggers as programs over named variables."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye import signals
from adeye.errors import SpecError
from adeye.kernel import storyboard
from adeye.kernel.boxes import box_distance, box_of
from adeye.kernel.criticality import road_extent, road_gap, road_ttc
from adeye.kernel.elementary import cos
from adeye.kernel.jit import compiled
from adeye.kernel.postfix import PUSH_VARIABLE, Programs
from adeye.kernel.road import lane_way
from adeye.kernel.storyboard import Script
from adeye.signals import (
    Bools,
    Floats,
    Ints,
    RoadMap,
    Scene,
    SceneContext,
)
from adeye.simulate.world.formulas import BELOW_ZERO, Formulas, Pick, Situation
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
    formulas: Formulas,
    road: RoadMap,
    begins: Mapping[str, Floats],
    index: Mapping[str, int],
    step: float,
) -> Script:
    """Compile the storyboard of each run.

    Args:
        formulas: Scenarios of the batch with their parameters.
        road: The road of each run.
        begins: Where each actor starts along it (B,) [m].
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
        row[:, storyboard.ACTION_RELATIVE] = row[:, storyboard.ACTION_LANE] = -1.0
        delay = formulas.limited(
            f"storyboard.{name}.delay",
            lambda s, name=name: s.storyboard[name].delay,  # type: ignore[misc]
            above=BELOW_ZERO,
            default=0.0,
            unit="s",
        )
        row[:, storyboard.ACTION_DELAY] = np.ceil(delay / step - _ROUNDING)
        _fill_action(row, name, formulas, road, begins)
        if event.speed is not None and event.speed.relative_to is not None:
            row[:, storyboard.ACTION_RELATIVE] = index[f"{event.speed.relative_to}.speed"]
    events = list(scenario.storyboard)
    order = np.array([events.index(name) for name in scenario.acting_order], dtype=np.int64)
    numbers = np.zeros(actions.shape[:2], dtype=np.int64)
    programs = compile_conditions(_triggers(formulas), index, numbers)
    return Script(actions, programs, numbers, order)


def _fill_action(
    row: Floats, name: str, formulas: Formulas, road: RoadMap, begins: Mapping[str, Floats]
) -> None:
    event = formulas.scenario.storyboard[name]
    where = f"storyboard.{name}"
    if event.lane_change is not None:
        _fill_lane_change(row, name, formulas, road, begins)
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


def _fill_lane_change(
    row: Floats, name: str, formulas: Formulas, road: RoadMap, begins: Mapping[str, Floats]
) -> None:
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
    # A lane may shift: while its actor drives, the target is where the lane is beside it.
    begin = begins[formulas.scenario.storyboard[name].actor]
    if road.slabs.shape[1]:
        row[:, storyboard.ACTION_LANE] = lane
    row[:, storyboard.ACTION_TARGET] = centers(f"{part}.to_lane", road, lane, begin)


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


def centers(what: str, road: RoadMap, lane: Floats, s: Floats, *, oncoming: bool = False) -> Floats:
    """Return d of the centre of a lane of each run (B,) [m].

    Args:
        what: Name of the field, for the message.
        road: The road of each run.
        lane: (B,) numbers.
        s: Along the road (B,) [m].
        oncoming: Whether the lanes are those of the other way.

    Raises:
        SpecError: Such a lane is not there.
    """
    found = road.centers(lane, s, oncoming=oncoming)
    missing = np.isnan(found)
    if missing.any():
        way = "the other way" if oncoming else "the ego's way"
        raise SpecError(
            f"{what}: the road has no lane {lane[missing][0]:g} of {way} at {s[missing][0]:g} m",
            remedy="Start elsewhere, name another lane, or ask for other places.",
        )
    return found


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
                own = box_of(ego[run], ego_size[run])
                row[5] = box_distance(own, box_of(objects[run, thing], sizes[run, thing]))
