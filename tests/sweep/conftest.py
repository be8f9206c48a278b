"""A small ODD on disk, which tests change before they load it."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from adeye.spec.load import OddFiles, load_odd
from tests.motorway import fault

ROOT = Path(__file__).parents[2]

CAMERA_OUT = fault("camera_out", "sensors.front_camera", "drop_out", "2 s")
CANDIDATE = ["architectures/camera_radar.yaml"]
Load = Callable[..., OddFiles]

SWEEP: dict[str, Any] = {
    "parameters": {"ego_speed": ["80 km/h", "120 km/h"], "gap": ["30 m", "45 m", "60 m"]}
}


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Copy the shipped catalogue, architectures and concepts."""
    shutil.copytree(ROOT / "scenarios_db", tmp_path / "scenarios_db")
    shutil.copytree(ROOT / "odd", tmp_path / "odd")
    return tmp_path


@pytest.fixture
def load(project: Path) -> Callable[..., OddFiles]:
    """Write an ODD of one cut-in with changes on top, and load it."""

    def make(sweep: dict[str, Any] | None = None, **changes: Any) -> OddFiles:
        use = {"use": "cut_in", "sweep": sweep if sweep is not None else SWEEP}
        content: dict[str, Any] = {
            "odd": "example",
            "scenarios": [{**use, **changes.pop("use", {})}],
            "architectures": ["architectures/legacy_camera.yaml", *CANDIDATE],
            "concept": "concepts/motorway_chauffeur.yaml",
        }
        path = project / "odd" / "example.yaml"
        path.write_text(yaml.safe_dump({**content, **changes}), encoding="utf-8")
        return load_odd(path)

    return make
