"""R4: nominal and safety channel are in the package as source, and either can be replaced."""

from __future__ import annotations

import inspect

import pytest

from adeye.channels.nominal import NominalChannel
from adeye.channels.safety import SafetyChannel
from tests.conftest import MakeProject
from tests.project import CANDIDATE

pytestmark = pytest.mark.requirements

COASTER = '''
class Coaster:
    """Never brakes and never steers."""

    def __init__(self, parameters, context):
        self.speed = context.desired_speed

    def act(self, observation):
        return 0.0, 0.0
'''


def test_both_channels_can_be_read() -> None:
    assert "def act" in inspect.getsource(NominalChannel)
    assert "def act" in inspect.getsource(SafetyChannel)


def test_replaced_nominal_channel_drives_differently(make_project: MakeProject) -> None:
    project = make_project()
    (project.folder / "odd" / "architectures" / "coaster.py").write_text(COASTER, "utf-8")
    project.run(db="built_in.db")
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["nominal"] = {
            "kind": "./coaster.py:Coaster",
            "links": candidate["channels"]["nominal"]["links"],
        }
    project.run(db="replaced.db")
    own = {row["situation"]: row for row in project.rows(db="built_in.db") if _plain(row)}
    other = {row["situation"]: row for row in project.rows(db="replaced.db") if _plain(row)}
    assert own.keys() == other.keys()
    assert any(own[key]["trace_digest"] != other[key]["trace_digest"] for key in own)


def _plain(row: dict[str, object]) -> bool:
    return row["architecture"] == "camera_radar" and row["fault_entry"] == "none"
