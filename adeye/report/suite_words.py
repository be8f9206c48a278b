"""Speeds, shares and ranges of a suite as people read them; rounding never flatters."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from adeye.report.words import DASH, MINUS

if TYPE_CHECKING:
    from adeye.evaluation.suite.results import ForwardRange, SpeedRange

KMH: Final = 3.6
_SLOWEST_SAID: Final = 10.5
"""Speeds [km/h] from which the lowest one is worth a word; the search begins at 10."""


def kmh(speed: float) -> str:
    """Write a speed in whole km/h, rounded down: what is promised must hold.

    >>> kmh(27.7)
    '99'
    """
    return f"{math.floor(speed * KMH + 1e-6)}"


def percent(share: float) -> str:
    """Write a share in whole percent; only all is 100, and only nothing is 0.

    >>> percent(0.9999), percent(1.0), percent(0.001), percent(0.0)
    ('99', '100', '1', '0')
    """
    if 0.0 < share < 0.01:
        return "1"
    return f"{math.floor(100.0 * share + 1e-9)}"


def metres(value: float | None) -> str:
    """Write range to spare in whole metres, rounded down.

    >>> metres(12.7), metres(-0.2) == f"{MINUS}1", metres(None) == DASH
    ('+12', True, True)
    """
    if value is None:
        return DASH
    whole = math.floor(value + 1e-6)
    return f"{MINUS}{-whole}" if whole < 0 else f"+{whole}"


def left_speed(speed: float | None) -> str:
    """Write a speed that is left, ``none`` for none."""
    return "none" if speed is None else kmh(speed)


def speed_text(found: SpeedRange, odd_speed: float | None) -> str:
    """Write the highest speed with the sensor that it rests on; ``!`` is below the ODD's.

    Args:
        found: Speeds that a suite supports.
        odd_speed: Highest of the ODD, if there is one [m/s].
    """
    if found.highest_mps is None or found.lowest_mps is None:
        return "none" if odd_speed is None else "none !"
    text = f"> {kmh(found.highest_mps)}" if found.is_limit else kmh(found.highest_mps)
    if odd_speed is not None and found.highest_mps < odd_speed:
        text += " !"
    if found.lowest_mps * KMH > _SLOWEST_SAID:
        text += f" (from {math.ceil(found.lowest_mps * KMH - 1e-6)})"
    return f"{text} {found.sensor}"


def forward_text(found: ForwardRange) -> str:
    """Write the speed that UN R157 allows for a forward range; ``!`` is below the ODD's."""
    if not found.sensor:
        return "none" if found.needed_m is None else "none !"
    limit = "< 60" if found.speed_mps is None else kmh(found.speed_mps)
    is_short = found.needed_m is not None and found.range_m < found.needed_m
    return f"{limit}{' !' if is_short else ''} by {math.floor(found.range_m)} m"
