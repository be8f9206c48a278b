"""Sensor suites on a page: a drawing and tables for each architecture.

The ego drives to the right. Fields are filled one over the other with the same translucent colour,
so that the shade tells how many sensors look at a place; outlines tell the kinds apart.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from adeye.analysis.suite.geometry import View, free_way
from adeye.analysis.suite.records import Removal, Suite, SuiteSensor
from adeye.analysis.suite.speeds import TABLE
from adeye.kernel.elementary import sin_cos
from adeye.report.words import DASH, KMH, forward_text, left_speed, metres, percent, speed_text
from adeye.signals import Floats

# --- The drawing of a suite seen from above: fields of view to scale, as paths of an SVG ----------

WIDTH: Final = 960.0
"""Of a drawing in its own units; the page scales it."""

_MARGIN: Final = 10.0
_LEAST: Final = (60.0, 160.0, 40.0)
"""What is shown at least behind, ahead and aside [m]: the range of UN R157 at 130 km/h."""
_MOST: Final = (110.0, 220.0, 80.0)
"""What is shown at most; fields that reach further are cut."""
_NEAR: Final = (8.0, 6.0)
"""What the near drawing shows around the body, along and aside [m]."""
_STEP: Final = np.pi / 180.0
"""Angle between two points of an arc [rad]."""
_FULL_TURN: Final = 2.0 * np.pi - 1e-9
_TURN_POINTS: Final = 360
"""Points of an arc all around, one end counted twice, are more than this."""

_LABEL: Final = 12.0
"""Room for a label, in units of the drawing."""

_CIRCLES_FROM: Final = 10.0
"""Distance between rings from which the ego is small enough for circles [m]."""

_ARC: Final = 0.28
"""Half the angle of the arcs of braking and of UN R157 [rad]."""
_BRAKING_KMH: Final = (50, 80, 100, 130)
_REGULATED_KMH: Final = (60, 100, 130)


@dataclass(frozen=True, slots=True)
class Frame:
    """What of the ground a drawing shows.

    Attributes:
        rear: Behind the ego's centre [m].
        ahead: [m].
        aside: To each side [m].
    """

    rear: float
    ahead: float
    aside: float

    @property
    def scale(self) -> float:
        """Units of the drawing in a metre."""
        return WIDTH / (self.rear + self.ahead)

    @property
    def height(self) -> float:
        """Of the drawing in its units."""
        return 2.0 * self.aside * self.scale

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Put a point of the vehicle frame into the drawing."""
        return (x + self.rear) * self.scale, (self.aside - y) * self.scale


@dataclass(frozen=True, slots=True)
class Field:
    """What one sensor sees.

    Attributes:
        kind: Of the sensor.
        title: In words.
        path: Of the SVG.
    """

    kind: str
    title: str
    path: str


@dataclass(frozen=True, slots=True)
class Mark:
    """A line with a label.

    Attributes:
        kind: ``range``, ``braking`` or ``r157``.
        path: Of the SVG.
        label: Text.
        x: Place of the label.
        y: The same.
    """

    kind: str
    path: str
    label: str
    x: float
    y: float


@dataclass(frozen=True, slots=True)
class Drawing:
    """One drawing, ready for the template.

    Attributes:
        width: In its own units.
        height: The same.
        fields: Of the sensors, the largest first.
        marks: Rings and arcs.
        ego: Path of the body.
        nose: Path of the windscreen, which tells where ahead is.
        zones: Path of the zones' outlines.
        title: What it shows, for those who cannot see it.
    """

    width: float
    height: float
    fields: tuple[Field, ...]
    marks: tuple[Mark, ...]
    ego: str
    nose: str
    zones: str
    title: str


def far_frame(suites: Iterable[Suite]) -> Frame:
    """Choose one frame for several suites, so that their drawings can be compared."""
    rear, ahead, aside = _LEAST
    for suite in suites:
        for sensor in suite.sensors:
            for reach in sensor.reaches:
                for outer, _ in _pieces(_view(sensor), sensor, reach.near_m, reach.far_m):
                    rear = max(rear, _MARGIN - float(outer[0].min()))
                    ahead = max(ahead, _MARGIN + float(outer[0].max()))
                    aside = max(aside, _MARGIN + float(np.abs(outer[1]).max()))
    return Frame(
        *(min(found, most) for found, most in zip((rear, ahead, aside), _MOST, strict=True))
    )


def near_frame(suites: Iterable[Suite]) -> Frame:
    """Choose one frame around the bodies of several suites."""
    sizes = [(suite.length_m, suite.width_m) for suite in suites]
    along = 0.5 * max(size[0] for size in sizes) + _NEAR[0]
    return Frame(along, along, 0.5 * max(size[1] for size in sizes) + _NEAR[1])


def draw(suite: Suite, condition: str, frame: Frame, *, is_near: bool) -> Drawing:
    """Draw what the sensors of a suite see of cars.

    Args:
        suite: The analysis.
        condition: Weather and light.
        frame: What to show.
        is_near: Whether it is the drawing of the near field: zones are drawn, arcs are not.
    """
    drawn = [
        (reach.far_m, sensor, reach)
        for sensor in suite.sensors
        for reach in sensor.reaches
        if (reach.condition, reach.target) == (condition, "car") and reach.far_m > reach.near_m
    ]
    fields = []
    for far, sensor, reach in sorted(drawn, key=lambda item: (-item[0], item[1].id)):
        path = _field_path(sensor, reach.near_m, far, frame)
        text = (
            f"{sensor.id}: {sensor.kind}, {far:.0f} m, {np.degrees(sensor.field_of_view_rad):.0f}°"
        )
        fields.append(Field(sensor.kind, text, path))
    marks = list(_rings(frame, 2.0 if is_near else 50.0, suite))
    if not is_near:
        marks += [*_braking(suite, condition, frame), *_regulated(suite, frame)]
    return Drawing(
        width=WIDTH,
        height=round(frame.height, 1),
        fields=tuple(fields),
        marks=tuple(marks),
        ego=_box(frame, -0.5 * suite.length_m, 0.5 * suite.length_m, 0.5 * suite.width_m),
        nose=_box(frame, 0.12 * suite.length_m, 0.24 * suite.length_m, 0.4 * suite.width_m),
        zones=_zones(suite, frame) if is_near else "",
        title=f"{suite.architecture} in {condition}: fields of view of {len(fields)} sensors, "
        + ("near the vehicle" if is_near else "as far as they reach"),
    )


def _view(sensor: SuiteSensor) -> View:
    sine, cosine = sin_cos(sensor.yaw_rad)
    half = sin_cos(0.5 * sensor.field_of_view_rad)[1]
    return View(sensor.x_m, sensor.y_m, (cosine, sine), half, sensor.body_m)


def _pieces(
    view: View, sensor: SuiteSensor, near: float, far: float
) -> Iterator[tuple[tuple[Floats, Floats], tuple[Floats, Floats]]]:
    """Return outer and inner edge of what is seen, in pieces where the body hides the rest [m]."""
    half = 0.5 * sensor.field_of_view_rad
    angles = np.linspace(-half, half, max(2, int(np.ceil(2.0 * half / _STEP)) + 1))
    turns = [sin_cos(sensor.yaw_rad + float(angle)) for angle in angles]
    dx, dy = np.array([turn[1] for turn in turns]), np.array([turn[0] for turn in turns])
    reach = np.minimum(far, free_way(view, dx, dy))
    is_open = np.concatenate([[False], reach > near, [False]])
    starts = np.flatnonzero(~is_open[:-1] & is_open[1:])
    ends = np.flatnonzero(is_open[:-1] & ~is_open[1:])
    for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
        part = slice(start, end)
        yield (
            (view.x + dx[part] * reach[part], view.y + dy[part] * reach[part]),
            (view.x + dx[part] * near, view.y + dy[part] * near),
        )


def _field_path(sensor: SuiteSensor, near: float, far: float, frame: Frame) -> str:
    """Write a field of view; a ring has two outlines, of which the inner one cuts a hole."""
    is_full = sensor.field_of_view_rad >= _FULL_TURN
    parts = []
    for outer, inner in _pieces(_view(sensor), sensor, near, far):
        points = list(zip(*outer, strict=True))
        hole = list(zip(*inner, strict=True))[::-1]
        if is_full and len(points) > _TURN_POINTS:
            parts.append(_polygon(frame, points))
            parts.append(_polygon(frame, hole) if near > 0.0 else "")
        else:
            parts.append(_polygon(frame, points + (hole if near > 0.0 else hole[:1])))
    return "".join(parts)


def _polygon(frame: Frame, points: Sequence[tuple[float, float]]) -> str:
    return _line(frame, points) + "Z"


def _line(frame: Frame, points: Sequence[tuple[float, float]]) -> str:
    placed = (frame.place(float(x), float(y)) for x, y in points)
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in placed)


def _box(frame: Frame, rear: float, front: float, half: float) -> str:
    return _polygon(frame, [(rear, -half), (front, -half), (front, half), (rear, half)])


def _zones(suite: Suite, frame: Frame) -> str:
    return "".join(_polygon(frame, zone.outline_m) for zone in suite.zones)


def _circle(frame: Frame, radius: float) -> str:
    turns = [sin_cos(float(angle)) for angle in np.linspace(-np.pi, np.pi, 73)]
    return _line(frame, [(radius * turn[1], radius * turn[0]) for turn in turns])


def _rings(frame: Frame, step: float, suite: Suite) -> Iterator[Mark]:
    """Circles around the ego's centre; near it, lines of one distance to its body."""
    highest = frame.aside - _LABEL / frame.scale
    for number in range(1, 6):
        distance = step * number
        if step >= _CIRCLES_FROM:
            path = _circle(frame, distance)
            # A ring that leaves the drawing is labelled where it does.
            y = min(distance, highest)
            x = float(np.sqrt(distance * distance - y * y))
        else:
            path = _rounded(frame, 0.5 * suite.length_m, 0.5 * suite.width_m, distance)
            x, y = 0.0, 0.5 * suite.width_m + distance
        label = f"{distance:g} m" if x < frame.ahead and y <= highest else ""
        yield Mark("range", path, label, *_rounded_place(frame, x, y))


def _rounded(frame: Frame, length: float, width: float, distance: float) -> str:
    points = []
    for quarter, (x, y) in enumerate(
        ((length, width), (-length, width), (-length, -width), (length, -width))
    ):
        for step in range(10):
            sine, cosine = sin_cos(0.5 * np.pi * (quarter + step / 9.0))
            points.append((x + distance * cosine, y + distance * sine))
    return _polygon(frame, points)


def _rounded_place(frame: Frame, x: float, y: float) -> tuple[float, float]:
    placed = frame.place(x, y)
    return round(placed[0], 1), round(placed[1], 1)


def _braking(suite: Suite, condition: str, frame: Frame) -> Iterator[Mark]:
    """Arcs at the range that stopping needs, labelled on the left of the ego."""
    for item in suite.slacks:
        speed = round(item.speed_mps * 3.6)
        if (item.condition, item.case) != (condition, "stopped_car") or item.need_m is None:
            continue
        if speed in _BRAKING_KMH:
            yield from _arc(frame, "braking", item.need_m, 0.5 * suite.length_m, f"{speed}", 1.0)


def _regulated(suite: Suite, frame: Frame) -> Iterator[Mark]:
    """Arcs at the least ranges of UN R157, labelled on the right of the ego."""
    for speed, distance in TABLE:
        if round(speed * 3.6) in _REGULATED_KMH:
            text = f"R157 {speed * 3.6:.0f}"
            yield from _arc(frame, "r157", distance, 0.5 * suite.length_m, text, -1.0)


def _arc(
    frame: Frame, kind: str, radius: float, front: float, label: str, side: float
) -> Iterator[Mark]:
    if front + radius > frame.ahead:
        return
    angles = np.linspace(0.0, side * _ARC, 19)
    turns = [sin_cos(float(angle)) for angle in angles]
    points = [(front + radius * turn[1], radius * turn[0]) for turn in turns]
    x, y = points[-1]
    # The label stands just beyond the end of its arc.
    place = frame.place(x, y)
    yield Mark(
        kind, _line(frame, points), label, round(place[0], 1), round(place[1] - side * 9.0, 1)
    )


# --- Sensor suites on a page: a drawing and tables for each architecture --------------------------

Row = tuple[str, ...]

SPEED_HEADS: Final = (
    "Condition",
    "Stopped car",
    "Slower car",
    "Crossing pedestrian",
    "UN R157 range",
    "Lane ahead seen",
    "All zones seen",
    "Without the critical sensor",
)
ZONE_HEADS: Final = ("Zone", "For a", "Area", "1 sensor", "2 sensors", "3 sensors", "2 kinds",
                     "Largest circle unseen", "Hides whole")  # fmt: skip
LOSS_HEADS: Final = ("Without", "Sensors", "Condition", "Stopped car", "All cases",
                     "Lane ahead seen", "All zones seen")  # fmt: skip
SENSOR_HEADS: Final = ("Sensor", "Kind", "Field of view", "Range to a car", "Range to a pedestrian",
                       "Until brakes act", "Realises", "Cost")  # fmt: skip


@dataclass(frozen=True, slots=True)
class Picture:
    """The two drawings of a suite in one condition.

    Attributes:
        condition: Its name.
        text: What it is.
        far: As far as the sensors reach.
        near: Around the body.
    """

    condition: str
    text: str
    far: Drawing
    near: Drawing


@dataclass(frozen=True, slots=True)
class SuiteView:
    """One architecture on the page; cells are texts.

    Attributes:
        suite: The analysis.
        kinds: Kinds of sensor that it has, for the legend.
        pictures: The first is the reference.
        speeds: Rows under ``SPEED_HEADS``, speeds in km/h.
        zones: Name of a condition and rows under ``ZONE_HEADS``.
        losses: Rows under ``LOSS_HEADS``.
        sensors: Rows under ``SENSOR_HEADS``.
        slack_heads: Condition and speeds.
        slacks: Range to spare before a stopped car, a row for each condition [m].
    """

    suite: Suite
    kinds: tuple[str, ...]
    pictures: tuple[Picture, ...]
    speeds: tuple[Row, ...]
    zones: tuple[tuple[str, tuple[Row, ...]], ...]
    losses: tuple[Row, ...]
    sensors: tuple[Row, ...]
    slack_heads: Row
    slacks: tuple[Row, ...]


def suite_views(suites: Sequence[Suite], *, every: bool = False) -> tuple[SuiteView, ...]:
    """Arrange suites for the page.

    Args:
        suites: The analyses; their drawings get one scale.
        every: Whether to draw each in its worst condition, too.
    """
    if not suites:
        return ()
    far, near = far_frame(suites), near_frame(suites)
    views = []
    for suite in suites:
        ends = list(dict.fromkeys((suite.conditions[0], suite.worst)))
        pictures = tuple(
            Picture(
                condition.id,
                condition.text,
                draw(suite, condition.id, far, is_near=False),
                draw(suite, condition.id, near, is_near=True),
            )
            for condition in (ends if every else ends[:1])
        )
        views.append(
            SuiteView(
                suite=suite,
                kinds=tuple(sorted({sensor.kind for sensor in suite.sensors})),
                pictures=pictures,
                speeds=tuple(_speed_rows(suite)),
                zones=tuple((item.id, tuple(_zone_rows(suite, item.id))) for item in ends),
                losses=tuple(_loss_rows(suite, [item.id for item in ends])),
                sensors=tuple(_sensor_rows(suite)),
                slack_heads=("Condition", *(f"{speed * KMH:.0f}" for speed in _shown(suite))),
                slacks=tuple(_slack_rows(suite)),
            )
        )
    return tuple(views)


def _shown(suite: Suite) -> list[float]:
    return sorted({item.speed_mps for item in suite.slacks})


def _speed_rows(suite: Suite) -> Iterator[Row]:
    critical = next(
        (item for item in suite.removals if (item.kind, item.what) == ("sensor", suite.critical)),
        None,
    )
    for condition in suite.conditions:
        name = condition.id
        forward = next(item for item in suite.forward if item.condition == name)
        without = DASH
        if critical is not None:
            without = f"{left_speed(critical.all_cases_mps[name])} ({suite.critical})"
        yield (
            name,
            *(
                speed_text(item, suite.odd_speed_mps)
                for item in suite.speeds
                if item.condition == name
            ),
            forward_text(forward),
            f"{percent(suite.whole.front_seen[name])} %",
            f"{percent(suite.whole.seen[name])} %",
            without,
        )


def _zone_rows(suite: Suite, condition: str) -> Iterator[Row]:
    for zone in suite.zones:
        key = (zone.id, zone.target, condition)
        item = next(
            item for item in suite.coverage if (item.zone, item.target, item.condition) == key
        )
        spot = next(
            (item for item in suite.blind_spots if (item.zone, item.target, item.condition) == key),
            None,
        )
        yield (
            zone.title,
            zone.target,
            f"{item.area_m2:.0f} m²",
            f"{percent(item.seen_by_1)} %",
            f"{percent(item.seen_by_2)} %",
            f"{percent(item.seen_by_3)} %",
            f"{percent(item.seen_by_2_kinds)} %",
            DASH if spot is None else f"{spot.circle_m:.1f} m",
            DASH if spot is None or not spot.hides else spot.hides,
        )


def _loss_rows(suite: Suite, conditions: Sequence[str]) -> Iterator[Row]:
    for item in (suite.whole, *suite.removals):
        for number, condition in enumerate(conditions):
            yield (
                _lost(suite, item) if number == 0 else "",
                (", ".join(item.sensors) or DASH) if number == 0 else "",
                condition,
                left_speed(item.highest_mps[condition]),
                left_speed(item.all_cases_mps[condition]),
                f"{percent(item.front_seen[condition])} %",
                f"{percent(item.seen[condition])} %",
            )


def _lost(suite: Suite, item: Removal) -> str:
    if not item.what:
        return "nothing"
    if item.kind != "sensor":
        return f"{item.kind} {item.what}"
    return f"{item.what}, critical" if item.what == suite.critical else item.what


def _sensor_rows(suite: Suite) -> Iterator[Row]:
    reference = suite.conditions[0].id
    for sensor in suite.sensors:
        reach = {item.target: item for item in sensor.reaches if item.condition == reference}
        waits = [chain.total_s for chain in suite.chains if chain.sensor == sensor.id]
        yield (
            sensor.id,
            sensor.kind if sensor.fidelity == "object" else f"{sensor.kind}, {sensor.fidelity}",
            f"{math.degrees(sensor.field_of_view_rad):.0f}°",
            *(_range(reach[kind].near_m, reach[kind].far_m) for kind in ("car", "pedestrian")),
            f"{min(waits):.2f} s" if waits else "not linked",
            sensor.realises or DASH,
            f"{sensor.cost:g}",
        )
    for item in suite.not_analysed:
        yield (item.id, item.kind, f"not analysed: {item.why}", *([DASH] * 5))


def _range(near: float, far: float) -> str:
    if far <= near:
        return "none"
    return f"{near:.1f} to {far:.1f} m" if near > 0.0 else f"{far:.0f} m"


def _slack_rows(suite: Suite) -> Iterator[Row]:
    for condition in suite.conditions:
        values = {
            item.speed_mps: item.slack_m
            for item in suite.slacks
            if (item.condition, item.case) == (condition.id, "stopped_car")
        }
        yield (condition.id, *(metres(values[speed]) for speed in _shown(suite)))
