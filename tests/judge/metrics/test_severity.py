"""Severity: change of speed by the masses of both, who dies of it, and whose fault it is."""

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


def test_fault_is_with_who_drives_into_another_or_leaves_the_lane(hand_made: Any) -> None:
    beside = {"along": -0.5, "across": 1.9, "speed": 21.0}
    at = {d: hand_made().ego(d=np.full(21, 5.25 + d)) for d in (0.6, 1.2, -1.2, 8.75)}
    turned = hand_made().ego(d=np.full(21, 5.25 + 0.6), heading=0.2)
    scenes: dict[str, tuple[Any, dict[str, float], float]] = {
        "who drives into the rear of another": (hand_made(), {"along": 3.9, "speed": 10.0}, 1.0),
        "also in a step before the bodies touch": (hand_made(), {"along": 4.5, "speed": 10.0}, 1.0),
        "not who is hit from behind": (hand_made(), {"along": -3.9, "speed": 30.0}, 0.0),
        "not who stands": (hand_made().ego(speed=0.0), {"along": 3.9, "speed": -3.0}, 0.0),
        "who hits what stands": (hand_made(), {"along": 0.0, "across": 1.9, "speed": 0.0}, 1.0),
        "not who is hit in the left side in its lane": (hand_made(), beside, 0.0),
        "not in the right side": (hand_made(), {**beside, "across": -1.9}, 0.0),
        "who touches another left side between lanes": (at[1.2], beside, 1.0),
        "who touches another right side": (at[-1.2], {**beside, "across": -1.9}, 1.0),
        "not a straight body within its lane": (at[0.6], beside, 0.0),
        "a turned body reaches over the line": (turned, beside, 1.0),
        "who is off the road": (at[8.75], beside, 1.0),
        "with the corner of the front": (hand_made(), {**beside, "along": 3.5}, 1.0),
    }
    for why, (made, other, expected) in scenes.items():
        assert fault_of(touching(made, **other)) == (expected, "value", 0), why


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
