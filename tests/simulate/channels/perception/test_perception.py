"""What a channel perceives of the readings of its sensors: tracks, pose, and what is stale."""

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from adeye.kernel.road import position
from adeye.ports import ChannelContext
from adeye.signals import Bools, Floats, Measurement, Observation
from adeye.simulate.channels.driving import channel_records
from adeye.simulate.channels.perception import pose as subject
from adeye.simulate.channels.perception.step import NOTE_END, Perception, Sight
from adeye.simulate.channels.perception.tracking import assumed_accuracy
from adeye.simulate.channels.perception.tracks import TRACK_HITS
from adeye.simulate.sensors.rig import DATA_SHEETS
from adeye.spec.channels import NominalParameters
from adeye.testing import channel_context
from adeye.testing.scenes import ego_estimate, object_measurement, pose_measurement, straight_road
from tests.simulate.channels.perceived import LINKS, SENSORS

STEP = 0.05
SPEED = 20.0
LANE = 5.25
FIELDS = {"confirm_hits": 3.0, "coast": 0.5, "gate": 4.0, "confirm_window": 0.0}


class Eye:
    """The perception of a batch that is fed with an object at rest 60 m ahead of the start."""

    def __init__(self, runs: int = 1) -> None:
        self.road = straight_road(runs)
        context = channel_context(
            NominalParameters(), links=LINKS, sensors=SENSORS, runs=runs, road=self.road
        )
        self.perception = Perception(context, channel_records(context, FIELDS))
        self.seen = self.perception.seen

    def look(
        self,
        tick: int,
        *,
        sampled: int | None = None,
        with_pose: bool = True,
        alive: Bools | None = None,
        running: Bools | None = None,
    ) -> None:
        """Show a tick, with samples of an earlier one if that is given."""
        runs = self.seen.records.shape[0]
        stamp = STEP * (tick if sampled is None else sampled)
        ego = np.tile([SPEED * stamp, LANE, 0.0, SPEED, 0.0, 0.0, 0.0], (runs, 1))
        front = object_measurement(ego, np.tile([60.0, LANE, 0.0, 0.0, 0.0], (runs, 1, 1)), stamp)
        if alive is not None:
            front = replace(front, alive=alive)
        pose = pose_measurement(self.road, ego, stamp if with_pose else -1.0)
        running = np.ones(runs, dtype=np.bool_) if running is None else running
        shown = {"front": front, "pose": pose}
        self.perception.update(Observation(tick * STEP, shown, {}, None, running))


def test_track_is_shown_in_the_vehicle_frame_once_it_is_confirmed() -> None:
    eye = Eye()
    for tick in range(20):
        eye.look(tick)
        assert np.isfinite(eye.seen.shown).any() == (tick >= 2)
    # With its speed over ground.
    shown = eye.seen.shown[0]
    assert shown[0, :4] == pytest.approx([60.0 - SPEED * 0.95, 0.0, 0.0, 0.0], abs=0.1)
    assert np.isnan(shown[1:]).all()


def test_track_that_is_gone_is_not_shown_any_more() -> None:
    eye = Eye()
    for tick in range(3):
        eye.look(tick)
    assert np.isfinite(eye.seen.shown[0, 0]).all()
    for tick in range(3, 20):
        eye.look(tick, sampled=2)
    assert np.isnan(eye.seen.shown).all()


def test_end_of_the_tracks_is_noted() -> None:
    for with_pose, end in ((True, 1.0), (False, -1.0)):
        eye = Eye()
        eye.look(0, with_pose=with_pose)
        assert eye.seen.notes[0, NOTE_END] == end


def test_one_sample_is_used_once() -> None:
    eye = Eye()
    for tick in range(4):
        eye.look(tick, sampled=0)
    assert eye.seen.tracks[0, 0, TRACK_HITS] == 1.0


def test_without_own_motion_nothing_is_tracked() -> None:
    eye = Eye()
    for tick in range(5):
        eye.look(tick, with_pose=False)
    assert (eye.seen.tracks[0, :, TRACK_HITS] == 0.0).all()
    # The sample was not used up meanwhile.
    eye.look(5)
    assert eye.seen.tracks[0, 0, TRACK_HITS] == 1.0


def test_dead_sensor_degrades_its_own_run_only_and_only_while_it_is_dead() -> None:
    eye = Eye(runs=3)
    eye.look(0, alive=np.array([True, False, True]))
    assert eye.seen.degraded.tolist() == [False, True, False]
    eye.look(1)
    assert not eye.seen.degraded.any()


def test_runs_that_have_ended_stay_as_they_were() -> None:
    # More than a block, and the ended one in the second.
    eye = Eye(runs=70)
    running = np.ones(70, dtype=np.bool_)
    for tick in range(3):
        eye.look(tick, running=running)
    before = eye.seen.shown.copy()
    running[66] = False
    eye.look(3, running=running)
    changed = (eye.seen.shown[:, 0] != before[:, 0]).any(axis=1)
    assert changed.tolist() == running.tolist()
    # A channel keeps what it was shown, whatever becomes of the array.
    running[:] = False
    assert eye.seen.running.sum() == 69


def measurement(count: int, *, alive: bool = True, estimate: float | None = None) -> Measurement:
    return Measurement(
        np.full(2, 0.5),
        np.ones(2, dtype=np.bool_),
        np.full(2, alive),
        np.ones((2, count), dtype=np.bool_),
        np.full((2, count, 7), float(count)),
        np.zeros((2, count), dtype=np.int64),
        None if estimate is None else np.full((2, 13), estimate),
    )


KINDS = {"front": "radar", "own": "./mine.py:Mine", "gnss": "gnss", "imu": "imu"}


def linked(*links: str) -> ChannelContext:
    kinds = {name: (KINDS | SENSORS)[name] for name in links if name != "switch"}
    context = channel_context(None, links=links, sensors=kinds, runs=2)
    sheets = {
        name: dict.fromkeys(DATA_SHEETS[kind], np.full(2, 0.1))
        for name, kind in kinds.items()
        if kind in DATA_SHEETS
    }
    if "gnss" in sheets:
        sheets["gnss"]["bias"] = np.zeros(2)
    return replace(context, data_sheets=sheets)


def sight(*links: str) -> Sight:
    return Sight(linked(*links))


def values(*numbers: float) -> Measurement:
    made = measurement(0)
    made.values = np.tile(numbers, (2, 1))
    return made


def test_sensors_are_as_accurate_as_is_assumed_in_the_order_of_the_links() -> None:
    context = linked("front", "own", "switch")
    rows = Sight(context).accuracy
    assert rows.shape[:2] == (2, 2)
    assert np.array_equal(rows, assumed_accuracy(context, ["front", "own"]))
    assert not np.array_equal(rows[:, 0], rows[:, 1])


def test_lists_of_different_length_stand_side_by_side() -> None:
    both = sight("front", "own")
    shown = both.take({"front": measurement(1), "own": measurement(3)})
    assert [rows.shape for rows in shown.masks[:2]] == [(2, 1), (2, 3)]
    assert shown.detections[1][0, 2, 0] == 3.0
    assert shown.places.shape == (3, 2)
    assert shown.owner.shape == (3,)


def test_arrays_of_another_type_are_made_the_one_that_steps_are_compiled_for() -> None:
    one, seen = sight("front"), measurement(2)
    seen.detections = np.asfortranarray(seen.detections, dtype=np.float32)
    seen.stamp.flags.writeable = False
    shown = one.take({"front": seen})
    assert shown.detections[0].dtype == np.float64
    assert shown.detections[0].flags.c_contiguous
    assert shown.detections[0].tolist() == np.full((2, 2, 7), 2.0).tolist()
    assert shown.stamps[0].flags.writeable


def test_number_of_slots_is_the_same_for_few_sensors_and_doubles_for_many() -> None:
    counts = {}
    for sensors in (0, 1, 4, 5):
        names = [f"own_{index}" for index in range(sensors)]
        many = Sight(
            channel_context(None, links=names, sensors=dict.fromkeys(names, "camera"), runs=2)
        )
        shown = many.take({name: measurement(1) for name in names})
        counts[sensors] = {len(shown.stamps), len(shown.alive), len(shown.masks)}
    assert counts == {0: {4}, 1: {4}, 4: {4}, 5: {8}}


def test_first_linked_estimate_is_taken_and_without_one_there_is_no_stamp() -> None:
    both = {"own": measurement(0, estimate=1.0), "pose": measurement(0, estimate=2.0)}
    shown = sight("own", "pose").take(both)
    assert shown.estimate[0, 0] == 1.0
    assert shown.estimate_stamp.tolist() == [0.5, 0.5]
    blind = sight("front").take({"front": measurement(1)})
    assert blind.estimate_stamp.tolist() == [-1.0, -1.0]


def test_dead_sensor_is_shown_as_such_and_a_localisation_not_looked_through_for_objects() -> None:
    two, seen = sight("pose", "front"), measurement(1, alive=False)
    shown = two.take({"front": seen, "pose": measurement(1, estimate=1.0)})
    # The slots beyond the sensors are never a fault.
    assert [rows.all() for rows in shown.alive] == [True, False, True, True]
    assert shown.accuracy.shape[:2] == shown.mounts.shape[:2] == (2, 1)
    assert shown.masks[0] is seen.mask
    assert shown.estimate[0, 0] == 1.0


FIX = (100.0, 5.0, 20.0, 0.0)


def test_receiver_and_unit_stand_in_for_a_sensor_that_gives_an_estimate() -> None:
    two = sight("gnss", "imu")
    shown = two.take({"gnss": values(*FIX), "imu": values(-1.0, 0.0, 0.0)}, 0.6)
    # The box centre is where the antenna is; the time is that of the unit's sample.
    assert np.abs(shown.estimate[:, :4] - [100.0, 5.0, 0.0, 20.0]).max() < 1e-9
    assert shown.estimate_stamp.tolist() == [0.5, 0.5]
    assert shown.accuracy.size == 0


def test_receiver_alone_estimates_the_time_of_the_tick_if_it_is_known() -> None:
    shown = sight("gnss").take({"gnss": values(*FIX)}, 0.6)
    assert shown.estimate_stamp.tolist() == [0.6, 0.6]
    assert np.abs(shown.estimate[:, 0] - 102.0).max() < 1e-9
    assert sight("gnss").take({"gnss": values(*FIX)}).estimate_stamp.tolist() == [-1.0, -1.0]


def test_estimate_of_a_sensor_is_taken_before_that_of_the_channel() -> None:
    own = {"gnss": values(*FIX), "imu": values(0.0, 0.0, 0.0)}
    shown = sight("gnss", "imu", "own").take({**own, "own": measurement(0, estimate=7.0)}, 0.6)
    assert shown.estimate[0, 0] == 7.0


def test_without_receiver_nothing_is_estimated() -> None:
    assert sight("pose", "gnss", "imu").localiser is None
    one = sight("imu")
    assert one.localiser is None
    shown = one.take({"imu": values(0.0, 0.0, 0.0)}, 0.6)
    assert shown.estimate_stamp.tolist() == [-1.0, -1.0]


# --- The pose of a channel: carried on between the estimates of its sensors, and given up ---------


STRAIGHT = straight_road().segments[0]


def fresh_pose() -> Floats:
    pose = np.zeros(subject.POSE_WIDTH)
    subject.clear_pose(pose)
    return pose


def estimate_at(
    time: float, *, speed: float = 20.0, curvature: float = 0.0, rear: float = 0.0
) -> Floats:
    """Ego whose centre moves along the line 5 m left of the reference line.

    Its body is turned in where its centre is ahead of the rear axle, by ``rear``.
    """
    road = straight_road(curvature=curvature)
    s = speed * time / (1.0 - 5.0 * curvature)
    x, y, heading = position(road.segments[0], s, 5.0)
    bend = curvature / (1.0 - 5.0 * curvature)
    turned_in = math.asin(rear * bend)
    forward = speed * math.cos(turned_in)
    state = np.array([[x, y, heading - turned_in, forward, 0.0, 0.0, forward * bend]])
    return ego_estimate(road, state).reshape(-1)


def test_pose_is_unknown_before_the_first_sample_that_is_a_number() -> None:
    wrong = estimate_at(0.0)
    wrong[1] = np.nan
    for sample, stamp in ((np.zeros(13), -1.0), (wrong, 0.0)):
        pose = fresh_pose()
        subject.update_pose(pose, STRAIGHT, sample, stamp, 0.0, STEP)
        assert not subject.has_pose(pose, 0.0)


def test_late_sample_is_carried_to_now() -> None:
    pose = fresh_pose()
    subject.update_pose(pose, STRAIGHT, estimate_at(1.0), 1.0, 1.2, STEP)
    assert pose[subject.POSE_S] == pytest.approx(24.0)
    assert pose[subject.POSE_STAMP] == 1.0


@pytest.mark.parametrize(
    ("curvature", "speed", "rear", "near"),
    [
        (0.0, 20.0, 0.0, 0.02),
        (1.0 / 200.0, 20.0, 0.0, 0.02),
        (-1.0 / 200.0, 20.0, 0.0, 0.02),
        # A box centre that swings around the rear axle.
        (1.0 / 60.0, 12.0, 1.45, 0.01),
        (-1.0 / 60.0, 12.0, 1.45, 0.01),
    ],
)
def test_pose_is_true_between_rare(
    curvature: float, speed: float, rear: float, near: float
) -> None:
    pose = fresh_pose()
    pose[subject.POSE_REAR] = rear
    segments = straight_road(curvature=curvature).segments[0]
    sample = partial(estimate_at, speed=speed, curvature=curvature, rear=rear)
    for tick in range(2, 60):
        stamp = (tick // 4) * 4 * STEP - 2 * STEP
        subject.update_pose(pose, segments, sample(stamp), stamp, tick * STEP, STEP)
    assert pose[[subject.POSE_X, subject.POSE_Y]] == pytest.approx(sample(59 * STEP)[:2], abs=near)
    turned_in = math.asin(rear * curvature / (1.0 - 5.0 * curvature))
    assert pose[subject.POSE_ALIGN] == pytest.approx(-turned_in, abs=2e-3 if rear else 1e-3)


def test_noise_is_reduced_as_the_gain_promises() -> None:
    generator = np.random.Generator(np.random.Philox(1))
    pose, places, headings = fresh_pose(), [], []
    for tick in range(3000):
        sample = estimate_at(tick * STEP)
        sample[8] += 0.1 * generator.standard_normal()
        sample[2] += 0.01 * generator.standard_normal()
        subject.update_pose(pose, STRAIGHT, sample, tick * STEP, tick * STEP, STEP)
        places.append(pose[subject.POSE_D])
        headings.append(pose[subject.POSE_ALIGN])
    promised = 0.01 * np.sqrt(subject.HEADING_GAIN / (2.0 - subject.HEADING_GAIN))
    assert np.std(headings) == pytest.approx(promised, rel=0.1)
    assert (
        np.std(places) >= 0.1 * np.sqrt(subject.LATERAL_GAIN / (2.0 - subject.LATERAL_GAIN)) * 0.9
    )
    assert np.std(places) < 0.08


def test_braking_ego_is_carried_to_standstill_and_no_further() -> None:
    pose = fresh_pose()
    sample = estimate_at(0.0, speed=2.0)
    sample[4] = -8.0
    subject.update_pose(pose, straight_road().segments[0], sample, 0.0, 0.0, STEP)
    start = pose[subject.POSE_S]
    for tick in range(1, 9):
        subject.update_pose(pose, straight_road().segments[0], sample, 0.0, tick * STEP, STEP)
    assert pose[subject.POSE_SPEED] == 0.0
    assert pose[subject.POSE_S] - start == pytest.approx(0.25, abs=1e-9)


def test_pose_is_lost_when_samples_stay_away() -> None:
    pose = fresh_pose()
    subject.update_pose(pose, straight_road().segments[0], estimate_at(0.0), 0.0, 0.0, STEP)
    assert subject.has_pose(pose, subject.MAX_AGE)
    assert not subject.has_pose(pose, subject.MAX_AGE + STEP)
