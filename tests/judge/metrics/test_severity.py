"""Severity: change of speed by the masses of both, who dies of it, and whose fault it is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS
from tests.judge.conftest import measure


def test_masses_share_the_speed(hand_made: Any) -> None:
    made = hand_made().touch(7, "lead", speed=10.0)
    own, other = 1800.0, 1500.0
    expected = 10.0 * other / (own + other)
    assert measure(made, "delta_v_mps") == (
        pytest.approx(expected, rel=1e-9), "value", pytest.approx(0.7), 0
    )  # fmt: skip
    assert measure(made, "other_delta_v_mps")[0] == pytest.approx(10.0 - expected, rel=1e-9)
    assert measure(made, "fatality_probability")[0] == pytest.approx(
        ((10.0 - expected) / 31.74) ** 4, rel=1e-9
    )


def test_who_hits_a_building_stops(hand_made: Any) -> None:
    made = hand_made().touch(7, "lead", speed=10.0)
    trace = made.trace()
    trace.layout.context.object_classes[:] = 10
    assert METRICS["delta_v_mps"].compute(trace).value[0] == 10.0
    assert METRICS["other_delta_v_mps"].compute(trace).value[0] == 0.0


def test_without_contact_there_is_no_change_and_no_death(hand_made: Any) -> None:
    assert measure(hand_made(), "delta_v_mps")[1] == "no_conflict"
    value, status, time, actor = measure(hand_made(), "fatality_probability")
    assert (value, status, actor) == (0.0, "value", -1)
    assert np.isnan(time)


def test_unknown_impact_speed_is_never_harmless(hand_made: Any) -> None:
    made = hand_made().touch(5, "lead", speed=np.nan)
    for column in ("delta_v_mps", "fatality_probability"):
        assert not np.isfinite(measure(made, column)[0])


ROW = 10


def fault_of(made: Any) -> Any:
    found = METRICS["contact_at_fault"].compute(made.trace())
    return float(found.value[0]), found.status[0], found.actor[0]


def touching(made: Any, *, along: float, across: float = 0.0, **other: Any) -> Any:
    """Put the other body beside the ego's centre at the contact."""
    ego = made.columns["ego"][0, ROW]
    made.object("lead", s=np.full(21, ego[0] + along), d=np.full(21, ego[1] + across), **other)
    return made.touch(ROW, "lead")


def test_without_contact_nobody_is_at_fault(hand_made: Any) -> None:
    assert fault_of(hand_made()) == (0.0, "value", -1)
    assert np.isnan(METRICS["contact_at_fault"].compute(hand_made().trace()).time[0])


def test_who_drives_into_the_rear_of_another_is_at_fault(hand_made: Any) -> None:
    assert fault_of(touching(hand_made(), along=3.9, speed=10.0)) == (1.0, "value", 0)


def test_step_that_ends_before_the_bodies_touch_changes_nothing(hand_made: Any) -> None:
    assert fault_of(touching(hand_made(), along=4.5, speed=10.0))[0] == 1.0


def test_who_is_hit_from_behind_is_not(hand_made: Any) -> None:
    assert fault_of(touching(hand_made(), along=-3.9, speed=30.0)) == (0.0, "value", 0)


def test_who_stands_is_not(hand_made: Any) -> None:
    made = touching(hand_made().ego(speed=0.0), along=3.9, speed=-3.0)
    assert fault_of(made)[0] == 0.0


def test_who_hits_what_stands_is_wherever_they_touch(hand_made: Any) -> None:
    assert fault_of(touching(hand_made(), along=0.0, across=1.9, speed=0.0))[0] == 1.0


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_who_is_hit_in_the_side_within_its_lane_is_not(hand_made: Any, side: float) -> None:
    assert fault_of(touching(hand_made(), along=-0.5, across=1.9 * side, speed=21.0))[0] == 0.0


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_who_touches_another_side_between_lanes_is(hand_made: Any, side: float) -> None:
    made = hand_made().ego(d=np.full(21, 5.25 + 1.2 * side))
    assert fault_of(touching(made, along=-0.5, across=1.9 * side, speed=21.0))[0] == 1.0


def test_turned_body_reaches_over_the_line_of_its_lane(hand_made: Any) -> None:
    straight = hand_made().ego(d=np.full(21, 5.25 + 0.6))
    assert fault_of(touching(straight, along=-0.5, across=1.9, speed=21.0))[0] == 0.0
    turned = hand_made().ego(d=np.full(21, 5.25 + 0.6), heading=0.2)
    assert fault_of(touching(turned, along=-0.5, across=1.9, speed=21.0))[0] == 1.0


def test_who_is_off_the_road_is(hand_made: Any) -> None:
    made = hand_made().ego(d=np.full(21, 14.0))
    assert fault_of(touching(made, along=-0.5, across=1.9, speed=21.0))[0] == 1.0


def test_corner_of_the_front_is_the_front(hand_made: Any) -> None:
    assert fault_of(touching(hand_made(), along=3.5, across=1.9, speed=21.0))[0] == 1.0


def test_mirrored_scene_has_the_same_fault(hand_made: Any) -> None:
    found = [
        [
            fault_of(touching(hand_made(), along=along, across=side * across, speed=22.0))[0]
            for along in (-3.9, -3.0, 0.0, 1.0, 3.0, 3.9)
            for across in (0.5, 1.9)
        ]
        for side in (-1.0, 1.0)
    ]
    assert found[0] == found[1]
    assert {0.0, 1.0} == set(found[0])


def test_unknown_state_is_an_error_and_no_innocence(hand_made: Any) -> None:
    assert fault_of(touching(hand_made(), along=3.9, speed=np.nan))[1] == "error"
