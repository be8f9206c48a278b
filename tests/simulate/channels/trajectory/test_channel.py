"""The closed loop: what a driver would call cruise control, emergency braking and swerving."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.signals import ControlCommand
from adeye.simulate.channels.hooks import POINTS
from adeye.simulate.channels.trajectory.channel import CANDIDATES, TrajectoryChannel
from adeye.simulate.channels.trajectory.cost import SAMPLES
from adeye.spec.channels import TrajectoryParameters
from adeye.testing import Drive, World, channel_context, check_channel, drive
from tests.simulate.channels.perceived import LINKS, SENSORS, shown

LANE, LEFT, RIGHT = 5.25, 8.75, 1.75


def aside(done: Drive) -> float:
    """Return how far the ego came away from the centre of its lane [m]."""
    return float(np.abs(done.ego[:, 1] - LANE).max())


SEES_ALL_ROUND: dict[str, Any] = {"rear_sight": "120 m"}


def made(*, shows: bool = True, road: Any = None, desired: float = 30.0, **more: Any) -> Any:
    channel = TrajectoryChannel()
    parameters = TrajectoryParameters.model_validate(more)
    context = channel_context(
        parameters, links=LINKS, sensors=SENSORS, desired_speed=desired, road=road
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
def test_conforms_while_it_sees_all_round() -> None:
    parameters = TrajectoryParameters.model_validate(SEES_ALL_ROUND | {"weight_lane_change": 1.0})
    sensors = {"truth": "ground_truth"}
    check_channel(TrajectoryChannel, parameters, links=("truth",), sensors=sensors)


def test_ego_starts_from_standstill() -> None:
    done = run(World(speed=0.0), 15.0, desired=10.0)
    assert done.ego[-1, 3] == pytest.approx(10.0, abs=0.3)


def test_emergency_braking_is_used_when_it_is_needed() -> None:
    late = World(objects=lambda _: [[120.0, LANE, 0.0, 0.0, 0.0]], sight=40.0, speed=20.0)
    done = run(late, 10.0, desired=20.0)
    assert done.proposals[:, 0, 0].min() < -6.5
    assert done.distance.min() > 0.3
    assert aside(done) < 0.5


def test_wall_is_dodged_into_the_free_lane_only_where_braking_cannot_avoid_it() -> None:
    enough = run(World(objects=wall, sight=75.0), 9.0, **SEES_ALL_ROUND)
    assert aside(enough) < 0.6
    assert enough.distance.min() > 0.3
    done = run(World(objects=wall, sight=48.0), 8.0, **SEES_ALL_ROUND)
    assert done.distance.min() > 0.3
    assert abs(done.ego[-1, 1] - LANE) == pytest.approx(3.5, abs=0.1)
    assert np.abs(done.ego[:, 3] * done.ego[:, 6]).max() < 5.5


def test_of_two_lanes_the_one_that_is_free_is_taken() -> None:
    done = run(World(objects=wall_and(*beside(30.0, LEFT)), sight=48.0), 8.0, **SEES_ALL_ROUND)
    assert done.ego[-1, 1] == pytest.approx(RIGHT, abs=0.1)
    assert done.distance.min() > 0.3


def test_between_occupied_lanes_it_brakes_in_its_own() -> None:
    world = World(objects=wall_and(*beside(30.0, LEFT, RIGHT)), sight=48.0)
    done = run(world, 5.4, **SEES_ALL_ROUND)
    assert aside(done) < 0.6
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

    assert aside(run(World(objects=sudden(45.0)), 5.4, **SEES_ALL_ROUND)) < 0.6
    assert aside(run(World(objects=sudden(30.0)), 6.0, **SEES_ALL_ROUND)) > 3.0


def test_lane_that_nobody_looks_back_into_is_not_entered() -> None:
    done = run(World(objects=wall, sight=48.0), 5.4)
    assert aside(done) < 0.6
    assert done.proposals[:, 0, 0].min() == pytest.approx(-8.0, abs=0.3)


def test_shoulder_is_a_way_out_and_is_left_again() -> None:
    world = World(objects=lambda _: [[150.0, RIGHT, 0.0, 0.0, 0.0]], sight=48.0, lane=0)
    done = run(world, 14.0)
    assert done.distance.min() > 0.1
    assert done.ego[:, 1].min() < 0.0
    assert done.ego[-1, 1] == pytest.approx(RIGHT, abs=0.3)


def test_slow_lead_is_overtaken_only_where_lane_changes_are_cheap() -> None:
    slow = World(objects=lambda t: [[60.0 + 20.0 * t, LANE, 0.0, 20.0, 0.0]])
    assert aside(run(slow, 10.0, **SEES_ALL_ROUND)) < 0.6
    past = run(slow, 10.0, weight_lane_change=2.0, **SEES_ALL_ROUND)
    assert past.ego[-1, 0] > 60.0 + 20.0 * 10.0
    assert past.distance.min() > 1.0


def answer(channel: TrajectoryChannel, ticks: int = 8) -> ControlCommand:
    """Drive at 20 m/s towards something that stands 60 m ahead of the start."""
    for tick in range(ticks):
        time = 0.05 * tick
        seen = shown([20.0 * time, LANE, 0.0, 20.0], [60.0, LANE, 0.0, 0.0, 0.0], time)
        command = channel.act(seen)
    return command


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
    begin = np.array([20.0 * 0.05 * 7, LANE])
    assert np.abs(command.candidates[0, there, 0] - begin).max() < 0.2


def test_whoever_looks_changes_nothing() -> None:
    """Candidates that nobody looks at are dropped early, but never the best."""
    shown_to, hidden = made(**SEES_ALL_ROUND), made(shows=False, **SEES_ALL_ROUND)
    for ticks in (1, 4, 8):
        one, other = answer(shown_to, ticks), answer(hidden, ticks)
        for name in ("acceleration", "steering_angle", "plan", "tracks"):
            assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), name
    assert other.candidates is None
