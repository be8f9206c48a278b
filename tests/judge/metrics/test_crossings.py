"""Crossings: times between the rows, who was first, and what is not known at the end."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS


def measure(made: Any, column: str) -> Any:
    found = METRICS[column].compute(made.trace())
    return float(found.value[0]), found.status[0], float(found.time[0]), found.actor[0]


def crossing(  # noqa: PLR0913 - what a test varies
    hand_made: Any, *, speed: float, at: float, begins: float, size: tuple[float, float],
    step: float = 0.1, slowing: float = 0.0, seconds: float = 4.0,
) -> Any:  # fmt: skip
    """An object crosses from d 0 on, at s 44 m; the ego's front is there after 2.1 s at 20 m/s."""
    rows = round(seconds / step) + 1
    time = np.arange(rows) * step
    made = hand_made(rows=rows, step=step)
    made.ego(s=20.0 * time - 0.5 * slowing * time**2, speed=20.0 - slowing * time)
    d = begins + speed * time
    return made.object("lead", s=at, d=d, speed=speed, heading=np.pi / 2.0, size=size)


def test_object_first_has_the_time_from_its_exit_to_the_entry_of_the_ego(hand_made: Any) -> None:
    # Corridor 4.25 to 6.25 m: a pedestrian of 0.5 m at 5 m/s is out after (6.5 - 0.03) / 5 s.
    made = crossing(hand_made, speed=5.0, at=44.0, begins=0.03, size=(0.5, 0.5))
    gone, entry = (6.25 + 0.25 - 0.03) / 5.0, (44.0 - 0.25 - 2.0) / 20.0
    assert measure(made, "min_pet_s")[:2] == (pytest.approx(entry - gone, rel=1e-9), "value")
    assert measure(made, "max_encroachment_time_s")[0] == pytest.approx(2.5 / 5.0, rel=1e-9)
    assert measure(made, "pet_overlap_s")[1] == "no_conflict"


def test_ego_first_has_the_time_from_its_exit(hand_made: Any) -> None:
    made = crossing(hand_made, speed=5.0, at=44.0, begins=-11.0, size=(0.5, 0.5))
    gone, entry = (44.0 + 0.25 + 2.0) / 20.0, (4.25 - 0.25 + 11.0) / 5.0
    assert measure(made, "min_pet_s")[0] == pytest.approx(entry - gone, rel=1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_thin_object_at_60_mps_does_not_tunnel_through_the_corridor(
    hand_made: Any, side: float
) -> None:
    # 6 m in a step: it is on the one side at 0.7 s and on the other at 0.8 s.
    made = crossing(hand_made, speed=60.0, at=44.0, begins=0.0, size=(0.1, 0.1))
    d = 5.25 + side * (60.0 * np.arange(41) * 0.1 - 45.0)
    made.object("lead", d=d, heading=side * np.pi / 2.0)
    gone = (45.0 + 1.05) / 60.0
    entry = (44.0 - 0.05 - 2.0) / 20.0
    assert measure(made, "min_pet_s")[:2] == (pytest.approx(entry - gone, rel=1e-9), "value")
    assert measure(made, "max_encroachment_time_s")[0] == pytest.approx(2.1 / 60.0, rel=1e-9)


def test_both_at_once_is_undefined_with_the_time_of_overlap(hand_made: Any) -> None:
    made = crossing(hand_made, speed=2.0, at=44.0, begins=1.0, size=(0.5, 0.5))
    # In the corridor from 1.5 s to 2.75 s; the ego from 2.0875 s to 2.3125 s.
    assert measure(made, "min_pet_s")[1] == "undefined"
    assert measure(made, "pet_overlap_s")[:2] == (pytest.approx(0.225, rel=1e-6), "value")
    assert measure(made, "min_predicted_pet_s")[:2] == (0.0, "value")


def test_ego_that_never_comes_leaves_it_incomplete(hand_made: Any) -> None:
    made = crossing(hand_made, speed=5.0, at=44.0, begins=0.0, size=(0.5, 0.5), slowing=5.5,
                    seconds=3.5)  # fmt: skip
    assert measure(made, "min_pet_s")[1] == "incomplete"
    assert measure(made, "max_encroachment_time_s")[1] == "value"


def test_who_drives_along_does_not_cross(hand_made: Any) -> None:
    for column in ("min_pet_s", "pet_overlap_s", "max_encroachment_time_s", "min_predicted_pet_s"):
        assert measure(hand_made(), column)[1] == "not_applicable"


def test_prediction_is_the_time_itself_at_constant_speed(hand_made: Any) -> None:
    made = crossing(hand_made, speed=5.0, at=44.0, begins=0.03, size=(0.5, 0.5))
    assert measure(made, "min_predicted_pet_s")[0] == pytest.approx(
        measure(made, "min_pet_s")[0], rel=1e-6
    )


@pytest.mark.parametrize(("heading", "first"), [(1.0, 50.0), (2.1, 70.0), (-1.0, 50.0)])
def test_prediction_is_the_time_itself_for_who_crosses_askew(
    hand_made: Any, heading: float, first: float
) -> None:
    # It goes on along the road while it crosses: the conflict area is not where it is seen.
    made = hand_made(rows=61)
    side = np.sign(heading)
    made.ego(s=20.0 * made.time, d=5.25)
    made.object(
        "lead", s=first + 5.0 * np.cos(heading) * made.time, speed=5.0, heading=heading,
        d=5.25 + side * (5.0 * abs(np.sin(heading)) * made.time - 3.0), size=(0.5, 0.5),
    )  # fmt: skip
    predicted, status = measure(made, "min_predicted_pet_s")[:2]
    assert (predicted, status) == (pytest.approx(measure(made, "min_pet_s")[0], rel=1e-9), "value")


def test_time_converges_with_the_square_of_the_step(hand_made: Any) -> None:
    # The braking ego enters between rows: 20 t - 2 t² = 41.75.
    exact = (20.0 - (400.0 - 8.0 * 41.75) ** 0.5) / 4.0 - (6.5 - 0.03) / 5.0
    errors = []
    for step in (0.2, 0.1, 0.05, 0.025, 0.0125):
        made = crossing(hand_made, speed=5.0, at=44.0, begins=0.03, size=(0.5, 0.5), step=step,
                        slowing=4.0, seconds=4.0)  # fmt: skip
        errors.append(abs(measure(made, "min_pet_s")[0] - exact))
    bounds = [step * step for step in (0.2, 0.1, 0.05, 0.025, 0.0125)]
    assert all(error <= bound for error, bound in zip(errors, bounds, strict=True))
    assert errors[0] > 0.0


def test_unknown_number_is_an_error(hand_made: Any) -> None:
    made = crossing(hand_made, speed=5.0, at=44.0, begins=0.0, size=(0.5, 0.5))
    made.columns["objects"][0, 5, 0, 3] = np.nan
    assert measure(made, "min_pet_s")[1] == "error"
