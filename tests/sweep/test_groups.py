"""Groups: fault entries are sets in the ODD's order, axes are those that vary something."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from adeye.errors import SweepError
from adeye.sweep.expand import read_points
from adeye.sweep.groups import Group, groups_of, varies

if TYPE_CHECKING:
    from adeye.spec.load import OddFiles

Load = Callable[..., "OddFiles"]


def fault(name: str, target: str, model: str = "drop_out") -> dict[str, Any]:
    return {"id": name, "target": target, "model": model, "onset": {"at": "1 s"}}


CAMERA = fault("camera_out", "sensors.front_camera")
RADAR = fault("radar_out", "sensors.front_radar")
SILENT = fault("silent", "channels.nominal", "silent")


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


@pytest.mark.parametrize(
    "written",
    [
        [["silent", "camera_out"]],
        [["camera_out", "silent"]],
        ["none", ["camera_out", "silent"], ["silent", "camera_out"]],
    ],
)
def test_double_fault_is_one_entry_however_it_is_written(load: Load, written: Any) -> None:
    files = load(faults=[CAMERA, SILENT], use={"faults": written})
    assert entries(files) == ["none", "camera_out+silent"]
    assert groups(files)[1].faults == (0, 1)


def test_entry_is_left_out_where_a_target_is_missing(load: Load) -> None:
    files = load(faults=[RADAR, CAMERA], use={"faults": ["radar_out", ["radar_out", "camera_out"]]})
    assert entries(files, "legacy_camera") == ["none"]
    assert entries(files) == ["none", "radar_out", "radar_out+camera_out"]


def test_unused_fault_may_have_any_target(load: Load) -> None:
    lost = fault("lost", "sensors.lidar")
    assert entries(load(faults=[lost], use={"faults": ["none"]})) == ["none"]
    with pytest.raises(
        SweepError, match=r"no architecture has sensors\.lidar\. There are: sensors"
    ):
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
