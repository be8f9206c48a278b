"""A slowly changing bias: a first-order Gauss-Markov process, sampled.

Its values are normal with one standard deviation for ever, and two of them are correlated by
``exp(-time between / correlation time)``. A long correlation time is a constant unknown offset, a
short one is white noise.

Source:
    Maybeck (1979), "Stochastic models, estimation, and control", volume 1, section 4.11.
"""

from __future__ import annotations

import math

from adeye.kernel.elementary import exp
from adeye.kernel.jit import inlined

__all__ = ["next_bias", "share_kept", "share_new"]


def share_kept(period: float, correlation_time: float) -> float:
    """Return the share of a bias that is left at the next sample.

    Args:
        period: Time between two samples [s].
        correlation_time: > 0 [s].
    """
    return float(exp(-period / correlation_time))


def share_new(kept: float) -> float:
    """Return the share of its deviation that comes anew, so that the deviation stays as it is."""
    return math.sqrt((1.0 - kept) * (1.0 + kept))


@inlined
def next_bias(
    bias: float,
    sigma: float,
    kept: float,
    new: float,
    draw: float,
    is_first: bool,  # noqa: FBT001 - a kernel
) -> float:
    """Return the bias of a sample from that of the sample before.

    Args:
        bias: Of the sample before; it does not matter for the first.
        sigma: Standard deviation of the bias.
        kept: ``share_kept``.
        new: ``share_new``.
        draw: A standard normal number.
        is_first: Whether this is the first sample, which is drawn from the stationary distribution.
    """
    if is_first:
        return sigma * draw
    return kept * bias + new * sigma * draw
