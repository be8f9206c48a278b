"""Trigger variables: what a condition of a storyboard or of a fault's onset may name.

``time``; ``ego.speed``, ``ego.s``, ``ego.d``; for every actor and static object ``speed``, ``s``,
``d``, ``gap``, ``ttc`` and ``distance``; ``<event>.begun`` and ``ended(<event>)`` as 1 or 0,
``<event>.begun_at`` and ``since(<event>)``, undefined before it begins; the scenario's parameters.
Gaps run along the lane that the ego drives, see ``kernel.road.lane_way``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.kernel.elementary import cos, sin_cos
from adeye.kernel.geometry import box_distance
from adeye.kernel.jit import compiled
from adeye.kernel.postfix import PUSH_VARIABLE
from adeye.kernel.road import lane_way
from adeye.kernel.storyboard import EVENT_VARIABLES
from adeye.signals import (
    EGO_HEADING,
    EGO_SPEED,
    EGO_X,
    EGO_Y,
    OBJECT_HEADING,
    OBJECT_SPEED,
    OBJECT_X,
    OBJECT_Y,
    PLACE_CURVATURE,
    PLACE_D,
    PLACE_HEADING,
    PLACE_S,
    Bools,
    Floats,
    Ints,
    Scene,
    SceneContext,
)
from adeye.spec.expression import parse
from adeye.units import Dimension

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.spec.scenario import LogicalScenario, Parameter
    from adeye.world.formulas import Situation

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
    for what in EVENT_VARIABLES:
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
        names += [f"{event}.{what}" for what in EVENT_VARIABLES for event in context.event_ids]
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

    def watch(self, ops: Ints, args: Floats, also: Ints | None = None) -> None:
        """Fill from now on only what some programs read: most conditions name few of the variables.

        Args:
            ops: (P, L) operations of the programs, see ``kernel.postfix``.
            args: (P, L) their arguments.
            also: (N,) variables that something else reads.
        """
        self._wanted[:] = False
        self._wanted[args[ops == PUSH_VARIABLE].astype(np.int64)] = True
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
    bend = place[PLACE_CURVATURE]
    return float(max(0.0, 1.0 - bend * d) / max(1e-3, 1.0 - bend * place[PLACE_D]))


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
        ego_s = ego_place[run, PLACE_S]
        road = ego_place[run, PLACE_HEADING]
        angle = ego[run, EGO_HEADING] - road
        extent = road_extent(ego_size[run], angle)
        along = ego[run, EGO_SPEED] * cos(angle)
        table[run, 1] = ego[run, EGO_SPEED]
        table[run, 2] = ego_s
        table[run, 3] = ego_place[run, PLACE_D]
        for thing in range(objects.shape[1]):
            first = FIRST_OBJECT + 6 * thing
            row = table[run, first : first + 6]
            heading = objects[run, thing, OBJECT_HEADING]
            turned = heading - places[run, thing, PLACE_HEADING]
            speed = objects[run, thing, OBJECT_SPEED]
            row[0] = speed
            row[1] = places[run, thing, PLACE_S]
            row[2] = places[run, thing, PLACE_D]
            if wanted[first + 3] or wanted[first + 4]:
                there = places[run, thing, PLACE_HEADING]
                apart = lane_way(ego_s, road, ego_place[run, PLACE_D], row[1], there)
                row[3] = road_gap(apart, extent, road_extent(sizes[run, thing], turned))
                # What drives beside gains on the ego's lane by the radii of the two.
                carried = lane_share(places[run, thing], ego_place[run, PLACE_D])
                row[4] = road_ttc(row[3], along, carried * speed * cos(turned))
            if wanted[first + 5]:
                row[5] = box_distance(
                    ego[run, EGO_X],
                    ego[run, EGO_Y],
                    ego[run, EGO_HEADING],
                    ego_size[run, 0],
                    ego_size[run, 1],
                    objects[run, thing, OBJECT_X],
                    objects[run, thing, OBJECT_Y],
                    heading,
                    sizes[run, thing, 0],
                    sizes[run, thing, 1],
                )
