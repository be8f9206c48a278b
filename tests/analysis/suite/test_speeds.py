"""How fast a suite lets the ego go: waits, needed ranges, the table of UN R157."""

import math
from itertools import product
from typing import Any

import numpy as np
import pytest

from adeye.analysis.suite import speeds as suite_speeds
from adeye.analysis.suite.conditions import CASES, DEFAULTS, Condition
from adeye.analysis.suite.geometry import Reach, view_of
from adeye.analysis.suite.records import Chain, SpeedRange
from adeye.kernel.criticality import stopping_distance
from adeye.kernel.motion import GRAVITY
from tests.analysis.suite.rigs import BUMPER, FRONT, architecture, radar
from tests.stored import known

DRY, WET, NIGHT = DEFAULTS
STOPPED, SLOWER, CROSSING = CASES
STEP = 0.1 / 3.6


def path(far: float = 100.0, near: float = 0.0, **changes: Any) -> suite_speeds.Path:
    built = architecture({"eye": radar(**changes)})
    (chain,) = suite_speeds.chains_of(built)
    reaches = {
        (condition.id, kind): Reach(near, far)
        for condition in DEFAULTS
        for kind in ("car", "pedestrian")
    }
    return suite_speeds.Path(chain, view_of(built.sensors["eye"], built.vehicle), reaches)


def highest(one: suite_speeds.Path, case: Any = STOPPED, condition: Condition = DRY) -> SpeedRange:
    return suite_speeds.speed_range(
        [one], [suite_speeds.supported(one, condition, case, FRONT)], condition, case
    )


def test_highest_speed_solves_the_quadratic() -> None:
    for condition, far in product((DRY, WET), (40.0, 100.0, 180.0)):
        one = path(far)
        delay, braking = one.chain.total_s, suite_speeds.braking_of(one.chain, condition)
        room = far - suite_speeds.MARGIN
        exact = braking * (math.sqrt(delay**2 + 2.0 * room / braking) - delay)
        assert exact - STEP < highest_mps(one, condition=condition) <= exact + 1e-9


def highest_mps(one: suite_speeds.Path, case: Any = STOPPED, condition: Condition = DRY) -> float:
    return known(highest(one, case, condition).highest_mps)


def test_slower_car_allows_its_own_speed_more() -> None:
    more = highest_mps(path(), SLOWER) - highest_mps(path())
    assert more == pytest.approx(60.0 / 3.6, abs=2.0 * STEP)


def test_wide_sensor_sees_the_crossing_pedestrian_almost_as_far_as_the_car() -> None:
    wide = path(field_of_view=3.0)
    ahead = highest_mps(wide)
    assert 0.97 * ahead < highest_mps(wide, CROSSING) <= ahead


def test_pedestrian_of_a_slow_ego_comes_from_outside_a_narrow_field_of_view() -> None:
    half = math.radians(10.0)
    found = highest(path(field_of_view=2.0 * half), CROSSING)
    # He stays at one bearing from the front of the ego, where this sensor sits: tan = his / mine.
    assert found.lowest_mps == pytest.approx((5.0 / 3.6) / math.tan(half), abs=STEP)


def test_both_sides_must_be_seen() -> None:
    for yaw, is_seen in ((0.19, False), (0.0, True)):
        one = path(field_of_view=0.4, mount={**BUMPER, "yaw": yaw})
        left = suite_speeds.slacks_at(one, DRY, CROSSING, np.array([10.0]), FRONT)[1]
        assert bool(np.isfinite(left[0])) is is_seen
        assert is_seen or np.isneginf(left[0])


def test_sensor_that_looks_back_supports_no_speed_and_has_no_slack() -> None:
    back = path(mount={**BUMPER, "x": -FRONT, "yaw": math.pi})
    found = highest(back)
    assert (found.highest_mps, found.lowest_mps, found.sensor) == (None, None, "")
    assert suite_speeds.speed_range([], [], DRY, STOPPED).highest_mps is None
    slack = suite_speeds.slack_at([back], DRY, STOPPED, 20.0, FRONT)
    assert (slack.need_m, slack.slack_m, slack.sensor) == (None, None, "")


def test_range_that_never_ends_is_marked_as_the_limit_of_the_search() -> None:
    found = highest(path(5000.0))
    assert found.is_limit
    assert found.highest_mps == pytest.approx(250.0 / 3.6)


def test_gap_between_two_sensors_is_where_the_supported_speeds_begin() -> None:
    near, far = path(40.0), path(200.0, near=90.0)
    oks = [suite_speeds.supported(one, DRY, STOPPED, FRONT) for one in (near, far)]
    assert oks[1].any()
    both = suite_speeds.speed_range([near, far], oks, DRY, STOPPED)
    assert both.highest_mps == highest(far).highest_mps
    assert both.lowest_mps == highest(far).lowest_mps
    assert known(both.lowest_mps) > highest_mps(near) + STEP


def test_last_run_begins_after_the_gap() -> None:
    assert suite_speeds.last_run(np.array([True, True, False, True, True, False])) == (3, 4)
    assert suite_speeds.last_run(np.array([True, True])) == (0, 1)
    assert suite_speeds.last_run(np.zeros(3, dtype=np.bool_)) is None


def test_slack_is_range_less_need_and_of_the_best_chain() -> None:
    short, long = path(60.0), path(100.0)
    found = suite_speeds.slack_at([short, long], DRY, STOPPED, 20.0, FRONT)
    assert known(found.slack_m) == pytest.approx(100.0 - known(found.need_m))
    assert known(found.slack_m) > 0.0
    assert known(suite_speeds.slack_at([long], DRY, STOPPED, 60.0, FRONT).slack_m) < 0.0


def test_supported_speeds_are_those_with_slack() -> None:
    one = path(80.0)
    ok = suite_speeds.supported(one, WET, STOPPED, FRONT)
    for place in range(0, len(suite_speeds.SPEEDS), 157):
        speed = float(suite_speeds.SPEEDS[place])
        slack = suite_speeds.slack_at([one], WET, STOPPED, speed, FRONT).slack_m
        assert bool(ok[place]) is (known(slack) >= 0.0)


def test_forward_range_counts_from_the_front() -> None:
    back = path(100.0, mount={"x": 0.0, "y": 0.0, "z": 2.0})
    found = suite_speeds.forward_range([back], DRY, FRONT, None)
    assert found.range_m == pytest.approx(100.0 - FRONT)
    assert found.needed_m is None
    aside = path(100.0, mount={"x": FRONT, "y": 0.6, "z": 2.0})
    straight = suite_speeds.forward_range([aside], DRY, FRONT, None).range_m
    assert straight == pytest.approx(math.sqrt(100.0**2 - 0.6**2))


def test_forward_range_meets_the_regulation_or_not() -> None:
    found = suite_speeds.forward_range([path(149.9)], DRY, FRONT, 130.0 / 3.6)
    assert found.range_m < known(found.needed_m) == 150.0
    assert known(found.speed_mps) < 130.0 / 3.6


def test_sensor_that_looks_aside_has_no_forward_range() -> None:
    aside = path(100.0, field_of_view=0.5, mount={**BUMPER, "yaw": 1.0})
    found = suite_speeds.forward_range([aside], DRY, FRONT, None)
    assert (found.range_m, found.sensor, found.speed_mps) == (0.0, "", None)
    short = path(1.0, mount={"x": -2.0, "y": 0.0, "z": 2.0})
    assert suite_speeds.forward_range([short], DRY, FRONT, None).range_m == 0.0


def chain(sensor: dict[str, Any] | None = None, **changes: Any) -> Chain:
    (found,) = suite_speeds.chains_of(architecture({"eye": sensor or radar()}, **changes))
    return found


def channel(**content: Any) -> dict[str, Any]:
    return {"nominal": {"kind": "nominal", "links": ["eye"], "rate": 20.0, **content}}


def test_waits_of_the_built_in_nominal_channel() -> None:
    found = chain(radar(rate=10.0, latency=0.1, jitter=0.02))
    waits = [found.sense_s, found.confirm_s, found.decide_s, found.act_s]
    assert waits == pytest.approx([0.1 + 0.1 + 0.02, 2 * 0.1, 0.05 + 0.05, 0.15])
    assert found.total_s == pytest.approx(0.67)
    assert not found.is_assumed
    # The first hit confirms where one is enough, and without a link there is no chain.
    assert chain(channels=channel(parameters={"confirm_hits": 1})).confirm_s == 0.0
    assert (
        list(suite_speeds.chains_of(architecture({"eye": radar()}, channels=channel(links=[]))))
        == []
    )


def test_brakes_are_as_weak_as_the_weakest_of_channel_vehicle_and_grip() -> None:
    strong = chain(channels=channel(parameters={"emergency_deceleration": 20.0}))
    weak = chain(channels=channel(parameters={"emergency_deceleration": 3.0}))
    ice = Condition("ice", 0.0, 1e4, "day", 0.2)
    assert suite_speeds.braking_of(strong, Condition("track", 0.0, 1e4, "day", 2.0)) == 9.0
    assert suite_speeds.braking_of(weak, DRY) == 3.0
    assert suite_speeds.braking_of(strong, ice) == pytest.approx(0.2 * GRAVITY)


def test_safety_channel_waits_for_its_monitor_and_for_the_switch() -> None:
    parameters = {"confirm": 0.2, "emergency_deceleration": 7.0}
    channels = {
        "nominal": {"kind": "nominal", "links": [], "rate": 20.0},
        "safety": {"kind": "safety", "links": ["eye"], "rate": 10.0, "parameters": parameters},
    }
    order = {"policy": "fixed_priority", "priority": ["safety", "nominal"], "default": "nominal"}
    found = chain(channels=channels, switch={**order, "debounce": 0.3, "handover": 0.1})
    assert found.confirm_s == pytest.approx((suite_speeds.SAFETY_HITS - 1) * 0.05 + 0.2)
    assert found.decide_s == pytest.approx(0.1 + 0.3 + 0.1)
    assert found.deceleration_mps2 == 7.0


def test_plug_in_channel_is_assumed_to_be_like_the_built_in_unless_it_tells() -> None:
    plugin = {"own": {"kind": "./own.py:Own", "links": ["eye"], "rate": 20.0}}
    switch = {"policy": "fixed_priority", "priority": ["own"], "default": "own"}
    silent = chain(channels=plugin, switch=switch)
    assert silent.is_assumed
    assert [silent.confirm_s, silent.deceleration_mps2] == pytest.approx([0.1, 8.0])
    told = {"confirm_hits": 5, "emergency_deceleration": 6.0, "name": "x", "is_fast": True}
    plugin["own"]["parameters"] = told
    found = chain(channels=plugin, switch=switch)
    assert not found.is_assumed
    assert [found.confirm_s, found.deceleration_mps2] == pytest.approx([0.2, 6.0])


def test_needed_range_is_the_stopping_distance_and_the_margin() -> None:
    found = chain()
    speeds = np.array([-3.0, 10.0, 30.0])
    need = suite_speeds.needed_ranges_of(found, DRY, speeds)
    braking = suite_speeds.braking_of(found, DRY)
    assert need[0] == suite_speeds.MARGIN
    for speed, value in zip(speeds[1:], need[1:], strict=True):
        assert value == stopping_distance(speed, found.total_s, braking) + suite_speeds.MARGIN


GIVEN = {60: 46, 70: 50, 80: 60, 90: 75, 100: 90, 110: 110, 120: 130, 130: 150}


def test_table_is_that_of_the_regulation_with_speed_the_inverse_of_range() -> None:
    assert {round(speed * 3.6): distance for speed, distance in suite_speeds.TABLE} == GIVEN
    for speed, distance in {**GIVEN, 125: 140}.items():
        assert suite_speeds.least_forward_range(speed / 3.6) == pytest.approx(distance)
        assert suite_speeds.speed_by_range(distance) == pytest.approx(speed / 3.6)
    # From 90 km/h on it is about half a second and 5 m/s².
    for speed in (90, 100, 110, 120, 130):
        assert stopping_distance(speed / 3.6, 0.5, 5.0) == pytest.approx(GIVEN[speed], abs=2.5)


def test_below_the_table_its_least_range_holds_and_above_there_is_none() -> None:
    assert suite_speeds.least_forward_range(5.0) == 46.0
    assert suite_speeds.least_forward_range(131.0 / 3.6) is None
    assert suite_speeds.speed_by_range(45.9) is None
    assert suite_speeds.speed_by_range(1000.0) == pytest.approx(130.0 / 3.6)
