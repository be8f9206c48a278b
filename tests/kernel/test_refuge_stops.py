"""Stops in bays: where they end, within which limits, and what cannot be had."""

import math
from typing import NamedTuple

import numpy as np
import pytest

from adeye.kernel.profiles import (
    PATH_EXISTS,
    PATH_LENGTH,
    PATH_ROW,
    PATH_START,
    PATH_TARGET,
    PROFILE_ACCELERATION,
    PROFILE_ROW,
    PROFILE_S,
    PROFILE_SPEED,
    at_path,
)
from adeye.kernel.road import NO_REFUGE, PARKING_BAY, REST_AREA, body_edge
from adeye.kernel.stops import (
    ANYWHERE,
    LAID_PATHS,
    LAID_PROFILES,
    LATERAL_ACCELERATION,
    LATERAL_JERK,
    ONLY_REST_AREA,
    REFUGE,
    ROOM_ALONG,
    STOP_LEVELS,
    STOP_SAMPLES,
    entry_length,
    fill_stop,
    fits_limits,
    lateral_movement,
    lay_refuge_stops,
    path_of,
    profile_of,
    refuge_of,
    refuge_target,
    standing_room,
    stop_jerk,
    stop_level,
)
from adeye.signals import Floats, parameter_record

RECORD = parameter_record(
    {
        "stop_deceleration": [4.0],
        "emergency_deceleration": 8.0,
        "lane_width": 3.5,
        "lanes": 3.0,
        "shoulder": 2.5,
        "verge": 0.0,
        "length": 4.5,
        "width": 1.8,
        "max_curvature": 0.25,
        "acceleration_lag": 0.15,
    }
)[0]
SLOW = 1.75
BAY = np.array([[0.0, 200.0, 60.0, 4.0, 20.0]])
LONG = np.array([[0.0, 180.0, 100.0, 4.0, 30.0]])


class Laid(NamedTuple):
    paths: Floats
    profiles: Floats

    def path(self, level: int) -> Floats:
        row: Floats = self.paths[path_of(REFUGE * STOP_LEVELS + level)]
        return row

    def profile(self, level: int) -> Floats:
        rows: Floats = self.profiles[profile_of(REFUGE * STOP_LEVELS + level)]
        return rows

    def exists(self) -> list[bool]:
        return [self.path(level)[PATH_EXISTS] > 0.0 for level in range(STOP_LEVELS)]


def lay(  # noqa: PLR0913 - each is one thing that a test may want to set
    refuges: Floats = BAY,
    *,
    speed: float = 25.0,
    s: float = 0.0,
    d: float = SLOW,
    acceleration: float = 0.0,
    places: int = ANYWHERE,
    kept: int = NO_REFUGE,
    driven: Floats | None = None,
    shoulder: float = 2.5,
) -> Laid:
    record = RECORD.copy()
    record["shoulder"] = shoulder
    paths = np.zeros((LAID_PATHS, PATH_ROW))
    profiles = np.zeros((LAID_PROFILES, STOP_SAMPLES, PROFILE_ROW))
    for level in range(STOP_LEVELS):
        wanted, jerk = stop_level(record, level), stop_jerk(level)
        fill_stop(speed, acceleration, wanted, jerk, 0.15, profiles[level])
    none = np.full(PATH_ROW, np.nan)
    lay_refuge_stops(
        record,
        refuges,
        places,
        (s, d, speed, acceleration),
        (s, d, 0.0, 0.0),
        0.0,
        SLOW,
        kept,
        none if driven is None else driven,
        paths,
        profiles,
    )
    return Laid(paths, profiles)


def test_rows_of_paths_and_profiles_are_apart() -> None:
    stops = range((REFUGE + 1) * STOP_LEVELS)
    rows = {(path_of(stop), profile_of(stop)) for stop in stops}
    assert len(rows) == len(stops)
    assert max(path_of(stop) for stop in stops) == LAID_PATHS - 1
    assert max(profile_of(stop) for stop in stops) == LAID_PROFILES - 1


def test_in_a_short_bay_who_needs_the_way_goes_on_to_its_end() -> None:
    """At 25 m/s the way from the lane takes more than the half of it."""
    assert lay().profile(1)[-1, PROFILE_S] == pytest.approx(260.0 - 2.25 - ROOM_ALONG)


def test_every_level_stands_in_the_middle_of_the_bay() -> None:
    laid = lay(LONG)
    assert laid.exists() == [True] * STOP_LEVELS
    for level in range(STOP_LEVELS):
        path, profile = laid.path(level), laid.profile(level)
        assert profile[-1, PROFILE_S] == pytest.approx(230.0)
        assert at_path(path, 230.0 - path[PATH_START]) == pytest.approx((-4.5, 0.0, 0.0))
        assert refuge_of(RECORD, LONG, 0.0, path, profile) == PARKING_BAY
        hardest = -profile[:, PROFILE_ACCELERATION].min()
        assert hardest == pytest.approx(stop_level(RECORD, level))


@pytest.mark.slow
@pytest.mark.parametrize("speed", [8.0, 15.0, 25.0, 33.0])
@pytest.mark.parametrize("shoulder", [0.0, 2.5])
@pytest.mark.parametrize("level", range(STOP_LEVELS))
def test_no_stop_leaves_its_limits_or_the_road(speed: float, shoulder: float, level: int) -> None:
    """Between the places that the library looks at, a corner may cut a taper by centimetres."""
    start = 200.0 - 6.0 * speed
    laid = lay(speed=speed, s=start, shoulder=shoulder)
    if not laid.exists()[level]:
        return
    path, profile = laid.path(level), laid.profile(level)
    ways = np.linspace(0.0, profile[-1, PROFILE_S], 400)
    speeds = np.sqrt(np.interp(ways, profile[:, PROFILE_S], profile[:, PROFILE_SPEED] ** 2))
    for way, now in zip(ways, speeds, strict=True):
        s = start + way
        d, slope, _ = at_path(path, s - path[PATH_START])
        assert d >= body_edge(BAY, s, slope, 4.5, 1.8, shoulder, 0.0) - 0.05
        aside, jerk = lateral_movement(path, s - path[PATH_START], now, 0.0)
        assert abs(aside) <= LATERAL_ACCELERATION
        assert abs(jerk) <= LATERAL_JERK


@pytest.mark.slow
def test_a_bay_without_a_shoulder_can_be_had() -> None:
    assert any(lay(shoulder=0.0).exists())
    assert any(lay(shoulder=0.0, speed=33.0).exists())


def test_who_is_too_fast_for_the_way_does_not_enter() -> None:
    """From 60 m before the last place, 15 m/s can be braked away, 33 m/s cannot."""
    assert any(lay(s=194.0, d=SLOW, speed=5.0).exists())
    assert not any(lay(s=194.0, speed=33.0).exists())
    # Harder levels come to stand where gentler ones do not.
    feasible = lay(s=140.0, speed=25.0).exists()
    assert feasible == sorted(feasible)


def test_the_horizon_of_the_library_is_not_passed() -> None:
    assert not any(lay(s=-600.0).exists())


def test_a_bay_behind_the_ego_is_passed_over_for_the_next() -> None:
    two = np.concatenate([BAY, [[1.0, 500.0, 100.0, 8.0, 40.0]]])
    laid = lay(two, s=300.0)
    assert laid.exists()[1]
    assert refuge_of(RECORD, two, 300.0, laid.path(1), laid.profile(1)) == REST_AREA
    assert not any(lay(BAY, s=300.0).exists())


def test_parking_bays_are_left_out_where_a_rest_area_is_asked_for() -> None:
    two = np.array([[0.0, 110.0, 100.0, 4.0, 30.0], [1.0, 280.0, 100.0, 8.0, 40.0]])
    assert lay(two).profile(1)[-1, PROFILE_S] == pytest.approx(160.0)
    rest = lay(two, places=ONLY_REST_AREA)
    assert rest.exists()[3]
    assert refuge_of(RECORD, two, 0.0, rest.path(3), rest.profile(3)) == REST_AREA
    assert not any(lay(BAY, places=ONLY_REST_AREA).exists())


@pytest.mark.parametrize(
    "refuge",
    [(0.0, 200.0, 8.0, 4.0, 20.0), (0.0, 200.0, 60.0, 1.7, 20.0)],
    ids=["too short", "too shallow"],
)
def test_a_bay_smaller_than_the_vehicle_is_none(refuge: tuple[float, ...]) -> None:
    assert not any(lay(np.array([refuge])).exists())


def test_deep_areas_are_not_entered_farther_than_needed() -> None:
    shallow, deep = np.array([0.0, 0.0, 60.0, 2.0, 0.0]), np.array([0.0, 0.0, 60.0, 20.0, 0.0])
    assert refuge_target(RECORD, shallow) == -3.5
    assert refuge_target(RECORD, deep) == pytest.approx(-2.5 - 0.9 - 1.5)
    assert standing_room(RECORD, deep) == (2.25 + ROOM_ALONG, 60.0 - 2.25 - ROOM_ALONG)


def test_the_length_of_an_entry_is_a_time_at_the_speed_of_its_start() -> None:
    slow, fast = entry_length(RECORD, 10.0, 4.0, 4.0), entry_length(RECORD, 20.0, 4.0, 4.0)
    assert fast == pytest.approx(2.0 * slow)
    # Who brakes over all of it cannot be faster at its start than it leaves room for.
    most = entry_length(RECORD, 1e3, 2.4, 4.0)
    start = math.sqrt(2.0 * 2.4 * most)
    assert most / start == pytest.approx(fast / 20.0)


def test_a_stop_that_was_begun_ends_where_it_was_to_end() -> None:
    first = lay(LONG)
    path, profile = first.path(1).copy(), first.profile(1)
    for sample in range(5, STOP_SAMPLES, 9):
        s = profile[sample, PROFILE_S]
        speed, acceleration = profile[sample, PROFILE_SPEED], profile[sample, PROFILE_ACCELERATION]
        d = at_path(path, s - path[PATH_START])[0]
        again = lay(LONG, s=s, d=d, speed=speed, acceleration=acceleration, kept=1, driven=path)
        assert again.exists()[1]
        end = again.path(1)
        assert end[PATH_START] + end[PATH_LENGTH] == pytest.approx(230.0)
        assert s + again.profile(1)[-1, PROFILE_S] == pytest.approx(230.0, abs=1.5)
        assert end[PATH_TARGET] == path[PATH_TARGET]


@pytest.mark.slow
def test_edges_of_the_taper_bind_where_there_is_no_shoulder() -> None:
    """The same path fits with a shoulder beside it and does not without one."""
    path, profile = lay().path(1), lay().profile(1)
    assert fits_limits(RECORD, BAY, path, -path[PATH_START], profile, SLOW)
    bare = RECORD.copy()
    bare["shoulder"] = 0.0
    assert not fits_limits(bare, BAY, path, -path[PATH_START], profile, SLOW)
