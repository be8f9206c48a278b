"""A campaign whose own place is so noisy that the debounce of the safety channel matters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tests.project import CANDIDATE, Project

if TYPE_CHECKING:
    from pathlib import Path

CONFIRM = "architecture.channels.safety.parameters.confirm"

_ODD: dict[str, Any] = {
    "odd": "noisy",
    "scenarios": [
        {
            "use": "lead_braking",
            "sweep": {
                "parameters": {
                    "deceleration": ["2 m/s^2", "3 m/s^2"],
                    CONFIRM: ["0.2 s", "0 s", "0.1 s"],
                }
            },
        }
    ],
    "faults": [
        {
            "id": "nominal_silent",
            "target": "channels.nominal",
            "model": "silent",
            "onset": {"at": "3 s"},
        }
    ],
    "architectures": ["architectures/camera_radar.yaml"],
    "concept": "concepts/motorway_chauffeur.yaml",
    "gate": {"architectures": ["camera_radar"]},
    "step": "0.05 s",
    "seed": 7,
    "replicates": 4,
}


def noisy_project(folder: Path) -> Project:
    """Sweep the confirm time: white noise of a place trips a quick monitor, and a slow one not."""
    project = Project(folder, _ODD)
    with project.edited(CANDIDATE) as candidate:
        sensors, safety = candidate["sensors"], candidate["channels"]["safety"]
        sensors["own_place"] = {
            "kind": "localisation",
            "rate": "20 Hz",
            "lateral_noise": "0.6 m",
            "heading_noise": "0.05 deg",
            "speed_noise": "0.05 m/s",
            "realises": "safety_perception",
        }
        sensors["own_radar"] = dict(sensors["front_radar"])
        safety["links"] = ["own_place", "own_radar", "channels.nominal", "switch"]
        safety["parameters"] = {"max_lane_offset": "0.6 m"}
        # Else the switch itself would be quicker than a slow monitor.
        candidate["switch"]["staleness"] = "1 s"
    return project
