import numpy as np
import pytest

from adeye.signals import DEGRADED, OK
from adeye.simulate.channels.links import observe
from adeye.simulate.channels.safety import SafetyChannel
from adeye.simulate.channels.safety.in_lane import ticks_within
from adeye.spec.channels import SafetyParameters
from adeye.testing import channel_context, check_channel
from adeye.testing.scenes import object_measurement, straight_road

LINKS = ("truth", "channels.nominal", "switch")


@pytest.mark.slow
@pytest.mark.parametrize("links", [LINKS, ("truth",), ("channels.nominal",)])
def test_conforms(links: tuple[str, ...]) -> None:
    sensors = {"truth": "ground_truth"} if "truth" in links else {}
    check_channel(SafetyChannel, SafetyParameters(), links=links, sensors=sensors or {"x": "radar"})


def test_monitors_are_named_in_the_order_of_their_columns() -> None:
    assert SafetyChannel.monitor_ids == (
        "nominal_silent",
        "nominal_implausible",
        "object_danger",
        "lane_departure",
    )


def test_durations_are_rounded_up_to_ticks_of_the_channel() -> None:
    assert [ticks_within(t, 0.05) for t in (0.0, 0.05, 0.06, 0.1, 0.3)] == [0, 1, 2, 2, 6]


def test_dead_sensor_degrades_the_channel() -> None:
    channel, road = SafetyChannel(), straight_road()
    channel.reset(
        channel_context(
            SafetyParameters(),
            links=("truth", "rear"),
            sensors={"truth": "ground_truth", "rear": "radar"},
        )
    )
    ego = np.array([[0.0, 5.25, 0.0, 20.0, 0.0, 0.0, 0.0]])
    rear = object_measurement(ego, np.zeros((1, 0, 5)), 0.0)
    readings = {"truth": object_measurement(ego, np.zeros((1, 0, 5)), 0.0, road=road), "rear": rear}
    running = np.ones(1, dtype=np.bool_)
    statuses = []
    for alive in (True, False):
        rear.alive[:] = alive
        seen = observe(("truth", "rear"), 0.0, readings, {}, None, running, protect=False)
        statuses.append(int(channel.act(seen).status[0]))
    assert statuses == [OK, DEGRADED]
