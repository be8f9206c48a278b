import numpy as np
import pytest

from adeye.signals import SILENT, Observation
from adeye.simulate.channels.rack import ClockedChannel
from adeye.testing import ScriptedChannel, channel_context

STEP = 0.05


def observation(tick: int) -> Observation:
    return Observation(tick * STEP, {}, {}, None, np.ones(1, dtype=np.bool_))


def play(every: int, delay: int, ticks: int) -> list[tuple[float, float, int]]:
    """Acceleration, stamp and status at each tick of a channel that counts its own ticks."""
    clocked = ClockedChannel(ScriptedChannel(np.arange(1.0, 20.0)), every, delay)
    clocked.reset(channel_context(None, links=(), sensors={}))
    rows = []
    for tick in range(ticks):
        command = clocked.act(observation(tick) if clocked.is_due else None)
        rows.append(
            (float(command.acceleration[0]), float(command.stamp[0]), int(command.status[0]))
        )
    return rows


def test_command_is_held_between_the_channels_own_ticks() -> None:
    assert [row[0] for row in play(every=3, delay=0, ticks=7)] == [1, 1, 1, 2, 2, 2, 3]


def test_command_is_released_after_the_delay_with_the_observations_stamp() -> None:
    rows = play(every=1, delay=2, ticks=5)
    assert [row[0] for row in rows] == [0, 0, 1, 2, 3]
    assert [row[1] for row in rows] == [-1.0, -1.0, 0.0, STEP, 2 * STEP]


def test_channel_is_silent_before_its_first_release() -> None:
    rows = play(every=1, delay=1, ticks=2)
    assert [row[2] == SILENT for row in rows] == [True, False]


def test_delay_longer_than_the_period_keeps_every_command() -> None:
    assert [row[0] for row in play(every=2, delay=3, ticks=8)] == [0, 0, 0, 1, 1, 2, 2, 3]


def test_due_channel_needs_an_observation() -> None:
    clocked = ClockedChannel(ScriptedChannel([1.0]), 2, 0)
    clocked.reset(channel_context(None, links=(), sensors={}))
    with pytest.raises(ValueError, match="needs an observation"):
        clocked.act(None)


def test_reset_forgets_what_was_on_the_way() -> None:
    clocked = ClockedChannel(ScriptedChannel([5.0]), 1, 1)
    context = channel_context(None, links=(), sensors={})
    clocked.reset(context)
    clocked.act(observation(0))
    clocked.reset(context)
    assert clocked.act(observation(0)).stamp[0] == -1.0
