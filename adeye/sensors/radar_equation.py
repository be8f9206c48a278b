"""What decides whether a 77 GHz radar detects an object: echo, noise, rain and threshold."""

from __future__ import annotations

from typing import Final

import numpy as np

from adeye.kernel.elementary import exp, log, power
from adeye.kernel.jit import compiled, inlined
from adeye.signals import OBJECT_CLASSES, Floats, Ints
from adeye.world.objects import CROSS_SECTION
from adeye.world.weather import MM_PER_HOUR, NEPER

RAIN_ECHO_A: Final = 1.354e-4
RAIN_ECHO_B: Final = 0.682
"""Radar cross section of rain per volume at 77 GHz, a·R^b [m²/m³] with R [mm/h]. Computed for
spheres (Mie 1908) with the drop sizes of Marshall & Palmer (1948) and the permittivity of water at
20 °C of Liebe, Hufford & Manabe (1991), and fitted from 1 to 100 mm/h, within 17 %."""

LEAST_SIGNAL: Final = 1e-3
"""Signal-to-noise ratio below which an echo is left out: what it adds to noise decides nothing."""


@compiled
def decibels(level: float) -> float:
    """Return the ratio that a level is [dB]."""
    return exp(level / NEPER)


@compiled
def detection_threshold(false_alarm_rate: float) -> float:
    """Return the power above which a cell counts as a detection, in units of the mean noise.

    The power of noise alone is exponentially distributed.

    Args:
        false_alarm_rate: Probability that noise crosses the threshold in one cell, below 1.

    Source:
        Richards (2014), "Fundamentals of radar signal processing", 2nd ed., chapter 6.
    """
    return -log(false_alarm_rate)


@compiled
def signal_for(probability: float, false_alarm_rate: float) -> float:
    """Return the mean signal-to-noise ratio at which a fluctuating target is so often detected.

    Signal and noise of a Swerling 1 target have an exponentially distributed power of mean
    1 + SNR, so P_d = P_fa^(1/(1 + SNR)), solved for the SNR here.

    Args:
        probability: Of detection, between the false-alarm rate and 1.
        false_alarm_rate: Of one cell.

    Source:
        Swerling (1960), "Probability of detection for fluctuating targets", IRE Trans. IT-6, for
        one pulse (here one frame).
    """
    return log(false_alarm_rate) / log(probability) - 1.0


@compiled
def rain_echo(rain: float) -> float:
    """Return the radar cross section of rain per volume [m²/m³].

    Args:
        rain: [m/s].
    """
    if not rain > 0.0:
        return 0.0
    return RAIN_ECHO_A * power(rain / MM_PER_HOUR, RAIN_ECHO_B)


@inlined
def signal_to_noise(  # noqa: PLR0913, PLR0917 - a kernel
    strength: float,
    cross_section: float,
    distance: float,
    bearing: float,
    beam: float,
    extinction: float,
    rain_in_cell: float,
) -> float:
    """Return the mean power of an echo over that of noise and of the rain in its cell.

    The radar equation: both ways through the antenna's Gaussian beam and through the rain, spread
    with the fourth power of the distance. The rain in the cell grows with its volume, which is
    proportional to the distance squared. All of it counts as if it fell at the target's range rate,
    which is the worst case.

    Args:
        strength: Signal-to-noise ratio of 1 m² at 1 m on the boresight in clear air.
        cross_section: Of what is seen of the object [m²].
        distance: [m], positive.
        bearing: From the boresight [rad].
        beam: Two-way loss per bearing squared, in nepers of the power [1/rad²].
        extinction: One way [1/m].
        rain_in_cell: Cross section of the rain in the cell per distance squared [m²/m²].

    Source:
        Skolnik (2008), "Radar handbook", 3rd ed.: the radar equation, echoes of rain.
    """
    square = distance * distance
    loss = beam * bearing * bearing + 2.0 * extinction * distance
    # Without a loss the exponential is 1, which is not worth asking for.
    gain = strength * exp(-loss) if loss > 0.0 else strength
    return gain * cross_section / (square * square + gain * rain_in_cell * square)


@inlined
def facing(along: float, across: float, half: float) -> float:
    """Return how squarely a face looks at the sensor: the squared cosine of its incidence.

    Args:
        along: Place of the sensor in the frame of the box, at right angles to the face [m].
        across: Along the face, from its middle [m].
        half: Half of the size of the box, at right angles to the face [m].

    Returns:
        0 if the sensor is not before the face, 1 straight before its middle.
    """
    before = abs(along) - half
    if not before > 0.0:
        return 0.0
    return before * before / (before * before + across * across)


def cross_sections(classes: Ints) -> Floats:
    """Return the cross sections (M, 2) of the ends and the sides of objects [m²].

    Args:
        classes: (M,) index into ``OBJECT_CLASSES``.
    """
    known = np.array(
        [[decibels(level) for level in CROSS_SECTION[name]] for name in OBJECT_CLASSES]
    )
    return np.ascontiguousarray(known[classes])
