"""Scripted channels for proofs that need a known command."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tests.project import CANDIDATE, MINI, Project, run_cases

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.trace import Trace

SCRIPTED = '''
"""A channel that gives the command, the status and the silence that its parameters say."""

from adeye import ports
from adeye.ports import ScalarCommand
from adeye.signals import OK, REQUESTS_AUTHORITY


class Scripted:
    class Parameters(ports.Parameters):
        acceleration: float = 0.0
        steering_angle: float = 0.0
        requests_from: float = 1e9
        requests_until: float = 1e9
        fails_from: float = 1e9

    def __init__(self, parameters, context):
        self.parameters = parameters

    def act(self, observation):
        if observation.time >= self.parameters.fails_from:
            raise RuntimeError("told to fail")
        asks = (
            self.parameters.requests_from <= observation.time < self.parameters.requests_until
        )
        return ScalarCommand(
            self.parameters.acceleration,
            self.parameters.steering_angle,
            REQUESTS_AUTHORITY if asks else OK,
        )
'''


def scripted(folder: Path, channels: dict[str, dict[str, float]], **switch: Any) -> Project:
    """Make a project whose candidate has scripted channels.

    Args:
        folder: Where to.
        channels: Parameters of each channel, by id.
        switch: Fields of the switch; by default the first channel acts.
    """
    odd = {
        **MINI,
        "scenarios": [{"use": "lead_braking", "faults": ["none"]}],
        "faults": [],
        "architectures": ["architectures/camera_radar.yaml"],
    }
    project = Project(folder / "project", odd)
    (folder / "project" / "odd" / "architectures" / "scripted.py").write_text(SCRIPTED, "utf-8")
    names = list(channels)
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"] = {
            name: {
                "kind": "./scripted.py:Scripted",
                "rate": "20 Hz",
                "links": ["localisation"],
                "parameters": parameters,
            }
            for name, parameters in channels.items()
        }
        default = {"policy": "fixed_priority", "priority": names, "default": names[0]}
        candidate["switch"] = {**default, **switch}
    with project.edited("odd/concepts/motorway_chauffeur.yaml") as concept:
        # Requirements that every architecture can be judged on.
        concept["requirements"] = [
            item for item in concept["requirements"] if item["id"] in {"FSR-01", "FSR-06"}
        ]
    return project


def driven(project: Project) -> Trace:
    """Execute the first test case of a project."""
    plan = project.plan()
    return run_cases(plan, [plan.cases[0]])
