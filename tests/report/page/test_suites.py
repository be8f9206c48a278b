"""Suites arranged for a page: every row as long as its heads, marks where something is short."""

from typing import Any

from adeye.analysis.suite.analyse import analyse
from adeye.analysis.suite.records import Suite
from adeye.report.page.suites import (
    LOSS_HEADS,
    SENSOR_HEADS,
    SPEED_HEADS,
    ZONE_HEADS,
    SuiteView,
    suite_views,
)
from tests.analysis.suite.rigs import BUMPER, all_around, architecture, radar

CAMERA: dict[str, Any] = {
    "kind": "camera",
    "mount": BUMPER,
    "field_of_view": 0.7,
    "range": 80.0,
    "rate": 20.0,
    "night_range": 0.4,
    "realises": "camera",
}


def suite(**options: Any) -> Suite:
    sensors = {
        "camera": CAMERA,
        "eye": radar(),
        "truth": {"kind": "ground_truth", "rate": 20.0},
    }
    return analyse(architecture(sensors), **options)


def view(**options: Any) -> SuiteView:
    return suite_views([suite(**options)])[0]


def test_rows_are_as_long_as_their_heads() -> None:
    found = view()
    tables = [
        (SPEED_HEADS, found.speeds),
        (LOSS_HEADS, found.losses),
        (SENSOR_HEADS, found.sensors),
        (found.slack_heads, found.slacks),
        *((ZONE_HEADS, rows) for _, rows in found.zones),
    ]
    for heads, rows in tables:
        assert rows
        assert {len(row) for row in rows} == {len(heads)}


def test_every_condition_has_its_row_and_the_reference_its_drawing() -> None:
    found = view()
    assert [row[0] for row in found.speeds] == ["dry_day", "rain", "night"]
    assert [picture.condition for picture in found.pictures] == ["dry_day"]


def test_worst_condition_is_drawn_beside_the_reference_on_request() -> None:
    alone = analyse(architecture({"camera": CAMERA}))
    found = suite_views([alone], every=True)[0]
    assert [picture.condition for picture in found.pictures] == ["dry_day", "night"]
    assert [name for name, _ in found.zones] == ["dry_day", "night"]


def test_sensors_that_were_left_out_stand_below_the_others() -> None:
    rows = view().sensors
    assert [row[0] for row in rows] == ["camera", "eye", "truth"]
    assert rows[-1][2] == "not analysed: no devices"


def test_critical_sensor_is_named_in_every_condition() -> None:
    assert {row[-1].partition("(")[2] for row in view().speeds} == {"eye)"}
    assert any(row[0] == "eye, critical" for row in view().losses)


def test_suite_without_a_critical_sensor_says_so() -> None:
    twins = analyse(architecture({"one": all_around(), "other": all_around()}))
    assert {row[-1] for row in suite_views([twins])[0].speeds} == {"\N{EN DASH}"}


def test_no_suites_are_no_views() -> None:
    assert suite_views([]) == ()


def test_element_of_several_sensors_is_a_row_of_its_own() -> None:
    pair = {"one": radar(realises="radars"), "other": radar(range=50.0, realises="radars")}
    rows = suite_views([analyse(architecture(pair))])[0].losses
    assert ("element radars", "one, other") in {row[:2] for row in rows}


def test_range_of_a_sensor_with_a_blind_zone_has_two_ends() -> None:
    near = {
        "kind": "ultrasonic", "mount": BUMPER, "field_of_view": 1.0, "range": 5.0, "rate": 20.0,
        "blind_zone": 0.25,
    }  # fmt: skip
    blind = {**CAMERA, "kind": "lidar", "fidelity": "physical", "range": 80.0, "drop_out": 1.0}
    blind.pop("night_range")
    rows = suite_views([analyse(architecture({"near": near, "poor": blind}))])[0].sensors
    assert [row[3] for row in rows] == ["0.2 to 5.0 m", "none"]
