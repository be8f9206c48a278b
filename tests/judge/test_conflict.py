"""Conflicts: bodies on the road, who is in the path, bounds, and what is left to do."""

import math
from dataclasses import astuple
from typing import Any

import numpy as np
import pytest

from adeye.judge import conflict
from adeye.judge.following import DST, MDRAC, MTTC, STN, TTR, is_worse_when_larger
from adeye.judge.series import RssParameters, TraceSeries
from adeye.judge.stl.series import SampleStatus
from adeye.kernel.boxes import box_distance, box_of
from adeye.kernel.criticality import rss_lateral_distance

NAMES = ("distance", "gap", "ttc", "time_gap", "time_headway", "drac", "required_deceleration")
COLUMNS = {name: column for column, name in enumerate((*NAMES, "rss_margin"))}


def measured(made: Any, quantity: str, row: int = 0) -> Any:
    values, actors = TraceSeries(made.trace()).conflicts
    column = COLUMNS[quantity]
    return float(values[column, 0, row]), int(actors[column, 0, row])


def test_golden_approach_to_a_slower_lead(hand_made: Any) -> None:
    made = hand_made().object("lead", speed=10.0)
    lengths, times = {"distance": 40.0, "gap": 40.0}, {"ttc": 4.0, "time_gap": 2.0}
    demands = {"time_headway": 2.2, "drac": 1.25, "required_deceleration": 1.25}
    for quantity, value in (lengths | times | demands).items():
        assert measured(made, quantity) == (pytest.approx(value), 0), quantity


def test_braking_lead_that_stops_first_requires_more_than_drac(hand_made: Any) -> None:
    made = hand_made().object("lead", speed=10.0, acceleration=-5.0)
    # The lead needs 10 m to stop: 20² / (2 (40 + 10)).
    assert measured(made, "required_deceleration")[0] == pytest.approx(4.0)
    assert measured(made, "drac")[0] == pytest.approx(1.25)


def test_stopped_ego_has_infinite_ttc_and_headway(hand_made: Any) -> None:
    made = hand_made().ego(speed=0.0).object("lead", speed=0.0)
    for quantity in ("ttc", "time_gap", "time_headway"):
        assert measured(made, quantity)[0] == np.inf


def test_equal_speeds_have_a_headway_but_no_ttc(hand_made: Any) -> None:
    made = hand_made()
    assert measured(made, "ttc") == (np.inf, -1)
    assert measured(made, "time_gap") == (pytest.approx(2.0), 0)


def test_object_in_the_next_lane_is_no_conflict(hand_made: Any) -> None:
    made = hand_made().object("lead", d=8.75, speed=10.0)
    assert measured(made, "gap") == (np.inf, -1)
    assert measured(made, "drac") == (0.0, -1)
    assert measured(made, "distance")[0] == pytest.approx(np.hypot(40.0, 1.5))


@pytest.mark.parametrize(("beside", "is_conflict"), [(1.99, True), (2.0, False), (-1.99, True)])
def test_corridor_is_as_wide_as_the_ego(
    hand_made: Any, beside: float, *, is_conflict: bool
) -> None:
    made = hand_made().object("lead", d=5.25 + beside)
    assert (measured(made, "gap")[1] == 0) is is_conflict


def test_object_behind_counts_for_the_distance_only(hand_made: Any) -> None:
    made = hand_made().object("lead", s=-10.0, speed=30.0)
    assert measured(made, "distance") == (pytest.approx(6.0), 0)
    for quantity in ("gap", "ttc", "time_gap", "rss_margin"):
        assert measured(made, quantity) == (np.inf, -1)


def test_worst_actor_differs_between_quantities(hand_made: Any) -> None:
    made = hand_made(objects=("near", "far")).object("far", s=104.0, speed=0.0)
    made.object("near", speed=18.0)
    assert measured(made, "gap") == (pytest.approx(40.0), 0)
    assert measured(made, "ttc") == (pytest.approx(5.0), 1)
    assert measured(made, "drac") == (pytest.approx(2.0), 1)


def test_oncoming_object_requires_the_closing_speed_to_vanish(hand_made: Any) -> None:
    made = hand_made().object("lead", speed=10.0, heading=np.pi)
    assert measured(made, "ttc")[0] == pytest.approx(40.0 / 30.0)
    assert measured(made, "required_deceleration")[0] == pytest.approx(30.0**2 / 80.0)


def crossing(hand_made: Any, d: float, speed: float, heading: float = np.pi / 2) -> Any:
    made = hand_made(objects=("pedestrian",))
    return made.object("pedestrian", s=42.3, d=d, speed=speed, heading=heading, size=(0.6, 0.6))


def test_pedestrian_is_in_the_path_who_is_in_the_corridor_as_the_ego_comes(hand_made: Any) -> None:
    nobody = (np.inf, -1)
    for why, walker, quantity, expected in (
        # The ego arrives after 2 s; at 1.5 m/s the pedestrian has gone 3 m by then.
        ("will be in the corridor", (2.25, 1.5), "ttc", (pytest.approx(2.0), 0)),
        ("arrives too late", (0.0, 1.5), "ttc", nobody),
        ("has left before", (3.9, 3.0), "ttc", nobody),
        ("walks away", (2.25, 1.5, -np.pi / 2), "ttc", nobody),
        ("is in it, whatever follows", (5.25, 5.0), "gap", (pytest.approx(40.0), 0)),
    ):
        assert measured(crossing(hand_made, *walker), quantity) == expected, why


def test_drifting_vehicle_is_not_predicted_to_cross(hand_made: Any) -> None:
    made = hand_made().object("lead", d=8.0, speed=10.0, heading=-0.2)
    assert measured(made, "ttc") == (np.inf, -1)


def test_mirrored_road_gives_the_same(hand_made: Any) -> None:
    left = hand_made().object("lead", d=6.5, speed=12.0, heading=0.05, acceleration=-1.0)
    right = hand_made().object("lead", d=4.0, speed=12.0, heading=-0.05, acceleration=-1.0)
    a, b = (TraceSeries(made.trace()).conflicts[0] for made in (left, right))
    np.testing.assert_allclose(a, b, rtol=1e-12)


def test_ttc_grows_and_drac_falls_with_the_gap(hand_made: Any) -> None:
    made = hand_made().ego(s=0.0).object("lead", s=np.linspace(10.0, 90.0, 21), speed=10.0)
    values, _ = TraceSeries(made.trace()).conflicts
    assert np.all(np.diff(values[0, :, conflict.TTC]) > 0.0)
    assert np.all(np.diff(values[0, :, conflict.DRAC]) < 0.0)


@pytest.mark.parametrize(
    ("ego_speed", "lead_speed", "safe"),
    [(20.0, 20.0, 65.781), (30.0, 20.0, 147.031), (30.0, 30.0, 115.781), (36.111, 0.0, 233.990)],
)
def test_golden_rss_distances(
    hand_made: Any, ego_speed: float, lead_speed: float, safe: float
) -> None:
    made = hand_made().ego(speed=ego_speed).object("lead", speed=lead_speed)
    assert measured(made, "rss_margin") == (pytest.approx(40.0 - safe, abs=1e-3), 0)


@pytest.mark.parametrize(("beside", "is_safe"), [(2.73, True), (2.72, False)])
def test_rss_is_safe_beside_from_0_725_m(hand_made: Any, beside: float, *, is_safe: bool) -> None:
    made = hand_made().object("lead", d=5.25 + beside)
    assert (measured(made, "rss_margin")[1] == -1) is is_safe


def test_printed_rss_asks_for_room_to_who_drives_away_as_well(hand_made: Any) -> None:
    # 6 m/s across the road and away from the ego, which as printed needs 8 m between them.
    trace = hand_made().object("lead", d=8.75, speed=20.0, heading=np.arcsin(0.3)).trace()
    for is_printed in (False, True):
        series = TraceSeries(trace, RssParameters(is_printed=is_printed))
        assert (int(series.samples("rss_margin").actor[0, 0]) == 0) is is_printed


def test_rss_of_oncoming_traffic_adds_both_ways(hand_made: Any) -> None:
    made = hand_made().object("lead", speed=20.0, heading=np.pi)
    own, other = 21.75 + 23.5**2 / 6.0, 21.75 + 23.5**2 / 8.0
    assert measured(made, "rss_margin")[0] == pytest.approx(40.0 - own - other)


def test_contact_row_has_no_distance_and_no_time_left(hand_made: Any) -> None:
    made = hand_made().object("lead", d=7.3).touch(5, "lead")
    assert measured(made, "distance", 5) == (0.0, 0)
    assert measured(made, "ttc", 5) == (0.0, 0)
    assert measured(made, "distance", 4)[0] > 0.0


def test_overlapping_extents_of_bodies_apart_leave_their_distance_as_gap(hand_made: Any) -> None:
    # Side by side and turned: the extents overlap on the road, the bodies do not.
    made = hand_made().ego(heading=np.pi / 4, speed=1.0)
    made.object("lead", s=1.6, d=3.65, heading=np.pi / 4, speed=0.0)
    gap, actor = measured(made, "gap")
    assert actor == 0
    assert 0.0 < gap == pytest.approx(measured(made, "distance")[0])


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_input_that_is_not_finite_spoils_the_row(hand_made: Any, bad: float) -> None:
    for column in (0, 2, 3, 4):
        made = hand_made()
        made.columns["objects"][0, 3, 0, column] = bad
        measured_values, _ = TraceSeries(made.trace()).conflicts
        assert np.isnan(measured_values[:, 0, 3]).all()
        assert not np.isnan(measured_values[:, 0, 2]).any()


def on_a_bend(made: Any, radius: float) -> Any:
    """Lay the road of hand-made runs around an arc, to the left where the radius is positive."""
    for state, place in (("ego", "ego_place"), ("objects", "object_places")):
        turned = made.columns[place][..., 0] / radius
        made.columns[place][..., 2] += turned
        made.columns[state][..., 2] += turned
    return made


@pytest.mark.parametrize("radius", [60.0, -60.0, 500.0, -45.0])
@pytest.mark.parametrize("lane", [0, 2])
def test_distances_on_a_bend_are_those_along_the_lane_of_the_ego(
    hand_made: Any, radius: float, lane: int
) -> None:
    d = 3.5 * (lane + 0.5)
    made = hand_made().ego(s=0.0, d=d, speed=8.0).object("lead", s=44.0, d=d, speed=3.0)
    series = TraceSeries(on_a_bend(made, radius).trace())
    gap = 44.0 * (radius - d) / radius - 4.0
    closed = {
        "gap": gap, "ttc": gap / 5.0, "time_gap": gap / 8.0, "time_headway": (gap + 4.0) / 8.0,
        "drac": 12.5 / gap, "required_deceleration": 12.5 / gap, "mttc": gap / 5.0,
    }  # fmt: skip
    for name, value in closed.items():
        assert series.samples(name).values[0, 0] == pytest.approx(value, rel=1e-9), name
    assert series.object_gap(0)[0, 0] == pytest.approx(gap, rel=1e-9)
    straight = hand_made().ego(s=0.0, d=d, speed=8.0).object("lead", s=gap + 4.0, d=d, speed=3.0)
    rss = TraceSeries(straight.trace()).samples("rss_margin").values[0, 0]
    assert series.samples("rss_margin").values[0, 0] == pytest.approx(rss, rel=1e-9)


def test_mirrored_bend_gives_the_same(hand_made: Any) -> None:
    def gap(radius: float, d: float) -> float:
        made = hand_made().ego(s=0.0, d=d).object("lead", s=44.0, d=d)
        return float(TraceSeries(on_a_bend(made, radius).trace()).samples("gap").values[0, 0])

    assert gap(60.0, 8.75) == gap(-60.0, -8.75)


def test_bend_without_end_is_the_straight_to_the_bit(hand_made: Any) -> None:
    made = hand_made().object("lead", s=44.1 + 0.7 * np.arange(21))
    bits = [TraceSeries(it.trace()).conflicts[0] for it in (made, on_a_bend(made, np.inf))]
    assert bits[0].tobytes() == bits[1].tobytes()


EGO: conflict.Body = (0.0, 0.0, 20.0, 0.0, 2.0, 1.0)


def turned(angle: float, speed: float = 10.0) -> conflict.Body:
    return conflict.on_road(0.0, 0.0, speed, 4.0, 2.0, math.sin(angle), math.cos(angle))


def test_straight_body_is_as_long_and_wide_as_it_is() -> None:
    body = turned(0.0)
    assert (body[conflict.ALONG], body[conflict.ACROSS]) == (10.0, 0.0)
    assert (body[conflict.HALF_LENGTH], body[conflict.HALF_WIDTH]) == (2.0, 1.0)


@pytest.mark.parametrize("angle", [0.1, 0.7, -0.7, 2.0, math.pi])
def test_turned_body_keeps_its_speed_and_its_corners_reach_its_extents(angle: float) -> None:
    body = turned(angle)
    assert math.hypot(body[conflict.ALONG], body[conflict.ACROSS]) == pytest.approx(10.0)
    corners = [
        (
            x * math.cos(angle) - y * math.sin(angle),
            x * math.sin(angle) + y * math.cos(angle),
        )
        for x in (-2.0, 2.0)
        for y in (-1.0, 1.0)
    ]
    assert body[conflict.HALF_LENGTH] == pytest.approx(max(along for along, _ in corners))
    assert body[conflict.HALF_WIDTH] == pytest.approx(max(across for _, across in corners))


@pytest.mark.parametrize("size", [(4.0, 2.0), (0.6, 0.6), (18.75, 2.55)])
def test_reach_is_a_little_more_than_half_of_the_diagonal(size: tuple[float, float]) -> None:
    half = 0.5 * math.hypot(*size)
    assert half < conflict.reach_of(*size) < half * 1.00001 + 2e-6


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_one_number_that_is_not_finite_spoils_all(bad: float) -> None:
    numbers = [1.0, -2.0, 0.0, 1e300, -1e-300, -0.0, 5.0, 6.0, 7.0, 8.0]
    assert conflict.are_finite(*numbers)
    for place in range(10):
        spoilt = list(numbers)
        spoilt[place] = bad
        assert not conflict.are_finite(*spoilt)


def test_angle_is_turned_anew_only_where_it_changes() -> None:
    turns = np.full((2, 3), np.nan)
    conflict.turn(turns, 1, 0.5)
    assert turns[1].tolist() == pytest.approx([0.5, math.sin(0.5), math.cos(0.5)])
    assert np.isnan(turns[0]).all()
    turns[1, 1] = 9.0
    conflict.turn(turns, 1, 0.5)
    assert turns[1, 1] == 9.0
    conflict.turn(turns, 1, 0.25)
    assert turns[1, 1] == pytest.approx(math.sin(0.25))


def walker(d: float, across: float) -> conflict.Body:
    return (40.0, d, 0.0, across, 0.3, 0.3)


def test_walker_is_in_the_path_if_in_the_corridor_as_the_ego_passes() -> None:
    for d, across, is_met in (
        (0.0, 0.0, True),
        (1.29, 0.0, True),
        (1.3, 0.0, False),
        (-1.3, 0.0, False),
        (4.0, -1.5, True),
        (-4.0, 1.5, True),
        (4.0, 1.5, False),
        (9.0, -1.5, False),
        (2.0, -4.0, False),
    ):
        # The ego is beside the walker from 1.885 s to 2.115 s on.
        assert conflict.is_in_path(EGO, 1.0, walker(d, across), 37.7) is is_met
        mirrored = walker(-d, -across)
        assert conflict.is_in_path(EGO, 1.0, mirrored, 37.7) is is_met, d


def test_walker_beside_the_corridor_is_met_by_no_ego_that_stands() -> None:
    standing: conflict.Body = (0.0, 0.0, 0.0, 0.0, 2.0, 1.0)
    assert not conflict.is_in_path(standing, 1.0, walker(4.0, -1.5), 37.7)
    assert not conflict.is_in_path(EGO, 1.0, walker(4.0, -1.5), 0.0)
    # Nor by one that has come level with him, however soon he steps in.
    assert not conflict.is_in_path(EGO, 1.0, walker(1.4, -1.5), -0.5)


RSS = np.array(astuple(RssParameters()))
BRAKING = 0.5 / RSS[7]


def scene(seed: int, rows: int = 30, objects: int = 3) -> Any:
    """Return the ego, its size, the others and their sizes, at random places."""
    bits = np.random.default_rng(seed)
    ego, others = np.zeros((1, rows, 7)), np.zeros((1, rows, objects, 5))
    ego[..., :3], others[..., :3] = (bits.uniform(-9.0, 9.0, (*part.shape[:-1], 3)) for part in
                                     (ego, others))  # fmt: skip
    return ego, np.array([[4.0, 2.0, 1.5]]), others, bits.uniform(0.5, 6.0, (1, objects, 3))


def whole(ego: Any, size: Any, others: Any, sizes: Any) -> conflict.Scene:
    """Let a run of 20 rows have them; nothing reads their places on the road."""
    places, nobody = np.zeros((*others.shape[:3], 6)), np.full(ego.shape[:2], -1, dtype=np.int16)
    return conflict.Scene(np.array([20]), ego, ego[..., :6], size, others, places, sizes, nobody)


def distances(
    ego: np.ndarray, size: np.ndarray, others: np.ndarray, sizes: np.ndarray
) -> np.ndarray:
    return np.array(
        [
            [
                box_distance(box_of(ego[0, row], size[0]), box_of(others[0, row, at], sizes[0, at]))
                for at in range(others.shape[2])
            ]
            for row in range(ego.shape[1])
        ]
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_least_so_far_is_the_distance_of_some_row(seed: int) -> None:
    ego, size, others, sizes = scene(seed)
    others[..., :2] += 40.0
    found = conflict.least_so_far(0, whole(ego, size, others, sizes))
    every = distances(ego, size, others, sizes)[:20]
    assert found in every
    assert found >= every.min() > 0.0


@pytest.mark.slow
def test_without_a_number_or_an_object_nothing_is_left_out() -> None:
    ego, size, others, sizes = scene(0)
    assert conflict.least_so_far(0, whole(ego, size, others[:, :, :0], sizes)) == np.inf
    assert conflict.least_so_far(0, whole(ego, size, others * np.nan, sizes)) == np.inf


@pytest.mark.parametrize("seed", range(5))
def test_distance_is_exact_up_to_what_is_enough(seed: int) -> None:
    ego, size, others, sizes = scene(seed)
    every = distances(ego, size, others, sizes)
    turns = np.full((others.shape[2] + 1, 3), np.nan)
    bounds = 0
    for row in range(ego.shape[1]):
        x, y, heading = ego[0, row, :3]
        for at in range(others.shape[2]):
            ox, oy, o_heading = others[0, row, at, :3]
            o_length, o_width = sizes[0, at, :2]
            found = conflict.distance_below(
                (ox - x, oy - y),
                (heading, 4.0, 2.0),
                (o_heading, o_length, o_width),
                turns,
                at,
                3.0,
            )
            bounds += found != every[row, at]
            assert found == every[row, at] or 3.0 < found <= every[row, at] + 1e-9
    assert bounds > 0


def test_far_beside_is_neither_in_the_path_nor_laterally_unsafe() -> None:
    bits = np.random.default_rng(1)
    culled = 0
    for _ in range(3000):
        beside, across = bits.uniform(-8.0, 8.0), bits.uniform(-2.0, 2.0)
        speed, angle = bits.uniform(-20.0, 20.0), bits.uniform(-0.7, 0.7)
        length, width = bits.uniform(0.3, 12.0), bits.uniform(0.3, 3.0)
        reach = conflict.lateral_reach(abs(across), RSS[0], RSS[6], BRAKING) + RSS[8]
        if not conflict.is_far_beside(
            beside, 1.0, reach, (speed, angle, length, width), RSS, BRAKING
        ):
            continue
        culled += 1
        own = (0.0, 0.0, 20.0, across, 2.0, 1.0)
        other = conflict.on_road(30.0, beside, speed, length, width, np.sin(angle), np.cos(angle))
        assert own[conflict.ALONG] == 20.0
        assert not conflict.is_in_path(own, 1.0, other, 20.0)
        side = np.copysign(1.0, beside)
        lateral = rss_lateral_distance(side * across, side * other[3], *RSS[[0, 1, 6, 7, 8]])
        assert abs(beside) - 1.0 - other[conflict.HALF_WIDTH] >= lateral
    assert 100 < culled < 2900


def test_demands_are_worse_when_larger() -> None:
    assert [what for what in range(10) if is_worse_when_larger(what)] == [MDRAC, DST, STN]
    assert not is_worse_when_larger(MTTC)
    assert not is_worse_when_larger(TTR)


def test_series_has_the_closed_form_at_every_row(hand_made: Any) -> None:
    # 20 m/s towards a standing lead, from 44 m on.
    series = TraceSeries(hand_made().object("lead", speed=0.0, s=48.0).trace())
    gap = 44.0 - 20.0 * series.trace.time
    found = series.samples("mttc")
    assert found.values[0] == pytest.approx(gap / 20.0, rel=1e-9)
    assert (found.actor == 0).all()
    brake = gap / 20.0 - 20.0 / (2.0 * 9.0)
    steer = gap / 20.0 - np.sqrt(2.0 * 2.0 / 9.80665)
    assert series.samples("ttr").values[0] == pytest.approx(np.maximum(brake, steer), rel=1e-9)


def test_braking_lead_at_equal_speed_is_a_conflict_of_accelerations_only(hand_made: Any) -> None:
    series = TraceSeries(hand_made().object("lead", acceleration=-5.0).trace())
    # The lead stands after 4 s and 40 m, the ego is there after 80 m: (40 + 40) / 20.
    assert series.samples("mttc").values[0] == pytest.approx(np.full(21, 4.0), rel=1e-9)
    assert (series.samples("ttc").status[0] == SampleStatus.NO_CONFLICT).all()
    assert (series.samples("ttr").status[0] == SampleStatus.NO_CONFLICT).all()


def test_contact_is_zero_and_an_unknown_speed_an_error(hand_made: Any) -> None:
    made = hand_made().touch(7, "lead")
    made.columns["ego"][0, 3, 3] = np.nan
    found = TraceSeries(made.trace()).samples("mttc")
    assert (found.values[0, 7], found.status[0, 7]) == (0.0, SampleStatus.VALUE)
    assert found.status[0, 3] == SampleStatus.ERROR


def test_distance_and_gap_to_an_object_ahead(hand_made: Any) -> None:
    series = TraceSeries(hand_made().trace())
    np.testing.assert_allclose(series.object_distance(0), 40.0)
    np.testing.assert_allclose(series.object_gap(0), 40.0)


def test_gap_behind_is_negative_and_a_touched_object_is_at_no_distance(hand_made: Any) -> None:
    made = hand_made().object("lead", s=-44.0 + 20.0 * np.arange(21) * 0.1)
    assert TraceSeries(made.trace()).object_gap(0)[0, 3] == pytest.approx(-40.0)
    touched = TraceSeries(hand_made().touch(7, "lead").trace())
    assert touched.object_distance(0)[0, 7] == 0.0


def test_unknown_number_makes_no_distance(hand_made: Any) -> None:
    made = hand_made()
    made.columns["objects"][0, 5, 0, 4] = np.nan
    series = TraceSeries(made.trace())
    for found in (series.object_distance(0)[0], series.object_gap(0)[0]):
        assert np.flatnonzero(np.isnan(found)).tolist() == [5]
