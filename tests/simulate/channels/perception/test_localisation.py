"""Where the ego is by satellite and inertia: without error, with noise, in an outage, in a loop."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.signals import (
    EGO_ACCELERATION,
    EGO_HEADING,
    EGO_SPEED,
    EGO_STEERING,
    EGO_X,
    EGO_Y,
    EGO_YAW_RATE,
    ESTIMATE_PLACE,
    STATUS_LABELS,
    Floats,
)
from adeye.simulate.channels.perception.localisation import MOST_DEVIATION, Localiser
from adeye.simulate.engine import run
from adeye.simulate.sensors.rig import DATA_SHEETS
from adeye.spec.architecture import Architecture
from adeye.spec.fault import FAULT
from adeye.testing.scenes import channel_context, ego_estimate, straight_road
from tests.motorway import ARCHITECTURE, make_case, make_scenario, merged
from tests.simulate.channels.egos import CAR, STEP, Estimated, drive, estimate, gnss, imu

if TYPE_CHECKING:
    from adeye.sweep.case import TestCase

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
    made: Floats = found.estimates[after:, :, :ESTIMATE_PLACE] - states[ticks]
    return made


@pytest.mark.slow
@pytest.mark.parametrize(
    ("states", "bound"),
    [(STRAIGHT, 1e-9), (CURVE, 1e-4), (BRAKING, 5e-3), (WINDING, 5e-3)],
    ids=["straight", "curve", "braking", "winding"],
)
@pytest.mark.parametrize("place", [{}, {"x": "0.8 m", "y": "-0.4 m"}], ids=["middle", "corner"])
def test_without_noise_the_estimate_follows_the_truth(
    states: Floats, bound: float, place: dict[str, str]
) -> None:
    found = estimate(states, gnss(mount=place), imu(mount=place))
    assert found.stamps[2:, 0] == pytest.approx(np.arange(2, len(states)) * STEP)
    error = np.abs(errors(found, states)).max(axis=(0, 1))
    assert error[[EGO_X, EGO_Y, EGO_HEADING, EGO_SPEED]].max() < bound


def test_acceleration_and_yaw_rate_are_those_of_the_last_period() -> None:
    found = errors(estimate(WINDING, gnss(), imu()), WINDING)
    # Half a period late, in motion with a jerk of 1 m/s³ and 0.15 rad/s².
    assert np.abs(found[:, :, EGO_ACCELERATION]).max() < 1.2 * 0.5 * STEP
    assert np.abs(found[:, :, EGO_YAW_RATE]).max() < 0.15 * STEP
    assert np.abs(found[:, :, EGO_STEERING]).max() < 1e-3


def test_place_on_the_road_belongs_to_the_estimated_pose() -> None:
    found = estimate(WINDING, gnss(**NOISY), imu(**SHAKY))
    rows = found.estimates[-1]
    expected = ego_estimate(straight_road(1), rows[:, :ESTIMATE_PLACE])
    assert rows[:, ESTIMATE_PLACE:] == pytest.approx(expected[:, ESTIMATE_PLACE:])


@pytest.mark.slow
def test_receiver_alone_follows_at_constant_turn_and_acceleration() -> None:
    found = estimate(WINDING, gnss(), None)
    assert found.stamps[2:, 0] == pytest.approx(np.arange(2, 400) * STEP)
    error = np.abs(errors(found, WINDING)).max(axis=(0, 1))
    assert error[[EGO_X, EGO_Y]].max() < 0.1
    assert error[EGO_HEADING] < 0.02
    assert error[EGO_ACCELERATION] < 0.5


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
    true_y = WINDING[tick, EGO_Y] - rear * np.sin(WINDING[tick, EGO_HEADING])
    share = (found.states[tick, :, 1] - true_y) / found.deviations[tick]
    assert share.mean() == pytest.approx(0.0, abs=4.0 / math.sqrt(200.0))
    assert (share**2).mean() == pytest.approx(1.0, abs=4.0 * math.sqrt(2.0 / 200.0))
    # And better than a fix alone.
    assert found.deviations[tick].max() < 0.5 * 0.3


def test_estimate_learns_the_bias_of_the_yaw_rate() -> None:
    found = estimate(WINDING, gnss(**NOISY), imu(yaw_rate_bias="1 deg/s"), runs=50)
    error = np.abs(errors(found, WINDING, after=300)[:, :, EGO_YAW_RATE] - 0.0)
    assert np.median(error) < 0.3 * math.radians(1.0)


def test_in_an_outage_the_error_grows_with_the_deviation_and_both_recover() -> None:
    out = {"outages": {"tunnel": {"begin": "5 s", "duration": "4 s"}}}
    states = drive(300, 20.0)
    found = estimate(states, gnss(**NOISY, **out), imu(**SHAKY), runs=100)
    error = found.estimates[:, :, EGO_Y] - states[:, None, EGO_Y]
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
    assert found.deviations[last, 0] < MOST_DEVIATION
    assert found.deviations[last + 15, 0] > MOST_DEVIATION


def test_better_unit_lasts_longer() -> None:
    states = drive(600, 30.0)

    def lasts(unit: dict[str, str]) -> float:
        found = estimate(states, gnss(**NOISY), imu(**unit), blind={0: (100, 600)})
        return float(found.stamps[-1, 0])

    worse = SHAKY | {"yaw_rate_noise": "1 deg/s", "yaw_rate_bias": "1 deg/s"}
    assert lasts(SHAKY) > 1.5 * lasts(worse) - 5.0 > 0.0


def test_receiver_whose_bias_is_wider_than_a_lane_gives_no_estimate() -> None:
    found = estimate(STRAIGHT, gnss(bias="1.2 m"), imu())
    assert (found.stamps == -1.0).all()


def test_standing_ego_begins_along_its_lane_and_drives_off() -> None:
    states = drive(300, 0.0, lambda time: (1.5 if time > 5.0 else 0.0, 0.0))
    found = estimate(states, gnss(**NOISY), imu(**SHAKY), runs=20)
    assert (found.stamps[3:] > 0.0).all()
    assert (found.estimates[:, :, EGO_SPEED] >= 0.0).all()
    assert np.abs(errors(found, states, after=250)[:, :, EGO_HEADING]).max() < 0.05


def test_run_does_not_depend_on_the_others() -> None:
    many = estimate(WINDING[:100], gnss(**NOISY), imu(**SHAKY), runs=3)
    one = estimate(WINDING[:100], gnss(**NOISY), imu(**SHAKY), runs=1)
    assert np.array_equal(many.estimates[:, :1], one.estimates)
    assert np.array_equal(many.stamps[:, :1], one.stamps)


@pytest.mark.parametrize(
    ("kinds", "used"),
    [
        (["gnss", "imu"], ["gnss", "imu"]),
        (["gnss"], ["gnss", None]),
        (["imu"], None),
        (["radar"], None),
        (["gnss", "imu", "localisation"], None),
        (["gnss", "imu", "ground_truth"], None),
    ],
)
def test_only_a_channel_with_a_receiver_and_no_estimate_needs_one(
    kinds: list[str], used: list[str | None] | None
) -> None:
    context = channel_context(None, links=kinds, sensors={kind: kind for kind in kinds})
    sheets = {kind: {field: np.ones(1) for field in fields} for kind, fields in DATA_SHEETS.items()}
    made = Localiser.of(replace(context, data_sheets=sheets))
    assert (None if made is None else [made.gnss, made.imu]) == used


GOOD: dict[str, Any] = {
    "gnss": {
        "kind": "gnss",
        "rate": "10 Hz",
        "latency": "0.1 s",
        "mount": {"x": "0.5 m"},
        "position_noise": "0.05 m",
        "speed_noise": "0.05 m/s",
    },
    "imu": {
        "kind": "imu",
        "rate": "20 Hz",
        "acceleration_noise": "0.05 m/s^2",
        "acceleration_bias": "0.05 m/s^2",
        "yaw_rate_noise": "0.1 deg/s",
        "yaw_rate_bias": "0.1 deg/s",
    },
}


def offsets(sensors: dict[str, Any], runs: int = 12, **world: Any) -> Floats:
    """Return how far from the centre of its lane the ego comes in each run (B,) [m]."""
    architecture = merged(ARCHITECTURE, {"channels": {"nominal": {"links": list(sensors)}}})
    architecture["sensors"] = sensors
    scenario = make_scenario(horizon="20 s", **world)
    cases: list[TestCase] = [
        replace(
            make_case(scenario, seed=seed), architecture=Architecture.model_validate(architecture)
        )
        for seed in range(runs)
    ]
    trace = run(cases)
    found: Floats = np.nanmax(np.abs(trace["ego_place"][:, :, 5]), axis=1)
    return found


def test_ego_with_good_sensors_keeps_its_lane() -> None:
    assert offsets(GOOD).max() < 0.15


def test_ego_with_a_good_receiver_alone_keeps_its_lane() -> None:
    assert offsets({"gnss": GOOD["gnss"]}).max() < 0.2


def test_ego_with_a_wandering_receiver_leaves_its_lane() -> None:
    # A car of 1.9 m crosses the line of a lane of 3.5 m at an offset of 0.8 m.
    bad = GOOD | {"gnss": GOOD["gnss"] | {"bias": "0.8 m", "bias_time": "10 s"}}
    assert (offsets(bad) > 0.8).mean() >= 0.25


@pytest.mark.slow
def test_ego_keeps_its_lane_through_a_short_outage_only() -> None:
    def through(duration: str) -> Floats:
        outages = {"tunnel": {"begin": "5 s", "duration": duration}}
        return offsets(GOOD | {"gnss": GOOD["gnss"] | {"outages": outages}})

    assert through("2 s").max() < 0.3
    assert through("12 s").max() > 0.8


def statuses(target: str) -> list[str]:
    """Return the status of the channel at each tick of a run; the target is out from 3 s on."""
    fault = FAULT.validate_python(
        {"id": "out", "target": target, "model": "drop_out", "onset": {"at": "3 s"}}
    )
    architecture = merged(ARCHITECTURE, {"channels": {"nominal": {"links": list(GOOD)}}})
    case = replace(
        make_case(make_scenario(horizon="15 s")),
        architecture=Architecture.model_validate({**architecture, "sensors": GOOD}),
        faults=(fault,),
        fault_entry="out",
    )
    return [STATUS_LABELS[number] for number in run([case])["status"][0, :300, 0]]


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
