"""A random sample, of any size, of the shipped ODD with a million test cases."""

from __future__ import annotations

from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]


def write_sample(place: Path, samples: int) -> Path:
    """Write an ODD with so many test cases into an empty folder and return its file."""
    content = yaml.safe_load((ROOT / "odd" / "million.yaml").read_text("utf-8"))
    for use in content["scenarios"]:
        use["sweep"]["design"] = "random"
        use["sweep"]["samples"] = samples // 2
        parameters = use["sweep"]["parameters"]
        for name, axis in parameters.items():
            ends = (axis["from"], axis["to"]) if isinstance(axis, dict) else (axis[0], axis[-1])
            parameters[name] = sorted(ends, key=_number)
    for name in ("odd", "scenarios_db"):
        (place / name).symlink_to(ROOT / name)
    path = place / "sample.yaml"
    content["architectures"] = [f"odd/{item}" for item in content["architectures"]]
    content["concept"] = f"odd/{content['concept']}"
    path.write_text(yaml.safe_dump(content), "utf-8")
    return path


def _number(quantity: object) -> float:
    return float(str(quantity).split(" ")[0])
