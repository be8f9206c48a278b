"""The channel around the planner: contract, monitors, batches."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.signals import REQUESTS_AUTHORITY, Bools
from adeye.simulate.channels.factory import make_channel
from adeye.simulate.channels.safety import PlannedSafetyChannel, SafetyChannel
from adeye.simulate.channels.safety.planned_stop import LAST_SAFE_STOP
from adeye.spec.channels import SafetyParameters, StopRatings
from adeye.testing import Drive, World, check_channel
from adeye.testing.scenes import straight_road
from tests.simulate.channels.safety import supervised
from tests.simulate.channels.safety.supervised import LINKS, SAFETY, column, silence

PLANNED = SafetyParameters(stop="planned")


def run(world: World, item: SafetyParameters, horizon: float = 16.0, **more: Any) -> Drive:
    links = ("truth", "channels.nominal", "switch")
    return supervised.run(world, item, horizon, links=links, **more)


@pytest.mark.slow
def test_conforms() -> None:
    for links in (LINKS["safety"][:3], ("truth",), ("channels.nominal",)):
        sensors = {"truth": "ground_truth"} if "truth" in links else {"x": "radar"}
        check_channel(PlannedSafetyChannel, PLANNED, links=links, sensors=sensors)


def test_parameters_say_which_channel_is_made() -> None:
    for parameters in (None, SafetyParameters()):
        assert make_channel("safety", Path(), parameters).monitor_ids == SafetyChannel.monitor_ids
    planned = make_channel("safety", Path(), PLANNED).monitor_ids
    assert planned == (*SafetyChannel.monitor_ids, "last_safe_stop")
    assert planned[LAST_SAFE_STOP] == "last_safe_stop"


# The planned stop in closed loop: nominal and safety channel, switch and the ego's dynamics.

SLOW, SHOULDER = 1.75, -1.25
ACROSS = (-1.25, 1.75, 5.25, 8.75)


def fired(done: Drive) -> Bools:
    return column(done, PLANNED, "last_safe_stop", 0)


def standing(place: Sequence[Sequence[float]]) -> Any:
    return lambda _time: [[s, d, 0.0, 0.0, 0.0] for s, d in place]


def test_from_the_slow_lane_it_stops_on_the_shoulder_and_keeps_to_its_choice() -> None:
    done = run(World(lane=0), PLANNED, on_commands=silence(1.0))
    assert done.ego[-1, 3] == 0.0
    assert done.ego[-1, 1] == pytest.approx(SHOULDER, abs=0.1)
    assert done.ego[:, 4].min() >= -4.0 - 1e-9
    assert not fired(done).any()
    # Once on its way to the shoulder it never turns back.
    assert np.diff(done.ego[:, 1]).max() < 2e-3
    begun = done.proposals[30:, SAFETY, 0]
    assert (np.diff(begun[:40]) <= 1e-9).all()


def test_lane_is_crossed_only_where_it_is_seen_to_be_free_from_behind() -> None:
    blind = run(World(lane=1), PLANNED, on_commands=silence(1.0))
    assert blind.ego[:, 1] == pytest.approx(5.25, abs=0.1)
    far = SafetyParameters(stop="planned", rear_sight="400 m")
    done = run(World(lane=1), far, on_commands=silence(1.0))
    # All of its width of 1.8 m is on the shoulder.
    assert -1.6 < done.ego[-1, 1] < -0.9


def test_other_ratings_choose_another_place() -> None:
    rated = SafetyParameters(stop="planned", ratings=StopRatings(hard_shoulder=6))
    done = run(World(lane=0), rated, on_commands=silence(1.0))
    assert done.ego[:, 1] == pytest.approx(SLOW, abs=0.1)


def test_stop_in_a_curve_follows_the_lane() -> None:
    road = straight_road(curvature=1.0 / 600.0)
    rated = SafetyParameters(stop="planned", ratings=StopRatings(hard_shoulder=8))
    world = World(lane=0, road=road, speed=20.0)
    done = run(world, rated, 14.0, on_commands=silence(1.0))
    assert done.ego[-1, 3] == 0.0
    # The centre of the curve lies 600 m to the left of the right edge.
    away = np.hypot(done.ego[:, 0], done.ego[:, 1] - 600.0)
    assert 600.0 - away == pytest.approx(SLOW, abs=0.3)


def test_without_any_safe_stop_ahead_the_last_one_is_taken() -> None:
    places = standing([(160.0, d) for d in ACROSS])
    done = run(World(lane=1, objects=places, sight=0.0), PLANNED)
    first = int(np.argmax(done.authority == SAFETY))
    assert done.status[first, SAFETY] == REQUESTS_AUTHORITY
    assert done.distance.min() > 0.0
    assert done.ego[-1, 3] == 0.0


def test_last_safe_stop_fires_where_no_stop_is_left() -> None:
    """Something that was not seen before stands 30 m ahead at 30 m/s: nothing is feasible."""

    def appears(time: float) -> list[list[float]]:
        return [[60.0 if time >= 1.0 else 900.0, d, 0.0, 0.0, 0.0] for d in ACROSS]

    done = run(World(lane=1, objects=appears, sight=0.0), PLANNED, 1.6)
    assert fired(done).any()
    # In the lane with all that the brakes give is the least harm.
    assert done.proposals[-1, SAFETY, 0] == -8.0
    assert not fired(run(World(lane=1), PLANNED, 2.0)).any()
