"""The library of stops: their ways and limits, ratings of places, and stops in bays."""

import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pytest

from adeye.kernel import profiles, stops
from adeye.kernel.road import NO_REFUGE, PARKING_BAY, REST_AREA, Ground, body_edge, curvature_at
from adeye.signals import Floats
from adeye.spec.channels import StopRatings
from tests.kernel.stop_limits import GROUND, body

RECORD = body()
RULES = np.array(stops.DEFAULT_RULES)


def stop(
    speed: float, deceleration: float, *, jerk: float = stops.ONSET_JERK, wait: float = 0.0
) -> Floats:
    profile = np.zeros((stops.STOP_SAMPLES, profiles.PROFILE_ROW))
    stops.fill_stop(speed, 0.0, deceleration, jerk, wait, profile)
    return profile


def paths(
    d: float, speed: float, *, lane: int, curvature: float = 0.0, slope: float = 0.0, **more: Any
) -> Floats:
    made = np.zeros((stops.LAID_PATHS, profiles.PATH_ROW))
    driven, middle = np.full(profiles.PATH_ROW, np.nan), 3.5 * (lane + 0.5)
    ground = GROUND._replace(**more)
    stops.lay_stops(RECORD, ground, 0.0, d, slope, 0.0, speed, middle, curvature, driven, made)
    return made


@pytest.mark.parametrize(
    ("kmh", "way"), [(60.0, 34.7), (80.0, 61.7), (100.0, 96.5), (130.0, 163.0)]
)
def test_stop_at_4_mps2_takes_the_way_of_the_closed_form(kmh: float, way: float) -> None:
    speed = kmh / 3.6
    assert speed * speed / 8.0 == pytest.approx(way, abs=0.05)
    # Ramp of t = a / j: the speed falls by a t / 2, the way is v t - a t² / 6.
    ramp = 4.0 / stops.ONSET_JERK
    later = speed - 2.0 * ramp
    exact = speed * ramp - 4.0 * ramp * ramp / 6.0 + later * later / 8.0
    assert stop(speed, 4.0)[-1, profiles.PROFILE_S] == pytest.approx(exact, rel=1e-12)
    assert stop(speed, 4.0, jerk=1e9)[-1, profiles.PROFILE_S] == pytest.approx(way, abs=0.05)


def test_way_while_waiting_is_added() -> None:
    way = stop(25.0, 4.0)[-1, profiles.PROFILE_S]
    for wait in (0.0, 0.1, 0.3, 0.5):
        ways = stop(25.0, 4.0, wait=wait)[:, profiles.PROFILE_S]
        assert ways[-1] - way == pytest.approx(25.0 * wait)
        assert (np.diff(ways) >= 0.0).all()
        assert ways[0] <= 25.0 * stops.STOP_INTERVAL + 1e-9


def test_who_stands_while_waiting_stays() -> None:
    profile = np.zeros((stops.STOP_SAMPLES, profiles.PROFILE_ROW))
    stops.fill_stop(0.4, -4.0, 4.0, stops.ONSET_JERK, 0.5, profile)
    assert profile[:, profiles.PROFILE_S] == pytest.approx(0.4 * 0.4 / 8.0)
    assert stops.stands_at(profile) == 0


def test_levels_rise_from_gentle_to_emergency() -> None:
    assert [stops.stop_level(RECORD, level) for level in range(stops.STOP_LEVELS)] == [
        2.4,
        4.0,
        6.0,
        8.0,
    ]
    assert [stops.stop_jerk(level) > 20.0 for level in range(stops.STOP_LEVELS)] == [
        False,
        False,
        True,
        True,
    ]


def test_gentlest_stop_from_130_kmh_stands_within_the_horizon() -> None:
    assert stops.stands_at(stop(130.0 / 3.6, 2.4)) < stops.STOP_SAMPLES
    assert stops.stands_at(stop(60.0, 2.4)) == stops.STOP_SAMPLES


@pytest.mark.slow
@pytest.mark.parametrize("speed", [3.0, 8.0, 15.0, 25.0, 36.1])
@pytest.mark.parametrize("level", range(stops.STOP_LEVELS))
def test_no_stop_to_the_side_leaves_its_lateral_limits(speed: float, level: int) -> None:
    """At ten times as many places as the planner looks at."""
    acceleration = stops.stop_level(RECORD, level)
    for row in (stops.IN_LANE, stops.RIGHT_LANE, stops.SHOULDER):
        path = paths(5.5, speed, lane=1)[row]
        for share in np.linspace(0.0, 1.0, 800, endpoint=False):
            now = speed * math.sqrt(1.0 - share)
            way = share * speed * speed / (2.0 * acceleration)
            aside, jerk = stops.lateral_movement(path, way, now, -acceleration)
            assert abs(aside) <= stops.LATERAL_ACCELERATION
            assert abs(jerk) <= stops.LATERAL_JERK
        assert stops.fits_limits(RECORD, GROUND, path, 0.0, stop(speed, acceleration), 5.5)


def test_turned_hard_aside_no_stop_to_the_shoulder_is_within_the_limits() -> None:
    path = paths(1.75, 25.0, lane=0, slope=0.3)[stops.SHOULDER]
    assert not stops.fits_limits(RECORD, GROUND, path, 0.0, stop(25.0, 4.0), 1.75)


def test_shoulder_and_right_lane_are_where_they_are() -> None:
    made = paths(5.25, 20.0, lane=1)
    assert made[stops.SHOULDER, profiles.PATH_TARGET] == -1.25
    assert made[stops.RIGHT_LANE, profiles.PATH_TARGET] == 1.75
    assert paths(1.75, 20.0, lane=0)[stops.RIGHT_LANE, profiles.PATH_EXISTS] == 0.0


def test_narrow_shoulder_is_none() -> None:
    made = paths(1.75, 20.0, lane=0, shoulder=1.5)
    there = made[: stops.REFUGE, profiles.PATH_EXISTS]
    assert there.tolist() == [1.0, 1.0, 0.0, 0.0]


def test_in_a_curve_the_lane_is_followed_and_straight_on_leaves_the_road() -> None:
    made = paths(1.75, 30.0, lane=0, curvature=1.0 / 300.0)
    assert profiles.at_path(made[stops.IN_LANE], 100.0)[0] == pytest.approx(1.75)
    assert profiles.at_path(made[stops.STRAIGHT], 60.0)[0] == pytest.approx(1.75 - 60.0**2 / 600.0)
    profile = stop(30.0, 4.0)
    assert stops.fits_limits(RECORD, GROUND, made[stops.IN_LANE], 0.0, profile, 1.75)
    assert not stops.fits_limits(RECORD, GROUND, made[stops.STRAIGHT], 0.0, profile, 1.75)


def rated(path: Floats, profile: Floats) -> float:
    return stops.rate_stop(RECORD, RULES, GROUND, 0.0, path, profile)


def test_ends_are_rated_by_their_place() -> None:
    profile, slow, middle = stop(20.0, 2.4), paths(1.75, 20.0, lane=0), paths(5.25, 20.0, lane=1)
    rows = (stops.IN_LANE, stops.STRAIGHT, stops.SHOULDER)
    assert [rated(slow[row], profile) for row in rows] == [3.0, 3.0, 1.0]
    assert rated(middle[stops.IN_LANE], profile) == 5.0


def test_stop_that_ends_half_way_to_the_shoulder_is_rated_by_the_lane() -> None:
    path, hard = paths(1.75, 30.0, lane=0)[stops.SHOULDER], stop(30.0, 8.0, jerk=100.0)
    d = profiles.at_path(path, hard[-1, profiles.PROFILE_S])[0]
    assert -1.0 < d < 1.0
    assert stops.rate_stop(RECORD, RULES, GROUND, 0.0, path, hard) == 3.0


def test_speed_falls_and_the_way_ends_with_it() -> None:
    profile = stop(20.0, 6.0)
    assert all(later <= sooner for sooner, later in pairwise(profile[:, profiles.PROFILE_SPEED]))
    first = stops.stands_at(profile)
    assert (profile[first:, profiles.PROFILE_S] == profile[first, profiles.PROFILE_S]).all()


# --- Ratings of places to stop at: lanes, shoulders, curves, refuges and verges -------------------

LIMIT = 130.0 / 3.6
BENT = np.array([[0.0, 0.0, 0.0, 500.0, 0.0], [500.0, 0.0, 0.0, 500.0, 1.0 / 250.0]])


def ground(**more: Any) -> Ground:
    """Three lanes of 3.5 m with a bend, and a shoulder of 2.5 m."""
    return GROUND._replace(segments=BENT, speed_limit=LIMIT)._replace(**more)


def kind(d: float, curvature: float = 0.0, limit: float = LIMIT) -> int:
    line = np.array([[0.0, 0.0, 0.0, 500.0, curvature]])
    return stops.place_kind(ground(segments=line, speed_limit=limit), 100.0, d)


def rate(s: float, d: float, slope: float = 0.0) -> float:
    return stops.rate_footprint(RULES, ground(), s, d, slope, 4.5, 1.8)


def test_table_is_the_one_that_users_write() -> None:
    assert dict(zip(stops.RULE_NAMES, stops.DEFAULT_RULES, strict=True)) == dict(StopRatings())
    assert len(stops.DEFAULT_RULES) == len(stops.RULE_NAMES) == stops.RULES
    assert len(stops.SCALE) == int(stops.CONTACT) + 1


def test_places_across_a_straight_road() -> None:
    places = {
        -2.6: stops.RULE_OFF_ROAD, -2.4: stops.RULE_SHOULDER, -0.1: stops.RULE_SHOULDER,
        0.1: stops.RULE_SLOW_LANE_IN_SIGHT, 3.4: stops.RULE_SLOW_LANE_IN_SIGHT,
        3.6: stops.RULE_FAST_LANE, 10.4: stops.RULE_FAST_LANE, 10.6: stops.RULE_OFF_ROAD,
        math.nan: stops.RULE_OFF_ROAD,
    }  # fmt: skip
    assert {d: kind(d) for d in places} == places


def test_sight_in_a_curve_is_that_of_the_circle() -> None:
    radius, inside = 400.0, 3.0
    # Half the chord that touches the inner edge; the formula is for small angles.
    exact = 2.0 * radius * math.acos(1.0 - inside / radius)
    assert stops.sight_distance(1.0 / radius, inside) == pytest.approx(exact, rel=2e-3)
    assert stops.sight_distance(0.0, inside) == math.inf


def test_tighter_curves_are_rated_worse() -> None:
    kinds = [kind(1.75, -1.0 / radius) for radius in (5000.0, 900.0, 300.0)]
    assert kinds == [stops.RULE_SLOW_LANE_IN_SIGHT, stops.RULE_SLOW_LANE, stops.RULE_CURVE]
    assert kind(1.75, -1.0 / 300.0, 15.0) == stops.RULE_SLOW_LANE_IN_SIGHT
    assert kind(-1.0, -1.0 / 300.0) == stops.RULE_SHOULDER


def test_worst_cell_under_the_body_counts() -> None:
    assert [rate(100.0, d) for d in (-1.25, -0.8, 1.75, 3.5, 5.25)] == [1.0, 3.0, 3.0, 5.0, 5.0]
    assert rate(100.0, -1.25, 0.1) == 1.0
    assert rate(100.0, -1.25, 0.6) == 7.0


def test_body_that_reaches_into_a_curve_is_in_it() -> None:
    assert curvature_at(BENT, 499.0) == 0.0
    assert curvature_at(BENT, 501.0) == 1.0 / 250.0
    assert (rate(497.0, 1.75), rate(499.0, 8.75)) == (3.0, 6.0)


def test_beside_the_shoulder_a_refuge_is_best_then_a_verge() -> None:
    bay = np.array([[0.0, 80.0, 60.0, 2.0, 20.0]])

    def beside(d: float, s: float = 100.0) -> int:
        return stops.place_kind(ground(refuges=bay, verge=3.0), s, d)

    kinds = [beside(d) for d in (-2.4, -2.6, -4.5, -4.6, -5.5, -5.6)]
    assert kinds == [
        *(stops.RULE_SHOULDER, stops.RULE_REFUGE, stops.RULE_REFUGE),
        *(stops.RULE_VERGE, stops.RULE_VERGE, stops.RULE_OFF_ROAD),
    ]
    assert beside(-2.6, 300.0) == stops.RULE_VERGE
    assert [RULES[kind] for kind in kinds] == [1.0, 0.0, 0.0, 2.0, 2.0, 7.0]


def test_a_footprint_across_the_line_of_a_bay_is_rated_by_the_shoulder() -> None:
    bay = np.array([[0.0, 80.0, 60.0, 4.0, 20.0]])

    def rated(s: float, d: float) -> float:
        return stops.rate_footprint(RULES, ground(refuges=bay), s, d, 0.0, 4.5, 1.8)

    assert [rated(100.0, d) for d in (-4.5, -3.0, -1.25)] == [0.0, 1.0, 1.0]
    # In the taper the outer corner is off the road.
    assert rated(70.0, -4.5) == 7.0


# --- Stops in bays: where they end, within which limits, and what cannot be had -------------------

SLOW = 1.75
BAY = np.array([[0.0, 200.0, 60.0, 4.0, 20.0]])
LONG = np.array([[0.0, 180.0, 100.0, 4.0, 30.0]])


class Laid(NamedTuple):
    paths: Floats
    all_profiles: Floats

    def path(self, level: int) -> Floats:
        row: Floats = self.paths[stops.path_of(stops.REFUGE * stops.STOP_LEVELS + level)]
        return row

    def profile(self, level: int) -> Floats:
        rows: Floats = self.all_profiles[stops.profile_of(stops.REFUGE * stops.STOP_LEVELS + level)]
        return rows

    def exists(self) -> list[bool]:
        return [self.path(level)[profiles.PATH_EXISTS] > 0.0 for level in range(stops.STOP_LEVELS)]


def lay(
    refuges: Floats = BAY,
    state: tuple[float, float, float, float] = (0.0, SLOW, 25.0, 0.0),
    *,
    places: int = stops.ANYWHERE,
    kept: int = NO_REFUGE,
    driven: Floats | None = None,
    shoulder: float = 2.5,
) -> Laid:
    """Lay the stops in refuges from a state: s, d, speed and acceleration of the ego."""
    record, ground = RECORD, GROUND._replace(refuges=refuges, shoulder=shoulder)
    s, d, speed, acceleration = state
    made_paths = np.zeros((stops.LAID_PATHS, profiles.PATH_ROW))
    made = np.zeros((stops.LAID_PROFILES, stops.STOP_SAMPLES, profiles.PROFILE_ROW))
    for level in range(stops.STOP_LEVELS):
        wanted, jerk = stops.stop_level(record, level), stops.stop_jerk(level)
        stops.fill_stop(speed, acceleration, wanted, jerk, 0.15, made[level])
    before = np.full(profiles.PATH_ROW, np.nan) if driven is None else driven
    place = (s, d, 0.0, 0.0)
    approach = stops.Approach(record, ground, state, place, 0.0, SLOW, before)
    stops.lay_refuge_stops(approach, places, kept, made_paths, made)
    return Laid(made_paths, made)


def test_rows_of_paths_and_profiles_are_apart() -> None:
    numbers = range((stops.REFUGE + 1) * stops.STOP_LEVELS)
    rows = {(stops.path_of(number), stops.profile_of(number)) for number in numbers}
    assert len(rows) == len(numbers)
    assert max(stops.path_of(number) for number in numbers) == stops.LAID_PATHS - 1
    assert max(stops.profile_of(number) for number in numbers) == stops.LAID_PROFILES - 1


def test_in_a_short_bay_who_needs_the_way_goes_on_to_its_end() -> None:
    """At 25 m/s the way from the lane takes more than the half of it."""
    assert lay().profile(1)[-1, profiles.PROFILE_S] == pytest.approx(
        260.0 - 2.25 - stops.ROOM_ALONG
    )


def test_every_level_stands_in_the_middle_of_the_bay() -> None:
    laid = lay(LONG)
    assert laid.exists() == [True] * stops.STOP_LEVELS
    for level in range(stops.STOP_LEVELS):
        path, profile = laid.path(level), laid.profile(level)
        assert profile[-1, profiles.PROFILE_S] == pytest.approx(230.0)
        assert profiles.at_path(path, 230.0 - path[profiles.PATH_START]) == pytest.approx(
            (-4.5, 0.0, 0.0)
        )
        assert (
            stops.refuge_of(RECORD, GROUND._replace(refuges=LONG), 0.0, path, profile)
            == PARKING_BAY
        )
        hardest = -profile[:, profiles.PROFILE_ACCELERATION].min()
        assert hardest == pytest.approx(stops.stop_level(RECORD, level))


@pytest.mark.slow
@pytest.mark.parametrize("speed", [8.0, 15.0, 25.0, 33.0])
@pytest.mark.parametrize("shoulder", [0.0, 2.5])
@pytest.mark.parametrize("level", range(stops.STOP_LEVELS))
def test_no_stop_leaves_its_limits_or_the_road(speed: float, shoulder: float, level: int) -> None:
    """Between the places that the library looks at, a corner may cut a taper by centimetres."""
    start = 200.0 - 6.0 * speed
    laid = lay(state=at(start, speed), shoulder=shoulder)
    if not laid.exists()[level]:
        return
    path, profile = laid.path(level), laid.profile(level)
    ground = GROUND._replace(refuges=BAY, shoulder=shoulder)
    ways = np.linspace(0.0, profile[-1, profiles.PROFILE_S], 400)
    speeds = np.sqrt(
        np.interp(ways, profile[:, profiles.PROFILE_S], profile[:, profiles.PROFILE_SPEED] ** 2)
    )
    for way, now in zip(ways, speeds, strict=True):
        s = start + way
        d, slope, _ = profiles.at_path(path, s - path[profiles.PATH_START])
        assert d >= body_edge(ground, s, slope, 4.5, 1.8) - 0.05
        aside, jerk = stops.lateral_movement(path, s - path[profiles.PATH_START], now, 0.0)
        assert abs(aside) <= stops.LATERAL_ACCELERATION
        assert abs(jerk) <= stops.LATERAL_JERK


@pytest.mark.slow
def test_a_bay_without_a_shoulder_can_be_had() -> None:
    for speed in (25.0, 33.0):
        assert any(lay(state=at(0.0, speed), shoulder=0.0).exists())


def at(s: float, speed: float = 25.0) -> tuple[float, float, float, float]:
    """State of an ego that drives evenly in the slow lane."""
    return s, SLOW, speed, 0.0


def test_who_is_too_fast_or_too_far_for_the_way_does_not_enter() -> None:
    """From 60 m before the last place, 15 m/s can be braked away, 33 m/s cannot."""
    assert any(lay(state=at(194.0, 5.0)).exists())
    assert not any(lay(state=at(194.0, 33.0)).exists())
    # Harder levels come to stand where gentler ones do not.
    feasible = lay(state=at(140.0)).exists()
    assert feasible == sorted(feasible)
    # Nor does who would stop beyond the horizon of the library.
    assert not any(lay(state=at(-600.0)).exists())


def test_a_bay_behind_the_ego_is_passed_over_for_the_next() -> None:
    two = np.concatenate([BAY, [[1.0, 500.0, 100.0, 8.0, 40.0]]])
    laid = lay(two, at(300.0))
    assert laid.exists()[1]
    assert (
        stops.refuge_of(RECORD, GROUND._replace(refuges=two), 300.0, laid.path(1), laid.profile(1))
        == REST_AREA
    )
    assert not any(lay(BAY, at(300.0)).exists())


def test_parking_bays_are_left_out_where_a_rest_area_is_asked_for() -> None:
    two = np.array([[0.0, 110.0, 100.0, 4.0, 30.0], [1.0, 280.0, 100.0, 8.0, 40.0]])
    assert lay(two).profile(1)[-1, profiles.PROFILE_S] == pytest.approx(160.0)
    rest = lay(two, places=stops.ONLY_REST_AREA)
    assert rest.exists()[3]
    assert (
        stops.refuge_of(RECORD, GROUND._replace(refuges=two), 0.0, rest.path(3), rest.profile(3))
        == REST_AREA
    )
    assert not any(lay(BAY, places=stops.ONLY_REST_AREA).exists())


@pytest.mark.parametrize(
    "refuge",
    [(0.0, 200.0, 8.0, 4.0, 20.0), (0.0, 200.0, 60.0, 1.7, 20.0)],
    ids=["too short", "too shallow"],
)
def test_a_bay_smaller_than_the_vehicle_is_none(refuge: tuple[float, ...]) -> None:
    assert not any(lay(np.array([refuge])).exists())


def test_deep_areas_are_not_entered_farther_than_needed() -> None:
    shallow, deep = np.array([0.0, 0.0, 60.0, 2.0, 0.0]), np.array([0.0, 0.0, 60.0, 20.0, 0.0])
    assert stops.refuge_target(RECORD, GROUND, shallow) == -3.5
    assert stops.refuge_target(RECORD, GROUND, deep) == pytest.approx(-2.5 - 0.9 - 1.5)
    assert stops.standing_room(RECORD, deep) == (
        2.25 + stops.ROOM_ALONG,
        60.0 - 2.25 - stops.ROOM_ALONG,
    )


def test_the_length_of_an_entry_is_a_time_at_the_speed_of_its_start() -> None:
    slow, fast = (
        stops.entry_length(RECORD, 10.0, 4.0, 4.0),
        stops.entry_length(RECORD, 20.0, 4.0, 4.0),
    )
    assert fast == pytest.approx(2.0 * slow)
    # Who brakes over all of it cannot be faster at its start than it leaves room for.
    most = stops.entry_length(RECORD, 1e3, 2.4, 4.0)
    start = math.sqrt(2.0 * 2.4 * most)
    assert most / start == pytest.approx(fast / 20.0)


def test_a_stop_that_was_begun_ends_where_it_was_to_end() -> None:
    first = lay(LONG)
    path, profile = first.path(1).copy(), first.profile(1)
    for sample in range(5, stops.STOP_SAMPLES, 9):
        s = profile[sample, profiles.PROFILE_S]
        speed, acceleration = (
            profile[sample, profiles.PROFILE_SPEED],
            profile[sample, profiles.PROFILE_ACCELERATION],
        )
        d = profiles.at_path(path, s - path[profiles.PATH_START])[0]
        again = lay(LONG, (s, d, speed, acceleration), kept=1, driven=path)
        assert again.exists()[1]
        end = again.path(1)
        assert end[profiles.PATH_START] + end[profiles.PATH_LENGTH] == pytest.approx(230.0)
        assert s + again.profile(1)[-1, profiles.PROFILE_S] == pytest.approx(230.0, abs=1.5)
        assert end[profiles.PATH_TARGET] == path[profiles.PATH_TARGET]


@pytest.mark.slow
def test_edges_of_the_taper_bind_where_there_is_no_shoulder() -> None:
    """The same path fits with a shoulder beside it and does not without one."""
    path, profile = lay().path(1), lay().profile(1)
    for shoulder in (2.5, 0.0):
        ground, here = GROUND._replace(refuges=BAY, shoulder=shoulder), -path[profiles.PATH_START]
        fits = stops.fits_limits(RECORD, ground, path, here, profile, SLOW)
        assert fits == (shoulder > 0.0)
