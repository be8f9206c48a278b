"""The decision in closed loop: nominal and safety channel, switch and the ego's dynamics."""

from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.signals import Bools
from adeye.simulate.channels.safety import SafetyChannel
from adeye.simulate.channels.safety.in_lane import (
    MEMORY_STOPPING,
    MEMORY_WIDTH,
    ticks_within,
    update_stopping,
)
from adeye.spec.channels import SafetyParameters
from adeye.spec.switch import Switch
from adeye.testing import Drive, ScriptedChannel, World, channel_context, check_channel
from tests.simulate.channels.perceived import shown
from tests.simulate.channels.safety import supervised
from tests.simulate.channels.safety.supervised import LATCHED, NOMINAL, SAFETY, column, silence

LANE = 5.25
IN_LANE = SafetyParameters()
LINKS = ("truth", "channels.nominal", "switch")


def run(world: World, horizon: float, **more: Any) -> Drive:
    return supervised.run(world, IN_LANE, horizon, **({"links": LINKS} | more))


def monitor(done: Drive, name: str, which: int = 1) -> Bools:
    return column(done, IN_LANE, name, which)


def test_nothing_is_requested_on_a_free_road() -> None:
    done = run(World(), 6.0)
    assert (done.status[:, SAFETY] == signals.OK).all()
    assert (done.authority == NOMINAL).all()


def test_silent_nominal_is_confirmed_after_staleness_and_the_confirm_time() -> None:
    done = run(World(), 3.0, on_commands=silence(1.0))
    first = int(np.argmax(done.status[:, SAFETY] == signals.REQUESTS_AUTHORITY))
    # The last command is of 0.95 s, and a linked channel is seen one tick late.
    raw = 0.95 + IN_LANE.staleness + 0.05
    assert done.time[monitor(done, "nominal_silent", 0).argmax()] == pytest.approx(raw)
    assert done.time[first] == pytest.approx(raw + IN_LANE.confirm)


def test_safe_stop_ends_in_standstill_in_the_lane_at_its_deceleration() -> None:
    done = run(World(offset=0.3), 14.0, on_commands=silence(1.0))
    assert done.ego[-1, 3] == 0.0
    assert done.ego[-1, 1] == pytest.approx(LANE, abs=0.1)
    assert done.ego[:, 4].min() >= -IN_LANE.stop_deceleration - 1e-9
    way = done.ego[-1, 0] - done.ego[20, 0]
    # 4 m/s² from 30 m/s, and 0.15 s to confirm, 0.16 s of ramp, 0.15 s of lag at full speed.
    assert way == pytest.approx(30.0**2 / 8.0 + 30.0 * 0.46, abs=5.0)


def test_stop_goes_on_after_healing_while_it_is_latched_or_the_switch_is_not_linked() -> None:
    healing = silence(1.0, 1.6)
    latched = run(World(), 16.0, on_commands=healing)
    assert latched.status[-1, SAFETY] == signals.OK
    assert latched.reason[-1] == signals.REASON_LATCHED
    unlinked = run(World(), 16.0, on_commands=healing, links=LINKS[:2])
    assert latched.ego[-1, 3] == unlinked.ego[-1, 3] == 0.0
    free = LATCHED.model_copy(update={"latch": False})
    done = run(World(), 16.0, on_commands=healing, switch=free)
    assert (done.authority[-1], done.reason[-1]) == (NOMINAL, signals.REASON_DEFAULT)
    assert done.ego[-1, 3] > 25.0
    assert done.proposals[-1, SAFETY, 0] > -0.5


def test_stop_is_given_up_once_hysteresis_returns_authority() -> None:
    content = {"policy": "hysteresis", "priority": ("safety", "nominal"), "default": "nominal"}
    spec = Switch.model_validate({**content, "return_after": "1 s"})
    done = run(World(), 16.0, on_commands=silence(1.0, 1.6), switch=spec)
    taken = np.flatnonzero(done.authority == SAFETY)
    assert done.reason[taken[-1] + 1] == signals.REASON_RETURNED
    assert (done.authority[taken[-1] + 1 :] == NOMINAL).all()
    assert done.ego[-1, 3] > 25.0
    assert done.proposals[-1, SAFETY, 0] > -0.5


def test_stop_goes_on_unless_another_channel_acts_in_the_ordinary_way() -> None:
    for reason, goes_on in (
        (signals.REASON_DEFAULT, False),
        (signals.REASON_VOTED, False),
        (signals.REASON_HANDOVER, True),
        (signals.REASON_NO_MAJORITY, True),
        (signals.REASON_LATCHED, True),
    ):
        memory = np.zeros(MEMORY_WIDTH)
        memory[MEMORY_STOPPING] = 1.0
        update_stopping(memory, False, reason, 0.0)  # noqa: FBT003 - a kernel
        assert bool(memory[MEMORY_STOPPING]) == goes_on, reason


def test_blind_nominal_channel_is_overridden_for_a_stopped_vehicle() -> None:
    world = World(objects=lambda _: [[200.0, LANE, 0.0, 0.0, 0.0]], sight=0.0)
    done = run(world, 14.0)
    assert done.distance.min() > 0.5
    first = int(np.argmax(done.authority == SAFETY))
    required = 30.0**2 / (2.0 * done.distance[first])
    assert IN_LANE.danger_threshold <= required < 6.0
    assert done.reason[first] == signals.REASON_REQUEST
    assert monitor(done, "object_danger")[first]


def test_pedestrian_entering_the_path_of_a_blind_nominal_channel_is_not_hit() -> None:
    def crossing(time: float) -> list[list[float]]:
        return [[55.0, -2.0 + 1.5 * time, np.pi / 2, 1.5, 0.0]]

    world = World(objects=crossing, size=(0.5, 0.6), object_class=6, sight=0.0, speed=13.9)
    blind = run(world, 6.0)
    assert blind.distance.min() > 0.5
    assert monitor(blind, "object_danger").any()


def test_implausible_command_is_overridden() -> None:
    done = run(World(), 4.0, nominal=ScriptedChannel([0.0] * 20 + [-25.0]))
    assert monitor(done, "nominal_implausible")[-1]
    assert done.authority[-1] == SAFETY
    done = run(World(), 2.0, nominal=ScriptedChannel([0.0], [0.0] * 20 + [0.9]))
    assert monitor(done, "nominal_implausible").any()


def test_departure_is_stopped_and_led_back_to_the_lane_that_was_left() -> None:
    done = run(World(speed=20.0), 14.0, nominal=ScriptedChannel([0.0], [0.005]))
    assert monitor(done, "lane_departure").any()
    assert done.authority[-1] == SAFETY
    assert done.ego[-1, 3] == 0.0
    assert done.ego[-1, 1] == pytest.approx(LANE, abs=0.3)


def test_shadow_command_follows_gently() -> None:
    lead = World(objects=lambda t: [[60.0 + 20.0 * t, LANE, 0.0, 20.0, 0.0]], speed=20.0)
    done = run(lead, 10.0)
    assert (done.authority == NOMINAL).all()
    assert done.proposals[:, SAFETY, 0].min() > -1.0


def test_without_ego_estimate_the_channel_is_in_fault() -> None:
    done = run(World(), 1.0, links=("front", "channels.nominal"))
    assert (done.status[:, SAFETY] == signals.FAULT).all()


def test_without_channel_link_silence_never_fires() -> None:
    done = run(World(), 2.0, on_commands=silence(1.0), links=("truth",))
    assert not monitor(done, "nominal_silent", 0).any()


@pytest.mark.slow
def test_conforms() -> None:
    for links in (LINKS, ("truth",), ("channels.nominal",)):
        sensors = {"truth": "ground_truth"} if "truth" in links else {"x": "radar"}
        check_channel(SafetyChannel, IN_LANE, links=links, sensors=sensors)


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
    channel, links = SafetyChannel(), ("truth", "rear")
    sensors = {"truth": "ground_truth", "rear": "radar"}
    channel.reset(channel_context(IN_LANE, links=links, sensors=sensors))
    for alive, status in ((True, signals.OK), (False, signals.DEGRADED)):
        seen = shown([0.0, LANE, 0.0, 20.0], links=links, alive=alive)
        assert channel.act(seen).status.tolist() == [status]
