"""Messages of ROS: their definitions, and what of a tick each topic is told.

One table of definitions serves ROS 1 and ROS 2, in their own language; where the two differ, so do
the tables. Messages are made as dictionaries here, and become what a middleware sends there. Units
are SI, axes x forward, y left, z up; headers name the frame, and carry when a sample was taken.
"""

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

_SAME: Final = """
ackermann_msgs/AckermannDrive: float32 steering_angle, float32 steering_angle_velocity,
    float32 speed, float32 acceleration, float32 jerk
ackermann_msgs/AckermannDriveStamped: std_msgs/Header header, AckermannDrive drive
geometry_msgs/Point: float64 x, float64 y, float64 z
geometry_msgs/Vector3: float64 x, float64 y, float64 z
geometry_msgs/Quaternion: float64 x, float64 y, float64 z, float64 w
geometry_msgs/Pose: Point position, Quaternion orientation
geometry_msgs/PoseWithCovariance: Pose pose, float64[36] covariance
geometry_msgs/Twist: Vector3 linear, Vector3 angular
geometry_msgs/TwistWithCovariance: Twist twist, float64[36] covariance
geometry_msgs/Transform: Vector3 translation, Quaternion rotation
geometry_msgs/TransformStamped: std_msgs/Header header, string child_frame_id, Transform transform
nav_msgs/Odometry: std_msgs/Header header, string child_frame_id,
    geometry_msgs/PoseWithCovariance pose, geometry_msgs/TwistWithCovariance twist
rosgraph_msgs/Clock: time clock
sensor_msgs/Imu: std_msgs/Header header,
    geometry_msgs/Quaternion orientation, float64[9] orientation_covariance,
    geometry_msgs/Vector3 angular_velocity, float64[9] angular_velocity_covariance,
    geometry_msgs/Vector3 linear_acceleration, float64[9] linear_acceleration_covariance
sensor_msgs/NavSatStatus: int8 STATUS_NO_FIX=-1, int8 STATUS_FIX=0, int8 STATUS_SBAS_FIX=1,
    int8 STATUS_GBAS_FIX=2, int8 status, uint16 SERVICE_GPS=1, uint16 SERVICE_GLONASS=2,
    uint16 SERVICE_COMPASS=4, uint16 SERVICE_GALILEO=8, uint16 service
sensor_msgs/NavSatFix: std_msgs/Header header, NavSatStatus status, float64 latitude,
    float64 longitude, float64 altitude, float64[9] position_covariance,
    uint8 COVARIANCE_TYPE_UNKNOWN=0, uint8 COVARIANCE_TYPE_APPROXIMATED=1,
    uint8 COVARIANCE_TYPE_DIAGONAL_KNOWN=2, uint8 COVARIANCE_TYPE_KNOWN=3,
    uint8 position_covariance_type
sensor_msgs/PointField: uint8 INT8=1, uint8 UINT8=2, uint8 INT16=3, uint8 UINT16=4, uint8 INT32=5,
    uint8 UINT32=6, uint8 FLOAT32=7, uint8 FLOAT64=8, string name, uint32 offset, uint8 datatype,
    uint32 count
sensor_msgs/PointCloud2: std_msgs/Header header, uint32 height, uint32 width, PointField[] fields,
    bool is_bigendian, uint32 point_step, uint32 row_step, uint8[] data, bool is_dense
std_msgs/String: string data
tf2_msgs/TFMessage: geometry_msgs/TransformStamped[] transforms
vision_msgs/BoundingBox3D: geometry_msgs/Pose center, geometry_msgs/Vector3 size
vision_msgs/Detection3DArray: std_msgs/Header header, Detection3D[] detections
"""
_ROS_1: Final = """
std_msgs/Header: uint32 seq, time stamp, string frame_id
vision_msgs/ObjectHypothesisWithPose: int64 id, float64 score, geometry_msgs/PoseWithCovariance pose
vision_msgs/Detection3D: std_msgs/Header header, ObjectHypothesisWithPose[] results,
    BoundingBox3D bbox, sensor_msgs/PointCloud2 source_cloud
"""
_ROS_2: Final = """
std_msgs/Header: time stamp, string frame_id
vision_msgs/ObjectHypothesis: string class_id, float64 score
vision_msgs/ObjectHypothesisWithPose: ObjectHypothesis hypothesis,
    geometry_msgs/PoseWithCovariance pose
vision_msgs/Detection3D: std_msgs/Header header, ObjectHypothesisWithPose[] results,
    BoundingBox3D bbox, string id
"""

COMMAND: Final = "ackermann_cmd"
TOPICS: Final[Mapping[str, str]] = {
    "tf": "tf2_msgs/TFMessage",
    "odom": "nav_msgs/Odometry",
    "objects": "vision_msgs/Detection3DArray",
    "imu": "sensor_msgs/Imu",
    "fix": "sensor_msgs/NavSatFix",
    "points": "sensor_msgs/PointCloud2",
    "adeye/observation": "std_msgs/String",
    "clock": "rosgraph_msgs/Clock",
}
"""What is published, and its type; ``clock`` comes last in a tick."""

METRES_NORTH: Final = 6_335_439.327
"""Radius of the meridian at the equator of WGS 84 [m]: a map has no place on the earth, so that
fixes are those of one whose origin is at latitude and longitude 0."""
METRES_EAST: Final = 6_378_137.0
"""Radius of the equator of WGS 84 [m]."""


class Field(NamedTuple):
    """A field of a message.

    Attributes:
        kind: Its type, or that of its elements; with the package where it is no built-in.
        name: Of it.
        length: None for one, 0 for any number of them, else how many.
        constant: Value of what is no field but a constant; else empty.
    """

    kind: str
    name: str
    length: int | None
    constant: str


def definitions(version: int) -> dict[str, list[Field]]:
    """Read the definitions of ROS 1 or ROS 2, by type."""
    text = " ".join((_SAME + (_ROS_1 if version == 1 else _ROS_2)).split("\n    "))
    lines = [line for line in text.splitlines() if line]
    found = {}
    for line in lines:
        name, _, fields = line.partition(": ")
        found[name] = [_field(name.partition("/")[0], field) for field in fields.split(", ")]
    return found


def _field(package: str, text: str) -> Field:
    kind, name = text.split()
    kind, bracket, length = kind.rstrip("]").partition("[")
    if kind[0].isupper():
        kind = f"{package}/{kind}"
    name, _, constant = name.partition("=")
    return Field(kind, name, int(length or 0) if bracket else None, constant)


def filled(
    known: Mapping[str, Sequence[Field]],
    kind: str,
    value: Any,
    build: Callable[[str, dict[str, Any]], Any],
) -> Any:
    """Make a message of a dictionary; what it leaves out is nothing, or 0.

    Args:
        known: Definitions by type.
        kind: Type of the message.
        value: The dictionary, or the value of a type that is built in.
        build: Makes a message of its type and fields; those of a time are ``sec`` and ``nanosec``.
    """
    if kind == "time":
        value = value or {"secs": 0, "nsecs": 0}
        return build(kind, {"sec": value["secs"], "nanosec": value["nsecs"]})
    if kind not in known:
        return {"string": "", "bool": False}.get(kind, 0) if value is None else value
    made: dict[str, Any] = {}
    for field in known[kind]:
        item = (value or {}).get(field.name)
        if field.constant:
            continue
        if field.length is None:
            made[field.name] = filled(known, field.kind, item, build)
        elif item is None or field.kind not in known:
            made[field.name] = [0] * field.length if item is None else item
        else:
            made[field.name] = [filled(known, field.kind, element, build) for element in item]
    return build(kind, made)


def nanoseconds(time: float) -> int:
    """Return a time in whole nanoseconds, as stamps have it."""
    return round(time * 1e9)


def stamp(time: float) -> dict[str, int]:
    """Return a time [s] as a stamp."""
    secs, nsecs = divmod(nanoseconds(time), 10**9)
    return {"secs": secs, "nsecs": nsecs}


class Topics:
    """What the topics are told of one run, and how its answers are read."""

    def __init__(self, hello: Mapping[str, Any], version: int) -> None:
        """Prepare.

        Args:
            hello: First line of a run.
            version: Of ROS.
        """
        self._version = version
        self._sensors: Mapping[str, Any] = hello["sensors"]
        self._renamed: Mapping[str, str] = hello["parameters"].get("topics", {})
        self._now = 0
        self._tick = 0

    def topic(self, name: str) -> str:
        """Return the name that a topic has in this run."""
        return self._renamed.get(name, name)

    def messages(self, line: bytes, shown: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
        """List topics with their messages at one tick, in the order to send them.

        A sensor has one where it delivers at this tick.
        """
        self._tick, self._now = shown["tick"], nanoseconds(shown["time"])
        transforms = []
        for name, item in shown["sensors"].items():
            sensor = self._sensors[name]
            kind, mount = sensor["kind"], sensor["mount"]
            if mount is not None:
                x, y, z, yaw = mount
                transforms.append(_transform(shown["time"], "base_link", name, (x, y, z), yaw))
            if not item["fresh"]:
                continue
            header = {"stamp": stamp(item["stamp"]), "frame_id": name if mount else "base_link"}
            if "estimate" in item:
                ego = [_number(value) for value in item["estimate"]]
                transforms += _ego_frames(item["stamp"], ego)
                yield "odom", _odometry(item["stamp"], ego)
            if item["most"]:
                found = [self._detection(header, row, mount) for row in item["detections"]]
                yield "objects", {"header": header, "detections": found}
            if "points" in item:
                yield "points", _cloud(header, item["points"], mount[3] if mount else 0.0)
            if "values" in item:
                values = [_number(value) for value in item["values"]]
                yield (
                    ("imu", _imu(header, values))
                    if kind == "imu"
                    else ("fix", _fix(header, values))
                )
        yield "tf", {"transforms": transforms}
        yield "adeye/observation", {"data": line.decode("ascii").rstrip("\n")}
        yield "clock", {"clock": stamp(shown["time"])}

    def answer(self, secs: int, nsecs: int, acceleration: float, angle: float) -> dict[str, Any]:
        """Return a command as ``adeye/channel@1`` has it; its stamp tells what it answers."""
        told = secs * 10**9 + nsecs
        return {
            "tick": self._tick + (told > self._now) - (told < self._now),
            "acceleration": acceleration if math.isfinite(acceleration) else None,
            "steering_angle": angle if math.isfinite(angle) else None,
        }

    def _detection(
        self, header: Any, row: Sequence[Any], mount: Sequence[float] | None
    ) -> dict[str, Any]:
        x, y, _, _, length, width, kind = (_number(value) for value in row)
        heading = 0.0
        if mount is not None:
            along, across, yaw = x - mount[0], y - mount[1], mount[3]
            x = math.cos(yaw) * along + math.sin(yaw) * across
            y = math.cos(yaw) * across - math.sin(yaw) * along
            heading = -yaw
        pose = _pose(x, y, heading)
        known: dict[str, Any] = {"id": int(kind), "score": 1.0}
        if self._version == 2:
            known = {"hypothesis": {"class_id": str(int(kind)), "score": 1.0}}
        return {
            "header": header,
            "results": [{**known, "pose": {"pose": pose}}] if kind >= 0 else [],
            "bbox": {"center": pose, "size": {"x": length, "y": width, "z": 0.0}},
        }


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _yaw(angle: float) -> dict[str, float]:
    return {"x": 0.0, "y": 0.0, "z": math.sin(angle / 2.0), "w": math.cos(angle / 2.0)}


def _vector(x: float, y: float = 0.0, z: float = 0.0) -> dict[str, float]:
    return {"x": x, "y": y, "z": z}


def _pose(x: float, y: float, heading: float) -> dict[str, Any]:
    return {"position": _vector(x, y), "orientation": _yaw(heading)}


def _transform(
    time: float, parent: str, child: str, place: tuple[float, float, float], heading: float
) -> dict[str, Any]:
    return {
        "header": {"stamp": stamp(time), "frame_id": parent},
        "child_frame_id": child,
        "transform": {"translation": _vector(*place), "rotation": _yaw(heading)},
    }


def _ego_frames(time: float, ego: Sequence[float]) -> Iterator[dict[str, Any]]:
    """Yield where the ego is, and the nearest place on the centre of its lane."""
    x, y, heading = ego[:3]
    road, offset = ego[9], ego[12]
    yield _transform(time, "map", "base_link", (x, y, 0.0), heading)
    foot = x + offset * math.sin(road), y - offset * math.cos(road), 0.0
    yield _transform(time, "map", "lane", foot, road)


def _odometry(time: float, ego: Sequence[float]) -> dict[str, Any]:
    x, y, heading, speed, _, _, rate = ego[:7]
    return {
        "header": {"stamp": stamp(time), "frame_id": "map"},
        "child_frame_id": "base_link",
        "pose": {"pose": _pose(x, y, heading)},
        "twist": {"twist": {"linear": _vector(speed), "angular": _vector(0.0, 0.0, rate)}},
    }


def _imu(header: Any, values: Sequence[float]) -> dict[str, Any]:
    along, across, rate = values
    return {
        "header": {**header, "frame_id": "base_link"},
        "orientation": _yaw(0.0),
        # It gives no orientation, and says so as the type has it.
        "orientation_covariance": [-1.0, *[0.0] * 8],
        "angular_velocity": _vector(0.0, 0.0, rate),
        "linear_acceleration": _vector(along, across),
    }


def _fix(header: Any, values: Sequence[float]) -> dict[str, Any]:
    return {
        "header": header,
        "status": {"status": 0 if math.isfinite(values[0]) else -1, "service": 1},
        "latitude": math.degrees(values[1] / METRES_NORTH),
        "longitude": math.degrees(values[0] / METRES_EAST),
    }


def _cloud(header: Any, points: Sequence[Sequence[Any]], yaw: float) -> dict[str, Any]:
    """Make a cloud in the frame of the sensor of those beams that have a return."""
    rows = []
    for distance, bearing, elevation in points:
        if distance:
            level, angle = distance * math.cos(elevation), bearing - yaw
            place = level * math.cos(angle), level * math.sin(angle), distance * math.sin(elevation)
            rows.append(struct.pack("<3f", *place))
    fields = [
        {"name": name, "offset": 4 * at, "datatype": 7, "count": 1} for at, name in enumerate("xyz")
    ]
    return {
        "header": header,
        "height": 1,
        "width": len(rows),
        "fields": fields,
        "point_step": 12,
        "row_step": 12 * len(rows),
        "data": b"".join(rows),
        "is_dense": True,
    }
