"""Where the safety channel plans to stop: which places it finds, and which it chooses."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.kernel import profiles, stops
from adeye.kernel.road import Ground
from adeye.signals import Floats
from adeye.simulate.channels.perception.pose import POSE_ALIGN
from adeye.simulate.channels.safety import planned_stop
from adeye.simulate.channels.trajectory.cost import Others
from tests.kernel.stop_limits import GROUND, limits
from tests.simulate.channels.trajectory.record import pose

SLOW, MIDDLE, HARD_SHOULDER = 1.75, 5.25, -1.25
TIMES = stops.STOP_INTERVAL * np.arange(1, stops.STOP_SAMPLES + 1)

Thing = tuple[float, float, float, float]
"""Place along and across [m], speed [m/s], acceleration until it stands [m/s²]."""


def predict(things: list[Thing]) -> Others:
    objects = np.zeros((len(things), profiles.OBJECT_ROW))
    ways = np.zeros((len(things), stops.STOP_SAMPLES, profiles.WAY_ROW))
    for row, (s, d, speed, braking) in enumerate(things):
        body, way = objects[row], ways[row]
        body[profiles.OBJECT_LENGTH], body[profiles.OBJECT_WIDTH] = 4.5, 1.8
        body[profiles.OBJECT_GROWTH] = 1.0
        body[profiles.OBJECT_COSINE], body[profiles.OBJECT_S], body[profiles.OBJECT_D] = 1.0, s, d
        body[profiles.OBJECT_SPEED], body[profiles.OBJECT_BEHIND] = speed, float(s <= -4.5)
        rolling = np.minimum(TIMES, speed / -braking) if braking < 0.0 else TIMES
        way[:, profiles.WAY_S] = s + (speed + 0.5 * braking * rolling) * rolling
        way[:, profiles.WAY_D] = d
        way[:, profiles.WAY_SPEED] = np.maximum(0.0, speed + braking * rolling)
    return Others(objects, ways)


def plan(
    things: list[Thing],
    *,
    d: float = SLOW,
    speed: float = 25.0,
    align: float = 0.0,
    ground: Ground = GROUND,
    places: int = stops.ANYWHERE,
    **changes: float,
) -> tuple[int, Floats]:
    record = limits(**changes)
    place = pose(d=d, speed=speed)
    place[POSE_ALIGN] = align
    found = np.zeros((stops.STOPS, planned_stop.FOUND_ROW))
    task = planned_stop.StopTask(
        record,
        np.array(stops.DEFAULT_RULES),
        ground,
        place,
        3.5 * math.floor(d / 3.5) + 1.75,
        predict(things),
        np.full(profiles.PATH_ROW, np.nan),
        np.zeros((stops.LAID_PATHS, profiles.PATH_ROW)),
        np.zeros((stops.LAID_PROFILES, stops.STOP_SAMPLES, profiles.PROFILE_ROW)),
        np.zeros((stops.STOP_SAMPLES, 2)),
        found,
    )
    chosen = planned_stop.plan_stop(task, places, 0.0, planned_stop.NO_STOP, False)  # noqa: FBT003 - a kernel
    return chosen, found


def number(path: int, level: int) -> int:
    return path * stops.STOP_LEVELS + level


def test_free_road_offers_the_shoulder_at_the_stop_deceleration() -> None:
    chosen, found = plan([])
    assert chosen == number(stops.SHOULDER, 1)
    assert found[chosen].tolist() == [1.0, 1.0, 0.0, 1.0, stops.ROADSIDE]


def test_blocked_shoulder_leaves_the_lane() -> None:
    chosen, found = plan([(s, HARD_SHOULDER, 0.0, 0.0) for s in range(20, 160, 10)])
    assert chosen == number(stops.IN_LANE, 1)
    assert not found[number(stops.SHOULDER, 0) :, planned_stop.FOUND_FEASIBLE].any()


def test_everything_blocked_is_infeasible_and_the_lowest_impact_is_taken() -> None:
    chosen, found = plan([(30.0, d, 0.0, 0.0) for d in (HARD_SHOULDER, SLOW, MIDDLE, 8.75)])
    assert not found[:, planned_stop.FOUND_FEASIBLE].any()
    assert chosen % stops.STOP_LEVELS == stops.STOP_LEVELS - 1
    assert found[chosen, planned_stop.FOUND_IMPACT] == found[:, planned_stop.FOUND_IMPACT].min()
    # 25.5 m of way at 8 m/s², less the lag of 0.15 s, the ramp and what passes in a sample.
    physics = math.sqrt(25.0**2 - 2.0 * 8.0 * (25.5 - 25.0 * 0.19))
    assert found[chosen, planned_stop.FOUND_IMPACT] == pytest.approx(physics, abs=0.2 * 8.0)


def test_standing_object_asks_for_a_harder_stop_only_where_it_is_near() -> None:
    shut = [(s, HARD_SHOULDER, 0.0, 0.0) for s in range(20, 160, 10)]
    levels = [plan([*shut, (s, SLOW, 0.0, 0.0)])[0] for s in (120.0, 80.0, 60.0)]
    assert levels == [number(stops.IN_LANE, level) for level in (1, 2, 3)]


def test_lead_that_brakes_is_predicted() -> None:
    """At 14 m and the same speed: one that goes on is no matter, one that brakes hard is."""
    shut = [(float(s), HARD_SHOULDER, 25.0, 0.0) for s in range(-4, 300, 10)]
    assert plan([*shut, (14.0, SLOW, 25.0, 0.0)])[0] == number(stops.IN_LANE, 1)
    braking = plan([*shut, (14.0, SLOW, 25.0, -7.0)])
    assert braking[0] == number(stops.IN_LANE, 3)
    assert not braking[1][number(stops.IN_LANE, 1), planned_stop.FOUND_FEASIBLE]


def test_who_follows_does_not_forbid_to_brake() -> None:
    chosen, found = plan([(-12.0, SLOW, 30.0, 0.0)])
    assert found[number(stops.IN_LANE, 1), planned_stop.FOUND_FEASIBLE] == 1.0
    assert chosen == number(stops.SHOULDER, 1)


def test_ego_that_points_off_the_road_does_not_stop_straight_on() -> None:
    _, found = plan([], align=-0.2)
    assert not found[
        number(stops.STRAIGHT, 0) : number(stops.STRAIGHT, 3) + 1, planned_stop.FOUND_FEASIBLE
    ].any()


def test_impact_is_the_speed_against_the_first_object() -> None:
    record = limits()
    path, profile = (
        np.zeros(profiles.PATH_ROW),
        np.zeros((stops.STOP_SAMPLES, profiles.PROFILE_ROW)),
    )
    profiles.lay_path(path, 0.0, SLOW, 0.0, 0.0, SLOW, 50.0)
    stops.fill_stop(20.0, 0.0, 2.4, 100.0, 0.0, profile)
    line = np.zeros((stops.STOP_SAMPLES, 2))

    def meet(*things: Thing) -> tuple[bool, float]:
        return planned_stop.meet_objects(record, path, 0.0, profile, predict(list(things)), line)

    far, slow = (60.0, SLOW, 0.0, 0.0), (40.0, SLOW, 5.0, 0.0)
    near, both = meet(far, slow)
    first, second = meet(far)[1], meet(slow)[1]
    assert near
    assert first == pytest.approx(math.sqrt(400.0 - 4.8 * 55.5), abs=0.6)
    assert both == pytest.approx(max(first, 0.0) if first == both else second)
    assert meet() == (False, 0.0)


def found_of(*rows: tuple[float, float, float]) -> Floats:
    """Return feasibility, rating and impact of the first stops; the others cannot be driven."""
    found = np.full((stops.STOPS, planned_stop.FOUND_ROW), math.inf)
    found[:, planned_stop.FOUND_FEASIBLE] = 0.0
    for row, (feasible, rating, impact) in enumerate(rows):
        found[row] = feasible, rating, impact, rating, stops.ANYWHERE
    return found


@pytest.mark.slow
def test_kept_stop_is_given_up_for_a_better_rating_or_once_it_is_infeasible() -> None:
    found = found_of((1.0, 3.0, 0.0), (1.0, 3.0, 0.0), (1.0, 1.0, 0.0))
    found[0, planned_stop.FOUND_COST] = 3.6
    assert planned_stop.choose_stop(found, planned_stop.NO_STOP, stops.ANYWHERE) == 2
    found[2, planned_stop.FOUND_FEASIBLE] = 0.0
    assert planned_stop.choose_stop(found, planned_stop.NO_STOP, stops.ANYWHERE) == 1
    assert planned_stop.choose_stop(found, 0, stops.ANYWHERE) == 0
    found[2, planned_stop.FOUND_FEASIBLE] = 1.0
    assert planned_stop.choose_stop(found, 0, stops.ANYWHERE) == 2
    found = found_of((0.0, 1.0, 9.0), (1.0, 5.0, 0.0))
    assert planned_stop.choose_stop(found, 0, stops.ANYWHERE) == 1


def test_least_harm_is_the_lowest_impact_then_the_lowest_rating() -> None:
    found = found_of(*((0.0, 5.0, 12.0),) * 3, (0.0, 5.0, 7.0), (0.0, 3.0, 7.0), (0.0, 1.0, 9.0))
    assert planned_stop.choose_stop(found, planned_stop.NO_STOP, stops.ANYWHERE) == 4
    assert planned_stop.choose_stop(found, 3, stops.ANYWHERE) == 3
    assert planned_stop.choose_stop(found, 5, stops.ANYWHERE) == 4
    assert found[4, planned_stop.FOUND_RATING] == 3.0


def bays(*rows: tuple[float, ...]) -> Ground:
    return GROUND._replace(refuges=np.array(rows))


BAY = bays((0.0, 200.0, 60.0, 4.0, 20.0))
REST = bays((0.0, 150.0, 60.0, 4.0, 20.0), (1.0, 280.0, 150.0, 8.0, 40.0))
BARE = GROUND._replace(shoulder=0.0)


def test_a_bay_ahead_is_preferred_to_the_shoulder() -> None:
    chosen, found = plan([], ground=BAY)
    assert chosen == number(stops.REFUGE, 1)
    assert found[chosen].tolist() == [1.0, 0.0, 0.0, 0.0, stops.ROADSIDE]


def test_a_bay_that_is_taken_leaves_the_shoulder() -> None:
    taken = plan([(s, -4.5, 0.0, 0.0) for s in (205.0, 230.0, 255.0)], ground=BAY)
    assert taken[0] == number(stops.SHOULDER, 1)
    assert not taken[1][number(stops.REFUGE, 0) :, planned_stop.FOUND_FEASIBLE].any()


def test_a_bay_is_entered_where_it_is_neither_too_near_nor_too_far() -> None:
    near, far = (bays((0.0, s, 60.0, 4.0, 20.0)) for s in (60.0, 700.0))
    assert plan([], ground=near, speed=33.0)[0] == number(stops.SHOULDER, 1)
    assert plan([], ground=near, speed=15.0)[0] == number(stops.REFUGE, 1)
    assert plan([], ground=far)[0] == number(stops.SHOULDER, 1)
    # Without a shoulder it is entered over its taper.
    chosen, found = plan([], ground=BAY._replace(shoulder=0.0))
    assert chosen // stops.STOP_LEVELS == stops.REFUGE
    assert found[chosen, planned_stop.FOUND_RATING] == 0.0


def test_places_are_what_is_asked_for_or_nothing() -> None:
    assert plan([], ground=REST, places=stops.ROADSIDE)[0] == number(stops.REFUGE, 1)
    chosen, found = plan([], ground=REST, places=stops.ONLY_REST_AREA)
    assert chosen == number(stops.REFUGE, 1)
    assert found[chosen, planned_stop.FOUND_PLACE] == stops.ONLY_REST_AREA
    assert plan([], ground=BAY, places=stops.ONLY_REST_AREA)[0] == planned_stop.NO_STOP
    assert plan([], places=stops.ROADSIDE)[0] == number(stops.SHOULDER, 1)
    assert plan([], places=stops.ROADSIDE, ground=BARE)[0] == planned_stop.NO_STOP
    assert plan([], places=stops.ANYWHERE, ground=BARE)[0] == number(stops.IN_LANE, 1)


def test_a_rest_area_on_the_other_side_of_a_lane_needs_sight_to_the_rear() -> None:
    assert plan([], d=MIDDLE, ground=BAY)[0] == number(stops.IN_LANE, 1)
    assert plan([], d=MIDDLE, ground=BAY, rear_sight=500.0)[0] // stops.STOP_LEVELS == stops.REFUGE
    taken = plan([(-40.0, SLOW, 33.0, 0.0)], d=MIDDLE, ground=BAY, rear_sight=500.0)
    assert taken[0] == number(stops.IN_LANE, 1)


# A stop may enter or cross a lane only where nobody from behind is cut up.


def test_straight_on_leads_into_another_lane_only_where_that_is_seen_to_be_free() -> None:
    """From the middle lane towards the left one: also once the side is over the edge."""
    # The gentle one leads off the road.
    straight = slice(number(stops.STRAIGHT, 1), number(stops.STRAIGHT, 3) + 1)

    def feasible(things: list[Thing], **changes: Any) -> list[float]:
        found: list[float] = plan(things, **changes)[1][
            straight, planned_stop.FOUND_FEASIBLE
        ].tolist()
        return found

    left, right = (-20.0, 8.75, 30.0, 0.0), (-20.0, SLOW, 30.0, 0.0)
    for place in (MIDDLE, MIDDLE + 1.2):
        turned = {"d": place, "align": 0.03}
        assert feasible([], **turned) == [0.0] * 3
        assert feasible([], **turned, rear_sight=500.0) == [1.0] * 3
        assert feasible([left], **turned, rear_sight=500.0) == [0.0] * 3
        assert feasible([right], **turned, rear_sight=500.0) == [1.0] * 3
    assert feasible([], d=MIDDLE) == [1.0] * 3


def test_path_aside_is_feasible_only_where_nobody_comes_along_it() -> None:
    across = number(stops.SHOULDER, 1)
    scenes: list[tuple[list[Thing], dict[str, Any], float]] = [
        ([], {"d": MIDDLE}, 0.0),
        ([], {"d": MIDDLE, "rear_sight": 500.0}, 1.0),
        ([(-20.0, SLOW, 33.0, 0.0)], {"d": MIDDLE, "rear_sight": 500.0}, 0.0),
        ([(-20.0, 8.75, 33.0, 0.0)], {"d": MIDDLE, "rear_sight": 500.0}, 1.0),
        # From the slow lane onto the shoulder.
        ([(-20.0, HARD_SHOULDER, 30.0, 0.0)], {}, 0.0),
        ([(-300.0, HARD_SHOULDER, 10.0, 0.0)], {}, 1.0),
    ]
    for things, more, is_free in scenes:
        _, found = plan(things, **more)
        assert found[across, planned_stop.FOUND_FEASIBLE] == is_free, (things, more)
