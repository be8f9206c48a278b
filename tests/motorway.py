"""A motorway scenario and its test cases, by the words that a test changes."""

from collections.abc import Mapping
from typing import Any

from adeye.spec.architecture import Architecture
from adeye.spec.odd import Attributes
from adeye.spec.scenario import LogicalScenario
from adeye.sweep.case import TestCase

MOTORWAY: dict[str, Any] = {
    "scenario": "motorway",
    "title": "A motorway",
    "provenance": {"source": "made for a test"},
    "parameters": {"ego_speed": {"default": "30 m/s"}, "gap": {"default": "40 m"}},
    "world": {
        "road": {
            "kind": "straight",
            "length": "2000 m",
            "lanes": 3,
            "lane_width": "3.5 m",
            "shoulder": "2.5 m",
            "speed_limit": "130 km/h",
        }
    },
    "environment": {"rain": "0 mm/h", "fog_visibility": "2000 m", "friction": 0.9},
    "ego": {"lane": 1, "s": "200 m", "speed": "ego_speed"},
    "horizon": "5 s",
    "tail": "2 s",
}
VEHICLE: dict[str, Any] = {
    "length": "4.8 m",
    "width": "1.9 m",
    "height": "1.5 m",
    "wheelbase": "2.9 m",
    "max_acceleration": "3 m/s^2",
    "max_deceleration": "9 m/s^2",
    "max_steering_angle": "0.6 rad",
    "max_steering_rate": "0.8 rad/s",
    "acceleration_lag": "0.2 s",
    "steering_lag": "0.1 s",
}
ARCHITECTURE: dict[str, Any] = {
    "architecture": "bare",
    "title": "An ego with one channel",
    "vehicle": VEHICLE,
    "sensors": {"truth": {"kind": "ground_truth", "rate": "20 Hz"}},
    "channels": {"nominal": {"kind": "nominal", "links": ["truth"]}},
    "switch": {"policy": "fixed_priority", "priority": ["nominal"], "default": "nominal"},
}


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
