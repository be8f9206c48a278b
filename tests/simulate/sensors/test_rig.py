"""The sensors of an architecture together: names, kinds, rates, independence."""

import math
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from adeye.errors import PluginError, SpecError
from adeye.signals import Measurement, Scene, SceneContext
from adeye.simulate.sensors.rig import BUILT_IN, DATA_SHEETS, Rig, data_sheets, mounts
from adeye.sweep.case import TestCase
from adeye.testing import check_sensor
from tests.simulate.sensors.scenes import CAR, architecture, scene, scene_context

VIEW = {"mount": {"x": "2 m"}, "field_of_view": "60 deg", "range": "150 m", "rate": "20 Hz"}
POSE = {"kind": "localisation", "rate": "20 Hz", "lateral_noise": "0.1 m"}
RADAR = {**VIEW, "kind": "radar", "range_noise": "0.3 m", "bearing_noise": "0.2 deg"}
CAMERA = {
    **VIEW,
    "kind": "camera",
    "mount": {"x": "1.5 m", "yaw": "5 deg"},
    "rate": "10 Hz",
    "latency": "0.1 s",
    "distance_noise": 0.02,
}
GNSS = {"kind": "gnss", "rate": "10 Hz", "position_noise": "0.5 m", "bias": "0.5 m"}
IMU = {"kind": "imu", "rate": "20 Hz", "yaw_rate_noise": "0.1 deg/s"}
PHYSICAL = {**VIEW, "fidelity": "physical", "mount": {"x": "1 m", "z": "1 m"}}
PIXELS = {name: value for name, value in PHYSICAL.items() if name != "range"}
DIRT = {"column": 60, "row": 20, "columns": 30, "rows": 25, "transmission": 0.9}
BEAMS = {"range_noise": "0.05 m", "bearing_noise": "0.1 deg", "drop_out": 0.1}

ALL: dict[str, dict[str, Any]] = {
    "camera": CAMERA,
    "camera/physical": {**PIXELS, "kind": "camera", "noise": 0.02, "patches": {"dirt": DIRT}},
    "radar": RADAR,
    "radar/physical": {**PHYSICAL, "kind": "radar", "clutter": 3},
    "lidar": {**VIEW, "kind": "lidar", "field_of_view": "360 deg", "range_noise": "0.05 m"},
    "lidar/physical": {**PHYSICAL, "kind": "lidar", **BEAMS},
    "ultrasonic": {**VIEW, "kind": "ultrasonic", "range": "60 m", "range_noise": "0.02 m"},
    "gnss": {**GNSS, "outages": {"tunnel": {"begin": "5 s", "duration": "1 s"}}},
    "imu": IMU,
    "localisation": POSE,
    "ground_truth": {"kind": "ground_truth", "rate": "20 Hz"},
}
"""One sensor of each model, with noise where it has any."""

LAYERS = {"layers": 4, "vertical_field_of_view": "10 deg", "beams": 90}
TURNED = {"z": "1.3 m", "yaw": "20 deg", "pitch": "2 deg"}
UNLIKE: dict[str, dict[str, Any]] = {
    "camera": {"range": "20 m", "mount": {"yaw": "20 deg"}},
    "camera/physical": {"mount": TURNED, "patches": {"dirt": {**DIRT, "noise": 0.1}}},
    "radar": {"range_noise": "0.1 m"},
    "radar/physical": {"clutter": 0, "mount": {"yaw": "20 deg"}},
    "lidar": {"range_noise": "0.5 m"},
    "lidar/physical": {"mount": TURNED},
    "ultrasonic": {"range_noise": "0.1 m"},
    "gnss": {"bias": "2 m", "outages": {"tunnel": {"begin": "0.5 s", "duration": "0.3 s"}}},
    "imu": {"yaw_rate_noise": "1 deg/s", "bias_time": "5 s"},
    "localisation": {"lateral_noise": "0.3 m"},
    "ground_truth": {},
}
"""Fields that may differ from run to run of a batch."""

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


def rig_of(context: SceneContext, *suites: Mapping[str, Any], folder: Path = Path()) -> Rig:
    """Return the rig of a batch of which each run has one of these suites of sensors."""
    return Rig(cases(*suites), context, folder)


def sense(
    sensors: Mapping[str, Any], ticks: int = 8, *, step: float = 0.05, folder: Path = Path()
) -> list[dict[str, Measurement]]:
    """Let a rig watch a car that drives away; copy what it delivers."""
    context = scene_context([CAR], step=step)
    rig = rig_of(context, sensors, folder=folder)
    return [_copied(rig.sense(at(context, tick))) for tick in range(ticks)]


def at(context: Any, tick: int) -> Scene:
    return scene(context, [(40.0 + 10.0 * tick * context.step, 0.0)], tick=tick)


def _copied(readings: dict[str, Measurement]) -> dict[str, Measurement]:
    return {name: item.copy() for name, item in readings.items()}


def same(one: Measurement, other: Measurement) -> bool:
    pairs = [(getattr(one, f.name), getattr(other, f.name)) for f in fields(Measurement)]
    return all(a is b or np.array_equal(a, b, equal_nan=a.dtype.kind == "f") for a, b in pairs)


def content(item: Measurement, run: int = 0) -> dict[str, list[Any]]:
    """Return what a reading says of one run, whatever room it has for more."""
    found = item.mask[run]
    parts = {"detections": item.detections[run, found], "source": item.source[run, found]}
    for name in ("points", "hits", "estimate", "values"):
        array = getattr(item, name)
        if array is not None:
            parts[name] = array[run]
    return {name: np.nan_to_num(array, nan=-1e9).tolist() for name, array in parts.items()}


def test_every_sensor_delivers_under_its_name_what_its_kind_measures_and_nothing_else() -> None:
    def parts(item: Measurement) -> set[str]:
        optional = ("points", "estimate", "values")
        found = {name for name in optional if getattr(item, name) is not None}
        return found | ({"detections"} if item.mask.any() else set())

    shown = sense({model.replace("/", "_"): record for model, record in ALL.items()}, ticks=4)[-1]
    expected = {name: {"detections"} for name in shown} | {
        # What it detects is made of its points by the channels.
        "lidar_physical": {"points"},
        "gnss": {"values"},
        "imu": {"values"},
        "localisation": {"estimate"},
        "ground_truth": {"detections", "estimate"},
    }
    assert {name: parts(item) for name, item in shown.items()} == expected


def test_there_is_a_sensor_of_every_model_here() -> None:
    assert ALL.keys() == UNLIKE.keys() == BUILT_IN.keys()


@pytest.mark.slow
@pytest.mark.parametrize("model", ALL)
def test_every_model_conforms(model: str) -> None:
    layers = LAYERS if model == "lidar/physical" else {}
    for record in (ALL[model], ALL[model] | UNLIKE[model] | layers):
        spec = architecture({"front": record}).sensors["front"]
        for every, latency, jitter in ((2, 3, 0), (1, 0, 0), (1, 5, 0), (2, 3, 2), (1, 0, 3)):
            check_sensor(BUILT_IN[model], spec, every=every, latency=latency, jitter=jitter)


@pytest.mark.parametrize("model", ALL)
def test_each_run_of_a_batch_is_sensed_as_its_own_record_says(model: str) -> None:
    context = scene_context([CAR], runs=2)
    one, other = {"it": ALL[model]}, {"it": ALL[model] | UNLIKE[model]}

    def readings(*suites: Mapping[str, Any]) -> list[dict[str, list[Any]]]:
        rig = rig_of(context, *suites)
        last = [_copied(rig.sense(at(context, tick))) for tick in range(14)][-1]
        return [content(last["it"], run) for run in range(2)]

    mixed, first, second = readings(one, other), readings(one, one), readings(other, other)
    assert mixed == [first[0], second[1]]
    assert (first[0] == second[0]) == (model == "ground_truth")


def test_sample_comes_after_its_latency_as_it_was_taken() -> None:
    for model, record in ALL.items():
        prompt = sense({"it": {**record, "latency": "0 s"}})
        late = sense({"it": {**record, "latency": "0.15 s"}}, ticks=11)
        for before, after in zip(prompt, late[3:], strict=True):
            assert same(before["it"], after["it"]), model


def test_ended_run_is_sensed_no_more() -> None:
    context = scene_context([CAR], runs=2)
    for model in ALL.keys() - {"localisation", "ground_truth"}:
        record = {**ALL[model], "latency": "0 s", "rate": "20 Hz"}
        rig = rig_of(context, {"it": record}, {"it": record})
        for tick in range(4):
            shown = at(context, tick)
            shown.running[1] = tick < 2
            found = rig.sense(shown)["it"]
            is_sensed: Any = found.mask.any(axis=1)
            if found.points is not None:
                is_sensed = found.points.any(axis=(1, 2))
            if found.values is not None:
                is_sensed = np.asarray(np.isfinite(found.values).all(axis=1))
            assert is_sensed.tolist() == [True, tick < 2], (model, tick)
            assert is_sensed[1] or not found.detections[1].any(), (model, tick)


def test_object_at_no_place_is_sensed_by_nobody() -> None:
    context = scene_context([CAR])
    for model in ALL.keys() - {"ground_truth", "gnss", "imu", "localisation"}:
        for place in ((math.nan, 0.0), (20.0, 0.0, math.nan)):
            rig = rig_of(context, {"it": ALL[model]})
            found = [rig.sense(scene(context, [place], tick=tick))["it"] for tick in range(3)][-1]
            hits = found.source if found.hits is None else found.hits
            assert not (hits == 0).any(), model


def test_object_far_away_leaves_what_is_sensed_of_others_bit_identical() -> None:
    one, two = scene_context([CAR], runs=2), scene_context([CAR, CAR], runs=2)
    for model in ALL.keys() - {"ground_truth"}:
        suite = {"it": ALL[model]}
        alone, more = rig_of(one, suite, suite), rig_of(two, suite, suite)
        for tick in range(6):
            expected = alone.sense(scene(one, [(40.0, 0.0)], tick=tick))["it"]
            found = more.sense(scene(two, [(40.0, 0.0), (-400.0, 0.0)], tick=tick))["it"]
            for run in range(2):
                assert content(found, run) == content(expected, run), model


@pytest.mark.parametrize("jitter", ["0 s", "0.15 s"])
def test_another_sensor_leaves_every_other_measurement_bit_identical(jitter: str) -> None:
    base = {f"s{number}": record for number, record in enumerate(ALL.values())}
    alone = [sense({name: record}) for name, record in base.items()]
    # Neither what else is there, nor a further one, nor its place in the file matters.
    suites = [base]
    for record in ALL.values():
        more = {"more": {**record, "jitter": jitter}}
        suites += [base | more, more | base]
    for suite in suites:
        together = sense(suite)
        for name, expected in zip(base, alone, strict=True):
            for before, after in zip(expected, together, strict=True):
                assert same(before[name], after[name]), (name, list(suite))


def test_one_sensor_is_no_other_one() -> None:
    # What the law above compares does tell sensors apart: two of one kind differ by their names.
    for model, record in ALL.items():
        readings = sense({"one": record, "other": record}, ticks=12)
        differs = not all(same(item["one"], item["other"]) for item in readings)
        assert differs == (model != "ground_truth"), model


def test_halving_the_step_leaves_every_sample_bit_identical() -> None:
    # In an exactly known scene; the noise counts the sensor's own samples, not ticks.
    def samples(model: str, step: float, stride: int) -> list[dict[str, list[Any]]]:
        context = scene_context([CAR], step=step)
        rig = rig_of(context, {"front": ALL[model]})
        shown = (scene(context, [(40.0, 0.0)], tick=tick) for tick in range(6 * stride))
        delivered = [rig.sense(item)["front"].copy() for item in shown]
        return [content(item) for item in delivered if item.fresh[0]]

    for model in ALL:
        fine = samples(model, 0.025, 2)
        assert samples(model, 0.05, 1) == fine != [], model


def test_rates_latencies_and_jitter_are_in_ticks_of_the_master_clock() -> None:
    on_time = sense({"front": CAMERA}, ticks=40)
    fresh = [readings["front"].fresh[0] for readings in on_time[:8]]
    assert fresh == [False, False, True, False, True, False, True, False]
    late = sense({"front": {**CAMERA, "jitter": "0.1 s"}}, ticks=40)
    behind = [
        float(one["front"].stamp[0] - other["front"].stamp[0])
        for one, other in zip(on_time[4:], late[4:], strict=True)
    ]
    # A sample each 0.1 s, at most as much late.
    assert [min(behind), max(behind)] == pytest.approx([0.0, 0.1])
    for field, value in (("rate", "7 Hz"), ("jitter", "0.07 s")):
        with pytest.raises(SpecError, match=rf"sensors\.front\.{field}"):
            sense({"front": {**CAMERA, field: value}})


BLIND = {"kind": "./blind.py:Blind", "rate": "20 Hz"}


def test_plugin_sensor_comes_from_the_folder_of_its_file(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"no file .*blind\.py"):
        sense({"front": BLIND}, ticks=1, folder=tmp_path)
    (tmp_path / "blind.py").write_text(PLUGIN, "utf-8")
    last = sense({"front": BLIND, "back": RADAR}, ticks=2, folder=tmp_path)[-1]
    assert not last["front"].mask.any()
    assert last["back"].mask.any()


def test_answer_below_a_mask_is_refused(tmp_path: Path) -> None:
    answer = "no_measurement(runs, count, with_estimate=False)"
    hidden = f"{answer}.map(lambda values: np.ma.masked_array(values, mask=True))"
    (tmp_path / "blind.py").write_text(f"import numpy as np\n{PLUGIN.replace(answer, hidden)}")
    with pytest.raises(PluginError, match=r"blind\.py.*masked samples, not numbers"):
        sense({"front": BLIND}, ticks=1, folder=tmp_path)


def test_answer_out_of_its_form_is_refused(tmp_path: Path) -> None:
    answer = "no_measurement(runs, count, with_estimate=False)"
    for change, said in (
        ("source=np.full((runs, count), 10**9)", "names object 1000000000"),
        ("source=np.full((runs, count), 2**64 - 3, dtype=np.uint64)", "names object -3"),
        ("detections=np.zeros((runs, count, 2))", "detections has shape"),
        ("mask=np.ones((runs, count + 1), dtype=bool)", "source has shape"),
        ("mask=np.ones((runs, count))", "Cannot cast"),
        ("alive=np.full(runs, np.nan)", "Cannot cast"),
        ("stamp=np.full(runs, 5.0)", "is after 0 s"),
        ("stamp=np.full(runs, np.nan)", "not finite"),
        ("mask=np.ones((runs, count), dtype=bool), detections=np.full((runs, count, 7), np.nan)",
         "not finite"),
    ):  # fmt: skip
        wrong = PLUGIN.replace(answer, f"replace({answer}, {change})")
        text = f"import numpy as np\nfrom dataclasses import replace\n{wrong}"
        (tmp_path / "blind.py").write_text(text)
        with pytest.raises(PluginError, match=rf"blind\.py.*{said}.*\.py:\d+\)"):
            sense({"front": BLIND}, ticks=1, folder=tmp_path)


def test_mounts_are_poses_of_the_sensors_that_have_one() -> None:
    found = mounts(cases(*[{"front": CAMERA, "pose": POSE}] * 2))
    assert list(found) == ["front"]
    assert found["front"] == pytest.approx(np.array([[1.5, 0.0, 0.0, np.radians(5.0)]] * 2))


def test_ultrasonic_sensors_of_a_rig_hear_each_other_only_if_they_are_told_to() -> None:
    parking = {"kind": "ultrasonic", "field_of_view": "60 deg", "range": "5 m", "rate": "20 Hz"}
    context = scene_context([CAR])
    for cross_talk, distance in ((False, 4.0), (True, 3.0)):
        sensors = {
            "front": {**parking, "mount": {"x": "0 m"}, "cross_talk": cross_talk},
            "further": {**parking, "mount": {"x": "2 m"}},
        }
        found = rig_of(context, sensors).sense(scene(context, [(4.0 + 0.5 * CAR[0], 0.0)]))["front"]
        assert float(found.detections[0, 0, 0]) == pytest.approx(distance)


def test_receiver_and_unit_know_where_the_rear_axle_is() -> None:
    # The vehicle of the architecture has a wheelbase of 2.7 m.
    context = scene_context([])
    shown = scene(context, [], ego=(0.0, 0.0, 0.0, 20.0, 0.0, 0.0, 0.1))
    readings = rig_of(context, {"gnss": GNSS, "imu": IMU}).sense(shown)
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
    camera = {**PIXELS, "kind": "camera", "mount": {"z": "1.3 m"}, "columns": 300}
    sheet = data_sheets(cases({"front": camera}))["front"]
    told = {field: column.tolist() for field, column in sheet.items()}
    view = [pytest.approx(np.pi / 3.0)]
    assert told == {"field_of_view": view, "columns": [300.0], "mount.z": [1.3]}
