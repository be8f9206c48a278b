"""Where the ego is by satellite and inertia: without error, with noise, in an outage, in a loop."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.signals import Floats, parameter_record
from adeye.simulate.channels.perception import localisation as subject
from adeye.simulate.engine import run
from adeye.simulate.sensors.rig import DATA_SHEETS
from adeye.spec.architecture import Architecture
from adeye.spec.fault import FAULT
from adeye.testing.scenes import channel_context, ego_estimate, straight_road
from tests.motorway import ARCHITECTURE, fault, make_case, make_scenario, merged
from tests.simulate.channels.egos import CAR, STEP, Estimated, drive, estimate, gnss, imu

NOISY = {"position_noise": "0.3 m", "speed_noise": "0.1 m/s"}
SHAKY = {
    "yaw_rate_noise": "0.2 deg/s",
    "acceleration_noise": "0.1 m/s^2",
    "yaw_rate_bias": "0.2 deg/s",
    "acceleration_bias": "0.1 m/s^2",
}
STRAIGHT = drive(200, 20.0)
CURVE = drive(200, 20.0, lambda _: (0.0, 0.02))
BRAKING = drive(200, 20.0, lambda time: (-8.0 if time > 6.0 else 0.0, 0.0))
WINDING = drive(400, 20.0, lambda time: (math.sin(time), 0.01 * math.sin(time)))


def errors(found: Estimated, states: Floats, after: int = 60) -> Floats:
    """Return the errors (N, B, 7) of the estimates from a tick on, each at its own time."""
    ticks = np.round(found.stamps[after:] / STEP).astype(int)
    made: Floats = found.estimates[after:, :, : signals.ESTIMATE_PLACE] - states[ticks]
    return made


PLACE = [signals.EGO_X, signals.EGO_Y, signals.EGO_HEADING, signals.EGO_SPEED]


def greatest(found: Estimated, states: Floats, after: int = 100) -> Floats:
    """Return the greatest error of x, y, heading and speed from a tick on."""
    made: Floats = np.abs(errors(found, states, after)).max(axis=(0, 1))[PLACE]
    return made


@pytest.mark.parametrize(
    ("states", "bound"),
    [(STRAIGHT, 1e-9), (CURVE, 1e-4), (BRAKING, 5e-3), (WINDING, 5e-3)],
    ids=["straight", "curve", "braking", "winding"],
)
def test_without_noise_the_estimate_follows_the_truth(states: Floats, bound: float) -> None:
    for place in ({}, {"x": "0.8 m", "y": "-0.4 m"}):
        found = estimate(states, gnss(mount=place), imu(mount=place))
        assert found.stamps[2:, 0] == pytest.approx(np.arange(2, len(states)) * STEP)
        assert greatest(found, states, after=60).max() < bound, place


def test_acceleration_and_yaw_rate_are_those_of_the_last_period() -> None:
    found = errors(estimate(WINDING, gnss(), imu()), WINDING)
    # Half a period late, in motion with a jerk of 1 m/s³ and 0.15 rad/s².
    assert np.abs(found[:, :, signals.EGO_ACCELERATION]).max() < 1.2 * 0.5 * STEP
    assert np.abs(found[:, :, signals.EGO_YAW_RATE]).max() < 0.15 * STEP
    assert np.abs(found[:, :, signals.EGO_STEERING]).max() < 1e-3


def test_place_on_the_road_belongs_to_the_estimated_pose() -> None:
    found = estimate(WINDING, gnss(**NOISY), imu(**SHAKY))
    rows = found.estimates[-1]
    expected = ego_estimate(straight_road(1), rows[:, : signals.ESTIMATE_PLACE])
    assert rows[:, signals.ESTIMATE_PLACE :] == pytest.approx(expected[:, signals.ESTIMATE_PLACE :])


def test_receiver_alone_follows_at_constant_turn_and_acceleration() -> None:
    found = estimate(WINDING, gnss(), None)
    assert found.stamps[2:, 0] == pytest.approx(np.arange(2, 400) * STEP)
    error = np.abs(errors(found, WINDING)).max(axis=(0, 1))
    assert error[[signals.EGO_X, signals.EGO_Y]].max() < 0.1
    assert error[signals.EGO_HEADING] < 0.02
    assert error[signals.EGO_ACCELERATION] < 0.5


def test_innovations_are_as_large_as_the_filter_expects() -> None:
    found = estimate(WINDING, gnss(**NOISY), imu(**SHAKY), runs=60)
    # Of a chi-squared number with 4 degrees of freedom; two fixes see the same one.
    squares = found.innovations[100::2]
    spread = math.sqrt(8.0 / squares.size)
    assert squares.mean() == pytest.approx(4.0, abs=5.0 * spread)


def test_errors_are_as_large_as_the_filter_believes() -> None:
    found = estimate(WINDING, gnss(**NOISY), imu(**SHAKY), runs=200, latency=0.0)
    # At the ticks of a fix the filter stands at the tick; its place is the rear axle.
    tick = 398
    rear = 0.5 * CAR.wheelbase
    true_y = WINDING[tick, signals.EGO_Y] - rear * np.sin(WINDING[tick, signals.EGO_HEADING])
    share = (found.states[tick, :, 1] - true_y) / found.deviations[tick]
    assert share.mean() == pytest.approx(0.0, abs=4.0 / math.sqrt(200.0))
    assert (share**2).mean() == pytest.approx(1.0, abs=4.0 * math.sqrt(2.0 / 200.0))
    # And better than a fix alone.
    assert found.deviations[tick].max() < 0.5 * 0.3


def test_in_an_outage_the_error_grows_with_the_deviation_and_both_recover() -> None:
    out = {"outages": {"tunnel": {"begin": "5 s", "duration": "4 s"}}}
    states = drive(300, 20.0)
    found = estimate(states, gnss(**NOISY, **out), imu(**SHAKY), runs=100)
    error = found.estimates[:, :, signals.EGO_Y] - states[:, None, signals.EGO_Y]
    before, late, after = (error[tick].std() for tick in (100, 180, 220))
    assert late > 3.0 * before
    assert after < 1.5 * before
    believed = found.deviations[181].mean()
    assert late == pytest.approx(believed, rel=0.25)


def test_dead_receiver_stops_the_estimate_only_when_the_lane_is_in_doubt() -> None:
    states = drive(600, 30.0)
    found = estimate(states, gnss(**NOISY), imu(**SHAKY), blind={0: (100, 600)})
    stamps = found.stamps[:, 0]
    last = int(np.argmax(stamps == stamps[-1]))
    # For seconds it goes on, then it stands still for good.
    assert 100 + 60 < last < 100 + 200
    assert found.deviations[last, 0] < subject.MOST_DEVIATION
    assert found.deviations[last + 15, 0] > subject.MOST_DEVIATION


def test_receiver_whose_bias_is_wider_than_a_lane_gives_no_estimate() -> None:
    found = estimate(STRAIGHT, gnss(bias="1.2 m"), imu())
    assert (found.stamps == -1.0).all()


def test_standing_ego_begins_along_its_lane_and_drives_off() -> None:
    states = drive(300, 0.0, lambda time: (1.5 if time > 5.0 else 0.0, 0.0))
    found = estimate(states, gnss(**NOISY), imu(**SHAKY), runs=20)
    assert (found.stamps[3:] > 0.0).all()
    assert (found.estimates[:, :, signals.EGO_SPEED] >= 0.0).all()
    assert np.abs(errors(found, states, after=250)[:, :, signals.EGO_HEADING]).max() < 0.05


def test_run_does_not_depend_on_the_others() -> None:
    many = estimate(WINDING[:100], gnss(**NOISY), imu(**SHAKY), runs=3)
    one = estimate(WINDING[:100], gnss(**NOISY), imu(**SHAKY), runs=1)
    assert np.array_equal(many.estimates[:, :1], one.estimates)
    assert np.array_equal(many.stamps[:, :1], one.stamps)


def test_only_a_channel_with_a_receiver_and_no_estimate_needs_one() -> None:
    sheets = {kind: {field: np.ones(1) for field in fields} for kind, fields in DATA_SHEETS.items()}
    cases: list[tuple[list[str], list[str | None] | None]] = [
        (["gnss", "imu"], ["gnss", "imu"]),
        (["gnss"], ["gnss", None]),
        (["imu"], None),
        (["radar"], None),
        (["gnss", "imu", "localisation"], None),
        (["gnss", "imu", "ground_truth"], None),
    ]
    for kinds, used in cases:
        context = channel_context(None, links=kinds, sensors={kind: kind for kind in kinds})
        made = subject.Localiser.of(replace(context, data_sheets=sheets))
        assert (None if made is None else [made.gnss, made.imu]) == used


RECEIVER = {
    "latency": "0.1 s",
    "mount": {"x": "0.5 m"},
    "position_noise": "0.05 m",
    "speed_noise": "0.05 m/s",
}
UNIT = {
    "acceleration_noise": "0.05 m/s^2",
    "acceleration_bias": "0.05 m/s^2",
    "yaw_rate_noise": "0.1 deg/s",
    "yaw_rate_bias": "0.1 deg/s",
}


def suite(**changes: Any) -> dict[str, Any]:
    """Return good sensors, the receiver with changes."""
    return {"gnss": gnss(**(RECEIVER | changes)), "imu": imu(**UNIT)}


def offsets(sensors: dict[str, Any], runs: int = 12) -> Floats:
    """Return how far from the centre of its lane the ego comes in each run (B,) [m]."""
    scenario, made = make_scenario(horizon="20 s"), architecture_with(sensors)
    cases = [replace(make_case(scenario, seed=seed), architecture=made) for seed in range(runs)]
    found: Floats = np.nanmax(np.abs(run(cases)["ego_place"][:, :, 5]), axis=1)
    return found


def architecture_with(sensors: dict[str, Any]) -> Architecture:
    content = merged(ARCHITECTURE, {"channels": {"nominal": {"links": list(sensors)}}})
    return Architecture.model_validate({**content, "sensors": sensors})


def test_ego_with_good_sensors_keeps_its_lane_and_with_a_wandering_receiver_leaves_it() -> None:
    assert offsets(suite()).max() < 0.15
    assert offsets({"gnss": suite()["gnss"]}).max() < 0.2
    # A car of 1.9 m crosses the line of a lane of 3.5 m at an offset of 0.8 m.
    assert (offsets(suite(bias="0.8 m", bias_time="10 s")) > 0.8).mean() >= 0.25


def test_ego_keeps_its_lane_through_a_short_outage_only() -> None:
    short, long = (
        offsets(suite(outages={"tunnel": {"begin": "5 s", "duration": duration}})).max()
        for duration in ("2 s", "12 s")
    )
    assert short < 0.3
    assert long > 0.8


def statuses(target: str) -> list[str]:
    """Return the status of the channel at each tick of a run; the target is out from 3 s on."""
    out = FAULT.validate_python(fault("out", target, "drop_out", "3 s"))
    case = replace(
        make_case(make_scenario(horizon="15 s")),
        architecture=architecture_with(suite()),
        faults=(out,),
        fault_entry="out",
    )
    return [signals.STATUS_LABELS[number] for number in run([case])["status"][0, :300, 0]]


def test_channel_without_its_receiver_is_degraded_until_the_lane_is_in_doubt() -> None:
    found = statuses("sensors.gnss")
    assert found[10:60] == ["ok"] * 50
    last = found.index("fault", 10)
    assert found[60:last] == ["degraded"] * (last - 60)
    assert 5.0 < (last - 60) * STEP < 12.0
    assert found[last:] == ["fault"] * (300 - last)


def test_channel_without_its_inertial_unit_has_no_pose_after_half_a_second() -> None:
    # The last sample is of 2.95 s.
    found = statuses("sensors.imu")
    assert found[60:69] == ["degraded"] * 9
    assert found[70:] == ["fault"] * 230


# Fixes that come late, early, between two samples or not at all.

NOISY_FIXES = {"position_noise": "0.2 m", "speed_noise": "0.1 m/s"}
SHAKY_FIXES = {"yaw_rate_noise": "0.3 deg/s", "acceleration_noise": "0.1 m/s^2"}
WINDING_FIXES = drive(200, 20.0, lambda time: (math.sin(time), 0.02 * math.sin(2.0 * time)))


def test_row_with_one_that_is_no_number_is_none() -> None:
    assert subject.is_number(np.array([1.0, 2.0]))
    assert not any(
        subject.is_number(np.array([1.0, wrong])) for wrong in (math.nan, math.inf, -math.inf)
    )


def test_late_fix_gives_the_state_that_a_fix_without_latency_gives() -> None:
    # With the antenna over the rear axle: elsewhere the late fix knows the turn better.
    over_axle = {"x": f"{-0.5 * CAR.wheelbase} m"}
    receiver, unit = gnss(rate="4 Hz", mount=over_axle, **NOISY_FIXES), imu(**SHAKY_FIXES)
    early = estimate(WINDING_FIXES, receiver, unit, latency=0.0)
    late = estimate(WINDING_FIXES, receiver, unit, latency=0.2)
    # After the fix of tick k the one without latency stands there; the other one four ticks later.
    for tick in range(5, 190, 5):
        assert np.array_equal(early.states[tick], late.states[tick + 4])
        assert np.array_equal(early.innovations[tick], late.innovations[tick + 4], equal_nan=True)


def test_estimate_is_of_the_newest_sample_however_late_the_fix() -> None:
    found = estimate(WINDING_FIXES, gnss(), imu(), latency=0.3)
    assert found.stamps[20:, 0] == pytest.approx(np.arange(20, 200) * STEP)


def test_fix_that_is_older_than_the_queue_is_not_used() -> None:
    # Once begun, the filter has gone on beyond its time.
    found = estimate(WINDING_FIXES, gnss(**NOISY_FIXES), imu(), latency=subject.LATEST_FIX + 0.2)
    used = found.innovations[np.isfinite(found.innovations)]
    assert used.size == 0
    assert (found.stamps[20:] > 0.0).all()


def test_fix_between_two_samples_is_used_at_its_time() -> None:
    # The unit samples every fourth tick, the receiver every second.
    found = estimate(WINDING_FIXES, gnss(), imu(rate="5 Hz"), latency=0.1)
    assert (greatest(found, WINDING_FIXES) < [0.05, 0.05, 0.01, 0.1]).all()


def test_fix_that_is_newer_than_all_samples_waits_for_the_unit() -> None:
    found = estimate(WINDING_FIXES, gnss(rate="20 Hz"), imu(), latency=0.0, unit_latency=0.15)
    # The estimate is as old as the newest sample.
    assert found.stamps[50:, 0] == pytest.approx(np.arange(47, 197) * STEP)
    assert (greatest(found, WINDING_FIXES) < [0.01, 0.01, 0.002, 0.02]).all()


def test_one_of_several_fixes_that_come_before_their_sample_is_used() -> None:
    found = estimate(
        WINDING_FIXES, gnss(rate="20 Hz", **NOISY_FIXES), imu(), latency=0.0, unit_latency=0.15
    )
    used = np.diff(found.innovations[60:180, 0]) != 0.0
    # One waits for three ticks, and the next one is that of the tick after: one in four.
    assert used.sum() == pytest.approx(30, abs=1)


def test_dead_unit_stops_the_estimate_and_it_begins_anew_with_it() -> None:
    found = estimate(WINDING_FIXES, gnss(), imu(), blind={1: (100, 140)})
    assert found.stamps[139, 0] == pytest.approx(99 * STEP)
    # The first fix that is newer than the unit's return comes 0.1 s later.
    assert found.stamps[145, 0] == pytest.approx(145 * STEP)
    assert greatest(found, WINDING_FIXES, after=145)[1] < 0.05


def test_dead_receiver_leaves_the_samples_to_go_by() -> None:
    found = estimate(WINDING_FIXES, gnss(), imu(), blind={0: (100, 200)})
    assert found.stamps[100:, 0] == pytest.approx(np.arange(100, 200) * STEP)
    # Without noise the samples alone are nearly enough.
    assert greatest(found, WINDING_FIXES)[1] < 0.1
    assert (np.diff(found.deviations[115:, 0]) > 0.0).all()


# The filter's steps: derivatives, the matrix form of a correction, the first fix.

STATE = np.array([10.0, -4.0, 0.6, 18.0, 0.2, -0.03])
TIME_INERTIAL = 0.05


def record(**changes: float) -> Any:
    fields = {
        "acceleration_density": 0.0,
        "yaw_rate_density": 0.0,
        "acceleration_bias": 0.0,
        "yaw_rate_bias": 0.0,
        "bias_time": 50.0,
        "lever_x": 1.9,
        "lever_y": 0.4,
        "place_variance": 0.09,
        "velocity_variance": 0.01,
    }
    return parameter_record({name: np.array([v]) for name, v in (fields | changes).items()})[0]


def after(state: Floats) -> Floats:
    moved = state.copy()
    subject.predict(
        record(), moved, np.zeros((subject.STATES, subject.STATES)), 1.5, 0.3, TIME_INERTIAL
    )
    return moved


def spread(seed: int = 0) -> Floats:
    """Return a made-up covariance: symmetric and positive."""
    root = np.array([[math.sin(seed + 1.7 * i + 0.9 * j * j) for j in range(6)] for i in range(6)])
    scales = np.diag([1.0, 1.0, 0.05, 0.5, 0.1, 0.02])
    made: Floats = scales @ (root @ root.T + np.eye(6)) @ scales
    return 0.5 * (made + made.T)


def jacobian(function: Any, count: int) -> Floats:
    columns = []
    for index in range(subject.STATES):
        nudge = np.zeros(subject.STATES)
        nudge[index] = 1e-5
        columns.append((function(STATE + nudge) - function(STATE - nudge)) / 2e-5)
    made: Floats = np.array(columns).T
    assert made.shape == (count, subject.STATES)
    return made


def fix_of(state: Floats, rate: float = 0.3) -> Floats:
    """Return the fix without error of a state."""
    c, s = math.cos(state[subject.HEADING]), math.sin(state[subject.HEADING])
    turn = rate - state[subject.YAW_RATE_BIAS]
    arm_x, arm_y = c * 1.9 - s * 0.4, s * 1.9 + c * 0.4
    place = state[subject.X] + arm_x, state[subject.Y] + arm_y
    speed = state[subject.SPEED]
    return np.array([*place, speed * c - turn * arm_y, speed * s + turn * arm_x])


def test_straight_ahead_the_way_is_that_of_constant_acceleration() -> None:
    x, y, heading, speed = subject.carry(1.0, 2.0, 0.0, 10.0, 2.0, 0.0, 3.0)
    assert (x, y, heading, speed) == pytest.approx((1.0 + 39.0, 2.0, 0.0, 16.0))


def test_steady_turn_stays_on_its_circle() -> None:
    # 10 m/s and 0.5 rad/s: a radius of 20 m.
    x, y, heading, speed = 20.0, 0.0, 0.5 * math.pi, 10.0
    for _ in range(200):
        x, y, heading, speed = subject.carry(x, y, heading, speed, 0.0, 0.5, 0.05)
    assert math.hypot(x, y) == pytest.approx(20.0, abs=1e-4)


def test_biases_are_taken_away_and_fade() -> None:
    moved = after(STATE)
    assert moved[subject.SPEED] == pytest.approx(18.0 + (1.5 - 0.2) * TIME_INERTIAL)
    assert moved[subject.HEADING] == pytest.approx(0.6 + (0.3 + 0.03) * TIME_INERTIAL)
    assert moved[subject.ACCELERATION_BIAS] == pytest.approx(0.2 * math.exp(-TIME_INERTIAL / 50.0))


def test_covariance_moves_with_the_derivatives_of_the_state() -> None:
    slopes = jacobian(after, subject.STATES)
    covariance = spread()
    expected = slopes @ covariance @ slopes.T
    subject.predict(record(), STATE.copy(), covariance, 1.5, 0.3, TIME_INERTIAL)
    assert covariance == pytest.approx(expected, rel=1e-5, abs=1e-7)


def test_noise_of_the_unit_adds_to_speed_and_heading_only() -> None:
    covariance, expected = np.zeros((2, subject.STATES, subject.STATES))
    noisy = record(acceleration_density=0.04, yaw_rate_density=0.0003)
    subject.predict(noisy, STATE.copy(), covariance, 0.0, 0.0, TIME_INERTIAL)
    for row, density in ((subject.SPEED, 0.04), (subject.HEADING, 0.0003)):
        expected[row, row] = density * TIME_INERTIAL
    assert covariance == pytest.approx(expected)


def test_bias_that_is_as_unknown_as_ever_stays_so() -> None:
    covariance = np.zeros((subject.STATES, subject.STATES))
    covariance[subject.YAW_RATE_BIAS, subject.YAW_RATE_BIAS] = 0.02**2
    for _ in range(40):
        subject.predict(
            record(yaw_rate_bias=0.02, bias_time=3.0), STATE.copy(), covariance, 0, 0, TIME_INERTIAL
        )
    assert covariance[subject.YAW_RATE_BIAS, subject.YAW_RATE_BIAS] == pytest.approx(0.02**2)


def test_correction_is_that_of_the_matrix_form() -> None:
    slopes = jacobian(fix_of, 4)
    covariance, state = spread(3), STATE.copy()
    rest = np.array([0.4, -0.3, 0.15, 0.2])
    noise = np.diag([0.09, 0.09, 0.01, 0.01])
    expected = slopes @ covariance @ slopes.T + noise
    gain = covariance @ slopes.T @ np.linalg.inv(expected)
    wanted_state = state + gain @ rest
    wanted = covariance - gain @ slopes @ covariance
    scratch = np.full(subject.SCRATCH, 77.0)
    total = subject.correct(record(), state, covariance, fix_of(STATE) + rest, 0.3, scratch)
    assert state == pytest.approx(wanted_state, rel=1e-6)
    assert covariance == pytest.approx(wanted, rel=1e-6, abs=1e-9)
    assert np.array_equal(covariance, covariance.T)
    assert total == pytest.approx(rest @ np.linalg.inv(expected) @ rest, rel=1e-6)


def test_fix_that_is_as_expected_changes_no_state() -> None:
    state, covariance, scratch = STATE.copy(), spread(), np.zeros(subject.SCRATCH)
    before = np.diag(covariance).copy()
    assert subject.correct(record(), state, covariance, fix_of(STATE), 0.3, scratch) < 1e-20
    assert state == pytest.approx(STATE)
    assert (np.diag(covariance) < before).all()


def begun(fix: Floats, rate: float = 0.0, **changes: float) -> tuple[Floats, Floats]:
    state, covariance = np.full(subject.STATES, 9.0), np.full((subject.STATES, subject.STATES), 9.0)
    subject.begin(record(**changes), straight_road().segments[0], state, covariance, fix, rate)
    return state, covariance


def test_moving_ego_heads_where_it_moves_and_slips_with_the_turn() -> None:
    wanted = np.array([3.0, 5.0, 0.4, 20.0, 0.0, 0.0])
    state, covariance = begun(fix_of(wanted, 0.2), 0.2)
    # The slip is taken as a small angle.
    assert state == pytest.approx(wanted, abs=2e-3)
    assert covariance[subject.HEADING, subject.HEADING] == pytest.approx(
        subject.COURSE**2 + 0.01 / 20.0**2, rel=0.01
    )


@pytest.mark.slow
def test_first_state_knows_the_antenna_as_well_as_the_fix_whatever_its_heading() -> None:
    state, covariance = begun(np.array([50.0, 5.0, 0.0, 0.0]), bias=0.0)
    slopes = np.zeros((2, subject.STATES))
    slopes[0, subject.X] = slopes[1, subject.Y] = 1.0
    c, s = math.cos(state[subject.HEADING]), math.sin(state[subject.HEADING])
    slopes[0, subject.HEADING], slopes[1, subject.HEADING] = -(s * 1.9 + c * 0.4), c * 1.9 - s * 0.4
    assert slopes @ covariance @ slopes.T == pytest.approx(0.09 * np.eye(2))


def test_lateral_deviation_is_what_it_is_after_the_way() -> None:
    # Carried on for half a second, the covariance says the same as the shortcut.
    state, covariance = np.array([0.0, 0.0, 0.7, 20.0, 0.0, 0.0]), spread(5)
    covariance[subject.YAW_RATE_BIAS] = covariance[:, subject.YAW_RATE_BIAS] = 0.0
    covariance[subject.YAW_RATE_BIAS, subject.YAW_RATE_BIAS] = 0.01**2
    ahead = subject.lateral_variance(state, covariance, 0.0, 0.5)
    subject.predict(record(bias_time=1e6), state, covariance, 0.0, 0.0, 0.5)
    assert subject.lateral_variance(state, covariance, 0.0, 0.0) == pytest.approx(ahead, rel=1e-6)


@pytest.mark.parametrize("turn", [0.4, -1.1, 2.5])
def test_unsureness_across_the_heading_does_not_depend_on_where_north_is(turn: float) -> None:
    state, places = np.zeros(subject.STATES), [subject.X, subject.Y]
    state[subject.HEADING], state[subject.SPEED] = 0.3, 12.0
    root = np.random.default_rng(5).normal(size=(subject.STATES, subject.STATES))
    covariance = root @ root.T
    turned, other = np.eye(subject.STATES), state.copy()
    cosine, sine = math.cos(turn), math.sin(turn)
    turned[np.ix_(places, places)] = [[cosine, -sine], [sine, cosine]]
    other[subject.HEADING] += turn
    expected = subject.lateral_variance(state, covariance, 1.3, 0.2)
    found = subject.lateral_variance(other, turned @ covariance @ turned.T, 1.3, 0.2)
    assert found == pytest.approx(expected, rel=1e-9)
