"""Contact is swept: nothing passes through, and its speed is the relative one."""

import numpy as np
import pytest

from adeye.signals import Floats
from adeye.simulate.traffic.stage import contact_share, speed_between, sweep_contacts

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
    touched, impact = np.full(1, -1, dtype=np.int64), np.zeros(1)
    foreign = np.zeros(1, dtype=np.bool_)
    sweep_contacts(
        np.array([running]),
        ego[0][np.newaxis],
        np.stack([thing[0] for thing in objects])[np.newaxis],
        ego[1][np.newaxis],
        np.stack([thing[1] for thing in objects])[np.newaxis],
        CAR[np.newaxis],
        np.stack([thing[2] for thing in objects])[np.newaxis],
        len(objects) if actors is None else actors,
        np.zeros((3, len(objects))),
        touched,
        impact,
        foreign,
    )
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
