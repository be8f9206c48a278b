from dataclasses import replace

import numpy as np
import pytest

from adeye.signals import Bools, Observation
from adeye.simulate.channels.driving import channel_records
from adeye.simulate.channels.perception.step import NOTE_END, Perception
from adeye.simulate.channels.perception.tracks import TRACK_HITS
from adeye.spec.channels import NominalParameters
from adeye.testing import channel_context
from adeye.testing.scenes import object_measurement, pose_measurement, straight_road

STEP = 0.05
SPEED = 20.0
LANE = 5.25
FIELDS = {"confirm_hits": 3.0, "coast": 0.5, "gate": 4.0, "confirm_window": 0.0}


class Eye:
    """The perception of a batch that is fed with an object at rest 60 m ahead of the start."""

    def __init__(self, runs: int = 1) -> None:
        self.road = straight_road(runs)
        context = channel_context(
            NominalParameters(),
            links=("front", "pose"),
            sensors={"front": "radar", "pose": "localisation"},
            runs=runs,
            road=self.road,
        )
        self.seen = Perception(context, channel_records(context, FIELDS))

    def look(
        self,
        time: float,
        *,
        stamp: float,
        with_pose: bool = True,
        alive: Bools | None = None,
        running: Bools | None = None,
    ) -> None:
        runs = self.seen.records.shape[0]
        ego = np.tile([SPEED * stamp, LANE, 0.0, SPEED, 0.0, 0.0, 0.0], (runs, 1))
        objects = np.tile([60.0, LANE, 0.0, 0.0, 0.0], (runs, 1, 1))
        front = object_measurement(ego, objects, stamp)
        if alive is not None:
            front = replace(front, alive=alive)
        pose = pose_measurement(self.road, ego, stamp if with_pose else -1.0)
        if running is None:
            running = np.ones(runs, dtype=np.bool_)
        self.seen.update(Observation(time, {"front": front, "pose": pose}, {}, None, running))


def test_confirmed_track_is_shown_in_the_vehicle_frame_with_its_speed_over_ground() -> None:
    eye = Eye()
    for tick in range(20):
        eye.look(tick * STEP, stamp=tick * STEP)
    shown = eye.seen.shown[0]
    assert shown[0, :4] == pytest.approx([60.0 - SPEED * 0.95, 0.0, 0.0, 0.0], abs=0.1)
    assert np.isnan(shown[1:]).all()


def test_track_is_not_shown_before_it_is_confirmed() -> None:
    eye = Eye()
    for tick in range(2):
        eye.look(tick * STEP, stamp=tick * STEP)
    assert np.isnan(eye.seen.shown).all()


def test_track_that_is_gone_is_not_shown_any_more() -> None:
    eye = Eye()
    for tick in range(3):
        eye.look(tick * STEP, stamp=tick * STEP)
    assert np.isfinite(eye.seen.shown[0, 0]).all()
    for tick in range(3, 20):
        eye.look(tick * STEP, stamp=2 * STEP)
    assert np.isnan(eye.seen.shown).all()


def test_end_of_the_tracks_is_noted() -> None:
    eye = Eye()
    eye.look(0.0, stamp=0.0)
    assert eye.seen.notes[0, NOTE_END] == 1.0
    blind = Eye()
    blind.look(0.0, stamp=0.0, with_pose=False)
    assert blind.seen.notes[0, NOTE_END] == -1.0


def test_one_sample_is_used_once() -> None:
    eye = Eye()
    for tick in range(4):
        eye.look(tick * STEP, stamp=0.0)
    assert eye.seen.tracks[0, 0, TRACK_HITS] == 1.0


def test_without_own_motion_nothing_is_tracked() -> None:
    eye = Eye()
    for tick in range(5):
        eye.look(tick * STEP, stamp=tick * STEP, with_pose=False)
    assert (eye.seen.tracks[0, :, TRACK_HITS] == 0.0).all()
    # The sample was not used up meanwhile.
    eye.look(5 * STEP, stamp=5 * STEP)
    assert eye.seen.tracks[0, 0, TRACK_HITS] == 1.0


def test_dead_sensor_degrades_its_own_run_only_and_only_while_it_is_dead() -> None:
    eye = Eye(runs=3)
    eye.look(0.0, stamp=0.0, alive=np.array([True, False, True]))
    assert eye.seen.degraded.tolist() == [False, True, False]
    eye.look(STEP, stamp=STEP)
    assert not eye.seen.degraded.any()


def test_runs_that_have_ended_stay_as_they_were() -> None:
    # More than a block, and the ended one in the second.
    eye = Eye(runs=70)
    running = np.ones(70, dtype=np.bool_)
    for tick in range(3):
        eye.look(tick * STEP, stamp=tick * STEP, running=running)
    before = eye.seen.shown.copy()
    running[66] = False
    eye.look(3 * STEP, stamp=3 * STEP, running=running)
    changed = (eye.seen.shown[:, 0] != before[:, 0]).any(axis=1)
    assert changed.tolist() == running.tolist()
    # A channel keeps what it was shown, whatever becomes of the array.
    running[:] = False
    assert eye.seen.running.sum() == 69
