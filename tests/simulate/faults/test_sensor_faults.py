"""Faults of sensors: closed forms of each, and the laws that all of them obey."""

import copy
import math
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye import signals as s
from adeye.kernel.relation import tick_time
from adeye.signals import IMU_YAW_RATE as YAW_RATE
from adeye.simulate.faults.sensor_faults import Pixels
from adeye.spec.fault import FAULT, MODELS, SensorFault, model_of
from adeye.spec.sensor_faults import SIGNALS, has_signal
from adeye.testing.sensors import moment
from adeye.units import Dimension
from tests.frozen import assert_frozen
from tests.motorway import ARCHITECTURE, fault
from tests.simulate.faults import streams as sensed
from tests.simulate.faults.streams import (
    CONTEXT,
    END,
    ONSET,
    STEP,
    TICKS,
    at_onset,
    made,
    make_rig,
    played,
    same,
    scenes,
    streams,
)

SEAT = np.array([2.0, 0.5])
ALL = np.ones(3, dtype=np.bool_)


def bearings(item: Any, run: int = 0) -> Any:
    away = item.detections[run, item.mask[run], :2] - SEAT
    return np.degrees(np.arctan2(away[:, 1], away[:, 0]))


def test_nothing_is_seen_in_a_blind_sector_and_all_is_beside_it() -> None:
    given, faulty = at_onset("blind_sector", "camera", {"right": "-90 deg", "left": "0 deg"})
    before = bearings(given)
    assert (before < 0.0).any()
    assert (before > 0.0).any()
    assert bearings(faulty).tolist() == before[before >= 0.0].tolist()


def test_sector_may_go_through_the_rear() -> None:
    given, faulty = at_onset("blind_sector", "truth", {"right": "1 deg", "left": "-90 deg"})
    away = given.detections[0, :, :2]
    angle = np.degrees(np.arctan2(away[:, 1], away[:, 0]))
    kept = (angle < 1.0) & (angle >= -90.0)
    assert faulty.source[0, faulty.mask[0]].tolist() == given.source[0, kept].tolist()


def test_beams_of_a_blind_sector_come_back_empty() -> None:
    sector = {"right": "-10 deg", "left": "3 deg"}
    given, faulty = at_onset("blind_sector", "beam_lidar", sector)
    angle = np.degrees(given.points[0, :, s.POINT_BEARING])
    blind = (angle >= -10.0) & (angle < 3.0)
    assert (given.points[0, blind, s.POINT_RANGE] > 0.0).any()
    assert not faulty.points[0, blind, s.POINT_RANGE].any()
    assert (faulty.hits[0, blind] == -1).all()
    assert np.array_equal(faulty.points[0, ~blind], given.points[0, ~blind])


def test_reach_is_the_share_of_the_range() -> None:
    for factor, reach in ((0.2, 30.0), (0.3, 45.0)):
        given, faulty = at_onset("range_loss", "lidar", {"factor": factor})
        away = np.linalg.norm(given.detections[0, given.mask[0], :2] - SEAT, axis=1)
        assert faulty.mask[0].sum() == (away <= reach).sum()
        given, faulty = at_onset("range_loss", "beam_lidar", {"factor": factor})
        near = given.points[0, :, s.POINT_RANGE] <= reach
        assert np.array_equal(faulty.points[0, near], given.points[0, near])
        assert not faulty.points[0, ~near, s.POINT_RANGE].any()


def test_what_a_turned_sensor_reports_is_turned_back_about_it() -> None:
    given, faulty = at_onset("miscalibration", "camera", {"yaw": "5 deg"})
    assert sorted(bearings(faulty)) == pytest.approx(sorted(bearings(given) - 5.0))
    assert bearings(faulty, 1).tolist() == bearings(given, 1).tolist()
    given, faulty = at_onset("miscalibration", "beam_lidar", {"yaw": "5 deg"})
    back = given.points[0, :, s.POINT_RANGE] > 0.0
    off = np.degrees(faulty.points - given.points)[0, back, s.POINT_BEARING]
    assert off == pytest.approx(-5.0)


def test_what_a_shifted_sensor_reports_is_shifted_back() -> None:
    shift = {"x": "0.4 m", "y": "-0.3 m"}
    given, faulty = at_onset("miscalibration", "camera", shift)
    assert given.mask[0].any()
    stood, moved = (item.detections[0, item.mask[0], :2].mean(axis=0) for item in (given, faulty))
    assert moved - stood == pytest.approx([-0.4, 0.3])
    given, faulty = at_onset("miscalibration", "beam_lidar", shift)
    back = given.points[0, :, s.POINT_RANGE] > 0.0
    one, other = given.points[0, back], faulty.points[0, back]
    x = one[:, 0] * np.cos(one[:, 1]) - other[:, 0] * np.cos(other[:, 1])
    y = one[:, 0] * np.sin(one[:, 1]) - other[:, 0] * np.sin(other[:, 1])
    assert x == pytest.approx(0.4)
    assert y == pytest.approx(-0.3)


def test_jump_moves_the_ego_in_the_map() -> None:
    size = {"x": "30 m", "y": "-2 m", "heading": "10 deg"}
    given, faulty = at_onset("jump", "localisation", size)
    off = (faulty.estimate - given.estimate)[0, [s.EGO_X, s.EGO_Y, s.EGO_HEADING]]
    assert off == pytest.approx([30.0, -2.0, math.radians(10.0)])
    given, faulty = at_onset("jump", "gnss", {"x": "30 m"})
    assert (faulty.values - given.values)[0].tolist() == pytest.approx([30.0, 0.0, 0.0, 0.0])


def pictures(model: str, parameters: dict[str, Any], active: Any = ALL) -> list[Any]:
    """What the physical camera delivers with a fault from a tick on."""
    injector = made(model, "pixel_camera", parameters)
    assert isinstance(injector, Pixels)
    rig, found = make_rig(), []
    for tick, scene in enumerate(scenes()):
        patches = injector.patches(moment(active & (tick >= ONSET)))
        rig.cover("pixel_camera", [] if patches is None else [patches])
        sensed = rig.sense(copy.deepcopy(scene))["pixel_camera"]
        found.append(copy.deepcopy(sensed))
    return found


def test_black_image_shows_nothing_from_the_frame_of_the_onset_in_its_runs_only() -> None:
    found = pictures("blackout", {}, np.array([True, False, True]))
    clear = streams()["pixel_camera"]
    for tick in range(TICKS):
        assert same(found[tick], clear[tick], 1)
        # A frame comes two ticks after it was taken.
        if tick < ONSET + 2:
            assert same(found[tick], clear[tick])
        else:
            assert not found[tick].mask[[0, 2]].any()
    assert clear[ONSET + 2].mask[0].any()


def test_pixel_fault_of_no_size_changes_no_bit() -> None:
    whole = {"columns": 320, "rows": 120}
    for model, parameters in (
        ("dead_pixels", {"columns": 0, "rows": 50}),
        ("dead_pixels", {**whole, "transmission": 1.0}),
        ("pixel_noise", {**whole, "noise": 0.0}),
        ("blackout", {"transmission": 1.0}),
    ):
        for one, other in zip(pictures(model, parameters), streams()["pixel_camera"], strict=True):
            assert same(one, other), (model, parameters)


def test_dead_half_of_the_image_hides_what_is_there_only() -> None:
    # The neighbour is left of column 156, the lead at the right of it.
    found = pictures("dead_pixels", {"columns": 156, "rows": 120})[ONSET + 2]
    clear = streams()["pixel_camera"][ONSET + 2]
    left = set(clear.source[0, clear.detections[0, :, 1] > 2.0].tolist())
    assert left
    assert not left & set(found.source[0].tolist())
    assert found.mask[0].any()


def test_noise_shows_what_is_not_there() -> None:
    noise = {"columns": 320, "rows": 120, "noise": 0.5}
    found = pictures("pixel_noise", noise)[ONSET + 2]
    clear = streams()["pixel_camera"][ONSET + 2]
    assert found.mask.sum() > clear.mask.sum()


# --- How far a number is off: closed forms, sample by sample --------------------------------------


def always(_tick: int) -> Any:
    return np.ones(3, dtype=np.bool_)


def estimates(parameters: dict[str, Any], model: str = "bias", **how: Any) -> list[Any]:
    pairs = played(made(model, "localisation", parameters), "localisation", **how)
    return [(given, faulty) for given, faulty in pairs if given.stamp[0] >= 0.0]


def test_bias_of_the_place_moves_its_place_on_the_road() -> None:
    for signal, x, y in (("ego_x", 3.0, 0.0), ("ego_y", 0.0, 3.0)):
        given, faulty = estimates({"signal": signal, "size": "3 m"})[END - 5]
        off = faulty.estimate - given.estimate
        # The road is straight, along x.
        for column, size in (
            (s.EGO_X, x),
            (s.EGO_Y, y),
            (s.ESTIMATE_PLACE + s.PLACE_S, x),
            (s.ESTIMATE_PLACE + s.PLACE_D, y),
        ):
            assert off[[0, 2], column] == pytest.approx([size, size])
            assert off[1, column] == 0.0


def test_speed_is_never_below_zero() -> None:
    _, faulty = estimates({"signal": "ego_speed", "size": "-100 m/s"})[END - 5]
    assert faulty.estimate[:, s.EGO_SPEED].tolist() == [0.0, pytest.approx(15.0, abs=1.0), 0.0]


def test_bias_varies_from_run_to_run() -> None:
    sizes = [{"signal": "yaw_rate", "size": f"{run} rad/s"} for run in range(3)]
    given, faulty = played(made("bias", "imu", sizes), "imu", always, onset=0)[20]
    assert faulty.values[:, YAW_RATE] - given.values[:, YAW_RATE] == pytest.approx([0.0, 1.0, 2.0])


def test_scale_multiplies() -> None:
    given, faulty = at_onset("scale", "radar", {"signal": "range", "factor": 0.5})
    x = given.detections[0, :, 0][given.mask[0]] - 2.0
    assert 2.0 + 0.5 * x == pytest.approx(faulty.detections[0, :, 0][faulty.mask[0]])


def test_drift_grows_with_the_age_of_the_sample() -> None:
    fault = made("drift", "localisation", {"signal": "ego_x", "size": "2 m", "over": "10 s"})
    pairs = played(fault, "localisation")
    for tick in range(ONSET, END):
        given, faulty = pairs[tick]
        age = max(0.0, given.stamp[0] - ONSET * STEP)
        off = faulty.estimate[0, s.EGO_X] - given.estimate[0, s.EGO_X]
        assert off == pytest.approx(0.2 * age, abs=1e-9)


def test_noise_has_its_deviation_and_stays_with_its_sample() -> None:
    fault = made("noise", "beam_lidar", {"signal": "range", "size": "0.2 m"})
    pairs = played(fault, "beam_lidar")
    given, faulty = pairs[ONSET]
    back = given.points[:, :, 0] > 5.0
    off = (faulty.points - given.points)[:, :, 0]
    count = int(back[[0, 2]].sum())
    assert np.std(off[[0, 2]][back[[0, 2]]]) == pytest.approx(0.2, abs=0.6 / math.sqrt(count))
    assert not off[1].any()
    # The lidar is sampled at every second tick.
    assert np.array_equal(pairs[ONSET + 1][1].points, faulty.points)
    assert not np.array_equal(pairs[ONSET + 2][1].points, faulty.points)


def test_steps_are_multiples() -> None:
    _, faulty = estimates({"signal": "ego_x", "size": "0.5 m"}, "quantise")[END - 5]
    multiple = faulty.estimate[[0, 2], s.EGO_X] / 0.5
    assert multiple == pytest.approx(np.round(multiple), abs=1e-12)


def test_stuck_value_is_that_value() -> None:
    _, faulty = estimates({"signal": "ego_speed", "value": "36 km/h"}, "stuck_at")[END - 5]
    assert faulty.estimate[[0, 2], s.EGO_SPEED] == pytest.approx([10.0, 10.0])


def test_stuck_bearing_leaves_the_range() -> None:
    given, faulty = at_onset("stuck_at", "camera", {"signal": "bearing", "value": "30 deg"})
    seat = np.array([2.0, 0.5])
    before = np.linalg.norm(given.detections[0, given.mask[0], :2] - seat, axis=1)
    after = faulty.detections[0, faulty.mask[0], :2] - seat
    assert np.linalg.norm(after, axis=1) == pytest.approx(sorted(before))
    assert np.arctan2(after[:, 1], after[:, 0]) == pytest.approx(math.radians(30.0))


def test_spikes_come_as_often_as_they_should() -> None:
    spike = {"signal": "range", "size": "1 m", "probability": 0.25}
    given, faulty = played(made("spike", "beam_lidar", spike), "beam_lidar")[ONSET]
    back = given.points[[0, 2], :, 0] > 0.0
    off = (faulty.points - given.points)[[0, 2], :, 0][back]
    hit = np.abs(off) > 0.5
    assert off[hit] == pytest.approx(1.0)
    assert not off[~hit].any()
    deviation = math.sqrt(0.25 * 0.75 / len(off))
    assert abs(float(np.mean(hit)) - 0.25) < 4.0 * deviation


def test_flipped_sign_is_the_opposite_and_flipped_twice_nothing() -> None:
    flip = {"signal": "yaw_rate", "bit": 63}
    given, faulty = at_onset("bit_flip", "imu", flip)
    assert faulty.values[0, YAW_RATE] == -given.values[0, YAW_RATE]
    again = made("bit_flip", "imu", flip)
    assert same(again.apply(faulty, moment(np.array([True, False, True]))), given)


def test_flip_of_the_exponent_may_make_no_number_and_the_place_is_nowhere() -> None:
    fault = made("bit_flip", "localisation", {"signal": "ego_x", "bit": 62})
    _, faulty = played(fault, "localisation")[ONSET]
    # An exponent of 1023 + n becomes one of 2047 + n - 1024: huge, infinite or tiny.
    row = faulty.estimate[2]
    assert abs(row[s.EGO_X]) > 1e7 or abs(row[s.EGO_X]) < 1e-7
    assert np.isnan(row[s.ESTIMATE_PLACE + s.PLACE_S]) == (abs(row[s.EGO_X]) > 1e7)


def test_half_the_step_leaves_what_a_sample_draws() -> None:
    """The same samples, looked at twice as often, have the same noise."""
    noise = {"signal": "ego_x", "size": "1 m"}
    once = made("noise", "localisation", noise)
    twice = made("noise", "localisation", noise, step=STEP / 2)
    active = np.ones(3, dtype=np.bool_)
    for item, scene in zip(streams()["localisation"], scenes(), strict=True):
        now = moment(active, time=scene.time, age=scene.time)
        one = once.apply(deepcopy(item), now)
        twice.apply(deepcopy(item), now)
        held = replace(item, fresh=np.zeros(3, dtype=np.bool_))
        assert same(replace(one, fresh=held.fresh), twice.apply(held, now))


# --- Which objects are missed, made up, split or taken for others ---------------------------------

LEAD, NEIGHBOUR, WALL = range(3)
REACH = float(ARCHITECTURE["vehicle"]["wheelbase"].removesuffix(" m"))


def sources(parameters: dict[str, Any]) -> list[list[int]]:
    """Return which objects are left of the truth where some are missed, by run."""
    _, faulty = at_onset("miss", "truth", parameters)
    return [sorted(row[row >= 0].tolist()) for row in faulty.source]


def test_only_the_classes_that_are_named_or_what_is_in_the_sector_is_missed() -> None:
    every = [LEAD, NEIGHBOUR, WALL]
    names = [s.OBJECT_CLASSES[number] for number in CONTEXT.object_classes]
    found = sources({"classes": [names[NEIGHBOUR], names[WALL]]})
    assert found == [[LEAD], every, [LEAD]]
    # The wall is at the right, the neighbour at the left.
    found = sources({"right": "-90 deg", "left": "-1 deg"})
    assert found == [[LEAD, NEIGHBOUR], every, [LEAD, NEIGHBOUR]]


def test_class_is_that_of_the_object_where_the_sensor_tells_none() -> None:
    given, faulty = at_onset("miss", "cell_radar", {"classes": ["truck"]})
    assert NEIGHBOUR in given.source[0]
    assert NEIGHBOUR not in faulty.source[0]
    assert (faulty.source[0] >= 0).sum() == (given.source[0] >= 0).sum() - 1


def test_what_is_beyond_is_missed() -> None:
    given, faulty = at_onset("miss", "truth", {"beyond": "45 m"})
    far = np.linalg.norm(given.detections[0, :, :2], axis=1) >= 45.0
    assert far.any()
    assert not far.all()
    assert faulty.source[0, faulty.mask[0]].tolist() == given.source[0, ~far].tolist()


def test_share_of_misses_is_the_probability() -> None:
    fault = made("miss", "truth", {"probability": 0.3})
    pairs = played(fault, "truth", lambda _: np.ones(3, dtype=np.bool_), onset=0)
    missed = [3 - int(item.mask[run].sum()) for _, item in pairs for run in range(3)]
    share = sum(missed) / (3 * len(missed))
    assert abs(share - 0.3) < 4.0 * math.sqrt(0.3 * 0.7 / (3 * len(missed)))


def test_taken_for_another_class() -> None:
    taken = {"classes": ["car"], "taken_for": "pedestrian"}
    _, faulty = at_onset("misclassify", "truth", taken)
    classes = [s.OBJECT_CLASSES[int(number)] for number in faulty.detections[0, :, 6]]
    assert sorted(classes) == sorted(["pedestrian", "truck", "barrier"])


def test_halves_lie_side_by_side_and_fill_the_whole() -> None:
    given, faulty = played(made("split", "truth", {"classes": ["truck"]}), "truth")[ONSET]
    whole = given.detections[0][given.source[0] == NEIGHBOUR][0]
    halves = faulty.detections[0][faulty.detections[0, :, 5] == whole[5] / 2]
    assert len(halves) == 2
    assert sorted(halves[:, 1]) == pytest.approx([whole[1] - whole[5] / 4, whole[1] + whole[5] / 4])
    assert faulty.mask.sum(axis=1).tolist() == [4, 3, 4]
    assert (faulty.source[0] == NEIGHBOUR).sum() == 1


GHOST = {"x": "30 m", "y": "2 m", "speed": "0 m/s"}


def test_standing_ghost_comes_nearer_as_the_ego_drives() -> None:
    pairs = played(made("ghost", "truth", GHOST), "truth")
    for tick in range(ONSET, END):
        _, faulty = pairs[tick]
        here, then = scenes()[tick].ego[0], scenes()[ONSET].ego[0]
        row = faulty.detections[0][faulty.mask[0] & (faulty.source[0] < 0)][0]
        sine, cosine = math.sin(then[2]), math.cos(then[2])
        x = then[0] + 30.0 * cosine - 2.0 * sine - here[0]
        y = then[1] + 30.0 * sine + 2.0 * cosine - here[1]
        assert math.hypot(row[0], row[1]) == pytest.approx(math.hypot(x, y))
        # The box centre swings around the rear axle, half a wheelbase behind it.
        aside = here[s.EGO_YAW_RATE] * 0.5 * REACH
        rate = -here[s.EGO_SPEED] * (math.cos(here[2]) * x + math.sin(here[2]) * y)
        rate -= aside * (math.cos(here[2]) * y - math.sin(here[2]) * x)
        assert row[2] == pytest.approx(rate / math.hypot(x, y))
        assert row[[3, 4, 5, 6]].tolist() == [1.0, 4.5, 1.8, 0.0]


def test_ghost_appears_where_it_is_written_and_moves_with_its_speed() -> None:
    pairs = played(made("ghost", "truth", {**GHOST, "speed": "10 m/s"}), "truth")
    first, later = (pairs[tick][1] for tick in (ONSET, END - 1))
    places = [item.detections[0][item.mask[0] & (item.source[0] < 0)][0] for item in (first, later)]
    assert places[0][:2] == pytest.approx([30.0, 2.0])
    # The ego of run 0 drives 10 m/s, so it stays where it is but for the ego's heading in the map.
    moved = (END - 1 - ONSET) * STEP * 10.0
    assert np.linalg.norm(places[1][:2] - places[0][:2]) < 0.02 * moved
    assert pairs[ONSET][1].mask.sum(axis=1).tolist() == [4, 3, 4]


def test_ghost_of_a_late_sample_is_where_it_was_when_that_was_made() -> None:
    pairs = played(made("ghost", "radar", GHOST), "radar")
    given, faulty = pairs[ONSET]
    row = faulty.detections[0][faulty.mask[0] & (faulty.source[0] < 0)][0]
    late = ONSET * STEP - given.stamp[0]
    assert late == pytest.approx(0.1)
    ahead = 30.0 + late * scenes()[ONSET].ego[0, s.EGO_SPEED]
    assert row[0] == pytest.approx(ahead, abs=0.05)
    assert pairs[ONSET + 1][1].detections.tobytes() == faulty.detections.tobytes()


# --- When samples come, and what they say about it ------------------------------------------------


def stamps(pairs: list[Any], run: int = 0) -> list[float]:
    return [float(faulty.stamp[run]) for _, faulty in pairs]


def test_frozen_sample_has_new_stamps_and_old_content() -> None:
    pairs = played(made("freeze", "truth"), "truth")
    before = pairs[ONSET - 1][0]
    for given, faulty in pairs[ONSET:END]:
        assert faulty.stamp.tolist() == given.stamp.tolist()
        assert faulty.fresh.all()
        assert faulty.detections[0].tobytes() == before.detections[0].tobytes()
        assert faulty.estimate is not None
        assert faulty.estimate[0].tobytes() == before.estimate[0].tobytes()


def test_nothing_is_frozen_before_the_first_sample() -> None:
    pairs = played(made("freeze", "camera"), "camera", lambda _: np.ones(3, dtype=np.bool_))
    first = next(given for given, _ in pairs if given.stamp[0] >= 0.0)
    assert pairs[-1][1].detections.tobytes() == first.detections.tobytes()
    assert pairs[-1][1].stamp[0] == pairs[-1][0].stamp[0] > first.stamp[0]


def test_stale_sample_keeps_its_stamp_and_is_alive() -> None:
    pairs = played(made("stale", "truth"), "truth")
    for _, faulty in pairs[ONSET:END]:
        assert faulty.stamp[0] == pairs[ONSET - 1][0].stamp[0]
        assert faulty.fresh.tolist() == [False, True, False]
        assert faulty.alive.all()


def test_stale_stamp_is_that_of_the_sample_before_the_onset() -> None:
    pairs = played(made("stale_stamp", "truth"), "truth")
    for given, faulty in pairs[ONSET:END]:
        assert faulty.stamp[0] == pairs[ONSET - 1][0].stamp[0]
        assert faulty.detections.tobytes() == given.detections.tobytes()


def test_clock_drifts_by_its_rate_and_never_below_zero() -> None:
    fault = made("clock_drift", "truth", {"offset": "-0.1 s", "rate": 0.1})
    for tick, (given, faulty) in enumerate(played(fault, "truth")):
        if ONSET <= tick < END:
            gone = -0.1 + 0.1 * (tick - ONSET) * STEP
            assert faulty.stamp[0] == pytest.approx(given.stamp[0] + gone)
    early = made("clock_drift", "truth", {"offset": "-1 s"})
    pairs = played(early, "truth", lambda _: np.ones(3, dtype=np.bool_), onset=0)
    assert stamps(pairs)[:3] == [0.0, 0.0, 0.0]


def test_delayed_samples_come_so_many_ticks_later() -> None:
    pairs = played(made("delay", "truth", {"by": "0.15 s"}), "truth")
    found = stamps(pairs)
    held = [(ONSET - 1) * STEP] * 3
    late = [(tick - 3) * STEP for tick in range(ONSET + 3, END)]
    assert found[ONSET:END] == pytest.approx([*held, *late])
    fresh = [bool(faulty.fresh[0]) for _, faulty in pairs]
    assert fresh[ONSET:END] == [False] * 3 + [True] * (END - ONSET - 3)
    assert found[END] == tick_time(END, STEP)


def test_jitter_never_lets_a_sample_overtake_and_stays_in_its_span() -> None:
    fault = made("delay", "truth", {"by": "0.1 s", "jitter": "0.2 s"})
    found = stamps(played(fault, "truth", lambda tick: np.full(3, tick >= 2), onset=2))
    assert (np.diff(found[2:]) >= 0.0).all()
    late = [tick * STEP - stamp for tick, stamp in enumerate(found) if tick >= 12]
    assert min(late) >= 0.1 - 1e-9
    # What is held up by the one before comes with it, one tick after another at the latest.
    assert max(late) <= 0.3 + STEP + 1e-9
    assert len({round(item / STEP) for item in late}) > 1


def test_lost_sample_leaves_the_one_before() -> None:
    pairs = played(made("sample_loss", "truth", {"probability": 0.5}), "truth")
    shown = stamps(pairs)
    lost = 0
    for tick in range(ONSET, END):
        given, faulty = pairs[tick]
        if faulty.stamp[0] != given.stamp[0]:
            lost += 1
            assert faulty.stamp[0] == shown[tick - 1]
            assert not faulty.fresh[0]
            assert faulty.alive[0]
    assert 0 < lost < END - ONSET


def long_play(parameters: dict[str, Any], samples: int) -> list[bool]:
    """Which of many samples are lost."""

    fault = made("sample_loss", "truth", parameters)
    item, active = streams()["truth"][0], np.ones(3, dtype=np.bool_)
    found = []
    for number in range(samples):
        now = item.copy()
        now.stamp[:] = number
        found.append(bool(fault.apply(now, moment(active, time=number)).stamp[0] != number))
    return found


@pytest.mark.slow
def test_bursts_have_their_mean_length_and_share() -> None:
    lost = np.array(long_play({"enter": 0.05, "leave": 0.25}, 8_000))
    # Stationary share of the bad state of a chain of two: enter / (enter + leave).
    assert np.mean(lost) == pytest.approx(0.05 / 0.30, abs=0.03)
    begins = np.count_nonzero(lost[1:] & ~lost[:-1])
    assert np.count_nonzero(lost) / begins == pytest.approx(4.0, rel=0.15)


def test_power_comes_back_after_the_restart() -> None:
    pairs = played(made("power_loss", "truth", {"restart": "0.2 s"}), "truth")
    alive = [bool(faulty.alive[0]) for _, faulty in pairs]
    down = [tick for tick, is_alive in enumerate(alive) if not is_alive]
    assert down == list(range(ONSET, END + 4))
    assert all(faulty.alive[1] for _, faulty in pairs)


# --- Laws that every fault of a sensor obeys, for every kind of sensor that can have it -----------

SIZES = {
    Dimension.LENGTH: "0.7 m",
    Dimension.ANGLE: "2 deg",
    Dimension.SPEED: "3 m/s",
    Dimension.ACCELERATION: "0.5 m/s^2",
    Dimension.ANGULAR_RATE: "2 deg/s",
}
NO_SIZES = {
    Dimension.LENGTH: "0 m",
    Dimension.ANGLE: "0 deg",
    Dimension.SPEED: "0 m/s",
    Dimension.ACCELERATION: "0 m/s^2",
    Dimension.ANGULAR_RATE: "0 deg/s",
}
OF_SIGNALS: dict[str, dict[str, Any]] = {
    "bias": {},
    "scale": {"factor": 1.5},
    "drift": {"over": "1 s"},
    "noise": {},
    "quantise": {},
    "stuck_at": {},
    "spike": {"probability": 1.0},
    "bit_flip": {"bit": 51},
}
PLAIN: dict[str, dict[str, Any]] = {
    "drop_out": {},
    "power_loss": {"restart": "0.2 s"},
    "freeze": {},
    "stale": {},
    "stale_stamp": {},
    "clock_drift": {"offset": "-0.1 s"},
    "delay": {"by": "0.15 s", "jitter": "0.1 s"},
    "sample_loss": {"probability": 1.0},
    "jump": {"x": "2 m", "y": "-1 m"},
    "miss": {},
    "ghost": {"x": "15 m", "y": "1 m", "speed": "5 m/s"},
    "misclassify": {"taken_for": "building"},
    "split": {},
    "blind_sector": {"right": "-60 deg", "left": "60 deg"},
    "range_loss": {"factor": 0.1},
    "miscalibration": {"yaw": "3 deg", "x": "0.1 m", "y": "-0.2 m"},
}
NULL: dict[str, dict[str, Any]] = {
    "bias": {"size": "0"},
    "scale": {"factor": 1.0},
    "drift": {"size": "0", "over": "1 s"},
    "noise": {"size": "0"},
    "quantise": {"size": "0"},
    "spike": {"size": "0", "probability": 1.0},
    "clock_drift": {},
    "delay": {"by": "0 s"},
    "sample_loss": {},
    "jump": {},
    "miss": {"probability": 0.0},
    "misclassify": {"probability": 0.0, "taken_for": "car"},
    "split": {"probability": 0.0},
    "blind_sector": {"right": "10 deg", "left": "10 deg"},
    "range_loss": {"factor": 1.0},
    "miscalibration": {},
}
"""Of each model whose effect has a size, what has none."""

MEMORY = {"power_loss"}
LATER = {"drift"}
"""Models that do nothing to a sample made at the onset or before."""


def full(model: str, signal: str = "") -> dict[str, Any]:
    if model not in OF_SIGNALS:
        return PLAIN[model]
    size = SIZES[SIGNALS[signal].dimension]
    parameters = {"signal": signal, **OF_SIGNALS[model]}
    if model == "stuck_at":
        return {**parameters, "value": size}
    return parameters if model in ("scale", "bit_flip") else {**parameters, "size": size}


def null(model: str, signal: str = "") -> dict[str, Any]:
    parameters = dict(NULL[model])
    if signal:
        parameters["signal"] = signal
        if "size" in parameters:
            parameters["size"] = NO_SIZES[SIGNALS[signal].dimension]
    return parameters


def combinations() -> list[tuple[str, str, str]]:
    found = [
        (model, sensor, signal)
        for model in OF_SIGNALS
        for sensor in sensed.SENSORS
        for signal in SIGNALS
        if has_signal(signal, sensed.SUITE.sensors[sensor])
    ]
    for model, parameters in PLAIN.items():
        built: Any = FAULT.validate_python(fault("a", "sensors.a", model, **parameters))
        found += [
            (model, name, "")
            for name, spec in sensed.SUITE.sensors.items()
            if not built.misfits(spec)
        ]
    return found


EVERY = combinations()
FIRST = list(
    {(model, signal): item for item in reversed(EVERY) for model, _, signal in [item]}.values()
)
"""Of each model and signal one sensor, which is tried at every change."""


def by_model(items: list[tuple[str, str, str]]) -> pytest.MarkDecorator:
    """Try all of a model, those of ``FIRST`` always."""
    trials = []
    for model in dict.fromkeys(model for model, _, _ in items):
        own = [item for item in items if item[0] == model]
        trials.append(pytest.param([item for item in own if item in FIRST], id=model))
        rest = [item for item in own if item not in FIRST]
        trials.append(pytest.param(rest, id=f"{model} elsewhere", marks=pytest.mark.slow))
    return pytest.mark.parametrize("combinations", trials)


Combinations = list[tuple[str, str, str]]
every = by_model(EVERY)


def test_every_model_of_sensors_is_among_those_tested() -> None:
    models = {model_of(item) for item in MODELS if issubclass(item, SensorFault)}
    pixels = {"dead_pixels", "pixel_noise", "blackout"}
    assert models - pixels == {model for model, _, _ in EVERY}
    assert set(OF_SIGNALS) | set(PLAIN) == models - pixels


@every
def test_fault_acts_from_onset_to_end_and_in_its_runs_only(combinations: Combinations) -> None:
    for model, sensor, signal in combinations:
        pairs = sensed.played(sensed.made(model, sensor, full(model, signal)), sensor)
        for tick, (given, faulty) in enumerate(pairs):
            assert sensed.same(given, sensed.streams()[sensor][tick])
            assert sensed.same(given, faulty, 1)
            if tick < sensed.ONSET or (tick >= sensed.END and model not in MEMORY):
                assert faulty is given
        changed = [
            tick for tick, (given, faulty) in enumerate(pairs) if not sensed.same(given, faulty)
        ]
        if is_without_size(model, sensor, signal):
            assert not changed
        elif model in LATER:
            assert changed[0] == first_made_after(sensed.ONSET, sensor)
        elif model == "freeze":
            assert changed[0] == first_unlike(sensed.ONSET - 1, sensor)
        else:
            assert changed[0] == sensed.ONSET


def is_without_size(model: str, sensor: str, signal: str) -> bool:
    """Whether it acts on a size that the sensor gives as 0, for unknown."""
    is_size = signal in ("length", "width") or model == "split"
    return is_size and sensor in sensed.SIZELESS and model in ("scale", "quantise", "split")


def first_made_after(tick: int, sensor: str) -> int:
    """The first tick with a sample that was made after a tick."""
    stamps = [item.stamp[0] for item in sensed.streams()[sensor]]
    return next(k for k, stamp in enumerate(stamps) if stamp > tick * sensed.STEP + 1e-9)


def first_unlike(tick: int, sensor: str) -> int:
    """The first tick after one whose sample says something else: an image may stay the same."""
    items = sensed.streams()[sensor]
    for later in range(tick + 1, sensed.TICKS):
        stamped = replace(items[tick], stamp=items[later].stamp, fresh=items[later].fresh)
        if not (sensed.same(stamped, items[later], 0) and sensed.same(stamped, items[later], 2)):
            return later
    raise AssertionError(sensor)


@pytest.mark.slow
@by_model([item for item in EVERY if item[0] in NULL])
def test_fault_of_no_size_changes_no_bit(combinations: Combinations) -> None:
    for model, sensor, signal in combinations:
        for given, faulty in sensed.played(sensed.made(model, sensor, null(model, signal)), sensor):
            assert sensed.same(given, faulty)


@every
def test_runs_do_not_know_of_each_other(combinations: Combinations) -> None:
    for model, sensor, signal in combinations:
        together = sensed.played(sensed.made(model, sensor, full(model, signal)), sensor)
        for run in range(sensed.RUNS):
            injector = sensed.made(model, sensor, full(model, signal), runs=[run])
            alone = sensed.played(injector, sensor, runs=[run])
            for (_, one), (_, other) in zip(together, alone, strict=True):
                assert sensed.same(one.map(lambda array, run=run: array[run : run + 1]), other)


@pytest.mark.slow
@pytest.mark.parametrize("sensor", list(sensed.SENSORS))
def test_never_present_is_the_very_same_object(sensor: str) -> None:
    for model, name, signal in EVERY:
        if name != sensor:
            continue
        quiet = sensed.played(
            sensed.made(model, sensor, full(model, signal)),
            sensor,
            lambda tick: sensed.window(tick, sensed.TICKS, sensed.TICKS),
        )
        assert all(faulty is given for given, faulty in quiet)


def test_pixel_faults_have_no_patches_where_they_are_not_present() -> None:
    for model, parameters in (
        ("dead_pixels", {"columns": 9, "rows": 7}),
        ("pixel_noise", {"columns": 9, "rows": 7, "noise": 0.1}),
        ("blackout", {}),
    ):
        injector = sensed.made(model, "pixel_camera", parameters)
        assert isinstance(injector, Pixels)
        assert injector.patches(moment(np.zeros(sensed.RUNS, dtype=np.bool_))) is None
        patches = injector.patches(moment(np.array([True, False, True])))
        assert patches is not None
        assert (patches[1] == 0.0).all()
        assert (patches[[0, 2]] != 0.0).any()


# --- Numbers: what sensors of all kinds deliver, and what each fault makes of it ------------------


def told(item: s.Measurement, run: int) -> str:
    """Write what a sensor delivers in a run: its sample, how many it sees, sums of its columns."""
    parts = [
        f"at {item.stamp[run]:.9g}",
        "new" if item.fresh[run] else "old",
        "" if item.alive[run] else "dead",
        f"of {item.source[run, item.mask[run]].tolist()}",
        *(
            f"{name} {' '.join(f'{value:.9g}' for value in np.atleast_2d(found).sum(axis=0))}"
            for name, found in (
                ("seen", item.detections[run, item.mask[run]]),
                ("estimate", None if item.estimate is None else item.estimate[run]),
                ("values", None if item.values is None else item.values[run]),
                ("points", None if item.points is None else item.points[run]),
            )
            if found is not None
        ),
    ]
    return ", ".join(part for part in parts if part)


def test_what_sensors_deliver_is_frozen() -> None:
    lines = [
        f"{name} run {run} tick {tick}: {told(ticks[tick], run)}"
        for name, ticks in sensed.streams().items()
        for run in range(3)
        for tick in (0, 2, 5, 13, 39)
    ]
    assert_frozen("sensors.txt", "\n".join([*lines, ""]))


def test_what_faults_make_of_sensors_is_frozen() -> None:
    lines = []
    for model, sensor, signal in FIRST:
        pairs = sensed.played(sensed.made(model, sensor, full(model, signal)), sensor)
        for tick in (ONSET, ONSET + 5, END - 1, END + 2):
            lines += [f"{model} {sensor} {signal} tick {tick}: {told(pairs[tick][1], 2)}"]
    assert_frozen("sensor_faults.txt", "\n".join([*lines, ""]))
