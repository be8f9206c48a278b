"""How far a sensor detects by its own geometry and power, and how fast that lets a vehicle go.

Weather is not in here: it shortens what these give (``adeye/simulate/world/weather.py``).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from adeye.kernel.criticality import stopping_distance
from adeye.kernel.elementary import atan, exp, sin_cos
from adeye.kernel.jit import compiled

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


LIGHT_OF_THRESHOLD = 120.0
"""Illuminance at which the noise of light doubles the square of a camera's threshold [lx]. Our
choice: a pedestrian of contrast 0.25 then needs 5 lx where the threshold is 0.05 by day, the
illuminance to which the range of headlamps is commonly rated."""

FARTHEST = 1e4
"""Beyond this nothing is asked [m]."""


@compiled
def focal_length(columns: float, field_of_view: float) -> float:
    """Return the focal length of a pinhole camera in pixels, ``columns / (2 tan(angle / 2))``.

    Args:
        columns: Of the image.
        field_of_view: Horizontal, 0 to pi [rad].
    """
    sine, cosine = sin_cos(0.5 * field_of_view)
    return 0.5 * columns * cosine / sine


@compiled
def pixel_range(height: float, focal: float, rows: float) -> float:
    """Return the depth to which an object fills so many rows of the image, ``focal height / rows``.

    Args:
        height: Of the object [m].
        focal: Focal length [px].
        rows: Least rows, > 0.
    """
    return focal * height / rows


@compiled
def headlamp_share(cosine: float) -> float:
    """Return the share of the headlamps' intensity in a direction.

    The twelfth power of the cosine, our choice: half is left at 19 degrees, nothing from 90 on.

    Args:
        cosine: Of the angle to the ego's heading.
    """
    if cosine <= 0.0:
        return 0.0
    square = cosine * cosine
    fourth = square * square
    return fourth * fourth * fourth


@compiled
def contrast_threshold(threshold: float, illuminance: float) -> float:
    """Return the least contrast that a camera sees at an illuminance; infinite in the dark.

    ``threshold * sqrt(1 + E0 / E)``: by day other noise decides, at night that of light, which
    falls with the square root of its amount.

    Args:
        threshold: By day.
        illuminance: E, of what is looked at [lx].

    Source:
        de Vries (1943); Rose (1948), J. Opt. Soc. Am. 38, 196. That both kinds of noise add by
        their squares, and E0, are our choice.
    """
    if not illuminance > 0.0:
        return math.inf
    return threshold * math.sqrt(1.0 + LIGHT_OF_THRESHOLD / illuminance)


@compiled
def contrast_range(
    contrast: float, threshold: float, extinction: float, illuminance: float, headlamps: float
) -> float:
    """Return the range to which an object stands out from its background [m].

    Its contrast falls with ``exp(-extinction distance)`` (Koschmieder 1924), the light of the own
    headlamps on it with the distance squared.

    Args:
        contrast: Close by, 0 to 1.
        threshold: Least contrast that is detected by day, > 0.
        extinction: >= 0 [1/m].
        illuminance: Without the headlamps [lx].
        headlamps: Intensity of the headlamps towards it [cd].

    Returns:
        0 where it does not stand out at all; no more than ``FARTHEST``. Found by halving, since
        what is seen falls with the distance, to far below a millimetre.
    """
    if math.isnan(contrast + threshold + extinction + illuminance + headlamps):
        return math.nan
    low, high = 0.0, FARTHEST
    for _ in range(60):
        middle = 0.5 * (low + high)
        light = illuminance + headlamps / (middle * middle)
        if contrast * exp(-extinction * middle) >= contrast_threshold(threshold, light):
            low = middle
        else:
            high = middle
    return low


@compiled
def cross_section_range(reference_range: float, cross_section: float, reference: float) -> float:
    """Return the range at which a radar target is as strong as the reference target at its range.

    The received power goes with ``cross_section / range**4``.

    Args:
        reference_range: [m].
        cross_section: Of the target, >= 0 [m²].
        reference: Cross section of the reference target, > 0 [m²].

    Source:
        Skolnik (2001), "Introduction to radar systems", 3rd ed.: the radar equation.
    """
    return reference_range * math.sqrt(math.sqrt(cross_section / reference))


@compiled
def sure_beams(width: float, distance: float, spacing: float) -> float:
    """Return how many beams of a fan hit a face for sure, wherever it stands between them.

    Args:
        width: Of the face, across the line of sight [m].
        distance: To it, > 0 [m].
        spacing: Angle between two beams, > 0 [rad].
    """
    angle = 2.0 * atan(0.5 * width / distance)
    # An angle of n spacings holds n beams or n + 1; rounding must not take one away.
    return float(math.floor(angle / spacing + 1e-9))


@compiled
def needed_ranges(
    speeds: Floats, delay: float, deceleration: float, margin: float, out: Floats
) -> None:
    """Compute the range from which a vehicle comes to rest with a margin, at many speeds.

    Args:
        speeds: Closing speeds (N,) [m/s]; a negative one needs the margin only.
        delay: From a thing in sight to acting brakes [s].
        deceleration: [m/s²].
        margin: Gap that is left [m].
        out: (N,) [m].
    """
    for row in range(len(speeds)):
        out[row] = stopping_distance(speeds[row], delay, deceleration) + margin
