"""Who comes from behind in the next lane, and how early it is seen, over hand-made runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS

CRITICAL = 10.0 * 0.4 + 10.0**2 / 6.0 + 20.0
"""What somebody 10 m/s faster than the ego's 20 m/s needs [m]."""


def measure(made: Any) -> Any:
    found = METRICS["rear_detection_margin_m"].compute(made.trace())
    return float(found.value[0]), found.status[0], float(found.time[0]), int(found.actor[0])


def overtaken(hand_made: Any, *objects: str, behind: float = 80.0) -> Any:
    """Somebody 10 m/s faster in the left lane, who gains 1 m from row to row."""
    made = hand_made(objects=objects or ("fast",), rows=101)
    return made.object("fast", s=3.0 * np.arange(101) - behind - 4.0, speed=30.0, d=8.75)


def test_margin_is_the_distance_of_the_first_detection_less_the_critical(hand_made: Any) -> None:
    made = overtaken(hand_made)
    made.columns["detected"][0, 20:, 0, 0] = True
    assert measure(made) == (pytest.approx(60.0 - CRITICAL), "value", 2.0, 0)


def test_who_is_never_seen_is_at_zero(hand_made: Any) -> None:
    assert measure(overtaken(hand_made))[:2] == (pytest.approx(-CRITICAL), "value")


def test_who_is_seen_alongside_only_is_at_zero(hand_made: Any) -> None:
    made = overtaken(hand_made)
    made.columns["detected"][0, 81:, 0, 0] = True
    assert measure(made)[0] == pytest.approx(-CRITICAL)


def test_ground_truth_does_not_see(hand_made: Any) -> None:
    made = overtaken(hand_made)
    made.columns["detected"][0, :, 1, 0] = True
    assert measure(made)[0] == pytest.approx(-CRITICAL)


def test_who_is_too_near_from_the_start_does_not_count(hand_made: Any) -> None:
    assert measure(overtaken(hand_made, behind=CRITICAL - 0.5))[1] == "not_applicable"
    assert measure(overtaken(hand_made, behind=CRITICAL + 0.5))[1] == "value"


@pytest.mark.parametrize(
    ("why", "change"),
    [
        ("slower", {"speed": 19.0}),
        ("in the lane of the ego", {"d": 5.25}),
        ("two lanes away", {"d": 5.25 + 1.5 * 3.5 + 0.1}),
        ("ahead", {"s": 50.0 + 3.0 * np.arange(101)}),
    ],
)
def test_who_does_not_come_from_behind_in_the_next_lane_does_not_count(
    hand_made: Any, why: str, change: dict[str, Any]
) -> None:
    assert measure(overtaken(hand_made).object("fast", **change))[1] == "not_applicable", why


def test_worst_of_two_counts(hand_made: Any) -> None:
    made = overtaken(hand_made, "fast", "faster")
    made.object("faster", s=4.0 * np.arange(101) - 154.0, speed=40.0, d=1.75)
    made.columns["detected"][0, 20:, 0, :] = True
    critical = 20.0 * 0.4 + 20.0**2 / 6.0 + 20.0
    assert measure(made) == (pytest.approx(110.0 - critical), "value", 2.0, 1)


def test_distance_on_a_bend_is_that_along_the_lane_of_who_comes(hand_made: Any) -> None:
    made = overtaken(hand_made)
    made.columns["detected"][0, :, 0, 0] = True
    for place in ("ego_place", "object_places"):
        made.columns[place][..., 2] = made.columns[place][..., 0] / 100.0
    behind = 84.0 * (100.0 - 8.75) / 100.0 - 4.0
    assert measure(made)[0] == pytest.approx(behind - CRITICAL)
