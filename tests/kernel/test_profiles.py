"""Profiles of speed, paths to the side, and what is predicted of one object."""

from __future__ import annotations

import numpy as np
import pytest

from adeye.kernel import profiles
from adeye.signals import Floats
from tests.kernel.stop_limits import GROUND

INTERVAL = 0.25
SAMPLES = 16


def profile(speed: float, before: float, wanted: float, jerk: float = 25.0) -> Floats:
    made = np.zeros((SAMPLES, profiles.PROFILE_ROW))
    profiles.fill_profile(speed, before, wanted, jerk, INTERVAL, 0.0, made)
    return made


def stepped(speed: float, before: float, wanted: float, jerk: float) -> Floats:
    """Drive the same in steps of a tenth of a millisecond."""
    way, acceleration, rows = 0.0, before, []
    step, per = 1e-4, round(INTERVAL / 1e-4)
    change = jerk * step
    for number in range(1, SAMPLES * per + 1):
        acceleration += float(np.clip(wanted - acceleration, -change, change))
        later = max(0.0, speed + acceleration * step)
        way += 0.5 * (speed + later) * step
        speed = later
        if speed == 0.0:
            acceleration = min(acceleration, 0.0)
        if number % per == 0:
            rows.append((way, speed))
    return np.array(rows)


def test_profile_is_what_small_steps_make() -> None:
    for speed, before, wanted, jerk in (
        (30.0, 0.0, -8.0, 25.0),
        (30.0, -8.0, 1.5, 10.0),
        (10.0, 1.0, 1.0, 25.0),
        (6.0, 0.0, -8.0, 5.0),
        (0.4, -0.5, -4.0, 2.0),
        (0.0, 0.0, 1.5, 25.0),
        (12.0, -3.0, -2.0, 25.0),
        (0.0, 0.0, -2.0, 25.0),
    ):
        made = profile(speed, before, wanted, jerk)[:, [profiles.PROFILE_S, profiles.PROFILE_SPEED]]
        expected = stepped(speed, before, wanted, jerk)
        assert made == pytest.approx(expected, abs=5e-3), (speed, before, wanted)


def test_held_brake_does_not_keep_a_standing_ego_from_starting() -> None:
    made = profile(0.0, -2.0, 1.0)
    assert made[-1, profiles.PROFILE_SPEED] > 3.0
    assert (made[:, profiles.PROFILE_S] >= 0.0).all()


def path(d: float, slope: float, bend: float, target: float, length: float) -> Floats:
    made = np.zeros(profiles.PATH_ROW)
    profiles.lay_path(made, 100.0, d, slope, bend, target, length)
    return made


def test_path_begins_in_its_state_and_ends_at_rest_at_its_target() -> None:
    made = path(1.0, 0.05, -0.002, 4.5, 60.0)
    assert profiles.at_path(made, 0.0) == pytest.approx((1.0, 0.05, -0.002))
    assert profiles.at_path(made, 60.0 - 1e-9) == pytest.approx((4.5, 0.0, 0.0), abs=1e-7)
    assert profiles.at_path(made, 200.0) == (4.5, 0.0, 0.0)


def test_slope_and_bend_are_derivatives() -> None:
    made, step = path(0.0, 0.02, 0.001, 3.0, 50.0), 1e-4
    for way in (1.0, 17.0, 33.0, 49.0):
        early, late = profiles.at_path(made, way - step), profiles.at_path(made, way + step)
        middle = profiles.at_path(made, way)
        assert (late[0] - early[0]) / (2 * step) == pytest.approx(middle[1], abs=1e-6)
        assert (late[1] - early[1]) / (2 * step) == pytest.approx(middle[2], abs=1e-6)


def test_path_laid_again_from_half_way_is_the_same_path() -> None:
    made = path(0.0, 0.0, 0.0, 3.5, 60.0)
    again = np.zeros(profiles.PATH_ROW)
    profiles.lay_path(again, 130.0, *profiles.at_path(made, 30.0), 3.5, 30.0)
    for way in (0.0, 5.0, 20.0, 29.0):
        assert profiles.at_path(again, way) == pytest.approx(
            profiles.at_path(made, 30.0 + way), abs=1e-9
        )


def test_path_at_its_target_is_flat() -> None:
    assert path(2.0, 0.0, 0.0, 2.0, 60.0)[profiles.PATH_IS_FLAT] == 1.0
    assert path(1.0, 0.0, 0.0, 2.0, 60.0)[profiles.PATH_IS_FLAT] == 0.0


# --- What is predicted of one object, whoever asks; the tests of the channels' tracks are theirs --

LANE = 5.25
TIMES = 0.5 * np.arange(1, 9)


def ways(
    speed: float, sideways: float, acceleration: float = 0.0, *, is_free: bool = False
) -> tuple[Floats, Floats]:
    body, way = np.zeros(profiles.OBJECT_ROW), np.zeros((8, profiles.WAY_ROW))
    body[profiles.OBJECT_D], body[profiles.OBJECT_SPEED] = LANE, speed
    profiles.predict_body(GROUND, 0.0, body, sideways, is_free, acceleration, 0.5, way)
    return body, way


def test_lane_change_is_completed_and_no_more() -> None:
    body, way = ways(20.0, 1.0)
    assert way[:, profiles.WAY_S] == pytest.approx(20.0 * TIMES)
    assert way[:, profiles.WAY_D] == pytest.approx(np.minimum(8.75, LANE + TIMES))
    assert body[profiles.OBJECT_SINE] > 0.0


def test_who_is_free_goes_on_beyond_the_road() -> None:
    body, way = ways(0.0, -2.0, is_free=True)
    assert way[:, profiles.WAY_D] == pytest.approx(LANE - 2.0 * TIMES)
    assert body[profiles.OBJECT_GROWTH] == profiles.FREE_GROWTH


@pytest.mark.slow
def test_who_brakes_stands_and_moves_sideways_no_more() -> None:
    _, way = ways(8.0, 0.5, -4.0)
    assert way[-1, profiles.WAY_S] == pytest.approx(8.0)
    assert way[-1, profiles.WAY_D] == pytest.approx(LANE + 0.5 * 2.0)


def test_little_braking_is_noise_and_too_much_is_not_believed() -> None:
    seen = [(-1.0, 20.0), (-4.0, 20.0), (-30.0, 20.0), (-4.0, -20.0)]
    assert [profiles.believed_braking(*it) for it in seen] == [0.0, -4.0, -10.0, 0.0]


def test_margin_grows_with_time_and_faster_for_those_who_may_turn() -> None:
    assert profiles.margin_at(0.3, 0.1, 1.0, 0.0) == 0.3
    assert profiles.margin_at(0.3, 0.1, 1.0, 4.0) == pytest.approx(0.7)
    assert profiles.margin_at(0.3, 0.1, profiles.FREE_GROWTH, 4.0) == pytest.approx(1.3)
