"""R14: every channel, built in or not, gives commands of one specification."""

from __future__ import annotations

from pathlib import Path
from string import Template

import pytest

from adeye.cli.new import EXAMPLES
from adeye.ports import ControlChannel
from adeye.simulate.channels.factory import BUILT_IN, make_channel
from adeye.spec.channels import (
    NominalParameters,
    ReferenceParameters,
    SafetyParameters,
    TrajectoryParameters,
)
from adeye.testing import ScriptedChannel, check_channel

pytestmark = pytest.mark.requirements

PARAMETERS = {
    "nominal": NominalParameters(),
    "safety": SafetyParameters(),
    "trajectory": TrajectoryParameters(),
    "reference": ReferenceParameters(),
}
LINKS = {
    "nominal": ("front", "pose"),
    "safety": ("truth", "channels.other", "switch"),
    "trajectory": ("front", "pose"),
    "reference": ("truth",),
}
SENSORS = {
    "nominal": {"front": "radar", "pose": "localisation"},
    "safety": {"truth": "ground_truth"},
    "trajectory": {"front": "radar", "pose": "localisation"},
    "reference": {"truth": "ground_truth"},
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", sorted(BUILT_IN))
def test_built_in_channel_conforms(kind: str) -> None:
    check_channel(BUILT_IN[kind], PARAMETERS[kind], links=LINKS[kind], sensors=SENSORS[kind])
    assert isinstance(BUILT_IN[kind](), ControlChannel)


SILENT = {"kind": "channel_silent", "watches": ["other"]}
STOPS = {
    "planned": {"stop": "planned"},
    "supervised": {"supervisor": {"monitors": {"silent": SILENT}}},
    "supervised and planned": {
        "stop": "planned",
        "supervisor": {"monitors": {"silent": SILENT, "last": {"kind": "last_safe_stop"}}},
    },
}


@pytest.mark.slow
@pytest.mark.parametrize("stop", sorted(STOPS))
def test_every_kind_of_safe_stop_conforms(stop: str) -> None:
    parameters = SafetyParameters.model_validate(STOPS[stop])
    check_channel(
        lambda: make_channel("safety", Path(), parameters),
        parameters,
        links=LINKS["safety"],
        sensors=SENSORS["safety"],
    )


def test_fake_of_the_package_conforms() -> None:
    check_channel(lambda: ScriptedChannel([1.0, -1.0]))


def test_example_that_is_written_for_users_conforms() -> None:
    source = Template(EXAMPLES["channel"].source).substitute(class_name="Mine", name="mine")
    space: dict[str, object] = {"__name__": "mine"}
    exec(compile(source, "mine.py", "exec"), space)  # noqa: S102 - our own example
    mine = space["Mine"]
    assert isinstance(mine, type)
    check_channel(mine, mine.Parameters())  # type: ignore[attr-defined]
