"""The stage: storyboards in closed loop, frozen runs, the order of a tick, and the ego."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.errors import SpecError
from adeye.signals import EGO_SPEED, EGO_X, EGO_Y, Floats, Ints, Scene
from adeye.simulate.traffic.stage import Ego, Ending, Stage, locate, locate_all
from adeye.simulate.world.compile import compile_world
from adeye.spec.quantity import SI
from adeye.spec.scenario import LogicalScenario
from adeye.sweep.case import TestCase
from adeye.testing.scenes import straight_road
from tests.kernel.stop_limits import GROUND
from tests.motorway import make_case, make_scenario


def car(**start: Any) -> dict[str, Any]:
    return {"kind": "car", "start": {"lane": 1, "speed": "30 m/s", **start}}


CUT_IN: dict[str, Any] = {
    "actors": {"cutter": car(lane=0, ahead_of="ego", gap="gap", speed="25 m/s")},
    "storyboard": {
        "cut_in": {
            "actor": "cutter",
            "when": "cutter.gap <= 38 m",
            "lane_change": {"to_lane": 1, "lateral_speed": "1 m/s"},
        }
    },
}


def run(cases: list[TestCase], command: tuple[float, float] = (0.0, 0.0)) -> list[Scene]:
    """Drive every run to its end with one command; return the scenes."""
    stage = Stage(compile_world(cases), cases, Path(), Path())
    scenes = [stage.scene()]
    nothing: Floats = np.zeros((len(cases), len(cases[0].scenario.actors), 5))
    while scenes[-1].running.any():
        stage.advance(np.tile(command, (len(cases), 1)), nothing)
        scenes.append(stage.scene())
    return scenes


def test_a_scene_holds_what_is_true_at_its_tick() -> None:
    scenes = run([make_case(make_scenario())])
    assert [scene.tick for scene in scenes] == list(range(141))
    assert scenes[100].time == 100 * 0.05
    assert scenes[100].ego[0, 0] == pytest.approx(200.0 + 30.0 * 5.0)
    assert scenes[100].ego_place[
        0, [signals.PLACE_S, signals.PLACE_D, signals.PLACE_LANE]
    ].tolist() == pytest.approx([350.0, 5.25, 1.0])


def test_scenes_do_not_change_afterwards() -> None:
    cases = [make_case(make_scenario())]
    stage = Stage(compile_world(cases), cases, Path(), Path())
    first = stage.scene()
    before = first.ego.tolist()
    stage.advance(np.zeros((1, 2)), np.zeros((1, 0, 5)))
    assert first.ego.tolist() == before
    assert stage.scene().ego.tolist() != before


def test_a_trigger_on_the_gap_fires_at_the_first_tick_at_which_it_holds() -> None:
    scenes = run([make_case(make_scenario(**CUT_IN))])
    # The gap of 40 m closes by 5 m/s and is 38 m at 0.4 s.
    began = scenes[-1].begun[0, 0]
    assert began in (0.4, 0.45)
    first = round(began / 0.05)
    assert np.isnan(scenes[first - 1].begun[0, 0])
    assert scenes[first].begun[0, 0] == began
    # It has moved sideways one tick later, not before.
    assert scenes[first].object_places[0, 0, signals.PLACE_D] == pytest.approx(1.75)
    assert scenes[first + 1].object_places[0, 0, signals.PLACE_D] > 1.75


def test_an_event_whose_condition_holds_at_once_begins_at_time_zero() -> None:
    scenario = make_scenario(
        actors={"lead": car(ahead_of="ego", gap="80 m")},
        storyboard={
            "slow": {
                "actor": "lead",
                "when": "time >= 0 s",
                "speed": {"to": "20 m/s", "rate": "2 m/s^2"},
            }
        },
    )
    scenes = run([make_case(scenario)])
    assert scenes[0].begun.tolist() == [[0.0]]
    assert scenes[1].objects[0, 0, 3] == pytest.approx(30.0 - 0.1)


def test_a_cut_in_too_near_ends_in_contact_with_the_closing_speed() -> None:
    scenario = make_scenario(**CUT_IN, horizon="20 s")
    last = run([make_case(scenario, {"gap": 36.0})])[-1]
    assert last.contact.tolist() == [0]
    assert last.impact_speed[0] == pytest.approx(5.0, abs=1e-6)


def test_initial_contact_ends_a_run_at_its_first_scene() -> None:
    scenario = make_scenario(actors={"lead": car(s="202 m", speed="10 m/s")})
    scenes = run([make_case(scenario)])
    assert len(scenes) == 1
    assert scenes[0].contact.tolist() == [0]
    assert scenes[0].impact_speed[0] == pytest.approx(20.0)


def test_actors_that_touch_are_noted_and_the_run_goes_on() -> None:
    actors = {
        "front": car(lane=2, s="300 m", speed="10 m/s"),
        "back": car(lane=2, s="280 m", speed="20 m/s"),
    }
    scenes = run([make_case(make_scenario(actors=actors))])
    foreign = [bool(scene.foreign_contact[0]) for scene in scenes]
    assert foreign.index(True) == pytest.approx((20.0 - 4.5) / 10.0 / 0.05, abs=1)
    assert all(foreign[foreign.index(True) :])
    assert len(scenes) == 141


def test_a_run_that_has_ended_is_frozen() -> None:
    scenario = make_scenario(**CUT_IN, horizon="20 s")
    scenes = run([make_case(scenario, {"gap": gap}) for gap in (20.0, 120.0)])
    ended = next(k for k, scene in enumerate(scenes) if not scene.running[0])
    assert ended < len(scenes) - 1
    for name in ("ego", "ego_place", "objects", "object_places", "begun", "impact_speed"):
        frozen, last = getattr(scenes[ended], name)[0], getattr(scenes[-1], name)[0]
        np.testing.assert_array_equal(frozen, last)


@pytest.mark.slow
def test_runs_have_the_same_bits_alone_and_in_a_batch() -> None:
    scenario = make_scenario(
        **CUT_IN, world={"road": {"kind": "curve", "radius": "900 m", "length": "1500 m"}}
    )
    cases = [make_case(scenario, {"gap": gap}) for gap in np.linspace(36.0, 60.0, 7)]
    together = run(cases, (-1.0, 0.004))
    for number, case in enumerate(cases):
        for row, scene in enumerate(run([case], (-1.0, 0.004))):
            for name in ("ego", "objects", "object_places", "begun", "contact"):
                np.testing.assert_array_equal(
                    getattr(scene, name)[0], getattr(together[row], name)[number]
                )


def test_half_the_step_gives_the_same_cut_in() -> None:
    scenario = make_scenario(**CUT_IN)
    coarse = run([make_case(scenario, step=0.05)])
    fine = run([make_case(scenario, step=0.025)])
    # The trigger may be seen one coarse step earlier.
    assert fine[-1].begun[0, 0] <= coarse[-1].begun[0, 0] <= fine[-1].begun[0, 0] + 0.05
    assert coarse[-1].objects[0, 0, :2].tolist() == pytest.approx(
        fine[-1].objects[0, 0, :2].tolist(), abs=2e-3
    )


def two(first: str, then: str, **more: Any) -> dict[str, Any]:
    """Let a car be asked for 35 and for 25 m/s at one time, in the order of the file."""
    wanted = {"faster": "35 m/s", "slower": "25 m/s"}
    return {
        "actors": {"lead": car(s="400 m")},
        "storyboard": {
            name: {
                "actor": "lead",
                "when": "time >= 0.5 s",
                "speed": {"to": wanted[what], "rate": "5 m/s^2"},
                **more,
            }
            for name, what in ((first, "faster"), (then, "slower"))
        },
        "realised": [first, then],
    }


@pytest.mark.parametrize(("first", "then"), [("a", "b"), ("b", "a")])
def test_of_two_events_at_one_tick_the_later_in_the_file_acts_whatever_its_name(
    first: str, then: str
) -> None:
    scenario = make_scenario(**two(first, then))
    last = run([make_case(scenario)])[-1]
    assert last.objects[0, 0, 3] == 25.0
    begun = dict(zip(scenario.storyboard, last.begun[0].tolist(), strict=True))
    assert begun == {first: np.inf, then: 0.5}


def test_the_order_is_noted_where_it_decides_and_only_there() -> None:
    assert make_scenario(**two("a", "b")).order == ()
    noted = make_scenario(**two("b", "a"))
    assert noted.order == ("b", "a")
    stored = LogicalScenario.model_validate_json(noted.model_dump_json(), context=SI)
    assert stored.acting_order == ("b", "a")
    apart = two("b", "a")
    apart["actors"]["other"] = car(s="600 m")
    apart["storyboard"]["a"]["actor"] = "other"
    assert "order" not in make_scenario(**apart).executable()


def test_a_delay_a_time_since_and_an_end_are_kept_to_the_tick() -> None:
    def event(when: str, to: str, **more: Any) -> dict[str, Any]:
        return {"actor": "lead", "when": when, "speed": {"to": to, "rate": "10 m/s^2"}, **more}

    scenario = make_scenario(
        actors={"lead": car(s="400 m"), "other": car(s="700 m")},
        storyboard={
            "first": event("time >= 0.5 s", "35 m/s", delay="0.3 s"),
            "second": event("since(first) >= 0.2 s", "25 m/s"),
            "third": event("ended(second)", "30 m/s"),
            "fourth": event("first.begun and time >= first.begun_at + 3 s", "20 m/s"),
            "fifth": {**event("ended(first)", "10 m/s"), "actor": "other"},
        },
    )
    scenes = run([make_case(scenario)])
    begun = dict(zip(scenario.storyboard, scenes[-1].begun[0].tolist(), strict=True))
    assert begun["first"] == pytest.approx(0.8)
    # The second takes the place of the first, which has ended by that, and 0.7 s itself.
    assert begun["second"] == pytest.approx(1.0)
    assert begun["fifth"] == pytest.approx(1.0)
    assert begun["third"] == pytest.approx(1.7)
    assert begun["fourth"] == pytest.approx(3.8)


def test_a_target_speed_may_be_relative_to_a_speed_now() -> None:
    change = {"to": "-4 m/s", "relative_to": "ego", "rate": "5 m/s^2"}
    board = {"follow": {"actor": "lead", "when": "time >= 1 s", "speed": change}}
    scenario = make_scenario(actors={"lead": car(s="400 m")}, storyboard=board)
    # The ego brakes from 30 m/s with 1 m/s²; later ticks change the target no more.
    last = run([make_case(scenario, vehicle={"acceleration_lag": "0 s"})], (-1.0, 0.0))[-1]
    assert last.objects[0, 0, 3] == pytest.approx(25.0)
    slow = make_scenario(
        actors={"lead": car(s="400 m")},
        storyboard={"follow": {**board["follow"], "speed": {**change, "to": "-90 m/s"}}},
        horizon="12 s",
    )
    assert run([make_case(slow)])[-1].objects[0, 0, 3] == 0.0


# --- Runs end at contact, after horizon and tail, or a tail after the goal ------------------------

NOTHING: Ints = np.array([-1], dtype=np.int64)


def end(
    goal: float = np.inf, *, horizon: float = 1.0, tail: float = 0.5, road: float = 1000.0
) -> Ending:
    length = np.array([road])
    return Ending(step=0.1, horizon=horizon, tail=tail, goal=np.array([goal]), road_length=length)


def drive(ending: Ending, speed: float = 10.0, contact_at: float = math.inf) -> int:
    """Return the tick at which the run ends; it drives past s = 0 at tick 0."""
    tick = 0
    while True:
        touched = np.array([0 if tick >= contact_at else -1], dtype=np.int64)
        ending.update(tick, np.array([speed * 0.1 * tick]), touched)
        if not ending.running[0]:
            return tick
        tick += 1


ENDS: dict[str, tuple[Ending, dict[str, float], int, int, str]] = {
    "horizon and tail without a goal": (end(), {}, 15, 10, "complete"),
    "goal and tail": (end(goal=4.0), {}, 9, 4, "complete, arrived"),
    "goal in the tail changes nothing": (end(goal=12.0), {}, 15, 10, "complete"),
    "goal without a tail": (end(goal=4.0, tail=0.0), {}, 4, 4, "complete, arrived"),
    "contact": (end(), {"contact_at": 6}, 6, 6, ""),
    "contact in the tail": (end(goal=4.0), {"contact_at": 7}, 7, 4, "arrived"),
    "initial contact": (end(), {"contact_at": 0}, 0, 0, ""),
    # The last row on the road counts.
    "end of the road": (end(road=4.5), {}, 5, 4, ""),
    "end of the road at a tick": (end(road=5.0), {}, 6, 5, ""),
    "begin of the road": (end(), {"speed": -10.0}, 1, 0, ""),
    "contact before the end of the road": (end(road=4.5), {"contact_at": 3}, 3, 3, ""),
    "goal before the end of the road": (
        end(road=4.5, goal=4.0, tail=0.0),
        {},
        4,
        4,
        "complete, arrived",
    ),
    "end of the road in the tail": (end(road=4.5, goal=3.0), {}, 5, 3, "arrived"),
}
"""Ends of the road and the like, how the run is driven, its last tick and row, and how it went."""


def test_what_happens_first_ends_the_run() -> None:
    for name, (ending, driven, tick, row, went) in ENDS.items():
        assert drive(ending, **driven) == tick, name
        assert ending.horizon_row.tolist() == [row], name
        assert ending.complete.tolist() == ["complete" in went], name
        assert ending.arrived.tolist() == ["arrived" in went], name
        assert ending.running.tolist() == [False]


def test_an_unknown_place_is_no_end_of_the_road() -> None:
    ending = end()
    ending.update(0, np.array([np.nan]), NOTHING)
    assert ending.running.tolist() == [True]


def test_a_run_that_has_ended_stays_ended() -> None:
    ending = end()
    drive(ending, contact_at=6)
    ending.update(7, np.array([0.0]), NOTHING)
    assert ending.running.tolist() == [False]
    assert ending.complete.tolist() == [False]


def test_runs_of_a_batch_end_one_by_one() -> None:
    length = np.full(2, 1000.0)
    goal = np.array([3.0, np.inf])
    ending = Ending(step=0.1, horizon=1.0, tail=0.0, goal=goal, road_length=length)
    seen = []
    for tick in range(11):
        ending.update(tick, np.full(2, float(tick)), np.full(2, -1))
        seen.append(ending.running.tolist())
    assert seen[2:4] == [[True, True], [False, True]]
    assert seen[-1] == [False, False]
    assert ending.horizon_row.tolist() == [3, 10]


def test_a_horizon_between_two_ticks_is_refused() -> None:
    with pytest.raises(SpecError, match=r"horizon: 0\.25 s is no whole number of steps"):
        end(horizon=0.25)


# --- Places on the road: lanes from the right, offsets to the left --------------------------------

STRAIGHT = np.array([[0.0, 0.0, 0.0, 1000.0, 0.0]])
LEFT = np.array([[0.0, 0.0, 0.0, 300.0, 0.01]])


def place(x: float, y: float, road: Floats = STRAIGHT) -> Floats:
    out = np.zeros(6)
    locate(GROUND._replace(segments=road), x, y, out)
    return out


def test_a_point_has_its_lane_and_its_distance_left_of_the_nearest_centre() -> None:
    for y, lane, offset in (
        (1.75, 0, 0.0),
        (5.75, 1, 0.5),
        (8.25, 2, -0.5),
        (0.0, 0, -1.75),
        # Off the lanes.
        (-1.0, -1, -2.75),
        (12.0, -1, 3.25),
    ):
        found = place(120.0, y)
        assert found[signals.PLACE_LANE] == lane, y
        assert found[signals.PLACE_OFFSET] == pytest.approx(offset), y
        assert found[signals.PLACE_S] == 120.0


def test_in_a_left_curve_the_road_turns_left() -> None:
    # A quarter circle of 100 m around (0, 100).
    found = place(97.0, 100.0, LEFT)
    assert found[signals.PLACE_S] == pytest.approx(50.0 * math.pi)
    assert found[signals.PLACE_D] == pytest.approx(3.0)
    assert found[signals.PLACE_HEADING] == pytest.approx(math.pi / 2)
    assert found[signals.PLACE_CURVATURE] == 0.01


def test_no_number_is_nowhere() -> None:
    found = place(math.nan, 0.0)
    assert found[signals.PLACE_LANE] == -1
    assert np.isnan(found[[signals.PLACE_S, signals.PLACE_D, signals.PLACE_OFFSET]]).all()


def test_ego_and_objects_of_running_runs_are_located() -> None:
    ego = np.zeros((2, 7))
    ego[:, 0], ego[:, 1] = 10.0, 1.75
    objects = np.zeros((2, 2, 5))
    objects[:, :, 0], objects[:, :, 1] = [[20.0, 30.0]], [[5.25, -1.0]]
    ego_place, places = np.full((2, 6), 7.0), np.full((2, 2, 6), 7.0)
    grounds = straight_road(2).grounds()
    unknown, near = np.zeros((2, 0, 6)), np.zeros((2, 3), dtype=np.int64)
    locate_all(np.array([True, False]), ego, objects, grounds, unknown, near, ego_place, places)
    assert ego_place[0, :2].tolist() == [10.0, 1.75]
    assert places[0, :, signals.PLACE_S].tolist() == [20.0, 30.0]
    assert places[0, :, signals.PLACE_LANE].tolist() == [1.0, -1.0]
    assert (ego_place[1] == 7.0).all()
    assert (places[1] == 7.0).all()


# --- The ego stage: limits, braking distance, batches ---------------------------------------------


def driven(
    command: tuple[float, float],
    ticks: int,
    *,
    runs: int = 1,
    friction: float = 0.9,
    **vehicle: str,
) -> Floats:
    """Return the states (B, T, 7) after each tick under one command."""
    case = make_case(make_scenario(environment={"friction": friction}), vehicle=vehicle)
    world = compile_world([case] * runs)
    stage = Ego([case] * runs, world.context, Path())
    states = world.ego.copy()
    rows: list[Any] = []
    for _ in range(ticks):
        stage.move(
            np.ones(runs, dtype=np.bool_), np.tile(command, (runs, 1)), states, np.zeros(runs)
        )
        rows.append(states.copy())
    return np.stack(rows, axis=1)


def test_ego_brakes_as_vehicle_and_road_let_it_and_turns_left_by_a_positive_angle() -> None:
    lost = 6.0 * (0.05 - 0.2 * (1.0 - math.exp(-0.05 / 0.2)))
    table: list[tuple[float, dict[str, Any], float]] = [
        (-6.0, {"acceleration_lag": "0 s"}, 6.0 * 0.05),
        (-6.0, {"acceleration_lag": "0.2 s"}, lost),
        (-50.0, {"acceleration_lag": "0 s", "max_deceleration": "5 m/s^2"}, 5.0 * 0.05),
    ]
    for command, limits, braked in table:
        states = driven((command, 0.0), 1, **limits)
        assert states[0, 0, EGO_SPEED] == pytest.approx(30.0 - braked), limits
    icy = driven((-9.0, 0.0), 1, acceleration_lag="0 s", friction=0.2)
    assert icy[0, 0, EGO_SPEED] == pytest.approx(30.0 - 0.2 * 9.80665 * 0.05)
    stopped = driven((-6.0, 0.0), 150, acceleration_lag="0 s")[0, -1]
    assert stopped[[EGO_X, EGO_SPEED]] == pytest.approx([200.0 + 30.0**2 / 12.0, 0.0])
    for angle in (0.02, -0.02):
        assert (driven((0.0, angle), 40)[0, -1, EGO_Y] - 5.25) / angle > 50.0


def test_gravity_pulls_along_a_grade_and_brakes_that_hold_it_hold_the_ego() -> None:
    cases = [make_case(make_scenario(), vehicle={"acceleration_lag": "0 s"})] * 3
    world = compile_world(cases)
    # Up by 4 % from 150 m on, down by 4 %, and flat.
    grades = np.array([[[0.0, 0.0], [150.0, 0.04]], [[0.0, -0.04]] * 2, [[0.0, 0.0]] * 2])
    road = replace(world.context.road, grades=grades)
    stage = Ego(cases, replace(world.context, road=road), Path())
    states, s, moving = world.ego.copy(), np.full(3, 200.0), np.ones(3, dtype=np.bool_)
    stage.move(moving, np.zeros((3, 2)), states, s)
    pull = 9.80665 * 0.04 / math.hypot(1.0, 0.04)
    gained = states[:, EGO_SPEED] - world.ego[:, EGO_SPEED]
    np.testing.assert_allclose(gained, [-pull * 0.05, pull * 0.05, 0.0], atol=1e-9)
    states[:, EGO_SPEED] = 0.0
    stage.move(moving, np.full((3, 2), [-2.0, 0.0]), states, s)
    assert states[:, EGO_SPEED].tolist() == [0.0, 0.0, 0.0]


def test_a_run_that_has_ended_stays_where_it_is() -> None:
    cases = [make_case(make_scenario())] * 2
    world = compile_world(cases)
    states = world.ego.copy()
    Ego(cases, world.context, Path()).move(
        np.array([False, True]), np.zeros((2, 2)), states, np.zeros(2)
    )
    assert states[0].tolist() == world.ego[0].tolist()
    assert states[1, EGO_X] == pytest.approx(201.5)
