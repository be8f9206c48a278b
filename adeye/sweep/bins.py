"""Bins of an ODD's attributes: which a point has, and which the ODD has at all."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.units import UNITS, Dimension

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.spec.bins import CoverageBins
    from adeye.spec.expression import Expression
    from adeye.spec.odd import Attributes
    from adeye.spec.scenario import LogicalScenario
    from adeye.sweep.boundary import Columns

SLACK: Final = 1e-9
"""Relative slack at an edge, so that one written in another unit still has its own value."""
DEFAULT_EDGES: Final[dict[str, tuple[float, ...]]] = {
    "ego_speed": (0.0, 30.0 / 3.6, 60.0 / 3.6, 90.0 / 3.6, 130.0 / 3.6),
    # Below drizzle, light, moderate and heavy rain (American Meteorological Society).
    "rain": (0.0, 0.1 / 3.6e6, 2.5 / 3.6e6, 7.6 / 3.6e6, 50.0 / 3.6e6),
    # Dense, thick and thin fog, mist and haze, clear.
    "fog_visibility": (0.0, 50.0, 200.0, 1000.0, 100_000.0),
    # Ice and snow, wet, damp, dry.
    "friction": (0.0, 0.3, 0.5, 0.7, 1.2),
}
DIMENSIONS: Final = {
    "ego_speed": Dimension.SPEED,
    "rain": Dimension.RAIN_RATE,
    "fog_visibility": Dimension.LENGTH,
    "friction": Dimension.NONE,
}
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
    """Give the formula of each attribute that is a number."""
    return {
        "ego_speed": scenario.ego.speed,
        "rain": scenario.environment.rain,
        "fog_visibility": scenario.environment.fog_visibility,
        "friction": scenario.environment.friction,
    }


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
        (N,) number of the bin by attribute, ``NO_BIN`` where there is none.
    """
    labels = _labels(scenario)
    found: dict[str, NDArray[np.int64]] = {}
    for name, own in bins.items():
        if name in labels:
            words = [item.label for item in own]
            code = words.index(labels[name]) if labels[name] in words else NO_BIN
            found[name] = np.full(count, code, dtype=np.int64)
        else:
            value = formulas(scenario)[name].evaluate(columns)
            values = np.broadcast_to(np.asarray(value, dtype=float), (count,))
            found[name] = codes_of_values(values, own)
    return found


def codes_of_values(values: NDArray[np.float64], bins: Sequence[Bin]) -> NDArray[np.int64]:
    """Tell which band each value lies in, ``NO_BIN`` where none does: (N,)."""
    codes = np.full(len(values), NO_BIN, dtype=np.int64)
    for number, item in enumerate(bins):
        slack = SLACK * max(abs(item.low), abs(item.high))
        below = values <= item.high + slack if item.is_last else values < item.high - slack
        codes[(values >= item.low - slack) & below] = number
    return codes


def _labels(scenario: LogicalScenario) -> Mapping[str, str]:
    road = scenario.world.road
    return {
        "road_type": road.road_type,
        "lanes": str(road.lanes),
        "illumination": scenario.environment.illumination,
    }
