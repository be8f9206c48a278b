"""Swept values for people: in the unit of the scenario's default, and reading back."""

from __future__ import annotations

from typing import Any

import pytest

from adeye.sweep.axes import NamedValue, axis_text, named_values, quantity_or_text, quantity_text

ODD: dict[str, Any] = {
    "scenarios": {
        "cut_in": {
            "parameters": {
                "ego_speed": {"default": "100 km/h"},
                "lateral_speed": {"default": "1.5 m/s"},
                "rain": {"default": "0 mm/h"},
                "friction": {"default": 0.9},
            }
        }
    }
}


@pytest.mark.parametrize(
    ("value", "default", "text"),
    [
        (25.0, "100 km/h", "90 km/h"),
        (130 / 3.6, "100 km/h", "130 km/h"),
        (-10 / 3.6, "-30 km/h", "-10 km/h"),
        (1.5, "1 m/s", "1.5 m/s"),
        (7.5e-3 / 3600, "0 mm/h", "7.5 mm/h"),
        (45.0, "30 m", "45 m"),
        (2.2, "1.8 s", "2.2 s"),
        (6.0, "4 m/s^2", "6 m/s²"),
        (0.35, 0.9, "0.35"),
        (3.0, "left", "3"),
    ],
)
def test_value_is_written_in_the_unit_of_the_default(value: float, default: Any, text: str) -> None:
    assert quantity_text(value, default) == text


@pytest.mark.parametrize(
    ("text", "default"),
    [("110 km/h", "100 km/h"), ("2.5 mm/h", "0 mm/h"), ("0.7 m/s", "1 m/s"), ("35 m", "1 km")],
)
def test_what_is_written_reads_back(text: str, default: str) -> None:
    value, _ = quantity_or_text(text)
    again, _ = quantity_or_text(quantity_text(float(value), default))
    assert again == pytest.approx(value, rel=1e-9)


def test_axis_by_path_and_words_are_shown_as_they_are() -> None:
    assert axis_text("architecture.switch.policy", "stuck", ODD, "cut_in") == "stuck"
    assert axis_text("architecture.sensors.front_camera.range", 120.0, ODD, "cut_in") == "120"
    assert axis_text("ego_speed", 25.0, ODD, "another") == "25"


def test_point_is_named_in_its_order() -> None:
    point: dict[str, float | str] = {"rain": 0.0, "ego_speed": 25.0, "friction": 0.5}
    assert named_values(point, ODD, "cut_in") == (
        NamedValue("rain", "0 mm/h"),
        NamedValue("ego_speed", "90 km/h"),
        NamedValue("friction", "0.5"),
    )
