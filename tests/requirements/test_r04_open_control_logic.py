"""R4: nominal and safety channel are in the package as readable source, and can be replaced."""

from __future__ import annotations

import importlib
import inspect

import pytest

from adeye.channels.factory import BUILT_IN
from tests.conftest import MakeProject
from tests.project import CANDIDATE, MINI

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
    # It brakes before the lead does, so the ego comes less close.
    close = {row["campaign"]: row["min_distance_m"] for row in project.rows()}
    old = project.rows(before.campaign)[0]
    assert close[after.campaign] > old["min_distance_m"]
