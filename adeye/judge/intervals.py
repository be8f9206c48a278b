"""Intervals of fault handling: what detects, what handles, and the times between, in one place.

Timelines (a run against its twins) and the metrics of a single run share all of it; they differ in
which alarms do not count: for a timeline those that the fault-free twin has as well, for a metric
those that have been on since before the fault.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from adeye.judge.trace_signals import STANDSTILL_SPEED
from adeye.signals import MANOEUVRE_MONITORS, NO_CHANNEL, REASON_STALENESS, Bools, Floats, Ints

BRAKES_FROM: Final = 0.5
"""Commanded deceleration from which the ego brakes and does not only coast [m/s²]."""


@dataclass(frozen=True, slots=True)
class Intervals:
    """Intervals of fault handling [s], shape (...), NaN for what did not come to its end.

    Attributes:
        fdti: Fault detection time interval: from the fault to its detection.
        frti: Fault reaction time interval: from there to safe state or emergency operation.
        fhti: Fault handling time interval, both together.
        eoti: Emergency operation time interval: from emergency operation to the safe state.
    """

    fdti: Floats
    frti: Floats
    fhti: Floats
    eoti: Floats


def intervals(fault: Floats, detect: Floats, emergency: Floats, safe: Floats) -> Intervals:
    """Give the intervals between four times of a run.

    Args:
        fault: (...) when a fault is first present [s]; NaN for what never happens, here and below.
        detect: (...) when it is detected [s].
        emergency: (...) when emergency operation begins [s].
        safe: (...) when the safe state is reached for good [s].

    Source:
        ISO 26262-1:2018, 3.43, 3.44 (emergency operation) and 3.54 to 3.61.

    >>> found = intervals(*np.array([1.0, 1.2, 1.5, 4.0]))
    >>> [round(float(value), 6) for value in (found.fdti, found.frti, found.fhti, found.eoti)]
    [0.2, 0.3, 0.5, 2.5]
    """
    fdti = np.asarray(detect - fault)
    # What handles the fault may act before it is told to: then nothing is left to react.
    frti = np.maximum(0.0, np.fmin(safe, emergency) - detect)
    return Intervals(fdti, frti, np.asarray(fdti + frti), np.maximum(0.0, safe - emergency))


def alarms(monitors: NDArray[Any], reason: NDArray[Any], names: Sequence[str]) -> Bools:
    """Tell at which rows something is found to be wrong.

    Args:
        monitors: (..., T, Q, 2) raw and confirmed state of the monitors.
        reason: (..., T) why the acting channel acts.
        names: (Q,) of the monitors. What tells the manoeuvre detects nothing: a monitor has done
            so before.

    Returns:
        (..., T, A): each monitor that detects is confirmed; the switch finds the acting channel
        unusable.
    """
    detecting = [at for at, name in enumerate(names) if name not in MANOEUVRE_MONITORS]
    confirmed = [monitors[..., at, 1] != 0 for at in detecting]
    return np.stack([*confirmed, np.asarray(reason == REASON_STALENESS)], axis=-1)


def any_of(flags: Bools) -> Bools:
    """Tell at which rows (..., T) any flag (..., T, A) is on."""
    # Flag by flag: numpy is slow along an axis of few.
    return reduce(np.logical_or, np.moveaxis(flags, -1, 0))


def held_since_before(on: Bools, onset: Ints) -> Bools:
    """Tell at which rows from another on an alarm has been on since before it, without a break.

    Args:
        on: (R, T, A) alarms.
        onset: (R,) rows to begin with.
    """
    held = np.zeros_like(on)
    before = on[np.arange(len(onset)), np.maximum(onset - 1, 0)] & (onset > 0)[:, np.newaxis]
    # Few alarms are on before a fault.
    for run, alarm in np.argwhere(before):
        later = on[run, onset[run] :, alarm]
        held[run, onset[run] :, alarm] = np.logical_and.accumulate(later)
    return held


def others_act(authority: NDArray[Any], default: int) -> Bools:
    """Tell at which rows (...) another channel than the default acts."""
    return np.asarray((authority != default) & (authority != NO_CHANNEL))


def brakes(acceleration: Floats) -> Bools:
    """Tell at which rows (...) the acting command [m/s²] brakes."""
    return np.asarray(acceleration <= -BRAKES_FROM)


@dataclass(frozen=True, slots=True)
class Degradation:
    """What a supervisor makes of its alarms, (..., T); nowhere without a supervisor.

    Attributes:
        in_force: A minimal-risk manoeuvre is in force.
        goes_on: A monitor is confirmed, and the drive shall go on without a manoeuvre, now and to
            the end: what leads to a manoeuvre later has not been handled by going on till then.
    """

    in_force: Bools
    goes_on: Bools


def degradation(monitors: NDArray[Any], names: Sequence[str]) -> Degradation:
    """Read the columns that tell the manoeuvre.

    Args:
        monitors: (..., T, Q, 2) raw and confirmed state of the monitors.
        names: (Q,) of the monitors.
    """
    asked, in_force, confirmed = np.zeros((3, *monitors.shape[:-2]), dtype=np.bool_)
    for at, name in enumerate(names):
        if name in MANOEUVRE_MONITORS:
            asked |= monitors[..., at, 0] != 0
            in_force |= monitors[..., at, 1] != 0
        else:
            confirmed |= monitors[..., at, 1] != 0
    if not set(names) & set(MANOEUVRE_MONITORS):
        confirmed[...] = False
    is_needed = asked | in_force
    later = np.logical_or.accumulate(is_needed[..., ::-1], axis=-1)[..., ::-1]
    return Degradation(in_force, confirmed & ~later)


def operates_in_emergency(
    acts: Bools, acceleration: Floats, speed: Floats, degraded: Degradation
) -> Bools:
    """Tell at which rows (...) there is emergency operation.

    Another channel than the default acts, and brakes, stands, or is on its way to a safe stop: one
    that leads into a refuge may begin without braking. To act is not enough, for a channel may get
    authority and drive on. Or a supervisor lets the drive go on in spite of its alarms.

    Args:
        acts: (...) whether another channel than the default acts.
        acceleration: (...) of the acting command [m/s²].
        speed: (...) of the ego [m/s].
        degraded: (...) what a supervisor makes of its alarms.
    """
    does = brakes(acceleration) | (np.abs(speed) <= STANDSTILL_SPEED) | degraded.in_force
    return np.asarray((acts & does) | degraded.goes_on)


def first_from(flags: Bools, onset: Ints) -> Ints:
    """Find the first row from another on, -1 for none.

    Args:
        flags: (R, T).
        onset: (R,) rows to begin with.
    """
    later = flags & (np.arange(flags.shape[1]) >= onset[:, np.newaxis])
    return np.where(later.any(axis=1), later.argmax(axis=1), -1)
