"""Contact is swept: nothing passes through, and its speed is the relative one."""

import math
from typing import Any

import numpy as np
import pytest
from highway_env.utils import are_polygons_intersecting

from adeye.kernel.traffic import network as n
from adeye.kernel.traffic.drivers import MANY
from adeye.signals import Floats
from adeye.simulate.traffic.stage import contact_share, speed_between, sweep_contacts
from benchmarks.support import crash as k
from benchmarks.support.highway_scenes import STEP, Draw, convert, scene

CAR = np.array([4.5, 1.8, 1.5])
WALKER = np.array([0.5, 0.6, 1.75])


def state(x: float, y: float = 0.0, heading: float = 0.0, speed: float = 0.0) -> Floats:
    return np.array([x, y, heading, speed, 0.0])


def sweep(
    ego: tuple[Floats, Floats],
    objects: list[tuple[Floats, Floats, Floats]],
    *,
    actors: int | None = None,
    running: bool = True,
) -> tuple[int, float, bool]:
    count = len(objects)
    befores, afters, sizes = (np.stack(rows)[np.newaxis] for rows in zip(*objects, strict=True))
    before, after = (state[np.newaxis] for state in ego)
    touched, impact, foreign = np.full(1, -1), np.zeros(1), np.zeros(1, dtype=np.bool_)
    ways = before, befores, after, afters, CAR[np.newaxis], sizes
    scratch, bodies = np.zeros((3, count)), count if actors is None else actors
    sweep_contacts(np.array([running]), *ways, bodies, scratch, touched, impact, foreign)
    return int(touched[0]), float(impact[0]), bool(foreign[0])


@pytest.mark.slow
def test_sixty_metres_a_second_do_not_tunnel_through_a_pedestrian() -> None:
    step = 0.1
    before, after = state(0.0, speed=60.0), state(60.0 * step, speed=60.0)
    # The pedestrian stands where neither end pose of the tick touches it.
    walker = state(3.0, speed=0.0)
    narrow = np.array([0.5, 0.6, 1.75])
    assert before[0] + 0.25 < walker[0] - 0.25
    share = contact_share(before, after, narrow, walker, walker, narrow)
    assert share == pytest.approx((3.0 - 0.5) / 6.0)


def test_head_on_cars_meet_with_the_sum_of_their_speeds() -> None:
    ego = (state(0.0, speed=30.0), state(1.5, speed=30.0))
    other = (state(6.0, heading=np.pi, speed=30.0), state(4.5, heading=np.pi, speed=30.0), CAR)
    touched, impact, _ = sweep(ego, [other])
    assert touched == 0
    assert impact == pytest.approx(60.0)


@pytest.mark.slow
def test_impact_speed_is_taken_at_the_time_of_contact() -> None:
    # Braking evenly from 10 to 0 m/s in the tick; half-way it touches a standing car.
    share = 0.5
    wall = state(9.0)
    speed = speed_between(state(0.0, speed=10.0), state(1.0), wall, wall, share)
    assert speed == pytest.approx(5.0)


def test_of_two_contacts_in_a_tick_the_earlier_counts() -> None:
    ego = (state(0.0, speed=60.0), state(6.0, speed=60.0))
    far, near = state(9.0), state(6.5)
    touched, _, _ = sweep(ego, [(far, far, CAR), (near, near, WALKER)])
    assert touched == 1


def test_a_crossing_pedestrian_is_hit_from_the_side() -> None:
    ego = (state(0.0, speed=20.0), state(1.0, speed=20.0))
    walker = (state(2.6, -1.0, np.pi / 2, 1.5), state(2.6, -0.9, np.pi / 2, 1.5), WALKER)
    touched, impact, _ = sweep(ego, [walker])
    assert touched == 0
    assert impact == pytest.approx(np.hypot(20.0, 1.5))


def test_passing_beside_is_no_contact() -> None:
    ego = (state(0.0, speed=60.0), state(6.0, speed=60.0))
    beside = state(3.0, 1.9)
    assert sweep(ego, [(beside, beside, CAR)]) == (-1, 0.0, False)


def test_actors_that_touch_are_a_foreign_contact_and_leave_the_ego_alone() -> None:
    ego = (state(-50.0), state(-50.0))
    one, two = state(0.0), state(4.0)
    # Two actors, an actor and a static object, and static objects, which may overlap.
    for actors, is_foreign in ((2, True), (1, True), (0, False)):
        found = sweep(ego, [(one, one, CAR), (two, two, CAR)], actors=actors)
        assert found == (-1, 0.0, is_foreign)


def test_a_state_that_is_not_a_number_counts_as_contact() -> None:
    ego = (state(np.nan), state(np.nan))
    far = state(500.0)
    assert sweep(ego, [(far, far, CAR)])[0] == 0


def test_a_run_that_has_ended_finds_nothing() -> None:
    ego = (state(0.0), state(0.0))
    assert sweep(ego, [(state(1.0), state(1.0), CAR)], running=False) == (-1, 0.0, False)


def test_actors_in_a_queue_touch_nobody_until_two_of_them_do() -> None:
    ego = state(-100.0)
    queue = [state(10.0 * k, 0.2 * k, 0.1) for k in range(6)]
    objects = [(one, one, CAR) for one in queue]
    assert sweep((ego, ego), objects) == (-1, 0.0, False)
    pushed = state(34.0, 0.8, 0.1, 20.0)
    objects[4] = (queue[4], pushed, CAR)
    assert sweep((ego, ego), objects) == (-1, 0.0, True)


def test_nobody_knows_that_an_actor_at_an_unknown_place_touches_nobody() -> None:
    ego, lost = state(-100.0), state(float("nan"))
    objects = [(state(0.0), state(0.0), CAR), (lost, lost, CAR)]
    assert sweep((ego, ego), objects) == (1, 0.0, True)


# --- Touching boxes: highway-env's answer for pairs, and the same one from both broad phases ------

SIZE = (5.0, 2.0)


def box(x: float, y: float, heading: float) -> Floats:
    """(4, 2) corners of a car."""
    length, width = SIZE
    along = np.array([-length, -length, length, length]) / 2.0
    across = np.array([width, -width, -width, width]) / 2.0
    cosine, sine = math.cos(heading), math.sin(heading)
    return np.column_stack([x + cosine * along - sine * across, y + sine * along + cosine * across])


def pushed(first: Floats, second: Floats, way: tuple[float, float]) -> tuple[Any, ...]:
    return k.separating_push(np.vstack([first, second]), *way)


def test_what_two_boxes_do_is_highway_env_s_answer() -> None:
    draw = Draw(9)
    answers = set()
    for _ in range(300):
        first = box(0.0, 0.0, draw.between(-3.0, 3.0))
        second = box(draw.between(-7, 7), draw.between(-7, 7), draw.between(-3, 3))
        way = np.array([draw.between(-2, 2), draw.between(-2, 2)])
        touch, will_touch, push = are_polygons_intersecting(
            np.vstack([first, first[:1]]), np.vstack([second, second[:1]]), way, np.zeros(2)
        )
        found = pushed(first, second, (way[0], way[1]))
        assert found[:2] == (touch, will_touch)
        assert found[2:] == pytest.approx((0.0, 0.0) if push is None else tuple(push), abs=1e-12)
        answers.add((bool(touch), bool(will_touch)))
    assert len(answers) >= 3


def by_looking_at_all(ours: Any) -> Floats:
    """Touch everybody with everybody, pair by pair, as two at a time."""
    vehicles, marks = ours.vehicles, ours.marks
    bodies, _, corners = ours.bodies
    for first in range(len(vehicles)):
        for second in range(first + 1, len(vehicles)):
            if marks[first, n.ROLE] != n.FIXED and k._are_near(
                vehicles, bodies, first, second, STEP
            ):
                k._collide_pair(vehicles, marks, bodies, corners, first, second, STEP)
    return np.array(bodies)


@pytest.mark.slow
@pytest.mark.parametrize("vehicles", [6, 20])
@pytest.mark.parametrize("kind", ["straight", "intersection"])
def test_culled_pairs_touch_as_all_pairs_do_to_the_bit(kind: str, vehicles: int) -> None:
    crashes = 0
    for seed in range(80 // vehicles):
        road = scene(kind, 80 + seed, vehicles)
        ours, naive = convert(road), convert(road)
        assert (len(ours.vehicles) >= MANY) == (vehicles == 20)
        # Closer together, so that many touch, more than two at a time.
        for side in (ours, naive):
            centre = side.vehicles[:, :2].mean(axis=0)
            side.vehicles[:, :2] = centre + 0.15 * (side.vehicles[:, :2] - centre)
        expected = by_looking_at_all(naive)
        bodies, pairs, corners = ours.bodies
        k.collide(ours.vehicles, ours.marks, bodies, pairs, corners, STEP)
        np.testing.assert_array_equal(bodies, expected)
        np.testing.assert_array_equal(ours.marks[:, n.CRASHED], naive.marks[:, n.CRASHED])
        crashes += int(ours.marks[:, n.CRASHED].sum())
    assert crashes > 10
