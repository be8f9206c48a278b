"""Where a mounted sensor looks: its field of view and what the ego's own body hides from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.kernel.elementary import sin_cos

if TYPE_CHECKING:
    from adeye.evaluation.suite.reach import Reach
    from adeye.signals import Bools, Floats
    from adeye.spec.architecture import Vehicle
    from adeye.spec.sensors import Sensor

AT_EDGE: Final = 0.3
"""How deep behind an edge of the body a sensor still looks out over it [m]. Our choice: room for a
bumper's foam and cover."""

_TOUCH: Final = 1e-9
"""Lines that only touch the body are not hidden [m]."""


@dataclass(frozen=True, slots=True)
class View:
    """A sensor at its place on the vehicle.

    Attributes:
        x: Of the mount, from the box centre forward [m].
        y: To the left [m].
        ahead: Cosine and sine of the direction that it faces.
        cosine: Of half the field of view.
        body: What hides the outside from it: least and greatest x and y [m]; None on the roof.
    """

    x: float
    y: float
    ahead: tuple[float, float]
    cosine: float
    body: tuple[float, float, float, float] | None


def view_of(sensor: Sensor, vehicle: Vehicle) -> View:
    """Place a sensor that has a mount and a field of view on the vehicle.

    One at the roof or above sees all around over the body. One within ``AT_EDGE`` of an edge of
    the outline looks out over that edge, so at a corner over two. One deeper inside, such as a
    camera behind the windscreen, looks out over the edge that it faces. The rest of the body hides
    what lies behind it.

    Args:
        sensor: Record with ``mount`` and ``field_of_view``.
        vehicle: The ego.
    """
    mount, angle = sensor.mount, sensor.field_of_view  # type: ignore[union-attr]
    sine, cosine = sin_cos(mount.yaw)
    half = sin_cos(0.5 * angle)[1]
    body = None
    if mount.z < vehicle.height:
        body = _hiding(mount.x, mount.y, (cosine, sine), vehicle)
    return View(mount.x, mount.y, (cosine, sine), half, body)


def _hiding(
    x: float, y: float, ahead: tuple[float, float], vehicle: Vehicle
) -> tuple[float, float, float, float]:
    """Pull the edges that the sensor looks out over back to it."""
    front, side = 0.5 * vehicle.length, 0.5 * vehicle.width
    # Depth behind each edge, and how fast a ray straight ahead comes nearer to it.
    depth = {
        "rear": (x + front, -ahead[0]),
        "front": (front - x, ahead[0]),
        "right": (y + side, -ahead[1]),
        "left": (side - y, ahead[1]),
    }
    over = {name for name, (behind, _) in depth.items() if behind <= AT_EDGE}
    if not over:
        ways = {name: behind / speed for name, (behind, speed) in depth.items() if speed > _TOUCH}
        over = {min(ways, key=lambda name: ways[name])}
    return (
        max(-front, x) if "rear" in over else -front,
        min(front, x) if "front" in over else front,
        max(-side, y) if "right" in over else -side,
        min(side, y) if "left" in over else side,
    )


def distance(view: View, x: Floats, y: Floats) -> Floats:
    """Distance of points from the sensor [m].

    Args:
        view: The sensor.
        x: Of the points in the vehicle frame [m].
        y: The same shape [m].
    """
    dx, dy = x - view.x, y - view.y
    out: Floats = np.sqrt(dx * dx + dy * dy)
    return out


def looks_at(view: View, x: Floats, y: Floats) -> Bools:
    """Tell which points lie in the field of view with a free line of sight, however far.

    An object counts as seen where its middle is: then half of it, which is what sensors ask for by
    default, is inside the edge of the field of view.

    Args:
        view: The sensor.
        x: Of the points in the vehicle frame [m].
        y: The same shape [m].
    """
    dx, dy = x - view.x, y - view.y
    along = dx * view.ahead[0] + dy * view.ahead[1]
    seen: Bools = along >= view.cosine * np.sqrt(dx * dx + dy * dy) - _TOUCH
    if view.cosine <= -1.0 + 1e-12:
        seen[...] = True
    seen &= free_way(view, dx, dy) >= 1.0
    return seen


def free_way(view: View, dx: Floats, dy: Floats) -> Floats:
    """Tell how often a vector fits between the sensor and the body that hides what is behind.

    Args:
        view: The sensor.
        dx: Vectors from the sensor in the vehicle frame [m].
        dy: The same shape [m].

    Returns:
        Where the ray enters the body, in lengths of the vector; infinite where it does not.
    """
    if view.body is None:
        return np.full(dx.shape, np.inf)
    left, right, low, high = view.body
    start, end = np.zeros(dx.shape), np.full(dx.shape, np.inf)
    # A ray is inside the body where it is inside both of its slabs.
    for origin, way, near, far in ((view.x, dx, left, right), (view.y, dy, low, high)):
        near_edge, far_edge = near + _TOUCH - origin, far - _TOUCH - origin
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            first, second = near_edge / way, far_edge / way
        is_within = near_edge < 0.0 < far_edge
        still = way == 0.0
        enters = np.where(still, 0.0 if is_within else np.inf, np.fmin(first, second))
        leaves = np.where(still, np.inf, np.fmax(first, second))
        start, end = np.maximum(start, enters), np.minimum(end, leaves)
    return np.where(start < end, start, np.inf)


def sees(view: View, reach: Reach, x: Floats, y: Floats) -> Bools:
    """Tell at which points a target is detected.

    Args:
        view: The sensor.
        reach: From where to where it detects the target.
        x: Of the points in the vehicle frame [m].
        y: The same shape [m].
    """
    far = distance(view, x, y)
    if reach.far <= reach.near:
        return np.zeros(far.shape, dtype=np.bool_)
    seen: Bools = looks_at(view, x, y) & (far >= reach.near) & (far <= reach.far)
    return seen
