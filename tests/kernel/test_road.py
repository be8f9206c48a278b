"""Roads: a place and its point are inverse to each other, on every kind of road."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from adeye.kernel import criticality, road
from adeye.kernel.storyboard import advance
from adeye.signals import REFUGE_KINDS
from tests.kernel.stop_limits import GROUND
from tests.kernel.test_strips import SLABS, STRIPS

Floats = NDArray[np.float64]


def chain(*pieces: tuple[float, float], heading: float = 0.0) -> Floats:
    """Join (length, curvature) pieces, each from the end of the one before."""
    rows = []
    x, y = 12.0, -7.0
    for length, curvature in pieces:
        rows.append((x, y, heading, length, curvature))
        steps = 20000
        for k in range(steps):
            middle = heading + curvature * length * (k + 0.5) / steps
            x += length / steps * math.cos(middle)
            y += length / steps * math.sin(middle)
        heading += curvature * length
    return np.array(rows)


ROADS = {
    "straight": chain((1000.0, 0.0)),
    "oblique": chain((400.0, 0.0), heading=2.9),
    "left_curve": chain((100.0, 0.0), (300.0, 1.0 / 250.0), (500.0, 0.0)),
    "right_curve": chain((100.0, 0.0), (300.0, -1.0 / 250.0), (500.0, 0.0)),
    "s_curve": chain((100.0, 0.0), (200.0, 0.004), (200.0, -0.004), (300.0, 0.0), heading=-1.0),
    "lone_arc": chain((500.0, 0.003)),
    "wide_arc": chain((1000.0, 1e-9)),
}


@pytest.mark.parametrize("name", ROADS)
def test_point_of_a_place_is_at_that_place(name: str) -> None:
    for d in (-3.0, 0.0, 1.75, 5.25, 14.0):
        segments = ROADS[name]
        end = road.road_length(segments)
        for s in (-30.0, -1e-6, 0.0, 55.0, 100.0, 150.0, 299.9, 0.99 * end, end, end + 40.0):
            x, y, heading = road.position(segments, s, d)
            back_s, back_d, back_heading, _ = road.local(segments, x, y)
            assert back_s == pytest.approx(s, abs=2e-6)
            assert back_d == pytest.approx(d, abs=2e-6)
            assert back_heading == pytest.approx(heading, abs=1e-7)


def test_of_many_segments_the_place_is_the_nearest_of_theirs() -> None:
    draw = np.random.default_rng(5)
    line = chain(*zip(draw.uniform(3.0, 40.0, 30), draw.uniform(-0.02, 0.02, 30), strict=True))
    before = np.concatenate([[0.0], np.cumsum(line[:, 3])])
    for s, d in zip(draw.uniform(-50.0, 700.0, 300), draw.uniform(-12.0, 12.0, 300), strict=True):
        x, y, _ = road.position(line, s, d)
        places = []
        for k in range(30):
            way, aside, heading, curvature = road.local(line[k : k + 1], x, y)
            beyond = max(0.0, -way if k > 0 else 0.0, way - line[k, 3] if k < 29 else 0.0)
            error = aside * aside + beyond * beyond
            places.append((error, before[k] + way, aside, heading, curvature))
        assert road.local(line, x, y) == pytest.approx(min(places)[1:], abs=1e-9)


def test_other_way_of_a_hairpin_is_not_taken_for_this_one() -> None:
    turn = [(9.5, 1.0 / 24.0)] * 8
    line = chain((650.0, 0.0), *turn, (650.0, 0.0))
    assert len(line) > road.MANY
    guide = np.zeros((len(line), road.GUIDE_WIDTH))
    road.lay_guide(line, guide)
    for near, s in enumerate((3.0, 300.0, 600.0, 649.0, 700.0, 727.0, 900.0, 1300.0, 1370.0)):
        for d in (-9.0, 0.0, 5.0, 15.0):
            x, y, heading = road.position(line, s, d)
            for found in (road.local(line, x, y), road.local_near(line, guide, near, x, y)):
                assert found[:2] == pytest.approx((s, d), abs=1e-6)
                assert math.cos(found[2] - heading) == pytest.approx(1.0)


def nearest_of(line: Floats, x: float, y: float) -> float:
    """Return how near a line of many segments comes to a point between its ends."""
    found = []
    for k in range(len(line)):
        s, d, *_ = road.local(line[k : k + 1], x, y)
        if 0.0 <= s <= line[k, 3]:
            found.append(abs(d))
        found.append(math.hypot(x - line[k, 0], y - line[k, 1]))
    return min(found)


def test_nearest_part_of_a_line_is_found_however_it_turns() -> None:
    draw = np.random.default_rng(3)
    for _ in range(40):
        # Straights and bends of ten metres to hundreds, hairpins among them.
        pieces: list[tuple[float, float]] = []
        while len(pieces) <= road.MANY:
            radius, angle = draw.uniform(25.0, 120.0), draw.uniform(-2.8, 2.8)
            pieces += [(draw.uniform(10.0, 600.0), 0.0)]
            pieces += [(abs(angle) * radius, math.copysign(1.0 / radius, angle))]
        line = chain(*pieces)
        guide = np.zeros((len(line), road.GUIDE_WIDTH))
        road.lay_guide(line, guide)
        for s in draw.uniform(20.0, road.road_length(line) - 20.0, 60):
            x, y, _ = road.position(line, s, draw.uniform(-15.0, 15.0))
            found = road.local(line, x, y)
            if 0.0 <= found[0] <= road.road_length(line):
                assert abs(found[1]) == pytest.approx(nearest_of(line, x, y), abs=1e-8)
            near = int(draw.integers(len(line)))
            assert road.local_near(line, guide, near, x, y)[:4] == found


def test_guide_tells_how_far_each_begin_is_from_all_but_its_neighbours() -> None:
    draw = np.random.default_rng(17)
    bends = draw.uniform(-0.01, 0.01, 12)
    line = chain(*zip(draw.uniform(5.0, 60.0, 12), bends, strict=True))
    guide = np.zeros((12, road.GUIDE_WIDTH))
    road.lay_guide(line, guide)
    points = np.vstack([line[:, :2], road.position(line[11:], line[11, 3], 0.0)[:2]])
    lengths = line[:, 3]
    assert guide[:, road.GUIDE_S] == pytest.approx(np.cumsum(lengths) - lengths)
    for k in range(12):
        ways = np.hypot(*(points - points[k]).T)
        # Of a segment no point is nearer than half of what its ends are farther than it is long.
        least = 0.5 * (ways[:-1] + ways[1:] - lengths)
        beside = np.abs(np.arange(12) - k) <= 2
        assert guide[k, road.GUIDE_NEAR] == pytest.approx(0.5 * least[~beside].min() - 1e-3)
        assert guide[k, road.GUIDE_BEND] == np.abs(bends[beside]).max()
        assert guide[k, road.GUIDE_SINE : road.GUIDE_COSINE + 1] == pytest.approx(
            [math.sin(line[k, 2]), math.cos(line[k, 2])]
        )


def test_whatever_segment_is_guessed_the_place_is_the_same_to_the_bit() -> None:
    draw = np.random.default_rng(11)
    # With loops, so that parts of the line that are far apart along it lie beside each other.
    for most in (0.004, 0.03):
        bends = draw.uniform(-most / 4, most, 40)
        line = chain(*zip(draw.uniform(1.0, 60.0, 40), bends, strict=True))
        guide = np.zeros((40, road.GUIDE_WIDTH))
        road.lay_guide(line, guide)
        assert (guide[:, road.GUIDE_NEAR] > 0.0).any()
        for s, d in zip(draw.uniform(-60.0, 1300.0, 300), draw.normal(0.0, 60.0, 300), strict=True):
            x, y, _ = road.position(line, s, d)
            expected = road.local(line, x, y)
            *at_first, beside = road.local_near(line, guide, int(draw.integers(40)), x, y)
            *again, same = road.local_near(line, guide, beside, x, y)
            assert tuple(at_first) == tuple(again) == expected
            assert beside == same
            assert guide[beside, road.GUIDE_S] <= expected[0] + 1e-9 or beside == 0


def test_straight_road_is_its_frame() -> None:
    straight = np.array([[0.0, 0.0, 0.0, 100.0, 0.0]])
    assert road.position(straight, 30.0, 1.75) == (30.0, 1.75, 0.0)
    assert road.local(straight, 30.0, 1.75) == (30.0, 1.75, 0.0, 0.0)
    assert road.position(straight, -5.0, 0.0) == (-5.0, 0.0, 0.0)
    assert road.position(straight, 130.0, 0.0) == (130.0, 0.0, 0.0)


def test_quarter_circle_to_the_left_ends_up_north() -> None:
    quarter = np.array([[0.0, 0.0, 0.0, 50.0 * math.pi, 0.01]])
    x, y, heading = road.position(quarter, 50.0 * math.pi, 10.0)
    assert (x, y) == pytest.approx((90.0, 100.0), abs=1e-9)
    assert heading == pytest.approx(math.pi / 2, rel=1e-14)


def test_left_is_positive_on_a_right_curve() -> None:
    curve = np.array([[0.0, 0.0, 0.0, 100.0, -0.01]])
    s, d, heading, curvature = road.local(curve, 0.0, 2.0)
    assert (s, d, heading, curvature) == pytest.approx((0.0, 2.0, 0.0, -0.01), abs=1e-12)


@pytest.mark.slow
def test_curvature_is_that_of_the_segment() -> None:
    segments = ROADS["s_curve"]
    curvatures = [
        road.local(segments, *road.position(segments, s, 2.0)[:2])[3] for s in (50, 150, 350, 650)
    ]
    assert curvatures == [0.0, 0.004, -0.004, 0.0]


def test_headings_stay_within_half_a_turn() -> None:
    winding = chain((700.0, 0.008))
    for s in np.linspace(0.0, 700.0, 71):
        assert -math.pi < road.position(winding, s, 0.0)[2] <= math.pi


def test_unknown_point_has_no_place() -> None:
    assert all(math.isnan(value) for value in road.local(ROADS["s_curve"], math.nan, 0.0))
    assert math.isnan(road.position(ROADS["s_curve"], math.nan, 0.0)[0])


def test_inner_lane_of_a_left_curve_is_tighter() -> None:
    assert road.offset_curvature(0.01, 20.0) == pytest.approx(1.0 / 80.0, rel=1e-15)
    assert road.offset_curvature(-0.01, 20.0) == pytest.approx(-1.0 / 120.0, rel=1e-15)
    assert road.offset_curvature(0.0, 20.0) == 0.0
    assert math.isnan(road.offset_curvature(0.01, 100.0))


def test_lanes_are_counted_from_the_right() -> None:
    places = (0.0, 1.75, 3.5, 5.0, 10.49, -0.01, 10.5, 99.0, math.nan)
    lanes = [road.lane_of(GROUND, 0.0, d) for d in places]
    assert lanes == [0, 0, 1, 1, 2, -1, -1, -1, -1]


def test_place_off_the_lanes_belongs_to_the_outermost_lane() -> None:
    for d, lane in ((-1.0, 0), (0.0, 0), (3.6, 1), (10.4, 2), (12.0, 2)):
        assert road.lane_at(GROUND, 0.0, d) == lane
        assert road.center_at(GROUND, 0.0, d) == 3.5 * lane + 1.75


def test_lane_change_ends_at_the_next_centre_that_way() -> None:
    for d, sideways, goal in (
        (8.6, -1.0, 5.25),
        (8.8, -1.0, 8.75),
        (5.25, 1.0, 8.75),
        (2.0, -1.0, 1.75),
        (1.0, -1.0, -math.inf),
        (9.0, 1.0, math.inf),
    ):
        assert road.center_ahead(GROUND, 0.0, d, sideways) == goal, (d, sideways)


@pytest.mark.parametrize("width", [2.9, 3.1, 3.5, 3.7])
def test_centre_of_a_lane_is_in_it_up_to_its_edges(width: float) -> None:
    ground = GROUND._replace(lane_width=width, lanes=4)
    for lane in range(4):
        assert road.lane_of(ground, 0.0, road.lane_center(ground, 0.0, lane)) == lane
    assert road.lane_of(ground, 0.0, math.nextafter(4 * width, 0.0)) == 3


def way(segments: Floats, s: float, d: float, other_s: float) -> float:
    headings = [road.position(segments, place, 0.0)[2] for place in (s, other_s)]
    return road.lane_way(s, headings[0], d, other_s, headings[1])


@pytest.mark.parametrize("name", ROADS)
@pytest.mark.parametrize("d", [-3.0, 0.0, 8.75, 14.0])
def test_way_along_a_lane_is_the_length_of_its_line(name: str, d: float) -> None:
    segments = ROADS[name]
    for first, last in ((20.0, 390.0), (120.0, 380.0), (-30.0, 60.0), (390.0, 150.0)):
        points = np.array(
            [road.position(segments, s, d)[:2] for s in np.linspace(first, last, 2001)]
        )
        length = np.hypot(*np.diff(points, axis=0).T).sum()
        assert abs(way(segments, first, d, last)) == pytest.approx(length, abs=1e-4)
        assert way(segments, last, d, first) == pytest.approx(-way(segments, first, d, last))
        assert (way(segments, first, d, last) > 0.0) == (last > first)


def test_way_along_a_straight_is_that_along_the_road_to_the_bit() -> None:
    generator = np.random.Generator(np.random.Philox(5))
    for s, other, d in generator.uniform(0.0, 390.0, (200, 3)):
        for name in ("straight", "oblique"):
            assert way(ROADS[name], s, d, other) == other - s


def test_place_at_the_end_of_a_way_is_that_far_along_the_lane() -> None:
    for name in ("left_curve", "s_curve"):
        for length in (200.0, 13.7, -90.0):
            end = advance(ROADS[name], 150.0, 8.75, length)
            assert way(ROADS[name], 150.0, 8.75, end) == pytest.approx(length, abs=1e-6)


def test_at_the_centre_of_a_bend_no_way_is_left_and_beyond_an_unknown_place_none_is_known() -> None:
    assert road.lane_way(0.0, 0.0, 300.0, 50.0, 0.2) == 0.0
    for bad in range(5):
        numbers = [0.0, 0.0, 5.0, 50.0, 0.2]
        numbers[bad] = math.nan
        assert math.isnan(road.lane_way(*numbers))


# --- Bays beside the road: linear tapers, edges, and whether a body is on the road or inside ------

BAY = np.array([0.0, 400.0, 60.0, 4.0, 20.0])
TWO = np.array([BAY, [1.0, 600.0, 100.0, 8.0, 0.0]])
NONE = np.zeros((0, 5))


def test_kinds_are_numbered_as_they_are_named() -> None:
    assert (REFUGE_KINDS[road.PARKING_BAY], REFUGE_KINDS[road.REST_AREA]) == (
        "parking_bay",
        "rest_area",
    )


def test_depth_is_linear_over_the_tapers() -> None:
    places = (379.9, 380.0, 385.0, 390.0, 400.0, 460.0, 465.0, 480.0, 1000.0)
    depths = [road.depth_at(BAY, s) for s in places]
    assert depths == pytest.approx([0.0, 0.0, 1.0, 2.0, 4.0, 4.0, 3.0, 0.0, 0.0])


def test_a_taper_without_length_is_a_step() -> None:
    assert [road.refuge_depth(TWO, s) for s in (599.9, 600.0, 700.0, 700.1)] == [0.0, 8.0, 8.0, 0.0]


def test_the_edge_is_that_of_shoulder_bay_or_verge() -> None:
    verge = GROUND._replace(refuges=TWO, verge=1.0)
    assert road.right_edge(GROUND, 0.0) == -2.5
    assert road.right_edge(verge, 0.0) == -3.5
    assert road.right_edge(verge, 430.0) == -6.5
    # The bay lies in the verge.
    assert road.right_edge(verge, 382.5) == -3.5


def test_a_body_keeps_its_corners_on_the_road() -> None:
    bays = GROUND._replace(refuges=TWO)
    straight = road.body_edge(GROUND, 0.0, 0.0, 4.5, 1.8)
    assert straight == pytest.approx(0.9 - 2.5)
    for slope in (-0.2, 0.2):
        turned = road.body_edge(GROUND, 0.0, slope, 4.5, 1.8)
        assert turned == pytest.approx(straight + 0.45)
    # Of the corners in the taper the rear one has less room, unless the body is turned into it.
    assert road.body_edge(bays, 390.0, 0.0, 4.5, 1.8) == pytest.approx(0.9 - 2.5 - 1.55)
    assert road.body_edge(bays, 390.0, -0.2, 4.5, 1.8) == pytest.approx(0.9 - 2.5 - 2.0)


BODIES: list[tuple[float, float, float, bool]] = [
    (430.0, -4.5, 0.0, True),
    (430.0, -3.4, 0.0, True),
    (430.0, -3.3, 0.0, False),
    (430.0, -5.7, 0.0, False),
    (430.0, -3.4, 0.1, False),
    (392.0, -3.4, 0.0, True),
    (386.0, -3.4, 0.0, False),
    (300.0, -3.4, 0.0, False),
]
"""Place along and across, slope, and whether it is inside."""


def test_a_body_is_in_a_bay_with_all_of_its_corners() -> None:
    for s, d, slope, inside in BODIES:
        assert road.is_in_refuge(GROUND, BAY, s, d, slope, 4.5, 1.8) == inside, (s, d, slope)


def grounds(*beside: tuple[float, float]) -> road.Grounds:
    """Return roads with bays, of each the width of its shoulder and of its verge."""
    runs = len(beside)
    shoulder, verge = np.array(beside).T.copy()
    lines, bays = np.tile(GROUND.segments, (runs, 1, 1)), np.tile(TWO, (runs, 1, 1))
    width, limit = np.full(runs, 3.5), np.full(runs, 36.1)
    across = [np.zeros((runs, 0, width)) for width in (4, 8, 4, 2, 4)]
    return road.Grounds(lines, bays, width, 3, shoulder, verge, limit, *across)


def test_places_on_the_road_are_marked_run_by_run() -> None:
    s = np.array([[430.0, 430.0, 430.0, 300.0, 300.0, math.nan]] * 2)
    d = np.array([[10.5, 10.6, -6.0, -6.0, -3.0, math.nan]] * 2)
    marks = road.mark_on_road(grounds((2.5, 0.0), (0.0, 3.0)), 0.0, s, d)
    assert marks.tolist() == [
        [True, False, True, False, False, False],
        [True, False, False, False, True, False],
    ]


def columns(s: Floats, d: Floats) -> tuple[Floats, Floats]:
    """Return places as a trace has them, beside each other, for which the kernel is compiled."""
    places = np.stack([s, d], axis=-1)
    return places[..., 0], places[..., 1]


def test_a_place_is_part_of_what_is_there_and_asks_what_holds_there() -> None:
    ways = grounds((2.5, 1.0))._replace(slabs=SLABS[np.newaxis], strips=STRIPS[np.newaxis])
    s = np.full((1, 8), 50.0)
    d = np.array([[1.0, 1.0, 4.0, -1.0, 7.5, 6.7, -3.0, -4.0]])
    align = np.array([[0.0, 3.0, 3.0, 3.0, 0.0, 0.0, 0.0, 0.0]])
    rules = road.road_rules(ways, *columns(s, d), align)[0]
    assert [road.PARTS[int(part)] for part in rules[:, road.RULE_PART]] == [
        *("driving", "driving", "oncoming", "shoulder", "walking", "off", "other", "off")
    ]
    assert rules[:, road.RULE_WRONG_WAY].tolist() == [0, 1, 1, 0, 0, 0, 0, 0]
    assert rules[:, road.RULE_LIMIT].tolist() == [20.0] * 8
    place = columns(np.full((1, 1), 430.0), np.full((1, 1), -3.0))
    bay = road.road_rules(grounds((2.5, 0.0)), *place, 0 * d)
    assert road.PARTS[int(bay[0, 0, road.RULE_PART])] == "parking"


@pytest.mark.slow
def test_bodies_in_refuges_are_marked_run_by_run() -> None:
    s, d = np.array([[430.0, 650.0, 500.0]]), np.full((1, 3), -4.5)
    size = np.array([[4.5, 1.8, 1.5]])
    for turn, inside in ((0.0, [True, True, False]), (0.5 * math.pi, [False] * 3)):
        marks = road.mark_in_refuge(grounds((2.5, 0.0)), size, s, d, np.full((1, 3), turn))
        assert marks.tolist() == [inside]


def test_the_width_of_a_bay_in_a_curve_is_across_the_road() -> None:
    """Road coordinates bend with the road: the edge of a bay is a line of equal distance."""
    segments = np.array([[0.0, 0.0, 0.0, 900.0, 1.0 / 600.0]])
    for s in (400.0, 430.0, 460.0):
        inner = road.position(segments, s, road.right_edge(GROUND, s))
        outer = road.position(segments, s, road.right_edge(GROUND._replace(refuges=TWO), s))
        assert math.dist(inner[:2], outer[:2]) == pytest.approx(4.0)


def test_a_faster_one_behind_closes() -> None:
    assert criticality.road_ttc(-10.0, 20.0, 25.0) == 2.0
    assert criticality.road_ttc(-10.0, 20.0, 20.0) == math.inf
    assert criticality.road_ttc(10.0, 0.0, 0.0) == math.inf
    assert criticality.road_ttc(10.0, 20.0, -5.0) == 0.4


def test_a_gap_has_the_sign_of_where_the_other_is() -> None:
    assert criticality.road_gap(10.0, 2.0, 3.0) == 5.0
    assert criticality.road_gap(-10.0, 2.0, 3.0) == -5.0
    assert criticality.road_gap(4.0, 2.0, 3.0) == 0.0


def test_a_box_across_the_road_takes_its_width_along_it() -> None:
    size = np.array([12.0, 2.5, 3.8])
    assert criticality.road_extent(size, 0.0) == 6.0
    assert criticality.road_extent(size, math.pi / 2) == pytest.approx(1.25)
    assert criticality.road_extent(size, math.pi) == pytest.approx(6.0)
