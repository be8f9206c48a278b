"""R4: the channels of the package are readable source, and each can be replaced, from YAML too."""

import importlib
import inspect
from typing import get_args

import pytest

from adeye.simulate.bridges.middleware import MIDDLEWARE
from adeye.simulate.channels.factory import BUILT_IN
from adeye.simulate.channels.fmu import FmuChannel
from adeye.simulate.channels.policy import PolicyChannel
from adeye.simulate.channels.process.channel import ProcessChannel
from adeye.spec.channels import BuiltInChannel
from tests.conftest import MakeProject
from tests.project import CANDIDATE, odd_of, use

pytestmark = pytest.mark.requirements

REPLACEMENT = '''
"""A nominal channel of somebody else: brakes gently from the start."""

from adeye.ports import ScalarCommand


class Gentle:
    def __init__(self, parameters, context):
        pass

    def act(self, observation):
        return ScalarCommand(-1.5, 0.0)
'''


POLICY = '''
"""A policy of somebody else: keeps its speed and steers to the middle of the lane."""


def keep(observation):
    ego = observation["ego"]
    return 0.0, -0.02 * ego[4] - 0.4 * ego[3]
'''

CHANNELS = {
    **BUILT_IN,
    "policy": PolicyChannel,
    "process": ProcessChannel,
    "fmu": FmuChannel,
}


def test_every_built_in_kind_of_channel_is_here() -> None:
    union, *_ = get_args(BuiltInChannel)
    kinds = {
        kind
        for record in get_args(union)
        for kind in get_args(record.model_fields["kind"].annotation)
    }
    # Behind a middleware, or at an address, is a program.
    assert kinds == {*CHANNELS, *MIDDLEWARE, "remote"}


@pytest.mark.parametrize("kind", CHANNELS)
def test_channel_is_source_in_the_package(kind: str) -> None:
    built: object = CHANNELS[kind]
    name: str = built.__module__
    assert name.startswith(f"adeye.simulate.channels.{kind}")
    source = inspect.getsource(importlib.import_module(name))
    assert source.startswith('"""')
    assert inspect.getdoc(built)


@pytest.mark.slow
def test_channel_can_be_replaced_without_a_change_here(make_project: MakeProject) -> None:
    project = make_project(odd_of("lead_braking"))
    before = project.run()
    (project.folder / "odd" / "architectures" / "gentle.py").write_text(REPLACEMENT, "utf-8")
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["nominal"]["kind"] = "./gentle.py:Gentle"
    after = project.run()
    assert (before.executed, after.executed) == (1, 1)
    built_in, gentle = project.rows(before.campaign)[0], project.rows(after.campaign)[0]
    assert gentle["situation"] == built_in["situation"]
    assert gentle["trace_digest"] != built_in["trace_digest"]
    # It does what its code says, whatever is ahead.
    assert gentle["max_deceleration_mps2"] != built_in["max_deceleration_mps2"]


@pytest.mark.slow
def test_nominal_channel_is_exchanged_for_another_one_by_its_kind(
    make_project: MakeProject,
) -> None:
    """The simple one, the one that plans trajectories, and a policy, on one situation."""
    kinds: dict[str, dict[str, object]] = {
        "nominal": {},
        "trajectory": {},
        "policy": {"policy": "./keep.py:keep", "normalised": False},
    }
    near = use("cut_in", {"gap": ["20 m"], "ego_speed": ["100 km/h"]})
    project = make_project(odd_of(near, architectures=[f"{kind}_logic" for kind in kinds]))
    (project.folder / "odd" / "architectures" / "keep.py").write_text(POLICY, "utf-8")
    base = project.read(CANDIDATE)
    for kind, parameters in kinds.items():
        base["architecture"] = f"{kind}_logic"
        base["channels"]["nominal"] |= {"kind": kind, "parameters": parameters}
        # What it does on its own: the safety channel watches and does not act.
        base["switch"]["policy"] = "stuck"
        project.write(f"odd/architectures/{kind}_logic.yaml", base)
    summary = project.run()
    assert (summary.planned, summary.executed) == (3, 3)
    rows = {row["architecture"]: row for row in project.rows()}
    assert len({row["situation"] for row in rows.values()}) == 1
    assert len({row["trace_digest"] for row in rows.values()}) == 3
    assert {row["outcome"] for row in rows.values()} == {"completed"}
    # Both built-in channels brake for the cutter; the policy does not look at it.
    braking = {name: row["max_deceleration_mps2"] for name, row in rows.items()}
    assert braking["nominal_logic"] > 1.0
    assert braking["trajectory_logic"] > 1.0
    assert braking["policy_logic"] < 0.5
