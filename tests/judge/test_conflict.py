"""Conflicts in hand-made scenes: who is in the path, and what the criticality is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.judge.conflict import QUANTITIES
from adeye.judge.series import TraceSeries


def measured(made: Any, quantity: str, row: int = 0) -> Any:
    values, actors = TraceSeries(made.trace()).conflicts
    column = QUANTITIES.index(quantity)
    return float(values[column, 0, row]), int(actors[column, 0, row])


@pytest.mark.parametrize(
    ("quantity", "value"),
    [
        ("distance", 40.0),
        ("gap", 40.0),
        ("ttc", 4.0),
        ("time_gap", 2.0),
        ("time_headway", 2.2),
        ("drac", 1.25),
        ("required_deceleration", 1.25),
    ],
)
def test_golden_approach_to_a_slower_lead(hand_made: Any, quantity: str, value: float) -> None:
    made = hand_made().object("lead", speed=10.0)
    assert measured(made, quantity) == (pytest.approx(value), 0)


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


def test_pedestrian_who_will_be_in_the_corridor_is_in_the_path(hand_made: Any) -> None:
    # The ego arrives after 2 s; at 1.5 m/s the pedestrian has gone 3 m by then.
    assert measured(crossing(hand_made, 2.25, 1.5), "ttc") == (pytest.approx(2.0), 0)


def test_pedestrian_who_arrives_too_late_is_not_in_the_path(hand_made: Any) -> None:
    assert measured(crossing(hand_made, 0.0, 1.5), "ttc") == (np.inf, -1)


def test_pedestrian_who_has_left_before_the_ego_comes_is_not_in_the_path(hand_made: Any) -> None:
    assert measured(crossing(hand_made, 3.9, 3.0), "ttc") == (np.inf, -1)


def test_pedestrian_who_walks_away_is_not_in_the_path(hand_made: Any) -> None:
    assert measured(crossing(hand_made, 2.25, 1.5, -np.pi / 2), "ttc") == (np.inf, -1)


def test_pedestrian_in_the_corridor_is_in_the_path_whatever_follows(hand_made: Any) -> None:
    assert measured(crossing(hand_made, 5.25, 5.0), "gap") == (pytest.approx(40.0), 0)


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
    assert np.all(np.diff(values[0, :, QUANTITIES.index("ttc")]) > 0.0)
    assert np.all(np.diff(values[0, :, QUANTITIES.index("drac")]) < 0.0)


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
@pytest.mark.parametrize("column", ["speed", "s", "heading", "acceleration"])
def test_input_that_is_not_finite_spoils_the_row(hand_made: Any, column: str, bad: float) -> None:
    made = hand_made()
    values = made.columns["objects"][0, 3]
    values[0, {"s": 0, "heading": 2, "speed": 3, "acceleration": 4}[column]] = bad
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


@pytest.mark.slow
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
