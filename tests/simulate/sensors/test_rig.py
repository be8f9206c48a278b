"""The sensors of an architecture together: names, kinds, rates, independence."""

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from pydantic import ValidationError

from adeye.errors import PluginError, SpecError
from adeye.signals import Measurement, Scene
from adeye.simulate.sensors.rig import BUILT_IN, DATA_SHEETS, Rig, data_sheets, mounts
from adeye.sweep.case import TestCase
from tests.simulate.sensors.scenes import CAR, architecture, scene, scene_context

RADAR = {
    "kind": "radar",
    "mount": {"x": "2 m"},
    "field_of_view": "60 deg",
    "range": "150 m",
    "rate": "20 Hz",
    "range_noise": "0.3 m",
    "bearing_noise": "0.2 deg",
}
CAMERA = {
    "kind": "camera",
    "mount": {"x": "1.5 m", "yaw": "5 deg"},
    "field_of_view": "60 deg",
    "range": "120 m",
    "rate": "10 Hz",
    "latency": "0.1 s",
    "distance_noise": 0.02,
}
POSE = {"kind": "localisation", "rate": "20 Hz", "lateral_noise": "0.1 m"}
GNSS = {"kind": "gnss", "rate": "10 Hz", "position_noise": "0.5 m", "bias": "0.5 m"}
IMU = {"kind": "imu", "rate": "20 Hz", "yaw_rate_noise": "0.1 deg/s"}

PLUGIN = """
from adeye.delivery import no_measurement


class Blind:
    def __init__(self, context):
        self.context = context

    def sense(self, scene):
        runs, count = self.context.scene.runs, len(self.context.scene.object_ids)
        return no_measurement(runs, count, with_estimate=False)
"""


def cases(*sensors: Mapping[str, Any]) -> list[TestCase]:
    """Test cases with these sensors: a rig looks at nothing else of them."""
    made = [SimpleNamespace(architecture=architecture(items)) for items in sensors]
    return cast("list[TestCase]", made)


def sense(
    sensors: Mapping[str, Any], ticks: int = 8, *, step: float = 0.05, folder: Path = Path()
) -> list[dict[str, Measurement]]:
    """Let a rig watch a car that drives away; copy what it delivers."""
    context = scene_context([CAR], step=step)
    rig = Rig(cases(sensors), context, folder)
    return [_copied(rig.sense(at(context, tick))) for tick in range(ticks)]


def at(context: Any, tick: int) -> Scene:
    return scene(context, [(40.0 + 10.0 * tick * context.step, 0.0)], tick=tick)


def _copied(readings: dict[str, Measurement]) -> dict[str, Measurement]:
    return {name: item.copy() for name, item in readings.items()}


def same(one: Measurement, other: Measurement) -> bool:
    pairs = [
        (getattr(one, field.name), getattr(other, field.name)) for field in fields(Measurement)
    ]
    return all(a is b or np.array_equal(a, b, equal_nan=a.dtype.kind == "f") for a, b in pairs)


def test_every_sensor_has_a_reading_by_its_name() -> None:
    readings = sense({"front_radar": RADAR, "front_camera": CAMERA, "pose": POSE}, ticks=1)[0]
    assert sorted(readings) == ["front_camera", "front_radar", "pose"]
    assert readings["pose"].estimate is not None
    assert readings["front_radar"].estimate is None


def test_second_sensor_of_a_kind_is_a_second_name_with_noise_of_its_own() -> None:
    for readings in sense({"left": RADAR, "right": RADAR}):
        left, right = readings["left"], readings["right"]
        assert left.mask[0, 0]
        assert right.mask[0, 0]
        assert not np.array_equal(left.detections, right.detections)


PHYSICAL = {"fidelity": "physical", "field_of_view": "60 deg", "rate": "20 Hz"}
ALL: dict[str, dict[str, Any]] = {
    "camera": CAMERA,
    "camera/physical": {
        **PHYSICAL,
        "kind": "camera",
        "mount": {"x": "1.5 m", "z": "1.3 m"},
        "noise": 0.02,
    },
    "radar": RADAR,
    "radar/physical": {
        **PHYSICAL,
        "kind": "radar",
        "mount": {"x": "2 m"},
        "range": "150 m",
        "clutter": 3,
    },
    "lidar": {
        "kind": "lidar",
        "mount": {"x": "1 m"},
        "field_of_view": "360 deg",
        "range": "100 m",
        "rate": "10 Hz",
        "range_noise": "0.05 m",
    },
    "lidar/physical": {
        **PHYSICAL,
        "kind": "lidar",
        "mount": {"x": "1 m", "z": "0.8 m"},
        "range": "100 m",
        "range_noise": "0.05 m",
        "drop_out": 0.1,
    },
    "ultrasonic": {
        "kind": "ultrasonic",
        "mount": {"x": "2 m"},
        "field_of_view": "60 deg",
        "range": "60 m",
        "rate": "20 Hz",
        "range_noise": "0.02 m",
    },
    "gnss": GNSS,
    "imu": IMU,
    "localisation": POSE,
    "ground_truth": {"kind": "ground_truth", "rate": "20 Hz"},
}
"""One sensor of each model, with noise where it has any."""


def test_there_is_a_sensor_of_every_model_here() -> None:
    assert ALL.keys() == BUILT_IN.keys()


@pytest.mark.parametrize("added", ALL)
@pytest.mark.parametrize("jitter", ["0 s", "0.15 s"])
def test_another_sensor_leaves_every_other_measurement_bit_identical(
    added: str, jitter: str
) -> None:
    base = {f"s{number}": record for number, record in enumerate(ALL.values())}
    more = {**ALL[added], "jitter": jitter}
    alone = [sense({name: record}) for name, record in base.items()]
    # Neither what else is there, nor a further one, nor its place in the file matters.
    for suite in (base, {**base, "more": more}, {"more": more, **base}):
        together = sense(suite)
        for name, expected in zip(base, alone, strict=True):
            for before, after in zip(expected, together, strict=True):
                assert same(before[name], after[name]), name


def test_one_sensor_is_no_other_one() -> None:
    # What the law above compares does tell sensors apart: two of one kind differ by their names.
    for model, record in ALL.items():
        readings = sense({"one": record, "other": record}, ticks=12)
        differs = not all(same(item["one"], item["other"]) for item in readings)
        assert differs == (model != "ground_truth"), model


def test_halving_the_step_leaves_every_sample_bit_identical() -> None:
    # In an exactly known scene; the noise counts the sensor's own samples, not ticks.
    def noise(step: float, stride: int) -> list[list[float]]:
        context = scene_context([CAR], step=step)
        rig = Rig(cases({"front": RADAR}), context, Path())
        rows = []
        for tick in range(6 * stride):
            found = rig.sense(scene(context, [(40.0, 0.0)], tick=tick))["front"]
            if found.fresh[0]:
                rows.append(found.detections[0, 0].tolist())
        return rows

    assert noise(0.05, 1) == noise(0.025, 2)


def test_rates_and_latencies_are_in_ticks_of_the_master_clock() -> None:
    fresh = [readings["front"].fresh[0] for readings in sense({"front": CAMERA})]
    assert fresh == [False, False, True, False, True, False, True, False]


def test_rate_that_does_not_divide_the_clock_is_refused() -> None:
    with pytest.raises(SpecError, match=r"sensors\.front\.rate"):
        sense({"front": {**RADAR, "rate": "7 Hz"}})


def test_values_may_vary_from_run_to_run() -> None:
    context = scene_context([CAR], runs=2)
    rig = Rig(cases({"front": RADAR}, {"front": {**RADAR, "range": "20 m"}}), context, Path())
    assert rig.sense(scene(context, [(40.0, 0.0)]))["front"].mask[:, 0].tolist() == [True, False]


def test_unknown_kind_is_no_sensor() -> None:
    with pytest.raises(ValidationError, match="sonar"):
        architecture({"front": {**RADAR, "kind": "sonar"}})


def test_plugin_that_is_not_there_is_named() -> None:
    with pytest.raises(SpecError, match=r"no file .*sonar\.py"):
        sense({"front": {"kind": "./sonar.py:Sonar", "rate": "20 Hz"}}, ticks=1)


def test_plugin_sensor_comes_from_the_folder_of_its_file(tmp_path: Path) -> None:
    (tmp_path / "blind.py").write_text(PLUGIN, "utf-8")
    sensors = {"front": {"kind": "./blind.py:Blind", "rate": "20 Hz"}, "back": RADAR}
    readings = sense(sensors, ticks=2, folder=tmp_path)
    assert not readings[-1]["front"].mask.any()
    assert readings[-1]["back"].mask.any()


def test_answer_below_a_mask_is_refused(tmp_path: Path) -> None:
    answer = "no_measurement(runs, count, with_estimate=False)"
    hidden = f"{answer}.map(lambda values: np.ma.masked_array(values, mask=True))"
    text = PLUGIN.replace(answer, hidden)
    (tmp_path / "blind.py").write_text(f"import numpy as np\n{text}", "utf-8")
    sensors = {"front": {"kind": "./blind.py:Blind", "rate": "20 Hz"}}
    with pytest.raises(PluginError, match=r"blind\.py.*masked samples, not numbers"):
        sense(sensors, ticks=1, folder=tmp_path)


def test_mounts_are_poses_of_the_sensors_that_have_one() -> None:
    found = mounts(cases({"front": CAMERA, "pose": POSE}, {"front": CAMERA, "pose": POSE}))
    assert list(found) == ["front"]
    assert found["front"] == pytest.approx(np.array([[1.5, 0.0, 0.0, np.radians(5.0)]] * 2))


def test_ultrasonic_sensors_of_a_rig_hear_each_other_only_if_they_are_told_to() -> None:
    def distance(cross_talk: bool) -> float:  # noqa: FBT001 - one word
        parking = {"kind": "ultrasonic", "field_of_view": "60 deg", "range": "5 m", "rate": "20 Hz"}
        sensors = {
            "front": {**parking, "mount": {"x": "0 m"}, "cross_talk": cross_talk},
            "further": {**parking, "mount": {"x": "2 m"}},
        }
        context = scene_context([CAR])
        rig = Rig(cases(sensors), context, Path())
        found = rig.sense(scene(context, [(4.0 + 0.5 * CAR[0], 0.0)]))["front"]
        return float(found.detections[0, 0, 0])

    assert distance(cross_talk=False) == pytest.approx(4.0)
    assert distance(cross_talk=True) == pytest.approx(3.0)


def test_jitter_is_in_ticks_of_the_master_clock() -> None:
    late = {"front": {**CAMERA, "jitter": "0.1 s"}}
    stamps = [float(readings["front"].stamp[0]) for readings in sense(late, ticks=40)]
    on_time = [float(readings["front"].stamp[0]) for readings in sense({"front": CAMERA}, ticks=40)]
    behind = np.array(on_time[4:]) - np.array(stamps[4:])
    assert behind.min() == 0.0
    # A sample each 0.1 s, at most as much late.
    assert behind.max() == pytest.approx(0.1)
    with pytest.raises(SpecError, match=r"sensors\.front\.jitter"):
        sense({"front": {**CAMERA, "jitter": "0.07 s"}})


def test_receiver_and_unit_know_where_the_rear_axle_is() -> None:
    # The vehicle of the architecture has a wheelbase of 2.7 m.
    context = scene_context([])
    shown = scene(context, [], ego=(0.0, 0.0, 0.0, 20.0, 0.0, 0.0, 0.1))
    readings = Rig(cases({"gnss": GNSS, "imu": IMU}), context, Path()).sense(shown)
    fix, sample = readings["gnss"].values, readings["imu"].values
    assert fix is not None
    assert sample is not None
    assert fix[0, 3] == pytest.approx(0.1 * 1.35)
    assert sample[0, 0] == pytest.approx(-0.1 * 0.1 * 1.35)


def test_data_sheets_tell_the_accuracy_of_every_run_and_no_outage() -> None:
    suite = {"gnss": GNSS, "imu": IMU, "front": RADAR, "pose": POSE}
    worse = {**GNSS, "position_noise": "2 m"}
    sheets = data_sheets(cases(suite, {**suite, "gnss": worse}))
    assert {name: tuple(sheet) for name, sheet in sheets.items()} == {
        "gnss": DATA_SHEETS["gnss"],
        "imu": DATA_SHEETS["imu"],
        "front": DATA_SHEETS["radar"],
    }
    assert sheets["gnss"]["position_noise"].tolist() == [0.5, 2.0]
    assert sheets["gnss"]["rate"].tolist() == [10.0, 10.0]
    assert sheets["front"]["range_noise"].tolist() == [0.3, 0.3]


def test_data_sheet_of_a_camera_with_an_image_tells_its_height() -> None:
    camera = {**CAMERA, "fidelity": "physical", "mount": {"z": "1.3 m"}, "columns": 300}
    del camera["range"], camera["distance_noise"]
    sheet = data_sheets(cases({"front": camera}))["front"]
    assert {field: column.tolist() for field, column in sheet.items()} == {
        "field_of_view": [pytest.approx(np.pi / 3.0)],
        "columns": [300.0],
        "mount.z": [1.3],
    }
