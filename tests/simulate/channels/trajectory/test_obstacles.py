"""What candidates cost for the objects around them: predicted, near, touched, cut up."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.kernel import profiles
from adeye.kernel.jit import compiled
from adeye.signals import OBJECT_CLASSES, Floats
from adeye.simulate.channels.perception import tracks as kept
from adeye.simulate.channels.perception.step import Seen
from adeye.simulate.channels.trajectory import cost as subject
from tests.kernel.stop_limits import GROUND
from tests.simulate.channels.perceived import perceived
from tests.simulate.channels.trajectory.record import LANE, pose, record

INTERVAL = 0.25
TIMES = INTERVAL * np.arange(1, subject.SAMPLES + 1)


def thing(s: float, d: float, speed: float, *, heading: float = 0.0) -> tuple[Floats, Floats]:
    """Return a car and its way at constant speed."""
    body, way = np.zeros(profiles.OBJECT_ROW), np.zeros((subject.SAMPLES, profiles.WAY_ROW))
    body[profiles.OBJECT_LENGTH], body[profiles.OBJECT_WIDTH] = 4.5, 1.8
    body[profiles.OBJECT_GROWTH] = 1.0
    body[profiles.OBJECT_SINE], body[profiles.OBJECT_COSINE] = math.sin(heading), math.cos(heading)
    body[profiles.OBJECT_S], body[profiles.OBJECT_D], body[profiles.OBJECT_SPEED] = s, d, speed
    body[profiles.OBJECT_BEHIND] = float(s <= -4.5)
    way[:, profiles.WAY_S] = s + speed * TIMES
    way[:, profiles.WAY_D], way[:, profiles.WAY_SPEED] = d, speed
    return body, way


def others(*items: tuple[Floats, Floats]) -> subject.Others:
    """Return things as the predicted objects."""
    objects = np.array([body for body, _ in items]).reshape(-1, profiles.OBJECT_ROW)
    return subject.Others(
        objects, np.array([way for _, way in items]).reshape(-1, subject.SAMPLES, profiles.WAY_ROW)
    )


def cost(
    item: tuple[Floats, Floats],
    *,
    wanted: float = 0.0,
    target: float = LANE,
    leaving: bool = False,
    speed: float = 30.0,
    sample: int | None = None,
) -> float:
    limits, window = record(), np.zeros((1, 2), dtype=np.int64)
    path, line = np.zeros(profiles.PATH_ROW), np.zeros((subject.SAMPLES, subject.LINE_ROW))
    profile = np.zeros((subject.SAMPLES, profiles.PROFILE_ROW))
    profiles.fill_profile(speed, wanted, wanted, 25.0, INTERVAL, 0.0, profile)
    profiles.lay_path(path, 0.0, LANE, 0.0, 0.0, target, 68.0)
    subject.drive_line(limits, path, profile, 0.0, 0.0, -9.0, 99.0, True, line)  # noqa: FBT003
    body, way = item
    subject.mark_interest(limits, profile, others(item), window)
    if window[0, 0] >= window[0, 1]:
        return 0.0
    if sample is not None:
        window[0] = sample, sample + 1
    return subject.object_cost(limits, profile, line, body, way, window[0], leaving)


def test_far_away_beside_and_behind_cost_nothing() -> None:
    for place in (
        (400.0, LANE, 30.0),
        (0.0, LANE + 3.5, 30.0),
        (60.0, LANE - 3.5, 10.0),
        (-6.0, LANE, 60.0),
    ):
        assert cost(thing(*place)) == 0.0, place


def test_distance_that_is_kept_costs_nothing_and_a_shorter_one_more_and_more() -> None:
    gaps = [4.0 + 1.8 * 30.0 + 4.5 + 0.1, 50.0, 30.0, 20.0]
    costs = [cost(thing(gap, LANE, 30.0)) for gap in gaps]
    assert costs[0] == 0.0
    assert costs == sorted(costs)
    assert 0.0 < costs[1] < costs[3] < 50.0


@pytest.mark.slow
def test_collision_dominates_and_is_worse_the_sooner_and_the_harder_it_is() -> None:
    assert cost(thing(60.0, LANE, 0.0)) > 1000.0
    assert cost(thing(35.0, LANE, 10.0)) > cost(thing(75.0, LANE, 10.0)) > 200.0
    assert cost(thing(60.0, LANE, 0.0), wanted=-3.0) > cost(thing(60.0, LANE, 0.0), wanted=-8.0)


def test_collision_at_the_end_of_the_horizon_costs_a_fifth_of_one_now() -> None:
    # The ego's middle is ahead of the other's all the way, so there is no distance to keep.
    touching = thing(-1.0, LANE, 30.0)
    costs = [cost(touching, sample=sample) for sample in range(subject.SAMPLES)]
    shares = 1.0 - 0.8 * TIMES / TIMES[-1]
    assert costs == pytest.approx(float(record()["weight_collision"]) * shares)


def test_lane_is_never_left_into_somebody() -> None:
    neighbour = thing(2.0, LANE + 3.5, 30.0)
    assert cost(neighbour, target=LANE + 3.5, leaving=True) == math.inf
    assert 100.0 < cost(neighbour, target=LANE + 3.5) < math.inf


def test_overlap_falls_from_contact_to_the_margin_of_what_is_met_in_the_meantime() -> None:
    straight, _ = thing(0.0, LANE, 30.0)
    turned, _ = thing(0.0, LANE, 30.0, heading=0.3)
    for along, across, body, way, expected in (
        (0.0, 1.7, straight, 0.0, 1.0),
        (4.4, 0.0, straight, 0.0, 1.0),
        (0.0, 1.9, straight, 0.0, 0.75),
        (0.0, 2.05, straight, 0.0, 0.375),
        (0.0, 2.3, straight, 0.0, 0.0),
        # What passes between two samples is met.
        (6.0, 0.0, straight, 0.0, 0.0),
        (6.0, 0.0, straight, 7.5, 1.0),
    ):
        found = subject.overlap(record(), along, across, 0.0, body, way, 0.4)
        assert found == pytest.approx(expected), (along, across, way)
    # A turned body reaches further.
    assert subject.overlap(record(), 0.0, 2.3, 0.0, turned, 0.0, 0.4) > 0.5


def test_critical_distance_is_that_of_the_regulation() -> None:
    # 130 km/h behind 100 km/h: closing 8.33 m/s for 0.4 s, then braking with 3 m/s², then 1 s.
    closing = 30.0 / 3.6
    wanted = closing * 0.4 + closing**2 / 6.0 + 100.0 / 3.6
    assert subject.critical_distance(record(), 130.0 / 3.6, 100.0 / 3.6) == pytest.approx(wanted)
    assert subject.critical_distance(record(), 20.0, 30.0) == 30.0


def cut_up(*items: Any, d: float = LANE, is_lane: bool = True, **more: float) -> bool:
    limits = record(**({"rear_sight": 100.0} | more))
    return subject.is_cut_up(limits, GROUND, (0.0, d), LANE + 3.5, is_lane, 30.0, others(*items))


def test_follower_is_cut_up_if_it_would_have_to_brake_too_hard() -> None:
    assert cut_up(thing(-40.0, LANE + 3.5, 40.0))
    assert not cut_up(thing(-90.0, LANE + 3.5, 40.0))
    assert not cut_up(thing(-40.0, LANE + 3.5, 30.0))
    # Nobody is in an empty lane, unless it is not seen; nobody asks once the ego is in the lane.
    assert not cut_up()
    assert not cut_up(thing(-30.0, LANE, 40.0))
    assert cut_up(rear_sight=0.0)
    assert cut_up(rear_sight=30.0)
    assert not cut_up(rear_sight=0.0, is_lane=False)
    assert not cut_up(thing(-10.0, LANE + 3.5, 60.0), d=LANE + 1.5)


def track(x: float, y: float, vx: float, vy: float = 0.0, **more: float) -> Floats:
    made = np.zeros(kept.TRACK_STATE)
    made[kept.TRACK_X], made[kept.TRACK_Y], made[kept.TRACK_VX], made[kept.TRACK_VY] = x, y, vx, vy
    made[kept.TRACK_LENGTH], made[kept.TRACK_WIDTH] = 4.5, 1.8
    made[kept.TRACK_HITS] = more.get("hits", 5.0)
    made[kept.TRACK_VAR_VX] = more.get("var_vx", 0.1)
    made[kept.TRACK_VAR_VY] = more.get("var_vy", 0.01)
    made[kept.TRACK_BRAKING] = more.get("braking", 0.0)
    made[kept.TRACK_CLASS] = more.get("kind", 0.0)
    return made


def predicted(*tracks: Floats) -> tuple[int, Floats, Floats]:
    room = subject.Others(
        np.zeros((8, profiles.OBJECT_ROW)), np.zeros((8, subject.SAMPLES, profiles.WAY_ROW))
    )
    seen = perceived({"length": 4.5, "confirm_hits": 3.0}, pose(), np.array(tracks))
    return _predicted(seen, INTERVAL, room), room.objects, room.ways


@compiled
def _predicted(seen: Seen, interval: float, room: subject.Others) -> int:
    """Count the objects: outside of compiled code, a part of an array comes back whole."""
    return int(subject.predict_objects(seen, 0, interval, room).objects.shape[0])


def test_objects_go_on_as_their_tracks_say() -> None:
    pedestrian = float(OBJECT_CLASSES.index("pedestrian"))
    beside, brakes = LANE + 3.5, np.minimum(TIMES, 2.0)
    for item, along, across in (
        # In its lane at its speed, even if it sways.
        (track(40.0, 3.5, 25.0), 40.0 + 25.0 * TIMES, beside),
        (track(40.0, 3.5, 25.0, -0.25), 40.0 + 25.0 * TIMES, beside),
        (track(40.0, 3.5, 25.0, -0.8, var_vy=0.49), 40.0 + 25.0 * TIMES, beside),
        # To the end of its lane change; across all lanes, who walks; to its standstill.
        (track(40.0, 3.3, 25.0, -1.0), 40.0 + 25.0 * TIMES, np.maximum(LANE, LANE + 3.3 - TIMES)),
        (track(40.0, -6.0, 0.0, 2.0, kind=pedestrian), 40.0, LANE - 6.0 + 2.0 * TIMES),
        (track(40.0, 0.0, 12.0, braking=-6.0), 40.0 + 12.0 * brakes - 3.0 * brakes**2, LANE),
    ):
        _, objects, ways = predicted(item)
        assert objects[0, profiles.OBJECT_S] == 40.0
        assert ways[0, :, profiles.WAY_S] == pytest.approx(along)
        assert ways[0, :, profiles.WAY_D] == pytest.approx(across)


def test_track_that_is_not_sure_yet_is_left_out() -> None:
    count, _, _ = predicted(track(40.0, 0.0, 0.0, hits=2.0), track(40.0, 0.0, 0.0, var_vx=100.0))
    assert count == 0


@pytest.mark.slow
def test_only_what_is_all_behind_the_ego_is_behind() -> None:
    _, objects, _ = predicted(track(-4.0, 3.5, 30.0), track(-5.0, 3.5, 30.0))
    assert objects[:2, profiles.OBJECT_BEHIND].tolist() == [0.0, 1.0]


def profile(speed: float, wanted: float) -> Floats:
    made = np.zeros((subject.SAMPLES, profiles.PROFILE_ROW))
    profiles.fill_profile(speed, wanted, wanted, 25.0, 0.25, 0.0, made)
    return made


def cost_scoring(speed: float, wanted: float, previous: float = 0.0) -> float:
    return subject.profile_cost(record(), profile(speed, wanted), wanted, previous, speed, 30.0)


def test_rounded_square_is_smooth_at_its_knee() -> None:
    knee, step = 0.4, 1e-6
    far, near, beyond, further = (
        subject.rounded_square(knee + n * step, knee) for n in (-2, -1, 1, 2)
    )
    assert near == pytest.approx(beyond, abs=3.0 * step)
    assert (near - far) / step == pytest.approx((further - beyond) / step, rel=1e-3)


def test_nothing_costs_less_than_driving_at_the_allowed_speed_as_before() -> None:
    assert cost_scoring(30.0, 0.0) == 0.0
    assert cost_scoring(30.0, 0.2) > 0.0
    assert cost_scoring(30.0, -0.2) > 0.0
    # A slow ego gains by accelerating and a fast one by braking.
    assert cost_scoring(20.0, 0.5) < cost_scoring(20.0, 0.0)
    assert cost_scoring(34.0, -0.5) < cost_scoring(34.0, 0.0)
    # Becoming faster than allowed is worse than hard braking.
    assert cost_scoring(30.0, 1.5) > cost_scoring(30.0, -8.0)
    assert cost_scoring(20.0, 1.0, previous=1.0) < cost_scoring(20.0, 1.0, previous=0.0)


def driven(target: float, length: float, wanted: float, **more: float) -> tuple[float, Floats]:
    path, line = np.zeros(profiles.PATH_ROW), np.zeros((subject.SAMPLES, subject.LINE_ROW))
    profiles.lay_path(path, 0.0, LANE, 0.0, 0.0, target, length)
    found = subject.drive_line(
        record(),
        path,
        profile(30.0, wanted),
        0.0,
        more.get("curvature", 0.0),
        -1.6,
        9.6,
        more.get("last", 0.0) > 0.0,
        line,
    )
    return found, line


def test_quick_lane_change_costs_more_than_a_calm_one_and_beyond_the_limits_all() -> None:
    assert 0.0 < driven(LANE + 3.5, 120.0, 0.0)[0] < driven(LANE + 3.5, 70.0, 0.0)[0] < math.inf
    assert driven(LANE + 3.5, 45.0, 0.0)[0] == math.inf
    # Braking leaves less for the way aside.
    assert driven(LANE + 3.5, 68.0, 0.0)[0] < math.inf
    assert driven(LANE + 3.5, 68.0, -7.0)[0] == math.inf
    # Places off the road are forbidden.
    for target in (-3.0, 11.0):
        assert driven(target, 110.0, 0.0)[0] == math.inf


def test_last_resort_is_never_forbidden() -> None:
    found, line = driven(LANE, 60.0, -8.0, curvature=0.003, last=1.0)
    assert found < math.inf
    assert (line[:, subject.LINE_D] == LANE).all()
    assert driven(LANE, 60.0, -8.0, curvature=0.003)[0] == math.inf
