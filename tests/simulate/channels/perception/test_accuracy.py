"""What channels assume of their sensors: closed forms, laws, and whether the tracks bear it out."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.signals import Bools, Floats
from adeye.simulate.channels.perception import tracking
from adeye.simulate.channels.perception import tracks as kept
from adeye.simulate.channels.perception.pose import POSE_WIDTH
from adeye.simulate.sensors.ranging import RangingSensor
from adeye.simulate.sensors.rig import BUILT_IN, DATA_SHEETS, data_sheet
from adeye.spec.sensors import Sensor, model_name
from adeye.testing.scenes import channel_context
from tests.simulate.channels.perceived import sample_of
from tests.simulate.sensors.scenes import architecture, scene, scene_context, sensor_context

DEGREE = math.pi / 180.0
SEEN = {"mount": {"x": "0 m", "z": "1.2 m"}, "field_of_view": "60 deg", "rate": "20 Hz"}
CAMERA = {**SEEN, "kind": "camera", "range": "100 m", "distance_noise": 0.05}
RADAR = {**SEEN, "kind": "radar", "range": "150 m", "range_noise": "0.3 m"}
LIDAR = {**SEEN, "kind": "lidar", "range": "150 m", "range_noise": "0.1 m"}
PIXELS = {**SEEN, "kind": "camera", "fidelity": "physical", "columns": 400, "rows": 200}
CELLS = {**SEEN, "kind": "radar", "fidelity": "physical", "range": "150 m"}
BEAMS = {**SEEN, "kind": "lidar", "fidelity": "physical", "range": "150 m", "beams": 600}
ULTRASONIC = {**SEEN, "kind": "ultrasonic", "range": "5 m", "range_noise": "0.02 m"}
TRUTH = {"kind": "ground_truth", "rate": "20 Hz"}


def record(sensor: Mapping[str, Any]) -> Sensor:
    return architecture({"one": sensor}).sensors["one"]


def assumed(*runs: Mapping[str, Any]) -> Floats:
    """Return what is assumed of one sensor with a record in every run (B, ACCURACY_WIDTH)."""
    specs = [record(sensor) for sensor in runs]
    sheets = {}
    if model_name(specs[0]) in DATA_SHEETS:
        rows = [data_sheet(spec) for spec in specs]
        sheets["one"] = {field: np.array([row[field] for row in rows]) for field in rows[0]}
    context = channel_context(None, links=["one"], sensors={"one": specs[0].kind}, runs=len(specs))
    context = replace(context, data_sheets=sheets, models={"one": model_name(specs[0])})
    return tracking.assumed_accuracy(context, ["one"])[:, 0]


def deviations(sensor: Mapping[str, Any], distance: float) -> tuple[float, float, float]:
    """Return what is assumed along, across and of the range rate [m], [m], [m/s]."""
    row = assumed(sensor)[0]
    along, across = tracking.assumed_noise(row, distance)
    return math.sqrt(along), math.sqrt(across), math.sqrt(row[tracking.RATE])


FOCAL = 200.0 / math.tan(30.0 * DEGREE)
SHARE = 1.0 / math.sqrt(2.0 * math.log(1e4))
"""Of a cell, which the weakest echo leaves."""
RATE = {"range_rate_resolution": "2 m/s", "false_alarm_rate": 1e-4}
ERRORS: list[tuple[dict[str, Any], float, list[tuple[float, float] | None]]] = [
    # 5 % of 100 m at 100 m, so a quarter of that at 50 m.
    (
        {**CAMERA, "bearing_noise": "0.5 deg"},
        50.0,
        [(1.25, 0.02), (0.5 * DEGREE * 50.0, 0.02), None],
    ),
    (
        {**RADAR, "bearing_noise": "1 deg", "range_rate_noise": "0.1 m/s"},
        40.0,
        [(0.3, 0.02), (DEGREE * 40.0, 0.02), (0.1, 0.05)],
    ),
    ({**LIDAR, "bearing_noise": "0.1 deg"}, 80.0, [(0.1, 0.02), (DEGREE * 8.0, 0.02), None]),
    # Half a pixel on the ground and one in bearing.
    (PIXELS, 40.0, [(0.5 * 40.0**2 / (FOCAL * 1.2), 0.3), (40.0 / FOCAL, 0.1), None]),
    # Beams are 0.1 degrees apart.
    (
        {**BEAMS, "range_noise": "0.05 m", "bearing_noise": "0.02 deg"},
        60.0,
        [(0.05, 0.15), (DEGREE * math.sqrt(0.1**2 / 12.0 + 0.02**2) * 60.0, 0.1), None],
    ),
    (
        {**CELLS, "range_resolution": "4 m", "bearing_resolution": "5 deg", **RATE},
        50.0,
        [(4.0 * SHARE, 0.5), (5.0 * DEGREE * SHARE * 50.0, 0.2), (2.0 * SHARE, 0.25)],
    ),
    # An echo comes from anywhere in the cone.
    (ULTRASONIC, 3.0, [(0.02, 0.1), (60.0 * DEGREE / math.sqrt(12.0) * 3.0, 0.5), None]),
    # As good as the ego knows itself.
    (TRUTH, 100.0, [(0.02, 0.0), (0.02, 0.0), (0.05, 0.0)]),
]
"""Sensors, a distance, and the parts of the error along, across and of the range rate there."""


def test_sensor_errs_as_its_data_sheet_says() -> None:
    for sensor, distance, errors in ERRORS:
        for found, parts in zip(deviations(sensor, distance), errors, strict=True):
            assert parts is None or found == pytest.approx(math.hypot(*parts), rel=1e-6), sensor


def test_every_sensor_that_detects_has_a_row_of_its_own() -> None:
    every = (CAMERA, RADAR, LIDAR, PIXELS, CELLS, BEAMS, ULTRASONIC, TRUTH)
    unknown = tracking.assumed_accuracy(
        channel_context(None, links=["one"], sensors={"one": "./mine.py:Mine"}), ["one"]
    )
    models = {model_name(record(sensor)): assumed(sensor) for sensor in every}
    assert models.keys() == set(BUILT_IN) - {"gnss", "imu", "localisation"}
    assert not any(np.array_equal(rows, unknown[0]) for rows in models.values())


def test_sensor_without_a_data_sheet_is_taken_for_a_middling_camera() -> None:
    context = channel_context(None, links=["a", "b"], sensors={"a": "./my.py:My", "b": "radar"})
    rows = tracking.assumed_accuracy(context, ["a", "b"])[0]
    assert np.array_equal(rows[0], rows[1])
    assert np.sqrt(rows[0]) == pytest.approx([0.3, 3e-4, 0.1, 0.003, 0.05])


def test_each_run_has_the_data_sheet_of_its_own_sweep() -> None:
    rows = assumed(*({**RADAR, "bearing_noise": f"{noise} deg"} for noise in (0, 1, 2)))
    assert rows.shape == (3, tracking.ACCURACY_WIDTH)
    assert np.sqrt(rows[:, tracking.BEARING]) == pytest.approx([0.0, DEGREE, 2.0 * DEGREE])
    assert (rows[:, tracking.ALONG] == rows[0, tracking.ALONG]).all()


# How far samples are from what tracks expect, against how far that is expected to be.

STEP = 0.05
SETTLED = 20
SUITE: dict[str, dict[str, Any]] = {
    "camera": {**CAMERA, "bearing_noise": "0.3 deg"},
    "radar": {**RADAR, "bearing_noise": "0.2 deg", "range_rate_noise": "0.2 m/s"},
    "corner radar": {**RADAR, "bearing_noise": "1 deg", "range_rate_noise": "0.2 m/s"},
    "coarse radar": {**RADAR, "bearing_noise": "3 deg", "range_rate_noise": "0.2 m/s"},
    "lidar": {**LIDAR, "bearing_noise": "0.1 deg"},
}


def drive(runs: int, ticks: int) -> Floats:
    """Let objects drive as tracks are thought to (ticks, B, 4): x, y, heading, speed."""
    noise = np.random.Generator(np.random.Philox(5)).standard_normal((ticks, runs, 2))
    noise *= np.sqrt(np.array([kept.FREEDOM_X, kept.FREEDOM_Y]) * STEP)
    velocity = np.cumsum(noise, axis=0)
    place = np.array([40.0, 6.0]) + STEP * np.cumsum(velocity, axis=0)
    heading = np.arctan2(velocity[..., 1], velocity[..., 0])
    return np.dstack([place, heading, np.hypot(velocity[..., 0], velocity[..., 1])])


def normalised_innovation(sensor: Mapping[str, Any], accuracy: Floats, ticks: int = 60) -> float:
    """Return the mean of innovation squared over its assumed variance, of every number measured."""
    runs = 60
    context = scene_context(runs=runs)
    device = RangingSensor(sensor_context(record({**sensor, "min_visible": 0.01}), context))
    shown = scene(context, [(0.0, 0.0)])
    tracks, pose = np.zeros((runs, kept.TRACKS, kept.TRACK_STATE)), np.zeros(POSE_WIDTH)
    squares: list[float] = []
    for tick, states in enumerate(drive(runs, ticks)):
        shown.tick, shown.time = tick, tick * STEP
        shown.objects[:, 0, :4] = states
        sample = device.sense(shown)
        for run in range(runs):
            row = sample.detections[run]
            tracking.predict_tracks(tracks[run], pose, (0.0, 0.0, 0.0, 1.0), tick * STEP, STEP, 0.5)
            if tick >= SETTLED:
                squares += innovations(tracks[run, 0], row[0], accuracy)
            _update(tracks[run], pose, accuracy, sample.mask[run], row, tick * STEP)
    return float(np.mean(squares))


def innovations(track: Floats, row: Floats, accuracy: Floats) -> list[float]:
    """Return the squared error of each number of a detection over its assumed variance."""
    belief = kept.read_belief(track)
    distance = math.hypot(row[0], row[1])
    ux, uy = row[0] / distance, row[1] / distance
    along, across = tracking.assumed_noise(accuracy, distance)
    numbers = [((ux, 0.0, uy, 0.0), distance, along), ((-uy, 0.0, ux, 0.0), 0.0, across)]
    if row[3] > 0.0:
        turning = (uy * belief[0][1] - ux * belief[0][3]) ** 2 * across / distance**2
        numbers.append(((0.0, ux, 0.0, uy), row[2], accuracy[tracking.RATE] + turning))
    found = []
    for weights, measured, noise in numbers:
        spread = np.array(weights) @ covariance(belief) @ np.array(weights) + noise
        found.append((measured - np.array(weights) @ np.array(belief[0])) ** 2 / spread)
        belief = kept.learn(belief, weights, measured, noise)
    return found


def covariance(belief: Any) -> Floats:
    """Return the covariance of a belief (4, 4)."""
    found = np.diag(belief[1])
    found[0, 1:], found[1, 2:], found[2, 3:] = belief[2], belief[3][:2], belief[3][2]
    return np.triu(found) + np.triu(found, 1).T


def _update(
    tracks: Floats, pose: Floats, accuracy: Floats, mask: Bools, rows: Floats, time: float
) -> None:
    tracking.update_tracks(
        tracks,
        1 if tracks[0, kept.TRACK_HITS] > 0.0 else 0,
        pose,
        (0.0, 0.0, 0.0, 1.0),
        sample_of(accuracy, rows, time, mask=mask),
        30.0,
        (3.0, 0.0, 0.0),
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(SUITE))
def test_samples_are_as_far_from_tracks_as_they_are_expected_to_be(name: str) -> None:
    assert 0.85 < normalised_innovation(SUITE[name], assumed(SUITE[name])[0]) < 1.15


def test_one_row_for_all_radars_would_trust_coarse_ones_too_much_and_fine_ones_too_little() -> None:
    row = np.square([0.5, 0.0, 0.2, 0.01, 0.25])
    assert normalised_innovation(SUITE["radar"], row) < 0.6
    assert normalised_innovation(SUITE["coarse radar"], row) > 1.5


def test_sensor_that_is_worse_than_its_data_sheet_shows_in_its_samples() -> None:
    promised = assumed(SUITE["lidar"])[0]
    assert normalised_innovation({**SUITE["lidar"], "range_noise": "0.5 m"}, promised) > 3.0
