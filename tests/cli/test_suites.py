"""Tables of suites: several side by side, and a suite that sees nothing."""

from typing import Any

import pytest

from adeye.analysis.suite.analyse import analyse
from adeye.cli.sensors import print_suites
from tests.analysis.suite.rigs import all_around, architecture, radar

pytestmark = pytest.mark.usefixtures("folder")


def printed(capfd: pytest.CaptureFixture[str], *sensors: dict[str, Any]) -> str:
    print_suites(
        [
            analyse(architecture(each, architecture=f"suite_{number}"))
            for number, each in enumerate(sensors)
        ]
    )
    return capfd.readouterr().out


def test_suites_stand_side_by_side(capfd: pytest.CaptureFixture[str]) -> None:
    text = printed(capfd, {"eye": radar()}, {"roof": all_around(range=70.0)})
    heads = [line for line in text.splitlines() if "Zone" in line]
    assert heads
    assert all("suite_0" in line and "suite_1" in line for line in heads)


def test_suite_without_eyes_supports_no_speed(capfd: pytest.CaptureFixture[str]) -> None:
    text = printed(capfd, {"truth": {"kind": "ground_truth", "rate": 20.0}})
    line = next(line for line in text.splitlines() if "stopped car" in line)
    assert line.split()[-1] == "none"
    assert "Not analysed (no devices): suite_0.truth." in text


def test_suite_that_sees_everything_has_no_blind_spot(capfd: pytest.CaptureFixture[str]) -> None:
    text = printed(capfd, {"roof": all_around(range=300.0)})
    assert "No blind spot in any zone." in text
    assert "100/0/0 | 0" in text


def test_critical_sensor_and_shared_element_are_marked(capfd: pytest.CaptureFixture[str]) -> None:
    text = printed(
        capfd,
        {"a": radar(realises="radars"), "b": radar(range=50.0, realises="radars")},
    )
    assert "  a (critical)" in text
    assert "radars (element, 2 sensors)" in text


def test_speed_from_which_a_pedestrian_is_seen_is_told(capfd: pytest.CaptureFixture[str]) -> None:
    text = printed(capfd, {"eye": radar(field_of_view=0.3)})
    line = next(line for line in text.splitlines() if "crossing pedestrian" in line)
    assert "(from 34)" in line
