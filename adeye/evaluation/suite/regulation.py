"""The least forward detection range that UN R157 asks for."""

from __future__ import annotations

from itertools import pairwise
from typing import Final

TABLE: Final = (
    (60.0 / 3.6, 46.0),
    (70.0 / 3.6, 50.0),
    (80.0 / 3.6, 60.0),
    (90.0 / 3.6, 75.0),
    (100.0 / 3.6, 90.0),
    (110.0 / 3.6, 110.0),
    (120.0 / 3.6, 130.0),
    (130.0 / 3.6, 150.0),
)
"""Highest speed of the system [m/s] and least forward detection range [m], from the foremost point
of the vehicle: UN R157, 01 series of amendments, paragraph 7.1.1. Between the rows it is
interpolated linearly here."""


def least_forward_range(speed: float) -> float | None:
    """Return the least forward detection range for a system of some highest speed [m].

    Args:
        speed: [m/s].

    Returns:
        That of 60 km/h for all below; None above 130 km/h, where the regulation ends.

    >>> least_forward_range(130.0 / 3.6)
    150.0
    """
    if speed <= TABLE[0][0]:
        return TABLE[0][1]
    for (low, near), (high, far) in pairwise(TABLE):
        if speed <= high:
            return far if speed == high else near + (far - near) * (speed - low) / (high - low)
    return None


def speed_by_range(forward_range: float) -> float | None:
    """Return the highest speed for which a forward detection range suffices [m/s].

    Args:
        forward_range: [m].

    Returns:
        None below the range of 60 km/h; 130 km/h at most.
    """
    if forward_range < TABLE[0][1]:
        return None
    for (low, near), (high, far) in pairwise(TABLE):
        if forward_range < far:
            return low + (high - low) * (forward_range - near) / (far - near)
    return TABLE[-1][0]
