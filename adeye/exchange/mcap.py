"""A run as MCAP with the schemas of Foxglove, which its viewer and Lichtblick know.

Topics: ``/tf`` and ``/tf_static``; ``/road`` and what stands on it; ``/scene``, ego and actors;
``/sensor/ID/detections`` and ``/sensor/ID/points``; ``/channel/ID/tracks``, ``…/candidates`` and
``…/command``; ``/ego``, ``/object/ID`` and ``/switch`` for plots; ``/events`` and ``/metrics``. All
but tracks is in ``map``. ``/sensor/ID/image`` is what a physical camera showed, with
``/sensor/ID/calibration``.
"""

from __future__ import annotations

import json
import math
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from foxglove import messages as fox

from adeye import signals as columns
from adeye.exchange.container import mcap_file
from adeye.exchange.view import BASE, MAP, Account, RunView, nanoseconds, quaternion

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Iterator, Mapping
    from pathlib import Path

    from adeye.exchange.container import McapFile
    from adeye.exchange.view import Remark, SensorPose
    from adeye.trace import Album, Picture

    Say = Callable[[int], Any]
    """Gives the message of a row, or None where there is nothing new."""

_EGO: Final = "ego"
_BLUE, _GREY, _DARK, _ORANGE = (
    *((0.12, 0.45, 0.85, 0.9), (0.55, 0.57, 0.6, 0.9)),
    *((0.35, 0.33, 0.3, 0.9), (0.95, 0.55, 0.1, 0.9)),
)
_GREEN, _WHITE, _FAINT = (0.1, 0.7, 0.35, 0.9), (0.95, 0.95, 0.95, 1.0), (0.6, 0.6, 0.6, 0.35)
_NIGHT: Final = (0.05, 0.06, 0.08)
"""Of an image where it shows nothing."""
_SHADES: Final = (1.0, 0.8, 0.6)
"""Of objects of one class, which an image could not tell apart."""
_YELLOW, _CYAN = (255, 217, 51, 255), (64, 217, 255, 255)
"""Of detections and of a lidar's points: red, green, blue, alpha."""
_POINT: Final = np.dtype([("place", "<f8", 3), ("colour", "u1", 4)])
_LINE: Final = 0.12
"""Width of painted lines and of trajectories [m]."""
_TRACK_HEIGHT: Final = 0.1
"""Tracks know no height: they lie on the ground as plates [m]."""
_DEFAULT_TRACK: Final = 0.5
"""Length and width of a track that knows none [m]."""
_LEVELS: Final = {
    "info": fox.LogLevel.Info,
    "warning": fox.LogLevel.Warning,
    "error": fox.LogLevel.Error,
}
_EGO_NAMES: Final = (
    *("x_m", "y_m", "heading_rad", "speed_mps", "acceleration_mps2", "steering_angle_rad"),
    "yaw_rate_radps",
)
_OBJECT_NAMES: Final = _EGO_NAMES[:5]
_COMMAND: Final = ("acceleration_mps2", "steering_angle_rad")
_WORDS: Final = frozenset({"status", "authority", "reason"})
"""Values that are words, not numbers."""
_NO_IMAGES: Final[Album] = {}


def write_mcap(view: RunView, account: Account, path: Path, album: Album = _NO_IMAGES) -> None:
    """Write a run, always the same bytes.

    Args:
        view: The run.
        account: What is known of it beside its trace.
        path: Of the file.
        album: Images of its cameras; no trace holds them.
    """
    with mcap_file(path) as file:
        topics = [_topic(file, *item) for item in _topics(view, album)]
        events = _topic(file, "/events", fox.Log, lambda _: None)[0]
        metrics = _topic(file, "/metrics", sorted(account.metrics or {}), lambda _: None)[0]
        times = [nanoseconds(time) for time in view.time.tolist()]
        waiting = sorted(account.remarks, key=lambda item: item.time)
        for row, time in enumerate(times):
            for channel, say in topics:
                if (message := say(row)) is not None:
                    file.log(channel, time, _bytes(message))
            is_last = row == len(times) - 1
            while waiting and (is_last or nanoseconds(waiting[0].time) < times[row + 1]):
                remark = waiting.pop(0)
                file.log(events, min(nanoseconds(remark.time), times[-1]), _log(remark).encode())
        file.log(metrics, times[-1], _bytes(dict(account.metrics or {})))
        file.say("adeye", {"run": account.run, **account.about})


def _topic(file: McapFile, topic: str, kind: Any, say: Say) -> tuple[int, Say]:
    """Begin a topic of a Foxglove schema, or of numbers by name."""
    if isinstance(kind, list | tuple):
        types = {name: {"type": "string" if name in _WORDS else "number"} for name in kind}
        text = json.dumps({"type": "object", "properties": types}).encode()
        return file.channel(topic, (f"adeye{topic}", "jsonschema", text), "json"), say
    schema = kind.get_schema()
    return file.channel(topic, (schema.name, schema.encoding, schema.data)), say


def _bytes(message: Any) -> bytes:
    """Encode a message of Foxglove, or values by name without those that are no numbers."""
    if not isinstance(message, dict):
        encoded: bytes = message.encode()
        return encoded
    kept = {
        name: value
        for name, value in message.items()
        if isinstance(value, str) or (value is not None and math.isfinite(value))
    }
    return json.dumps(kept).encode()


def _topics(view: RunView, album: Album) -> Iterator[tuple[str, Any, Say]]:
    yield "/tf", fox.FrameTransforms, lambda row: _ego_frame(view, row)
    yield "/tf_static", fox.FrameTransforms, _once(lambda: _sensor_frames(view, album))
    yield "/road", fox.SceneUpdate, _once(lambda: _road(view))
    yield "/scene", fox.SceneUpdate, lambda row: _scene(view, row)
    yield "/ego", _EGO_NAMES, _numbers(_EGO_NAMES, view.ego)
    for index, name in enumerate(view.objects_of[: view.actors]):
        yield f"/object/{name}", _OBJECT_NAMES, _numbers(_OBJECT_NAMES, view.objects[:, index])
    lidars = view.trace.layout.lidars
    for pose in view.sensors:
        if pose.detects:
            samples = {item[0]: item for item in view.samples(pose.index)}
            yield (
                f"/{pose.frame}/detections",
                fox.PointCloud,
                partial(_detections, samples, pose.place[2]),
            )
        if pose.id in lidars and view.trace["points"].shape[3]:
            points = view.column("points", 1)[:, lidars.index(pose.id)]
            yield f"/{pose.frame}/points", fox.PointCloud, partial(_points, view, pose, points)
    for index, name in enumerate(view.trace.layout.channels):
        yield from _channel(view, index, name)
    yield from _images(view, album)
    yield "/switch", ("authority", "reason", *_COMMAND), lambda row: _switch(view, row)


def _once(make: Callable[[], Any]) -> Say:
    return lambda row: make() if row == 0 else None


def _numbers(names: tuple[str, ...], values: Any) -> Say:
    return lambda row: dict(zip(names, values[row].tolist(), strict=True))


def _stamp(time: float) -> fox.Timestamp:
    seconds, rest = divmod(nanoseconds(time), 1_000_000_000)
    return fox.Timestamp(seconds, rest)


def _vector(x: float, y: float, z: float) -> fox.Vector3:
    return fox.Vector3(x=x, y=y, z=z)


def _turn(yaw: float, pitch: float = 0.0) -> fox.Quaternion:
    x, y, z, w = quaternion(yaw, pitch)
    return fox.Quaternion(x=x, y=y, z=z, w=w)


def _color(parts: tuple[float, float, float, float]) -> fox.Color:
    r, g, b, a = parts
    return fox.Color(r=r, g=g, b=b, a=a)


# --- Frames ---------------------------------------------------------------------------------------


def _ego_frame(view: RunView, row: int) -> fox.FrameTransforms:
    x, y, heading = view.ego[row, : columns.EGO_HEADING + 1].tolist()
    frame = fox.FrameTransform(
        timestamp=_stamp(view.time[row]),
        parent_frame_id=MAP,
        child_frame_id=BASE,
        translation=_vector(x, y, 0.0),
        rotation=_turn(heading),
    )
    return fox.FrameTransforms(transforms=[frame])


def _sensor_frames(view: RunView, images: Container[str]) -> fox.FrameTransforms:
    return fox.FrameTransforms(
        transforms=[
            fox.FrameTransform(
                timestamp=_stamp(0.0),
                parent_frame_id=BASE,
                child_frame_id=pose.frame,
                translation=_vector(*pose.place),
                rotation=_turn(pose.yaw, pose.pitch),
            )
            for pose in view.sensors
        ]
        + [
            fox.FrameTransform(
                timestamp=_stamp(0.0),
                parent_frame_id=pose.frame,
                child_frame_id=_optical(pose.id),
                translation=_vector(0.0, 0.0, 0.0),
                rotation=fox.Quaternion(x=-0.5, y=0.5, z=-0.5, w=0.5),
            )
            for pose in view.sensors
            if pose.id in images
        ]
    )


# --- What is on the road --------------------------------------------------------------------------


def _entity(time: float, name: str, frame: str = MAP, **parts: Any) -> fox.SceneEntity:
    return fox.SceneEntity(timestamp=_stamp(time), frame_id=frame, id=name, **parts)


def _box(
    x: float, y: float, yaw: float, size: tuple[float, float, float], color: Any
) -> fox.CubePrimitive:
    """Stand a box of length, width and height on the ground."""
    pose = fox.Pose(position=_vector(x, y, 0.5 * size[2]), orientation=_turn(yaw))
    return fox.CubePrimitive(pose=pose, size=_vector(*size), color=_color(color))


def _paint(view: RunView, index: int) -> tuple[float, float, float, float]:
    """Return the colour of an object: free to go anywhere, other traffic, or standing."""
    is_free = view.kind(index) in columns.OBJECT_CLASSES[columns.FIRST_FREE : columns.LAST_FREE + 1]
    return (_ORANGE if is_free else _GREY) if index < view.actors else _DARK


def _object(view: RunView, row: int, index: int) -> fox.SceneEntity:
    x, y, heading = view.objects[row, index, : columns.OBJECT_HEADING + 1].tolist()
    return _entity(
        float(view.time[row]),
        view.objects_of[index],
        cubes=[_box(x, y, heading, view.size(index), _paint(view, index))],
        metadata=[fox.KeyValuePair(key="class", value=view.kind(index))],
    )


def _scene(view: RunView, row: int) -> fox.SceneUpdate:
    x, y, heading = view.ego[row, : columns.EGO_HEADING + 1].tolist()
    ego = _entity(float(view.time[row]), _EGO, cubes=[_box(x, y, heading, view.size(), _BLUE)])
    actors = [_object(view, row, index) for index in range(view.actors)]
    return fox.SceneUpdate(entities=[ego, *actors])


def _road(view: RunView) -> fox.SceneUpdate:
    """Draw what stays as it is; in a topic of its own, of which a viewer shows the last message."""
    found = view.road
    edges = [] if found.shoulder is None else [found.shoulder]
    lines = [
        _strip(
            line.places,
            _FAINT if line.marking == "none" else _WHITE,
            # Its points are those of the road, so what is dashed is drawn thinner.
            width=0.5 * _LINE if line.marking == "dashed" else _LINE,
        )
        for line in (*found.boundaries, *edges)
    ]
    still = [_object(view, 0, index) for index in range(view.actors, len(view.objects_of))]
    return fox.SceneUpdate(entities=[_entity(0.0, "road", lines=lines), *still])


def _strip(places: Any, color: Any, *, width: float = _LINE) -> fox.LinePrimitive:
    return fox.LinePrimitive(
        thickness=width,
        points=[fox.Point3(x=x, y=y, z=0.0) for x, y in places.tolist()],
        color=_color(color),
    )


# --- What sensors and channels make of it ---------------------------------------------------------


def _cloud(time: float, places: Any, height: float, colour: tuple[int, ...]) -> fox.PointCloud:
    """Write places (N, 2) in the map, which know no height, as a cloud as high as their sensor.

    Its points have their own colour: by a number of them, as viewers choose it, one is all dark.
    """
    there = np.zeros(len(places), dtype=_POINT)
    there["place"][:, :2], there["place"][:, 2] = places, height
    there["colour"] = colour
    kinds = fox.PackedElementFieldNumericType
    fields = [
        fox.PackedElementField(name=name, offset=8 * place, type=kinds.Float64)
        for place, name in enumerate("xyz")
    ]
    fields += [
        fox.PackedElementField(name=name, offset=24 + place, type=kinds.Uint8)
        for place, name in enumerate(("red", "green", "blue", "alpha"))
    ]
    pose = fox.Pose(position=_vector(0.0, 0.0, 0.0), orientation=_turn(0.0))
    return fox.PointCloud(
        timestamp=_stamp(time),
        frame_id=MAP,
        pose=pose,
        point_stride=_POINT.itemsize,
        fields=fields,
        data=there.tobytes(),
    )


def _detections(samples: Mapping[int, Any], height: float, row: int) -> fox.PointCloud | None:
    if row not in samples:
        return None
    _, _, taken, places, has = samples[row]
    return _cloud(taken, places[has], height, _YELLOW)


def _points(view: RunView, pose: SensorPose, points: Any, row: int) -> fox.PointCloud | None:
    if row == view.rows - 1 or (row and _is_same(points[row], points[row - 1])):
        return None
    # When it was taken; before the first sample it is that there is none.
    taken = float(view.trace["sensor_stamp"][view.run, row, pose.index])
    taken = min(taken, float(view.time[row])) if taken >= 0.0 else float(view.time[row])
    has = np.isfinite(points[row][:, 0])
    return _cloud(taken, points[row][has], pose.place[2], _CYAN)


def _images(view: RunView, album: Album) -> Iterator[tuple[str, Any, Say]]:
    """Give what cameras showed, at the tick at which it was taken."""
    palette = _palette(view)
    for name, pictures in album.items():
        topic, taken = f"/sensor/{name}", {nanoseconds(item.time): item for item in pictures}
        yield (
            f"{topic}/calibration",
            fox.CameraCalibration,
            _once(partial(_calibration, view, name)),
        )
        yield f"{topic}/image", fox.RawImage, partial(_image, view, name, taken, palette)


def _palette(view: RunView) -> Any:
    """Return colours (M + 2, 3) of pixels: each object's as in the scene, lighter or darker."""
    shades = [
        [_SHADES[index % len(_SHADES)] * part for part in _paint(view, index)[:3]]
        for index in range(len(view.objects_of))
    ]
    # What is no object has a negative number: -2 and -1 are the last two.
    return np.rint(255.0 * np.array([*shades, _WHITE[:3], _NIGHT])).astype(np.uint8)


def _calibration(view: RunView, name: str) -> fox.CameraCalibration:
    """Say how a camera depicts: as a pinhole, with the middle of the first pixel at 0, 0."""
    spec: Any = view.trace.layout.architectures[view.run].sensors[name]
    focal = 0.5 * spec.columns / math.tan(0.5 * spec.field_of_view)
    across, down = 0.5 * (spec.columns - 1), 0.5 * (spec.rows - 1)
    return fox.CameraCalibration(
        timestamp=_stamp(0.0),
        frame_id=_optical(name),
        width=spec.columns,
        height=spec.rows,
        K=[focal, 0.0, across, 0.0, focal, down, 0.0, 0.0, 1.0],
        R=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        P=[focal, 0.0, across, 0.0, 0.0, focal, down, 0.0, 0.0, 0.0, 1.0, 0.0],
    )


def _optical(name: str) -> str:
    """Name the frame of a camera that images are in: x to the right, y down, z ahead."""
    return f"sensor/{name}/optical"


def _image(
    view: RunView, name: str, taken: Mapping[int, Picture], palette: Any, row: int
) -> fox.RawImage | None:
    picture = taken.get(nanoseconds(view.time[row]))
    if picture is None:
        return None
    pixels = picture.pixels[:, ::-1] if view.mirrored else picture.pixels
    rows, width = pixels.shape
    return fox.RawImage(
        timestamp=_stamp(picture.time),
        frame_id=_optical(name),
        width=width,
        height=rows,
        encoding="rgb8",
        step=3 * width,
        data=palette[pixels].tobytes(),
    )


def _is_same(one: Any, other: Any) -> bool:
    return bool(np.array_equal(one, other, equal_nan=True))


def _channel(view: RunView, index: int, name: str) -> Iterator[tuple[str, Any, Say]]:
    topic, trace, run = f"/channel/{name}", view.trace, view.run
    tracks = view.tracks[:, index]
    if np.isfinite(tracks).any():
        yield f"{topic}/tracks", fox.SceneUpdate, lambda row: _tracks(view, row, name, tracks)
    costs = trace["candidate_costs"][run, :, index]
    if np.isfinite(costs).any():
        places = view.column("candidates", 1)[:, index]
        chosen = trace["chosen"][run, :, index]

        def candidates(row: int) -> fox.SceneUpdate | None:
            if row == view.rows - 1 or (row and _is_same(places[row], places[row - 1])):
                return None
            fan = _fan(places[row], costs[row], int(chosen[row]))
            return fox.SceneUpdate(entities=[_entity(view.time[row], f"{name} plans", lines=fan)])

        yield f"{topic}/candidates", fox.SceneUpdate, candidates
    asked = trace["acceleration"][run, :, index]
    turns = view.turned(trace["steering_angle"][run, :, index])
    status = trace["status"][run, :, index]

    def command(row: int) -> dict[str, Any] | None:
        if row == view.rows - 1:
            return None
        said = zip(_COMMAND, (float(asked[row]), float(turns[row])), strict=True)
        return {**dict(said), "status": columns.STATUS_LABELS[int(status[row])]}

    yield f"{topic}/command", (*_COMMAND, "status"), command


def _tracks(view: RunView, row: int, name: str, tracks: Any) -> fox.SceneUpdate | None:
    if row == view.rows - 1:
        return None
    boxes = []
    for x, y, vx, vy, length, width in tracks[row][np.isfinite(tracks[row]).all(axis=1)].tolist():
        size = (length or _DEFAULT_TRACK, width or _DEFAULT_TRACK, _TRACK_HEIGHT)
        yaw = math.atan2(vy, vx) if math.hypot(vx, vy) > 1.0 else 0.0
        boxes.append(_box(x, y, yaw, size, _ORANGE))
    entity = _entity(view.time[row], f"{name} tracks", BASE, cubes=boxes, frame_locked=True)
    return fox.SceneUpdate(entities=[entity])


def _fan(places: Any, costs: Any, chosen: int) -> list[fox.LinePrimitive]:
    """Draw the trajectories that a channel chose from, the chosen one last."""
    there = np.isfinite(places).all(axis=(1, 2)) & ~np.isnan(costs)
    order = sorted(np.flatnonzero(there).tolist(), key=lambda item: item == chosen)
    return [_strip(places[item], _GREEN if item == chosen else _FAINT) for item in order]


def _switch(view: RunView, row: int) -> dict[str, Any] | None:
    if row == view.rows - 1:
        return None
    trace, run = view.trace, view.run
    acceleration, angle = trace["command"][run, row].tolist()
    acting = int(trace["authority"][run, row])
    return {
        "authority": "none" if acting < 0 else trace.layout.channels[acting],
        "reason": columns.REASON_LABELS[int(trace["reason"][run, row])],
        "acceleration_mps2": acceleration,
        "steering_angle_rad": view.turned(angle),
    }


# --- What is told of it ---------------------------------------------------------------------------


def _log(remark: Remark) -> fox.Log:
    return fox.Log(
        timestamp=_stamp(remark.time),
        level=_LEVELS[remark.level],
        message=remark.text,
        name=remark.name,
    )
