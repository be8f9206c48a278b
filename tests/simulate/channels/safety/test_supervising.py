"""The supervised step in closed loop: counters, levels, and manoeuvres that give way."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.kernel.stops import ANYWHERE, ONLY_REST_AREA, ROADSIDE
from adeye.signals import DEGRADED, MANOEUVRE_MONITORS, OK, REQUESTS_AUTHORITY, Bools, Floats
from adeye.simulate.channels.factory import make_channel
from adeye.simulate.channels.links import observe
from adeye.simulate.channels.safety import SupervisedSafetyChannel, supervisor
from adeye.spec.channels import SafetyParameters
from adeye.spec.supervisor import KINDS
from adeye.testing import Drive, World, channel_context, check_channel
from adeye.testing.scenes import object_measurement, straight_road
from tests.simulate.channels.safety.supervised import (
    LATCHED,
    NOMINAL,
    OTHER_SILENT,
    SAFETY,
    SILENT,
    changed,
    column,
    faulty,
    first,
    parameters,
    run,
    silence,
)

PERIOD, TICK = 0.1, 0.05


def waiting(level: int, **more: Any) -> SafetyParameters:
    """Let the channel that never acts be watched at a level."""
    return parameters({"silent": {**OTHER_SILENT, "level": level}}, **more)


COUNTERS: list[tuple[dict[str, int], int]] = [
    ({}, 8),
    ({"fault": 15, "heal": -15}, 30),
    ({"increment": 2}, 4),
    ({"increment": 3}, 3),
    ({"fault": 1, "heal": 0}, 1),
]


@pytest.mark.parametrize("killed", [1.0, 1.05, 1.3])
@pytest.mark.parametrize(("counter", "steps"), COUNTERS)
def test_detection_takes_what_is_closed(killed: float, counter: dict[str, int], steps: int) -> None:
    item = parameters({"silent": SILENT}, counter=counter)
    done = run(World(), item, 6.0, on_commands=silence(killed))
    # The last command is one tick older, and a linked channel is seen one tick late.
    stale = killed - TICK + 0.2 + TICK
    asked = np.ceil(stale / PERIOD - 1e-6) * PERIOD
    assert first(done, column(done, item, "silent", 0)) == pytest.approx(asked)
    expected = asked + (steps - 1) * PERIOD
    confirmed = first(done, column(done, item, "silent"))
    assert confirmed == pytest.approx(expected)
    assert -1e-9 <= confirmed - killed - 0.2 - (steps - 1) * PERIOD < PERIOD + 1e-9
    assert first(done, done.status[:, SAFETY] == REQUESTS_AUTHORITY) == pytest.approx(expected)


def test_shorter_fault_heals_without_a_request() -> None:
    item = parameters({"silent": SILENT})
    done = run(World(), item, on_commands=silence(1.0, 1.6))
    assert column(done, item, "silent", 0).any()
    assert not column(done, item, "silent").any()
    assert (done.status[:, SAFETY] == OK).all()


def test_highest_level_among_the_confirmed_monitors_decides() -> None:
    fires = {"kind": "odd_exit", "max_speed": "1 m/s"}
    for levels, asked in (
        ([1], None),
        ([1, 2], "mrm_rest_area"),
        ([3, 1], "mrm_roadside_parking"),
        ([2, 4, 3], "mrm_stop"),
    ):
        item = parameters({f"m{at}": {**fires, "level": level} for at, level in enumerate(levels)})
        done = run(World(), item, 2.0)
        for name in MANOEUVRE_MONITORS:
            assert column(done, item, name, 0)[-1] == (name == asked)


def confirmed(done: Drive, item: SafetyParameters) -> list[str]:
    """Name the manoeuvres that were in force."""
    return [name for name in MANOEUVRE_MONITORS if column(done, item, name).any()]


def test_level_of_continue_degrades_the_channel_and_the_nominal_one_goes_on() -> None:
    item = parameters({"slow": {"kind": "odd_exit", "max_speed": "1 m/s", "level": 1}})
    done = run(World(), item, 3.0)
    assert done.status[-1, SAFETY] == DEGRADED
    assert (done.authority == NOMINAL).all()
    assert confirmed(done, item) == []


ENDS: list[tuple[SafetyParameters, Any, str, float]] = [
    # The best there is; where nothing is planned a milder one gives way to the stop in the lane.
    (parameters({"silent": SILENT}), silence(1.0), "mrm_stop", -1.25),
    (
        parameters({"silent": {**SILENT, "level": 2}}, stop="in_lane"),
        silence(1.0),
        "mrm_stop",
        1.75,
    ),
    (waiting(3), faulty(1.0), "mrm_roadside_parking", -1.25),
]
"""Parameters, what happens, the manoeuvre that masters it, and where across the road it ends."""


def test_manoeuvre_of_the_level_ends_at_its_place() -> None:
    for item, fault, manoeuvre, place in ENDS:
        done = run(World(lane=0), item, 16.0, on_commands=fault)
        assert confirmed(done, item) == [manoeuvre]
        assert done.ego[-1, 3] == 0.0
        assert done.ego[-1, 1] == pytest.approx(place, abs=0.1)


def test_roadside_parking_is_waited_for_until_the_patience_is_over() -> None:
    # From the left lane nobody sees behind, so the shoulder cannot be reached.
    item = waiting(3, patience="2 s")
    done = run(World(lane=1), item, 16.0, on_commands=faulty(1.0))
    began = first(done, column(done, item, "mrm_roadside_parking"))
    stops = first(done, column(done, item, "mrm_stop"))
    assert stops - began == pytest.approx(2.0 + TICK)
    between = (done.time > began) & (done.time < stops - 1e-6)
    assert (done.status[between, SAFETY] == DEGRADED).all()
    assert (done.authority[between] == NOMINAL).all()
    assert done.ego[-1, [1, 3]] == pytest.approx([5.25, 0.0], abs=0.1)


def with_refuges(*refuges: tuple[float, float]) -> World:
    """Return a road without a shoulder that has refuges: kind and place along it [m]."""
    rows = np.array([[(kind, s, 80.0, 4.0, 30.0) for kind, s in refuges]])
    road = replace(straight_road(), shoulder=np.zeros(1), refuges=rows.reshape(1, -1, 5))
    return World(lane=0, speed=25.0, road=road)


BAY, AREA = 0, 1


@pytest.mark.slow
def test_nominal_channel_drives_on_to_the_place_of_its_level() -> None:
    world = with_refuges((BAY, 300.0), (AREA, 900.0))
    for level, manoeuvre, begin in (
        (2, "mrm_rest_area", 900.0),
        (3, "mrm_roadside_parking", 300.0),
    ):
        item = waiting(level)
        done = run(world, item, 50.0, on_commands=faulty(1.0))
        assert confirmed(done, item) == [manoeuvre]
        assert done.ego[-1, 3] == 0.0
        assert begin < done.ego[-1, 0] < begin + 80.0
        assert done.ego[-1, 1] < -0.95
        asked = first(done, column(done, item, manoeuvre))
        took = first(done, done.status[:, SAFETY] == REQUESTS_AUTHORITY)
        # It waits for the moment from which the usual deceleration will do.
        between = (done.time > asked) & (done.time < took - 1e-6)
        assert took > asked + 5.0 or level == 3
        assert (done.authority[between] == NOMINAL).all()
        assert done.ego[between, 3].min(initial=99.0) > 23.0
        assert done.ego[:, 4].min() >= -4.0 - 1e-9


@pytest.mark.slow
def test_better_place_is_not_worth_a_harder_braking() -> None:
    item = waiting(3)
    for ahead in (150.0, 250.0, 350.0):
        world = with_refuges((BAY, ahead))
        assert world.road is not None
        beside = replace(world, speed=27.0, road=replace(world.road, shoulder=np.full(1, 2.5)))
        done = run(beside, item, 30.0, on_commands=faulty(1.0))
        assert done.ego[-1, 3] == 0.0
        assert done.ego[-1, 1] < -0.95
        assert not column(done, item, "mrm_stop").any()
        assert done.ego[:, 4].min() >= -4.0 - 1e-9


def test_chain_goes_from_rest_area_to_bay_to_stop_with_what_the_map_shows() -> None:
    item = waiting(2, sight="400 m")
    bay, area = ((BAY, 250.0),), ((AREA, 900.0),)
    for refuges, place in ((bay, "mrm_roadside_parking"), (area, "mrm_stop"), ((), "mrm_stop")):
        done = run(with_refuges(*refuges), item, 3.0, on_commands=faulty(1.0))
        assert confirmed(done, item) == [place]
        assert column(done, item, "mrm_rest_area", 0).any()


def test_level_that_rises_on_the_way_to_a_place_or_while_waiting_stops_at_once() -> None:
    for level, world, way in (
        (2, with_refuges((AREA, 900.0)), 200.0),
        (3, World(lane=1), 100.0),
    ):
        later = {"kind": "odd_exit", "to_s": f"{way} m"}
        item = parameters({"silent": {**OTHER_SILENT, "level": level}, "later": later})
        done = run(world, item, 25.0, on_commands=faulty(1.0))
        assert column(done, item, MANOEUVRE_MONITORS[level - 2]).any()
        rises = pytest.approx(first(done, column(done, item, "later")))
        assert first(done, column(done, item, "mrm_stop")) == rises
        assert first(done, done.status[:, SAFETY] == REQUESTS_AUTHORITY) == rises
        assert done.ego[-1, 3] == 0.0
        assert done.ego[-1, 0] < way + 200.0


def test_what_heals_before_the_takeover_is_forgotten() -> None:
    item = waiting(3)
    done = run(World(lane=1), item, 8.0, on_commands=faulty(1.0, 3.0))
    assert column(done, item, "mrm_roadside_parking").any()
    assert (done.status[-1, SAFETY], done.authority[-1]) == (OK, NOMINAL)
    assert not column(done, item, "mrm_roadside_parking")[-1]
    assert (done.authority == NOMINAL).all()


def test_what_heals_after_the_takeover_is_given_up_only_when_another_channel_acts() -> None:
    item = parameters({"silent": SILENT})
    for latch in (True, False):
        switch = LATCHED.model_copy(update={"latch": latch})
        done = run(World(), item, 16.0, on_commands=silence(1.0, 3.0), switch=switch)
        assert column(done, item, "mrm_stop").any()
        assert (done.ego[-1, 3] == 0.0) == latch
        assert column(done, item, "mrm_stop")[-1] == latch
        assert done.status[-1, SAFETY] == OK


def test_steering_in_degrees_is_found_at_once_and_a_brake_in_g_is_not() -> None:
    item = parameters({"wrong": {"kind": "channel_implausible", "watches": ["nominal"]}})

    def in_degrees(command: Any) -> None:
        command.steering_angle[:] = np.degrees(0.01)

    def in_g(command: Any) -> None:
        command.acceleration[:] = -4.0 / 9.81

    assert column(run(World(), item, 3.0, on_commands=changed(1.0, in_degrees)), item, "wrong")[-1]
    assert not column(run(World(), item, 3.0, on_commands=changed(1.0, in_g)), item, "wrong").any()


# The supervised channel: contract, monitors, batches, and what it watches through health links.


@pytest.mark.slow
@pytest.mark.parametrize("stop", ["in_lane", "planned"])
def test_conforms(stop: str) -> None:
    every = {
        "silent": SILENT,
        "wrong": {"kind": "channel_implausible", "watches": ["nominal"]},
        "off": {"kind": "off_road", "level": 2},
        "lane": {"kind": "lane_departure", "level": 3},
        "danger": {"kind": "object_danger"},
        "area": {"kind": "critical_area", "level": 1},
        "rss": {"kind": "rss_danger", "level": 1},
        "odd": {"kind": "odd_exit", "max_speed": "25 m/s", "level": 3},
    } | ({"last": {"kind": "last_safe_stop"}} if stop == "planned" else {})
    item = parameters(every, stop=stop)
    links = ("truth", "channels.nominal", "switch")
    made = partial(SupervisedSafetyChannel, item)
    check_channel(made, item, links=links, sensors={"truth": "ground_truth"})


def test_parameters_say_which_channel_is_made() -> None:
    item = parameters({"b": SILENT, "a": {"kind": "off_road"}})
    made = make_channel("safety", Path(), item)
    assert made.monitor_ids == ("a", "b", *MANOEUVRE_MONITORS)
    assert set(supervisor.THRESHOLDS) == set(KINDS)


FRONT = {"kind": "sensor_silent", "watches": ["front"]}


def drive_batch(items: Sequence[SafetyParameters]) -> list[tuple[Floats, Bools]]:
    channel, size = SupervisedSafetyChannel(items[0]), len(items)
    links, sensors = ("truth", "health.front"), {"truth": "ground_truth"}
    channel.reset(channel_context(list(items), links=links, sensors=sensors, runs=size))
    road, running, answers = straight_road(size), np.ones(size, dtype=np.bool_), []
    for tick in range(60):
        time = 0.05 * tick
        ego, objects = np.zeros((size, 7)), np.zeros((size, 1, 5))
        ego[:, [0, 1, 3]] = 20.0 * time, 1.75, 20.0
        objects[:, 0, [0, 1, 3]] = 80.0 + 5.0 * time, 1.75, 5.0
        truth = object_measurement(ego, objects, time, road=road)
        front = object_measurement(ego, objects, min(time, 1.0))
        readings = {"truth": truth, "front": front}
        answer = channel.act(observe(links, time, readings, {}, None, running, protect=False))
        assert answer.monitors is not None
        answers.append((np.stack([answer.acceleration, answer.steering_angle]), answer.monitors))
    return answers


def test_runs_of_a_batch_decide_as_they_do_alone_whatever_their_thresholds() -> None:
    items = [
        parameters(
            {
                "front": {**FRONT, "timeout": f"{0.2 * at} s"},
                "rss": {"kind": "rss_danger", "level": at, "response_time": f"{at} s"},
                "last": {"kind": "last_safe_stop"},
            },
            counter={"fault": at},
            rate=("20 Hz", "10 Hz", "5 Hz")[at - 1],
        )
        for at in (1, 2, 3)
    ]
    together = drive_batch(items)
    assert len({rows[1][run].tobytes() for run in range(3) for rows in together}) > 3
    for number, item in enumerate(items):
        for one, all_ in zip(drive_batch([item]), together, strict=True):
            assert one[0][:, 0].tobytes() == all_[0][:, number].tobytes()
            assert one[1][0].tobytes() == all_[1][number].tobytes()


def test_sensor_is_silent_its_timeout_after_the_last_sample_that_the_health_link_showed() -> None:
    item = parameters({"front": FRONT | {"timeout": "0.3 s"}}, rate="20 Hz")
    shown = [bool(rows[1][0, 0, 0]) for rows in drive_batch([item])]
    # The newest sample is of 1.0 s; the first evaluation that is more than 0.3 s later finds it.
    assert shown.index(True) == round((1.0 + 0.3 + 0.05) / 0.05)
    confirmed = [bool(rows[1][0, 0, 1]) for rows in drive_batch([item])]
    assert confirmed.index(True) == shown.index(True) + 7


# Which manoeuvre is in force, tick by tick.

SETTINGS = np.zeros(supervisor.SET_ROW)
SETTINGS[supervisor.SET_OF_LEVEL :] = (
    supervisor.CONTINUE,
    supervisor.REST_AREA,
    supervisor.ROADSIDE_PARKING,
    supervisor.STOP,
)
SETTINGS[supervisor.SET_PATIENCE] = 1.0
SETTINGS[supervisor.SET_LEAST], SETTINGS[supervisor.SET_SIGHT] = 25.0, 1000.0
GOING_ON = False


def state(
    held: int = supervisor.NONE, asked: int = supervisor.NONE, level: int = 0, waited: float = 0.0
) -> Floats:
    row = np.zeros(supervisor.FORCE_ROW)
    row[supervisor.FORCE_HELD], row[supervisor.FORCE_ASKED] = held, asked
    row[supervisor.FORCE_LEVEL], row[supervisor.FORCE_WAITED] = level, waited
    return row


def test_level_asks_for_its_manoeuvre() -> None:
    for level in range(5):
        row = state(level=level)
        supervisor.ask(row, SETTINGS, GOING_ON, 0.05)
        assert row[supervisor.FORCE_ASKED] == row[supervisor.FORCE_HELD] == level


def test_what_has_given_way_stays_so_while_the_level_is_the_same() -> None:
    row = state(supervisor.STOP, supervisor.REST_AREA, 2)
    supervisor.ask(row, SETTINGS, GOING_ON, 0.05)
    assert row[supervisor.FORCE_HELD] == supervisor.STOP


def test_lower_level_begins_anew_unless_the_channel_has_taken_over() -> None:
    for stopping, held in ((False, supervisor.REST_AREA), (True, supervisor.STOP)):
        row = state(supervisor.STOP, supervisor.ROADSIDE_PARKING, 2, 0.5)
        supervisor.ask(row, SETTINGS, stopping, 0.05)
        assert row[supervisor.FORCE_HELD] == held
        assert row[supervisor.FORCE_WAITED] == (0.55 if stopping else 0.0)


def test_what_cannot_be_had_or_not_in_time_gives_way() -> None:
    for held, rest, parking, waited, left in (
        (supervisor.REST_AREA, True, True, 1.0, supervisor.REST_AREA),
        (supervisor.REST_AREA, True, True, 1.01, supervisor.ROADSIDE_PARKING),
        (supervisor.REST_AREA, False, True, 0.0, supervisor.ROADSIDE_PARKING),
        (supervisor.REST_AREA, False, False, 0.0, supervisor.STOP),
        (supervisor.ROADSIDE_PARKING, True, True, 1.0, supervisor.ROADSIDE_PARKING),
        (supervisor.ROADSIDE_PARKING, True, True, 1.01, supervisor.STOP),
        (supervisor.ROADSIDE_PARKING, True, False, 0.0, supervisor.STOP),
        (supervisor.CONTINUE, False, False, 9.0, supervisor.CONTINUE),
        (supervisor.STOP, True, True, 9.0, supervisor.STOP),
    ):
        row = state(held, held, held, waited)
        supervisor.give_way(row, SETTINGS, rest, parking)
        assert row[supervisor.FORCE_HELD] == left, (held, rest, parking, waited)


def test_columns_tell_what_is_asked_for_and_what_is_in_force() -> None:
    shown = np.zeros((3, 2), dtype=np.bool_)
    supervisor.show_manoeuvre(state(supervisor.STOP, supervisor.REST_AREA), shown)
    assert shown.tolist() == [[True, False], [False, False], [False, True]]


def test_map_shows_what_is_neither_too_near_nor_out_of_sight() -> None:
    shown: list[tuple[list[tuple[float, float]], int]] = [
        ([], ANYWHERE),
        ([(0, 100.0)], ROADSIDE),
        ([(0, 100.0), (1, 500.0)], ONLY_REST_AREA),
        ([(1, 25.0)], ANYWHERE),
        ([(1, 25.1)], ONLY_REST_AREA),
        ([(1, 1000.1), (0, 1000.0)], ROADSIDE),
        ([(1, -50.0)], ANYWHERE),
    ]
    for refuges, best in shown:
        rows = np.zeros((len(refuges), 5))
        for row, (kind, ahead) in zip(rows, refuges, strict=True):
            row[:2] = kind, 300.0 + ahead
        assert supervisor.look_ahead(SETTINGS, rows, 300.0) == best, refuges
