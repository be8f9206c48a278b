"""R5: a channel and a sensor from another package plug in without a change here."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import pytest

from tests.project import CANDIDATE, MINI, Project

if TYPE_CHECKING:
    from pathlib import Path

    from tests.conftest import MakeProject

pytestmark = pytest.mark.requirements

PACKAGE = {
    "__init__.py": '"""Parts of a third party."""\n\n__version__ = "2.5"\n',
    "follow.py": '''
"""Keeps the speed that it measures, slower when something is near."""

from adeye import ports
from adeye.channels.scalar import ScalarCommand


class Follow:
    class Parameters(ports.Parameters):
        near: float = 50.0

    def __init__(self, parameters, context):
        self.near = parameters.near

    def act(self, observation):
        eye = observation.measurements["eye"]
        ahead = [x for x, *_ in eye.detections if x > 0.0]
        return ScalarCommand(-3.0 if ahead and min(ahead) < self.near else 0.0, 0.0)
''',
    "eye.py": '''
"""Sees every object ahead without error, at its own range."""

import numpy as np

from adeye import ports
from adeye.sensors.delivery import Delivery, no_measurement


class Eye:
    class Parameters(ports.Parameters):
        range: float = 80.0

    def __init__(self, context):
        self.context = context
        self.ranges = [self.Parameters(**spec.parameters).range for spec in context.specs]
        objects = len(context.scene.object_ids)
        empty = no_measurement(context.scene.runs, objects, with_estimate=False)
        self.delivery = Delivery(context.every, context.latency, empty)

    def sense(self, scene):
        if self.delivery.is_due(scene.tick):
            objects = len(self.context.scene.object_ids)
            sample = no_measurement(self.context.scene.runs, objects, with_estimate=False)
            sample.stamp[:] = scene.time
            for run, limit in enumerate(self.ranges):
                away = scene.objects[run, :, 0] - scene.ego[run, 0]
                order = [k for k in np.argsort(np.abs(away)) if 0.0 < away[k] <= limit]
                for row, thing in enumerate(order):
                    sample.mask[run, row] = True
                    sample.source[run, row] = thing
                    sample.detections[run, row, 0] = away[thing]
            self.delivery.push(scene.tick, sample)
        return self.delivery.newest(scene.tick)
''',
}


BESIDE = '''
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


@pytest.fixture
def third_party(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Install a package of somebody else."""
    name = "third_party_of_r05"
    (tmp_path / "site" / name).mkdir(parents=True)
    for file, text in PACKAGE.items():
        (tmp_path / "site" / name / file).write_text(text, "utf-8")
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    return name


def plugged(project: Project, name: str, *, near: float, reach: float) -> None:
    with project.edited(CANDIDATE) as candidate:
        candidate["sensors"]["eye"] = {
            "kind": f"{name}.eye:Eye",
            "rate": "20 Hz",
            "parameters": {"range": reach},
        }
        candidate["channels"]["nominal"] = {
            "kind": f"{name}.follow:Follow",
            "links": ["eye"],
            "rate": "20 Hz",
            "parameters": {"near": near},
        }
        candidate["channels"].pop("safety", None)
        candidate["switch"] = {
            "policy": "fixed_priority",
            "priority": ["nominal"],
            "default": "nominal",
        }


def test_channel_and_sensor_of_a_third_party_drive_the_ego(
    make_project: MakeProject, third_party: str
) -> None:
    odd = {
        **MINI,
        "scenarios": [{"use": "cut_in", "faults": ["none"]}],
        "faults": [],
        "architectures": ["architectures/camera_radar.yaml"],
    }
    project = make_project(odd)
    with project.edited("odd/concepts/motorway_chauffeur.yaml") as concept:
        # Requirements that every architecture can be judged on.
        concept["requirements"] = [
            item for item in concept["requirements"] if item["id"] in {"FSR-01", "FSR-02"}
        ]
    distances = {}
    for near, reach in ((60.0, 100.0), (60.0, 20.0), (1.0, 100.0)):
        plugged(project, third_party, near=near, reach=reach)
        summary = project.run()
        assert summary.executed == 1
        row = project.rows()[0]
        assert row["outcome"] == "completed"
        distances[near, reach] = row["min_distance_m"]
    # Both parts matter: a channel that heeds what the sensor sees in time keeps its distance.
    assert distances[60.0, 100.0] > max(distances[60.0, 20.0], distances[1.0, 100.0])
    assert f"{third_party}.eye" in sys.modules


def test_parts_from_a_file_of_the_user_run_in_the_loop(make_project: MakeProject) -> None:
    project = make_project()
    folder = project.folder / "odd" / "architectures"
    (folder / "parts.py").write_text(BESIDE, "utf-8")
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
