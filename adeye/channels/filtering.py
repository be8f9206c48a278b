"""The filter of a track: place and velocity in the plane, with everything that they share.

A Kalman filter at nearly constant velocity. Place along and place across the line of sight and the
range rate are taken in one after the other, as independent numbers, so nothing is inverted. What
the axes share is kept: a range rate tells one component of the velocity, and if that were split
into two numbers known for themselves, a few radars would soon be sure of a lateral speed that none
of them has seen.

Source:
    Bar-Shalom, Li & Kirubarajan (2001), "Estimation with applications to tracking and navigation",
    section 6.2.2 (white noise acceleration, discretised).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from adeye.channels.tracks import (
    TRACK_COV_V,
    TRACK_COV_X,
    TRACK_COV_X_VY,
    TRACK_COV_XY,
    TRACK_COV_Y,
    TRACK_COV_Y_VX,
    TRACK_VAR_VX,
    TRACK_VAR_VY,
    TRACK_VAR_X,
    TRACK_VAR_Y,
    TRACK_VX,
    TRACK_VY,
    TRACK_X,
    TRACK_Y,
)
from adeye.kernel.jit import inlined

if TYPE_CHECKING:
    from adeye.signals import Floats

FREEDOM_X: Final = 10.0
FREEDOM_Y: Final = 0.5
"""Spectral density of the unknown acceleration of a track [m²/s³]: within one second its velocity
changes by 3.2 m/s along and 0.7 m/s across with one standard deviation, hard braking and quick
lane changes by two to three of them. Our choice."""

_LEAST_VARIANCE: Final = 1e-9
"""No variance falls below it, whatever rounding does."""

Four = tuple[float, float, float, float]

Belief = tuple[Four, Four, tuple[float, float, float], tuple[float, float, float]]
"""What is held of a track: x, vx, y, vy; the variances of these; their covariances x-vx, x-y, x-vy
and vx-y, vx-vy, y-vy."""


@inlined
def read_belief(track: Floats) -> Belief:
    """Read what is held of a track.

    Args:
        track: (TRACK_STATE,).
    """
    return (
        (track[TRACK_X], track[TRACK_VX], track[TRACK_Y], track[TRACK_VY]),
        (track[TRACK_VAR_X], track[TRACK_VAR_VX], track[TRACK_VAR_Y], track[TRACK_VAR_VY]),
        (track[TRACK_COV_X], track[TRACK_COV_XY], track[TRACK_COV_X_VY]),
        (track[TRACK_COV_Y_VX], track[TRACK_COV_V], track[TRACK_COV_Y]),
    )


@inlined
def write_belief(track: Floats, belief: Belief) -> None:
    """Write what is held of a track.

    Args:
        track: (TRACK_STATE,) in and out.
        belief: See ``Belief``.
    """
    mean, variance, first, second = belief
    track[TRACK_X], track[TRACK_VX], track[TRACK_Y], track[TRACK_VY] = mean
    track[TRACK_VAR_X], track[TRACK_VAR_VX] = variance[0], variance[1]
    track[TRACK_VAR_Y], track[TRACK_VAR_VY] = variance[2], variance[3]
    track[TRACK_COV_X], track[TRACK_COV_XY], track[TRACK_COV_X_VY] = first
    track[TRACK_COV_Y_VX], track[TRACK_COV_V], track[TRACK_COV_Y] = second


@inlined
def learn(belief: Belief, weights: Four, measured: float, noise: float) -> Belief:
    """Take in one number that is a weighted sum of x, vx, y, vy.

    Args:
        belief: See ``Belief``.
        weights: Of x, vx, y, vy.
        measured: The number.
        noise: Variance of its error.
    """
    (x, vx, y, vy), (x_x, v_v, y_y, w_w), (x_v, x_y, x_w), (v_y, v_w, y_w) = belief
    a, b, c, d = weights
    # Covariances of the number with x, vx, y, vy; w stands for vy.
    to_x = a * x_x + b * x_v + c * x_y + d * x_w
    to_v = a * x_v + b * v_v + c * v_y + d * v_w
    to_y = a * x_y + b * v_y + c * y_y + d * y_w
    to_w = a * x_w + b * v_w + c * y_w + d * w_w
    scale = 1.0 / (a * to_x + b * to_v + c * to_y + d * to_w + noise)
    error = measured - (a * x + b * vx + c * y + d * vy)
    gain_x, gain_v, gain_y, gain_w = scale * to_x, scale * to_v, scale * to_y, scale * to_w
    return (
        (x + gain_x * error, vx + gain_v * error, y + gain_y * error, vy + gain_w * error),
        (
            max(_LEAST_VARIANCE, x_x - gain_x * to_x),
            max(_LEAST_VARIANCE, v_v - gain_v * to_v),
            max(_LEAST_VARIANCE, y_y - gain_y * to_y),
            max(_LEAST_VARIANCE, w_w - gain_w * to_w),
        ),
        (x_v - gain_x * to_v, x_y - gain_x * to_y, x_w - gain_x * to_w),
        (v_y - gain_v * to_y, v_w - gain_v * to_w, y_w - gain_y * to_w),
    )


@inlined
def grow(track: Floats, period: float) -> None:
    """Let the uncertainty of a track grow over a period.

    Args:
        track: (TRACK_STATE,) in and out.
        period: [s].
    """
    _grow_axis(track, TRACK_VAR_X, period, FREEDOM_X)
    _grow_axis(track, TRACK_VAR_Y, period, FREEDOM_Y)
    x_vy, y_vx, speeds = track[TRACK_COV_X_VY], track[TRACK_COV_Y_VX], track[TRACK_COV_V]
    track[TRACK_COV_XY] += period * (x_vy + y_vx + period * speeds)
    track[TRACK_COV_X_VY] = x_vy + period * speeds
    track[TRACK_COV_Y_VX] = y_vx + period * speeds


@inlined
def _grow_axis(track: Floats, column: int, period: float, freedom: float) -> None:
    """Let the uncertainty of one axis grow over a period (white acceleration)."""
    var, cov, rate = track[column], track[column + 1], track[column + 2]
    track[column] = var + period * (2.0 * cov + period * (rate + period * freedom / 3.0))
    track[column + 1] = cov + period * (rate + 0.5 * period * freedom)
    track[column + 2] = rate + period * freedom


@inlined
def forget_motion(track: Floats, variance: float) -> None:
    """Take a track to stand, with the same uncertainty along and across.

    Args:
        track: (TRACK_STATE,) in and out.
        variance: Of each component of its velocity [m²/s²].
    """
    track[TRACK_VX] = track[TRACK_VY] = 0.0
    track[TRACK_COV_X] = track[TRACK_COV_Y] = track[TRACK_COV_V] = 0.0
    track[TRACK_COV_X_VY] = track[TRACK_COV_Y_VX] = 0.0
    track[TRACK_VAR_VX] = track[TRACK_VAR_VY] = variance
