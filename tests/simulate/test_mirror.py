"""Left-hand traffic: a run there is that in the image, with the vehicle turned round in it."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.simulate.mirror import LATERAL, TURNED, as_driven
from adeye.spec import sensors
from adeye.spec.fault import FAULT, MODELS
from adeye.spec.load import load_architecture, load_scenario
from adeye.spec.odd import Attributes
from adeye.spec.quantity import SI, Measures
from adeye.spec.sensor_faults import SIGNALS, BlindSector, Miss
from adeye.spec.sensors import Mount, PhysicalCamera, SensorRecord
from adeye.sweep.case import TestCase
from adeye.trace import COLUMNS, Trace
from adeye.units import Dimension
from tests.mirroring import mirror
from tests.project import CANDIDATE, ROOT, Project, odd_of, run_cases, use

MAP = "scenarios_db/maps/rural.xodr"
ONSET = {"at": "1 s"}


def faults(side: float) -> list[dict[str, Any]]:
    """Return faults that are none of their own images, on one side or the other."""
    camera = {"target": "sensors.front_camera", "onset": ONSET}
    sector = ("8 deg", "20 deg") if side > 0.0 else ("-20 deg", "-8 deg")
    blind = dict(zip(("right", "left"), sector, strict=True))
    return [
        {"id": "dirt", "model": "blind_sector", **camera, **blind},
        {"id": "turned", "model": "miscalibration", **camera, "yaw": f"{side} deg"},
        {"id": "biased", "model": "bias", **camera, "signal": "bearing", "size": f"{side} deg"},
        {
            "id": "askew",
            "target": "actuators.steering",
            "model": "offset",
            "steering_angle": f"{0.2 * side} deg",
            "onset": ONSET,
        },
    ]


def planned(folder: Path, *, is_left: bool, side: float) -> Project:
    """Return a project in which a camera on one side of the vehicle meets a pedestrian."""
    ids = [fault["id"] for fault in faults(side)]
    swept = use("rural_pedestrian", {"place": ["rural:2+400"]}, faults=["none", ids])
    project = Project(folder, odd_of(swept, faults=faults(side)))
    if is_left:
        mirror(folder / MAP, folder / MAP)
    with project.edited(CANDIDATE) as candidate:
        camera = candidate["sensors"]["front_camera"]
        camera["mount"] = {"x": "1.5 m", "y": f"{0.9 * side} m", "yaw": f"{5.0 * side} deg"}
        candidate["channels"]["nominal"]["links"].remove("front_radar")
    project.require("FSR-01")
    return project


def run(project: Project) -> list[Trace]:
    plan = project.plan()
    return [run_cases(plan, [case]) for case in plan.cases]


def test_a_run_in_left_hand_traffic_is_that_of_the_turned_vehicle_in_the_image(
    tmp_path: Path,
) -> None:
    wanted = run(planned(tmp_path / "image", is_left=False, side=-1.0))
    found = run(planned(tmp_path / "left", is_left=True, side=1.0))
    for one, other in zip(wanted, found, strict=True):
        assert other.layout.context.road.left_hand
        for column in COLUMNS:
            np.testing.assert_array_equal(other.columns[column], one.columns[column], column)
    # The parked car hides the pedestrian from one side for longer.
    unlike = run(planned(tmp_path / "unlike", is_left=False, side=1.0))
    assert not np.array_equal(unlike[0]["detected"], wanted[0]["detected"])
    assert not np.array_equal(found[1]["ego"], found[0]["ego"])


@pytest.mark.slow
def test_verdicts_are_those_of_the_image(tmp_path: Path) -> None:
    rows = []
    for is_left in (False, True):
        project = planned(tmp_path / str(is_left), is_left=is_left, side=1.0 if is_left else -1.0)
        project.run()
        rows.append(
            [(row["fault_entry"], row["outcome"], row["verdicts"]) for row in project.rows()]
        )
    assert rows[0] == rows[1] != []


def signed(record: Any) -> set[str]:
    """Return the lengths and angles of a record that can be negative, but for those ahead."""
    found = set()
    for name, item in record.model_fields.items():
        of = {part.dimension for part in item.metadata if isinstance(part, Measures)}
        is_size = of & {Dimension.LENGTH, Dimension.ANGLE} or name in {"size", "value"}
        least = [getattr(part, key, -1.0) for part in item.metadata for key in ("ge", "gt")]
        if is_size and item.annotation is float and max(least, default=-1.0) < 0.0:
            found.add(name)
    return found - {"x", "z", "pitch"}


def test_everything_that_is_positive_to_the_left_is_turned() -> None:
    sectors = {record: {"right", "left"} for record in (Miss, BlindSector)}
    turned = sectors | {record: set(names) for record, names in TURNED.items()}
    assert {record: signed(record) for record in MODELS if signed(record)} == turned
    assert signed(Mount) == {"y", "yaw"}
    records = [*vars(sensors).values()]
    kinds = [item for item in records if isinstance(item, type) and issubclass(item, SensorRecord)]
    assert {name for kind in kinds for name in signed(kind)} == set()


def test_signals_of_faults_turn_with_what_they_measure_to_the_left() -> None:
    unlike = {"x", "range", "range_rate", "length", "width"}
    unlike |= {name for name in SIGNALS if name.endswith(("_x", "speed", "ego_acceleration"))}
    assert set(LATERAL) == set(SIGNALS) - unlike


def test_pixels_turn_about_the_middle_of_the_image() -> None:
    patch = {"patches": {"dirt": {"column": 90, "columns": 30, "rows": 5}}, "columns": 100}
    optics = {"kind": "camera", "fidelity": "physical", "rate": 10.0, "field_of_view": 1.0}
    content = {**optics, "mount": {"z": 1.0, "y": 0.5}, "rows": 50, **patch}
    sensor = PhysicalCamera.model_validate(content, context=SI)
    given = {"id": "f", "target": "sensors.c", "onset": {"at": 0.0}, "rows": 1}
    dead = {**given, "model": "dead_pixels", "column": 10, "columns": 3}
    architecture = load_architecture(ROOT / CANDIDATE).spec
    architecture = architecture.model_copy(update={"sensors": {"c": sensor}})
    scenario = load_scenario(ROOT / "scenarios_db/motorway/lead_braking.yaml").spec
    road = scenario.world.road.model_copy(update={"traffic": "left"})
    scenario = scenario.model_copy(
        update={"world": scenario.world.model_copy(update={"road": road})}
    )
    fault = FAULT.validate_python(dead, context=SI)
    case = TestCase(
        *("s", scenario, {}, architecture, (fault,), "f"),
        *(1, 0.05, Attributes(), 0, {}, True),
    )
    (driven,) = as_driven([case])
    camera: Any = driven.architecture.sensors["c"]
    assert (camera.mount.y, camera.patches["dirt"].column, camera.patches["dirt"].columns) == (
        *(-0.5, 0, 10),
    )
    pixels: Any = driven.faults[0]
    assert (pixels.column, pixels.columns) == (87, 3)
    assert driven.digest == case.digest
