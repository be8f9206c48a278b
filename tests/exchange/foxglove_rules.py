"""What a viewer of Foxglove's schemas needs of a file, looked at message by message."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from jsonschema.validators import validator_for
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

ROOT = "map"
UNIT = {"r", "g", "b", "a"}
KINDS = {1: "u1", 2: "i1", 3: "<u2", 4: "<i2", 5: "<u4", 6: "<i4", 7: "<f4", 8: "<f8"}
"""Of a field of a cloud, by the numbers of ``foxglove.PackedElementField.NumericType``."""


def findings(path: Path) -> list[str]:
    """Return what is wrong with a file: each line names the topic, and the time where there is one.

    Each message has to be decoded by the schema of its own channel alone, without anything left
    over. Frames are one tree below ``map``, and every frame that is named is in it. Times of a
    topic do not go back, and nothing is told before it is. Numbers are finite, colours between 0
    and 1, sizes above 0, and rotations have the length 1.
    """
    found: list[str] = []
    parents: dict[str, str] = {}
    named: set[tuple[str, str]] = set()
    last: dict[str, int] = {}
    rules: dict[int, Any] = {}
    decoders = DecoderFactory()
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        topics = {channel.topic for channel in summary.channels.values()}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            where = f"{channel.topic} at {message.log_time} ns"
            if message.log_time < last.get(channel.topic, 0):
                found.append(f"{where}: goes back")
            last[channel.topic] = message.log_time
            assert schema is not None
            if channel.message_encoding == "json":
                content = json.loads(message.data, parse_constant=_refused)
                rules[schema.id] = rules.get(schema.id) or _rules(schema.data)
                rules[schema.id].validate(content)
                continue
            decode = decoders.decoder_for(channel.message_encoding, schema)
            assert decode is not None
            decoded = decode(message.data)
            found += [f"{where}: {text}" for text in _wrong(decoded)]
            for item in _messages(decoded):
                if hasattr(item, "timestamp") and channel.topic != "/events":
                    stamp = item.timestamp.seconds * 1_000_000_000 + item.timestamp.nanos
                    if not 0 <= stamp <= message.log_time:
                        found.append(f"{where}: is stamped {stamp} ns")
                if hasattr(item, "child_frame_id"):
                    known = parents.setdefault(item.child_frame_id, item.parent_frame_id)
                    if known != item.parent_frame_id:
                        found.append(f"{where}: {item.child_frame_id} has two parents")
                elif hasattr(item, "frame_id"):
                    named.add((channel.topic, item.frame_id))
    found += [f"{topic}: is empty" for topic in sorted(topics - last.keys())]
    named |= {("/tf", child) for child in parents}
    found += [
        f"{topic}: no way from {name!r} to {ROOT}"
        for topic, name in sorted(named)
        if not _leads_to_root(name, parents)
    ]
    return found


def _refused(word: str) -> float:
    msg = f"{word} is no JSON"
    raise ValueError(msg)


def _leads_to_root(name: str, parents: dict[str, str]) -> bool:
    passed = {name}
    while name in parents:
        name = parents[name]
        if name in passed:
            return False
        passed.add(name)
    return name == ROOT


def _messages(message: Any) -> Iterator[Any]:
    """Yield a message and all that are in it."""
    yield message
    for field, value in message.ListFields():
        if field.message_type is not None:
            for item in [value] if hasattr(value, "ListFields") else value:
                yield from _messages(item)


def _rules(schema: bytes) -> Any:
    content = json.loads(schema) | {"additionalProperties": False}
    kind = validator_for(content)
    kind.check_schema(content)
    return kind(content)


def _wrong(message: Any) -> Iterator[str]:
    if message.FromString(message.SerializeToString()) != message:
        yield "is not itself when it is written again"
    for item in _messages(message):
        name = item.DESCRIPTOR.name
        numbers = {
            field.name: getattr(item, field.name)
            for field in item.DESCRIPTOR.fields
            if field.cpp_type in {field.CPPTYPE_DOUBLE, field.CPPTYPE_FLOAT}
        }
        if not all(np.isfinite(value).all() for value in numbers.values()):
            yield f"{name} {numbers} is not finite"
        if name == "Color" and not all(0.0 <= numbers[part] <= 1.0 for part in UNIT):
            yield f"colour {numbers}"
        if name == "Quaternion" and abs(math.hypot(*numbers.values()) - 1.0) > 1e-9:
            yield f"rotation {numbers}"
        if name == "CubePrimitive" and min(item.size.x, item.size.y, item.size.z) <= 0.0:
            yield f"size of a cube {item.size}"
        if name == "LinePrimitive" and (item.thickness <= 0.0 or len(item.points) < 2):
            yield f"line of {len(item.points)} points, {item.thickness} wide"
        if name == "PointCloud":
            yield from _wrong_cloud(item)
        if name == "RawImage" and not (
            3 * item.width == item.step and item.step * item.height == len(item.data) > 0
        ):
            yield f"image of {item.width} × {item.height} with {len(item.data)} bytes"


def _wrong_cloud(cloud: Any) -> Iterator[str]:
    names = [field.name for field in cloud.fields]
    kinds = [KINDS[field.type] for field in cloud.fields]
    offsets = [field.offset for field in cloud.fields]
    ends = [at + np.dtype(kind).itemsize for at, kind in zip(offsets, kinds, strict=True)]
    if max(ends) > cloud.point_stride or len(cloud.data) % cloud.point_stride:
        yield f"{len(cloud.data)} bytes of {cloud.point_stride} for a point"
        return
    point: Any = {"names": names, "formats": kinds, "offsets": offsets}
    point["itemsize"] = cloud.point_stride
    points = np.frombuffer(cloud.data, np.dtype(point))
    if not all(np.isfinite(points[name]).all() for name in names):
        yield "a point that is not finite"
