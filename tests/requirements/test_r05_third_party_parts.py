"""R5: a channel and a sensor of third parties plug in without a change to the package."""

from __future__ import annotations

import pytest

from tests.conftest import MakeProject
from tests.project import CANDIDATE

pytestmark = pytest.mark.requirements

PARTS = '''
import numpy as np

from adeye.ports import Parameters
from adeye.sensors.delivery import no_measurement


class Compass:
    """A sensor that sees nothing and is always alive."""

    def __init__(self, context):
        self.context = context

    def sense(self, scene):
        objects = len(self.context.scene.object_ids)
        reading = no_measurement(self.context.scene.runs, objects, with_estimate=False)
        reading.stamp[:] = scene.time
        return reading


class Cautious:
    """Brakes gently from the start."""

    class Parameters(Parameters):
        deceleration: float = 1.0

    def __init__(self, parameters, context):
        self.deceleration = parameters.deceleration

    def act(self, observation):
        assert set(observation.measurements) == {"compass"}
        return -self.deceleration, 0.0
'''


def test_parts_from_a_file_of_the_user_run_in_the_loop(make_project: MakeProject) -> None:
    project = make_project()
    folder = project.folder / "odd" / "architectures"
    (folder / "parts.py").write_text(PARTS, "utf-8")
    with project.edited(CANDIDATE) as candidate:
        candidate["sensors"]["compass"] = {"kind": "./parts.py:Compass", "rate": "10 Hz"}
        candidate["channels"]["nominal"] = {
            "kind": "./parts.py:Cautious",
            "links": ["compass"],
            "parameters": {"deceleration": 2.0},
        }
    project.run()
    rows = [row for row in project.rows() if row["architecture"] == "camera_radar"]
    plain = [row for row in rows if row["fault_entry"] == "none"]
    assert {row["outcome"] for row in plain} == {"completed"}
    assert {round(row["max_deceleration_mps2"], 6) for row in plain} == {2.0}
