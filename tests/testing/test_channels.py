"""The check of channels passes those that conform, and names the rule that another breaks."""

from typing import Any

import numpy as np
import pytest

from adeye.ports import ChannelContext
from adeye.signals import OK, ControlCommand, Observation
from adeye.testing import ScriptedChannel, channel_context, check_channel


def observation() -> Observation:
    return Observation(0.0, {}, {}, None, np.ones(2, dtype=np.bool_))


def test_scripted_channel_gives_its_script_and_stays_at_the_last_command() -> None:
    channel = ScriptedChannel(np.array([[1.0, 2.0], [3.0, 4.0]]), [0.1])
    channel.reset(channel_context(None, links=(), sensors={}, runs=2))
    rows = [channel.act(observation()).acceleration.tolist() for _ in range(3)]
    assert rows == [[1.0, 3.0], [2.0, 4.0], [2.0, 4.0]]


def test_scripted_channel_conforms() -> None:
    check_channel(lambda: ScriptedChannel([1.0, -1.0]))


class Broken:
    """A channel that breaks one rule, by the name of a method."""

    monitor_ids: tuple[str, ...] = ()
    made = 0

    def __init__(self, rule: str) -> None:
        self.rule = rule
        self.context: Any = None
        self.tick = 0
        Broken.made += 1
        self.number = Broken.made

    def reset(self, context: ChannelContext) -> None:
        self.context = context
        if self.rule != "remembers":
            self.tick = 0

    def act(self, seen: Observation) -> ControlCommand:
        self.tick += 1
        runs = self.context.runs
        value = {
            "remembers": float(self.tick),
            "random": float(self.number),
            "batch": float(runs),
            "infinite": np.inf,
        }.get(self.rule, 0.0)
        if self.rule == "alters":
            seen.measurements["front"].detections[:] = 0.0
        if self.rule == "blind":
            assert seen.measurements["pose"].stamp[0] >= 0.0, "cannot go on"
        count = runs + 1 if self.rule == "shape" else runs
        status = np.full(runs, 7 if self.rule == "status" else OK, dtype=np.int64)
        zeros = np.zeros(runs)
        name = "other" if self.rule == "name" else self.context.channel_id
        return ControlCommand(name, np.full(count, value), zeros, zeros, status)


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        ("remembers", "second reset"),
        ("random", "equal inputs"),
        ("batch", "other runs of its batch"),
        ("infinite", "not finite"),
        ("shape", "acceleration has shape"),
        ("status", "unknown"),
        ("name", "another id"),
        ("blind", "cannot go on"),
    ],
)
def test_broken_rule_is_named(rule: str, message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        check_channel(lambda: Broken(rule))


def test_channel_that_alters_the_truth_is_found() -> None:
    with pytest.raises(ValueError, match="read-only"):
        check_channel(lambda: Broken("alters"))


def test_failing_object_per_run_is_found() -> None:
    class Failing:
        def __init__(self, _parameters: Any, _context: Any) -> None:
            pass

        def act(self, _seen: Any) -> Any:
            raise RuntimeError("lost")

    with pytest.raises(AssertionError, match="lost"):
        check_channel(Failing)
