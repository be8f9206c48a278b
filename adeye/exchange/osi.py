"""A run as traces of ASAM OSI 3: the ground truth, and what each sensor detects.

Frames are those of OSI: places of boxes are their centres in the world; a vehicle's own frame
begins in the middle of its rear axle on the ground; detections are told in the frame of the sensor.
Sensors are drawn in plan view, so detections have neither height nor size, and mounts no pitch.

Source:
    ASAM OSI 3.8.0: ``osi_groundtruth.proto``, ``osi_sensordata.proto``; formats and names of trace
    files.
"""

from __future__ import annotations

import math
import re
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import google.protobuf
from mcap_protobuf.schema import build_file_descriptor_set
from osi3 import osi_version_pb2
from osi3.osi_groundtruth_pb2 import GroundTruth
from osi3.osi_lane_pb2 import Lane, LaneBoundary
from osi3.osi_object_pb2 import MovingObject, StationaryObject
from osi3.osi_sensordata_pb2 import SensorData

from adeye import signals as columns
from adeye.exchange.container import mcap_file
from adeye.exchange.view import nanoseconds
from adeye.kernel.motion import point_velocity
from adeye.outputs import has_mark
from adeye.version import __version__

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

    from adeye.exchange.road_lines import RoadLine
    from adeye.exchange.view import Account, RunView, SensorPose

START: Final = "19700101T000000Z"
"""Where simulated time begins, which is what the names of the files tell: no clock is read."""
_ZERO: Final = "1970-01-01T00:00:00Z"

NAMES: Final = re.compile(rf"{START}_(gt|sd|multi)_\d+_\d+_\d+_[\w-]+\.(osi|mcap)")
"""What the files are called that are written."""

HOST: Final = 1
"""Identifier of the ego; objects, sensors, lines and lanes follow."""

_VEHICLES: Final = {
    "car": MovingObject.VehicleClassification.TYPE_MEDIUM_CAR,
    "van": MovingObject.VehicleClassification.TYPE_DELIVERY_VAN,
    "truck": MovingObject.VehicleClassification.TYPE_HEAVY_TRUCK,
    "bus": MovingObject.VehicleClassification.TYPE_BUS,
    "motorcycle": MovingObject.VehicleClassification.TYPE_MOTORBIKE,
    "cyclist": MovingObject.VehicleClassification.TYPE_BICYCLE,
}
_STATIONARY: Final = {
    "barrier": StationaryObject.Classification.TYPE_BARRIER,
    "building": StationaryObject.Classification.TYPE_BUILDING,
}
_MARKINGS: Final = {
    "solid": LaneBoundary.Classification.TYPE_SOLID_LINE,
    "dashed": LaneBoundary.Classification.TYPE_DASHED_LINE,
    "none": LaneBoundary.Classification.TYPE_NO_LINE,
}


@dataclass(frozen=True, slots=True)
class Channel:
    """The messages of one kind, from one source.

    Attributes:
        kind: ``gt`` or ``sd``, as names of files tell it.
        source: Id of the sensor; empty for the ground truth.
        messages: In order of time.
    """

    kind: str
    source: str
    messages: tuple[Any, ...]

    @property
    def topic(self) -> str:
        """Name of its topic in a file of several."""
        return f"SensorData/{self.source}" if self.source else "GroundTruth"


def channels_of(view: RunView) -> tuple[Channel, ...]:
    """Make the messages of a run: ground truth at each tick, and each sensor's samples."""
    found = [Channel("gt", "", tuple(ground_truth(view)))]
    found += [
        Channel("sd", pose.id, tuple(sensor_data(view, pose)))
        for pose in view.sensors
        if pose.detects
    ]
    return tuple(item for item in found if item.messages)


# --- Files ----------------------------------------------------------------------------------------


def is_own(file: Path) -> bool:
    """Tell whether a file was written here; single traces say so by the day that they begin."""
    return file.suffix == ".osi" or has_mark(file)


def write_osi(view: RunView, account: Account, folder: Path) -> list[str]:
    """Write a run into a folder, always the same bytes.

    Args:
        view: The run.
        account: What is known of it beside its trace.
        folder: It gets a single-channel file for the ground truth and for each sensor, and one of
            MCAP with all of them.

    Returns:
        Names of the files.
    """
    channels = channels_of(view)
    short, names = account.run[:12], []
    for channel in channels:
        trace = f"{short}-{channel.source}" if channel.source else short
        names.append(_name(channel.kind, len(channel.messages), trace, "osi"))
        _write_single(channel.messages, folder / names[-1])
    most = max(len(channel.messages) for channel in channels)
    names.append(_name("multi", most, short, "mcap"))
    _write_multi(channels, account, folder / names[-1])
    return names


def _name(kind: str, frames: int, trace: str, ending: str) -> str:
    """Name a file as OSI asks for."""
    versions = (_osi_version(), google.protobuf.__version__)
    numbers = "_".join(version.replace(".", "") for version in versions)
    return f"{START}_{kind}_{numbers}_{frames}_{trace}.{ending}"


def _osi_version() -> str:
    found = _interface()
    return f"{found.version_major}.{found.version_minor}.{found.version_patch}"


def _interface() -> Any:
    options = osi_version_pb2.DESCRIPTOR.GetOptions()
    return options.Extensions[osi_version_pb2.current_interface_version]


def _write_single(messages: Sequence[Any], path: Path) -> None:
    with path.open("wb") as stream:
        for message in messages:
            content = _serialised(message)
            stream.write(struct.pack("<I", len(content)))
            stream.write(content)


def _serialised(message: Any) -> bytes:
    content: bytes = message.SerializeToString(deterministic=True)
    return content


def _write_multi(channels: Sequence[Channel], account: Account, path: Path) -> None:
    version, protobuf = _osi_version(), google.protobuf.__version__
    said = "net.asam.osi.trace"
    with mcap_file(path) as file:
        about = ", ".join(f"{name} {value}" for name, value in sorted(account.about.items()))
        file.say(
            said,
            {
                "version": version,
                "min_osi_version": version,
                "max_osi_version": version,
                "min_protobuf_version": protobuf,
                "max_protobuf_version": protobuf,
                "zero_time": _ZERO,
                "description": f"run {account.run}: {about}",
                "data_sources": f"adeye {__version__}",
            },
        )
        waiting: list[tuple[int, int, Any]] = []
        for channel in channels:
            kind = type(channel.messages[0])
            schema = build_file_descriptor_set(kind).SerializeToString(deterministic=True)
            metadata = {
                f"{said}.channel.osi_version": version,
                f"{said}.channel.protobuf_version": protobuf,
                f"{said}.channel.description": channel.source or "what is true",
            }
            number = file.channel(
                channel.topic,
                (kind.DESCRIPTOR.full_name, "protobuf", schema),
                metadata=metadata,
            )
            waiting += [(_time_of(item), number, item) for item in channel.messages]
        for time, number, message in sorted(waiting, key=lambda item: item[:2]):
            file.log(number, time, _serialised(message))


def _time_of(message: Any) -> int:
    return int(message.timestamp.seconds) * 1_000_000_000 + int(message.timestamp.nanos)


# --- Messages -------------------------------------------------------------------------------------


def ground_truth(view: RunView) -> Iterator[GroundTruth]:
    """Yield what is true at each tick: the road, what stands, and who moves."""
    still = GroundTruth()
    still.version.CopyFrom(_interface())
    still.host_vehicle_id.value = HOST
    _add_road(view, still)
    for index in range(view.actors, len(view.objects_of)):
        _add_standing(view, index, still)
    for row in range(view.rows):
        truth = GroundTruth()
        truth.CopyFrom(still)
        _stamp(truth.timestamp, float(view.time[row]))
        _add_ego(view, row, truth)
        for index in range(view.actors):
            _add_actor(view, row, index, truth)
        yield truth


def _stamp(stamp: Any, time: float) -> None:
    stamp.seconds, stamp.nanos = divmod(nanoseconds(time), 1_000_000_000)


def _object_id(index: int) -> int:
    return HOST + 1 + index


def _place(base: Any, place: tuple[float, float], yaw: float, size: Iterable[float]) -> None:
    """Say where a box of length, width and height stands."""
    base.dimension.length, base.dimension.width, base.dimension.height = size
    base.position.x, base.position.y = place
    base.position.z = 0.5 * base.dimension.height
    base.orientation.yaw = _wrapped(yaw)
    base.orientation.roll = base.orientation.pitch = 0.0


def _wrapped(angle: float) -> float:
    """Return an angle above -π and up to π, as OSI asks for.

    >>> _wrapped(-math.pi) == math.pi, _wrapped(7.0) == 7.0 - 2.0 * math.pi
    (True, True)
    """
    if -math.pi < angle <= math.pi:
        return angle
    turned = math.remainder(angle, 2.0 * math.pi)
    return math.pi if turned <= -math.pi else turned


def _move(base: Any, yaw: float, velocity: tuple[float, float], acceleration: float) -> None:
    """Say how it moves: velocity in its own frame, acceleration along its heading."""
    sine, cosine = math.sin(yaw), math.cos(yaw)
    ahead, aside = velocity
    base.velocity.x, base.velocity.y = cosine * ahead - sine * aside, sine * ahead + cosine * aside
    base.acceleration.x, base.acceleration.y = cosine * acceleration, sine * acceleration
    base.velocity.z = base.acceleration.z = 0.0


def _add_ego(view: RunView, row: int, truth: GroundTruth) -> None:
    moving = truth.moving_object.add()
    moving.id.value = HOST
    moving.type = MovingObject.TYPE_VEHICLE
    moving.vehicle_classification.type = _VEHICLES["car"]
    x, y, yaw, speed, acceleration, _, rate = view.ego[row].tolist()
    _place(moving.base, (x, y), yaw, view.size())
    _move(moving.base, yaw, point_velocity(speed, rate, view.rear_axle, 0.0), acceleration)
    moving.base.orientation_rate.yaw = rate
    # The axle has no height of its own: its middle is told on the ground.
    rear = moving.vehicle_attributes.bbcenter_to_rear
    rear.x, rear.y, rear.z = 0.0 - view.rear_axle, 0.0, -0.5 * view.size()[2]
    front = moving.vehicle_attributes.bbcenter_to_front
    front.x, front.y, front.z = view.rear_axle, 0.0, rear.z


def _add_actor(view: RunView, row: int, index: int, truth: GroundTruth) -> None:
    moving = truth.moving_object.add()
    moving.id.value = _object_id(index)
    kind = view.kind(index)
    if kind in _VEHICLES:
        moving.type = MovingObject.TYPE_VEHICLE
        moving.vehicle_classification.type = _VEHICLES[kind]
    else:
        is_person = kind == "pedestrian"
        moving.type = MovingObject.TYPE_PEDESTRIAN if is_person else MovingObject.TYPE_OTHER
    x, y, yaw, speed, acceleration = view.objects[row, index].tolist()
    _place(moving.base, (x, y), yaw, view.size(index))
    _move(moving.base, yaw, (speed, 0.0), acceleration)


def _add_standing(view: RunView, index: int, truth: GroundTruth) -> None:
    standing = truth.stationary_object.add()
    standing.id.value = _object_id(index)
    other = StationaryObject.Classification.TYPE_OTHER
    standing.classification.type = _STATIONARY.get(view.kind(index), other)
    x, y, yaw = view.objects[0, index, : columns.OBJECT_HEADING + 1].tolist()
    _place(standing.base, (x, y), yaw, view.size(index))


def _add_road(view: RunView, truth: GroundTruth) -> None:
    """Add the lines of the road, and the lanes between them."""
    road = view.road
    first = _object_id(len(view.objects_of) + len(view.trace.layout.sensors))
    edge = LaneBoundary.Classification.TYPE_ROAD_EDGE
    for number, line in enumerate(road.boundaries):
        _add_line(truth, first + number, line, _MARKINGS[line.marking])
    if road.shoulder is not None:
        _add_line(truth, first + len(road.boundaries), road.shoulder, edge)
    lanes = first + len(road.boundaries) + 1
    for number, lane in enumerate(road.lanes):
        added = truth.lane.add()
        added.id.value = lanes + number
        said = added.classification
        said.type = Lane.Classification.TYPE_DRIVING
        said.centerline_is_driving_direction = lane.is_ahead
        # OSI tells right and left as seen along the centre line, which leads towards greater s.
        said.right_lane_boundary_id.add().value = first + lane.right
        said.left_lane_boundary_id.add().value = first + lane.left
        middle = 0.5 * (road.boundaries[lane.right].places + road.boundaries[lane.left].places)
        for x, y in middle.tolist():
            said.centerline.add(x=x, y=y, z=0.0)
        for other, beside in enumerate(road.lanes):
            if beside.left == lane.right:
                said.right_adjacent_lane_id.add().value = lanes + other
            if beside.right == lane.left:
                said.left_adjacent_lane_id.add().value = lanes + other


def _add_line(truth: GroundTruth, number: int, line: RoadLine, kind: Any) -> None:
    added = truth.lane_boundary.add()
    added.id.value = number
    added.classification.type = kind
    for x, y in line.places.tolist():
        point = added.boundary_line.add()
        point.position.x, point.position.y, point.position.z = x, y, 0.0


def sensor_data(view: RunView, pose: SensorPose) -> Iterator[SensorData]:
    """Yield the samples of a sensor: its detections in its own frame at the time of the sample."""
    sine, cosine = math.sin(pose.yaw), math.cos(pose.yaw)
    for row, taken_row, taken, places, has in view.samples(pose.index):
        data = SensorData()
        data.version.CopyFrom(_interface())
        _stamp(data.timestamp, float(view.time[row]))
        _stamp(data.last_measurement_time, taken)
        data.sensor_id.value = _object_id(len(view.objects_of) + pose.index)
        x, y, z = pose.place
        mount = data.mounting_position
        mount.position.x, mount.position.y, mount.position.z = x + view.rear_axle, y, z
        mount.orientation.yaw = _wrapped(pose.yaw)
        mount.orientation.roll = mount.orientation.pitch = 0.0
        for index in has.nonzero()[0].tolist():
            ahead, left = _in_vehicle(view, taken_row, places[index].tolist())
            ahead, left = ahead - x, left - y
            found = (data.moving_object if index < view.actors else data.stationary_object).add()
            found.header.ground_truth_id.add().value = _object_id(index)
            found.base.position.x = cosine * ahead + sine * left
            found.base.position.y = cosine * left - sine * ahead
        yield data


def _in_vehicle(view: RunView, row: int, place: Sequence[float]) -> tuple[float, float]:
    """Return a place of the map as seen from the middle of the ego's box."""
    x, y, yaw = view.ego[row, : columns.EGO_HEADING + 1].tolist()
    sine, cosine = math.sin(yaw), math.cos(yaw)
    east, north = place[0] - x, place[1] - y
    return cosine * east + sine * north, cosine * north - sine * east
