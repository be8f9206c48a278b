"""Pack the embedded runs small: whole numbers, differences and runs of equal values.

Only what is drawn is rounded (places to 1 mm, angles to 0.1 mrad); verdicts and margins are given
as they were judged. The reader is ``web/decode.js``.
"""

from __future__ import annotations

import itertools
import json
import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Hashable, Sequence

    from adeye.report.parts import RunVerdict
    from adeye.report.replay import (
        ActorMotion,
        ChannelView,
        FanView,
        GridView,
        Line,
        Point,
        Replay,
        SensorView,
        SignalPlot,
        StaticBox,
        Track,
    )

LENGTH = 1000
"""Steps per metre, and per metre per second."""
POINT = 10
"""Steps per metre of the returns of a lidar."""
ANGLE = 10_000
"""Steps per radian."""
COARSE = 10
"""Steps per metre of a candidate's places."""
SHADES = 20
"""Steps from the least desirable to the best."""
DIGITS = 4
"""Digits of the largest value of a signal that are kept after the first."""

Packed = dict[str, Any]


def script_text(value: Any) -> str:
    r"""Write a value as JSON that is inert inside a ``<script>`` element.

    >>> script_text({"name": "</script><b>"})
    '{"name":"\\u003c/script>\\u003cb>"}'
    """
    text = json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    # The two line separators end a line in some readers of scripts, but not in JSON.
    for character in "<\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


def differences(values: Sequence[float | None], scale: int) -> Packed:
    """Pack numbers as whole differences from the number before.

    Args:
        values: Numbers; None where there is none.
        scale: Steps per unit.

    Returns:
        The scale ``k`` and the differences ``d``, None where there is no number.

    >>> differences([1.0, 1.5, None, 1.25], 100)
    {'k': 100, 'd': [100, 50, None, -25]}
    """
    packed: list[int | None] = []
    before = 0
    for value in values:
        if value is None:
            packed.append(None)
            continue
        steps = round(value * scale)
        packed.append(steps - before)
        before = steps
    return {"k": scale, "d": packed}


def repeats(values: Sequence[Hashable]) -> list[Any]:
    """Pack values as each value followed by how often it repeats.

    >>> repeats([False, False, True])
    [False, 2, True, 1]
    """
    groups = ((value, sum(1 for _ in group)) for value, group in itertools.groupby(values))
    return [item for pair in groups for item in pair]


def pack_replay(replay: Replay) -> Packed:
    """Pack one run for the page.

    Args:
        replay: The run.

    Returns:
        Plain lists, numbers and text.
    """
    ego = replay.ego
    return {
        **replay.model_dump(
            mode="json",
            include={
                *("run", "scenario", "architecture", "fault", "parameters", "outcome", "why"),
                *("command", "trace_digest", "step_s", "horizon_s", "events"),
            },
        ),
        "rows": replay.rows,
        "verdicts": [_verdict(verdict) for verdict in replay.verdicts],
        "boundaries": [_line(line) for line in replay.road.boundaries],
        "shoulder": None if replay.road.shoulder is None else _line(replay.road.shoulder),
        "ego": {
            "length": ego.length_m,
            "width": ego.width_m,
            "wheelbase": ego.wheelbase_m,
            "x": differences(ego.x_m, LENGTH),
            "y": differences(ego.y_m, LENGTH),
            "heading": differences(ego.heading_rad, ANGLE),
            "speed": differences(ego.speed_mps, LENGTH),
            "acceleration": differences(ego.acceleration_mps2, LENGTH),
            "steering": differences(ego.steering_angle_rad, ANGLE),
        },
        "actors": [_actor(actor) for actor in replay.actors],
        "boxes": [_box(box) for box in replay.boxes],
        "sensors": [_sensor(sensor) for sensor in replay.sensors],
        "channels": [_channel(channel) for channel in replay.channels],
        "grid": None if replay.grid is None else _grid(replay.grid),
        "faults": [
            {"id": fault.id, "text": fault.text, "active": repeats(fault.active)}
            for fault in replay.faults
        ],
        "authority": repeats(replay.authority),
        "reason": repeats(replay.reason),
        "signals": [_signal(signal) for signal in replay.signals],
    }


def _verdict(verdict: RunVerdict) -> Packed:
    return verdict.model_dump(mode="json")


def _line(line: Line) -> Packed:
    return {
        "marking": line.marking,
        "x": differences(line.x_m, LENGTH),
        "y": differences(line.y_m, LENGTH),
    }


def _actor(actor: ActorMotion) -> Packed:
    return {
        "id": actor.id,
        "kind": actor.kind,
        "length": actor.length_m,
        "width": actor.width_m,
        "x": differences(actor.x_m, LENGTH),
        "y": differences(actor.y_m, LENGTH),
        "heading": differences(actor.heading_rad, ANGLE),
        "speed": differences(actor.speed_mps, LENGTH),
    }


def _box(box: StaticBox) -> Packed:
    return {
        "id": box.id,
        "kind": box.kind,
        "length": box.length_m,
        "width": box.width_m,
        "x": box.x_m,
        "y": box.y_m,
        "heading": box.heading_rad,
    }


def _sensor(sensor: SensorView) -> Packed:
    found = [point for sample in sensor.detections for point in sample]
    return {
        "id": sensor.id,
        "kind": sensor.kind,
        "x": sensor.x_m,
        "y": sensor.y_m,
        "yaw": sensor.yaw_rad,
        "fov": sensor.fov_rad,
        "range": sensor.range_m,
        "alive": repeats(sensor.alive),
        "count": repeats([len(sample) for sample in sensor.detections]),
        "dx": differences([point[0] for point in found], LENGTH),
        "dy": differences([point[1] for point in found], LENGTH),
        "points": None if sensor.points is None else _points(sensor.points),
    }


def _points(rows: Sequence[Sequence[Point]]) -> Packed:
    """Pack the returns of a lidar, each sample once; a dot is as wide as a tenth of a metre."""
    samples = [(sample, sum(1 for _ in group)) for sample, group in itertools.groupby(rows)]
    found = [point for sample, _ in samples for point in sample]
    return {
        "rows": [rows for _, rows in samples],
        "count": [len(sample) for sample, _ in samples],
        "x": differences([point[0] for point in found], POINT),
        "y": differences([point[1] for point in found], POINT),
    }


def _channel(channel: ChannelView) -> Packed:
    packed: Packed = {
        "id": channel.id,
        "acceleration": differences(channel.acceleration_mps2, LENGTH),
        "steering": differences(channel.steering_angle_rad, ANGLE),
        "status": repeats(channel.status),
        "tracks": None,
    }
    if channel.tracks is not None:
        packed["tracks"] = _tracks(channel.tracks)
    if channel.fan is not None:
        packed["fan"] = _fan(channel.fan)
    return packed


def _fan(view: FanView) -> Packed:
    """Pack the fans; places are differences from the place before, within a candidate, too."""
    listed = [candidate for fan in view.fans for candidate in fan]
    points = [point for candidate in listed for point in candidate.points]
    return {
        "every": view.every,
        "count": repeats([len(fan) for fan in view.fans]),
        "points": repeats([len(candidate.points) for candidate in listed]),
        "chosen": repeats([candidate.is_chosen for candidate in listed]),
        "desirability": differences([candidate.desirability for candidate in listed], SHADES),
        "x": differences([point[0] for point in points], COARSE),
        "y": differences([point[1] for point in points], COARSE),
    }


def _grid(view: GridView) -> Packed:
    """Pack the grid maps; one that is equal to the map before is not repeated."""
    return {
        **view.model_dump(mode="json", exclude={"number", "occupied"}),
        "number": repeats(view.number),
        "occupied": repeats(view.occupied),
    }


def _tracks(ticks: Sequence[Sequence[Track]]) -> Packed:
    found = [track for tracks in ticks for track in tracks]
    # A tenth of a metre is finer than any track.
    columns = zip(*found, strict=True) if found else ((),) * 6
    return {
        "count": repeats([len(tracks) for tracks in ticks]),
        "columns": [differences(column, 100) for column in columns],
    }


def _signal(signal: SignalPlot) -> Packed:
    return {
        "name": signal.name,
        "unit": signal.unit,
        "labels": signal.labels,
        "thresholds": [line.model_dump(mode="json") for line in signal.thresholds],
        "values": differences(signal.values, _scale(signal.values)),
    }


def _scale(values: Sequence[float | None]) -> int:
    """Choose the steps per unit that keep ``DIGITS`` + 1 digits of the largest value."""
    largest = max((abs(value) for value in values if value is not None), default=0.0)
    if largest == 0.0:
        return 1
    return int(10 ** min(max(DIGITS - math.floor(math.log10(largest)), 0), 6))
