"""Which combinations of bins some scenario can have: those for which a point is found.

A combination is feasible if there is a witness, a point within the ranges of the scenario's
parameters that fulfils its constraints and lies in these bins. Points are looked for on a grid that
is dense where a bin is: a parameter that is an attribute itself stays within the bin.
"""

from __future__ import annotations

import math
from itertools import combinations, product
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.sweep.axes import default_values, quantity_or_text
from adeye.sweep.bins import NO_BIN, codes_of, formulas

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

    from adeye.spec.scenario import LogicalScenario
    from adeye.sweep.bins import Bin, Bins

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
        fixed = {**default_values(scenario)}
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
            for levels in _product([sorted(single[name]) for name in names]):
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
            low, high = (float(quantity_or_text(end)[0]) for end in parameter.range)
            found[name] = (low, high)
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


def _product(levels: list[list[int]]) -> list[tuple[int, ...]]:
    made: list[tuple[int, ...]] = [()]
    for own in levels:
        made = [(*head, level) for head in made for level in own]
    return made
