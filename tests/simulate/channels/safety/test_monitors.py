"""The monitors of the stop in the lane: when each is raised and confirmed, and what follows."""

from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.kernel.stops import ONSET_JERK
from adeye.signals import FAULT, OK, SILENT, Bools, Floats, parameter_record
from adeye.simulate.channels.driving import HOLD_DECELERATION
from adeye.simulate.channels.safety import SafetyChannel, in_lane
from adeye.spec.architecture import Switch
from adeye.spec.channels import SafetyParameters
from adeye.testing import Drive, ScriptedChannel, World, channel_context, check_channel
from tests.simulate.channels.perceived import shown
from tests.simulate.channels.safety import supervised
from tests.simulate.channels.safety.supervised import LATCHED, NOMINAL, SAFETY, column, silence

RECORD = parameter_record(
    {
        "staleness": [0.2],
        "max_command": 10.0,
        "max_steering_angle": 0.6,
        "danger_threshold": 4.5,
        "max_lane_offset": 1.0,
        "confirm_ticks": 2,
        "heal_ticks": 3,
    }
)[0]


def evidence(**changes: float) -> Floats:
    seen = np.zeros(in_lane.EVIDENCE_WIDTH)
    defaults = {"channels": 1.0, "heard": 1.0, "time": 1.0, "pose": 1.0, "on_lanes": 1.0}
    for name, value in (defaults | changes).items():
        seen[getattr(in_lane, f"SEEN_{name.upper()}")] = value
    return seen


NAN, INF = float("nan"), float("inf")
FIRES: dict[Any, list[tuple[dict[str, float], bool]]] = {
    in_lane.nominal_silent: [
        ({"status": 1.0}, True),
        ({"age": 0.2}, False),
        ({"age": 0.21}, True),
        ({"age": NAN}, True),
        ({"heard": 0.0, "time": 0.2}, False),
        ({"heard": 0.0, "time": 0.25}, True),
        ({"channels": 0.0, "status": 1.0, "age": 9.0, "heard": 0.0}, False),
    ],
    in_lane.nominal_implausible: [
        ({"acceleration": 10.0}, False),
        ({"acceleration": 10.1}, True),
        ({"acceleration": NAN}, True),
        ({"acceleration": INF}, True),
        ({"steering": 0.6}, False),
        ({"steering": 0.61}, True),
        ({"channels": 0.0, "acceleration": NAN}, False),
    ],
    in_lane.object_danger: [
        ({"required": 4.49}, False),
        ({"required": 4.5}, True),
        ({"required": INF}, True),
        ({"required": NAN}, True),
        ({"required": INF, "pose": 0.0}, False),
    ],
    in_lane.lane_departure: [
        ({"offset": 1.0}, False),
        ({"offset": -1.01}, True),
        ({"offset": NAN}, True),
        ({"on_lanes": 0.0}, True),
        ({"offset": 2.0, "pose": 0.0}, False),
    ],
}


def test_monitor_fires_beyond_its_threshold_and_where_it_knows_no_number() -> None:
    for monitor, cases in FIRES.items():
        assert not monitor(RECORD, evidence())
        for changes, fires in cases:
            assert monitor(RECORD, evidence(**changes)) is fires, changes


def confirmed_after(pattern: str, confirm: int, heal: int) -> str:
    """Feed a pattern of x (fires) and . (rests); mark the ticks at which it is confirmed."""
    state = np.zeros(2, dtype=np.int64)
    marks = ""
    for mark in pattern:
        in_lane.debounce(state, mark == "x", confirm, heal)
        marks += "C" if state[1] else "."
    return marks


def test_debounce_counts_and_saturates() -> None:
    for pattern, confirm, heal, marks in (
        ("x", 0, 0, "C"),
        ("x.", 0, 0, "C."),
        ("xxxx", 2, 3, "..CC"),
        ("xx.xx.", 2, 3, "....CC"),
        ("x.x.x.", 2, 3, "......"),
        ("xxx....", 2, 3, "..CCCC."),
        ("xxx..x....", 2, 3, "..CCCCCC.."),
        ("xxxxxxxxx....", 2, 3, "..CCCCCCCCCC."),
    ):
        assert confirmed_after(pattern, confirm, heal)[: len(marks)] == marks, pattern


def test_confirmed_monitor_is_shown_beside_its_raw_state() -> None:
    states = np.zeros((len(in_lane.MONITOR_IDS), in_lane.STATE_WIDTH), dtype=np.int64)
    shown = np.zeros((len(in_lane.MONITOR_IDS), 2), dtype=np.bool_)
    danger = in_lane.MONITOR_IDS.index("object_danger")
    results = [
        in_lane.run_monitors(RECORD, evidence(required=9.0), states, shown) for _ in range(3)
    ]
    assert results == [False, False, True]
    assert shown[danger].tolist() == [True, True]
    assert not in_lane.run_monitors(RECORD, evidence(), np.zeros_like(states), shown)
    assert shown[danger].tolist() == [False, False]


@pytest.mark.parametrize("before", [0, 2, 5])
def test_frozen_monitors_show_what_they_showed_and_go_on_from_there(before: int) -> None:
    states = np.zeros((len(in_lane.MONITOR_IDS), in_lane.STATE_WIDTH), dtype=np.int64)
    shown = np.zeros((len(in_lane.MONITOR_IDS), 2), dtype=np.bool_)
    for _ in range(before):
        in_lane.run_monitors(RECORD, evidence(required=9.0), states, shown)
    last = shown.copy()
    states[:, in_lane.STATE_FROZEN] = 1
    kept = states.copy()
    for required in (0.0, 9.0, 9.0, 9.0, 9.0, 0.0, 0.0):
        confirmed = in_lane.run_monitors(RECORD, evidence(required=required), states, shown)
        assert confirmed == last[:, 1].any()
        assert shown.tolist() == last.tolist()
        assert states.tolist() == kept.tolist()
    states[:, in_lane.STATE_FROZEN] = 0
    other = states.copy()
    assert in_lane.run_monitors(RECORD, evidence(required=9.0), states, shown) == (before >= 2)
    assert not np.array_equal(states, other) or before == 5


def gathered(*rows: tuple[float, float, float, int], heard: bool = True) -> Floats:
    seen = np.zeros(in_lane.EVIDENCE_WIDTH)
    in_lane.gather_commands(
        1.0,
        np.array([row[:3] for row in rows], dtype=np.float64).reshape(-1, 3),
        np.array([row[3] for row in rows], dtype=np.int64),
        np.full(len(rows), heard),
        seen,
    )
    return seen


def test_worst_of_the_linked_channels_counts() -> None:
    seen = gathered((1.0, 0.1, 0.9, OK), (-3.0, -0.2, 0.6, FAULT))
    assert seen[[in_lane.SEEN_CHANNELS, in_lane.SEEN_STATUS]].tolist() == [2.0, 1.0]
    assert seen[in_lane.SEEN_AGE] == pytest.approx(0.4)
    assert seen[[in_lane.SEEN_ACCELERATION, in_lane.SEEN_STEERING]].tolist() == [3.0, 0.2]


def test_number_that_is_none_is_not_hidden_by_others() -> None:
    none, some = (np.nan, 0.0, 1.0, OK), (9.0, 0.0, 1.0, OK)
    assert np.isnan(gathered(none, some)[in_lane.SEEN_ACCELERATION])
    assert np.isnan(gathered(some, none)[in_lane.SEEN_ACCELERATION])


def test_channel_without_first_command_is_not_heard_and_nothing_linked_is_none() -> None:
    assert gathered((0.0, 0.0, -1.0, SILENT), heard=False)[in_lane.SEEN_HEARD] == 0.0
    assert gathered((0.0, 0.0, 1.0, OK), heard=False)[in_lane.SEEN_HEARD] == 1.0
    assert gathered()[in_lane.SEEN_CHANNELS] == 0.0


STEP = 0.05
RECORD_STOP = parameter_record(
    {"stop_deceleration": [4.0], "emergency_deceleration": 8.0, "period": STEP}
)[0]


def stop(ticks: int, required: float, start: float = 0.0, **more: Any) -> list[float]:
    known = {"is_danger": True} | more
    accelerations = [start]
    for _ in range(ticks):
        accelerations.append(
            in_lane.stop_acceleration(RECORD_STOP, accelerations[-1], 20.0, required, **known)
        )
    return accelerations[1:]


def test_stop_builds_up_at_the_onset_jerk_to_the_stop_deceleration() -> None:
    ramp = stop(10, 0.0)
    assert ramp[:3] == pytest.approx([-ONSET_JERK * STEP * k for k in (1, 2, 3)])
    assert ramp[-1] == -4.0


def test_object_ahead_is_braked_for_at_once_with_a_reserve_up_to_the_emergency() -> None:
    for ticks, required, wanted in (
        (1, 5.0, -5.0),
        (3, 5.0, -6.0),
        (3, 50.0, -8.0),
        (3, INF, -8.0),
    ):
        assert stop(ticks, required)[-1] == pytest.approx(wanted)


def test_braking_is_not_taken_back_before_standstill_where_the_ego_is_held() -> None:
    for speed, expected in ((10.0, -7.0), (0.0, -HOLD_DECELERATION)):
        found = in_lane.stop_acceleration(RECORD_STOP, -7.0, speed, 0.0, is_danger=True)
        assert found == expected


def test_healed_danger_leaves_the_stop_its_own_deceleration() -> None:
    healed = stop(40, 0.0, -7.0, is_danger=False)
    assert healed[-1] == -RECORD_STOP["stop_deceleration"]


# --- The decision in closed loop: nominal and safety channel, switch and the ego's dynamics -------

LANE = 5.25
IN_LANE = SafetyParameters()
LINKS = ("truth", "channels.nominal", "switch")


def run(world: World, horizon: float, **more: Any) -> Drive:
    return supervised.run(world, IN_LANE, horizon, **({"links": LINKS} | more))


def monitor(done: Drive, name: str, which: int = 1) -> Bools:
    return column(done, IN_LANE, name, which)


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
        memory = np.zeros(in_lane.MEMORY_WIDTH)
        memory[in_lane.MEMORY_STOPPING] = 1.0
        in_lane.update_stopping(memory, False, reason, 0.0)  # noqa: FBT003 - a kernel
        assert bool(memory[in_lane.MEMORY_STOPPING]) == goes_on, reason


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


def test_durations_are_rounded_up_to_ticks_of_the_channel() -> None:
    assert [in_lane.ticks_within(t, 0.05) for t in (0.0, 0.05, 0.06, 0.1, 0.3)] == [0, 1, 2, 2, 6]


def test_dead_sensor_degrades_the_channel() -> None:
    channel, links = SafetyChannel(), ("truth", "rear")
    sensors = {"truth": "ground_truth", "rear": "radar"}
    channel.reset(channel_context(IN_LANE, links=links, sensors=sensors))
    for alive, status in ((True, signals.OK), (False, signals.DEGRADED)):
        seen = shown([0.0, LANE, 0.0, 20.0], links=links, alive=alive)
        assert channel.act(seen).status.tolist() == [status]
