"""Groups of test cases with one variant, sections of them, and what those share."""

from typing import Any

import pytest

from adeye.errors import SweepError
from adeye.spec.load import OddFiles
from adeye.sweep.expand import Expansion, expand, read_points
from adeye.sweep.groups import Group, groups_of, overlapping, varies
from tests.motorway import fault
from tests.stored import stored
from tests.sweep.conftest import CANDIDATE, Load

TABLES = stored("sweeps")


# --- Groups: fault entries are sets in the ODD's order, axes are those that vary something --------


CAMERA = fault("camera_out", "sensors.front_camera", "drop_out", "1 s")
RADAR = fault("radar_out", "sensors.front_radar", "drop_out", "1 s")
SILENT = fault("silent", "channels.nominal", "silent", "1 s")


def groups(files: OddFiles, architecture: str = "camera_radar") -> list[Group]:
    axes, points = read_points(files, 0)
    return groups_of(files, 0, files.architectures[architecture], axes, points)


def entries(files: OddFiles, architecture: str = "camera_radar") -> list[str]:
    return [group.entry for group in groups(files, architecture)]


def test_without_faults_there_is_the_fault_free_entry(load: Load) -> None:
    assert entries(load()) == ["none"]
    assert entries(load(use={"faults": []}, faults=[CAMERA])) == ["none"]


def test_every_fault_alone_is_the_default(load: Load) -> None:
    assert entries(load(faults=[CAMERA, RADAR])) == ["none", "camera_out", "radar_out"]


def test_double_fault_is_one_entry_however_it_is_written(load: Load) -> None:
    one, other = ["silent", "camera_out"], ["camera_out", "silent"]
    for written in ([one], [other], ["none", other, one]):
        files = load(faults=[CAMERA, SILENT], use={"faults": written})
        assert entries(files) == ["none", "camera_out+silent"]
        assert groups(files)[1].faults == (0, 1)


def test_entry_is_left_out_where_a_target_is_missing(load: Load) -> None:
    files = load(faults=[RADAR, CAMERA], use={"faults": ["radar_out", ["radar_out", "camera_out"]]})
    assert entries(files, "legacy_camera") == ["none"]
    assert entries(files) == ["none", "radar_out", "radar_out+camera_out"]


def test_unused_fault_may_have_any_target(load: Load) -> None:
    lost = fault("lost", "sensors.lidar", "drop_out")
    assert entries(load(faults=[lost], use={"faults": ["none"]})) == ["none"]
    with pytest.raises(SweepError, match=r"no architecture has sensors\.lidar\. There are: senso"):
        entries(load(faults=[lost]))


def test_axis_that_varies_nothing_is_left_out_and_its_points_fall_together(load: Load) -> None:
    radar = "architecture.sensors.front_radar.range"
    length = "faults.camera_out.duration"
    sweep = {"parameters": {"gap": ["30 m", "40 m"], radar: ["100 m", "150 m"], length: ["1 s"]}}
    files = load(sweep, faults=[CAMERA])
    plain, faulty = groups(files, "legacy_camera")
    assert {axis.name for axis in plain.axes} == {"gap"}
    assert {axis.name for axis in faulty.axes} == {"gap", length}
    assert len(plain.rows) == len(faulty.rows) == 2
    assert [len(group.rows) for group in groups(files)] == [4, 4]


def test_rows_that_fall_together_keep_the_first_of_each(load: Load) -> None:
    radar = "architecture.sensors.front_radar.range"
    axes = {"gap": ["30 m", "40 m", "30 m"], radar: ["9 m", "9 m", "10 m"]}
    sweep = {"design": "zip", "parameters": axes}
    assert groups(load(sweep), "legacy_camera")[0].rows.tolist() == [0, 1]


def test_without_axes_there_is_one_row(load: Load) -> None:
    assert groups(load({}))[0].rows.tolist() == [0]


def test_axis_of_a_fault_varies_with_that_fault_only(load: Load) -> None:
    files = load({"parameters": {"faults.camera_out.duration": ["1 s"]}}, faults=[CAMERA])
    (axis,), _ = read_points(files, 0)
    spec = files.architectures["legacy_camera"].spec
    assert varies(axis, spec, ("camera_out",))
    assert not varies(axis, spec, ("radar_out",))
    assert not varies(axis, spec, ())


# --- Sections: what one file variant makes alike stands together, and every ordinal is in one -----

RANGE = "architecture.sensors.front_camera.range"
LANES = "scenario.world.road.lanes"
GAPS = ["30 m", "40 m", "50 m"]
SWEPT: dict[str, list[Any]] = {"gap": GAPS, LANES: [3, 4]}


def expanded(
    load: Load, parameters: dict[str, list[Any]], design: str = "full_factorial"
) -> Expansion:
    sweep = {"design": design, "parameters": parameters}
    return expand(load(sweep, architectures=CANDIDATE, replicates=2))


def test_axes_of_parameters_make_one_section(load: Load) -> None:
    sections = expanded(load, {"gap": GAPS, "rain": ["0 mm/h", "5 mm/h"]}).sections
    assert [(item.first, item.end, len(item)) for item in sections] == [(0, 12, 12)]
    assert sections[0].rows.tolist() == [0, 1, 2, 3, 4, 5]


def test_points_of_one_variant_stand_together(load: Load) -> None:
    sections = expanded(load, SWEPT).sections
    assert [item.rows.tolist() for item in sections] == [[0, 2, 4], [1, 3, 5]]
    assert [(item.first, item.end) for item in sections] == [(0, 6), (6, 12)]


def test_sections_stand_in_the_order_of_their_first_points(load: Load) -> None:
    ranges = ["120 m", "90 m", "90 m", "120 m"]
    gaps = ["30 m", "40 m", "50 m", "60 m"]
    sections = expanded(load, {"gap": gaps, RANGE: ranges}, "zip").sections
    assert [item.rows.tolist() for item in sections] == [[0, 3], [1, 2]]


def test_what_is_written_differently_is_another_section(load: Load) -> None:
    assert len(expanded(load, {"architecture.cost": [1, 2]}).sections) == 2


@pytest.mark.parametrize(
    ("start", "stop", "found"), TABLES["ordinal range is found in its sections"]
)
def test_ordinal_range_is_found_in_its_sections(
    load: Load, start: int, stop: int, found: list[list[int]]
) -> None:
    sections = expanded(load, SWEPT).sections
    got = [[item.first, low, high] for item, low, high in overlapping(sections, start, stop)]
    assert got == found


# --- What a section shares: the records of its variant, made once for all that have it ------------


def test_files_that_nothing_is_written_into_are_shared_as_they_are(load: Load) -> None:
    files = load()
    expansion = expand(files)
    for section in expansion.sections:
        shared = expansion.shared(section)
        assert shared.scenario is files.scenarios["cut_in"].spec
        assert shared.architecture is section.group.architecture.spec


def test_each_section_has_its_variant_and_gets_it_again(load: Load) -> None:
    expansion = expanded(load, {RANGE: ["90 m", "110 m"]})
    made = [expansion.shared(section).architecture for section in expansion.sections]
    assert [item.sensors["front_camera"].range for item in made] == [90.0, 110.0]  # type: ignore[union-attr]
    assert expansion.shared(expansion.sections[0]).architecture is made[0]


def test_parameters_are_the_defaults_with_what_the_use_fixes(load: Load) -> None:
    expansion = expand(load(use={"parameters": {"rain": "5 mm/h"}}))
    parameters = expansion.shared(expansion.sections[0]).parameters
    assert parameters["rain"] == 5e-3 / 3600
    assert list(parameters) == list(expansion.files.scenarios["cut_in"].spec.parameters)


def test_value_that_is_not_valid_in_the_file_is_refused_at_its_axis(load: Load) -> None:
    expansion = expanded(load, {RANGE: ["90 m", "-1 m"]})
    expansion.shared(expansion.sections[0])
    with pytest.raises(SweepError, match=r"example\.yaml:\d+:\d+: with sensors\.front_camera"):
        expansion.shared(expansion.sections[1])
