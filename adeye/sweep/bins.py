"""Bins of an ODD's attributes: which a point has, and which the ODD has at all."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.kernel.relation import SLACK
from adeye.units import UNITS, Dimension

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.spec.bins import CoverageBins
    from adeye.spec.expression import Expression
    from adeye.spec.odd import Attributes
    from adeye.spec.scenario import LogicalScenario
    from adeye.sweep.boundary import Columns

DEFAULT_EDGES: Final[dict[str, tuple[float, ...]]] = {
    "ego_speed": (0.0, 30.0 / 3.6, 60.0 / 3.6, 90.0 / 3.6, 130.0 / 3.6),
    # Below drizzle, light, moderate and heavy rain (American Meteorological Society).
    "rain": (0.0, 0.1 / 3.6e6, 2.5 / 3.6e6, 7.6 / 3.6e6, 50.0 / 3.6e6),
    # Dense, thick and thin fog, mist and haze, clear.
    "fog_visibility": (0.0, 50.0, 200.0, 1000.0, 100_000.0),
    # Ice and snow, wet, damp, dry.
    "friction": (0.0, 0.3, 0.5, 0.7, 1.2),
}
ASKED_EDGES: Final[dict[str, tuple[float, ...]]] = {
    "radius": (0.0, 250.0, 500.0, 1000.0, 2000.0, 5000.0, 100_000.0),
    # A low sun stands in the view of a camera, a high one does not.
    "sun_elevation": tuple(math.radians(degrees) for degrees in (0.0, 10.0, 30.0, 60.0, 90.0)),
}
"""Of attributes that have bins only where the ODD speaks of them."""
DIMENSIONS: Final = {
    "ego_speed": Dimension.SPEED,
    "rain": Dimension.RAIN_RATE,
    "fog_visibility": Dimension.LENGTH,
    "friction": Dimension.NONE,
    "radius": Dimension.LENGTH,
    "sun_elevation": Dimension.ANGLE,
}
STRAIGHT: Final = "straight"
NO_SUN: Final = "no sun"
"""Of an environment without a sun, or with one below the horizon: nobody looks into it."""
NO_ACTOR: Final = "none"
SIDES: Final = ("ahead", "left", "behind", "right")
"""Quarters in which the sun stands, seen along the road at its start."""
NO_BIN: Final = -1


@dataclass(frozen=True, slots=True)
class Bin:
    """One bin: a label, or values from ``low`` to ``high`` in SI.

    Attributes:
        label: For people, and of an attribute with labels the value itself.
        low: Lower edge, which belongs to it; NaN for a label.
        high: Upper edge.
        is_last: Whether the upper edge belongs to it, too.
    """

    label: str
    low: float = math.nan
    high: float = math.nan
    is_last: bool = False


Bins = dict[str, tuple[Bin, ...]]


def bins_of(attributes: Attributes, declared: CoverageBins | None) -> Bins:
    """Give the bins of each attribute as far as the ODD has them.

    Args:
        attributes: The ODD's, whose limits cut the bins off.
        declared: Edges that the ODD declares.
    """
    scenery, environment = attributes.scenery, attributes.environment
    found: Bins = {
        "road_type": tuple(map(Bin, scenery.road_type)),
        "lanes": tuple(
            Bin(str(count)) for count in range(scenery.lanes.min, scenery.lanes.max + 1)
        ),
        "illumination": tuple(map(Bin, environment.illumination)),
    }
    speed = attributes.dynamic_elements.ego_speed
    limits: dict[str, tuple[float, float]] = {
        "ego_speed": (-math.inf, math.inf if speed is None else speed.max),
        "rain": (-math.inf, math.inf if environment.rain is None else environment.rain.max),
        "fog_visibility": (
            -math.inf if environment.fog is None else environment.fog.min_visibility,
            math.inf,
        ),
        "friction": (
            -math.inf if environment.friction is None else environment.friction.min,
            math.inf,
        ),
    }
    for name, (low, high) in limits.items():
        edges = (None if declared is None else getattr(declared, name)) or DEFAULT_EDGES[name]
        is_default = edges is DEFAULT_EDGES[name]
        # An ODD that goes on beyond the default bins has one more.
        if is_default and edges[-1] < high < math.inf:
            edges = (*edges, high)
        found[name] = _bands(edges, low, high, DIMENSIONS[name])
    return found | _asked(attributes, declared)


def _asked(attributes: Attributes, declared: CoverageBins | None) -> Bins:
    """Give the bins of attributes that only some ODDs speak of."""
    sun, radius = attributes.environment.sun_elevation, attributes.scenery.min_radius
    lows = {"radius": radius, "sun_elevation": None if sun is None else sun.min}
    firsts = {"radius": Bin(STRAIGHT), "sun_elevation": Bin(NO_SUN, -0.5 * math.pi, 0.0)}
    found: Bins = {}
    for name, low in lows.items():
        edges = None if declared is None else getattr(declared, name)
        if edges is not None or low is not None:
            limit = -math.inf if low is None else low
            edges = edges or ASKED_EDGES[name]
            bands = _bands(edges, limit, math.inf, DIMENSIONS[name])
            found[name] = (firsts[name], *bands) if bands else ()
    if found.get("sun_elevation"):
        found["sun_azimuth"] = tuple(map(Bin, (NO_SUN, *SIDES)))
    kinds = (declared.actors if declared else None) or attributes.dynamic_elements.actors
    if kinds:
        found["actors"] = tuple(map(Bin, (NO_ACTOR, *dict.fromkeys(kinds))))
    return found


def _bands(
    edges: Sequence[float], low: float, high: float, dimension: Dimension
) -> tuple[Bin, ...]:
    """Cut edges off at the limits of the ODD."""
    slack = SLACK * max(map(abs, edges))
    inside = [edge for edge in edges if low + slack < edge < high - slack]
    if edges[0] <= low + slack and low <= edges[-1]:
        inside = [low, *inside]
    if edges[-1] >= high - slack and high >= edges[0]:
        inside = [*inside, high]
    if len(inside) == 1:
        # The limit of the ODD leaves one value, as no rain at all.
        return (Bin(_written((inside[0],), dimension), inside[0], inside[0], is_last=True),)
    return tuple(
        Bin(_written(ends, dimension), *ends, at == len(inside) - 2)
        for at, ends in enumerate(pairwise(inside))
    )


def _written(ends: tuple[float, ...], dimension: Dimension) -> str:
    unit = UNITS[dimension.unit] if dimension.unit else UNITS["m"]
    numbers = [f"{end * unit.denominator / unit.numerator + 0.0:.6g}" for end in ends]
    return f"{' to '.join(numbers)} {dimension.unit}".rstrip()


def formulas(scenario: LogicalScenario) -> dict[str, Expression]:
    """Give the formula of each attribute that is a number in this scenario."""
    found = {
        "ego_speed": scenario.ego.speed,
        "rain": scenario.environment.rain,
        "fog_visibility": scenario.environment.fog_visibility,
        "friction": scenario.environment.friction,
        "radius": scenario.world.road.radius,
        "sun_elevation": scenario.environment.sun_elevation,
    }
    return {name: formula for name, formula in found.items() if formula is not None}


def codes_of(
    scenario: LogicalScenario, columns: Columns, count: int, bins: Bins
) -> dict[str, NDArray[np.int64]]:
    """Tell which bin each point has.

    Args:
        scenario: The scenario, overrides applied.
        columns: Its parameters in SI, scalars or (N,).
        count: N.
        bins: Of each attribute.

    Returns:
        (N,) number of the bin by attribute, ``NO_BIN`` where there is none; of an attribute that
        has several values at once, as actors of different kinds, (K, N).
    """
    labels = _labels(scenario)
    numbers = {
        name: np.broadcast_to(np.asarray(formula.evaluate(columns), dtype=float), (count,))
        for name, formula in formulas(scenario).items()
        if name in bins
    }
    found: dict[str, NDArray[np.int64]] = {}
    for name, own in bins.items():
        if name == "actors":
            rows = [_coded(label, own, count) for label in _kinds(scenario)]
            found[name] = np.stack(rows)
        elif name == "sun_azimuth":
            found[name] = _azimuth_codes(scenario, columns, numbers.get("sun_elevation"), count)
        elif name in numbers:
            # A curve to the right has a negative radius.
            values = np.abs(numbers[name]) if name == "radius" else numbers[name]
            found[name] = codes_of_values(values, own)
        else:
            found[name] = _coded(labels[name], own, count)
    return found


def _coded(label: str, bins: Sequence[Bin], count: int) -> NDArray[np.int64]:
    words = [item.label for item in bins]
    return np.full(count, words.index(label) if label in words else NO_BIN, dtype=np.int64)


def _azimuth_codes(
    scenario: LogicalScenario,
    columns: Columns,
    elevation: NDArray[np.float64] | None,
    count: int,
) -> NDArray[np.int64]:
    """Tell in which quarter the sun stands, from 1, and 0 where there is none: (N,)."""
    if elevation is None:
        return np.zeros(count, dtype=np.int64)
    formula = scenario.environment.sun_azimuth
    value = 0.0 if formula is None else formula.evaluate(columns)
    azimuth = np.broadcast_to(np.asarray(value, dtype=float), (count,))
    quarters = np.floor(azimuth / (0.5 * math.pi) + 0.5 + SLACK).astype(np.int64)
    return np.where(elevation < 0.0, 0, 1 + quarters % len(SIDES))


def codes_of_values(values: NDArray[np.float64], bins: Sequence[Bin]) -> NDArray[np.int64]:
    """Tell which band each value lies in, ``NO_BIN`` where none does: (N,)."""
    codes = np.full(len(values), NO_BIN, dtype=np.int64)
    for number, item in enumerate(bins):
        slack = SLACK * max(abs(item.low), abs(item.high))
        below = values <= item.high + slack if item.is_last else values < item.high - slack
        codes[(values >= item.low - slack) & below] = number
    return codes


def _kinds(scenario: LogicalScenario) -> list[str]:
    """Name the kinds of its actors, each once."""
    return sorted({str(actor.kind) for actor in scenario.actors.values()}) or [NO_ACTOR]


def _labels(scenario: LogicalScenario) -> Mapping[str, str]:
    """Give the attributes that are no number, and what stands where one has no formula."""
    road = scenario.world.road
    return {
        "road_type": road.road_type,
        "lanes": str(road.lanes),
        "illumination": scenario.environment.illumination,
        "radius": STRAIGHT,
        "sun_elevation": NO_SUN,
    }
