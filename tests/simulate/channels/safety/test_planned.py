"""The channel around the planner: contract, monitors, batches."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from adeye.signals import Floats
from adeye.simulate.channels.factory import make_channel
from adeye.simulate.channels.links import observe
from adeye.simulate.channels.safety import PlannedSafetyChannel, SafetyChannel
from adeye.simulate.channels.safety.planned_stop import LAST_SAFE_STOP
from adeye.spec.channels import SafetyParameters
from adeye.testing import channel_context, check_channel
from adeye.testing.scenes import object_measurement, straight_road
from tests.simulate.channels.safety.test_supervision import LINKS

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
