"""Channels that see one run: an instance for each, shown what is theirs."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from adeye.ports import ScalarCommand, ScalarContext, ScalarObservation
from adeye.signals import DEGRADED, OK, REASON_DEFAULT, SILENT, Authority, Observation
from adeye.simulate.channels.links import observe
from adeye.simulate.channels.scalar import ScalarChannel
from adeye.testing import ScriptedChannel, channel_context, check_channel
from adeye.testing.scenes import object_measurement, pose_measurement, straight_road

RUNS = 2


def observation(tick: int) -> Observation:
    return Observation(0.1 * tick, {}, {}, None, np.ones(RUNS, dtype=np.bool_))


def channel_of(answer: Callable[[int, float], Any]) -> ScalarChannel:
    """Every object knows its run by the desired speed."""

    class Mine:
        def __init__(self, _parameters: Any, context: ScalarContext) -> None:
            self.run = int(context.desired_speed)

        def act(self, seen: ScalarObservation) -> Any:
            return answer(self.run, seen.time)

    channel = ScalarChannel(Mine)
    channel.reset(
        channel_context(None, links=(), sensors={}, runs=RUNS, desired_speed=np.arange(float(RUNS)))
    )
    return channel


def test_each_run_has_an_object_of_its_own() -> None:
    command = channel_of(lambda run, _: (float(run), 0.1 * run)).act(observation(1))
    assert command.acceleration.tolist() == [0.0, 1.0]
    assert command.steering_angle.tolist() == [0.0, 0.1]
    assert command.stamp.tolist() == [0.1, 0.1]
    assert command.status.tolist() == [OK, OK]


UNUSABLE = [
    None,
    3.0,
    (1.0,),
    (1.0, 2.0, 3.0),
    (float("nan"), 0.0),
    (float("inf"), 0.0),
    ("1", 0.0),
    (True, 0.0),
    ([1.0], 0.0),
    np.zeros((2, 2)),
    ScalarCommand(1.0, 0.0, 17),
]


def test_unusable_answer_silences_its_run_for_good() -> None:
    for answer in UNUSABLE:

        def answered(run: int, time: float, wrong: Any = answer) -> Any:
            return wrong if run == 1 and time == 0.1 else (1.0, 0.0)

        channel = channel_of(answered)
        for tick in range(4):
            command = channel.act(observation(tick))
            assert command.status.tolist() == [OK, OK if tick == 0 else SILENT], answer
        assert command.stamp[1] == 0.0
        found = [event and (event.outcome, event.time) for event in channel.events]
        assert found == [None, ("channel_invalid_output", 0.1)], answer


def test_any_pair_of_finite_numbers_is_a_command_and_may_carry_a_status() -> None:
    pairs = [(1, 0), [np.float64(1.0), np.float32(0.0)], np.array([1.0, 0.0])]
    for answer, status in [(pair, OK) for pair in pairs] + [
        (ScalarCommand(1.0, 0.0, DEGRADED), DEGRADED)
    ]:
        command = channel_of(lambda *_, given=answer: given).act(observation(0))
        assert command.acceleration.tolist() == [1.0] * RUNS
        assert command.status.tolist() == [status] * RUNS


def test_exception_silences_its_run_and_names_the_place() -> None:
    def answer(run: int, _time: float) -> Any:
        return 1.0 / run, 0.0

    channel = channel_of(answer)
    assert channel.act(observation(0)).status.tolist() == [SILENT, OK]
    event = channel.events[0]
    assert event is not None
    assert event.outcome == "channel_error"
    assert "ZeroDivisionError" in event.detail
    assert "test_scalar.py" in event.detail


def test_object_that_cannot_be_made_is_silent_from_the_start() -> None:
    class Broken:
        def __init__(self, _parameters: Any, _context: ScalarContext) -> None:
            raise ValueError("no weights")

        def act(self, _seen: ScalarObservation) -> tuple[float, float]:
            return 0.0, 0.0

    channel = ScalarChannel(Broken)
    channel.reset(channel_context(None, links=(), sensors={}, runs=RUNS))
    assert channel.act(observation(0)).status.tolist() == [SILENT] * RUNS
    assert channel.events[1] is not None


def test_ended_run_is_not_asked() -> None:
    asked: list[int] = []

    def answer(run: int, _time: float) -> Any:
        asked.append(run)
        return 0.0, 0.0

    channel = channel_of(answer)
    channel.act(Observation(0.0, {}, {}, None, np.array([False, True])))
    assert asked == [1]


def test_object_sees_its_own_run_without_empty_rows() -> None:
    seen: list[ScalarObservation] = []

    class Mine:
        def __init__(self, parameters: Any, context: ScalarContext) -> None:
            assert parameters == "p"
            assert context.road.lanes == 3
            assert context.links == ("front", "pose", "channels.other", "switch")

        def act(self, observation: ScalarObservation) -> Any:
            seen.append(observation)
            return 0.0, 0.0

    links = ("front", "pose", "channels.other", "switch")
    context = channel_context("p", links=links, sensors={"front": "radar"}, runs=RUNS)
    channel = ScalarChannel(Mine)
    channel.reset(context)
    ego = np.zeros((RUNS, 7))
    ego[:, 1] = 5.25
    objects = np.zeros((RUNS, 2, 5))
    objects[1, 1, 0] = 500.0
    other = ScriptedChannel(np.array([[1.0], [2.0]]))
    other.reset(context)
    readings = {
        "front": object_measurement(ego, objects, 0.0, sight=100.0),
        "pose": pose_measurement(straight_road(RUNS), ego, 0.0),
    }
    readings["front"].values = np.array([[1.0, 2.0], [3.0, 4.0]])
    authority = Authority(np.array([0, 1]), np.full(RUNS, REASON_DEFAULT))
    running = np.ones(RUNS, dtype=np.bool_)
    proposals = {"other": other.act(observation(0))}
    channel.act(observe(links, 0.0, readings, proposals, authority, running, protect=True))
    assert [item.measurements["front"].detections.shape for item in seen] == [(2, 7), (1, 7)]
    assert [item.commands["other"].acceleration for item in seen] == [1.0, 2.0]
    assert [item.authority for item in seen] == [0, 1]
    estimate = seen[0].measurements["pose"].estimate
    assert estimate is not None
    assert estimate[8] == pytest.approx(5.25)
    values = [item.measurements["front"].values for item in seen]
    assert [None if row is None else row.tolist() for row in values] == [[1.0, 2.0], [3.0, 4.0]]
    assert seen[0].measurements["pose"].values is None


def test_conforms() -> None:
    class Mine:
        def __init__(self, _parameters: Any, context: ScalarContext) -> None:
            self.desired = context.desired_speed

        def act(self, seen: ScalarObservation) -> Any:
            estimate = seen.measurements["pose"].estimate
            assert estimate is not None
            return 0.1 * (self.desired - estimate[3]), 0.0

    check_channel(Mine)
