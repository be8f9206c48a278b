"""Where the ego's lane ends: it changes to the one that goes on, or stands before the end."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.kernel import strips
from adeye.signals import EGO_SPEED, EGO_X, EGO_Y, OK, RoadMap
from adeye.simulate.channels.nominal import NominalChannel
from adeye.simulate.channels.trajectory.channel import TrajectoryChannel
from adeye.spec.channels import NominalParameters, SafetyParameters, TrajectoryParameters
from adeye.testing import Drive, World, channel_context, drive
from adeye.testing.scenes import passenger_car, straight_road
from tests.simulate.channels.perceived import LINKS, SENSORS
from tests.simulate.channels.safety import supervised

END = 300.0
WIDTH = 3.5
LIMIT = 130.0 / 3.6
CAR = passenger_car()
CHANNELS: dict[str, Any] = {
    "nominal": (NominalChannel, NominalParameters),
    "trajectory": (TrajectoryChannel, TrajectoryParameters),
}
by_both = pytest.mark.parametrize("kind", sorted(CHANNELS))


def ending(*lanes: int, of: int = 2, end: float = END) -> RoadMap:
    """Return a road of some lanes of which these end, at once, with nothing beside them."""

    def driven(numbers: list[int]) -> list[list[float]]:
        places = [(WIDTH * lane, 0.0, WIDTH * (lane + 1), 0.0) for lane in numbers]
        return [
            [strips.DRIVING, strips.OWN, LIMIT, float(number), *place]
            for number, place in enumerate(places)
        ]

    before, behind = driven(list(range(of))), driven([k for k in range(of) if k not in lanes])
    slabs = [[0.0, 0.0, of, of], [end, of, len(behind), len(behind)]]
    return replace(
        straight_road(lanes=of), slabs=np.array([slabs]), strips=np.array([before + behind])
    )


def run(kind: str, world: World, horizon: float = 20.0, rear_sight: str = "150 m") -> Drive:
    channel, parameters = CHANNELS[kind]
    made = channel()
    made.reset(
        channel_context(
            parameters(rear_sight=rear_sight),
            links=LINKS,
            sensors={name: SENSORS[name] for name in LINKS},
            desired_speed=30.0,
            road=world.road,
        )
    )
    return drive({"c": made}, {"c": LINKS}, world, horizon=horizon)


def lateral(done: Drive, s: float) -> float:
    """Return where the ego was across the road at a place along it [m]."""
    return float(np.interp(s, done.ego[:, EGO_X], done.ego[:, EGO_Y]))


def in_lane(lane: int, *vehicles: tuple[float, float]) -> Callable[[float], list[list[float]]]:
    """Return vehicles of a lane by their place and speed at the start."""
    y = (lane + 0.5) * WIDTH
    return lambda time: [[s + speed * time, y, 0.0, speed, 0.0] for s, speed in vehicles]


@by_both
@pytest.mark.parametrize(("ends", "other"), [(0, 1), (1, 0)])
def test_ego_leaves_a_lane_that_ends_on_either_side_without_braking(
    kind: str, ends: int, other: int
) -> None:
    done = run(kind, World(road=ending(ends), lane=ends, speed=25.0))
    assert lateral(done, END - 10.0) == pytest.approx((other + 0.5) * WIDTH, abs=0.3)
    assert done.ego[:, EGO_SPEED].min() > 24.0
    assert (done.status == OK).all()


@by_both
def test_ego_merges_between_two_cars(kind: str) -> None:
    traffic = in_lane(1, (45.0, 25.0), (-40.0, 25.0))
    done = run(kind, World(road=ending(0), lane=0, speed=25.0, objects=traffic))
    assert lateral(done, END - 10.0) == pytest.approx(1.5 * WIDTH, abs=0.3)
    assert done.distance.min() > 2.0
    behind, ahead = (done.objects[-1][row][0] for row in (1, 0))
    assert behind < done.ego[-1, EGO_X] < ahead


@by_both
def test_without_a_gap_the_ego_stands_before_the_end(kind: str) -> None:
    column = in_lane(1, *((s, 25.0) for s in np.arange(-900.0, 100.0, 15.0)))
    done = run(kind, World(road=ending(0), lane=0, speed=25.0, objects=column), 30.0)
    assert done.ego[-1, EGO_SPEED] < 0.05
    assert END - 40.0 < done.ego[-1, EGO_X] < END - 20.0
    assert abs(done.ego[:, EGO_Y] - 0.5 * WIDTH).max() < 0.6


def closing_in(start: float, since: float, rate: float) -> Callable[[float], list[list[float]]]:
    """Return a car in lane 1 that is as fast as the ego, and from a time on up to 15 m/s faster."""

    def at(time: float) -> list[list[float]]:
        faster = min(rate * max(0.0, time - since), 15.0)
        way = 25.0 * time + faster * max(0.0, time - since) - 0.5 * faster**2 / rate
        return [[start + way, 1.5 * WIDTH, 0.0, 25.0 + faster, 0.0]]

    return at


@pytest.mark.parametrize(
    ("kind", "closing"),
    [("nominal", closing_in(-40.0, 0.8, 5.0)), ("trajectory", closing_in(-34.0, 0.0, 8.0))],
)
def test_a_change_is_given_up_where_the_gap_closes_before_the_ego_is_in_it(
    kind: str, closing: Callable[[float], list[list[float]]]
) -> None:
    done = run(kind, World(road=ending(0), lane=0, speed=25.0, objects=closing), 25.0)
    aside = done.ego[:, EGO_Y] - 0.5 * WIDTH
    ahead = np.array([car[0] for (car,) in done.objects]) - done.ego[:, EGO_X]
    until = int(np.argmax(ahead > CAR.length))
    # It had begun, its body stayed out of the other lane, and it went back.
    assert 0.3 < aside[:until].max() < 0.5 * (WIDTH - CAR.width)
    assert aside[until] < 0.9 * aside[:until].max()
    # Behind who has come by it changes after all.
    assert done.distance.min() > 1.0
    assert lateral(done, END - 10.0) == pytest.approx(1.5 * WIDTH, abs=0.3)


@by_both
def test_who_does_not_look_back_stands_before_the_end_and_enters_no_lane(kind: str) -> None:
    done = run(kind, World(road=ending(0), lane=0, speed=25.0), 30.0, "0 m")
    assert done.ego[-1, EGO_SPEED] < 0.05
    assert done.ego[-1, EGO_X] < END - 10.0
    assert abs(done.ego[:, EGO_Y] - 0.5 * WIDTH).max() < 0.6


@by_both
def test_several_lanes_that_end_are_left_one_after_the_other(kind: str) -> None:
    done = run(kind, World(road=ending(1, 2, of=3), lane=2, speed=20.0))
    assert lateral(done, END - 10.0) == pytest.approx(0.5 * WIDTH, abs=0.3)


@by_both
def test_nobody_leaves_a_lane_that_goes_on(kind: str) -> None:
    done = run(kind, World(road=ending(0), lane=1, speed=25.0))
    assert abs(done.ego[:, EGO_Y] - 1.5 * WIDTH).max() < 0.1


@pytest.mark.parametrize("stop", ["in_lane", "planned"])
@pytest.mark.parametrize("ends", [0, 1])
def test_a_safe_stop_in_a_lane_that_ends_stands_before_its_end(stop: Any, ends: int) -> None:
    """At the stop deceleration it would stand 20 m beyond."""
    done = supervised.run(
        World(road=ending(ends, end=110.0), lane=ends, speed=30.0),
        SafetyParameters(stop=stop),
        9.0,
        on_commands=supervised.silence(0.0),
        links=("truth", "channels.nominal", "switch"),
    )
    assert done.ego[-1, EGO_SPEED] < 0.05
    assert done.ego[-1, EGO_X] + 0.5 * CAR.length < 110.0
    assert abs(done.ego[:, EGO_Y] - (ends + 0.5) * WIDTH).max() < 0.6


@by_both
def test_who_stands_before_the_end_goes_on_once_the_lane_beside_is_free(kind: str) -> None:
    column = in_lane(1, *((s, 25.0) for s in np.arange(-300.0, 100.0, 15.0)))
    world = World(road=ending(0), lane=0, speed=25.0, objects=column)
    done = run(kind, world, 45.0, "300 m")
    assert done.ego[:, EGO_SPEED].min() < 0.05
    assert done.ego[-1, EGO_X] > END
    assert lateral(done, END - 2.0) == pytest.approx(1.5 * WIDTH, abs=0.9)
