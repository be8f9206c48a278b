"""Laws of drivers on rails, on lines and lanes made by hand."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from adeye.kernel.boxes import boxes_overlap, wrap_to_pi
from adeye.kernel.jit import compiled
from adeye.kernel.road import lane_way, position
from adeye.kernel.strips import LEAST_LANE
from adeye.kernel.traffic import network as n
from adeye.kernel.traffic import rails as k
from adeye.kernel.traffic.rails import Rails, advance_rails
from adeye.signals import Floats
from benchmarks.lane_ends import PLACES, count_rails
from benchmarks.support.rail_scenes import WIDTH, Car, Lines, Strip, lanes, lay

STEP = 0.1
RIGHT, LEFT = 0.5 * WIDTH, 1.5 * WIDTH
STRAIGHT = [(2000.0, 0.0)]
BENT = [(300.0, 0.0), (100.0, 0.01), (80.0, 0.0), (60.0, -0.015), (1460.0, 0.0)]
TWO_LANES = [(0.0, lanes(0, 1))]
RIGHT_ENDS = [(0.0, lanes(0, 1)), (800.0, lanes(1))]


def driven(rails: Rails, seconds: float, step: float = STEP) -> Floats:
    """Drive on; return the vehicles (ticks, N, VEHICLE_WIDTH)."""
    rows = []
    for _ in range(round(seconds / step)):
        advance_rails(rails, step)
        rows.append(rails.vehicles.copy())
    return np.array(rows)


# --- Nobody touches another -----------------------------------------------------------------------


@compiled
def touching(rails: Rails, ticks: int, step: float) -> int:
    """Drive on; count pairs of boxes that touch at the ticks."""
    vehicles, found = rails.vehicles, 0
    for _ in range(ticks):
        advance_rails(rails, step)
        for one in range(vehicles.shape[0]):
            for other in range(one):
                a, b = vehicles[one], vehicles[other]
                if abs(a[n.S] - b[n.S]) < 30.0:
                    found += boxes_overlap(
                        (a[n.X], a[n.Y], a[n.HEADING], a[n.LENGTH], 2.0 * a[k.HALF_ACROSS]),
                        (b[n.X], b[n.Y], b[n.HEADING], b[n.LENGTH], 2.0 * b[k.HALF_ACROSS]),
                    )
    return found


def made_up(draw: np.random.Generator) -> Rails:
    """Return a bent line of 2 to 4 lanes that end, begin and have limits; some drive against it."""
    most, opposite = int(draw.integers(2, 5)), int(draw.integers(0, 3))
    first, last, begin = 0, most, 0.0
    edge = most * WIDTH + 0.5
    slabs: list[tuple[float, Sequence[Strip]]] = []
    while begin < 1900.0:
        limits = draw.choice([math.inf, 25.0, 14.0], last - first)
        own = [
            strip._replace(limit=float(limit))
            for strip, limit in zip(lanes(*range(first, last)), limits, strict=True)
        ]
        against = [
            Strip(edge + i * WIDTH, edge + (i + 1) * WIDTH, way=-1.0) for i in range(opposite)
        ]
        slabs.append((begin, [*own, *against]))
        begin += float(draw.uniform(250.0, 600.0))
        change = int(draw.integers(0, 4))
        first = min(max(first + (change == 0) - (change == 1), 0), last - 1)
        last = min(max(last + (change == 2) - (change == 3), first + 1), most)
    pieces = [
        (float(draw.uniform(20.0, 150.0)), float(draw.choice([0.0, 0.0, 1.0, -1.0]) / radius))
        for radius in draw.uniform(40.0, 400.0, 24)
    ]
    lines = Lines(pieces, slabs)
    cars: list[Car] = []
    for _ in range(int(draw.integers(8, 24))):
        way = -1.0 if opposite and draw.random() < 0.25 else 1.0
        d = (int(draw.integers(0, most)) + 0.5) * WIDTH
        if way < 0.0:
            d = edge + (int(draw.integers(0, opposite)) + 0.5) * WIDTH
        s = float(draw.uniform(0.0, 249.0) if way > 0.0 else draw.uniform(1400.0, 1900.0))
        length, width = (12.0, 2.5) if draw.random() < 0.2 else (4.5, 1.8)
        if all(car.d != d or abs(car.s - s) > 18.0 + 0.5 * (car.length + length) for car in cars):
            speed, desired, timer = draw.uniform((0.0, 8.0, 0.0), (12.0, 38.0, 1.0))
            is_changing = bool(draw.random() < 0.7)
            cars.append(Car(s, d, speed, desired, way, is_changing, length, width, timer))
    return lay(lines, cars)


@pytest.mark.parametrize("hours", [10, pytest.param(500, marks=pytest.mark.slow)])
def test_nobody_touches_another(hours: int) -> None:
    draw, driven_s = np.random.default_rng(hours), 0.0
    stuck = 0
    while driven_s < 3600.0 * hours:
        rails = made_up(draw)
        assert touching(rails, 2400, STEP) == 0
        stuck += int((rails.vehicles[:, n.SPEED] < 1.0).sum())
        driven_s += 240.0 * len(rails.vehicles)
    assert stuck == 0


def joining(draw: np.random.Generator) -> Rails:
    """Return two ramps in a row that lead to a road of two lanes, with streams of any density."""
    cars: list[Car] = []
    for lane, begin, end, most in (
        (1, 10.0, 800.0, 22.0),
        (2, 10.0, 800.0, 22.0),
        (0, 10.0, 560.0, 15.0),
        (0, 910.0, 1360.0, 8.0),
    ):
        headway = float(draw.uniform(20.0, 60.0))
        s = begin + float(draw.uniform(0.0, headway))
        while s < end:
            length, width = (12.0, 2.5) if draw.random() < 0.2 else (4.5, 1.8)
            speed, desired, timer = draw.uniform((0.5 * most, 18.0, 0.0), (most, 33.0, 1.0))
            car = Car(s, (lane + 0.5) * WIDTH, speed, desired, timer=timer)
            cars.append(car._replace(length=length, width=width))
            s += headway + length + float(draw.exponential(0.5 * headway))
    return lay(PLACES["two ramps"].lines, cars)


@pytest.mark.parametrize("hours", [10, pytest.param(500, marks=pytest.mark.slow)])
def test_nobody_touches_another_where_two_ramps_join(hours: int) -> None:
    draw, driven_s, left = np.random.default_rng(hours), 0.0, 0
    while driven_s < 3600.0 * hours:
        rails = joining(draw)
        assert touching(rails, 3000, STEP) == 0
        left += int((rails.vehicles[:, n.S] < PLACES["two ramps"].behind).sum())
        driven_s += 300.0 * len(rails.vehicles)
    assert left == 0


# --- Motion along the line ------------------------------------------------------------------------


def test_alone_on_a_free_road_the_speed_is_that_of_idm_in_closed_form() -> None:
    """dv/dt = a (1 - (v / w)^4) gives t = w / 2a (artanh + arctan)(v / w), to first order."""
    wanted, seconds = 30.0, 8.0
    errors = []
    for step in (0.02, 0.01):
        rails = lay(Lines(STRAIGHT, TWO_LANES), [Car(0.0, RIGHT, 0.0, wanted)])
        share = float(driven(rails, seconds, step)[-1, 0, n.SPEED]) / wanted
        time = wanted / 6.0 * (math.atanh(share) + math.atan(share))
        errors.append(time - seconds)
    assert abs(errors[1]) < 0.01
    assert errors[1] / errors[0] == pytest.approx(0.5, abs=0.02)


def test_x_y_and_heading_are_those_of_the_place_beside_the_line() -> None:
    lines = Lines(BENT, RIGHT_ENDS)
    cars = [Car(50.0, RIGHT, 15.0, 25.0), Car(20.0, LEFT + 0.5, 20.0, 30.0)]
    rows = driven(lay(lines, cars), 40.0)
    assert (np.ptp(rows[:, :, k.D], axis=0) > 0.4).all()
    for before, after in zip(
        rows[:-1].reshape(-1, rows.shape[2]), rows[1:].reshape(-1, rows.shape[2]), strict=True
    ):
        x, y, heading = position(lines.segments, after[n.S], after[k.D])
        assert (after[n.X], after[n.Y]) == pytest.approx((x, y), abs=1e-9)
        # What it drove points where it heads, but for half of what it turned.
        way = math.hypot(after[n.X] - before[n.X], after[n.Y] - before[n.Y])
        if before[k.CURVATURE] == after[k.CURVATURE]:
            driven_m = 0.5 * STEP * (before[n.SPEED] + after[n.SPEED])
            assert way == pytest.approx(driven_m, abs=0.02)
        assert abs(wrap_to_pi(after[n.HEADING] - heading)) < 0.3
        if way > 0.5:
            to = math.atan2(after[n.Y] - before[n.Y], after[n.X] - before[n.X])
            middle = before[n.HEADING] + 0.5 * wrap_to_pi(after[n.HEADING] - before[n.HEADING])
            assert abs(wrap_to_pi(to - middle)) < 0.01


def test_against_a_mirrored_line_everybody_drives_alike() -> None:
    length = sum(length for length, _ in BENT)
    along = lay(
        Lines(BENT, RIGHT_ENDS), [Car(20.0 + 25.0 * i, RIGHT, 15.0, 20.0 + i) for i in range(8)]
    )
    mirrored = [Strip(-strip.left, -strip.right, way=-1.0) for strip in reversed(lanes(0, 1))]
    slabs = [(0.0, mirrored[:1]), (length - 800.0, mirrored)]
    back = [(piece, -bend) for piece, bend in reversed(BENT)]
    cars = [Car(length - 20.0 - 25.0 * i, -RIGHT, 15.0, 20.0 + i, way=-1.0) for i in range(8)]
    against = lay(Lines(back, slabs), cars)
    one, other = driven(along, 60.0), driven(against, 60.0)
    np.testing.assert_allclose(other[..., n.SPEED], one[..., n.SPEED], atol=1e-6)
    np.testing.assert_allclose(length - other[..., n.S], one[..., n.S], atol=1e-6)


def test_order_of_the_rows_changes_no_bit() -> None:
    draw = np.random.default_rng(3)
    cars = [
        Car(15.0 * i, (i % 2 + 0.5) * WIDTH, 15.0, 18.0 + 3.0 * (i % 4), timer=i * 0.37 % 1.0)
        for i in range(16)
    ]
    order = draw.permutation(16)
    lines = Lines(BENT, RIGHT_ENDS)
    one = driven(lay(lines, cars), 60.0)
    other = driven(lay(lines, [cars[i] for i in order], order), 60.0)
    np.testing.assert_array_equal(other, one[:, order])


def test_bends_are_driven_within_the_lateral_comfort() -> None:
    rows = driven(lay(Lines(BENT, TWO_LANES), [Car(0.0, LEFT, 25.0, 35.0)]), 40.0)[:, 0]
    bend = rows[:, k.CURVATURE] / (1.0 - rows[:, k.CURVATURE] * rows[:, k.D])
    lateral = abs(bend) * rows[:, n.SPEED] ** 2
    assert 2.5 < lateral.max() < k.LATERAL_COMFORT + 1e-6
    assert rows[:, n.ACCELERATION].min() > -k.EASY_BRAKING - 0.1


def test_who_keeps_the_lane_heeds_bends_as_who_may_leave_it() -> None:
    line = Lines(BENT, [(0.0, lanes(0))])
    one, other = (
        driven(lay(line, [Car(0.0, RIGHT, 25.0, 35.0, is_changing=may)]), 40.0)
        for may in (True, False)
    )
    assert np.array_equal(one[..., n.S], other[..., n.S])


# --- Lanes ----------------------------------------------------------------------------------------


def test_who_has_no_lane_to_go_on_in_stands_before_the_end() -> None:
    slabs = [(0.0, lanes(0, 1)), (800.0, [Strip(LEFT, LEFT + WIDTH, way=-1.0)])]
    vehicle = driven(lay(Lines(STRAIGHT, slabs), [Car(0.0, RIGHT, 20.0, 30.0)]), 120.0)[-1, 0]
    assert vehicle[n.SPEED] < 0.01
    assert 797.0 < vehicle[n.S] + vehicle[k.HALF] + k.LEAST_WAY < 800.5


@pytest.mark.parametrize(("slabs", "changes"), [(TWO_LANES, False), (RIGHT_ENDS, True)])
def test_who_keeps_the_lane_changes_only_where_it_ends(
    slabs: list[tuple[float, list[Strip]]],
    changes: bool,  # noqa: FBT001 - of a table
) -> None:
    cars = [Car(0.0, RIGHT, 25.0, 30.0, is_changing=False), Car(60.0, RIGHT, 5.0, 5.0)]
    rows = driven(lay(Lines(STRAIGHT, slabs), cars), 200.0)[:, 0]
    assert rows[-1, k.D] == (LEFT if changes else RIGHT)
    assert (rows[rows[:, n.S] < 800.0 - k.NEEDED, k.D] == RIGHT).all()


def test_number_of_a_lane_stays_where_the_one_right_of_it_ends() -> None:
    rails = lay(Lines(STRAIGHT, RIGHT_ENDS), [])
    assert rails.lanes[:2, k.COUNT].tolist() == [1.0, 2.0]
    assert rails.lanes[:2, k.TO].tolist() == [800.0, math.inf]


def test_tapered_lane_ends_where_it_is_too_narrow() -> None:
    taper = Strip(0.0, WIDTH, right_slope=WIDTH / 100.0)
    slabs = [(0.0, lanes(0, 1)), (700.0, [taper, *lanes(1)]), (800.0, lanes(1))]
    rails = lay(Lines(STRAIGHT, slabs), [])
    assert rails.lanes[0, k.TO] == pytest.approx(700.0 + 100.0 * (1.0 - LEAST_LANE / WIDTH))


def test_lane_that_two_changes_lead_out_of_counts_as_shorter() -> None:
    rails = lay(Lines(STRAIGHT, [(0.0, lanes(0, 1, 2)), (800.0, lanes(2))]), [])
    assert rails.lanes[:3, k.TO].tolist() == [800.0 - k.MORE_CHANGES, 800.0, math.inf]


def test_what_others_move_stands_in_every_lane_that_its_body_covers() -> None:
    placed = [
        Car(100.0, d, 20.0, 20.0, way, role=n.PLACED)
        for d, way in ((RIGHT, 1.0), (WIDTH - 0.8, 1.0), (LEFT, -1.0))
    ]
    rails = lay(Lines(BENT, TWO_LANES), placed)
    assert rails.marks[:, k.LANES].tolist() == [0b01, 0b11, 0b10]
    assert rails.vehicles[:, k.ALONG] == pytest.approx([20.0, 20.0, -20.0])


def test_what_jumps_stands_in_the_lanes_of_its_new_place() -> None:
    tapers = [Strip(0.0, WIDTH, right_slope=0.02), Strip(WIDTH, 2.0 * WIDTH, left_slope=-0.01)]
    slabs = [(0.0, lanes(1)), (200.0, lanes(0, 1)), *((s, tapers) for s in (400.0, 450.0, 500.0))]
    lines = Lines(STRAIGHT, [*slabs, (600.0, lanes(1, 2)), (900.0, lanes(2))])
    thing = Car(0.0, LEFT, 20.0, 20.0, role=n.PLACED)
    rails, found = lay(lines, [thing]), set()
    for s in (50.0, 950.0, 410.0, -20.0, 700.0, 460.0, 5000.0, 250.0, 595.0):
        for d in (RIGHT, WIDTH - 0.95, WIDTH, LEFT, 2.5 * WIDTH):
            k.show_thing(rails, 0, s, d, 0.0, 20.0)
            fresh = lay(lines, [thing._replace(s=s, d=d)])
            assert rails.marks[0, k.LANES] == fresh.marks[0, k.LANES], (s, d)
            found.add(int(rails.marks[0, k.LANES]))
    assert len(found) >= 4


def test_gaps_run_along_the_drivers_own_lane() -> None:
    lines = Lines(BENT, TWO_LANES)
    rails = lay(lines, [Car(280.0, LEFT, 10.0, 10.0), Car(390.0, LEFT, 10.0, 10.0)])
    (_, _, heading), (_, _, other) = (position(lines.segments, s, 0.0) for s in (280.0, 390.0))
    way = lane_way(280.0, heading, LEFT, 390.0, other)
    assert k._gap(rails.vehicles, 0, 1, 1.0) == pytest.approx(way - 4.5)


# --- Beside SUMO ----------------------------------------------------------------------------------

# benchmarks/lane_ends.py with SUMO 1.28.0.
SUMO = {
    "lane end": {"passed": 40, "flow_per_h": 1283.0, "queue": 25, "time_s": 92.0},
    "bend": {"passed": 30, "flow_per_h": 1238.0, "queue": 17, "time_s": 72.0},
    "two ramps": {"passed": 52, "flow_per_h": 2009.0, "queue": 20, "time_s": 83.0},
}


@pytest.mark.parametrize("place", SUMO)
def test_narrow_places_are_passed_as_by_the_drivers_of_sumo(place: str) -> None:
    figures = count_rails(PLACES[place])
    for name, expected in SUMO[place].items():
        assert figures[name] == pytest.approx(expected, rel=0.15), name
