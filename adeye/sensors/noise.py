"""Noise of pixels: how often it alone crosses the threshold, and where."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from adeye.kernel.elementary import exp, log
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.random import normal_pair, uniform

if TYPE_CHECKING:
    import numpy as np

GREATEST: Final = 8.6
"""No draw of ``kernel.random.normal`` lies further out: sqrt(-2 ln(2**-53)) = 8.57."""

_ROOT_TWO_PI: Final = 2.50662827463100050242
_FEW: Final = 1e-5
_FAR: Final = 1_000_000_000


@compiled
def upper_tail(x: float) -> float:
    """Probability that a standard normal number is at least x.

    Args:
        x: Not negative.

    Source:
        Abramowitz and Stegun (1964), 26.2.11 (series, near) and 26.2.14 (continued fraction, far).

    >>> round(upper_tail(1.0), 10), upper_tail(6.0) < 1e-9
    (0.1586552539, True)
    """
    density = exp(-0.5 * x * x) / _ROOT_TWO_PI
    if x < 3.0:
        term = total = x
        for odd in range(3, 121, 2):
            term *= x * x / odd
            total += term
        return 0.5 - density * total
    rest = x
    for numerator in range(60, 0, -1):
        rest = x + numerator / rest
    return density / rest


@compiled
def log_of_miss(threshold: float, sigma: float) -> float:
    """Logarithm of the probability that noise alone stays below the threshold; 0 for certain.

    Args:
        threshold: Positive.
        sigma: Standard deviation of the noise, in the same unit.
    """
    if not (sigma > 0.0 and threshold < GREATEST * sigma):
        return 0.0
    crossing = upper_tail(threshold / sigma)
    if crossing < _FEW:
        return -crossing - 0.5 * crossing * crossing
    return log(1.0 - crossing)


@inlined
def skip(missing: float, seed: np.uint64, owner: np.uint64, sample: int, index: int) -> int:
    """Draw how many pixels in a row noise alone leaves below the threshold.

    The geometric distribution: as if every pixel had its own draw, for one draw per crossing.

    Args:
        missing: ``log_of_miss`` of the pixels, negative.
        seed: Stream seed of the run.
        owner: Of the sensor.
        sample: Number of its sample.
        index: Of the draw.
    """
    count = log(uniform(seed, owner, sample, index)) / missing
    return int(count) if count < _FAR else _FAR


@inlined
def noise_of(pixel: int, seed: np.uint64, owner: np.uint64, sample: int) -> float:
    """Draw the standard normal noise of a pixel; two of them share a pair."""
    one, other = normal_pair(seed, owner, sample, pixel >> 1)
    return other if pixel & 1 else one
