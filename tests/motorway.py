"""A motorway scenario and its test cases, by the words that a test changes."""

from collections.abc import Mapping
from typing import Any

from adeye.spec.architecture import Architecture
from adeye.spec.odd import Attributes
from adeye.spec.scenario import LogicalScenario
from adeye.sweep.case import TestCase
from tests.stored import stored

MOTORWAY: dict[str, Any] = stored("motorway")
ARCHITECTURE: dict[str, Any] = stored("bare")
VEHICLE: dict[str, Any] = ARCHITECTURE["vehicle"]


def merged(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Merge nested mappings; the changes win."""
    out = dict(base)
    for key, value in changes.items():
        nested = isinstance(value, Mapping) and isinstance(out.get(key), Mapping)
        out[key] = merged(out[key], value) if nested else value
    return out


def make_scenario(**changes: Any) -> LogicalScenario:
    """Return the motorway with nested changes."""
    return LogicalScenario.model_validate(merged(MOTORWAY, changes))


def make_case(
    scenario: LogicalScenario,
    parameters: Mapping[str, float] | None = None,
    *,
    vehicle: Mapping[str, str] | None = None,
    step: float = 0.05,
    seed: int = 7,
) -> TestCase:
    """Return a test case of a scenario: values of its parameters, changes of the vehicle."""
    values = {"ego_speed": 30.0, "gap": 40.0, **(parameters or {})}
    architecture = merged(ARCHITECTURE, {"vehicle": vehicle or {}})
    return TestCase(
        scenario_id=scenario.scenario,
        scenario=scenario,
        parameters=values,
        architecture=Architecture.model_validate(architecture),
        faults=(),
        fault_entry="none",
        replicate=0,
        seed=seed,
        step=step,
        point={},
        inside_odd=True,
        attributes=Attributes(),
    )


def cut_ins(name: str, *gaps: str) -> dict[str, Any]:
    """Return an ODD of cut-ins at some gaps, driven by the shipped candidate."""
    return {
        "odd": name,
        "scenarios": [{"use": "cut_in", "sweep": {"parameters": {"gap": list(gaps)}}}],
        "architectures": ["architectures/camera_radar.yaml"],
        "concept": "concepts/motorway_chauffeur.yaml",
        "gate": {"architectures": ["camera_radar"]},
        "step": "0.05 s",
        "seed": 7,
    }


def fault(name: str, target: str, model: str, at: str = "0 s", **more: Any) -> dict[str, Any]:
    """Return a fault that begins at a time."""
    return {"id": name, "target": target, "model": model, "onset": {"at": at}, **more}
