"""What a report embeds of a run: the scene, the detections and the commands of every tick.

Arrays have one element per tick of the trace. The last row of a trace has a scene but no decision:
its readings, commands and authority repeat those of the row before. Places and headings are in the
map (ISO 8855: x forward, y left, heading counter-clockwise) unless a field says otherwise.

Only what is drawn is rounded (places to 1 mm, angles to 0.1 mrad); verdicts and margins are given
as they were judged. The reader is ``web/decode.js``.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Hashable, Iterator, Sequence, Sized
from typing import Annotated, Any, Literal

from pydantic import Field

from adeye.fields import fields_of
from adeye.judge.verdict import Outcome
from adeye.report.model.part import Id, Label, Part, RunVerdict, agrees

# --- What a report embeds of a run: the scene, the detections and the commands of every tick ------

Floats = tuple[float, ...]
Gaps = tuple[float | None, ...]
Point = tuple[float, float]
Track = tuple[float, float, float, float, float, float]
Positive = Annotated[float, Field(gt=0.0)]


class Undrawn(Part):
    """A run that was executed again to be drawn, and came out otherwise than it is stored."""

    run: Id
    why: str
    """What was to be shown of it."""
    command: str
    """Tells where and why it differs."""

    def __str__(self) -> str:
        """Say it in one sentence without an end."""
        return (
            f"run {self.run[:12]}, {self.why}, comes out otherwise than it is stored, and is not "
            f"drawn: {self.command}"
        )


class Line(Part):
    """A polyline along the road."""

    marking: Literal["solid", "dashed", "none"] = "solid"
    x_m: Floats
    y_m: Floats

    @agrees
    def _is_a_line(self) -> Iterator[str]:
        if len(self.x_m) != len(self.y_m) or len(self.x_m) < 2:
            yield f"a line needs as many x as y and at least 2, not {len(self.x_m)}/{len(self.y_m)}"


class RoadGeometry(Part):
    """The road around a run."""

    boundaries: Annotated[tuple[Line, ...], Field(min_length=2)]
    """Lane boundaries from the right edge to the left edge."""
    shoulder: Line | None = None
    """Outer edge of the shoulder and the bays beside the right edge."""


class _Body(Part):
    """An object on the ground."""

    id: Id
    kind: str
    length_m: Positive
    width_m: Positive


class StaticBox(_Body):
    """An object that does not move."""

    x_m: float
    y_m: float
    heading_rad: float


class ActorMotion(_Body):
    """An actor and where it was; the place is the centre of its body."""

    x_m: Floats
    y_m: Floats
    heading_rad: Floats
    speed_mps: Floats


class EgoMotion(Part):
    """The ego and where it was; the place is the centre of its body."""

    length_m: Positive
    width_m: Positive
    wheelbase_m: Positive
    x_m: Floats
    y_m: Floats
    heading_rad: Floats
    speed_mps: Floats
    acceleration_mps2: Floats
    steering_angle_rad: Floats


class SensorView(Part):
    """A sensor, its field of view and what it delivered."""

    id: Id
    kind: str
    x_m: float = 0.0
    """Mount in the vehicle frame, from the centre of the body."""
    y_m: float = 0.0
    yaw_rad: float = 0.0
    fov_rad: Positive | None = None
    """None for a sensor without a field of view."""
    range_m: Positive | None = None
    alive: tuple[bool, ...]
    detections: tuple[tuple[Point, ...], ...]
    """Places in the map of everything in the newest sample."""
    points: tuple[tuple[Point, ...], ...] | None = None
    """Places in the map of the returns in the newest sample; None of a sensor without beams."""


class Candidate(Part):
    """A trajectory that a channel might have driven."""

    desirability: Annotated[float, Field(ge=0.0, le=1.0)]
    """1 for the best, 0 for one that is not better than a collision."""
    is_chosen: bool
    points: tuple[Point, ...]
    """Places in the map, from the ego on, which is not among them."""


class FanView(Part):
    """The trajectories that a channel chose from, now and then."""

    every: Annotated[int, Field(ge=1)]
    """Ticks from one fan to the next; the first is at the first tick."""
    fans: tuple[tuple[Candidate, ...], ...]


class GridView(Part):
    """Cells around the ego, now and then: how safe it is to stand there, and when it is occupied.

    The first cell is the rearmost on the right. Each map is one text, see
    ``report.page.drive.packed``.
    """

    every: Annotated[int, Field(ge=1)]
    """Ticks from one map of the ground to the next; the first is at the first tick."""
    occupied_every: Annotated[int, Field(ge=1)]
    """Ticks from one map of what is occupied to the next."""
    view: Id
    """Whose objects are drawn: ``truth`` or a channel."""
    cell_m: Positive
    x_m: float
    """Rear edge of the window, ahead of the centre of the ego."""
    y_m: float
    """Its right edge, to the left of the ego."""
    columns: Annotated[int, Field(ge=1)]
    """Cells along the ego."""
    rows: Annotated[int, Field(ge=1)]
    """Cells across."""
    levels: Annotated[tuple[float, ...], Field(max_length=16)]
    """Ratings that occur, by code."""
    worst: Positive
    """Rating that is drawn darkest."""
    times_s: Floats
    """Latest time to occupancy of each code from 1 on; code 0 is never."""
    number: tuple[str, ...]
    """Codes of the ratings."""
    occupied: tuple[str, ...]
    """Codes of the time to occupancy."""


class ChannelView(Part):
    """A control channel: what it commanded, how it was, what it believed is there."""

    id: Id
    acceleration_mps2: Gaps
    """None where it commanded no number."""
    steering_angle_rad: Gaps
    status: tuple[str, ...]
    tracks: tuple[tuple[Track, ...], ...] | None = None
    """x, y, vx, vy, length, width in the vehicle frame; None for a channel that shows none."""
    fan: FanView | None = None
    """None for a channel that does not choose among trajectories."""


class FaultView(Part):
    """A fault and when it was present."""

    id: Id
    text: str
    active: tuple[bool, ...]


class Event(Part):
    """Something that happened at one time."""

    time_s: float
    kind: Literal[
        "storyboard", "fault", "switch", "monitor", "channel", "contact", "sensor", "verdict"
    ]
    text: str


class ThresholdLine(Part):
    """The limit that an FSR sets on a plotted signal."""

    fsr: Id
    value: float
    side: Literal["at_least", "at_most"]
    """Where the allowed values are."""


class SignalPlot(Part):
    """One signal over the run."""

    name: Id
    unit: str = ""
    values: tuple[float | None, ...]
    """None where the signal has no value, such as a time to collision without a conflict."""
    labels: tuple[str, ...] = ()
    """Words of an enumeration or of a boolean, by code; empty for a number."""
    thresholds: tuple[ThresholdLine, ...] = ()
    cap: float | None = None
    """Value from which on a larger one says no more: the axis need not show it."""


class Replay(Part):
    """One run, tick by tick."""

    run: Id
    scenario: Id
    architecture: Id
    fault: str = "none"
    parameters: tuple[Label, ...] = ()
    outcome: Outcome
    verdicts: tuple[RunVerdict, ...] = ()
    why: str
    """Why this run was selected."""
    command: str
    """Reproduces the run."""
    trace_digest: str = ""
    step_s: Positive
    horizon_s: float | None = None
    """Obligations begin before this time; what follows is the tail."""
    left_hand: bool = False
    """Whether traffic keeps to the left: all places, headings and angles are then those of the
    mirror image, and the page draws them as they are."""
    road: RoadGeometry
    ego: EgoMotion
    actors: tuple[ActorMotion, ...] = ()
    boxes: tuple[StaticBox, ...] = ()
    sensors: tuple[SensorView, ...] = ()
    channels: tuple[ChannelView, ...] = ()
    grid: GridView | None = None
    """None where no grid map was made."""
    faults: tuple[FaultView, ...] = ()
    authority: tuple[int, ...]
    """Index into ``channels``; -1 where no channel could act."""
    reason: tuple[str, ...]
    """Why the switch decided so."""
    events: tuple[Event, ...] = ()
    signals: tuple[SignalPlot, ...] = ()

    @property
    def rows(self) -> int:
        """Number of ticks."""
        return len(self.ego.x_m)

    @agrees
    def _rows_agree(self) -> Iterator[str]:
        if self.rows == 0:
            yield f"run {self.run}: a replay has at least one tick"
        for name, column in self._columns():
            if len(column) != self.rows:
                yield f"run {self.run}: {name} has {len(column)} rows, the ego has {self.rows}"
        for view in self.channels:
            if view.fan is not None and len(view.fan.fans) != -(-self.rows // view.fan.every):
                yield f"run {self.run}: channels.{view.id} has {len(view.fan.fans)} fans"
        for channel in self.authority:
            if not -1 <= channel < len(self.channels):
                yield f"run {self.run}: authority {channel} names none of the channels"

    @agrees
    def _grid_covers_the_run(self) -> Iterator[str]:
        if self.grid is not None:
            grid = self.grid
            for name, texts, every in (
                ("number", grid.number, grid.every),
                ("occupied", grid.occupied, grid.occupied_every),
            ):
                if len(texts) != -(-self.rows // every):
                    yield f"run {self.run}: grid.{name} has {len(texts)} maps"

    def _columns(self) -> Iterator[tuple[str, Sized]]:
        yield "authority", self.authority
        yield "reason", self.reason
        movers = [("ego", self.ego), *((f"actors.{actor.id}", actor) for actor in self.actors)]
        views = [
            *((f"sensors.{sensor.id}", sensor) for sensor in self.sensors),
            *((f"channels.{channel.id}", channel) for channel in self.channels),
            *((f"faults.{fault.id}", fault) for fault in self.faults),
        ]
        for owner, part in [*movers, *views]:
            for field in type(part).model_fields:
                column = getattr(part, field)
                if isinstance(column, tuple):
                    yield f"{owner}.{field}", column
        for signal in self.signals:
            yield f"signals.{signal.name}", signal.values


# --- Pack the embedded runs small: whole numbers, differences and runs of equal values ------------

LENGTH = 1000
"""Steps per metre, and per metre per second."""
POINT = 10
"""Steps per metre of the returns of a lidar."""
ANGLE = 10_000
"""Steps per radian."""
_STEPS = {"m": LENGTH, "mps": LENGTH, "mps2": LENGTH, "rad": ANGLE}
"""Steps of what a column measures, by the end of its name."""
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
    return {
        **replay.model_dump(
            mode="json",
            include={
                *("run", "scenario", "architecture", "fault", "parameters", "outcome", "why"),
                *("command", "trace_digest", "step_s", "horizon_s", "events", "left_hand"),
            },
        ),
        "rows": replay.rows,
        "verdicts": [verdict.model_dump(mode="json") for verdict in replay.verdicts],
        "boundaries": [_placed(line) for line in replay.road.boundaries],
        "shoulder": None if replay.road.shoulder is None else _placed(replay.road.shoulder),
        "ego": _placed(replay.ego),
        "actors": [_placed(actor) for actor in replay.actors],
        "boxes": [_placed(box) for box in replay.boxes],
        "sensors": [_sensor(sensor) for sensor in replay.sensors],
        "channels": [_channel(channel) for channel in replay.channels],
        "grid": None if replay.grid is None else _grid(replay.grid),
        "faults": [_placed(fault) for fault in replay.faults],
        "authority": repeats(replay.authority),
        "reason": repeats(replay.reason),
        "signals": [_signal(signal) for signal in replay.signals],
    }


def _placed(part: Part, *without: str) -> Packed:
    """Pack numbers as differences, under their names without the unit, and words as repeats."""
    packed: Packed = {}
    for field, value in part:
        name, _, unit = field.rpartition("_")
        if field in without:
            continue
        if unit in _STEPS:
            is_column = isinstance(value, tuple)
            key = name.removesuffix("_angle")
            packed[key] = differences(value, _STEPS[unit]) if is_column else value
        else:
            packed[field] = repeats(value) if isinstance(value, tuple) else value
    return packed


def _sensor(sensor: SensorView) -> Packed:
    found = [point for sample in sensor.detections for point in sample]
    return {
        **_placed(sensor, "detections", "points"),
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
    packed = _placed(channel, "tracks", "fan")
    packed["tracks"] = None if channel.tracks is None else _tracks(channel.tracks)
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
        **fields_of(signal, "name", "unit", "labels"),
        "thresholds": [line.model_dump(mode="json") for line in signal.thresholds],
        "values": differences(signal.values, _scale(signal.values)),
    }


def _scale(values: Sequence[float | None]) -> int:
    """Choose the steps per unit that keep ``DIGITS`` + 1 digits of the largest value."""
    largest = max((abs(value) for value in values if value is not None), default=0.0)
    if largest == 0.0:
        return 1
    return int(10 ** min(max(DIGITS - math.floor(math.log10(largest)), 0), 6))
