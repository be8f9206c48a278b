"""``sensors``: what the suites of architectures see and how fast that lets the ego go."""

from __future__ import annotations

import math
from collections import Counter
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from adeye.cli.options import Json, named_page, option
from adeye.cli.output import NONE, emit, emit_found, emit_line, emit_table, listed, wrote
from adeye.errors import SpecError, UsageError, amount
from adeye.report.words import KMH, forward_text, left_speed, metres, percent, speed_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from adeye.analysis.suite.conditions import Condition
    from adeye.analysis.suite.geometry import Zone
    from adeye.analysis.suite.records import BlindSpot, Removal, Suite, ZoneCoverage
    from adeye.spec.architecture import Architecture
    from adeye.spec.load import Loaded, OddFiles

# --- The tables that ``sensors`` prints, architectures side by side -------------------------------

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
    _coverage(suites)
    _blind(suites)
    _bearings(suites)
    _removals(suites)
    _footnotes(suites)


def _overview(suites: Sequence[Suite]) -> None:
    names = _names(suites)
    rows = []
    for suite in suites:
        kinds = Counter(sensor.kind for sensor in suite.sensors)
        rows.append(
            [
                suite.architecture,
                listed(f"{count} {kind}" for kind, count in kinds.items()),
                f"{suite.sensor_cost:g}",
                "/".join(left_speed(suite.whole.all_cases_mps[name]) for name in names),
                suite.critical or NONE,
            ]
        )
    speed = f"km/h in {'/'.join(names)}"
    headers = ("Architecture", "Sensors", "Cost", speed, "Critical")
    emit_table(headers, rows, right=("Cost",))


def _names(suites: Sequence[Suite]) -> list[str]:
    return [condition.id for condition in suites[0].conditions]


def _by_suite(
    suites: Sequence[Suite],
    heads: Sequence[str],
    rows: Iterable[tuple[Sequence[str], Callable[[Suite], str]]],
    title: str,
) -> None:
    """Print a table with a column for each suite: what it says beside the first cells of a row."""
    names = [suite.architecture for suite in suites]
    cells = [[*first, *map(said, suites)] for first, said in rows]
    emit_table((*heads, *names), cells, title=title, right=names)


def _speeds(suites: Sequence[Suite]) -> None:
    from adeye.analysis.suite.records import matching

    rows: list[list[object]] = []
    ends: list[int] = []
    odd_speed = suites[0].odd_speed_mps
    for condition in _names(suites):
        shown = condition
        for case in dict.fromkeys(item.case for item in suites[0].speeds):
            found = [next(matching(item.speeds, condition=condition, case=case)) for item in suites]
            said = (speed_text(one, odd_speed) for one in found)
            rows.append([shown, case.replace("_", " "), *said])
            shown = ""
        forward = (next(matching(suite.forward, condition=condition)) for suite in suites)
        rows.append(["", "UN R157 range", *map(forward_text, forward)])
        ends.append(len(rows) - 1)
    title = "Highest speed [km/h] that range allows, and by which sensor"
    if odd_speed is not None:
        title += f"; ! below the ODD's {odd_speed * KMH:g} km/h"
    headers = ("Condition", "Case", *(suite.architecture for suite in suites))
    emit_table(headers, rows, title=title, sections=ends)


def _slack(suites: Sequence[Suite]) -> None:
    from adeye.analysis.suite.records import matching

    speeds = sorted({item.speed_mps for item in suites[0].slacks})
    rows: list[list[object]] = []
    ends: list[int] = []
    for suite in suites:
        for number, condition in enumerate(_names(suites)):
            found = matching(suite.slacks, condition=condition, case=_STOPPED)
            values = {item.speed_mps: item.slack_m for item in found}
            name = suite.architecture if number == 0 else ""
            rows.append([name, condition, *(metres(values[speed]) for speed in speeds)])
        ends.append(len(rows) - 1)
    headers = [f"{speed * KMH:.0f}" for speed in speeds]
    emit_table(
        ("Architecture", "Condition", *headers),
        rows,
        title="Range to spare [m] before a stopped car, by speed [km/h]",
        right=headers,
        sections=ends,
    )


def _coverage(suites: Sequence[Suite]) -> None:
    from adeye.analysis.suite.records import matching

    names = _names(suites)

    def seen(zone: Zone, condition: str, suite: Suite) -> ZoneCoverage:
        place = {"zone": zone.id, "target": zone.target, "condition": condition}
        return next(matching(suite.coverage, **place))

    def shares(zone: Zone, suite: Suite) -> str:
        item = seen(zone, names[0], suite)
        counts = (item.seen_by_1, item.seen_by_2, item.seen_by_3)
        return f"{'/'.join(map(percent, counts))} | {percent(item.seen_by_2_kinds)}"

    def by_condition(zone: Zone, suite: Suite) -> str:
        return "/".join(percent(seen(zone, name, suite).seen_by_1) for name in names)

    zones = suites[0].zones
    _by_suite(
        suites,
        ("Zone", "For a"),
        [((zone.id, zone.target), partial(shares, zone)) for zone in zones],
        f"Coverage in {names[0]}: % of the zone seen by 1/2/3 sensors | by 2 kinds",
    )
    _by_suite(
        suites,
        ("Zone",),
        [((zone.id,), partial(by_condition, zone)) for zone in zones],
        f"Coverage by any sensor in {'/'.join(names)} [%]",
    )


def _blind(suites: Sequence[Suite]) -> None:
    from adeye.analysis.suite.records import matching

    reference = _names(suites)[0]

    def spots(zone: Zone, suite: Suite) -> Iterator[BlindSpot]:
        place = {"zone": zone.id, "target": zone.target, "condition": reference}
        return matching(suite.blind_spots, **place)

    def said(zone: Zone, suite: Suite) -> str:
        spot = next(spots(zone, suite), None)
        if spot is None:
            return NONE
        return f"{spot.area_m2:.1f} m², {spot.circle_m:.1f} m, {spot.hides or 'nobody'}"

    zones = [zone for zone in suites[0].zones if any(any(spots(zone, item)) for item in suites)]
    if not zones:
        emit("\nNo blind spot in any zone.")
        return
    _by_suite(
        suites,
        ("Zone",),
        [((zone.id,), partial(said, zone)) for zone in zones],
        f"Blind spots in {reference}: area, largest circle, largest road user hidden whole",
    )


def _bearings(suites: Sequence[Suite]) -> None:
    from adeye.analysis.suite.records import matching

    reference = _names(suites)[0]

    def said(degrees: int, suite: Suite) -> str:
        bearings = matching(suite.bearings, condition=reference)
        found = next(item for item in bearings if round(math.degrees(item.bearing_rad)) == degrees)
        blind = NONE if found.blind_from_m is None else f"{found.blind_from_m:.1f}"
        return f"{blind} / {found.seen_until_m:.1f}"

    _by_suite(
        suites,
        ("Direction",),
        [((name,), partial(said, degrees)) for degrees, name in _DIRECTIONS.items()],
        f"Nearest blind / farthest seen place [m] from the body in {reference}, for a car",
    )


def _removals(suites: Sequence[Suite]) -> None:
    names = _names(suites)
    rows: list[list[object]] = []
    sections: list[int] = []
    for suite in suites:
        rows.append([f"{suite.architecture}, whole", *_left(suite.whole, names)])
        for item in suite.removals:
            gone = item.what
            if item.kind != "sensor":
                gone = f"{item.what} ({item.kind}, {amount(len(item.sensors), 'sensor')})"
            elif item.what == suite.critical:
                gone = f"{item.what} (critical)"
            rows.append([f"  {gone}", *_left(item, names)])
        sections.append(len(rows) - 1)
    headers = ("km/h, all cases", "% of lane ahead", "% of all zones")
    emit_table(
        ("Without", *headers),
        rows,
        title=f"Loss of parts: what is left in {'/'.join(names)}",
        right=headers,
        sections=sections,
    )


def _left(item: Removal, names: Sequence[str]) -> tuple[str, str, str]:
    return (
        "/".join(left_speed(item.all_cases_mps[name]) for name in names),
        "/".join(percent(item.front_seen[name]) for name in names),
        "/".join(percent(item.seen[name]) for name in names),
    )


def _footnotes(suites: Sequence[Suite]) -> None:
    emit("\nConditions: " + "; ".join(f"{item.id}: {item.text}" for item in suites[0].conditions))
    left_out: dict[str, list[str]] = {}
    for suite in suites:
        for item in suite.not_analysed:
            left_out.setdefault(item.why, []).append(f"{suite.architecture}.{item.id}")
    for why, names in left_out.items():
        emit_line(f"Not analysed ({why}): {listed(names)}.")
    for note in dict.fromkeys(note for suite in suites for note in suite.notes):
        emit_line(f"- {note}")


# --- ``sensors``: what the suites of architectures see and how fast that lets the ego go ----------


def sensors(
    architectures: Annotated[list[Path] | None, typer.Argument(metavar="[ARCHITECTURE]...")] = None,
    odd: Annotated[Path | None, option("ODD")] = None,
    json: Json = False,
    html: Annotated[Path | None, option("FILE", callback=named_page)] = None,
) -> None:
    """Analyse the sensor suites of architectures without simulation, side by side.

    Coverage of the zones around the ego, blind spots, range to spare over what braking needs, the
    highest speed that is left in rain and at night, the forward range that UN R157 asks for, and
    what remains when a sensor fails.

    Parameters:
        architectures: Architecture files, such as odd/architectures/lidar.yaml; default: those of
            --odd.
        odd: Take conditions, highest speed and shared resources from an ODD, and its architectures
            if none are named.
        html: Write the tables and a drawing of each suite as one HTML page.

    Examples:
        adeye sensors odd/architectures/camera_radar.yaml
        adeye sensors --odd odd/motorway_chauffeur.yaml --html suites.html
    """
    from adeye.analysis.suite.analyse import analyse
    from adeye.analysis.suite.conditions import DEFAULTS, conditions_of
    from adeye.spec.load import load_architecture, load_odd

    files = load_odd(odd) if odd is not None else None
    loaded = [load_architecture(path) for path in architectures or ()]
    if not loaded and files is not None:
        loaded = list(files.architectures.values())
    if not loaded:
        raise UsageError(
            "there is no architecture to analyse",
            remedy="Name architecture files, or an ODD with --odd.",
        )
    conditions: Sequence[Condition] = DEFAULTS
    if files is not None:
        conditions = conditions_of(files.odd.spec.attributes.environment)
    suites = [
        analyse(item.spec, conditions, odd_speed=_speed(files), resources=_resources(files))
        for item in _distinct(loaded)
    ]
    name = files.odd.spec.odd if files else None
    emit_found(
        "sensors",
        suites,
        print_suites,
        json=json,
        document=lambda suites: {"odd": name, "suites": suites},
    )
    if html is not None:
        _write(suites, files, html)


def _distinct(loaded: Sequence[Loaded[Architecture]]) -> Sequence[Loaded[Architecture]]:

    known: dict[str, Loaded[Architecture]] = {}
    for item in loaded:
        name = item.spec.architecture
        if name in known:
            raise SpecError(
                f"architecture {name!r} is in another file, too: {known[name].path}",
                where=item.locate(("architecture",)),
                remedy="Give each architecture an id of its own.",
            )
        known[name] = item
    return loaded


def _speed(files: OddFiles | None) -> float | None:
    limit = None if files is None else files.odd.spec.attributes.dynamic_elements.ego_speed
    return None if limit is None else limit.max


def _resources(files: OddFiles | None) -> Mapping[str, Sequence[str]]:
    if files is None:
        return {}
    return {element.id: element.resources for element in files.concept.spec.elements}


def _write(suites: Sequence[Suite], files: OddFiles | None, path: Path) -> None:
    from adeye.report.page.html import write_suites

    write_suites(suites, path, title="" if files is None else files.odd.spec.title)
    wrote(path)
