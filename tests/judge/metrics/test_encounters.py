"""Encounters in the plane and crossings: closed forms, times between the rows, and bounds."""

import math
from functools import partial
from typing import Any

import numpy as np
import pytest

from adeye.judge.conflict import reach_of
from adeye.judge.metrics import METRICS
from adeye.judge.metrics.encounters import ENCOUNTER_DISTANCE, ENCOUNTER_HORIZON
from adeye.kernel.boxes import box_distance
from adeye.kernel.encounter import (
    closest_encounter,
    planar_time_to_collision,
    worst_time_to_collision,
)
from adeye.kernel.motion import GRAVITY
from tests.judge.conftest import measure


def expected(made: Any) -> list[float]:
    """The same from every row and object, without bounds."""
    best = [math.inf] * 4
    for row in range(made.rows):
        x, y, heading, speed = made.columns["ego"][0, row, :4]
        for index in range(len(made.objects)):
            ox, oy, o_heading, o_speed = made.columns["objects"][0, row, index, :4]
            length, width = made.sizes[0, index, :2]
            place = (ox - x, oy - y)
            rate = (
                o_speed * math.cos(o_heading) - speed * math.cos(heading),
                o_speed * math.sin(o_heading) - speed * math.sin(heading),
            )
            own, other = (heading, 4.0, 2.0), (o_heading, length, width)
            reach = reach_of(4.0, 2.0) + reach_of(length, width)
            time, distance = closest_encounter(place, rate, own, other)
            if time > ENCOUNTER_HORIZON:
                time = 0.0
                distance = box_distance((x, y, *own), (ox, oy, *other))
            best[0] = min(best[0], planar_time_to_collision(place, rate, own, other))
            best[1] = min(best[1], worst_time_to_collision(*place, *rate, reach, 2.0 * GRAVITY))
            best[2] = min(best[2], distance)
            if distance <= ENCOUNTER_DISTANCE:
                best[3] = min(best[3], time)
    return best


COLUMNS = ("min_ttc_2d_s", "min_wttc_s", "min_dce_m", "min_ttce_s")


@pytest.mark.parametrize("seed", range(25))
def test_bounds_leave_nothing_out(hand_made: Any, seed: int) -> None:
    draw = np.random.default_rng(seed)
    names = tuple("abcd")
    made = hand_made(objects=names)
    time = made.time
    made.ego(d=5.25 + 0.3 * np.sin(time), heading=0.05 * draw.normal())
    for name in names:
        speed, heading = draw.uniform(0.0, 35.0), draw.choice([0.0, np.pi / 2.0, np.pi])
        heading += draw.normal(0.0, 0.1)
        along, across = speed * np.cos(heading), speed * np.sin(heading)
        made.object(
            name, s=draw.uniform(-30.0, 90.0) + along * time,
            d=draw.uniform(-20.0, 30.0) + across * time, speed=speed, heading=heading,
            size=(draw.uniform(0.5, 8.0), draw.uniform(0.5, 2.5)),
        )  # fmt: skip
    wanted = expected(made)
    for column, value in zip(COLUMNS, wanted, strict=True):
        found = METRICS[column].compute(made.trace())
        if value == math.inf:
            assert found.status == ("no_conflict",), column
        else:
            assert found.value[0] == pytest.approx(value, rel=1e-9, abs=1e-9), column


def test_approach_in_the_own_lane_is_the_one_dimensional_case(hand_made: Any) -> None:
    made = hand_made().object("lead", speed=0.0, s=48.0)
    assert measure(made, "min_ttc_2d_s") == (pytest.approx(0.2, rel=1e-9), "value", 2.0, 0)
    assert measure(made, "min_dce_m")[:3] == (0.0, "value", 0.0)
    assert measure(made, "min_ttce_s")[0] == pytest.approx(0.2, rel=1e-9)


def test_neighbour_that_passes_is_no_collision_but_an_encounter_up_to_a_metre(
    hand_made: Any,
) -> None:
    for aside, status in ((0.5, "value"), (1.0, "value"), (1.125, "no_conflict")):
        made = hand_made().object("lead", speed=0.0, s=48.0, d=5.25 + 2.0 + aside)
        assert measure(made, "min_ttc_2d_s")[1] == "no_conflict"
        assert measure(made, "min_dce_m")[:2] == (pytest.approx(aside, rel=1e-9), "value")
        assert measure(made, "min_ttce_s")[1] == status, aside
        if status == "value":
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


def test_contact_is_no_distance_and_no_time(hand_made: Any) -> None:
    made = hand_made(objects=("lead", "other")).touch(7, "other")
    for column in COLUMNS:
        assert measure(made, column)[0] == 0.0, column


def test_static_object_cannot_come_to_meet_the_ego(hand_made: Any) -> None:
    made = hand_made().object("lead", speed=0.0, s=200.0)
    moving = measure(made, "min_wttc_s")[0]
    trace = made.trace()
    object.__setattr__(trace.layout.context, "actor_count", 0)
    fixed = float(METRICS["min_wttc_s"].compute(trace).value[0])
    assert fixed > moving


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


def test_of_two_that_do_the_same_the_first_is_named(hand_made: Any) -> None:
    two = partial(hand_made, objects=("lead", "other"))
    for speed, begins, columns in (
        (2.0, 1.0, (*COLUMNS, "pet_overlap_s", "max_encroachment_time_s", "min_predicted_pet_s")),
        (5.0, 0.03, ("min_pet_s", "max_encroachment_time_s", "min_predicted_pet_s")),
    ):
        made = crossing(two, speed=speed, at=44.0, begins=begins, size=(0.5, 0.5))
        d = begins + speed * made.time
        made.object("other", s=44.0, d=d, speed=speed, heading=np.pi / 2.0, size=(0.5, 0.5))
        assert {column: measure(made, column)[3] for column in columns} == dict.fromkeys(columns, 0)


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
