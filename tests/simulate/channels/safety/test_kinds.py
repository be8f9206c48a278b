"""Every kind of monitor: a scene where it fires, one where it does not, and no number fires."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from adeye.signals import FAULT, OK, ControlCommand, Floats
from adeye.simulate.channels.links import observe
from adeye.simulate.channels.safety import SupervisedSafetyChannel
from adeye.simulate.channels.safety import supervisor as kinds
from adeye.testing import channel_context
from adeye.testing.scenes import object_measurement, straight_road
from tests.simulate.channels.safety.supervised import parameters

LINKS = ("truth", "channels.nominal", "health.front")
MIDDLE = 5.25

Scene = dict[str, Any]
Numbers = Callable[[float], float]


USUAL: Scene = {
    "d": MIDDLE,
    "speed": 20.0,
    "yaw_rate": 0.0,
    "objects": [],
    "acceleration": 0.0,
    "steering": 0.0,
    "status": OK,
    "age": 0.05,
    "sample_age": 0.0,
    "alive": True,
    "estimate": 0.0,
}


def fires(monitor: Scene, scene: Scene | None = None, ticks: int = 8) -> bool:
    """Show a scene for some ticks, and tell whether the monitor fires at the last one."""
    scene = USUAL | (scene or {})
    item = parameters({"m": monitor}, rate="20 Hz")
    channel, road = SupervisedSafetyChannel(item), straight_road()
    channel.reset(channel_context(item, links=LINKS, sensors={"truth": "ground_truth"}))
    for tick in range(ticks):
        time = 0.05 * tick
        told: dict[str, Any] = {
            name: value(time) if callable(value) else value for name, value in scene.items()
        }
        ego = np.zeros((1, 7))
        ego[0, [0, 1, 3]] = told["speed"] * time, told["d"], told["speed"]
        ego[0, 6] = told["yaw_rate"]
        rows = [[ego[0, 0] + ahead, d, 0.0, speed, 0.0] for ahead, d, speed in told["objects"]]
        objects = np.array(rows, dtype=np.float64).reshape(1, -1, 5)
        truth = object_measurement(ego, objects, time, road=road)
        assert truth.estimate is not None
        truth.estimate += told["estimate"]
        front = object_measurement(ego, objects, time - told["sample_age"])
        front.alive[:] = told["alive"]
        numbers = told["acceleration"], told["steering"], time - told["age"], told["status"]
        command = ControlCommand("nominal", *(np.array([number]) for number in numbers))
        commands = {"nominal": command} if tick else {}
        readings, running = {"truth": truth, "front": front}, np.ones(1, dtype=np.bool_)
        seen = observe(LINKS, time, readings, commands, None, running, protect=False)
        answer = channel.act(seen)
    assert answer.monitors is not None
    return bool(answer.monitors[0, 0, 0])


NAN = float("nan")
SILENT = {"kind": "channel_silent", "watches": ["nominal"], "timeout": "0.1 s"}
WRONG = {"kind": "channel_implausible", "watches": ["nominal"]}
STUCK = {"kind": "channel_stuck", "watches": ["nominal"], "timeout": "0.2 s"}
SENSOR = {"kind": "sensor_silent", "watches": ["front"]}
AREA = {"kind": "critical_area"}
RSS = {"kind": "rss_danger"}
ODD = {"kind": "odd_exit"}


def from_0_2(value: float, before: float = 0.0) -> Numbers:
    return lambda time: value if time > 0.2 else before


def alternating(size: float) -> Numbers:
    return lambda time: size if round(time / 0.05) % 2 else -size


FIRES: list[tuple[Scene, Scene, bool]] = [
    (SILENT, {}, False),
    (SILENT, {"age": 0.1}, False),
    (SILENT, {"age": 0.15}, True),
    (SILENT, {"age": from_0_2(NAN, 0.05)}, True),
    (SILENT, {"status": from_0_2(FAULT, OK)}, True),
    (WRONG, {}, False),
    (WRONG, {"acceleration": -8.0}, False),
    (WRONG, {"acceleration": -10.1}, True),
    (WRONG, {"acceleration": NAN}, True),
    (WRONG, {"steering": NAN}, True),
    # 20 m/s and 1.5 m/s² on a wheelbase of 2.9 m.
    (WRONG, {"steering": 0.0109}, False),
    (WRONG, {"steering": float(np.degrees(0.0109))}, True),
    (WRONG, {"speed": 2.0, "steering": 0.5}, False),
    (WRONG, {"speed": 2.0, "steering": 0.7}, True),
    (WRONG, {"yaw_rate": 0.15}, False),
    (WRONG, {"yaw_rate": 0.25}, True),
    (WRONG, {"acceleration": alternating(4.0)}, False),
    (WRONG | {"max_jerk": "100 m/s^3"}, {"acceleration": alternating(4.0)}, True),
    (WRONG, {"speed": 0.0, "steering": alternating(0.1)}, False),
    (WRONG, {"speed": 0.0, "steering": alternating(0.2)}, True),
    (STUCK, {}, True),
    (STUCK, {"speed": 0.5}, False),
    (STUCK | {"min_speed": "0 m/s"}, {"speed": 0.5}, True),
    (STUCK, {"steering": alternating(1e-12)}, False),
    (STUCK, {"acceleration": alternating(1e-12)}, False),
    (STUCK, {"acceleration": NAN, "speed": 0.5}, True),
    (STUCK | {"timeout": "30 s"}, {}, False),
    (SENSOR, {}, False),
    (SENSOR, {"alive": lambda time: time < 0.2}, True),
    (SENSOR, {"sample_age": 0.3}, False),
    (SENSOR | {"max_age": "0.2 s"}, {"sample_age": 0.2}, False),
    (SENSOR | {"max_age": "0.2 s"}, {"sample_age": 0.3}, True),
    (SENSOR, {"sample_age": from_0_2(NAN)}, True),
    ({"kind": "off_road"}, {"d": -2.4}, False),
    ({"kind": "off_road"}, {"d": -2.6}, True),
    ({"kind": "off_road", "margin": "0.2 m"}, {"d": -2.6}, False),
    ({"kind": "off_road"}, {"d": 10.6}, True),
    ({"kind": "lane_departure"}, {"d": MIDDLE + 0.9}, False),
    ({"kind": "lane_departure"}, {"d": MIDDLE + 1.1}, True),
    ({"kind": "lane_departure"}, {"d": -0.5}, True),
    ({"kind": "object_danger"}, {"objects": [(80.0, MIDDLE, 0.0)]}, False),
    ({"kind": "object_danger"}, {"objects": [(40.0, MIDDLE, 0.0)]}, True),
    # 20 m ahead of the front of the ego, whose width is 1.9 m.
    (AREA, {"objects": [(24.0, MIDDLE, 20.0)]}, True),
    (AREA, {"objects": [(25.5, MIDDLE, 20.0)]}, False),
    (AREA | {"time": "1.2 s"}, {"objects": [(25.5, MIDDLE, 20.0)]}, True),
    (AREA, {"objects": [(10.0, MIDDLE + 1.9, 20.0)]}, True),
    (AREA, {"objects": [(10.0, MIDDLE + 2.2, 20.0)]}, False),
    (AREA | {"width_factor": 1.5}, {"objects": [(10.0, MIDDLE + 2.2, 20.0)]}, True),
    (AREA, {"objects": [(-8.0, MIDDLE, 20.0)]}, False),
    # 0.5 s, 1.5 and 6 against 8 m/s²: 21.1 m and the lengths of the two.
    (RSS, {"objects": [(23.0, MIDDLE, 20.0)]}, True),
    (RSS, {"objects": [(30.0, MIDDLE, 20.0)]}, False),
    (RSS, {"objects": [(30.0, MIDDLE, 15.0)]}, True),
    (RSS | {"least_braking": "4 m/s^2"}, {"objects": [(30.0, MIDDLE, 20.0)]}, True),
    (ODD | {"max_speed": "20.1 m/s"}, {}, False),
    (ODD | {"max_speed": "19.9 m/s"}, {}, True),
    (ODD | {"to_s": "5 m"}, {}, True),
    (ODD | {"from_s": "1 m", "to_s": "50 m"}, {}, False),
    (ODD | {"from_s": "50 m"}, {}, True),
    (ODD | {"to_d": "3.5 m"}, {}, True),
    (ODD | {"from_d": "3.5 m", "to_d": "7 m"}, {}, False),
    ({"kind": "last_safe_stop"}, {}, False),
    (
        {"kind": "last_safe_stop"},
        {"objects": [(22.0, 1.75 + 3.5 * x, 0.0) for x in range(3)] + [(22.0, -1.25, 0.0)]},
        True,
    ),
]
"""Monitors, what they are shown, and whether they fire."""


@pytest.mark.parametrize("case", FIRES)
def test_fires_where_it_should_and_nowhere_else(case: tuple[Scene, Scene, bool]) -> None:
    monitor, scene, expected = case
    assert fires(monitor, scene) == expected


def test_place_that_is_no_number_fires_once_it_should_be_known() -> None:
    plain = ("off_road", "lane_departure", "object_danger", "last_safe_stop")
    numbers: list[Scene] = [STUCK | {"timeout": "30 s"}, ODD | {"max_speed": "40 m/s"}]
    monitors: list[Scene] = [WRONG, AREA, RSS, *numbers, *({"kind": kind} for kind in plain)]
    for monitor in monitors:
        lost = {"estimate": NAN}
        assert not fires(monitor, lost, ticks=11), monitor
        assert fires(monitor, lost, ticks=12), monitor


def rule(increment: int, decrement: int, fault: int, heal: int) -> Floats:
    row = np.zeros(kinds.RULE_ROW)
    row[2 : kinds.RULE_FIRST] = increment, decrement, fault, heal
    return row


def test_counter_confirms_after_its_number_of_failing_evaluations() -> None:
    for counter, steps in (
        ((1, 1, 4, -4), 8),
        ((1, 1, 15, -15), 30),
        ((3, 1, 4, -4), 3),
        ((1, 5, 1, 0), 1),
    ):
        row = rule(*counter)
        state = np.array([counter[3], 0], dtype=np.int64)
        confirmed = [kinds.count(state, True, row) for _ in range(steps + 5)]
        assert confirmed == [False] * (steps - 1) + [True] * 6
        assert kinds.steps_to_confirm(row) == steps
        # It saturates, so it is cleared after as many steps however long it has fired.
        back = -(-(counter[2] - counter[3]) // counter[1])
        cleared = [kinds.count(state, False, row) for _ in range(back + 5)]
        assert cleared == [True] * (back - 1) + [False] * 6
        assert state[0] == counter[3]


def test_counter_holds_between_its_ends() -> None:
    row = rule(1, 1, 2, -2)
    state = np.array([-2, 0], dtype=np.int64)
    between = [True, True, True, False, False, True, True]
    assert not any(kinds.count(state, up, row) for up in between)
    assert kinds.count(state, True, row)
    between = [False, False, True, False, False, True]
    assert all(kinds.count(state, up, row) for up in between)


def test_asymmetric_counter_counts_each_way_with_its_own_step() -> None:
    row = rule(2, 1, 6, 0)
    state = np.array([0, 0], dtype=np.int64)
    # Two of three evaluations that fire add 3.
    seen = [kinds.count(state, up, row) for up in [True, True, False] * 2]
    assert seen == [False, False, False, False, True, True]
