"""Scripted channels for proofs that need a known command."""

from pathlib import Path
from typing import Any

from adeye.testing import zoo
from adeye.trace import Trace
from tests.project import CANDIDATE, Project, odd_of, run_cases

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
    project = Project(folder / "project", odd_of("lead_braking"))
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
    # Requirements that every architecture can be judged on.
    project.require("FSR-01", "FSR-06")
    return project


def invite(project: Project) -> None:
    """Give the candidate a channel ``guest`` that is a program of its own."""
    zoo.settle(project.folder / "odd" / "architectures")
    guest = {"kind": "process", "links": ["localisation"], "parameters": zoo.parameters("")}
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["guest"] = {"rate": "20 Hz", **guest}


def driven(project: Project) -> Trace:
    """Execute the first test case of a project."""
    plan = project.plan()
    return run_cases(plan, [plan.cases[0]])
