"""Numbers of a suite in words: rounding never flatters."""

import pytest

from adeye.analysis.suite.records import ForwardRange, SpeedRange
from adeye.report.words import forward_text, kmh, left_speed, metres, percent, speed_text


@pytest.mark.parametrize(
    ("share", "text"), [(0.0, "0"), (1e-6, "1"), (0.5, "50"), (0.999, "99"), (1.0, "100")]
)
def test_only_all_is_all_and_only_nothing_is_nothing(share: float, text: str) -> None:
    assert percent(share) == text


def test_speeds_and_ranges_are_rounded_down() -> None:
    assert kmh(99.99 / 3.6) == "99"
    assert kmh(100.0 / 3.6) == "100"
    assert metres(0.9) == "+0"
    assert metres(-0.1) == "\N{MINUS SIGN}1"
    assert left_speed(None) == "none"


def speed(lowest: float | None, highest: float | None, *, is_limit: bool = False) -> SpeedRange:
    sensor = "" if highest is None else "eye"
    low, high = (None if each is None else each / 3.6 for each in (lowest, highest))
    return SpeedRange("dry", "stopped_car", low, high, is_limit, sensor, 8.0)


def test_speed_names_its_sensor_and_is_marked_below_that_of_the_odd() -> None:
    assert speed_text(speed(10.0, 80.0), None) == "80 eye"
    assert speed_text(speed(10.0, 80.0), 100.0 / 3.6) == "80 ! eye"
    assert speed_text(speed(10.0, 120.0), 100.0 / 3.6) == "120 eye"
    assert speed_text(speed(21.2, 80.0), None) == "80 (from 22) eye"
    assert speed_text(speed(10.0, 250.0, is_limit=True), None) == "> 250 eye"
    assert speed_text(speed(None, None), None) == "none"
    assert speed_text(speed(None, None), 30.0) == "none !"


def test_forward_range_is_told_as_the_speed_that_it_allows() -> None:
    assert forward_text(ForwardRange("dry", 95.9, "eye", 102.9 / 3.6, None)) == "102 by 95 m"
    assert forward_text(ForwardRange("dry", 95.9, "eye", 102.9 / 3.6, 150.0)) == "102 ! by 95 m"
    assert forward_text(ForwardRange("dry", 30.0, "eye", None, None)) == "< 60 by 30 m"
    assert forward_text(ForwardRange("dry", 0.0, "", None, 150.0)) == "none !"
