"""Bounds of plausibility: slips of units and digits are refused with their place, unless meant."""

import shutil
from pathlib import Path
from typing import Any

import pytest
import yaml
from annotated_types import Le, Lt
from pydantic import BaseModel

from adeye.campaign.check import is_written
from adeye.campaign.plan import make_plan
from adeye.errors import InputError, SpecError
from adeye.spec import plausible
from adeye.spec.load import load_architecture, load_scenario, scenario_files, shipped
from adeye.spec.plausible import BOUNDS
from adeye.spec.sensors import Patch, SensorRecord, _Ranging
from adeye.units import Dimension
from tests.project import CANDIDATE, MINI, Project, odd_of
from tests.refusals import refused
from tests.stored import known, stored

TABLES = stored("definitions")


ARCHITECTURE = shipped("odd") / "architectures" / "camera_radar.yaml"


def edited(source: Path, folder: Path, path: str, value: Any, **more: Any) -> Path:
    """Copy a YAML file with another value at a dotted path."""
    content = yaml.safe_load(source.read_text("utf-8")) | more
    *folders, name = path.split(".")
    place = content
    for key in folders:
        place = place[key]
    place[name] = value
    copy = folder / source.name
    copy.write_text(yaml.safe_dump(content, sort_keys=False), "utf-8")
    return copy


@pytest.mark.parametrize(
    ("path", "value", "bound"), TABLES["part beyond the plausible is refused unless it is meant"]
)
def test_part_beyond_the_plausible_is_refused_unless_it_is_meant(
    tmp_path: Path, path: str, value: str, bound: str
) -> None:
    with pytest.raises(SpecError, match=f"{path}: .* is not plausible; {bound} is from ") as caught:
        load_architecture(edited(ARCHITECTURE, tmp_path, path, value))
    assert known(caught.value.where).line > 1
    assert f"beyond_plausible: [{bound}]" in str(caught.value)
    meant = edited(ARCHITECTURE, tmp_path, path, value, beyond_plausible=[bound])
    assert load_architecture(meant).spec.architecture == "camera_radar"
    other = next(name for name in BOUNDS if name != bound)
    with pytest.raises(SpecError, match="is not plausible"):
        load_architecture(edited(ARCHITECTURE, tmp_path, path, value, beyond_plausible=[other]))


@pytest.mark.parametrize(
    ("source", "path"),
    [
        ("lidar", "sensors.roof_lidar.reference_reflectivity"),
        ("study_camera_radar", "sensors.front_radar.reference_cross_section"),
    ],
)
def test_range_is_not_specified_at_what_nobody_can_see(
    tmp_path: Path, source: str, path: str
) -> None:
    # It would see other objects far beyond the range that the file says.
    shutil.copytree(ARCHITECTURE.parent, tmp_path, dirs_exist_ok=True)
    file = edited(ARCHITECTURE.with_name(f"{source}.yaml"), tmp_path, path, 1e-6)
    refused(SpecError, load_architecture, file, says=f"{path}: .* is not plausible")


@pytest.mark.parametrize(
    "record", [*SensorRecord.__subclasses__(), *_Ranging.__subclasses__(), Patch]
)
def test_number_of_a_sensor_has_two_ends(record: type[BaseModel]) -> None:
    # Whatever has no unit is a share, a factor or an intensity; only a price may be any.
    for name, dimension in plausible._dimensions(record).items():
        if dimension is Dimension.NONE and name != "cost":
            ends = {type(item) for item in record.model_fields[name].metadata}
            is_bound = plausible._bound_of(f"sensors.front.{name}", dimension)
            assert is_bound or ends & {Le, Lt}, f"{record.__name__}.{name}"


def test_bound_that_there_is_not_cannot_be_lifted(tmp_path: Path) -> None:
    path = edited(ARCHITECTURE, tmp_path, "cost", 1, beyond_plausible=["wheelbas"])
    with pytest.raises(SpecError, match=r"no bound of plausibility 'wheelbas'.*wheelbase"):
        load_architecture(path)


@pytest.mark.parametrize("folder", ["architectures", "concepts"])
def test_what_is_shipped_lifts_no_bound(folder: str) -> None:
    for path in [*(shipped("odd") / folder).glob("*.yaml"), *shipped("odd").glob("*.yaml")]:
        assert "beyond_plausible" not in path.read_text("utf-8")


LEAD = scenario_files(shipped("scenarios_db"))["lead_braking"]


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Project:
    """Make a project with a scenario of its own."""
    odd = odd_of({"use": "mine"}, architectures=("camera_radar", "legacy_camera"))
    return Project(tmp_path_factory.mktemp("plausible") / "project", odd)


def mine(project: Project, path: str, value: Any) -> Path:
    """Write that scenario: the shipped one with another value at a path."""
    file = edited(LEAD, project.folder / "scenarios_db", path, value, scenario="mine")
    return file.rename(file.with_name("mine.yaml"))


@pytest.mark.parametrize(
    ("path", "value", "bound"), TABLES["scenario beyond the plausible is refused"]
)
def test_scenario_beyond_the_plausible_is_refused(
    project: Project, path: str, value: Any, bound: str
) -> None:
    assert load_scenario(mine(project, path, value)).spec.scenario == "mine"
    with pytest.raises(InputError, match=f"{path}: .* is not plausible; {bound} is from "):
        make_plan(project.odd)


def test_object_is_long_or_wide_but_not_high(project: Project) -> None:
    house = {"kind": "building", "s": "500 m", "offset": "-9 m", "length": "900 m", "width": "1 m"}
    mine(project, "world.objects", {"house": {**house, "height": "100 m"}})
    assert make_plan(project.odd).cases
    mine(project, "world.objects", {"house": {**house, "height": "101 m"}})
    refused(InputError, make_plan, project.odd, says=r"house\.height: .*; object_height is from ")


def test_constant_that_no_run_can_have_is_refused(project: Project) -> None:
    for path, value in (("ego.speed", "-5 m/s"), ("storyboard.brake.stop.rate", "0 m/s^2")):
        mine(project, path, value)
        refused(InputError, make_plan, project.odd, says=f"{path}: .* is not above ")


@pytest.mark.parametrize("path", TABLES["delay longer than the run is refused"])
def test_delay_longer_than_the_run_is_refused(project: Project, path: str) -> None:
    """Such a sensor, channel or switch does nothing in any run, and no bound of its own says so."""
    mine(project, "tail", "13 s")
    before = (project.folder / CANDIDATE).read_text("utf-8")
    edited(project.folder / CANDIDATE, (project.folder / CANDIDATE).parent, path, "60 s")
    try:
        with pytest.raises(InputError, match=f"{path}: 60 s is not plausible; .* takes 25 s"):
            make_plan(project.odd)
    finally:
        (project.folder / CANDIDATE).write_text(before, "utf-8")


def test_default_counts_as_nobodys_word() -> None:
    """A switch waits 0.2 s unless it is told otherwise, also in a run of 0.1 s."""
    whole = load_architecture(ARCHITECTURE).spec
    assert is_written(whole, ("switch", "staleness"))
    said = whole.switch.model_fields_set - {"staleness"}
    switch = type(whole.switch).model_construct(_fields_set=said, **dict(whole.switch))
    short = whole.model_copy(update={"switch": switch})
    assert not is_written(short, ("switch", "staleness"))
    assert is_written(short, ("sensors", "front_camera", "latency"))


def test_fault_beyond_the_plausible_is_refused_unless_it_is_meant(tmp_path: Path) -> None:
    project = Project(tmp_path, MINI)
    for fault, bound in TABLES["fault beyond the plausible is refused unless it is meant"]:
        own = {"id": "absurd", "target": "sensors.front_radar", "onset": {"at": "2 s"}}
        with project.edited_odd() as odd:
            odd.pop("beyond_plausible", None)
            odd["faults"] = [{**own, **fault}]
            odd["scenarios"][0]["faults"] = ["none", "absurd"]
        refused(SpecError, project.plan, says=rf"faults\.0\..* is not plausible; {bound} is from ")
        with project.edited_odd() as odd:
            odd["beyond_plausible"] = [bound]
        project.plan()
