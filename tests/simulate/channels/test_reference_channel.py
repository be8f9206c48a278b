"""The reference channel in closed loop against the scenes of ``adeye reference``."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from adeye.kernel.reference_drivers import reactions as columns
from adeye.kernel.reference_drivers.drivers import SCRATCH_SIZE, drive_scenes
from adeye.kernel.reference_drivers.reactions import following_distance
from adeye.kernel.road import position
from adeye.signals import FAULT, OK, ControlCommand, Floats, RoadMap
from adeye.simulate.channels import reference as subject
from adeye.simulate.channels.links import observe
from adeye.simulate.channels.perception import pose as poses
from adeye.spec.architecture import Architecture
from adeye.spec.channels import ReferenceParameters
from adeye.testing import channel_context, check_channel
from adeye.testing.scenes import object_measurement, straight_road
from tests.kernel.stop_limits import GROUND
from tests.motorway import ARCHITECTURE

STEP = 0.05
SCENES = 240
LANE = 5.25
LINKS = ("truth",)


def scenes(kind: int, seed: int) -> Floats:
    """Draw scenes around what decides: half of them end in a contact."""
    draw = np.random.default_rng(seed)
    rows = np.zeros((SCENES, columns.SCENE_SIZE))
    rows[:, [columns.S_EGO_LENGTH, columns.S_OTHER_LENGTH]] = 4.5
    rows[:, [columns.S_EGO_WIDTH, columns.S_OTHER_WIDTH]] = 1.8
    rows[:, columns.S_LANE_WIDTH] = 3.5
    rows[:, columns.S_EGO_SPEED] = draw.uniform(8.0, 36.0, SCENES)
    rows[:, columns.S_OTHER_SPEED] = rows[:, columns.S_EGO_SPEED]
    rows[:, columns.S_GAP] = draw.uniform(2.0, 60.0, SCENES)
    if kind == columns.CUT_IN:
        rows[:, columns.S_OTHER_SPEED] *= draw.uniform(0.2, 1.0, SCENES)
        rows[:, columns.S_LATERAL_SPEED] = draw.uniform(0.4, 2.0, SCENES)
        rows[:, columns.S_LATERAL_OFFSET] = 3.5
    elif kind == columns.BRAKING_LEAD:
        rows[:, columns.S_BRAKING] = draw.uniform(3.0, 9.0, SCENES)
        rows[:, columns.S_BRAKING_JERK] = draw.uniform(5.0, 50.0, SCENES)
    else:
        rows[:, columns.S_LATERAL_SPEED] = draw.uniform(1.0, 3.0, SCENES)
        # The vehicle that cuts out gets past the standing one.
        clear = rows[:, columns.S_OTHER_SPEED] * 1.8 / rows[:, columns.S_LATERAL_SPEED]
        rows[:, columns.S_FRONT_GAP] = clear * draw.uniform(1.05, 1.6, SCENES)
    return rows


def expected(rows: Floats, kind: int, model: str) -> Floats:
    results = np.zeros((len(rows), columns.RESULT_SIZE))
    numbers = columns.vector(columns.parameters_of(model))
    scratch = np.zeros(SCRATCH_SIZE)
    drive_scenes(
        rows, kind, columns.MODELS[model], numbers, STEP, columns.EXACT, math.inf, scratch, results
    )
    # The fuzzy model comes to a standing vehicle for ever closer, and its gap ends in rounding.
    results[(results[:, 0] == 0.0) & (results[:, columns.R_MIN_GAP] < 1e-3), 0] = np.nan
    return results[:, 0]


def made(road: RoadMap, desired_speed: Any, **parameters: Any) -> subject.ReferenceChannel:
    channel = subject.ReferenceChannel()
    context = channel_context(
        ReferenceParameters.model_validate(parameters),
        links=LINKS,
        sensors={"truth": "ground_truth"},
        runs=len(road.segments),
        road=road,
        desired_speed=desired_speed,
    )
    channel.reset(context)
    return channel


def ask(
    channel: subject.ReferenceChannel, road: RoadMap, ego: Floats, objects: Floats, time: float
) -> ControlCommand:
    truth = object_measurement(ego.copy(), objects.copy(), time, road=road)
    running = np.ones(len(ego), dtype=np.bool_)
    return channel.act(observe(LINKS, time, {"truth": truth}, {}, None, running, protect=False))


def closed_loop(rows: Floats, kind: int, model: str, seconds: float = 25.0) -> Floats:
    """Let the channel drive every scene: one object, or two where one cuts out.

    The ego follows its command at once, and the channel sees nothing but a sample of truth.
    """
    runs = len(rows)
    road = straight_road(runs)
    # In the scenes nobody drives faster or eases off where the model asks for nothing.
    idle = "1e-6 m/s^2"
    idling = {"model": model, "max_acceleration": idle, "comfort_deceleration": idle}
    channel = made(road, rows[:, columns.S_EGO_SPEED].copy(), **idling)
    ego = np.zeros((runs, 7))
    ego[:, 0], ego[:, 1], ego[:, 3] = 500.0, LANE, rows[:, columns.S_EGO_SPEED]
    count = 2 if kind == columns.CUT_OUT else 1
    objects = np.zeros((runs, count, 5))
    objects[:, 0, 0] = 504.5 + rows[:, columns.S_GAP]
    objects[:, 0, 1] = LANE + rows[:, columns.S_LATERAL_OFFSET]
    objects[:, 0, 3] = rows[:, columns.S_OTHER_SPEED]
    if kind == columns.CUT_OUT:
        objects[:, 1, 0] = objects[:, 0, 0] + 4.5 + rows[:, columns.S_FRONT_GAP]
        objects[:, 1, 1] = LANE
    touched, sideways = np.zeros(runs), rows[:, columns.S_LATERAL_SPEED]
    for tick in range(round(seconds / STEP)):
        lateral = np.abs(objects[:, :, 1] - LANE) < 1.8
        ahead = np.abs(objects[:, :, 0] - ego[:, None, 0]) <= 4.5
        touched[(lateral & ahead).any(axis=1)] = 1.0
        command = ask(channel, road, ego, objects, tick * STEP)
        assert (command.status == OK).all()
        _advance(ego, np.where(touched > 0.0, 0.0, command.acceleration))
        _advance(objects[:, 0], -_braking(rows, kind, tick))
        if kind == columns.CUT_IN:
            offset = rows[:, columns.S_LATERAL_OFFSET] - sideways * (tick + 1) * STEP
            objects[:, 0, 1] = LANE + np.maximum(offset, 0.0)
        elif kind == columns.CUT_OUT:
            objects[:, 0, 1] = LANE + sideways * (tick + 1) * STEP
    return touched


def _braking(rows: Floats, kind: int, tick: int) -> Floats:
    if kind != columns.BRAKING_LEAD:
        return np.zeros(len(rows))
    return np.minimum(
        rows[:, columns.S_BRAKING_JERK] * (tick + 0.5) * STEP, rows[:, columns.S_BRAKING]
    )


def _advance(states: Floats, acceleration: Floats) -> None:
    """Move at constant acceleration, to a standstill within the step if it comes."""
    speed = states[:, 3]
    later = np.maximum(speed + acceleration * STEP, 0.0)
    stops = speed + acceleration * STEP < 0.0
    way_to_stop = speed**2 / (-2.0 * np.where(stops, acceleration, -1.0))
    states[:, 0] += np.where(stops, way_to_stop, STEP * 0.5 * (speed + later))
    states[:, 3], states[:, 4] = later, acceleration


def near_boundary(rows: Floats, kind: int, model: str, verdict: Floats) -> Any:
    """Tell of which scenes the verdict changes if the gap does by what one step drives."""
    way = STEP * rows[:, columns.S_EGO_SPEED]
    near = np.zeros(len(rows), dtype=np.bool_)
    for share in (-1.0, 1.0):
        moved = rows.copy()
        moved[:, columns.S_GAP] = np.maximum(moved[:, columns.S_GAP] + share * way, 0.1)
        near |= expected(moved, kind, model) != verdict
    return near


@pytest.mark.slow
@pytest.mark.parametrize("model", list(columns.MODELS))
@pytest.mark.parametrize("kind", [columns.CUT_IN, columns.BRAKING_LEAD, columns.CUT_OUT])
def test_contacts_are_those_of_the_scenes(kind: int, model: str) -> None:
    rows = scenes(kind, seed=11)
    verdict = expected(rows, kind, model)
    decided = ~np.isnan(verdict)
    assert decided.sum() > 0.8 * SCENES
    assert 0.1 * SCENES < (verdict == 1.0).sum() < 0.9 * SCENES
    driven = closed_loop(rows, kind, model)
    differs = decided & (driven != verdict)
    near = near_boundary(rows, kind, model, verdict)
    assert not (differs & ~near).any(), rows[differs & ~near]
    assert differs.sum() <= 0.02 * SCENES


@pytest.mark.parametrize("model", list(columns.MODELS))
def test_conforms(model: str) -> None:
    parameters = ReferenceParameters.model_validate({"model": model})
    check_channel(
        subject.ReferenceChannel, parameters, links=LINKS, sensors={"truth": "ground_truth"}
    )


@pytest.mark.parametrize("model", list(columns.MODELS))
def test_follows_at_its_own_distance(model: str) -> None:
    speed, road = 20.0, straight_road()
    channel = made(road, 30.0, model=model)
    ego = np.array([[500.0, LANE, 0.0, 20.0, 0.0, 0.0, 0.0]])
    wanted = following_distance(
        columns.MODELS[model], columns.vector(columns.parameters_of(model)), speed
    )
    objects = np.array([[[504.5 + 1.5 * wanted, LANE, 0.0, speed, 0.0]]])
    for tick in range(1600):
        _advance(ego, ask(channel, road, ego, objects, tick * STEP).acceleration)
        _advance(objects[:, 0], np.zeros(1))
    gap = objects[0, 0, 0] - ego[0, 0] - 4.5
    assert ego[0, 3] == pytest.approx(speed, abs=0.1)
    assert wanted <= gap <= 1.2 * wanted


def test_without_a_sample_of_the_tick_it_is_faulty() -> None:
    road, running = straight_road(), np.ones(1, bool)
    channel = made(road, 30.0)
    ego = np.array([[500.0, LANE, 0.0, 20.0, 0.0, 0.0, 0.0]])
    readings = {"truth": object_measurement(ego, np.zeros((1, 0, 5)), 0.0, road=road)}
    for time, status in ((0.0, OK), (STEP, FAULT)):
        seen = observe(LINKS, time, readings, {}, None, running, protect=False)
        assert channel.act(seen).status[0] == status


TRUTH = {"kind": "ground_truth", "rate": "20 Hz"}


def architecture_of(sensor: dict[str, Any], links: Sequence[str]) -> Architecture:
    """Return an architecture with one sensor and a reference driver."""
    driver = {"kind": "reference", "links": list(links), "rate": "20 Hz"}
    switch = {"policy": "fixed_priority", "priority": ["driver"], "default": "driver"}
    parts = {"sensors": {"truth": sensor}, "channels": {"driver": driver}, "switch": switch}
    return Architecture.model_validate({**ARCHITECTURE, **parts})


def test_a_reference_driver_sees_ground_truth_or_nothing() -> None:
    driver = architecture_of(TRUTH, ["truth"]).channels["driver"]
    assert driver.parameters == ReferenceParameters()
    for sensor, links in (
        ({"kind": "localisation", "rate": "20 Hz"}, ["truth"]),
        (TRUTH | {"latency": "0.1 s"}, ["truth"]),
        (TRUTH | {"rate": "10 Hz"}, ["truth"]),
        (TRUTH, ["truth", "switch"]),
        (TRUTH, []),
    ):
        with pytest.raises(ValueError, match="of kind ground_truth"):
            architecture_of(sensor, links)


# What a reference driver knows of objects: speeds from places, and who hides whom.

PERIOD = 0.05
RECORD: Any = np.array([(4.5, 1.8)], dtype=[("length", "f8"), ("width", "f8")])[0]


def pose(speed: float = 20.0) -> Floats:
    row = np.zeros(poses.POSE_WIDTH)
    row[[poses.POSE_S, poses.POSE_X]] = 500.0
    row[[poses.POSE_D, poses.POSE_Y]] = LANE
    row[[poses.POSE_ALIGN, poses.POSE_HEADING]] = 0.0
    row[poses.POSE_SPEED] = speed
    return row


def see(things: Floats, *places: tuple[float, float]) -> None:
    """Show objects at places relative to an ego that stays where it is."""
    rows = np.array([[x, y, 0.0, 0.0, 4.5, 1.8, 0.0] for x, y in places]).reshape(-1, 7)
    segments = straight_road().segments[0]
    subject.update_things(things, pose(), segments, LANE, np.ones(len(rows), bool), rows, PERIOD)


def nothing() -> Floats:
    return np.zeros((subject.THINGS, subject.THING_SIZE))


@pytest.mark.slow
def test_speed_and_acceleration_follow_from_places() -> None:
    things = nothing()
    for tick in range(5):
        time = tick * PERIOD
        see(things, (30.0 + 10.0 * time - 2.0 * time * time, 1.0 - 0.5 * time))
    thing = things[0]
    assert thing[subject.THING_FORWARD] == pytest.approx(10.0 - 4.0 * 0.2, abs=1e-6)
    assert thing[subject.THING_ACCELERATION] == pytest.approx(-4.0, abs=1e-6)
    assert thing[subject.THING_SIDEWAYS] == pytest.approx(-0.5, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_gap_and_speed_in_a_bend_are_those_along_the_lane(side: float) -> None:
    """The ego is still on the straight, the lead in the bend of 60 m that begins 10 m ahead."""
    segments = np.array([[0.0, 0.0, 0.0, 510.0, 0.0], [510.0, 0.0, 0.0, 150.0, side / 60.0]])
    things, view, here = nothing(), np.zeros(columns.VIEW_SIZE), pose()
    radius = 60.0 - side * LANE
    for tick in range(3):
        way = 40.0 + 12.0 * tick * PERIOD
        x, y, _ = position(segments, 510.0 + (way - 10.0) * 60.0 / radius, LANE)
        rows = np.array([[x - 500.0, y - LANE, 0.0, 0.0, 4.5, 1.8, 0.0]])
        subject.update_things(things, here, segments, LANE, np.ones(1, bool), rows, PERIOD)
    assert things[0, subject.THING_FORWARD] == pytest.approx(12.0, abs=1e-4)
    subject.look_at(RECORD, GROUND, things, 0, here, LANE, view)
    assert view[columns.GAP] == pytest.approx(way - 4.5, abs=1e-4)


def test_what_is_gone_is_forgotten() -> None:
    things = nothing()
    see(things, (30.0, 0.0))
    see(things)
    assert (things[:, subject.THING_HITS] == 0.0).all()


def test_objects_keep_their_rows_when_their_order_changes() -> None:
    things = nothing()
    see(things, (20.0, 3.5), (21.0, -3.5))
    # Both are taken to be as fast as the ego at first, a metre further on.
    see(things, (21.6, -3.5), (22.0, 3.5))
    assert things[0, subject.THING_S] == pytest.approx(522.0)
    assert things[1, subject.THING_S] == pytest.approx(521.6)


@pytest.mark.slow
def test_a_vehicle_ahead_hides_the_next_until_it_leaves() -> None:
    things, view = nothing(), np.zeros(columns.VIEW_SIZE)
    for _ in range(3):
        see(things, (20.0, 0.0), (60.0, 0.0))
        seen = [
            subject.look_at(RECORD, GROUND, things, row, pose(), LANE, view) for row in range(2)
        ]
    assert seen == [subject.VISIBLE, 0]
    for tick in range(1, 6):
        see(things, (20.0, 0.1 * tick), (60.0, 0.0))
        seen = [
            subject.look_at(RECORD, GROUND, things, row, pose(), LANE, view) for row in range(2)
        ]
        assert seen == [subject.VISIBLE, subject.VISIBLE if 0.1 * tick > 0.375 else 0]
    assert view[columns.CUE] == pytest.approx(0.5)
    assert view[columns.GAP] == pytest.approx(55.5)
    assert view[columns.LATERAL_GAP] == pytest.approx(-1.8)


def test_what_is_behind_is_not_looked_at() -> None:
    things, view = nothing(), np.zeros(columns.VIEW_SIZE)
    for _ in range(3):
        see(things, (-20.0, 0.0))
    row = int(np.argmin(np.abs(things[:, subject.THING_S] - 480.0)))
    assert subject.look_at(RECORD, GROUND, things, row, pose(), LANE, view) == subject.UNSEEN
