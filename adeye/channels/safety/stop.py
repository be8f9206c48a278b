"""The in-lane safe stop: how hard to brake, from its onset to standstill."""

from __future__ import annotations

from typing import Any, Final

from adeye.channels.driving import HOLD_DECELERATION, STANDSTILL
from adeye.kernel.control import limit_jerk
from adeye.kernel.jit import compiled
from adeye.kernel.motion import clip
from adeye.kernel.stops import BRAKES_AT_ONCE, ONSET_JERK

RESERVE: Final = 1.2
"""How much more than the required deceleration is commanded, for the lag of the brakes and for
what the object may still do. Our choice."""


@compiled
def stop_acceleration(
    record: Any,
    previous: float,
    speed: float,
    required: float,
    is_danger: bool,  # noqa: FBT001 - a kernel
) -> float:
    """Return the acceleration of the safe stop at this tick [m/s²].

    The stop deceleration if it is enough, up to the emergency deceleration if an object in the path
    needs more; then it is built up at once, else at limited jerk. What an object needed is kept as
    long as the danger is confirmed, because an object that has left the measurements may still be
    there; once the monitor has healed, the stop goes on with no more than its own deceleration, so
    that it does not endanger who follows.

    Args:
        record: Has ``stop_deceleration``, ``emergency_deceleration`` [m/s²] and ``period`` [s].
        previous: Acceleration of the stop at the previous tick, at its onset that of the ego
            [m/s²].
        speed: Of the ego [m/s].
        required: Required deceleration for the objects in the path [m/s²].
        is_danger: Whether an object ahead is a confirmed danger.
    """
    wanted = record["stop_deceleration"]
    return brake(record, previous, speed, wanted, ONSET_JERK, required, is_danger)


@compiled
def brake(  # noqa: PLR0913, PLR0917 - a kernel
    record: Any,
    previous: float,
    speed: float,
    wanted: float,
    jerk: float,
    required: float,
    is_danger: bool,  # noqa: FBT001 - a kernel
) -> float:
    """Return the acceleration on the way to a deceleration, or to what an object needs [m/s²].

    Args:
        record: See ``stop_acceleration``.
        previous: Acceleration of the stop at the previous tick [m/s²].
        speed: Of the ego [m/s].
        wanted: Deceleration if no object needs more [m/s²].
        jerk: How quickly that is built up [m/s³].
        required: Required deceleration for the objects in the path [m/s²].
        is_danger: Whether an object ahead is a confirmed danger.
    """
    hardest = max(record["emergency_deceleration"], record["stop_deceleration"])
    if speed < STANDSTILL:
        return -float(min(HOLD_DECELERATION, hardest))
    if RESERVE * required > wanted:
        wanted = min(RESERVE * required, hardest)
        jerk = BRAKES_AT_ONCE
    if is_danger:
        wanted = max(wanted, -previous)
    return clip(limit_jerk(previous, -wanted, jerk, record["period"]), -hardest, 0.0)
