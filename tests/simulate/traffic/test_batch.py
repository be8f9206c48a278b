"""The compiled traffic is the reference traffic, and a run is the same in any batch."""

from functools import partial
from typing import Any

import numpy as np
import pytest

from adeye.errors import SpecError, UsageError
from adeye.kernel.road import position
from adeye.kernel.traffic import network
from adeye.kernel.traffic.network import ALONGSIDE
from adeye.signals import OBJECT_SPEED, PLACE_OFFSET, PLACE_S, Floats, Scene
from adeye.simulate.traffic import make_traffic, variant_of
from adeye.simulate.traffic.batch import BatchTraffic, build_lanes
from adeye.simulate.traffic.highway import HighwayTraffic
from adeye.simulate.traffic.stage import locate_all
from adeye.sweep.case import TestCase
from tests.motorway import make_case, make_scenario

SAME = 1e-9
VARIANTS = ["reference", "fast"]


def car(lane: int, s: str, speed: str, desired: str, **more: Any) -> dict[str, Any]:
    return {
        "kind": "car",
        "start": {"lane": lane, "s": s, "speed": speed},
        "reactive": {"desired_speed": desired, "lane_changes": True},
        **more,
    }


DENSE: dict[str, Any] = {
    "a_slow": car(1, "320 m", "18 m/s", "18 m/s"),
    "b_fast": car(1, "270 m", "28 m/s", "33 m/s"),
    "c_right": car(0, "300 m", "22 m/s", "24 m/s"),
    "d_left": car(2, "290 m", "24 m/s", "26 m/s"),
    "e_last": car(0, "230 m", "25 m/s", "30 m/s"),
    "truck": {
        "kind": "truck",
        "start": {"lane": 0, "s": "380 m", "speed": "16 m/s"},
        "reactive": {"desired_speed": "20 m/s"},
    },
    "van": {"kind": "van", "start": {"lane": 2, "s": "400 m", "speed": "20 m/s"}},
}
# Enough for sorted lists.
MANY: dict[str, Any] = {
    f"car_{k:02}": car(k % 2, f"{240 + 14 * k} m", f"{20 + k % 5} m/s", f"{22 + 3 * (k % 4)} m/s")
    for k in range(16)
}
PARKED = {
    "kind": "parked_truck",
    "s": "700 m",
    "offset": "1.75 m",
    "length": "12 m",
    "width": "2.5 m",
    "height": "3.8 m",
}
S_CURVE = {"road": {"kind": "s_curve", "radius": "600 m", "length": "1200 m"}}


def worlds() -> dict[str, dict[str, Any]]:
    right = {"road": {**S_CURVE["road"], "radius": "-600 m"}}
    changes: dict[str, dict[str, Any]] = {
        "dense": {},
        "many": {"actors": MANY},
        "object": {"world": {"objects": {"truck": PARKED}}},
        "left": {"world": S_CURVE},
        "right": {"world": right},
    }
    usual = {"actors": DENSE, "ego": {"speed": "10 m/s"}}
    return {name: usual | change for name, change in changes.items()}


def drive(
    traffic: Any, cases: list[TestCase], ticks: int, command: tuple[float, float] = (0.0, 0.0)
) -> Floats:
    """Return the object states (B, ticks + 1, M, 5)."""
    _, scene = traffic.reset(cases)
    rows = [scene.objects]
    rows += [traffic.step(np.tile(command, (len(cases), 1))).objects for _ in range(ticks)]
    return np.stack(rows, axis=1)


@pytest.mark.slow
@pytest.mark.parametrize("world", worlds())
@pytest.mark.parametrize("variant", VARIANTS)
def test_it_is_the_reference_traffic_to_a_billionth(world: str, variant: str) -> None:
    case = make_case(make_scenario(**worlds()[world], horizon="30 s"))
    ours = drive(BatchTraffic(variant), [case], 300)[0]
    theirs = drive(HighwayTraffic(), [case], 300)[0]
    # Below half a metre a second the reference's steering is ill-conditioned.
    moving = theirs[:, [k for k in range(theirs.shape[1]) if theirs[0, k, 3] > 0.0], 3]
    slow = (moving <= 0.5).any(axis=1)
    until = int(np.argmax(slow)) if slow.any() else len(slow)
    assert until > 100
    np.testing.assert_allclose(ours[:until], theirs[:until], rtol=0, atol=SAME)
    # Somebody changed lanes.
    assert np.ptp(theirs[:until, :5, 1], axis=0).max() > 3.0


def test_only_a_straight_road_has_its_lanes_alongside() -> None:
    for world, content in worlds().items():
        traffic = BatchTraffic("fast")
        traffic.reset([make_case(make_scenario(**content, horizon="30 s"))])
        is_straight = world not in ("left", "right")
        assert (traffic._roads.lanes[..., ALONGSIDE] == float(is_straight)).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    "make", [*(partial(BatchTraffic, variant) for variant in VARIANTS), HighwayTraffic]
)
def test_a_run_has_the_same_bits_alone_and_in_a_batch_of_any_order(make: Any) -> None:
    scenario = make_scenario(actors=DENSE)
    cases = [make_case(scenario, {"ego_speed": speed}) for speed in np.linspace(20.0, 35.0, 6)]
    together = drive(make(), cases, 60)
    turned = drive(make(), cases[::-1], 60)
    np.testing.assert_array_equal(turned[::-1], together)
    for run, case in enumerate(cases):
        np.testing.assert_array_equal(drive(make(), [case], 60)[0], together[run])


@pytest.mark.parametrize("curvature", [0.0, 1.0 / 300.0, -1.0 / 300.0])
def test_lanes_lie_beside_the_reference_line(curvature: float) -> None:
    segments = np.array([[10.0, -4.0, 0.3, 90.0, 0.0], [0.0, 0.0, 0.3, 150.0, curvature]])
    segments[1, :2] = position(segments, 90.0, 0.0)[:2]
    links = network.build_links([(0, 1, 2), (1, 2, 2)])
    found = np.zeros((1, 4, network.LANE_WIDTH))
    build_lanes(segments[np.newaxis], links, np.array([3.5]), 20.0, found)
    for lane, (s, length) in enumerate([(-20.0, 110.0)] * 2 + [(90.0, 150.0)] * 2):
        d = (5.25, 1.75)[lane % 2]
        way = length * (1.0 - curvature * d * (lane > 1))
        assert found[0, lane, network.LANE_LENGTH] == pytest.approx(way)
        for share in (0.0, 0.4, 1.0):
            point = network.lane_point(found[0], lane, share * way, 0.0)
            on_road = position(segments, s + share * length, d)[:2]
            assert point == pytest.approx(on_road, abs=1e-9), (lane, share)


@pytest.mark.slow
def test_a_second_reset_begins_anew() -> None:
    traffic = BatchTraffic()
    case = make_case(make_scenario(actors=DENSE))
    first = drive(traffic, [case], 40)
    np.testing.assert_array_equal(drive(traffic, [case], 40), first)


@pytest.mark.slow
def test_the_variants_are_two_arithmetics() -> None:
    case = make_case(make_scenario(actors=DENSE, ego={"speed": "10 m/s"}, horizon="20 s"))
    reference, fast = (drive(BatchTraffic(variant), [case], 300) for variant in VARIANTS)
    assert not np.array_equal(reference, fast)
    assert BatchTraffic("fast").variant == variant_of("batch", "fast") != variant_of("batch")


def test_a_variant_may_be_named_with_its_version() -> None:
    for variant in VARIANTS:
        full = variant_of("batch", variant)
        assert BatchTraffic(full).variant == full
    assert make_traffic("batch").variant == variant_of("batch", "reference")


def test_an_unknown_variant_is_refused() -> None:
    with pytest.raises(UsageError, match="has no variant 'quick'"):
        BatchTraffic("quick")


def test_a_driver_brakes_for_the_ego() -> None:
    start = {"lane": 1, "s": "170 m", "speed": "25 m/s"}
    follower = {"kind": "car", "start": start, "reactive": {"desired_speed": "25 m/s"}}
    followed = []
    for lane in (1, 2):
        ego = {"lane": lane, "speed": "20 m/s"}
        scenario = make_scenario(actors={"follower": follower}, ego=ego)
        followed.append(drive(BatchTraffic(), [make_case(scenario)], 60, (-3.0, 0.0))[0, -1, 0, 3])
    behind_the_ego, beside_it = followed
    assert beside_it == pytest.approx(25.0, abs=1e-9)
    assert behind_the_ego < 18.0


TRAFFICS = pytest.mark.parametrize("make", [BatchTraffic, HighwayTraffic])


@TRAFFICS
def test_a_driver_brakes_for_a_scripted_actor_and_for_a_static_object(make: Any) -> None:
    start = {"lane": 0, "s": "300 m", "speed": "20 m/s"}
    follower = {"kind": "car", "start": start, "reactive": {}}
    ahead = {"kind": "truck", "start": {"lane": 0, "s": "350 m", "speed": "8 m/s"}}
    case = make_case(make_scenario(actors={"ahead": ahead, "follower": follower}, horizon="30 s"))
    last = drive(make(), [case], 500)[0, -1]
    assert last[1, 3] == pytest.approx(8.0, abs=0.05)
    world = {"objects": {"truck": PARKED}}
    scenario = make_scenario(actors={"follower": follower}, world=world, horizon="60 s")
    states = drive(make(), [make_case(scenario)], 1000)[0]
    gap = 700.0 - states[-1, 0, 0] - 6.0 - 2.25
    # It never reverses.
    assert states[:, 0, 3].min() >= 0.0
    assert 3.0 < gap < 5.5


@TRAFFICS
def test_a_run_that_has_ended_is_frozen_and_the_others_go_on(make: Any) -> None:
    free = make_scenario(actors=DENSE, ego={"lane": 1}, horizon="5 s")
    near = make_scenario(actors=DENSE, ego={"lane": 1, "s": "262 m"}, horizon="5 s")
    traffic = make()
    traffic.reset([make_case(near, {"ego_speed": 45.0}), make_case(free)])
    scenes: list[Scene] = []
    while traffic.ending.running.any():
        scenes.append(traffic.step(np.zeros((2, 2))))
    ended = next(k for k, scene in enumerate(scenes) if not scene.running[0])
    assert ended < len(scenes) - 1
    assert traffic.ending.complete.tolist() == [False, True]
    assert traffic.ending.running.tolist() == [False, False]
    assert traffic.ending.arrived.tolist() == [False, False]
    assert traffic.ending.horizon_row.tolist() == [ended + 1, 100]
    np.testing.assert_array_equal(scenes[ended].objects[0], scenes[-1].objects[0])
    assert not np.array_equal(scenes[ended].objects[1], scenes[-1].objects[1])


def test_scripted_actors_alone_move_as_in_the_reference_traffic() -> None:
    actors = {"van": {"kind": "van", "start": {"lane": 2, "s": "400 m", "speed": "20 m/s"}}}
    case = make_case(make_scenario(actors=actors))
    ours = drive(BatchTraffic(), [case], 50)
    np.testing.assert_array_equal(ours, drive(HighwayTraffic(), [case], 50))
    assert ours[0, -1, 0, 0] == pytest.approx(400.0 + 20.0 * 2.5)


@TRAFFICS
def test_timers_follow_the_situation_and_the_actor(make: Any) -> None:
    scenario = make_scenario(actors=DENSE, ego={"speed": "10 m/s"}, horizon="20 s")
    first, again, other = (
        drive(make(), [make_case(scenario, seed=seed)], 240) for seed in (7, 7, 8)
    )
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


@TRAFFICS
def test_using_traffic_before_its_reset_is_an_error(make: Any) -> None:
    with pytest.raises(RuntimeError, match="reset the traffic"):
        _ = make().ending
    with pytest.raises(RuntimeError, match="reset the traffic"):
        make().step(np.zeros((1, 2)))


# --- Imported roads, where drivers are on rails ---------------------------------------------------

BENDS = [(300.0, 0.0), (100.0, 0.01), (80.0, 0.0), (60.0, -0.015), (660.0, 0.0)]


def imported(**changes: Any) -> TestCase:
    strips = [(0, 1, 36.0, k, 3.5 * k, 0.0, 3.5 * (k + 1), 0.0) for k in range(3)]
    road = {"kind": "imported", "place": "a", "heading": 0.3, "line": BENDS, "length": "1200 m"}
    road |= {"slabs": [(0.0, strips)]}
    return make_case(make_scenario(**{"world": {"road": road}, "actors": DENSE, **changes}))


def test_on_an_imported_road_drivers_keep_to_its_lanes_and_touch_nobody() -> None:
    traffic = BatchTraffic()
    _, scene = traffic.reset([imported()])
    for _ in range(600):
        scene = traffic.step(np.zeros((1, 2)))
    reactive = [name for name, actor in DENSE.items() if "reactive" in actor]
    assert not scene.foreign_contact[0]
    offsets = scene.object_places[0, : len(reactive), PLACE_OFFSET]
    assert abs(offsets) == pytest.approx(0.0, abs=1e-6)


def test_places_that_drivers_on_rails_know_are_those_that_a_search_finds() -> None:
    traffic = BatchTraffic()
    strips = [(0, 1, 36.0, k, 3.5 * k, 0.0, 3.5 * (k + 1), 0.0) for k in range(3)]
    strips += [(0, -1, 36.0, -1, 10.5, 0.0, 14.0, 0.0)]
    road = {"kind": "imported", "place": "a", "heading": 0.3, "line": BENDS[1:], "length": "900 m"}
    road |= {"slabs": [(0.0, strips)]}
    start = {"oncoming": True, "lane": 0, "s": "90 m", "speed": "25 m/s"}
    actors = {**DENSE, "against": {**car(0, "0 m", "0 m/s", "25 m/s"), "start": start}}
    context, scene = traffic.reset([imported(world={"road": road}, actors=actors)])
    unknown, near = np.zeros((1, 0, 6)), np.zeros((1, 1 + len(actors)), dtype=np.int64)
    before, who = 0, context.object_ids.index("against")
    for _ in range(200):
        scene = traffic.step(np.zeros((1, 2)))
        searched = scene.ego_place.copy(), scene.object_places.copy()
        grounds = context.road.grounds()
        locate_all(scene.running, scene.ego, scene.objects, grounds, unknown, near, *searched)
        np.testing.assert_allclose(scene.object_places, searched[1], rtol=0.0, atol=1e-9)
        before += int(scene.object_places[0, who, PLACE_S] < 0.0)
    # Before the line begins it goes on as it begins: in a bend.
    assert before > 10


@pytest.mark.parametrize("variant", VARIANTS)
def test_on_an_imported_road_drivers_see_the_ego(variant: str) -> None:
    behind = {"a": car(1, "65 m", "15 m/s", "30 m/s", reactive={"desired_speed": "30 m/s"})}
    case = imported(actors=behind, ego={"s": "100 m", "lane": 1, "speed": "10 m/s"})
    states = drive(BatchTraffic(variant), [case], 300)
    assert states[0, -1, 0, OBJECT_SPEED] == pytest.approx(10.0, abs=0.5)


def test_who_heads_where_no_lane_goes_is_refused() -> None:
    start = {"lane": 1, "s": "200 m", "speed": "30 m/s", "heading": "180 deg"}
    against = {"a": {**car(1, "0 m", "0 m/s", "30 m/s"), "start": start}}
    with pytest.raises(SpecError, match=r"actors\.a\.start: at s 200 m no lane goes"):
        BatchTraffic().reset([imported(actors=against)])


def test_highway_refuses_imported_roads() -> None:
    with pytest.raises(UsageError, match="Use the batch traffic"):
        HighwayTraffic().reset([imported()])
