"""One master clock: durations and rates as whole numbers of its ticks."""

from __future__ import annotations

import math

from adeye.errors import SpecError, UsageError
from adeye.units import shown

TOLERANCE = 1e-6
"""Relative distance from a whole number of ticks that is taken for rounding."""


MAX_TICKS = 1_000_000
"""Most ticks of a run, and so of every time within it."""


def require_step(step: object) -> None:
    """Refuse what is no step of a run, as an ODD does.

    Raises:
        UsageError: It is no number above 0 s, or above 1 s.
    """
    if isinstance(step, bool) or not isinstance(step, int | float) or not 0.0 < step <= 1.0:
        raise UsageError(f"step is {shown(step)}", remedy="Give seconds above 0, at most 1.")


def ticks(duration: float, step: float, what: str) -> int:
    """Express a duration in ticks.

    Args:
        duration: [s], not negative.
        step: Master clock [s].
        what: Name of the quantity, for the message.

    Raises:
        SpecError: It is no whole number of ticks, or too many; the message names the nearest.

    >>> ticks(0.15, 0.05, "latency")
    3
    """
    count = duration / step
    if count > MAX_TICKS:
        raise _too_long(what, f"{duration:g} s", step)
    nearest = round(count)
    if abs(count - nearest) > TOLERANCE * max(1.0, abs(count)):
        low, high = math.floor(count) * step, math.ceil(count) * step
        raise SpecError(
            f"{what}: {duration:g} s is no whole number of steps of {step:g} s",
            remedy=f"The nearest are {low:g} s and {high:g} s.",
        )
    return nearest


def period_ticks(rate: float, step: float, what: str) -> int:
    """Express the period of a rate in ticks.

    Args:
        rate: [Hz], positive.
        step: Master clock [s].
        what: Name of the quantity, for the message.

    Raises:
        SpecError: The rate does not divide the clock's; the message names the nearest that do.

    >>> period_ticks(10.0, 0.05, "rate")
    2
    """
    if rate * step < 1.0 / MAX_TICKS:
        raise _too_long(what, f"a period of {1.0 / rate:g} s", step)
    count = 1.0 / (rate * step)
    nearest = round(count)
    if nearest < 1 or abs(count - nearest) > TOLERANCE * max(1.0, count):
        low = max(1, math.floor(count))
        rates = sorted({1.0 / (low * step), 1.0 / ((low + 1) * step)})
        raise SpecError(
            f"{what}: {rate:g} Hz does not divide the clock's {1.0 / step:g} Hz",
            remedy="The nearest that do are " + " and ".join(f"{r:g} Hz" for r in rates) + ".",
        )
    return nearest


def _too_long(what: str, duration: str, step: float) -> SpecError:
    return SpecError(
        f"{what}: {duration} is more than {MAX_TICKS:,} steps of {step:g} s",
        remedy="Take a shorter time or a longer step.",
    )
