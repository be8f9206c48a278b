from pathlib import Path

import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.signals import OK, SILENT, Observation
from adeye.simulate.channels import make_channel
from adeye.simulate.channels.factory import BUILT_IN
from adeye.spec.channels import NominalParameters, SafetyParameters
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


def observation() -> Observation:
    return Observation(0.0, {}, {}, None, np.ones(1, dtype=np.bool_))


def test_built_in_kinds_are_these() -> None:
    assert set(BUILT_IN) == {"nominal", "safety", "trajectory", "reference"}


def test_policy_is_contained_like_a_plugin(folder: Path) -> None:
    channel = make_channel("policy", folder)
    channel.reset(channel_context({}, links=(), sensors={}))
    assert channel.act(observation()).status.tolist() == [SILENT]


def test_scalar_plugin_gets_its_parameter_model(folder: Path) -> None:
    channel = make_channel("./mine.py:Mine", folder)
    channel.reset(channel_context({"gain": 0.25}, links=(), sensors={}))
    assert channel.act(observation()).acceleration.tolist() == [0.25]


def test_batch_plugin_keeps_its_monitors(folder: Path) -> None:
    channel = make_channel("./mine.py:Batch", folder)
    assert channel.monitor_ids == ("own",)
    channel.reset(channel_context({}, links=(), sensors={}))
    assert channel.act(observation()).status.tolist() == [OK]


def test_plugin_whose_constructor_fails_is_silent(folder: Path) -> None:
    channel = make_channel("./mine.py:Failing", folder)
    channel.reset(channel_context({}, links=(), sensors={}))
    assert channel.act(observation()).status.tolist() == [SILENT]


def test_class_without_act_is_no_channel(folder: Path) -> None:
    with pytest.raises(SpecError, match=r"no act\(\)"):
        make_channel("./mine.py:NoChannel", folder)


def test_wrong_parameter_is_an_input_error_with_its_path(folder: Path) -> None:
    channel = make_channel("./mine.py:Mine", folder)
    with pytest.raises(SpecError, match=r"channels\.tested\.parameters\.gian"):
        channel.reset(channel_context({"gian": 1.0}, links=(), sensors={}))


@pytest.mark.slow
def test_built_in_channels_conform() -> None:
    check_channel(lambda: make_channel("nominal", Path()), NominalParameters())
    check_channel(
        lambda: make_channel("safety", Path()),
        SafetyParameters(),
        links=("truth", "channels.nominal", "switch"),
        sensors={"truth": "ground_truth"},
    )


@pytest.mark.slow
def test_plugins_conform(folder: Path) -> None:
    for name in ("Mine", "Batch"):
        check_channel(lambda name=name: make_channel(f"./mine.py:{name}", folder), {})
