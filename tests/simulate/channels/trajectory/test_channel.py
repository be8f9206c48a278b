"""The closed loop: what a driver would call cruise control, emergency braking and swerving."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.signals import DEGRADED, FAULT, OK, ControlCommand
from adeye.simulate.channels.links import observe
from adeye.simulate.channels.trajectory.candidates import CANDIDATES
from adeye.simulate.channels.trajectory.channel import TrajectoryChannel
from adeye.simulate.channels.trajectory.cost import SAMPLES
from adeye.simulate.channels.trajectory.planner import POINTS
from adeye.spec.channels import TrajectoryParameters
from adeye.testing import Drive, World, channel_context, check_channel, drive
from adeye.testing.scenes import ego_estimate, object_measurement, pose_measurement, straight_road

LINKS = ("front", "pose")
LANE, LEFT, RIGHT = 5.25, 8.75, 1.75
SEES_ALL_ROUND: dict[str, Any] = {"rear_sight": "120 m"}


def made(*, shows: bool = True, links: Any = LINKS, road: Any = None, **more: Any) -> Any:
    desired = more.pop("desired", 30.0)
    sensors = {"front": "radar", "pose": "localisation"}
    channel = TrajectoryChannel()
    context = channel_context(
        TrajectoryParameters.model_validate(more),
        links=links,
        sensors={name: sensors[name] for name in links},
        desired_speed=desired,
        road=road,
    )
    channel.reset(replace(context, shows_candidates=shows))
    return channel


def run(world: World, horizon: float, **more: Any) -> Drive:
    return drive({"t": made(road=world.road, **more)}, {"t": LINKS}, world, horizon=horizon)


def wall(_time: float) -> list[list[float]]:
    return [[150.0, LANE, 0.0, 0.0, 0.0]]


def beside(speed: float, *lanes: float, start: float = 2.0) -> list[Any]:
    return [(start, lane, speed) for lane in lanes]


def wall_and(*others: tuple[float, float, float]) -> Any:
    def objects(time: float) -> list[list[float]]:
        return [*wall(time), *([x + v * time, y, 0.0, v, 0.0] for x, y, v in others)]

    return objects


@pytest.mark.slow
def test_conforms() -> None:
    check_channel(TrajectoryChannel, TrajectoryParameters())


@pytest.mark.slow
def test_conforms_while_it_sees_all_round() -> None:
    parameters = TrajectoryParameters.model_validate(SEES_ALL_ROUND | {"weight_lane_change": 1.0})
    sensors = {"truth": "ground_truth"}
    check_channel(TrajectoryChannel, parameters, links=("truth",), sensors=sensors)


@pytest.mark.slow
def test_free_road_is_driven_at_the_desired_speed_in_the_lane() -> None:
    done = run(World(speed=25.0, offset=0.8), 30.0)
    assert done.ego[-1, 3] == pytest.approx(30.0, abs=0.3)
    assert done.ego[-1, 1] == pytest.approx(LANE, abs=0.02)
    assert done.proposals[:, 0, 0].max() <= 1.5
    assert (done.status == OK).all()


def test_ego_starts_from_standstill() -> None:
    done = run(World(speed=0.0), 15.0, desired=10.0)
    assert done.ego[-1, 3] == pytest.approx(10.0, abs=0.3)


def test_speed_limit_is_kept() -> None:
    done = run(World(speed=36.0), 12.0, desired=60.0)
    assert done.ego[:, 3].max() < 130.0 / 3.6 + 0.3


@pytest.mark.slow
def test_slower_lead_is_followed_at_the_time_gap() -> None:
    """Adaptive cruise comes out of the costs: there is no car-following law in the channel."""
    done = run(World(objects=lambda t: [[80.0 + 20.0 * t, LANE, 0.0, 20.0, 0.0]]), 50.0)
    assert done.ego[-1, 3] == pytest.approx(20.0, abs=0.2)
    assert done.distance[-1] == pytest.approx(4.0 + 1.8 * 20.0, abs=3.0)
    assert done.proposals[:, 0, 0].min() > -2.5


@pytest.mark.parametrize("latency", [0, 4])
def test_stopped_lead_first_seen_at_150_m_is_stopped_for_in_comfort(latency: int) -> None:
    stopped = World(objects=lambda _: [[300.0, LANE, 0.0, 0.0, 0.0]], sight=150.0, latency=latency)
    done = run(stopped, 20.0)
    assert done.distance.min() > 2.5
    assert done.ego[-1, 3] == 0.0
    assert done.proposals[:, 0, 0].min() > -4.5


def test_emergency_braking_is_used_when_it_is_needed() -> None:
    late = World(objects=lambda _: [[120.0, LANE, 0.0, 0.0, 0.0]], sight=40.0, speed=20.0)
    done = run(late, 10.0, desired=20.0)
    assert done.proposals[:, 0, 0].min() < -6.5
    assert done.distance.min() > 0.3
    assert np.abs(done.ego[:, 1] - LANE).max() < 0.5


def test_braking_lead_is_not_touched() -> None:
    def braking(time: float) -> list[list[float]]:
        t = min(max(0.0, time - 3.0), 5.0)
        x = 60.0 + 30.0 * min(time, 3.0) + 30.0 * t - 3.0 * t * t
        return [[x, LANE, 0.0, 30.0 - 6.0 * t, -6.0]]

    done = run(World(objects=braking), 20.0)
    assert done.distance.min() > 2.0
    assert done.ego[-1, 3] == 0.0


@pytest.mark.parametrize("y", [LEFT, RIGHT])
def test_slow_vehicle_in_the_next_lane_is_passed_without_braking(y: float) -> None:
    done = run(World(objects=lambda t: [[150.0 + 10.0 * t, y, 0.0, 10.0, 0.0]]), 12.0)
    assert done.proposals[:, 0, 0].min() > -0.5
    assert np.abs(done.ego[:, 1] - LANE).max() < 0.6


def test_cutting_in_vehicle_is_reacted_to_before_it_is_in_the_lane() -> None:
    def cutting(time: float) -> list[list[float]]:
        y = LEFT - 3.5 * min(max(0.0, (time - 3.0) / 3.0), 1.0)
        return [[45.0 + 24.0 * time, y, 0.0, 24.0, 0.0]]

    done = run(World(objects=cutting), 12.0)
    first = int(np.argmax(done.proposals[:, 0, 0] < -1.0))
    assert 3.0 < done.time[first] < 4.6
    assert done.distance.min() > 5.0


def test_crossing_pedestrian_is_not_touched_and_not_raced() -> None:
    def crossing(time: float) -> list[list[float]]:
        walked = 1.5 * max(0.0, time - 2.0)
        return [[80.0, -1.0 + walked, np.pi / 2, 1.5 if time >= 2.0 else 0.0, 0.0]]

    world = World(objects=crossing, size=(0.5, 0.6), object_class=6, speed=13.9)
    done = run(world, 14.0, desired=13.9)
    assert done.distance.min() > 1.0
    assert done.ego[:, 3].max() < 14.5


@pytest.mark.parametrize("curvature", [1.0 / 300.0, -1.0 / 300.0])
def test_lane_is_kept_in_a_curve_at_the_speed_that_it_allows(curvature: float) -> None:
    road = straight_road(curvature=curvature)
    done = run(World(road=road, offset=0.5, speed=28.0), 14.0)
    last = ego_estimate(road, done.ego[-1:])[0]
    assert last[8] == pytest.approx(LANE, abs=0.05)
    assert last[3] ** 2 * abs(curvature) < 3.3


def test_braking_is_preferred_to_leaving_the_lane_where_it_is_enough() -> None:
    done = run(World(objects=wall, sight=75.0), 9.0, **SEES_ALL_ROUND)
    assert np.abs(done.ego[:, 1] - LANE).max() < 0.6
    assert done.distance.min() > 0.3


def test_wall_that_braking_cannot_avoid_is_dodged_into_the_free_lane() -> None:
    done = run(World(objects=wall, sight=48.0), 8.0, **SEES_ALL_ROUND)
    assert done.distance.min() > 0.3
    assert abs(done.ego[-1, 1] - LANE) == pytest.approx(3.5, abs=0.1)
    lateral = np.abs(done.ego[:, 3] * done.ego[:, 6])
    assert lateral.max() < 5.5


def test_of_two_lanes_the_one_that_is_free_is_taken() -> None:
    done = run(World(objects=wall_and(*beside(30.0, LEFT)), sight=48.0), 8.0, **SEES_ALL_ROUND)
    assert done.ego[-1, 1] == pytest.approx(RIGHT, abs=0.1)
    assert done.distance.min() > 0.3


@pytest.mark.slow
def test_between_occupied_lanes_it_brakes_in_its_own() -> None:
    world = World(objects=wall_and(*beside(30.0, LEFT, RIGHT)), sight=48.0)
    done = run(world, 5.4, **SEES_ALL_ROUND)
    assert np.abs(done.ego[:, 1] - LANE).max() < 0.6
    assert done.proposals[:, 0, 0].min() == pytest.approx(-8.0, abs=0.3)
    # It cannot stop before the wall, but no longer hits it at 30 m/s.
    assert done.ego[-1, 3] < 18.0


def test_nobody_who_comes_fast_from_behind_is_cut_up() -> None:
    def sudden(speed: float) -> Any:
        others = wall_and(*beside(speed, LEFT, RIGHT, start=90.0 - 55.0 - 3.0 * speed))

        def objects(time: float) -> Any:
            hidden = [[900.0, LANE, 0.0, 0.0, 0.0]]
            return others(time) if time > 3.1 else hidden + others(time)[1:]

        return objects

    fast = run(World(objects=sudden(45.0)), 5.4, **SEES_ALL_ROUND)
    assert np.abs(fast.ego[:, 1] - LANE).max() < 0.6
    alike = run(World(objects=sudden(30.0)), 6.0, **SEES_ALL_ROUND)
    assert np.abs(alike.ego[:, 1] - LANE).max() > 3.0


def test_lane_that_nobody_looks_back_into_is_not_entered() -> None:
    done = run(World(objects=wall, sight=48.0), 5.4)
    assert np.abs(done.ego[:, 1] - LANE).max() < 0.6
    assert done.proposals[:, 0, 0].min() == pytest.approx(-8.0, abs=0.3)


def test_shoulder_is_a_way_out_and_is_left_again() -> None:
    world = World(objects=lambda _: [[150.0, RIGHT, 0.0, 0.0, 0.0]], sight=48.0, lane=0)
    done = run(world, 14.0)
    assert done.distance.min() > 0.1
    assert done.ego[:, 1].min() < 0.0
    assert done.ego[-1, 1] == pytest.approx(RIGHT, abs=0.3)


def test_slow_lead_is_overtaken_only_where_lane_changes_are_cheap() -> None:
    slow = World(objects=lambda t: [[60.0 + 20.0 * t, LANE, 0.0, 20.0, 0.0]])
    behind = run(slow, 10.0, **SEES_ALL_ROUND)
    assert np.abs(behind.ego[:, 1] - LANE).max() < 0.6
    past = run(slow, 10.0, weight_lane_change=2.0, **SEES_ALL_ROUND)
    assert past.ego[-1, 0] > 60.0 + 20.0 * 10.0
    assert past.distance.min() > 1.0


def test_without_ego_estimate_the_channel_is_in_fault() -> None:
    done = drive({"t": made(links=("front",))}, {"t": ("front",)}, World(), horizon=0.5)
    assert (done.status == FAULT).all()


def answer(channel: TrajectoryChannel, ticks: int = 8, *, alive: bool = True) -> ControlCommand:
    """Drive at 20 m/s towards something that stands 60 m ahead of the start."""
    road = straight_road()
    for tick in range(ticks):
        time = 0.05 * tick
        ego = np.array([[20.0 * time, LANE, 0.0, 20.0, 0.0, 0.0, 0.0]])
        front = object_measurement(ego, np.array([[[60.0, LANE, 0.0, 0.0, 0.0]]]), time)
        front.alive[:] = alive
        readings = {"front": front, "pose": pose_measurement(road, ego, time)}
        running = np.ones(1, dtype=np.bool_)
        seen = observe(LINKS, time, readings, {}, None, running, protect=False)
        command = channel.act(seen)
    return command


def test_dead_sensor_degrades_the_channel() -> None:
    assert answer(made(), 1, alive=False).status.tolist() == [DEGRADED]


def test_plan_begins_ahead_of_the_ego_and_ends_where_it_stops() -> None:
    command = answer(made())
    assert command.plan is not None
    assert command.plan.shape == (1, SAMPLES, 4)
    x, y, heading, speed = command.plan[0].T
    assert 7.0 < x[0] < 13.0
    assert (np.diff(x) >= 0.0).all()
    assert x[-1] < 60.0 - 4.5
    assert y == pytest.approx(LANE, abs=0.5)
    assert heading == pytest.approx(0.0, abs=0.1)
    assert (np.diff(speed) <= 1e-9).all()


def test_fan_is_shown_with_the_chosen_one_as_the_cheapest() -> None:
    command = answer(made())
    assert command.candidates is not None
    assert command.candidate_costs is not None
    assert command.chosen is not None
    assert command.candidates.shape == (1, CANDIDATES, POINTS, 2)
    costs = command.candidate_costs[0]
    assert command.chosen[0] == int(np.argmin(costs))
    assert np.isfinite(costs).sum() >= 7
    there = np.isfinite(command.candidates[0]).all(axis=(1, 2))
    ego_x = 20.0 * 0.05 * 7
    assert command.candidates[0, there, 0] == pytest.approx(
        np.array([[ego_x, LANE]] * int(there.sum())), abs=0.2
    )


def test_whoever_looks_changes_nothing() -> None:
    """Candidates that nobody looks at are dropped early, but never the best."""
    shown, hidden = made(**SEES_ALL_ROUND), made(shows=False, **SEES_ALL_ROUND)
    for ticks in (1, 4, 8):
        one, other = answer(shown, ticks), answer(hidden, ticks)
        assert one.acceleration.tobytes() == other.acceleration.tobytes()
        assert one.steering_angle.tobytes() == other.steering_angle.tobytes()
        assert one.plan is not None
        assert other.plan is not None
        assert one.plan.tobytes() == other.plan.tobytes()
    assert other.candidates is None
    assert one.tracks is not None
    assert other.tracks is not None
    assert one.tracks.tobytes() == other.tracks.tobytes()
