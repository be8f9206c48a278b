import numpy as np
import pytest

from adeye.channels.accuracy import ACCURACY_WIDTH
from adeye.channels.perception import NOTE_END, NOTE_WIDTH, is_degraded, perceive, show_tracks
from adeye.channels.pose import POSE_WIDTH, clear_pose
from adeye.channels.tracks import TRACK_HITS, TRACK_STATE, TRACKS
from adeye.signals import TRACK_COLUMNS, Floats, parameter_record
from adeye.testing.scenes import ego_estimate, object_measurement, straight_road

STEP = 0.05
SPEED = 20.0
ACCURACY = np.full((1, 1, ACCURACY_WIDTH), 0.01)
RECORD = parameter_record(
    {
        "period": np.full(1, STEP),
        "coast": 0.5,
        "gate": 4.0,
        "confirm_hits": 3.0,
        "confirm_window": 0.0,
        "behind": 15.0,
    }
)


class Eye:
    """The state of one run, fed with an object at rest 60 m ahead of the start."""

    def __init__(self) -> None:
        self.pose = np.zeros((1, POSE_WIDTH))
        clear_pose(self.pose[0])
        self.tracks = np.zeros((1, TRACKS, TRACK_STATE))
        self.used = np.full((1, 1), -1.0)
        self.notes = np.zeros((1, NOTE_WIDTH))

    def look(self, time: float, *, stamp: float, with_pose: bool = True) -> None:
        road = straight_road()
        ego = np.array([[SPEED * stamp, 5.25, 0.0, SPEED, 0.0, 0.0, 0.0]])
        objects = np.array([[[60.0, 5.25, 0.0, 0.0, 0.0]]])
        seen = object_measurement(ego, objects, stamp)
        perceive(
            0,
            1,
            RECORD,
            time,
            np.ones(1, dtype=np.bool_),
            road.segments,
            ego_estimate(road, ego),
            np.full(1, stamp if with_pose else -1.0),
            ACCURACY,
            np.zeros((1, 1, 2)),
            (seen.stamp,),
            (seen.mask,),
            (seen.detections,),
            self.pose,
            self.tracks,
            self.used,
            self.notes,
            np.zeros((1, 2)),
            np.zeros(1, dtype=np.int64),
        )

    def shown(self) -> Floats:
        shown = np.full((TRACKS, len(TRACK_COLUMNS)), np.nan)
        show_tracks(self.tracks[0], 3.0, shown)
        return shown


def test_track_that_is_gone_is_not_shown_any_more() -> None:
    tracks = np.zeros((TRACKS, TRACK_STATE))
    shown = np.full((TRACKS, len(TRACK_COLUMNS)), np.nan)
    tracks[1, TRACK_HITS] = 3.0
    show_tracks(tracks, 3.0, shown)
    assert np.isfinite(shown).all(axis=1).tolist() == [False, True] + [False] * (TRACKS - 2)
    tracks[1, TRACK_HITS] = 0.0
    show_tracks(tracks, 3.0, shown)
    assert np.isnan(shown).all()


def test_confirmed_track_is_shown_in_the_vehicle_frame_with_its_speed_over_ground() -> None:
    eye = Eye()
    for tick in range(20):
        eye.look(tick * STEP, stamp=tick * STEP)
    first = eye.shown()[0]
    assert first[:4] == pytest.approx([60.0 - SPEED * 0.95, 0.0, 0.0, 0.0], abs=0.1)
    assert np.isnan(eye.shown()[1:]).all()


def test_track_is_not_shown_before_it_is_confirmed() -> None:
    eye = Eye()
    for tick in range(2):
        eye.look(tick * STEP, stamp=tick * STEP)
    assert np.isnan(eye.shown()).all()


def test_end_of_the_tracks_is_noted() -> None:
    eye = Eye()
    eye.look(0.0, stamp=0.0)
    assert eye.notes[0, NOTE_END] == 1.0
    blind = Eye()
    blind.look(0.0, stamp=0.0, with_pose=False)
    assert blind.notes[0, NOTE_END] == -1.0


def test_one_sample_is_used_once() -> None:
    eye = Eye()
    for tick in range(4):
        eye.look(tick * STEP, stamp=0.0)
    assert eye.tracks[0, 0, TRACK_HITS] == 1.0


def test_without_own_motion_nothing_is_tracked() -> None:
    eye = Eye()
    for tick in range(5):
        eye.look(tick * STEP, stamp=tick * STEP, with_pose=False)
    assert (eye.tracks[0, :, TRACK_HITS] == 0.0).all()
    # The sample was not used up meanwhile.
    eye.look(5 * STEP, stamp=5 * STEP)
    assert eye.tracks[0, 0, TRACK_HITS] == 1.0


def test_dead_sensor_degrades_its_own_run_only() -> None:
    alive = (np.array([True, True, True]), np.array([True, False, True]), np.zeros(3, np.bool_))
    assert [is_degraded(alive[:2], run) for run in range(3)] == [False, True, False]
    assert is_degraded(alive, 0)
