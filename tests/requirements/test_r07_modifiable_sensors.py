"""R7: every parameter of every sensor is varied from YAML, and what it stands for changes."""

from collections.abc import Iterator
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from adeye.errors import SweepError
from adeye.signals import Floats, Measurement
from adeye.simulate.channels.perception.clustering import Clustering
from adeye.simulate.sensors.rig import BUILT_IN, Rig
from adeye.simulate.world.weather import MM_PER_HOUR
from adeye.spec import sensors as records
from adeye.spec.quantity import Record
from adeye.sweep.case import TestCase
from tests.project import CANDIDATE, Project, odd_of, use
from tests.refusals import refused
from tests.simulate.sensors.scenes import CAR, TRUCK, scene, scene_context
from tests.stored import stored

pytestmark = pytest.mark.requirements

TESTED = "architecture.sensors.tested"

RECORDS: dict[str, type[Record]] = {
    "camera": records.Camera,
    "camera/physical": records.PhysicalCamera,
    "radar": records.Radar,
    "radar/physical": records.PhysicalRadar,
    "lidar": records.Lidar,
    "lidar/physical": records.PhysicalLidar,
    "ultrasonic": records.Ultrasonic,
    "gnss": records.Gnss,
    "imu": records.Imu,
    "localisation": records.Localisation,
    "ground_truth": records.GroundTruth,
}

MODELS: dict[str, dict[str, Any]] = stored("sensor_parameters")
BASES = {name: model["record"] for name, model in MODELS.items()}
"""A record of each model, beside its kind, fidelity and rate."""
AXES: dict[str, dict[str, list[Any]]] = {name: model["axes"] for name, model in MODELS.items()}
"""Two values of each parameter, beside ``CLOCK`` and ``PAPERS``, which every sensor has."""

CLOCK: dict[str, list[Any]] = {
    "rate": ["20 Hz", "10 Hz"],
    "latency": ["0 s", "0.1 s"],
    "jitter": ["0 s", "0.1 s"],
}
PAPERS: dict[str, list[Any]] = {
    "cost": [10, 20],
    "text": ["one maker", "another maker"],
    "realises": ["front_camera", "front_radar"],
}
"""What is written about a sensor: no run depends on it."""

PLAN_VIEW = frozenset({"mount.z", "mount.pitch"})
WITHOUT_EFFECT: dict[str, frozenset[str]] = {
    **dict.fromkeys(("camera", "radar", "radar/physical", "lidar", "ultrasonic"), PLAN_VIEW),
    # A place has no direction, and the unit is taken to be aligned with the vehicle.
    **dict.fromkeys(("gnss", "imu"), PLAN_VIEW | {"mount.yaw"}),
}
"""What stands in a record and is not looked at, as the record says."""


def axes_of(model: str) -> dict[str, list[Any]]:
    return AXES[model] | CLOCK


def parameters_of(record: type[Record], prefix: str = "") -> Iterator[str]:
    """Yield the dotted path of every number and word of a record; ``*`` for a name of the user."""
    for name, field in record.model_fields.items():
        path = f"{prefix}{name}"
        kept = field.annotation
        inner = [part for part in (kept, *get_args(kept)) if isinstance(part, type)]
        nested = [part for part in inner if issubclass(part, Record)]
        if not nested:
            yield path
        elif nested == [kept]:
            yield from parameters_of(nested[0], f"{path}.")
        else:
            yield from parameters_of(nested[0], f"{path}.*.")


def starred(path: str) -> str:
    """Write ``*`` for the name that the user gives to a patch or an outage."""
    head, *rest = path.split(".")
    return ".".join([head, "*", *rest[1:]]) if head in {"patches", "outages"} else path


def test_every_model_of_a_sensor_is_here() -> None:
    assert RECORDS.keys() == BUILT_IN.keys() == AXES.keys() == BASES.keys()
    sensors = [item for item in vars(records).values() if isinstance(item, type)]
    written = {item for item in sensors if "kind" in getattr(item, "model_fields", {})}
    # What a plug-in or an FMU takes, others have written.
    assert written - {records.PluginSensor, records.FmuSensor} == set(RECORDS.values())


@pytest.mark.parametrize("model", RECORDS)
def test_every_parameter_of_a_record_is_varied_here(model: str) -> None:
    known = set(parameters_of(RECORDS[model])) - {"kind", "fidelity"}
    assert {starred(path) for path in axes_of(model) | PAPERS} == known


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return a function that plans all sweeps of a model: two test cases by each parameter."""

    @cache
    def make(model: str) -> dict[str, tuple[TestCase, TestCase]]:
        project = project_of(tmp_path_factory.mktemp("sweep"), model)
        found: dict[str, list[TestCase]] = {}
        for case in project.plan().cases:
            (axis,) = case.point
            found.setdefault(axis.removeprefix(f"{TESTED}."), []).append(case)
        return {path: (one, other) for path, (one, other) in found.items()}

    return make


def project_of(folder: Path, model: str, axes: dict[str, list[Any]] | None = None) -> Project:
    """One scenario for each parameter, which sweeps it; all in one plan."""
    uses = [
        use("cut_in", {f"{TESTED}.{path}": values}) | {"as": f"sweep_{number}"}
        for number, (path, values) in enumerate((axes or axes_of(model)).items())
    ]
    project = Project(folder / "project", odd_of(*uses))
    kind, _, fidelity = model.partition("/")
    words = {"kind": kind, "rate": "20 Hz"} | ({"fidelity": fidelity} if fidelity else {})
    with project.edited(CANDIDATE) as candidate:
        candidate["sensors"]["tested"] = words | BASES[model]
        # Values that only reach what nothing is linked to are refused.
        candidate["channels"]["nominal"]["links"].append("tested")
        candidate["sensors"]["other_ultrasonic"] = {
            "kind": "ultrasonic",
            "mount": {"x": "2.2 m", "y": "0.4 m"},
            "field_of_view": "60 deg",
            "range": "5 m",
            "rate": "20 Hz",
        }
    return project


@pytest.mark.slow
@pytest.mark.parametrize("model", RECORDS)
def test_every_parameter_is_swept_from_yaml(model: str, planned: Any) -> None:
    cases = planned(model)
    assert cases.keys() == axes_of(model).keys()
    for path, (one, other) in cases.items():
        assert one.digest != other.digest, path
        assert one.situation_digest == other.situation_digest, path
        assert one.architecture.sensors["tested"] != other.architecture.sensors["tested"], path


def readings(case: TestCase, ticks: int = 30) -> list[Measurement]:
    """Let the sensors of a planned architecture watch one scene, in some rain, at dusk.

    A car drives ahead and hides half of a truck, a parked car and a person come near, and a post
    stays before the bumper of an ego that turns to the left.
    """
    sizes = [CAR, TRUCK, CAR, (0.5, 0.6, 1.75), (0.2, 0.2, 1.0)]
    kinds = ["car", "truck", "parked_car", "pedestrian", "barrier"]
    context = scene_context(sizes, kinds=kinds, rain=5.0 * MM_PER_HOUR, illuminance=1.0)
    rig = Rig([case], context, Path())
    spec = case.architecture.sensors["tested"]
    clustering = None
    if isinstance(spec, records.PhysicalLidar):
        clustering = Clustering([spec], len(sizes))
    found = []
    for tick in range(ticks):
        time = tick * context.step
        ego = (12.0 * time, 0.3 * time, 0.1 * time, 12.0, 1.0, 0.0, 0.1)
        things = [
            (25.0 + 14.0 * time, 1.5, 0.0, 14.0),
            (38.0 + 10.0 * time, 3.0, 0.0, 10.0),
            (40.0, -6.0, 0.1, 0.0),
            (25.0, 5.0 - 1.5 * time, -1.5, 1.5),
            (12.0 * time + 4.0, 0.3 * time + 0.3, 0.0, 12.0),
        ]
        item = rig.sense(scene(context, things, ego=ego, tick=tick))["tested"]
        found.append((item if clustering is None else clustering.detect(item)).copy())
    return found


def same(one: list[Measurement], other: list[Measurement]) -> bool:
    return all(
        _same(getattr(a, field.name), getattr(b, field.name))
        for a, b in zip(one, other, strict=True)
        for field in fields(Measurement)
    )


def _same(one: Floats | None, other: Floats | None) -> bool:
    if one is None or other is None:
        return one is other
    return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")


@pytest.mark.slow
@pytest.mark.parametrize("model", RECORDS)
def test_every_parameter_changes_what_the_sensor_reads(model: str, planned: Any) -> None:
    idle = {
        path
        for path, (one, other) in planned(model).items()
        if same(readings(one), readings(other))
    }
    assert idle == WITHOUT_EFFECT.get(model, frozenset())


def test_what_is_only_written_about_a_sensor_is_no_axis(tmp_path: Path) -> None:
    for path in PAPERS:
        project = project_of(tmp_path / path, "camera", {path: PAPERS[path]})
        caught = refused(SweepError, project.plan, says="no run differs between")
        assert caught.where is not None


def test_fidelity_is_swept_where_both_records_have_what_is_written(tmp_path: Path) -> None:
    project = project_of(tmp_path, "radar/physical", {"fidelity": ["object", "physical"]})
    one, other = project.plan().cases
    assert isinstance(one.architecture.sensors["tested"], records.Radar)
    assert isinstance(other.architecture.sensors["tested"], records.PhysicalRadar)
    assert one.digest != other.digest


def test_value_that_is_none_is_refused_at_its_axis(tmp_path: Path) -> None:
    for path, values, said in (
        ("range", ["5 s"], "is not a length"),
        ("beams", [1], "beams: must be at least 2"),
        ("mount.z", ["0.1 m"], "at least 0.2 m above the ground"),
        ("kind", ["radar"], "cannot vary"),
        ("bemas", [900], "no architecture has this path. There are: rate"),
    ):
        project = project_of(tmp_path / path, "lidar/physical", {path: values})
        caught = refused(SweepError, lambda made: list(made.plan().cases), project, says=said)
        assert "tested.yaml:" in str(caught)
