"""A campaign whose own place is so noisy that the debounce of the safety channel matters."""

from pathlib import Path
from typing import Any

from tests.project import CANDIDATE, Project
from tests.stored import stored

CONFIRM = "architecture.channels.safety.parameters.confirm"

_ODD: dict[str, Any] = stored("noisy")


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
