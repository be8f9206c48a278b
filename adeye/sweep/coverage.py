"""How much of an ODD test cases cover: combinations of bins of its attributes.

A combination is feasible if there is a witness, a point within the ranges of the scenario's
parameters that fulfils its constraints and lies in these bins. Points are looked for on a grid that
is dense where a bin is: a parameter that is an attribute itself stays within the bin.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations, pairwise, product
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.fields import fields_of
from adeye.kernel.relation import SLACK
from adeye.sweep.axes import default_values, ends_of
from adeye.units import UNITS, Dimension

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.spec.expression import Expression
    from adeye.spec.odd import Attributes, CoverageBins
    from adeye.spec.scenario import LogicalScenario
    from adeye.sweep.boundary import Columns

# --- Bins of an ODD's attributes: which a point has, and which the ODD has at all -----------------

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
        **fields_of(scenario.environment, "rain", "fog_visibility", "friction"),
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


# --- Which combinations of bins some scenario can have: those for which a point is found ----------

Tuple = tuple[tuple[str, ...], tuple[int, ...]]
"""Attributes and the numbers of their bins."""

POINTS: Final = 4_096
"""Points that are looked at for one combination."""
_INSET: Final = 1e-6
"""Share of a bin that its edges are kept away from, so that a point is in one bin only."""


class Witnesses:
    """Finds which combinations of bins the scenarios of an ODD can have.

    Args:
        scenarios: Overrides applied, each different one once.
        bins: Of each attribute.
        strength: How many attributes are combined.
    """

    def __init__(self, scenarios: Iterable[LogicalScenario], bins: Bins, strength: int) -> None:
        self._bins, self._strength = bins, strength
        self.found: set[Tuple] = set()
        for scenario in scenarios:
            self._look(scenario)

    def _look(self, scenario: LogicalScenario) -> None:
        ranges = _ranges(scenario)
        fixed = default_values(scenario)
        everywhere = self._seen(scenario, ranges, fixed)
        # A combination of bins each of which some point has: only these are looked for apart.
        single = {name: set(codes[codes != NO_BIN].tolist()) for name, codes in everywhere.items()}
        identities = {
            name: formula.text.strip()
            for name, formula in formulas(scenario).items()
            if name in self._bins and formula.text.strip() in ranges
        }
        for name, parameter in identities.items():
            low, high = ranges[parameter]
            single[name] |= {
                number
                for number, item in enumerate(self._bins[name])
                if item.low <= high and (low < item.high or (item.is_last and low <= item.high))
            }
        for names in combinations(self._bins, self._strength):
            for levels in product(*(sorted(single[name]) for name in names)):
                if (names, levels) not in self.found:
                    within = {
                        identities[name]: self._bins[name][level]
                        for name, level in zip(names, levels, strict=True)
                        if name in identities
                    }
                    narrowed = _narrowed(ranges, within)
                    if narrowed is not None:
                        self._seen(scenario, narrowed, fixed)

    def _seen(
        self,
        scenario: LogicalScenario,
        ranges: Mapping[str, tuple[float, float]],
        fixed: Mapping[str, float],
    ) -> dict[str, NDArray[np.int64]]:
        """Place points, keep what they witness, and give the bins of those that are possible."""
        columns: dict[str, NDArray[np.float64] | float] = {**fixed, **_spread(ranges)}
        mask = np.ones(POINTS, dtype=np.bool_)
        for constraint in scenario.constraints:
            mask &= np.broadcast_to(constraint.fulfilled(columns), (POINTS,))
        codes = {
            name: own[..., mask]
            for name, own in codes_of(scenario, columns, POINTS, self._bins).items()
        }
        if mask.any():
            self.found |= tuples_of(codes, self._strength).keys()
        return codes


def tuples_of(codes: Mapping[str, NDArray[np.int64]], strength: int) -> dict[Tuple, int]:
    """Count the combinations of bins that points have; a point without a bin counts nowhere.

    Args:
        codes: (N,) number of the bin by attribute; (K, N) of one with several values at once,
            which are different.
        strength: How many attributes are combined.
    """
    found: dict[Tuple, int] = {}
    sizes = {name: int(own.max(initial=NO_BIN)) + 1 for name, own in codes.items()}
    for names in combinations(codes, strength):
        shape = tuple(sizes[name] for name in names)
        if not all(shape):
            continue
        counts = np.zeros(math.prod(shape), dtype=np.int64)
        for rows in product(*(np.atleast_2d(codes[name]) for name in names)):
            has_all = np.logical_and.reduce([row != NO_BIN for row in rows])
            flat = np.ravel_multi_index([row[has_all] for row in rows], shape)
            counts += np.bincount(flat, minlength=len(counts))
        for place in np.flatnonzero(counts).tolist():
            levels = tuple(int(level) for level in np.unravel_index(place, shape))
            found[names, levels] = int(counts[place])
    return found


def _ranges(scenario: LogicalScenario) -> dict[str, tuple[float, float]]:
    """Give the ranges of parameters in SI; one without a range stays at its default."""
    found: dict[str, tuple[float, float]] = {}
    for name, parameter in scenario.parameters.items():
        if parameter.range is not None:
            found[name] = ends_of(parameter.range)
    return found


def _narrowed(
    ranges: Mapping[str, tuple[float, float]], within: Mapping[str, Bin]
) -> dict[str, tuple[float, float]] | None:
    """Keep parameters within bins; None where one of them cannot be."""
    found = dict(ranges)
    for name, item in within.items():
        inset = _INSET * (item.high - item.low)
        low = max(found[name][0], item.low)
        high = min(found[name][1], item.high if item.is_last else item.high - inset)
        if low > high:
            return None
        found[name] = (low, high)
    return found


def _spread(ranges: Mapping[str, tuple[float, float]]) -> dict[str, NDArray[np.float64]]:
    """Spread points over a box: evenly, and on its sides, where limits often are.

    Source:
        Roberts (2018), "The unreasonable effectiveness of quasirandom sequences": steps are powers
        of the root of x^(d+1) = x + 1.
    """
    root = 2.0
    for _ in range(64):
        root = (1.0 + root) ** (1.0 / (len(ranges) + 1))
    numbers = np.arange(1, POINTS + 1)
    found: dict[str, NDArray[np.float64]] = {}
    for at, (name, (low, high)) in enumerate(ranges.items(), start=1):
        share = np.mod(0.5 + numbers * root**-at, 1.0)
        # A tenth of the points at each side, which sides meet is as even as the points.
        share = np.clip((share - 0.1) / 0.8, 0.0, 1.0)
        found[name] = low + (high - low) * share
    return found


# --- How much of an ODD test cases cover: combinations of bins of its attributes ------------------


@dataclass(frozen=True, slots=True)
class Situations:
    """Planned points of one scenario, or those that were executed.

    Attributes:
        scenario: Overrides applied.
        columns: Its parameters in SI, scalars or (N,).
        count: N.
    """

    scenario: LogicalScenario
    columns: Columns
    count: int


@dataclass(frozen=True, slots=True)
class Combination:
    """What is covered of one attribute, or of some together.

    Attributes:
        attributes: Which.
        total: Combinations of their bins.
        feasible: Those that some scenario of the ODD can have.
        covered: Feasible ones that some situation has.
        uncovered: The others of the feasible ones, by the labels of their bins.
        impossible: Those that no scenario can have.
        counts: Situations of each covered one, in the order of the bins; one with actors of several
            kinds counts for each.
    """

    attributes: tuple[str, ...]
    total: int
    feasible: int
    covered: int
    uncovered: tuple[tuple[str, ...], ...]
    impossible: tuple[tuple[str, ...], ...]
    counts: tuple[tuple[tuple[str, ...], int], ...]


@dataclass(frozen=True, slots=True)
class Coverage:
    """What situations cover of an ODD.

    Attributes:
        situations: How many were looked at.
        outside: Those with an attribute in no bin, which count for the other attributes only.
        strength: Most attributes that are combined.
        combinations: One by one first, then together.
    """

    situations: int
    outside: int
    strength: int
    combinations: tuple[Combination, ...]


def coverage_of(
    attributes: Attributes,
    declared: CoverageBins | None,
    strength: int,
    situations: Iterable[Situations],
) -> Coverage:
    """Count what situations cover.

    Args:
        attributes: The ODD's.
        declared: Bins that it declares.
        strength: Most attributes that are combined, at least one.
        situations: Planned or executed ones. Of a scenario of the ODD as its file has it there may
            be none: what a sweep took from it stays feasible.
    """
    bins = bins_of(attributes, declared)
    sizes = range(1, strength + 1)
    counts: dict[Tuple, int] = {}
    scenarios: dict[int, LogicalScenario] = {}
    looked = outside = 0
    for part in situations:
        scenarios[id(part.scenario)] = part.scenario
        if not part.count:
            continue
        codes = codes_of(part.scenario, part.columns, part.count, bins)
        looked += part.count
        # One with several values is in a bin if one of them is.
        missing = [np.atleast_2d(own == NO_BIN).all(axis=0) for own in codes.values()]
        outside += int(np.logical_or.reduce(missing).sum())
        for size in sizes:
            for key, count in tuples_of(codes, size).items():
                counts[key] = counts.get(key, 0) + count
    # What a situation has is feasible, however it came about.
    feasible = set(counts)
    for size in sizes:
        feasible |= Witnesses(scenarios.values(), bins, size).found
    found = tuple(
        _combination(names, bins, feasible, counts)
        for size in sizes
        for names in combinations(bins, size)
    )
    return Coverage(looked, outside, strength, found)


def _combination(
    names: tuple[str, ...], bins: Bins, feasible: set[Tuple], counts: dict[Tuple, int]
) -> Combination:
    uncovered: list[tuple[str, ...]] = []
    impossible: list[tuple[str, ...]] = []
    covered: list[tuple[tuple[str, ...], int]] = []
    for levels in product(*(range(len(bins[name])) for name in names)):
        labels = tuple(bins[name][level].label for name, level in zip(names, levels, strict=True))
        if (names, levels) in counts:
            covered.append((labels, counts[names, levels]))
        elif (names, levels) in feasible:
            uncovered.append(labels)
        else:
            impossible.append(labels)
    return Combination(
        names,
        len(covered) + len(uncovered) + len(impossible),
        len(covered) + len(uncovered),
        len(covered),
        tuple(uncovered),
        tuple(impossible),
        tuple(covered),
    )
