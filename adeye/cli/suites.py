"""The tables that ``sensors`` prints, architectures side by side."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, Final

from adeye.cli.output import NONE, clean, emit, emit_table, listed

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from adeye.evaluation.suite.results import (
        BlindSpot,
        ForwardRange,
        Removal,
        SpeedRange,
        Suite,
        ZoneCoverage,
    )

_KMH: Final = 3.6
_STOPPED: Final = "stopped_car"
_DIRECTIONS: Final = {
    0: "ahead",
    45: "ahead left",
    90: "left",
    135: "behind left",
    180: "behind",
    -135: "behind right",
    -90: "right",
    -45: "ahead right",
}


def print_suites(suites: Sequence[Suite]) -> None:
    """Print what the analysis of several suites says, the short answer first.

    Args:
        suites: At least one, all for the same conditions.
    """
    _overview(suites)
    _speeds(suites)
    _slack(suites)
    conditions = suites[0].conditions
    for condition in dict.fromkeys((conditions[0].id, conditions[-1].id)):
        _coverage(suites, condition)
    _blind(suites)
    _bearings(suites)
    _removals(suites)
    _footnotes(suites)


def _overview(suites: Sequence[Suite]) -> None:
    rows = []
    for suite in suites:
        kinds = Counter(sensor.kind for sensor in suite.sensors)
        rows.append(
            [
                suite.architecture,
                listed(f"{count} {kind}" for kind, count in kinds.items()),
                f"{suite.sensor_cost:g}",
                suite.critical or NONE,
                listed(item.id for item in suite.not_analysed),
            ]
        )
    headers = ("Architecture", "Sensors", "Sensor cost", "Critical sensor", "Not analysed")
    emit_table(headers, rows, right=("Sensor cost",))


def _speeds(suites: Sequence[Suite]) -> None:
    rows: list[list[object]] = []
    ends: list[int] = []
    odd_speed = suites[0].odd_speed_mps
    for condition in suites[0].conditions:
        shown = condition.id
        for case in dict.fromkeys(item.case for item in suites[0].speeds):
            found = [_speed_at(suite, condition.id, case) for suite in suites]
            rows.append([shown, case.replace("_", " "), *(_speed(one, odd_speed) for one in found)])
            shown = ""
        forward = [
            next(item for item in suite.forward if item.condition == condition.id)
            for suite in suites
        ]
        rows.append(["", "UN R157 range", *map(_forward, forward)])
        ends.append(len(rows) - 1)
    title = "Highest speed [km/h] that range allows, and the sensor that it rests on"
    if odd_speed is not None:
        title += f"; ! is below the ODD's {odd_speed * _KMH:g} km/h"
    headers = ("Condition", "Case", *(suite.architecture for suite in suites))
    emit_table(headers, rows, title=title, sections=ends)


def _speed_at(suite: Suite, condition: str, case: str) -> SpeedRange:
    return next(item for item in suite.speeds if item.condition == condition and item.case == case)


def _speed(found: SpeedRange, odd_speed: float | None) -> str:
    if found.highest_mps is None or found.lowest_mps is None:
        return "none" + (" !" if odd_speed is not None else "")
    is_short = odd_speed is not None and found.highest_mps < odd_speed
    text = f"{'> ' if found.is_limit else ''}{kmh(found.highest_mps)}{' !' if is_short else ''}"
    # From the lowest speed of the search on there is nothing to say.
    if found.lowest_mps * _KMH > 10.5:
        text += f" (from {math.ceil(found.lowest_mps * _KMH - 1e-6)})"
    return f"{text} {found.sensor}"


def kmh(speed: float) -> str:
    """Write a speed in whole km/h, rounded down: what is promised must hold.

    >>> kmh(27.7)
    '99'
    """
    return f"{math.floor(speed * _KMH + 1e-6)}"


def _forward(found: ForwardRange) -> str:
    if not found.sensor:
        return "none"
    limit = "< 60" if found.speed_mps is None else kmh(found.speed_mps)
    short = found.needed_m is not None and found.range_m < found.needed_m
    return f"{limit}{' !' if short else ''} by {math.floor(found.range_m)} m"


def _slack(suites: Sequence[Suite]) -> None:
    speeds = sorted({item.speed_mps for item in suites[0].slacks})
    rows: list[list[object]] = []
    ends: list[int] = []
    for suite in suites:
        for number, condition in enumerate(suite.conditions):
            values = {
                item.speed_mps: item.slack_m
                for item in suite.slacks
                if item.condition == condition.id and item.case == _STOPPED
            }
            name = suite.architecture if number == 0 else ""
            rows.append([name, condition.id, *(_metres(values[speed]) for speed in speeds)])
        ends.append(len(rows) - 1)
    headers = [f"{speed * _KMH:.0f}" for speed in speeds]
    emit_table(
        ("Architecture", "Condition", *headers),
        rows,
        title="Range to spare [m] before a stopped car, by speed [km/h]",
        right=headers,
        sections=ends,
    )


def _metres(value: float | None) -> str:
    return NONE if value is None else f"{math.floor(value + 1e-6):+d}"


def _coverage(suites: Sequence[Suite], condition: str) -> None:
    rows = []
    for zone in suites[0].zones:
        cells = [
            next(
                item
                for item in suite.coverage
                if (item.zone, item.target, item.condition) == (zone.id, zone.target, condition)
            )
            for suite in suites
        ]
        rows.append([zone.id, zone.target, *map(_shares, cells)])
    emit_table(
        ("Zone", "For a", *(suite.architecture for suite in suites)),
        rows,
        title=f"Coverage in {condition}: % of the zone seen by 1 / 2 / 3 sensors, | by 2 kinds",
        right=[suite.architecture for suite in suites],
    )


def _shares(item: ZoneCoverage) -> str:
    counts = (item.seen_by_1, item.seen_by_2, item.seen_by_3)
    return f"{' / '.join(map(percent, counts))} | {percent(item.seen_by_2_kinds)}"


def percent(share: float) -> str:
    """Write a share in whole percent; what is not whole is never 100 and what is not nothing, 0.

    >>> percent(0.9999), percent(1.0), percent(0.001), percent(0.0)
    ('99', '100', '1', '0')
    """
    if 0.0 < share < 0.01:
        return "1"
    return f"{math.floor(100.0 * share + 1e-9)}"


def _blind(suites: Sequence[Suite]) -> None:
    reference = suites[0].conditions[0].id
    rows = []
    for zone in suites[0].zones:
        spots = [
            [
                item
                for item in suite.blind_spots
                if (item.zone, item.target, item.condition) == (zone.id, zone.target, reference)
            ]
            for suite in suites
        ]
        if any(spots):
            rows.append([zone.id, *map(_spot, spots)])
    if not rows:
        emit("\nNo blind spot in any zone.")
        return
    emit_table(
        ("Zone", *(suite.architecture for suite in suites)),
        rows,
        title=f"Blind spots in {reference}: area, largest circle, largest road user hidden whole",
        right=[suite.architecture for suite in suites],
    )


def _spot(found: Sequence[BlindSpot]) -> str:
    if not found:
        return NONE
    spot = found[0]
    return f"{spot.area_m2:.1f} m², {spot.circle_m:.1f} m, {spot.hides or 'nobody'}"


def _bearings(suites: Sequence[Suite]) -> None:
    reference = suites[0].conditions[0].id
    rows = []
    for degrees, name in _DIRECTIONS.items():
        cells = []
        for suite in suites:
            found = next(
                item
                for item in suite.bearings
                if item.condition == reference and round(math.degrees(item.bearing_rad)) == degrees
            )
            blind = NONE if found.blind_from_m is None else f"{found.blind_from_m:.1f}"
            cells.append(f"{blind} / {found.seen_until_m:.1f}")
        rows.append([name, *cells])
    emit_table(
        ("Direction", *(suite.architecture for suite in suites)),
        rows,
        title=f"Nearest blind / farthest seen place [m] from the body in {reference}, for a car",
        right=[suite.architecture for suite in suites],
    )


def _removals(suites: Sequence[Suite]) -> None:
    conditions = suites[0].conditions
    ends = dict.fromkeys((conditions[0].id, conditions[-1].id))
    rows: list[list[object]] = []
    sections: list[int] = []
    for suite in suites:
        rows.append([suite.architecture, "nothing", *_left(suite.whole, ends), ""])
        for item in suite.removals:
            gone = item.what
            if item.kind != "sensor":
                gone = f"{item.kind} {item.what} ({listed(item.sensors)})"
            is_critical = item.kind == "sensor" and item.what == suite.critical
            rows.append(["", gone, *_left(item, ends), "critical" if is_critical else ""])
        sections.append(len(rows) - 1)
    headers = ["Architecture", "Without"]
    for name in ends:
        headers += [f"{name}: speed", "all cases", "front", "zones"]
    emit_table(
        (*headers, ""),
        rows,
        title="Loss of parts: km/h left for a stopped car and for all cases; % seen of the lane "
        "ahead and of all zones",
        right=headers[2:],
        sections=sections,
    )


def _left(item: Removal, conditions: Iterable[str]) -> list[object]:
    cells: list[object] = []
    for name in conditions:
        for speed in (item.highest_mps[name], item.all_cases_mps[name]):
            cells.append("none" if speed is None else kmh(speed))
        cells += [percent(item.front_seen[name]), percent(item.seen[name])]
    return cells


def _footnotes(suites: Sequence[Suite]) -> None:
    emit("\nConditions: " + "; ".join(f"{item.id}: {item.text}" for item in suites[0].conditions))
    for suite in suites:
        for item in suite.not_analysed:
            emit(clean(f"Not analysed: {suite.architecture}.{item.id} ({item.kind}): {item.why}."))
    for note in dict.fromkeys(note for suite in suites for note in suite.notes):
        emit(clean(f"- {note}"))
