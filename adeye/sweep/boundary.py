"""Check planned attributes of points against the ODD's attributes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.relation import differences
from adeye.spec.expression import Expression
from adeye.units import Dimension, format_quantity

if TYPE_CHECKING:
    from adeye.spec.odd import Attributes
    from adeye.spec.scenario import LogicalScenario

Columns = Mapping[str, NDArray[np.float64] | float]


@dataclass(frozen=True, slots=True)
class Breach:
    """One attribute that some points leave.

    Attributes:
        attribute: Its name in the ODD.
        outside: (N,) which points leave it.
        text: What the first of them has, and what is allowed.
    """

    attribute: str
    outside: NDArray[np.bool_]
    text: str


def breaches(
    scenario: LogicalScenario, columns: Columns, count: int, attributes: Attributes
) -> list[Breach]:
    """List the attributes that points of a scenario leave.

    Args:
        scenario: The scenario, overrides applied.
        columns: Its parameters in SI, scalars or (N,).
        count: N.
        attributes: The ODD's.

    Returns:
        One entry per attribute that at least one point leaves.
    """
    found = [*_labels(scenario, count, attributes)]
    for name, expression, dimension, low, high in _limits(scenario, attributes):
        values = np.broadcast_to(np.asarray(expression.evaluate(columns), dtype=float), (count,))
        if name == "radius":
            # A curve to the right has a negative one.
            values = np.abs(values)
        outside = np.zeros(count, dtype=bool)
        if low is not None:
            outside |= ~(differences(values, low) >= 0.0)
        if high is not None:
            outside |= ~(differences(values, high) <= 0.0)
        if name == "sun elevation":
            # Below the horizon it blinds nobody.
            outside &= ~(values < 0.0)
        if outside.any():
            value = float(values[np.argmax(outside)])
            side, limit = ("above", high) if high is not None and value > high else ("below", low)
            assert limit is not None
            found.append(
                Breach(
                    name,
                    outside,
                    f"{name}: {format_quantity(value, dimension)} is {side} the ODD's "
                    f"{'maximum' if side == 'above' else 'minimum'} "
                    f"{format_quantity(limit, dimension)}",
                )
            )
    return found


Limit = tuple[str, Expression, Dimension, float | None, float | None]


def _limits(scenario: LogicalScenario, attributes: Attributes) -> Iterator[Limit]:
    conditions, environment = attributes.environment, scenario.environment
    if conditions.sun_elevation is not None and environment.sun_elevation is not None:
        low = conditions.sun_elevation.min
        yield "sun elevation", environment.sun_elevation, Dimension.ANGLE, low, None
    if conditions.rain:
        yield "rain", environment.rain, Dimension.RAIN_RATE, None, conditions.rain.max
    if conditions.friction:
        yield "friction", environment.friction, Dimension.NONE, conditions.friction.min, None
    if conditions.fog:
        low = conditions.fog.min_visibility
        yield "fog visibility", environment.fog_visibility, Dimension.LENGTH, low, None
    if attributes.dynamic_elements.ego_speed:
        top = attributes.dynamic_elements.ego_speed.max
        yield "ego_speed", scenario.ego.speed, Dimension.SPEED, None, top
        if scenario.ego.desired_speed is not None:
            yield "ego_speed", scenario.ego.desired_speed, Dimension.SPEED, None, top
    if attributes.scenery.min_radius is not None and scenario.world.road.radius is not None:
        low = attributes.scenery.min_radius
        yield "radius", scenario.world.road.radius, Dimension.LENGTH, low, None


def _labels(scenario: LogicalScenario, count: int, attributes: Attributes) -> Iterator[Breach]:
    everywhere = np.ones(count, dtype=bool)
    road, scenery = scenario.world.road, attributes.scenery
    least, most = road.lane_counts
    if least < scenery.lanes.min or most > scenery.lanes.max:
        found = f"{least} to {most}" if least < most else f"{most}"
        text = f"{found} lanes, the ODD has {scenery.lanes.min} to {scenery.lanes.max}"
        yield Breach("lanes", everywhere, text)
    if road.road_type not in scenery.road_type:
        text = f"road type {road.road_type}, the ODD has {', '.join(scenery.road_type)}"
        yield Breach("road_type", everywhere, text)
    light = scenario.environment.illumination
    if light not in attributes.environment.illumination:
        allowed = ", ".join(attributes.environment.illumination)
        yield Breach("illumination", everywhere, f"illumination {light}, the ODD has {allowed}")
    kinds = attributes.dynamic_elements.actors
    for name, actor in scenario.actors.items():
        if kinds and actor.kind not in kinds:
            text = f"actor {name} is a {actor.kind}, the ODD has {', '.join(kinds)}"
            yield Breach("actors", everywhere, text)
