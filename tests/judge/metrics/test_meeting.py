"""Metrics of encounters in the plane: closed forms of hand-made runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS


def measure(made: Any, column: str) -> Any:
    found = METRICS[column].compute(made.trace())
    return float(found.value[0]), found.status[0], float(found.time[0]), found.actor[0]


COLUMNS = ("min_ttc_2d_s", "min_wttc_s", "min_dce_m", "min_ttce_s")


def test_approach_in_the_own_lane_is_the_one_dimensional_case(hand_made: Any) -> None:
    made = hand_made().object("lead", speed=0.0, s=48.0)
    assert measure(made, "min_ttc_2d_s") == (pytest.approx(0.2, rel=1e-9), "value", 2.0, 0)
    assert measure(made, "min_dce_m")[:3] == (0.0, "value", 0.0)
    assert measure(made, "min_ttce_s")[0] == pytest.approx(0.2, rel=1e-9)


def test_neighbour_that_passes_is_no_collision_but_an_encounter(hand_made: Any) -> None:
    time = np.arange(21) * 0.1
    made = hand_made().object("lead", speed=0.0, s=48.0 + 0.0 * time, d=5.25 + 2.5)
    assert measure(made, "min_ttc_2d_s")[1] == "no_conflict"
    assert measure(made, "min_dce_m")[:2] == (pytest.approx(0.5, rel=1e-9), "value")
    assert measure(made, "min_ttce_s")[0] == pytest.approx(0.2, rel=1e-9)


def test_crossing_at_60_mps_is_seen_before_it_is_there(hand_made: Any) -> None:
    # Where the ego will be 2 s later, on a step of 6 m; rows never show them together.
    time = np.arange(21) * 0.1
    made = hand_made()
    d = 5.25 - 60.0 * (2.07 - time)
    made.object("lead", s=41.4, d=d, speed=60.0, heading=np.pi / 2.0, size=(0.1, 0.1))
    value, status, _, actor = measure(made, "min_ttc_2d_s")
    assert (status, actor) == ("value", 0)
    assert value == pytest.approx(2.07 - 1.05 / 60.0 - 2.0, abs=1e-9)
    assert measure(made, "min_dce_m")[0] == 0.0


def test_nearest_distance_converges_from_above(hand_made: Any) -> None:
    # Crossing ahead: the least distance is between rows; the prediction has it at once.
    def made(step: float) -> Any:
        rows = round(3.2 / step) + 1
        time = np.arange(rows) * step
        found = hand_made(rows=rows, step=step)
        return found.object(
            "lead", s=52.0, d=5.25 + 20.0 * (time - 1.63), speed=20.0, heading=np.pi / 2.0,
            size=(1.0, 1.0),
        )  # fmt: skip

    exact = measure(made(0.1), "min_dce_m")[0]
    least = [measure(made(step), "min_distance_m")[0] for step in (0.2, 0.1, 0.05, 0.025)]
    assert all(value >= exact - 1e-9 for value in least)
    errors = [value - exact for value in least]
    assert errors[-1] <= errors[0] / 4.0 + 1e-12
    assert errors[-1] < 0.2


@pytest.mark.parametrize("column", COLUMNS)
def test_empty_road_is_no_conflict_and_contact_zero(hand_made: Any, column: str) -> None:
    assert measure(hand_made(objects=()), column)[1] == "no_conflict"
    made = hand_made(objects=("lead", "other")).touch(7, "other")
    assert measure(made, column)[0] == 0.0


@pytest.mark.parametrize("column", COLUMNS)
def test_unknown_place_is_an_error(hand_made: Any, column: str) -> None:
    made = hand_made()
    made.columns["objects"][0, 10, 0, 0] = np.nan
    assert measure(made, column)[1] == "error"


def test_static_object_cannot_come_to_meet_the_ego(hand_made: Any) -> None:
    made = hand_made().object("lead", speed=0.0, s=200.0)
    moving = measure(made, "min_wttc_s")[0]
    trace = made.trace()
    object.__setattr__(trace.layout.context, "actor_count", 0)
    fixed = float(METRICS["min_wttc_s"].compute(trace).value[0])
    assert fixed > moving
