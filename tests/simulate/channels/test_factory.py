"""From the kind of a channel to its class, and to that of a plug-in."""

from pathlib import Path

import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.signals import OK, SILENT, ControlCommand, Observation
from adeye.simulate.channels import make_channel
from adeye.simulate.channels.factory import BUILT_IN
from adeye.testing import channel_context, check_channel

SCALAR = """
from adeye.ports import Parameters as Base

class Mine:
    class Parameters(Base):
        gain: float = 0.5

    def __init__(self, parameters, context):
        self.gain = parameters.gain

    def act(self, observation):
        return self.gain, 0.0

class Batch:
    monitor_ids = ("own",)

    def reset(self, context):
        self.context = context

    def act(self, observation):
        import numpy as np
        from adeye.signals import ControlCommand
        runs = self.context.runs
        zeros = np.zeros(runs)
        return ControlCommand(
            self.context.channel_id, zeros, zeros, zeros, np.zeros(runs, dtype=np.int64),
            monitors=np.zeros((runs, 1, 2), dtype=bool),
        )

class Failing(Batch):
    def __init__(self):
        raise OSError("no weights")

class NoChannel:
    pass
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "mine.py").write_text(SCALAR)
    return tmp_path


def answered(kind: str, folder: Path, **parameters: float) -> ControlCommand:
    """Make a channel, tell it its parameters, and ask it once."""
    channel = make_channel(kind, folder)
    channel.reset(channel_context(parameters, links=(), sensors={}))
    return channel.act(Observation(0.0, {}, {}, None, np.ones(1, dtype=np.bool_)))


def test_built_in_kinds_are_these() -> None:
    assert set(BUILT_IN) == {"nominal", "safety", "trajectory", "reference"}


def test_plugin_and_policy_are_contained_where_they_cannot_be_made(folder: Path) -> None:
    for kind in ("policy", "./mine.py:Failing"):
        assert answered(kind, folder).status.tolist() == [SILENT]
    with pytest.raises(SpecError, match=r"no act\(\)"):
        make_channel("./mine.py:NoChannel", folder)


def test_plugin_gets_its_parameters_and_keeps_its_monitors(folder: Path) -> None:
    assert answered("./mine.py:Mine", folder, gain=0.25).acceleration.tolist() == [0.25]
    with pytest.raises(SpecError, match=r"channels\.tested\.parameters\.gian"):
        answered("./mine.py:Mine", folder, gian=1.0)
    assert make_channel("./mine.py:Batch", folder).monitor_ids == ("own",)
    assert answered("./mine.py:Batch", folder).status.tolist() == [OK]


@pytest.mark.slow
def test_plugins_conform(folder: Path) -> None:
    for name in ("Mine", "Batch"):
        check_channel(lambda name=name: make_channel(f"./mine.py:{name}", folder), {})
