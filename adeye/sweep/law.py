"""A declared distribution in SI: what it can yield, and its quantiles.

A draw is the quantile of a number on (0, 1), so a law serves independent draws and space-filling
designs alike. The normal quantile is ``scipy.special.ndtri``, within some units in the last place;
another version of SciPy may round another way. That is why points are stored as values: what a run
depends on is the value, not the way to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from adeye.errors import SweepError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.errors import SourceLocation


@dataclass(frozen=True, eq=False)
class Law:
    """How the values of one axis are distributed; each kind uses its own fields.

    Attributes:
        kind: ``uniform``, ``normal``, ``lognormal``, ``empirical`` or ``choice``.
        low: Least value that it can yield, minus infinity if there is none.
        high: Largest one.
        centre: Mean of the normal, or of the logarithm.
        spread: Standard deviation of the same.
        values: (N,) of an empirical law, in ascending order.
        weights: (L,) of the levels of a choice.
    """

    kind: str
    low: float = -math.inf
    high: float = math.inf
    centre: float = 0.0
    spread: float = 1.0
    values: NDArray[np.float64] | None = None
    weights: tuple[float, ...] = ()

    def quantile(self, share: NDArray[np.float64]) -> NDArray[np.float64]:
        """Give the values below which the law lies with some probability.

        Args:
            share: (N,) probabilities, 0 < share < 1.

        Returns:
            (N,) values in SI; of a choice the numbers of its levels.
        """
        if self.kind == "uniform":
            return self.low + (self.high - self.low) * share
        if self.kind == "choice":
            ends = np.cumsum(self.weights)
            found = np.searchsorted(ends, share, side="right")
            return np.minimum(found, len(ends) - 1).astype(np.float64)
        if self.kind == "empirical":
            assert self.values is not None
            at = np.minimum((share * len(self.values)).astype(np.int64), len(self.values) - 1)
            return self.values[at]
        if self.kind == "lognormal":
            low = math.log(self.low) if self.low > 0.0 else -math.inf
            high = math.log(self.high)
            made: NDArray[np.float64] = np.exp(self._normal(share, low, high))
        else:
            made = self._normal(share, self.low, self.high)
        # Rounding may not lead out of the ends.
        return np.minimum(np.maximum(made, self.low), self.high)

    def mass(self) -> float:
        """Tell how much of the normal law lies between the ends."""
        from scipy.special import ndtr

        low, high = self._ends()
        # The upper tail as the lower one of the mirror image, where numbers are finer.
        return float(ndtr(-low) - ndtr(-high) if low > 0.0 else ndtr(high) - ndtr(low))

    def _ends(self) -> tuple[float, float]:
        low, high = self.low, self.high
        if self.kind == "lognormal":
            low, high = (math.log(low) if low > 0.0 else -math.inf), math.log(high)
        return (low - self.centre) / self.spread, (high - self.centre) / self.spread

    def _normal(self, share: NDArray[np.float64], low: float, high: float) -> NDArray[np.float64]:
        from scipy.special import ndtr, ndtri

        first, last = (low - self.centre) / self.spread, (high - self.centre) / self.spread
        # Above the mean the same law upside down, whose tail is not lost near 1.
        side = -1.0 if first > 0.0 else 1.0
        below, above = ndtr(side * first), ndtr(side * last)
        made: NDArray[np.float64] = ndtri(below + (above - below) * share)
        return self.centre + side * self.spread * made


def require_mass(law: Law, name: str, where: SourceLocation) -> None:
    """Refuse a law that its ends cut off so far that nothing is left to draw from.

    Raises:
        SweepError: The ends are empty, or hold less than a billionth of the law.
    """
    if not law.low < law.high:
        raise SweepError(
            f"{name}: from {law.low:g} to {law.high:g} (SI) nothing is left",
            where=where,
            remedy="Give min below max.",
        )
    if law.kind in {"normal", "lognormal"} and not law.mass() >= 1e-9:
        raise SweepError(
            f"{name}: only {law.mass():.2g} of the {law.kind} distribution lies between its ends",
            where=where,
            remedy="Move min and max towards the mean.",
        )
