"""The beams of a scanning sensor: their directions, and where they meet upright boxes."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.elementary import atan2, sin_cos
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.sight import COSINE, DX, DY, SINE

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Rows of a table of beams, in the vehicle frame.
(
    BEAM_X,  # unit vector of its direction in plan view
    BEAM_Y,
    BEAM_SLOPE,  # how much it rises per metre in plan view
    BEAM_SECANT,  # its length per metre in plan view
    BEAM_BEARING,  # in (-pi, pi] [rad]
    BEAM_ELEVATION,  # above the horizon [rad]
) = range(6)
BEAM_WIDTH: Final = 6

_STEEPEST: Final = 1e-9
"""Least length in plan view of a beam of length 1: one straight down hits the ground below."""

_SLOWEST: Final = 1e-200
"""Stands for a rate of 0: lengths divided by it neither overflow nor fit into any scene."""

_SLACK: Final = 1e-6
"""Share of the spacing by which an interval of beams is widened: where a beam meets the edge of a
box, the ray decides and not how a bearing was rounded."""


@compiled
def fill_beams(
    yaw: float,
    pitch: float,
    field_of_view: float,
    vertical_field_of_view: float,
    beams: int,
    layers: int,
    table: Floats,
) -> float:
    """Find the directions of all beams, layer by layer from the lowest to the highest.

    The beams of a layer stand evenly, each in the middle of its part of the field of view; layers
    stand evenly from edge to edge. A pitch turns about the left axis before the yaw, as in ISO
    8855: the nose goes down where it is positive.

    Args:
        yaw: Of the sensor in the vehicle [rad].
        pitch: [rad].
        field_of_view: Within a layer [rad].
        vertical_field_of_view: From the lowest to the highest layer [rad].
        beams: In a layer.
        layers: At least 1.
        table: (BEAM_WIDTH, layers * beams) out.

    Returns:
        Largest difference between the bearing of a beam about the yaw, and its angle within its
        layer [rad]: 0 without pitch.
    """
    pitch_sine, pitch_cosine = sin_cos(pitch)
    departure = 0.0
    for layer in range(layers):
        elevation = 0.0
        if layers > 1:
            elevation = (layer / (layers - 1) - 0.5) * vertical_field_of_view
        sine, cosine = sin_cos(elevation)
        for beam in range(beams):
            angle = ((beam + 0.5) / beams - 0.5) * field_of_view
            aside, ahead = sin_cos(angle)
            x = pitch_cosine * cosine * ahead + pitch_sine * sine
            y = cosine * aside
            z = pitch_cosine * sine - pitch_sine * cosine * ahead
            level = max(_STEEPEST, math.sqrt(x * x + y * y))
            # Without pitch it is the angle itself, which rounding must not change.
            about = atan2(y, x) if pitch != 0.0 else angle
            departure = max(departure, abs(wrap_to_pi(about - angle)))
            bearing = wrap_to_pi(yaw + about)
            place = layer * beams + beam
            table[BEAM_Y, place], table[BEAM_X, place] = sin_cos(bearing)
            table[BEAM_SLOPE, place] = z / level
            table[BEAM_SECANT, place] = 1.0 / level
            table[BEAM_BEARING, place] = bearing
            table[BEAM_ELEVATION, place] = atan2(z, level)
    return departure


@inlined
def beams_between(right: float, left: float, field_of_view: float, beams: int) -> tuple[int, int]:
    """Return the first and the last beam of a layer between two angles; last < first if none.

    Args:
        right: About the middle of the field of view [rad].
        left: Not below the right one [rad].
        field_of_view: [rad].
        beams: In the layer.
    """
    per_angle = beams / field_of_view
    first = math.ceil((right + 0.5 * field_of_view) * per_angle - 0.5 - _SLACK)
    last = math.floor((left + 0.5 * field_of_view) * per_angle - 0.5 + _SLACK)
    return max(0, int(first)), min(beams - 1, int(last))


@inlined
def scan_box(
    look: Floats,
    size: Floats,
    sine: float,
    cosine: float,
    height: float,
    table: Floats,
    first: int,
    last: int,
    thing: int,
    nearest: Floats,
    who: Ints,
) -> None:
    """Cast some beams at an upright box that stands on the ground, and keep the nearest hits.

    Args:
        look: (OUTLINE_WIDTH,) of the box from the sensor, its shape known, see ``sight``.
        size: (3,) length, width, height [m].
        sine: Of the heading of the vehicle that carries the sensor.
        cosine: Of the same.
        height: Of the sensor above the ground [m].
        table: (BEAM_WIDTH, P) see ``fill_beams``.
        first: Beam.
        last: Beam.
        thing: What a beam that meets the box first has hit.
        nearest: (P,) distance in plan view of the nearest hit so far [m], in and out.
        who: (P,) what is hit there, in and out.
    """
    along, across, turn_sine, turn_cosine = _in_box(look, sine, cosine)
    half_length, half_width, half_height = 0.5 * size[0], 0.5 * size[1], 0.5 * size[2]
    xs, ys = table[BEAM_X][first : last + 1], table[BEAM_Y][first : last + 1]
    slopes = table[BEAM_SLOPE][first : last + 1]
    so_far, found = nearest[first : last + 1], who[first : last + 1]
    # Without a jump, so that several beams are cast at a time.
    for beam in range(xs.shape[0]):
        x, y, before = xs[beam], ys[beam], so_far[beam]
        near, far = _cut(along, x * turn_cosine + y * turn_sine, half_length, 0.0, before)
        near, far = _cut(across, y * turn_cosine - x * turn_sine, half_width, near, far)
        near, far = _cut(height - half_height, slopes[beam], half_height, near, far)
        is_hit = (near <= far) & (near < before)
        so_far[beam] = near if is_hit else before
        found[beam] = thing if is_hit else found[beam]


@inlined
def scan_box_level(
    look: Floats,
    size: Floats,
    sine: float,
    cosine: float,
    height: float,
    table: Floats,
    first: int,
    last: int,
    thing: int,
    nearest: Floats,
    who: Ints,
) -> None:
    """Do what ``scan_box`` does for beams that neither rise nor fall, in less time."""
    if not 0.0 <= height <= size[2]:
        return
    along, across, turn_sine, turn_cosine = _in_box(look, sine, cosine)
    half_length, half_width = 0.5 * size[0], 0.5 * size[1]
    xs, ys = table[BEAM_X][first : last + 1], table[BEAM_Y][first : last + 1]
    so_far, found = nearest[first : last + 1], who[first : last + 1]
    for beam in range(xs.shape[0]):
        x, y, before = xs[beam], ys[beam], so_far[beam]
        near, far = _cut(along, x * turn_cosine + y * turn_sine, half_length, 0.0, before)
        near, far = _cut(across, y * turn_cosine - x * turn_sine, half_width, near, far)
        is_hit = (near <= far) & (near < before)
        so_far[beam] = near if is_hit else before
        found[beam] = thing if is_hit else found[beam]


@inlined
def _in_box(look: Floats, sine: float, cosine: float) -> tuple[float, float, float, float]:
    """Return where a sensor is in the frame of a box [m], and the heading of the box.

    The heading, as sine and cosine, is that in the vehicle, so that one table of beams serves for
    every heading of the vehicle.
    """
    c, s = look[COSINE], look[SINE]
    return (
        -look[DX] * c - look[DY] * s,
        look[DX] * s - look[DY] * c,
        s * cosine - c * sine,
        c * cosine + s * sine,
    )


@inlined
def _cut(start: float, rate: float, half: float, near: float, far: float) -> tuple[float, float]:
    """Cut [near, far] down to the part of a ray with abs(start + rate * t) <= half, without jumps.

    A ray along a slab moves through it so slowly that it is inside for ever, or never.
    """
    rate = rate if rate != 0.0 else _SLOWEST
    one, other = (-half - start) / rate, (half - start) / rate
    enter = one if one < other else other
    leave = other if one < other else one
    return (enter if enter > near else near), (leave if leave < far else far)
