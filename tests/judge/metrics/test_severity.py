"""Severity: change of speed by the masses of both, and who dies of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS


def measure(made: Any, column: str) -> Any:
    found = METRICS[column].compute(made.trace())
    return float(found.value[0]), found.status[0], float(found.time[0]), found.actor[0]


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
