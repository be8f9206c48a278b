"""The protocols: what the built-in parts have, what plug-ins are refused for."""

import ast
import re
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from adeye import ports
from adeye.cli.new import EXAMPLES
from adeye.ports import ChannelContext, ControlChannel, MetricColumn, Parameters
from adeye.simulate.channels.nominal import NominalChannel
from adeye.simulate.channels.safety import SafetyChannel
from adeye.testing.scenes import straight_road

ROOT = Path(__file__).resolve().parents[1]


class Gains(Parameters):
    """Parameters of a plug-in."""

    gain: float = 1.0


def test_plugin_parameters_refuse_unknown_keys_and_are_frozen() -> None:
    with pytest.raises(ValidationError, match="gian"):
        Gains.model_validate({"gian": 2.0})
    with pytest.raises(ValidationError, match="frozen"):
        Gains.model_validate({"gain": 2}).gain = 3.0  # type: ignore[misc]


@pytest.mark.parametrize("channel", [NominalChannel(), SafetyChannel()])
def test_built_in_channels_follow_the_protocol(channel: object) -> None:
    assert isinstance(channel, ControlChannel)


def test_what_cannot_act_is_no_channel() -> None:
    class Mute:
        monitor_ids: tuple[str, ...] = ()

        def reset(self, context: ChannelContext) -> None:
            """Do nothing."""

    assert not isinstance(Mute(), ControlChannel)


def test_runs_of_a_channel_are_counted_by_the_vehicles() -> None:
    road = straight_road(0)
    context = ChannelContext("nominal", (), (), {}, {}, (), road, np.zeros(0), 0.05, 0.05)
    assert context.runs == 0


def test_metric_column_keeps_value_status_time_and_actor_apart() -> None:
    column = MetricColumn(np.array([1.5]), ("value",), np.array([2.0]), [0])
    found = (column.value[0], column.status[0], column.time[0], column.actor[0])
    assert found == (1.5, "value", 2.0, 0)


def written_for_guests() -> list[tuple[str, str]]:
    """Return the code that shows how parts are written, with its place."""
    pages = [ROOT / "README.md", *sorted((ROOT / "docs" / "guide").glob("*.md"))]
    found = [
        (f"{page.name} {number}", block)
        for page in pages
        for number, block in enumerate(re.findall(r"```python\n(.*?)```", page.read_text(), re.S))
        if "class " in block or "def " in block
    ]
    found += [(f"adeye new {kind}", example.source) for kind, example in EXAMPLES.items()]
    zoo = ROOT / "adeye" / "testing" / "zoo"
    return found + [(name, (zoo / name).read_text()) for name in ("plugin.py", "program.py")]


@pytest.mark.parametrize(("place", "code"), written_for_guests(), ids=lambda item: item[:30])
def test_code_for_guests_imports_the_public_face_only(place: str, code: str) -> None:
    nodes = list(
        ast.walk(ast.parse(code.replace("$class_name", "Part").replace("${name}", "part")))
    )
    deep = {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module}
    deep |= {item.name for node in nodes if isinstance(node, ast.Import) for item in node.names}
    ours = {name for name in deep if name.partition(".")[0] == "adeye"}
    assert ours <= {"adeye", "adeye.ports", "adeye.testing", "adeye.testing.ros2"}, place


def test_every_name_of_the_public_face_is_there() -> None:
    assert len(set(ports.__all__)) == len(ports.__all__)
    assert all(hasattr(ports, name) for name in ports.__all__)
