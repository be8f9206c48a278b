"""Cut-ins in which every cell of preventability occurs, as a project on disk."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tests.project import MINI, Project, use

SWEEP = {
    "ego_speed": ["80 km/h", "120 km/h"],
    "gap": ["2 m", "12 m", "30 m"],
    "relative_speed": ["-20 km/h", "-50 km/h"],
}
ODD: dict[str, Any] = {
    **MINI,
    "scenarios": [use("cut_in", SWEEP, faults=("none", "front_camera_out"))],
}


def project_of_cut_ins(folder: Path, gate: str = "camera_radar", by: Sequence[str] = ()) -> Project:
    """Write the project, judged by the FSR that forbids contacts alone."""
    names: dict[str, Any] = {"architectures": [gate]}
    if by:
        names["preventable_by"] = list(by)
    project = Project(folder, {**ODD, "gate": names})
    project.require("FSR-01")
    return project
