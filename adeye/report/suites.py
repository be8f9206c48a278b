"""Sensor suites on a page: a drawing and tables for each architecture."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from adeye.report.drawing import Drawing, draw, far_frame, near_frame
from adeye.report.suite_words import (
    KMH,
    forward_text,
    left_speed,
    metres,
    percent,
    speed_text,
)
from adeye.report.words import DASH

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from adeye.evaluation.suite.results import Removal, Suite

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
