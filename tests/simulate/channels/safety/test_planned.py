"""The channel around the planner: contract, monitors, batches."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.signals import REQUESTS_AUTHORITY, Floats
from adeye.simulate.channels.factory import make_channel
from adeye.simulate.channels.links import observe
from adeye.simulate.channels.nominal import NominalChannel
from adeye.simulate.channels.safety import PlannedSafetyChannel, SafetyChannel
from adeye.simulate.channels.safety.planned_stop import LAST_SAFE_STOP
from adeye.spec.channels import NominalParameters, SafetyParameters, StopRatings
from adeye.spec.switch import Switch
from adeye.testing import Drive, World, channel_context, check_channel, drive
from adeye.testing.driving import Hook
from adeye.testing.scenes import object_measurement, straight_road
from tests.simulate.channels.safety.test_supervision import LINKS, SAFETY, silence

PLANNED = SafetyParameters(stop="planned")


@pytest.mark.slow
@pytest.mark.parametrize("links", [LINKS["safety"], ("truth",), ("channels.nominal",)])
def test_conforms(links: tuple[str, ...]) -> None:
    sensors = {"truth": "ground_truth"} if "truth" in links else {"x": "radar"}
    check_channel(PlannedSafetyChannel, PLANNED, links=links, sensors=sensors)


def test_runs_of_a_batch_decide_as_they_do_alone() -> None:
    runs = 3
    speeds, lanes = np.array([30.0, 22.0, 14.0]), np.array([1.75, 5.25, 1.75])

    def drive_batch(chosen: Sequence[int]) -> list[Floats]:
        channel, size = PlannedSafetyChannel(), len(chosen)
        channel.reset(
            channel_context(PLANNED, links=("truth",), sensors={"truth": "ground_truth"}, runs=size)
        )
        road, answers = straight_road(size), []
        for tick in range(60):
            time = 0.05 * tick
            ego = np.zeros((size, 7))
            ego[:, 3], ego[:, 1] = speeds[chosen], lanes[chosen]
            ego[:, 0] = speeds[chosen] * time
            objects = np.zeros((size, 1, 5))
            objects[:, 0, 0], objects[:, 0, 1] = 80.0 + 5.0 * time, lanes[chosen]
            objects[:, 0, 3] = 5.0
            readings = {"truth": object_measurement(ego, objects, time, road=road)}
            running = np.ones(size, dtype=np.bool_)
            seen = observe(("truth",), time, readings, {}, None, running, protect=False)
            answer = channel.act(seen)
            assert answer.candidate_costs is not None
            answers.append(
                np.column_stack(
                    [answer.acceleration, answer.steering_angle, answer.candidate_costs]
                )
            )
        return answers

    together = drive_batch(range(runs))
    for number in range(runs):
        alone = drive_batch([number])
        for one, all_ in zip(alone, together, strict=True):
            assert one[0].tobytes() == all_[number].tobytes()


def test_only_the_planned_channel_has_the_monitor_of_the_last_safe_stop() -> None:
    assert "last_safe_stop" not in SafetyChannel.monitor_ids
    assert PlannedSafetyChannel.monitor_ids[LAST_SAFE_STOP] == "last_safe_stop"


def test_parameters_say_which_channel_is_made() -> None:
    for parameters, count in ((None, 4), (SafetyParameters(), 4), (PLANNED, 5)):
        assert len(make_channel("safety", Path(), parameters).monitor_ids) == count


# The planned stop in closed loop: nominal and safety channel, switch and the ego's dynamics.

SLOW, SHOULDER = 1.75, -1.25


def run(
    world: World,
    horizon: float = 16.0,
    *,
    parameters: SafetyParameters = PLANNED,
    on_commands: Hook | None = None,
) -> Drive:
    nominal, safety = NominalChannel(), PlannedSafetyChannel()
    road = world.road or straight_road()
    sensors = {
        "nominal": {"front": "radar", "pose": "localisation"},
        "safety": {"truth": "ground_truth"},
    }
    for name, channel, numbers in (
        ("nominal", nominal, NominalParameters()),
        ("safety", safety, parameters),
    ):
        context = channel_context(
            numbers,
            links=LINKS[name],
            sensors=sensors[name],
            channel_id=name,
            desired_speed=world.speed,
            road=road,
        )
        channel.reset(context)
    switch = Switch(
        policy="fixed_priority", priority=("safety", "nominal"), default="nominal", latch=True
    )
    channels: dict[str, Any] = {"nominal": nominal, "safety": safety}
    return drive(channels, LINKS, world, horizon=horizon, switch=switch, on_commands=on_commands)


def fired(done: Drive, column: int = 1) -> Floats:
    rows = [shown[SAFETY] for shown in done.monitors]
    return np.array([row[LAST_SAFE_STOP, column] for row in rows if row is not None])


def standing(place: Sequence[Sequence[float]]) -> Any:
    return lambda _time: [[s, d, 0.0, 0.0, 0.0] for s, d in place]


def test_from_the_slow_lane_it_stops_on_the_shoulder() -> None:
    done = run(World(lane=0), on_commands=silence(1.0))
    assert done.ego[-1, 3] == 0.0
    assert done.ego[-1, 1] == pytest.approx(SHOULDER, abs=0.1)
    assert done.ego[:, 4].min() >= -4.0 - 1e-9
    assert not fired(done, 0).any()


def test_lane_that_the_sensors_do_not_see_from_behind_is_not_entered() -> None:
    done = run(World(lane=1), on_commands=silence(1.0))
    assert done.ego[:, 1] == pytest.approx(5.25, abs=0.1)


def test_lane_that_is_seen_to_be_free_is_crossed() -> None:
    far = SafetyParameters(stop="planned", rear_sight="400 m")
    done = run(World(lane=1), parameters=far, on_commands=silence(1.0))
    # All of its width of 1.8 m is on the shoulder.
    assert -1.6 < done.ego[-1, 1] < -0.9


def test_blocked_shoulder_leaves_the_lane() -> None:
    places = [(s, SHOULDER) for s in (90.0, 110.0, 130.0, 150.0, 170.0, 190.0)]
    done = run(World(lane=0, objects=standing(places)), on_commands=silence(1.0))
    assert done.ego[-1, 3] == 0.0
    assert done.ego[:, 1] == pytest.approx(SLOW, abs=0.2)
    assert done.distance.min() > 0.5


def test_other_ratings_choose_another_place() -> None:
    rated = SafetyParameters(stop="planned", ratings=StopRatings(hard_shoulder=6))
    done = run(World(lane=0), parameters=rated, on_commands=silence(1.0))
    assert done.ego[:, 1] == pytest.approx(SLOW, abs=0.1)


def test_stop_in_a_curve_follows_the_lane() -> None:
    road = straight_road(curvature=1.0 / 600.0)
    rated = SafetyParameters(stop="planned", ratings=StopRatings(hard_shoulder=8))
    world = World(lane=0, road=road, speed=20.0)
    done = run(world, 14.0, parameters=rated, on_commands=silence(1.0))
    assert done.ego[-1, 3] == 0.0
    # The centre of the curve lies 600 m to the left of the right edge.
    away = np.hypot(done.ego[:, 0], done.ego[:, 1] - 600.0)
    assert 600.0 - away == pytest.approx(SLOW, abs=0.3)


def test_without_any_safe_stop_ahead_the_last_one_is_taken() -> None:
    wall = World(
        lane=1, objects=standing([(160.0, d) for d in (-1.25, 1.75, 5.25, 8.75)]), sight=0.0
    )
    done = run(wall)
    first = int(np.argmax(done.authority == SAFETY))
    assert done.status[first, SAFETY] == REQUESTS_AUTHORITY
    assert done.distance.min() > 0.0
    assert done.ego[-1, 3] == 0.0


def test_last_safe_stop_fires_where_no_stop_is_left() -> None:
    """Something that was not seen before stands 30 m ahead at 30 m/s: nothing is feasible."""

    def appears(time: float) -> list[list[float]]:
        places = [[60.0, d, 0.0, 0.0, 0.0] for d in (-1.25, 1.75, 5.25, 8.75)]
        return places if time >= 1.0 else [[900.0, *place[1:]] for place in places]

    done = run(World(lane=1, objects=appears, sight=0.0), 1.6)
    assert fired(done, 0).any()
    # In the lane with all that the brakes give is the least harm.
    assert done.proposals[-1, SAFETY, 0] == -8.0
    assert not fired(run(World(lane=1), 2.0), 0).any()


def test_choice_is_kept_while_it_is_feasible() -> None:
    done = run(World(lane=0), on_commands=silence(1.0))
    sideways = np.diff(done.ego[:, 1])
    # Once on its way to the shoulder it never turns back.
    assert sideways.max() < 2e-3
    begun = done.proposals[30:, SAFETY, 0]
    assert (np.diff(begun[:40]) <= 1e-9).all()
