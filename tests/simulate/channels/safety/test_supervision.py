"""The decision in closed loop: nominal and safety channel, switch and the ego's dynamics."""

from typing import Any

import numpy as np
import pytest

from adeye.signals import (
    DEGRADED,
    FAULT,
    OK,
    REASON_DEFAULT,
    REASON_HANDOVER,
    REASON_LATCHED,
    REASON_NO_MAJORITY,
    REASON_REQUEST,
    REASON_RETURNED,
    REASON_VOTED,
    REQUESTS_AUTHORITY,
    SILENT,
    ControlCommand,
)
from adeye.simulate.channels.links import observe
from adeye.simulate.channels.nominal import NominalChannel
from adeye.simulate.channels.safety import SafetyChannel
from adeye.simulate.channels.safety.in_lane import (
    MEMORY_STOPPING,
    MEMORY_WIDTH,
    MONITOR_IDS,
    ticks_within,
    update_stopping,
)
from adeye.spec.channels import NominalParameters, SafetyParameters
from adeye.spec.switch import Switch
from adeye.testing import Drive, ScriptedChannel, World, channel_context, check_channel, drive
from adeye.testing.driving import Hook
from adeye.testing.scenes import object_measurement, straight_road

LANE = 5.25
NOMINAL, SAFETY = 0, 1
LINKS = {"nominal": ("front", "pose"), "safety": ("truth", "channels.nominal", "switch")}


def monitor(done: Drive, name: str, column: int) -> np.ndarray[Any, Any]:
    rows = [shown[SAFETY] for shown in done.monitors]
    return np.array([row[MONITOR_IDS.index(name), column] for row in rows if row is not None])


def run(  # noqa: PLR0913 - a test's choice
    world: World,
    horizon: float,
    *,
    desired: float = 30.0,
    on_commands: Hook | None = None,
    nominal: Any = None,
    latch: bool = True,
    switch: Switch | None = None,
    links: tuple[str, ...] = LINKS["safety"],
) -> Drive:
    driver = nominal or NominalChannel()
    driver.reset(
        channel_context(
            NominalParameters(),
            links=LINKS["nominal"],
            sensors={"front": "radar", "pose": "localisation"},
            channel_id="nominal",
            desired_speed=desired,
        )
    )
    safety = SafetyChannel()
    sensors = {"truth": "ground_truth", "front": "radar"}
    safety.reset(
        channel_context(
            SafetyParameters(),
            links=links,
            sensors={name: kind for name, kind in sensors.items() if name in links},
            channel_id="safety",
            desired_speed=desired,
        )
    )
    fixed = Switch(
        policy="fixed_priority", priority=("safety", "nominal"), default="nominal", latch=latch
    )
    return drive(
        {"nominal": driver, "safety": safety},
        LINKS | {"safety": links},
        world,
        horizon=horizon,
        switch=switch or fixed,
        on_commands=on_commands,
    )


def silence(first: float, last: float = np.inf) -> Hook:
    """Make the nominal channel silent for a while; the switch does not see it by its state."""

    def change(time: float, proposals: list[ControlCommand]) -> list[ControlCommand]:
        if not first - 1e-9 <= time < last - 1e-9:
            return proposals
        quiet = proposals[NOMINAL].copy()
        quiet.status[:] = SILENT
        quiet.stamp[:] = first - 0.05
        return [quiet, *proposals[SAFETY:]]

    return change


def test_nothing_is_requested_on_a_free_road() -> None:
    done = run(World(), 6.0)
    assert (done.status[:, SAFETY] == OK).all()
    assert (done.authority == NOMINAL).all()


def test_silent_nominal_is_confirmed_after_staleness_and_the_confirm_time() -> None:
    done = run(World(), 3.0, on_commands=silence(1.0))
    first = int(np.argmax(done.status[:, SAFETY] == REQUESTS_AUTHORITY))
    # The last command is of 0.95 s, and a linked channel is seen one tick late.
    raw = 0.95 + SafetyParameters().staleness + 0.05
    assert done.time[monitor(done, "nominal_silent", 0).argmax()] == pytest.approx(raw)
    assert done.time[first] == pytest.approx(raw + SafetyParameters().confirm)


def test_safe_stop_ends_in_standstill_in_the_lane_at_its_deceleration() -> None:
    done = run(World(offset=0.3), 14.0, on_commands=silence(1.0))
    assert done.ego[-1, 3] == 0.0
    assert done.ego[-1, 1] == pytest.approx(LANE, abs=0.1)
    assert done.ego[:, 4].min() >= -SafetyParameters().stop_deceleration - 1e-9


def test_stop_distance_is_that_of_the_stop_deceleration_and_its_onset() -> None:
    done = run(World(), 14.0, on_commands=silence(1.0))
    way = done.ego[-1, 0] - done.ego[20, 0]
    # 4 m/s² from 30 m/s, and 0.15 s to confirm, 0.16 s of ramp, 0.15 s of lag at full speed.
    assert way == pytest.approx(30.0**2 / 8.0 + 30.0 * 0.46, abs=5.0)


def test_latched_stop_goes_on_after_the_nominal_channel_has_recovered() -> None:
    done = run(World(), 16.0, on_commands=silence(1.0, 1.6))
    assert done.status[-1, SAFETY] == OK
    assert done.reason[-1] == REASON_LATCHED
    assert done.ego[-1, 3] == 0.0


def test_without_latch_the_nominal_channel_drives_on_after_healing() -> None:
    done = run(World(), 16.0, on_commands=silence(1.0, 1.6), latch=False)
    assert (done.authority[-1], done.reason[-1]) == (NOMINAL, REASON_DEFAULT)
    assert done.ego[-1, 3] > 25.0
    assert done.proposals[-1, SAFETY, 0] > -0.5


def test_stop_is_given_up_once_hysteresis_returns_authority() -> None:
    spec = Switch.model_validate(
        {
            "policy": "hysteresis",
            "priority": ("safety", "nominal"),
            "default": "nominal",
            "return_after": "1 s",
        }
    )
    done = run(World(), 16.0, on_commands=silence(1.0, 1.6), switch=spec)
    taken = np.flatnonzero(done.authority == SAFETY)
    assert done.reason[taken[-1] + 1] == REASON_RETURNED
    assert (done.authority[taken[-1] + 1 :] == NOMINAL).all()
    assert done.ego[-1, 3] > 25.0
    assert done.proposals[-1, SAFETY, 0] > -0.5


@pytest.mark.parametrize(
    ("reason", "goes_on"),
    [
        (REASON_DEFAULT, False),
        (REASON_VOTED, False),
        (REASON_HANDOVER, True),
        (REASON_NO_MAJORITY, True),
        (REASON_LATCHED, True),
    ],
)
def test_stop_goes_on_unless_another_channel_acts_in_the_ordinary_way(
    reason: int,
    goes_on: bool,  # noqa: FBT001 - a test's choice
) -> None:
    memory = np.zeros(MEMORY_WIDTH)
    memory[MEMORY_STOPPING] = 1.0
    update_stopping(memory, False, reason, 0.0)  # noqa: FBT003 - a kernel
    assert bool(memory[MEMORY_STOPPING]) == goes_on


def test_blind_nominal_channel_is_overridden_for_a_stopped_vehicle() -> None:
    world = World(objects=lambda _: [[200.0, LANE, 0.0, 0.0, 0.0]], sight=0.0)
    done = run(world, 14.0)
    assert done.distance.min() > 0.5
    first = int(np.argmax(done.authority == SAFETY))
    required = 30.0**2 / (2.0 * done.distance[first])
    assert SafetyParameters().danger_threshold <= required < 6.0
    assert done.reason[first] == REASON_REQUEST
    assert monitor(done, "object_danger", 1)[first]


def test_pedestrian_entering_the_path_of_a_blind_nominal_channel_is_not_hit() -> None:
    def crossing(time: float) -> list[list[float]]:
        return [[55.0, -2.0 + 1.5 * time, np.pi / 2, 1.5, 0.0]]

    world = World(objects=crossing, size=(0.5, 0.6), object_class=6, sight=0.0, speed=13.9)
    blind = run(world, 6.0, desired=13.9)
    assert blind.distance.min() > 0.5
    assert monitor(blind, "object_danger", 1).any()


def test_implausible_command_is_overridden() -> None:
    done = run(World(), 4.0, nominal=ScriptedChannel([0.0] * 20 + [-25.0]))
    assert monitor(done, "nominal_implausible", 1)[-1]
    assert done.authority[-1] == SAFETY
    done = run(World(), 2.0, nominal=ScriptedChannel([0.0], [0.0] * 20 + [0.9]))
    assert monitor(done, "nominal_implausible", 1).any()


def test_departure_is_stopped_and_led_back_to_the_lane_that_was_left() -> None:
    done = run(World(speed=20.0), 14.0, nominal=ScriptedChannel([0.0], [0.005]))
    assert monitor(done, "lane_departure", 1).any()
    assert done.authority[-1] == SAFETY
    assert done.ego[-1, 3] == 0.0
    assert done.ego[-1, 1] == pytest.approx(LANE, abs=0.3)


def test_shadow_command_follows_gently() -> None:
    lead = World(objects=lambda t: [[60.0 + 20.0 * t, LANE, 0.0, 20.0, 0.0]], speed=20.0)
    done = run(lead, 10.0, desired=20.0)
    assert (done.authority == NOMINAL).all()
    assert done.proposals[:, SAFETY, 0].min() > -1.0


def test_without_ego_estimate_the_channel_is_in_fault() -> None:
    done = run(World(), 1.0, links=("front", "channels.nominal"))
    assert (done.status[:, SAFETY] == FAULT).all()


def test_without_channel_link_silence_never_fires() -> None:
    done = run(World(), 2.0, on_commands=silence(1.0), links=("truth",))
    assert not monitor(done, "nominal_silent", 0).any()


def test_unlinked_switch_makes_a_stop_final() -> None:
    done = run(World(), 16.0, on_commands=silence(1.0, 1.6), links=("truth", "channels.nominal"))
    assert done.ego[-1, 3] == 0.0


LINKS_CHANNEL = ("truth", "channels.nominal", "switch")


@pytest.mark.slow
@pytest.mark.parametrize("links", [LINKS_CHANNEL, ("truth",), ("channels.nominal",)])
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
