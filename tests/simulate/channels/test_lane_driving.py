"""What both channels that drive in a lane must do, whichever way they decide it."""

from typing import Any

import numpy as np
import pytest

from adeye.signals import DEGRADED, FAULT, OK
from adeye.simulate.channels.nominal import NominalChannel
from adeye.simulate.channels.trajectory.channel import TrajectoryChannel
from adeye.spec.channels import NominalParameters, TrajectoryParameters
from adeye.testing import Drive, World, channel_context, drive
from adeye.testing.scenes import ego_estimate, straight_road
from tests.simulate.channels.perceived import LINKS, SENSORS, shown

LANE = 5.25
CHANNELS: dict[str, Any] = {
    "nominal": (NominalChannel, NominalParameters),
    "trajectory": (TrajectoryChannel, TrajectoryParameters),
}
by_both = pytest.mark.parametrize("kind", sorted(CHANNELS))


def made(kind: str, *, links: Any = LINKS, desired: float = 30.0, road: Any = None) -> Any:
    channel, parameters = CHANNELS[kind]
    built = channel()
    sensors = {name: SENSORS[name] for name in links}
    context = channel_context(
        parameters(), links=links, sensors=sensors, desired_speed=desired, road=road
    )
    built.reset(context)
    return built


def run(kind: str, world: World, horizon: float, desired: float = 30.0) -> Drive:
    channel = made(kind, desired=desired, road=world.road)
    return drive({"c": channel}, {"c": LINKS}, world, horizon=horizon)


@by_both
def test_free_road_is_driven_at_the_desired_speed_in_the_lane(kind: str) -> None:
    done = run(kind, World(speed=25.0, offset=0.8), 30.0)
    tolerance = {"nominal": 0.5, "trajectory": 0.3}[kind]
    assert done.ego[-1, 3] == pytest.approx(30.0, abs=tolerance)
    assert done.ego[-1, 1] == pytest.approx(LANE, abs=0.02)
    assert kind == "nominal" or done.proposals[:, 0, 0].max() <= 1.5
    assert (done.status == OK).all()


@by_both
def test_speed_limit_is_kept(kind: str) -> None:
    done = run(kind, World(speed=36.0), 20.0, desired=60.0)
    tolerance = {"nominal": 0.1, "trajectory": 0.3}[kind]
    assert done.ego[:, 3].max() < 130.0 / 3.6 + tolerance


@by_both
@pytest.mark.parametrize("latency", [0, 4])
def test_stopped_lead_first_seen_at_150_m_is_not_touched(kind: str, latency: int) -> None:
    stopped = World(objects=lambda _: [[300.0, LANE, 0.0, 0.0, 0.0]], sight=150.0, latency=latency)
    done = run(kind, stopped, 22.0)
    assert done.distance.min() > {"nominal": 2.0, "trajectory": 2.5}[kind]
    assert done.ego[-1, 3] == 0.0
    # The one that plans stops in comfort.
    assert kind == "nominal" or done.proposals[:, 0, 0].min() > -4.5


@by_both
def test_slower_lead_is_followed_at_the_time_gap(kind: str) -> None:
    """Of the one that plans, it comes out of the costs: there is no car-following law in it."""
    done = run(kind, World(objects=lambda t: [[80.0 + 20.0 * t, LANE, 0.0, 20.0, 0.0]]), 60.0)
    assert done.ego[-1, 3] == pytest.approx(20.0, abs=0.2)
    if kind == "nominal":
        equilibrium = (4.0 + 1.8 * 20.0) / np.sqrt(1.0 - (20.0 / 30.0) ** 4)
        assert done.distance[-1] == pytest.approx(equilibrium, abs=1.0)
    else:
        assert done.distance[-1] == pytest.approx(4.0 + 1.8 * 20.0, abs=3.0)
        assert done.proposals[:, 0, 0].min() > -2.5


@by_both
def test_braking_lead_is_not_touched(kind: str) -> None:
    def braking(time: float) -> list[list[float]]:
        t = min(max(0.0, time - 3.0), 5.0)
        x = 60.0 + 30.0 * min(time, 3.0) + 30.0 * t - 3.0 * t * t
        return [[x, LANE, 0.0, 30.0 - 6.0 * t, -6.0]]

    done = run(kind, World(objects=braking), 24.0)
    assert done.distance.min() > {"nominal": 1.0, "trajectory": 2.0}[kind]
    assert done.ego[-1, 3] == 0.0


@by_both
@pytest.mark.parametrize("y", [LANE + 3.5, LANE - 3.5])
def test_slow_vehicle_in_the_next_lane_is_passed_without_braking(kind: str, y: float) -> None:
    done = run(kind, World(objects=lambda t: [[150.0 + 10.0 * t, y, 0.0, 10.0, 0.0]]), 12.0)
    assert done.proposals[:, 0, 0].min() > -0.5
    assert np.abs(done.ego[:, 1] - LANE).max() < 0.6


@by_both
def test_cutting_in_vehicle_is_reacted_to_before_it_is_in_the_lane(kind: str) -> None:
    def cutting(time: float) -> list[list[float]]:
        y = LANE + 3.5 - 3.5 * min(max(0.0, (time - 3.0) / 3.0), 1.0)
        return [[45.0 + 24.0 * time, y, 0.0, 24.0, 0.0]]

    done = run(kind, World(objects=cutting), 15.0)
    first = int(np.argmax(done.proposals[:, 0, 0] < -1.0))
    assert 3.0 < done.time[first] < 4.6
    assert done.distance.min() > {"nominal": 3.0, "trajectory": 5.0}[kind]


@by_both
def test_crossing_pedestrian_is_not_touched_and_not_raced(kind: str) -> None:
    def crossing(time: float) -> list[list[float]]:
        walked = 1.5 * max(0.0, time - 2.0)
        return [[80.0, -1.0 + walked, np.pi / 2, 1.5 if time >= 2.0 else 0.0, 0.0]]

    world = World(objects=crossing, size=(0.5, 0.6), object_class=6, speed=13.9)
    done = run(kind, world, 14.0, desired=13.9)
    assert done.distance.min() > {"nominal": 0.5, "trajectory": 1.0}[kind]
    assert done.ego[:, 3].max() < 14.5


@by_both
@pytest.mark.parametrize("curvature", [1.0 / 300.0, -1.0 / 300.0])
def test_lane_is_kept_in_a_curve_at_the_speed_that_it_allows(kind: str, curvature: float) -> None:
    road = straight_road(curvature=curvature)
    done = run(kind, World(road=road, offset=0.5, speed=28.0), 14.0)
    last = ego_estimate(road, done.ego[-1:])[0]
    assert last[8] == pytest.approx(LANE, abs=0.05)
    assert last[3] ** 2 * abs(curvature) < 3.3


@by_both
def test_without_ego_estimate_the_channel_is_in_fault(kind: str) -> None:
    channel = made(kind, links=("front",))
    done = drive({"c": channel}, {"c": ("front",)}, World(), horizon=0.5)
    assert (done.status == FAULT).all()


@by_both
def test_dead_sensor_degrades_the_channel(kind: str) -> None:
    seen = shown([0.0, LANE, 0.0, 20.0], alive=False)
    assert made(kind).act(seen).status.tolist() == [DEGRADED]
