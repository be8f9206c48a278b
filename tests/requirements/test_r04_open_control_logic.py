"""R4: nominal and safety channel are in the package as readable source, and can be replaced."""

from __future__ import annotations

import importlib
import inspect
from typing import TYPE_CHECKING

import pytest

from adeye.channels.factory import BUILT_IN
from tests.project import CANDIDATE, MINI

if TYPE_CHECKING:
    from tests.conftest import MakeProject

pytestmark = pytest.mark.requirements

REPLACEMENT = '''
"""A nominal channel of somebody else: brakes gently from the start."""

from adeye.channels.scalar import ScalarCommand


class Gentle:
    def __init__(self, parameters, context):
        pass

    def act(self, observation):
        return ScalarCommand(-1.5, 0.0)
'''


@pytest.mark.parametrize("kind", ["nominal", "safety"])
def test_channel_is_source_in_the_package(kind: str) -> None:
    built: object = BUILT_IN[kind]
    module = importlib.import_module(f"adeye.channels.{kind}.channel")
    assert getattr(built, "__module__", "").startswith(f"adeye.channels.{kind}")
    source = inspect.getsource(module)
    assert source.startswith('"""')
    assert inspect.getdoc(built)


def test_channel_can_be_replaced_without_a_change_here(make_project: MakeProject) -> None:
    odd = {
        **MINI,
        "scenarios": [{"use": "lead_braking", "faults": ["none"]}],
        "faults": [],
        "architectures": ["architectures/camera_radar.yaml"],
    }
    project = make_project(odd)
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
