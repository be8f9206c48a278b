"""R14: every channel, built in or not, gives commands of one specification."""

from string import Template
from typing import Any

import pytest

from adeye.cli.new import EXAMPLES
from adeye.ports import ControlChannel
from adeye.simulate.channels.factory import BUILT_IN
from adeye.spec import channels
from adeye.testing import ScriptedChannel, check_channel

pytestmark = pytest.mark.requirements

SEEN = {"front": "radar", "pose": "localisation"}
TRUTH = {"truth": "ground_truth"}
KINDS: dict[str, tuple[Any, tuple[str, ...], dict[str, str]]] = {
    "nominal": (channels.NominalParameters, ("front", "pose"), SEEN),
    "safety": (channels.SafetyParameters, ("truth", "channels.other", "switch"), TRUTH),
    "trajectory": (channels.TrajectoryParameters, ("front", "pose"), SEEN),
    "reference": (channels.ReferenceParameters, ("truth",), TRUTH),
}
"""Parameters, links and kinds of sensors."""


@pytest.mark.slow
@pytest.mark.parametrize("kind", sorted(BUILT_IN))
def test_built_in_channel_conforms(kind: str) -> None:
    parameters, links, sensors = KINDS[kind]
    check_channel(BUILT_IN[kind], parameters(), links=links, sensors=sensors)
    assert isinstance(BUILT_IN[kind](), ControlChannel)


def test_fake_of_the_package_conforms() -> None:
    check_channel(lambda: ScriptedChannel([1.0, -1.0]))


def test_example_that_is_written_for_users_conforms() -> None:
    source = Template(EXAMPLES["channel"].source).substitute(class_name="Mine", name="mine")
    space: dict[str, object] = {"__name__": "mine"}
    exec(compile(source, "mine.py", "exec"), space)  # noqa: S102 - our own example
    mine = space["Mine"]
    assert isinstance(mine, type)
    check_channel(mine, mine.Parameters())  # type: ignore[attr-defined]
