"""Objects in the returns of a lidar: hand-made rings of returns, hand-made scenes, closed loops."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.delivery import sample_at
from adeye.signals import Bools, Floats, Measurement
from adeye.simulate import engine
from adeye.simulate.channels.perception.clustering import SLOTS, Clustering, fit_box, insert_box
from adeye.simulate.sensors.lidar import LidarSensor
from adeye.simulate.world.weather import MM_PER_HOUR
from adeye.spec.architecture import Architecture
from adeye.spec.quantity import SI
from adeye.spec.sensors import PhysicalLidar
from adeye.sweep.case import TestCase
from adeye.testing.sensors import injector, moment
from adeye.trace import Trace
from tests.project import Executed
from tests.simulate.sensors import scenes

BEAMS = 900
STEP = 2.0 * math.pi / BEAMS


def spec(**changes: Any) -> PhysicalLidar:
    fields = {"mount": {"z": "0.6 m"}, "field_of_view": "360 deg", "rate": "10 Hz"}
    beams = {"beams": BEAMS, "range": "150 m"}
    made: PhysicalLidar = scenes.sensor_spec("lidar/physical", **(fields | beams | changes))
    return made


def reading(returns: Sequence[tuple[int, float]], *, things: Sequence[int] = ()) -> Measurement:
    """Return a sample of beams with ranges [m], and the object behind each."""
    made = sample_at(0.0, 1, 4)
    points, hits = np.zeros((1, BEAMS, 3)), np.full((1, BEAMS), -1)
    for place, (beam, way) in enumerate(returns):
        points[0, beam, :2] = way, ((beam + 0.5) / BEAMS - 0.5) * 2.0 * math.pi
        hits[0, beam] = things[place] if things else 0
    return replace(made, points=points, hits=hits)


def clusters(returns: Sequence[tuple[int, float]], **changes: Any) -> Floats:
    """Return the detections in some returns."""
    found = Clustering([spec(**changes)], 4).detect(reading(returns))
    rows: Floats = found.detections[0, found.mask[0]]
    return rows


def detect(
    objects: Sequence[Sequence[float]],
    sizes: Sequence[tuple[float, float, float]] = (scenes.CAR,),
    *,
    rain: float = 0.0,
    **changes: Any,
) -> Measurement:
    """Let a new lidar look at a scene, and find what is in its returns."""
    context = scenes.scene_context(sizes, rain=rain)
    lidar = LidarSensor(scenes.sensor_context(spec(**changes), context))
    found = lidar.sense(scenes.scene(context, objects))
    return Clustering([spec(**changes)], len(sizes)).detect(found)


def rows_of(found: Measurement, run: int = 0) -> Floats:
    rows: Floats = found.detections[run, found.mask[run]]
    return rows


# --- what belongs together ------------------------------------------------------------------------

AHEAD = BEAMS // 2


def test_returns_closer_than_the_cluster_distance_are_one_object() -> None:
    near, apart = [(AHEAD, 20.0), (AHEAD + 1, 20.9)], [(AHEAD, 20.0), (AHEAD + 1, 21.1)]
    alone: dict[str, Any] = {"min_points": 1}
    assert 2.0 * 140.0 * STEP > 1.9
    for returns, changes, count in (
        (near, {}, 1),
        (apart, alone, 2),
        (apart, {"cluster_distance": "1.5 m"}, 1),
        # A chain, and a late return that is near to two others, which are apart.
        ([(AHEAD + k, 20.0 + 0.8 * k) for k in range(10)], {}, 1),
        ([(AHEAD, 20.0), (AHEAD + 1, 21.8), (AHEAD + 2, 20.9)], {}, 1),
        # A lone return is no object, nor are few.
        ([(AHEAD, 20.0)], {}, 0),
        ([(AHEAD, 20.0)], alone, 1),
        ([(AHEAD + k, 20.0) for k in range(4)], {"min_points": 5}, 0),
        # At 140 m beams are 0.98 m apart, two of them further than the cluster distance.
        ([(AHEAD, 140.0), (AHEAD + 2, 140.0)], {}, 1),
        ([(AHEAD, 140.0), (AHEAD + 3, 140.0)], alone, 2),
        ([(AHEAD + k, way) for k, way in enumerate((np.nan, np.inf, -3.0, np.nan))], alone, 0),
    ):
        assert len(clusters(returns, **changes)) == count, (returns, changes)


def test_pole_in_front_of_a_car_does_not_part_it() -> None:
    car = [(AHEAD + k, 15.0) for k in (*range(8), *range(10, 18))]
    pole = [(AHEAD + k, 8.0) for k in (8, 9)]
    found = clusters(sorted(car + pole))
    assert found[:, signals.DETECTION_X] == pytest.approx([8.0, 15.0], abs=0.2)


def test_object_behind_the_seam_of_a_whole_turn_is_one() -> None:
    (found,) = clusters(sorted((beam % BEAMS, 12.0) for beam in range(-6, 6)))
    assert found[:2] == pytest.approx([-12.0, 0.0], abs=0.02)
    # A lidar that does not look behind has no seam to close.
    ends = [(0, 12.0), (1, 12.0), *[(AHEAD + k, 30.0) for k in range(20)], (898, 12.0), (899, 12.0)]
    assert len(clusters(ends)) == 2
    assert len(clusters(ends, field_of_view="350 deg")) == 3


def test_object_behind_the_seam_is_one_in_every_layer() -> None:
    # What stands ahead is more returns than are looked back over.
    behind, ahead = ([(place + k, 12.0) for k in range(-10, 10)] for place in (BEAMS, AHEAD))
    seam = reading(sorted((beam % BEAMS, way) for beam, way in behind + ahead))
    other = reading(ahead)
    for layers in ((seam, other), (other, seam)):
        points, hits = (
            np.concatenate([getattr(layer, name) for layer in layers], axis=1)
            for name in ("points", "hits")
        )
        found = Clustering([spec(layers=2, vertical_field_of_view="4 deg")], 4).detect(
            replace(seam, points=points, hits=hits)
        )
        assert sorted(rows_of(found)[:, 0]) == pytest.approx([-12.0, 12.0], abs=0.02)


def test_side_that_beams_meet_at_a_flat_angle_falls_into_pieces_inside_of_its_car() -> None:
    # In the next lane, 25 m ahead: beams meet the side 1.7 m apart, in every layer.
    layers: Any = {"layers": 8, "vertical_field_of_view": "3 deg", "mount": {"z": "1 m"}}
    found = detect([(27.25, 3.5)], **layers)
    rows = rows_of(found)
    assert len(rows) > 1
    assert rows[0, signals.DETECTION_X] == pytest.approx(25.0, abs=0.1)
    assert np.abs(rows[:, signals.DETECTION_X] - 27.25).max() < 2.4
    assert np.abs(rows[:, signals.DETECTION_Y] - 3.5).max() < 1.0
    assert (found.source[0, : len(rows)] == 0).all()
    # In one layer each is a lone return.
    assert len(rows_of(detect([(27.25, 3.5)]))) == 1


def test_pedestrian_who_steps_out_behind_a_parked_car_is_an_object_of_its_own() -> None:
    # Three metres behind its far end, half a metre out of its line.
    person = (0.5, 0.5, 1.75)
    found = detect([(20.0, -3.0), (25.5, -1.9)], [scenes.CAR, person], beams=1800)
    assert found.source[0, :2].tolist() == [0, 1]


def test_two_cars_that_follow_one_another_in_the_next_lane_are_two_objects() -> None:
    for gap in (3.0, 6.0, 10.0):
        found = detect([(15.0, 3.5), (19.5 + gap, 3.5)], [scenes.CAR, scenes.CAR])
        assert found.source[0, :2].tolist() == [0, 1], gap
        assert found.mask.sum() == 2, gap


def test_ground_is_no_object() -> None:
    down = {"z": "1.8 m", "pitch": "5 deg"}
    found = detect([(200.0, 50.0)], layers=8, vertical_field_of_view="20 deg", mount=down)
    assert found.points is not None
    assert np.count_nonzero(found.points[0, :, 0]) > 500
    assert not found.mask.any()


def test_object_seen_in_several_layers_is_one() -> None:
    layers: Any = {"layers": 8, "vertical_field_of_view": "10 deg", "mount": {"z": "1.8 m"}}
    found = detect([(20.0, 0.0), (45.0, 0.0)], [scenes.CAR, scenes.TRUCK], **layers)
    assert found.mask.sum() == 2
    assert found.source[0, :2].tolist() == [0, 1]
    assert rows_of(found)[:, signals.DETECTION_X] == pytest.approx([17.75, 40.0], abs=0.1)


def test_source_is_the_object_of_most_returns() -> None:
    returns = [(AHEAD + k, 20.0) for k in range(5)]
    found = Clustering([spec()], 4).detect(reading(returns, things=[2, 2, 3, 3, 3]))
    assert found.source[0, :2].tolist() == [3, -1]
    nobody = Clustering([spec()], 4).detect(reading(returns, things=[-1] * 5))
    assert nobody.source[0, 0] == -1
    assert nobody.mask[0, 0]


# --- what is measured -----------------------------------------------------------------------------


def test_lead_is_its_rear_face_of_a_cars_width() -> None:
    for distance in (10.0, 30.0, 60.0, 100.0):
        row = rows_of(detect([(distance + 2.25, 0.0)]))[0]
        assert row[signals.DETECTION_X] == pytest.approx(distance)
        assert row[signals.DETECTION_LENGTH] == 0.0
        assert row[signals.DETECTION_WIDTH] == pytest.approx(1.8, abs=distance * STEP)
        assert abs(row[signals.DETECTION_Y]) <= 0.5 * distance * STEP


def test_place_is_that_of_the_mount_and_the_returns() -> None:
    mount = {"x": "2 m", "y": "0.5 m", "z": "0.6 m", "yaw": "30 deg"}
    row = rows_of(detect([(32.25, 1.0)], mount=mount))[0]
    assert row[[signals.DETECTION_X, signals.DETECTION_Y]] == pytest.approx([30.0, 1.0], abs=0.15)


def test_heavy_rain_does_not_part_a_near_car_nor_bring_it_nearer() -> None:
    places = []
    for run in range(20):
        context = scenes.scene_context(runs=20, rain=7.5 * MM_PER_HOUR)
        found = LidarSensor(scenes.sensor_context(spec(), context)).sense(
            scenes.scene(context, [(22.25, 0.0)])
        )
        shown = Clustering([spec()] * 20, 1).detect(found)
        rows = rows_of(shown, run)
        assert len(rows) == 1, run
        places.append(rows[0, signals.DETECTION_X])
    # 0.4 m of noise on each of 13 returns.
    assert np.mean(places) == pytest.approx(20.0, abs=0.15)
    assert np.std(places) < 0.25


# --- when -----------------------------------------------------------------------------------------


def drive(ticks: int, out: Sequence[int] = ()) -> list[Measurement]:
    """Follow a car for some ticks at a lidar of every second one, which drops out at some."""
    context = scenes.scene_context(runs=2)
    lidar = LidarSensor(scenes.sensor_context(spec(), context, every=2, latency=1))
    clustering, fault = Clustering([spec()] * 2, 1), injector("drop_out", "sensors.lidar", runs=2)
    seen = []
    for tick in range(ticks):
        found = lidar.sense(scenes.scene(context, [(20.0 + tick, 0.0)], tick=tick))
        active = np.array([False, tick in out])
        shown = clustering.detect(fault.apply(found, moment(active)))
        seen.append(replace(shown, mask=shown.mask.copy(), detections=shown.detections.copy()))
    return seen


def test_detections_stay_until_the_next_sample() -> None:
    seen = drive(6)
    assert not seen[0].mask.any()
    faces = [float(item.detections[0, 0, signals.DETECTION_X]) for item in seen[1:]]
    assert faces == pytest.approx([17.75, 17.75, 19.75, 19.75, 21.75])


def test_lidar_that_has_dropped_out_detects_nothing_in_its_run_only() -> None:
    seen = drive(9, out=(3, 4))
    there = np.array([item.mask[:, 0] for item in seen])
    assert there[:, 0].tolist() == [False] + [True] * 8
    assert there[:, 1].tolist() == [False, True, True, False, False] + [True] * 4
    faces = [float(item.detections[1, 0, signals.DETECTION_X]) for item in seen[5:]]
    assert faces == pytest.approx([21.75, 21.75, 23.75, 23.75])


def test_drop_out_that_ends_between_two_samples_leaves_what_the_lidar_shows() -> None:
    seen = drive(8, out=(3,))
    assert seen[4].stamp[1] == seen[4].stamp[0]
    assert np.array_equal(seen[4].mask[1], seen[4].mask[0])
    assert np.array_equal(seen[4].detections[1], seen[4].detections[0])


def test_reading_is_not_altered_and_keeps_its_returns() -> None:
    given = reading([(AHEAD, 20.0), (AHEAD + 1, 20.0)])
    found = Clustering([spec()], 4).detect(given)
    assert found.points is given.points
    assert found.mask.shape == (1, SLOTS)
    assert not given.mask.any()


def test_measurement_without_returns_is_refused() -> None:
    with pytest.raises(TypeError, match="points"):
        Clustering([spec()], 4).detect(replace(reading([]), points=None))


def test_run_of_a_batch_is_as_it_is_alone() -> None:
    context = scenes.scene_context([scenes.CAR, scenes.TRUCK], runs=3)
    noise = {"range_noise": "0.1 m"}
    found = LidarSensor(scenes.sensor_context(spec(**noise), context)).sense(
        scenes.scene(context, [(20.0, 0.0), (30.0, 4.0)])
    )
    together = Clustering([spec(**noise)] * 3, 2).detect(found)
    for run in range(3):
        one = found.map(partial(np.take, indices=[run], axis=0))
        alone = Clustering([spec(**noise)], 2).detect(one)
        assert np.array_equal(alone.detections[0], together.detections[run])
        assert np.array_equal(alone.source[0], together.source[run])


# --- closed loop ----------------------------------------------------------------------------------


def with_lidar(case: TestCase, **changes: Any) -> TestCase:
    """Give a test case one physical lidar as the only sensor of its nominal channel."""
    content = case.architecture.model_dump(mode="json")
    lidar = spec(mount={"x": "2.3 m", "z": "0.6 m"}, range_noise="0.03 m", **changes)
    localisation = {**content["sensors"]["localisation"], "realises": None}
    nominal = {**content["channels"]["nominal"], "links": ["localisation", "lidar"]}
    content |= {
        "sensors": {"localisation": localisation, "lidar": lidar.model_dump(mode="json")},
        "channels": {"nominal": {**nominal, "realises": None}},
        "switch": {"policy": "fixed_priority", "priority": ["nominal"], "default": "nominal"},
    }
    return replace(case, architecture=Architecture.model_validate(content, context=SI), faults=())


def detected(trace: Trace) -> Bools:
    """Tell when (T,) the lidar of the first run detects the lead."""
    found: Any = trace["detected"]
    rows: Bools = found[0, :, trace.layout.sensors.index("lidar"), 0]
    return rows


@pytest.fixture(scope="module")
def braking(mini: Executed) -> Trace:
    """Drive behind a lead that brakes to standstill, on one physical lidar."""
    cases = [case for case in mini.plan.cases if case.scenario_id == "lead_braking"]
    return engine.run([with_lidar(case) for case in cases[:2]], drawn=True)


def test_ego_with_one_lidar_follows_a_lead_and_stops_behind_it(braking: Trace) -> None:
    assert braking.complete.all()
    for run in range(braking.runs):
        rows = braking.length[run] - 1
        ego, lead = braking["ego"][run, :rows], braking["objects"][run, :rows, 0]
        gap = lead[:, signals.OBJECT_X] - ego[:, signals.EGO_X]
        assert ego[-1, signals.EGO_SPEED] < 0.2
        assert 6.0 < gap[-1] < 14.0
        assert gap.min() > 6.0


def test_track_of_the_lead_is_true_in_place_and_speed(braking: Trace) -> None:
    rows = slice(20, int(braking.length[0]) - 1)
    shown: Any = braking["tracks"]
    tracks = shown[0, rows, 0]
    there = np.isfinite(tracks).all(axis=-1)
    assert there[:, 0].all()
    assert there.sum() == there[:, 0].sum(), "one lead makes one track"
    ego, lead = braking["ego"][0, rows], braking["objects"][0, rows, 0]
    off = tracks[:, 0, 0] - (lead[:, signals.OBJECT_X] - ego[:, signals.EGO_X])
    # A lead that brakes hard is seen late, and the depth of a car is assumed.
    assert np.abs(off).max() < 1.2
    assert np.abs(off[-100:]).max() < 0.3


def test_recorder_knows_whom_the_lidar_detects(braking: Trace) -> None:
    assert detected(braking)[: int(braking.length[0]) - 1].all()


def test_case_has_the_same_bits_alone_and_in_a_batch(mini: Executed, braking: Trace) -> None:
    cases = [case for case in mini.plan.cases if case.scenario_id == "lead_braking"]
    assert engine.run([with_lidar(cases[1])]).digests() == [braking.digests()[1]]


def test_rain_takes_the_lead_from_the_lidar_and_the_ego_brakes_later(mini: Executed) -> None:
    case = next(case for case in mini.plan.cases if case.scenario_id == "lead_braking")
    wet = replace(case, parameters={**case.parameters, "rain": 40.0 * MM_PER_HOUR})
    first = []
    for one in (case, wet):
        trace = engine.run([with_lidar(one)])
        first.append(int(np.argmax(detected(trace))))
    assert 0 == first[0] < first[1]


# Boxes of hand-made clusters: the nearest face, and the depth where a side shows it.

SPACING = math.radians(0.4)
CENTRE, GRILLE = (0.0, 0.0), (2.3, 0.0)
Points = list[tuple[float, float]]


def fit(
    points: Points, mount: tuple[float, float] = (0.0, 0.0), cut: float = 0.0
) -> tuple[float, ...]:
    xs, ys = np.array(points).T
    following = np.arange(1, len(points) + 1)
    following[-1] = -1
    return fit_box(*mount, SPACING, 0, following, np.array(xs), np.array(ys), cut)


def face(x: float, low: float, high: float, count: int = 10) -> Points:
    return [(x, float(y)) for y in np.linspace(low, high, count)]


def flank(y: float, low: float, high: float, count: int = 10) -> Points:
    return [(float(x), y) for x in np.linspace(low, high, count)]


NOISE = (0.5, -0.5, 0.3, -0.3, 0.4, -0.4)
FITS: dict[str, tuple[Points, tuple[float, float], tuple[float | None, ...]]] = {
    # On average a beam's spacing wider than from the first return to the last.
    "rear of a lead": (face(30.0, -0.9, 0.9), CENTRE, (30.0, 0.0, 0.0, 1.8 + 30.0 * SPACING)),
    "front of a follower": (face(-12.0, -0.9, 0.9), CENTRE, (-12.0, 0.0, 0.0, None)),
    "noise": (
        [(30.0 + n, -0.9 + 0.36 * k) for k, n in enumerate(NOISE)],
        CENTRE,
        (30.0, None, None, None),
    ),
    "neighbour behind": (
        face(-5.0, 2.6, 4.4) + flank(2.6, -9.5, -5.0, 20),
        CENTRE,
        (-7.25, None, 4.5, None),
    ),
    # At 45 m a beam meets a side that is 2.6 m off every 5 m.
    "side whose end no beam shows": (
        [*face(40.0, 2.6, 4.4), (42.0, 2.6), (44.4, 2.6)],
        CENTRE,
        (40.0, 3.5, 0.0, None),
    ),
    "rear that stands aslant": (
        face(6.0, 2.6, 4.4) + flank(2.6, 6.0, 6.8, 4),
        CENTRE,
        (None, None, 0.0, None),
    ),
    # Half an assumed width beyond the side.
    "side alone": (flank(2.6, 8.0, 12.0, 20), CENTRE, (10.0, 2.6 + 0.9, 4.0, 0.0)),
    "vehicle alongside": (flank(-2.6, -2.0, 2.5, 30), CENTRE, (0.25, -3.5, 4.5, 0.0)),
    # Ahead of the centre of the body, behind a lidar in its grille.
    "face ahead of the mount": (face(1.5, 2.6, 4.4), CENTRE, (None, None, 0.0, None)),
    "face behind the mount": (face(1.5, 2.6, 4.4), GRILLE, (1.5, None, None, None)),
    "side beside the mount": (flank(2.6, 2.0, 5.0, 20), GRILLE, (None, None, 3.0, None)),
}
"""Returns, the place of the lidar, and what is known of x, y, length and width of the box."""


def test_box_has_its_nearest_face_and_the_depth_that_a_side_shows() -> None:
    for name, (points, mount, wanted) in FITS.items():
        for value, expected in zip(fit(points, mount), wanted, strict=True):
            assert expected is None or value == pytest.approx(expected, abs=1e-6), name


def test_two_faces_of_a_near_neighbour_show_its_box() -> None:
    for side in (1.0, -1.0):
        rear = [(x, side * y) for x, y in face(6.0, 2.6, 4.4)]
        along = [(x, side * y) for x, y in flank(2.6, 6.0, 10.5, 20)]
        x, y, length, width = fit(rear + along)
        assert [x, y, length] == pytest.approx([8.25, side * 3.5, 4.5])
        assert width == pytest.approx(1.8, abs=0.1)


def listed(rows: list[tuple[float, float]]) -> tuple[int, np.ndarray, np.ndarray]:
    detections, source = np.zeros((SLOTS, 7)), np.full(SLOTS, -1)
    count = 0
    for thing, (x, y) in enumerate(rows):
        count = insert_box(count, (x, y, 0.0, 1.5), thing, detections, source)
    return count, detections, source


def test_boxes_stand_in_order_of_distance_with_what_is_behind_them() -> None:
    count, detections, source = listed([(30.0, 0.0), (-10.0, 2.0), (0.0, 20.0)])
    assert count == 3
    assert source[:4].tolist() == [1, 2, 0, -1]
    assert detections[:3, signals.DETECTION_X].tolist() == [-10.0, 0.0, 30.0]
    assert detections[:3, signals.DETECTION_Y].tolist() == [2.0, 20.0, 0.0]
    assert (detections[:3, signals.DETECTION_CLASS] == -1.0).all()
    assert (detections[:3, signals.DETECTION_WIDTH] == 1.5).all()
    assert not detections[:3, [signals.DETECTION_LENGTH, signals.DETECTION_HAS_RANGE_RATE]].any()


@pytest.mark.slow
def test_full_list_keeps_the_nearest() -> None:
    ways = [float(way) for way in range(1, SLOTS + 6)]
    for order in (ways, ways[::-1]):
        count, detections, _ = listed([(way, 0.0) for way in order])
        assert count == SLOTS
        assert detections[:, signals.DETECTION_X].tolist() == ways[:SLOTS]


def test_part_of_a_car_in_view_is_placed_from_the_edge_that_is_seen() -> None:
    # A car from -2.5 to -0.7 m, of which a sensor that looks aside sees the outer 0.2 m.
    for side in (1.0, -1.0):
        points = [(7.0, side * y) for y in (-2.5, -2.4, -2.3)]
        found = fit(points, (1.4, side * -0.9), cut=side)
        assert found == pytest.approx((7.0, side * -1.6, 0.0, 0.0))
    # A part that is as wide as a car is placed as it is seen.
    assert fit(face(7.0, -1.2, 1.2), cut=1.0) == fit(face(7.0, -1.2, 1.2))
