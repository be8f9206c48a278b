"""Who follows: behind, in the path, with a gap, the same way."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS


def measure(made: Any, column: str) -> Any:
    found = METRICS[column].compute(made.trace())
    return float(found.value[0]), found.status[0], float(found.time[0]), found.actor[0]


@pytest.mark.parametrize(
    ("motion", "status"),
    [
        ({"s": -30.0, "speed": 24.0}, "value"),
        ({"s": -30.0, "speed": 24.0, "d": 5.25 + 1.99}, "value"),
        ({"s": -30.0, "speed": 24.0, "d": 5.25 - 2.01}, "no_conflict"),
        ({"s": -30.0, "speed": 24.0, "heading": np.pi}, "no_conflict"),
        ({"s": 60.0, "speed": 24.0}, "no_conflict"),
    ],
)
def test_who_follows(hand_made: Any, motion: dict[str, float], status: str) -> None:
    made = hand_made().ego(s=0.0)
    made.object("lead", **motion)
    assert measure(made, "min_rear_ttc_s")[1] == status
    assert measure(made, "max_follower_deceleration_mps2")[1] == status


def test_slower_follower_has_nothing_to_fear_and_nothing_to_do(hand_made: Any) -> None:
    made = hand_made().object("lead", s=-30.0, speed=15.0)
    assert measure(made, "min_rear_ttc_s")[1] == "no_conflict"
    assert measure(made, "max_follower_deceleration_mps2")[:2] == (0.0, "value")


def test_gap_behind_on_a_bend_is_that_along_the_lane_of_who_follows(hand_made: Any) -> None:
    made = hand_made().ego(s=0.0, d=8.75).object("lead", s=-30.0, d=8.75, speed=24.0)
    for state, place in (("ego", "ego_place"), ("objects", "object_places")):
        turned = made.columns[place][..., 0] / 60.0
        made.columns[place][..., 2] = made.columns[state][..., 2] = turned
    gap = 30.0 * (60.0 - 8.75) / 60.0 - 4.0
    assert measure(made, "min_rear_ttc_s")[0] == pytest.approx(gap / 4.0)
