"""The zones around the ego that a suite is asked to see, as polygons cut into cells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from adeye.kernel import detection_range
from adeye.kernel.elementary import atan, atan2, cos, sin, sin_cos, tan
from adeye.simulate.world import weather
from adeye.spec.sensors import model_name

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from adeye.analysis.suite.conditions import Condition, Target
    from adeye.signals import Bools, Floats
    from adeye.spec.architecture import Vehicle
    from adeye.spec.sensors import (
        Camera,
        Lidar,
        PhysicalCamera,
        PhysicalLidar,
        PhysicalRadar,
        Radar,
        Sensor,
        Ultrasonic,
    )

# --- The zones around the ego that a suite is asked to see, as polygons cut into cells ------------

LANE: Final = 3.5
"""Width of a lane [m]. Our choice: between 3.25 m and 3.75 m of German motorways (RAA)."""

FRONT_NEAR: Final = 46.0
FRONT_MID: Final = 90.0
FRONT_FAR: Final = 150.0
"""Where the zones ahead end, from the front [m]: the least forward detection ranges of UN R157 for
60, 100 and 130 km/h."""

SIDE_AHEAD: Final = 46.0
"""How far ahead the lanes beside are looked at for vehicles that cut in [m]. Our choice: as far as
the near zone."""

REAR: Final = 55.0
"""How far back one looks [m]: the least rear detection range of UN R79, 5.6.4.8.1 (03 series
of amendments) for lane changes."""

NEAR_FIELD: Final = 2.0
"""Width of the near field around the body [m]. Our choice: what parking and moving off need."""

_CELLS: Final = 3500.0
"""About how many cells a zone is cut into."""
_FINEST: Final = 0.05
_COARSEST: Final = 0.5


@dataclass(frozen=True, slots=True)
class Zone:
    """A part of the ground around the ego, without what the ego covers itself.

    Attributes:
        id: Its name.
        title: In words.
        target: Class that it is judged for in short tables.
        outline_m: Corners in the vehicle frame, x and y [m].
    """

    id: str
    title: str
    target: str
    outline_m: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Cells:
    """A zone cut into rectangles that are nearly square.

    Attributes:
        along: Edge of a cell along x [m].
        across: Edge of a cell along y [m].
        x: Middles of the columns (N,) [m].
        y: Middles of the rows (M,) [m].
        inside: (M, N) which cells belong to the zone.
    """

    along: float
    across: float
    x: Floats
    y: Floats
    inside: Bools

    @property
    def points(self) -> tuple[Floats, Floats]:
        """Middles of the cells of the zone, x and y (K,)."""
        x, y = np.meshgrid(self.x, self.y)
        return x[self.inside], y[self.inside]

    @property
    def area(self) -> float:
        """Of the zone [m²]."""
        return float(self.inside.sum()) * self.cell

    @property
    def cell(self) -> float:
        """Area of a cell [m²]."""
        return self.along * self.across


def zones_of(length: float, width: float) -> tuple[Zone, ...]:
    """List the zones around a vehicle.

    Args:
        length: Of the vehicle [m].
        width: Of the vehicle [m].
    """
    front, half_lane, far_lane = 0.5 * length, 0.5 * LANE, 1.5 * LANE
    ring = (front + NEAR_FIELD, 0.5 * width + NEAR_FIELD)
    boxes = (
        ("front_near", "ahead, near", front, front + FRONT_NEAR, -half_lane, half_lane),
        ("front_mid", "ahead, mid", front + FRONT_NEAR, front + FRONT_MID, -half_lane, half_lane),
        ("front_far", "ahead, far", front + FRONT_MID, front + FRONT_FAR, -half_lane, half_lane),
        ("front_left", "lane ahead left", front, front + SIDE_AHEAD, half_lane, far_lane),
        ("front_right", "lane ahead right", front, front + SIDE_AHEAD, -far_lane, -half_lane),
        ("side_left", "lane beside left", -front, front, half_lane, far_lane),
        ("side_right", "lane beside right", -front, front, -far_lane, -half_lane),
        ("rear", "behind", -front - REAR, -front, -half_lane, half_lane),
        ("rear_left", "lane behind left", -front - REAR, -front, half_lane, far_lane),
        ("rear_right", "lane behind right", -front - REAR, -front, -far_lane, -half_lane),
        ("near_field", "near field all around", -ring[0], ring[0], -ring[1], ring[1]),
    )
    return tuple(
        Zone(
            name,
            title,
            "pedestrian" if name == "near_field" else "car",
            ((x0, y0), (x1, y0), (x1, y1), (x0, y1)),
        )
        for name, title, x0, x1, y0, y1 in boxes
    )


def cells_of(zone: Zone, length: float, width: float) -> Cells:
    """Cut a zone into cells and leave out those under the ego.

    Args:
        zone: The zone.
        length: Of the ego [m].
        width: Of the ego [m].
    """
    corners = np.array(zone.outline_m)
    low, high = corners.min(axis=0), corners.max(axis=0)
    extent = high - low
    size = float(np.clip(np.sqrt(extent[0] * extent[1] / _CELLS), _FINEST, _COARSEST))
    columns, rows = (max(1, round(float(side) / size)) for side in extent)
    along, across = float(extent[0]) / columns, float(extent[1]) / rows
    x = low[0] + (np.arange(columns) + 0.5) * along
    y = low[1] + (np.arange(rows) + 0.5) * across
    grid_x, grid_y = np.meshgrid(x, y)
    inside = within(corners, grid_x, grid_y)
    inside &= ~((np.abs(grid_x) < 0.5 * length) & (np.abs(grid_y) < 0.5 * width))
    return Cells(along, across, x, y, inside)


def within(corners: Floats, x: Floats, y: Floats) -> NDArray[np.bool_]:
    """Tell which points lie inside a polygon, by the number of edges to their right.

    Args:
        corners: (K, 2), in order.
        x: Of the points [m].
        y: Of the points, same shape [m].
    """
    inside = np.zeros(x.shape, dtype=np.bool_)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if y0 == y1:
            continue
        crosses = (y0 <= y) != (y1 <= y)
        inside ^= crosses & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return inside


# --- Where a mounted sensor looks: its field of view and what the ego's own body hides from it ----

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


# --- From where to where a sensor detects a target in some conditions, by closed forms ------------

GROUND: Final = 0.2
"""A return from lower than this is taken for the ground [m]. Our choice."""

_STEP: Final = 0.25
"""Distance between two looks of a lidar [m]."""


class Reach(NamedTuple):
    """Nearest and farthest distance at which a target is detected [m]; no range if equal."""

    near: float
    far: float


NOTHING: Final = Reach(0.0, 0.0)


def reach_of(sensor: Sensor, target: Target, condition: Condition) -> Reach | None:
    """Compute from where to where a sensor detects a target that stands alone.

    Args:
        sensor: Its record.
        target: What is to be seen.
        condition: Weather and light.

    Returns:
        None for a sensor that does not look around, or a plug-in, of which nothing is known.
    """
    model = _MODELS.get(model_name(sensor))
    return None if model is None else model(sensor, target, condition)


def _camera(spec: Camera, _target: Target, condition: Condition) -> Reach:
    share = weather.light_share(spec.night_range, condition.illuminance)
    if share <= 0.0:
        return NOTHING
    if condition.sun_elevation_rad is not None:
        cosine = _toward_sun(spec, condition.sun_elevation_rad)
        share *= weather.glare_contrast(cosine, condition.illuminance)
    far = weather.camera_range(spec.range, condition.rain_mps, condition.visibility_m, share)
    return Reach(0.0, far)


def _toward_sun(spec: Camera | PhysicalCamera, elevation: float) -> float:
    """Cosine of the angle from a sun straight ahead to the nearest level line of sight in view."""
    yaw = abs(atan2(sin(spec.mount.yaw), cos(spec.mount.yaw)))
    aside = max(0.0, yaw - 0.5 * spec.field_of_view)
    return float(weather.sun_cosine(cos(aside), sin(aside), elevation, 0.0))


def _behind_lens(spec: PhysicalCamera, condition: Condition) -> float:
    """Share of the contrast that lens and glare leave; own headlamps do not count against glare."""
    elevation = condition.sun_elevation_rad
    if elevation is None:
        return float(spec.transmission)
    ahead = weather.sun_cosine(cos(spec.mount.yaw), sin(spec.mount.yaw), elevation, 0.0)
    facing = cos(spec.mount.pitch) * ahead - sin(spec.mount.pitch) * sin(elevation)
    cosine = _toward_sun(spec, elevation)
    veiled = weather.contrast_behind_veil(
        weather.SUN_ILLUMINANCE * facing, cosine, condition.illuminance
    )
    return float(spec.transmission * veiled)


def _physical_camera(spec: PhysicalCamera, target: Target, condition: Condition) -> Reach:
    """Both rows and contrast must suffice, with sky, street and headlamps for light.

    Only rows within the image count: a camera that looks down or up loses what is far or near.
    """
    rows = float(spec.min_pixel_height)
    focal = detection_range.focal_length(spec.columns, spec.field_of_view)
    tall = detection_range.pixel_range(target.height_m, focal, rows)
    extinction = weather.light_extinction(condition.rain_mps, condition.visibility_m)
    clear = detection_range.contrast_range(
        target.contrast * _behind_lens(spec, condition),
        spec.contrast_threshold,
        extinction,
        condition.illuminance,
        spec.headlamps * detection_range.headlamp_share(cos(spec.mount.yaw)),
    )
    return _longest_stretch(
        min(tall, clear),
        lambda distance: _rows_shown(spec, target, distance, focal) >= rows * (1.0 - 1e-9),
    )


def _rows_shown(spec: PhysicalCamera, target: Target, distance: float, focal: float) -> float:
    """Count the rows of the image that a target fills at a distance."""
    foot = atan2(-spec.mount.z, distance) + spec.mount.pitch
    top = atan2(target.height_m - spec.mount.z, distance) + spec.mount.pitch
    half = 0.5 * spec.rows
    # A right angle off the axis is outside of every image.
    limit = atan(half / focal)
    low, high = max(foot, -limit), min(top, limit)
    return float(focal * (tan(high) - tan(low))) if low < high else 0.0


def _longest_stretch(far: float, is_seen: Callable[[float], bool]) -> Reach:
    """Return the longest stretch up to a distance without a gap."""
    best = NOTHING
    start: float | None = None
    for distance in [*np.arange(_STEP, far, _STEP).tolist(), far]:
        if is_seen(distance):
            start = distance if start is None else start
            if distance - start > best.far - best.near:
                best = Reach(start, distance)
        else:
            start = None
    # The nearest look stands for all that is nearer.
    return Reach(0.0, best.far) if best.near == _STEP else best


def _radar(spec: Radar, _target: Target, _condition: Condition) -> Reach:
    return Reach(0.0, spec.range)


def _physical_radar(spec: PhysicalRadar, target: Target, condition: Condition) -> Reach:
    """Straight ahead of the antenna: z·exp(extinction·z / 2) is the range in clear air.

    The power falls with exp(-2·extinction·z) / z⁴.
    """
    reference = spec.reference_cross_section
    clear = detection_range.cross_section_range(spec.range, target.cross_section_m2, reference)
    extinction = weather.radar_rain_extinction(condition.rain_mps)
    return Reach(0.0, weather.range_in_extinction(clear, 0.5 * extinction))


def _lidar(spec: Lidar | PhysicalLidar, target: Target, condition: Condition) -> Reach:
    far = weather.lidar_range(
        spec.range,
        target.reflectivity,
        spec.reference_reflectivity,
        condition.rain_mps,
        condition.visibility_m,
    )
    return Reach(0.0, far)


def _physical_lidar(spec: PhysicalLidar, target: Target, condition: Condition) -> Reach:
    """Enough beams must hit the target between the ground and its top.

    Layers leave gaps: what counts is the longest stretch without one.
    """
    return _longest_stretch(
        _lidar(spec, target, condition).far,
        lambda distance: _returns(spec, target, distance) >= spec.min_points,
    )


def _returns(spec: PhysicalLidar, target: Target, distance: float) -> float:
    """Count the returns that a target gives at a distance, as far as the mean loss leaves them."""
    spacing = spec.field_of_view / spec.beams
    beams = min(float(spec.beams), detection_range.sure_beams(target.width_m, distance, spacing))
    layers = 0
    for layer in range(spec.layers):
        part = layer / (spec.layers - 1) - 0.5 if spec.layers > 1 else 0.0
        down = spec.mount.pitch - part * spec.vertical_field_of_view
        layers += GROUND <= spec.mount.z - distance * tan(down) <= target.height_m
    return float(beams * layers * (1.0 - spec.drop_out))


def _ultrasonic(spec: Ultrasonic, _target: Target, _condition: Condition) -> Reach:
    return Reach(min(spec.blind_zone, spec.range), spec.range)


_MODELS: Final[dict[str, Callable[[Any, Target, Condition], Reach]]] = {
    "camera": _camera,
    "camera/physical": _physical_camera,
    "radar": _radar,
    "radar/physical": _physical_radar,
    "lidar": _lidar,
    "lidar/physical": _physical_lidar,
    "ultrasonic": _ultrasonic,
}
