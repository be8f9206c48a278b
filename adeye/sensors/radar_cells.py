"""From the echoes of a radar to its detections: cells, threshold, errors, false alarms, clutter."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from adeye.kernel.elementary import log, sin_cos
from adeye.kernel.geometry import wrap_to_pi
from adeye.kernel.jit import inlined
from adeye.kernel.random import normal, normal_pair, uniform
from adeye.sensors.delivery import insert
from adeye.sensors.radar_equation import LEAST_SIGNAL

if TYPE_CHECKING:
    import numpy as np

    from adeye.signals import Floats, Ints

# Columns of an echo, and of a detection.
(
    ECHO_SIGNAL,  # mean signal-to-noise ratio, 0 for none
    ECHO_RANGE,  # [m]
    ECHO_BEARING,  # from the boresight [rad]
    ECHO_RATE,  # [m/s]
    ECHO_X,  # place in the vehicle frame, of a detection only [m]
    ECHO_Y,
) = range(6)
ECHO_WIDTH: Final = 6

DRAWS: Final = 3
"""Random numbers per object and sample: fluctuation; range and bearing; range rate."""

FIRST_GHOST: Final = 1 << 24
"""Where the random numbers of false alarms and clutter begin: behind those of every object, so that
another object leaves them as they were."""

FINEST: Final = 0.05
"""Standard deviation that no echo is strong enough to fall below, in cells: calibration and the
extent of objects, which signal-to-noise ratio does not improve. Our choice."""


@inlined
def same_cell(parameters: Any, one: Floats, other: Floats) -> bool:
    """Tell whether two echoes are too near each other in range, bearing and rate to be told apart.

    Cells have no fixed edges: what counts is the difference.
    """
    if not abs(one[ECHO_RANGE] - other[ECHO_RANGE]) < parameters["range_resolution"]:
        return False
    if not abs(one[ECHO_RATE] - other[ECHO_RATE]) < parameters["range_rate_resolution"]:
        return False
    apart = wrap_to_pi(one[ECHO_BEARING] - other[ECHO_BEARING])
    return bool(abs(apart) < parameters["bearing_resolution"])


@inlined
def folded(rate: float, most: float) -> float:
    """Return the range rate that a chirp sequence shows for a true one [m/s], in [-most, most).

    Args:
        rate: [m/s].
        most: Half of the span that it can tell apart [m/s].
    """
    if -most <= rate < most:
        return rate
    span = 2.0 * most
    return rate - span * math.floor((rate + most) / span)


@inlined
def _gather(parameters: Any, echoes: Floats) -> int:
    """Join the strongest echo that is left with all in its cell, and return its object, or -1.

    Echoes of one cell add in power, because their phases are independent; the sum lies at their
    mean, weighted with the power. So a weak object beside a strong one is not seen on its own.

    Args:
        parameters: Record of the sensor.
        echoes: (M, ECHO_WIDTH) in and out: what is joined has no signal any more.
    """
    strongest = -1
    most = 0.0
    for thing in range(echoes.shape[0]):
        if echoes[thing, ECHO_SIGNAL] > most:
            strongest, most = thing, echoes[thing, ECHO_SIGNAL]
    if strongest < 0:
        return -1
    peak = echoes[strongest]
    signal = away = aside = faster = 0.0
    for thing in range(echoes.shape[0]):
        echo = echoes[thing]
        share = echo[ECHO_SIGNAL]
        if thing == strongest or not share > 0.0 or not same_cell(parameters, peak, echo):
            continue
        signal += share
        away += share * (echo[ECHO_RANGE] - peak[ECHO_RANGE])
        aside += share * wrap_to_pi(echo[ECHO_BEARING] - peak[ECHO_BEARING])
        faster += share * (echo[ECHO_RATE] - peak[ECHO_RATE])
        echo[ECHO_SIGNAL] = 0.0
    if signal > 0.0:
        total = most + signal
        peak[ECHO_SIGNAL] = total
        peak[ECHO_RANGE] += away / total
        peak[ECHO_BEARING] += aside / total
        peak[ECHO_RATE] += faster / total
    return strongest


@inlined
def _received(
    parameters: Any, seed: np.uint64, owner: np.uint64, number: int, thing: int, signal: float
) -> float:
    """Draw the power of a cell in units of the mean noise; 0 if it stays below the threshold.

    Echo and noise of a fluctuating (Swerling 1) target have an exponentially distributed power.
    """
    chance = uniform(seed, owner, number, DRAWS * thing)
    received = -(1.0 + signal) * log(chance)
    return received if received > parameters["threshold"] else 0.0


@inlined
def detect(
    parameters: Any,
    seed: np.uint64,
    owner: np.uint64,
    number: int,
    echoes: Floats,
    order: Ints,
) -> int:
    """Join the echoes of each cell and keep those that cross the threshold, with their errors.

    Args:
        parameters: Record of the sensor.
        seed: Stream seed of the run.
        owner: Owner number of the sensor.
        number: Number of the sample.
        echoes: (M, ECHO_WIDTH) of objects in, of detections out.
        order: (>= M,) out: the detections, nearest first.

    Returns:
        Number of detections.
    """
    count = 0
    while True:
        thing = _gather(parameters, echoes)
        if thing < 0:
            return count
        signal = echoes[thing, ECHO_SIGNAL]
        echoes[thing, ECHO_SIGNAL] = 0.0
        # The rest is weaker still.
        if not signal > LEAST_SIGNAL:
            return count
        received = _received(parameters, seed, owner, number, thing, signal)
        if received > 0.0:
            first = DRAWS * thing + 1
            _measure(parameters, seed, owner, number, first, received, echoes[thing])
            x, y = echoes[thing, ECHO_X], echoes[thing, ECHO_Y]
            insert(order, echoes[:, ECHO_X:], count, thing, x * x + y * y)
            count += 1


@inlined
def _measure(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    seed: np.uint64,
    owner: np.uint64,
    number: int,
    first: int,
    received: float,
    echo: Floats,
) -> None:
    """Add the errors of measurement, resolution / sqrt(2·SNR) of each, and place the detection.

    Args:
        parameters: Record of the sensor.
        seed: Stream seed of the run.
        owner: Owner number of the sensor.
        number: Number of the sample.
        first: Index of the first of two draws.
        received: Power in units of the mean noise.
        echo: (ECHO_WIDTH,) in and out.

    Source:
        Curry (2005), "Radar system performance modeling", 2nd ed.: resolution / sqrt(2·SNR), here
        with a constant of 1 for all three; what the power of this sample is, not its mean, decides.
    """
    sigma = max(FINEST, 1.0 / math.sqrt(2.0 * received))
    along, aside = normal_pair(seed, owner, number, first)
    faster = normal(seed, owner, number, first + 1)
    echo[ECHO_RANGE] += sigma * parameters["range_resolution"] * along
    echo[ECHO_BEARING] += sigma * parameters["bearing_resolution"] * aside
    rate = echo[ECHO_RATE] + sigma * parameters["range_rate_resolution"] * faster
    echo[ECHO_RATE] = folded(rate, parameters["max_range_rate"])
    _place(parameters, echo)


@inlined
def _place(parameters: Any, echo: Floats) -> None:
    """Place a detection in the vehicle frame."""
    s, c = sin_cos(parameters["yaw"] + echo[ECHO_BEARING])
    echo[ECHO_X] = parameters["x"] + echo[ECHO_RANGE] * c
    echo[ECHO_Y] = parameters["y"] + echo[ECHO_RANGE] * s


@inlined
def count_events(mean: float, none: float, most: float, chance: float) -> int:
    """Return a Poisson distributed number, by the inverse of its distribution function.

    Args:
        mean: Of the distribution, positive.
        none: Probability of 0, exp(-mean).
        most: Greatest number that is returned.
        chance: Uniform draw.
    """
    count = 0
    probability = total = none
    while chance > total and count < most:
        count += 1
        probability *= mean / count
        total += probability
    return count


def most_events(mean: float) -> int:
    """Return a number that a Poisson distributed one exceeds less than once in 10^7 times."""
    return int(mean + 6.0 * math.sqrt(mean) + 4.0) if mean > 0.0 else 0


@inlined
def add_ghosts(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    seed: np.uint64,
    owner: np.uint64,
    number: int,
    velocity: tuple[float, float],
    objects: int,
    count: int,
    echoes: Floats,
    order: Ints,
) -> int:
    """Add false alarms and clutter to the detections of objects.

    A false alarm lies in any cell, whatever its range. Clutter is spread over the area in view and
    stands still in the world; it is weak, so in the cell of an object it is part of that echo.

    Args:
        parameters: Record of the sensor.
        seed: Stream seed of the run.
        owner: Owner number of the sensor.
        number: Number of the sample.
        velocity: Of the sensor along and across its boresight [m/s].
        objects: M.
        count: Detections so far.
        echoes: (K, ECHO_WIDTH) in and out; ghosts have the rows from M on.
        order: (K,) in and out: the detections, nearest first.

    Returns:
        Number of detections.
    """
    ghosts = count_events(
        parameters["ghosts"],
        parameters["no_ghost"],
        parameters["most_ghosts"],
        uniform(seed, owner, number, FIRST_GHOST),
    )
    most = parameters["max_range_rate"]
    for event in range(ghosts):
        first = FIRST_GHOST + 4 * (event + 1)
        ghost = echoes[objects + event]
        ghost[ECHO_RANGE] = parameters["range"] * uniform(seed, owner, number, first)
        aside = 2.0 * uniform(seed, owner, number, first + 1) - 1.0
        ghost[ECHO_BEARING] = parameters["half_view"] * aside
        if uniform(seed, owner, number, first + 2) < parameters["clutter_share"]:
            ghost[ECHO_RANGE] = math.sqrt(parameters["range"] * ghost[ECHO_RANGE])
            s, c = sin_cos(ghost[ECHO_BEARING])
            sigma = parameters["range_rate_resolution"] / math.sqrt(2.0 * parameters["threshold"])
            rate = sigma * normal(seed, owner, number, first + 3)
            rate -= velocity[0] * c + velocity[1] * s
            ghost[ECHO_RATE] = folded(rate, most)
        else:
            ghost[ECHO_RATE] = most * (2.0 * uniform(seed, owner, number, first + 3) - 1.0)
        count = _take_ghost(parameters, objects + event, count, echoes, order)
    return count


@inlined
def _take_ghost(parameters: Any, ghost: int, count: int, echoes: Floats, order: Ints) -> int:
    """Insert a ghost unless its cell has a detection; return the number of detections."""
    for row in range(count):
        if same_cell(parameters, echoes[order[row]], echoes[ghost]):
            return count
    _place(parameters, echoes[ghost])
    x, y = echoes[ghost, ECHO_X], echoes[ghost, ECHO_Y]
    insert(order, echoes[:, ECHO_X:], count, ghost, x * x + y * y)
    return count + 1
