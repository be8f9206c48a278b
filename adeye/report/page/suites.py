"""Sensor suites on a page: a drawing and tables for each architecture.

The ego drives to the right. Fields are filled one over the other with the same translucent colour,
so that the shade tells how many sensors look at a place; outlines tell the kinds apart.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from adeye.analysis.suite.conditions import Condition
from adeye.analysis.suite.geometry import View, free_way
from adeye.analysis.suite.records import Suite, SuiteSensor
from adeye.analysis.suite.speeds import TABLE
from adeye.kernel.elementary import sin_cos
from adeye.signals import Floats

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


def _rings(frame: Frame, step: float, suite: Suite) -> Iterator[Mark]:
    """Circles around the ego's centre; near it, lines of one distance to its body."""
    highest = frame.aside - _LABEL / frame.scale
    for number in range(1, 6):
        distance = step * number
        if step >= _CIRCLES_FROM:
            turns = [sin_cos(float(angle)) for angle in np.linspace(-np.pi, np.pi, 73)]
            path = _line(frame, [(distance * turn[1], distance * turn[0]) for turn in turns])
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


@dataclass(frozen=True, slots=True)
class SuiteView:
    """One architecture on the page.

    Attributes:
        suite: The analysis.
        ends: The reference and the worst condition, once if they are one.
        pictures: Of the first of them, or of all: as far as the sensors reach, and around the body.
    """

    suite: Suite
    ends: tuple[Condition, ...]
    pictures: tuple[tuple[Drawing, Drawing], ...]


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
        ends = tuple(dict.fromkeys((suite.conditions[0], suite.worst)))
        pictures = tuple(
            (draw(suite, item.id, far, is_near=False), draw(suite, item.id, near, is_near=True))
            for item in (ends if every else ends[:1])
        )
        views.append(SuiteView(suite, ends, pictures))
    return tuple(views)
