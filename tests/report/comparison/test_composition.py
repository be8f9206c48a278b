"""Costs that add up, sensors that count, and the one sensor that tells two suites apart."""

from __future__ import annotations

from typing import Any

from adeye.report.comparison.candidates import cost_of, extra_sensor, measuring, suite_of


def priced(declared: float, **parts: float) -> dict[str, Any]:
    sensors = {name: {"cost": cost} for name, cost in parts.items()}
    return {"cost": declared, "sensors": sensors, "channels": {"nominal": {"cost": 0.0}}}


def test_declared_cost_is_the_total_where_it_covers_the_parts() -> None:
    cost = cost_of(priced(300.0, camera=120.0, radar=90.0))
    assert cost is not None
    assert (cost.total, cost.declared) == (300.0, 300.0)
    assert cost.parts == {"sensors.camera": 120.0, "sensors.radar": 90.0}


def test_parts_that_cost_more_than_declared_are_the_total() -> None:
    cost = cost_of(priced(100.0, camera=120.0))
    assert cost is not None
    assert cost.total == 120.0


def test_what_declares_no_cost_is_not_free() -> None:
    assert cost_of(priced(0.0, camera=0.0)) is None


def test_sensors_that_measure_and_feed_a_channel() -> None:
    content = {
        "sensors": {
            "camera": {"kind": "camera"},
            "spare": {"kind": "camera"},
            "truth": {"kind": "ground_truth"},
            "place": {"kind": "localisation"},
        },
        "channels": {"nominal": {"links": ["camera", "place", "truth", "switch"]}},
    }
    assert measuring(content) == ["camera"]
    assert suite_of(content) == {"camera": 1}


def parts(*sensors: str, rate: float = 20.0) -> dict[str, Any]:
    return {
        "vehicle": {"length": 4.9},
        "sensors": {name: {"rate": rate} for name in sensors},
        "channels": {"nominal": {"links": list(sensors)}},
    }


def test_sensor_that_one_has_more_is_named_and_only_if_all_else_is_equal() -> None:
    assert extra_sensor(parts("camera", "radar"), parts("camera")) == "radar"
    assert extra_sensor(parts("camera"), parts("camera", "radar")) is None
    assert extra_sensor(parts("camera", "radar"), parts("camera", rate=10.0)) is None
    assert extra_sensor(parts("camera", "radar", "lidar"), parts("camera")) is None
    assert extra_sensor(parts("camera", "radar"), parts("lidar")) is None
