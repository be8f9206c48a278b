"""Where sensors look, how far, and through what."""

import copy
import math
from typing import Any

import numpy as np
import pytest

from adeye.signals import EGO_HEADING, EGO_X, EGO_Y, POINT_BEARING, POINT_RANGE
from adeye.simulate.faults.sensor_faults import Pixels
from adeye.testing.sensors import moment
from tests.simulate.faults.streams import (
    ONSET,
    TICKS,
    at_onset,
    made,
    make_rig,
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
    angle = np.degrees(given.points[0, :, POINT_BEARING])
    blind = (angle >= -10.0) & (angle < 3.0)
    assert (given.points[0, blind, POINT_RANGE] > 0.0).any()
    assert not faulty.points[0, blind, POINT_RANGE].any()
    assert (faulty.hits[0, blind] == -1).all()
    assert np.array_equal(faulty.points[0, ~blind], given.points[0, ~blind])


def test_reach_is_the_share_of_the_range() -> None:
    for factor, reach in ((0.2, 30.0), (0.3, 45.0)):
        given, faulty = at_onset("range_loss", "lidar", {"factor": factor})
        away = np.linalg.norm(given.detections[0, given.mask[0], :2] - SEAT, axis=1)
        assert faulty.mask[0].sum() == (away <= reach).sum()
        given, faulty = at_onset("range_loss", "beam_lidar", {"factor": factor})
        near = given.points[0, :, POINT_RANGE] <= reach
        assert np.array_equal(faulty.points[0, near], given.points[0, near])
        assert not faulty.points[0, ~near, POINT_RANGE].any()


def test_what_a_turned_sensor_reports_is_turned_back_about_it() -> None:
    given, faulty = at_onset("miscalibration", "camera", {"yaw": "5 deg"})
    assert sorted(bearings(faulty)) == pytest.approx(sorted(bearings(given) - 5.0))
    assert bearings(faulty, 1).tolist() == bearings(given, 1).tolist()
    given, faulty = at_onset("miscalibration", "beam_lidar", {"yaw": "5 deg"})
    back = given.points[0, :, POINT_RANGE] > 0.0
    off = np.degrees(faulty.points - given.points)[0, back, POINT_BEARING]
    assert off == pytest.approx(-5.0)


def test_what_a_shifted_sensor_reports_is_shifted_back() -> None:
    shift = {"x": "0.4 m", "y": "-0.3 m"}
    given, faulty = at_onset("miscalibration", "camera", shift)
    assert given.mask[0].any()
    stood, moved = (item.detections[0, item.mask[0], :2].mean(axis=0) for item in (given, faulty))
    assert moved - stood == pytest.approx([-0.4, 0.3])
    given, faulty = at_onset("miscalibration", "beam_lidar", shift)
    back = given.points[0, :, POINT_RANGE] > 0.0
    one, other = given.points[0, back], faulty.points[0, back]
    x = one[:, 0] * np.cos(one[:, 1]) - other[:, 0] * np.cos(other[:, 1])
    y = one[:, 0] * np.sin(one[:, 1]) - other[:, 0] * np.sin(other[:, 1])
    assert x == pytest.approx(0.4)
    assert y == pytest.approx(-0.3)


def test_jump_moves_the_ego_in_the_map() -> None:
    size = {"x": "30 m", "y": "-2 m", "heading": "10 deg"}
    given, faulty = at_onset("jump", "localisation", size)
    off = (faulty.estimate - given.estimate)[0, [EGO_X, EGO_Y, EGO_HEADING]]
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
