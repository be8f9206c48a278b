"""Cut-ins in which every cell of preventability occurs, as a project on disk."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tests.project import CONCEPT, MINI, Project

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

ODD: dict[str, Any] = {
    **MINI,
    "scenarios": [
        {
            "use": "cut_in",
            "faults": ["none", "front_camera_out"],
            "sweep": {
                "parameters": {
                    "ego_speed": ["80 km/h", "120 km/h"],
                    "gap": ["2 m", "12 m", "30 m"],
                    "relative_speed": ["-20 km/h", "-50 km/h"],
                }
            },
        }
    ],
}


def project_of_cut_ins(folder: Path, gate: str = "camera_radar", by: Sequence[str] = ()) -> Project:
    """Write the project, judged by the FSR that forbids contacts alone."""
    names: dict[str, Any] = {"architectures": [gate]}
    if by:
        names["preventable_by"] = list(by)
    project = Project(folder, {**ODD, "gate": names})
    with project.edited(CONCEPT) as concept:
        kept = [item for item in concept["requirements"] if item["id"] == "FSR-01"]
        concept["requirements"] = kept
    return project
