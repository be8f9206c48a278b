"""Objects: every kind has a class, a size and a reflectivity, and each has its place."""

from typing import Any, get_args

import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.signals import OBJECT_CLASSES
from adeye.simulate.world import objects
from adeye.simulate.world.compile import Starts, gap_circle, gap_order, resolve_starts
from adeye.simulate.world.formulas import BELOW_ZERO, Formulas, structure
from adeye.simulate.world.roads import build_roads
from adeye.spec.scenario import ActorKind, ObjectKind
from tests.motorway import make_case, make_scenario
from tests.refusals import refused


def test_default_size_of_every_actor_keeps_the_legal_limits_of_width_and_height() -> None:
    assert set(objects.DEFAULT_SIZES) == set(get_args(ActorKind))
    for kind, (length, width, height) in objects.DEFAULT_SIZES.items():
        assert 0.0 < length <= 12.0, kind
        assert 0.0 < width <= 2.55, kind
        assert 0.0 < height <= 4.0, kind


def test_every_kind_has_a_reflectivity_between_nothing_and_everything() -> None:
    kinds = {*get_args(ActorKind), *get_args(ObjectKind)}
    assert set(objects.DEFAULT_REFLECTIVITY) == kinds
    assert all(0.0 < share <= 1.0 for share in objects.DEFAULT_REFLECTIVITY.values())


def test_every_kind_of_actor_and_object_and_no_other_has_a_class() -> None:
    kinds = (*get_args(ActorKind), *get_args(ObjectKind))
    assert [OBJECT_CLASSES[number] for number in objects.class_indices(kinds)] == list(kinds)
    refused(ValueError, objects.class_indices, ("hovercraft",), says="not in tuple")


# --- Formulas over a batch: columns in the order of the cases, errors that name the field ---------


def test_a_formula_is_evaluated_for_each_run() -> None:
    scenario = make_scenario(ego={"speed": "ego_speed - 5 m/s"})
    cases = [make_case(scenario, {"ego_speed": speed}) for speed in (10.0, 20.0, 30.0)]
    values = Formulas.of(cases).values("ego.speed", lambda s: s.ego.speed)
    assert values.tolist() == [5.0, 15.0, 25.0]


def test_scenarios_with_overrides_keep_the_order_of_the_cases() -> None:
    plain, wet = make_scenario(), make_scenario(environment={"friction": 0.5})
    cases = [make_case(wet), make_case(plain), make_case(wet)]
    friction = Formulas.of(cases).values("friction", lambda s: s.environment.friction)
    assert friction.tolist() == [0.5, 0.9, 0.5]


def test_a_missing_formula_gives_the_default() -> None:
    formulas = Formulas.of([make_case(make_scenario())] * 2)
    assert formulas.values("ego.offset", lambda s: s.ego.offset, 0.25).tolist() == [0.25, 0.25]


def test_an_undefined_value_is_an_error_that_names_the_field() -> None:
    scenario = make_scenario(ego={"s": "10 m / (gap - 40 m) * 1 m"})
    with pytest.raises(SpecError, match=r"ego\.s: .*not finite"):
        Formulas.of([make_case(scenario)]).values("ego.s", lambda s: s.ego.s)


def test_a_value_at_its_lower_limit_is_refused() -> None:
    formulas = Formulas.of([make_case(make_scenario(world={"road": {"shoulder": "0 m"}}))])
    with pytest.raises(SpecError, match="shoulder: 0 m is not above 0 m"):
        formulas.limited("shoulder", lambda s: s.world.road.shoulder, above=0.0)
    shoulder = formulas.limited("shoulder", lambda s: s.world.road.shoulder, above=BELOW_ZERO)
    assert shoulder.tolist() == [0.0]


def test_scenarios_of_different_structure_do_not_share_a_batch() -> None:
    wide = make_scenario(world={"road": {"lanes": 4}})
    with pytest.raises(SpecError, match="differ in structure"):
        Formulas.of([make_case(make_scenario()), make_case(wide)])


def test_structure_tells_apart_what_cannot_share_arrays_and_no_values() -> None:
    lead = {"kind": "car", "start": {"lane": 1, "s": "1 m", "speed": "1 m/s"}}
    changes: list[dict[str, Any]] = [
        {"horizon": "6 s"},
        {"tail": "3 s"},
        {"ego": {"goal": {"s": "900 m"}}},
        {"actors": {"lead": lead}},
        {"world": {"road": {"kind": "curve", "radius": "500 m"}}},
    ]
    plain = structure(make_scenario())
    assert all(structure(make_scenario(**change)) != plain for change in changes)
    assert structure(make_scenario(environment={"friction": 0.4}, ego={"s": "300 m"})) == plain


# --- Starts: gaps are bumper to bumper, chains resolve, circles are refused -----------------------


def car(**start: Any) -> dict[str, Any]:
    return {"kind": "car", "start": {"lane": 1, "speed": "20 m/s", **start}}


def resolve(*, gaps: tuple[float, ...] = (40.0,), **changes: Any) -> Starts:
    scenario = make_scenario(**changes)
    formulas = Formulas.of([make_case(scenario, {"gap": gap}) for gap in gaps])
    return resolve_starts(formulas, build_roads(formulas), np.full(len(gaps), 4.8))


def test_a_gap_is_from_the_front_of_the_ego_to_the_rear_of_the_actor() -> None:
    starts = resolve(actors={"lead": car(ahead_of="ego", gap="gap")}, gaps=(40.0, 10.0))
    assert starts.s[:, 0] == pytest.approx([200.0 + 2.4 + 40.0 + 2.25, 200.0 + 2.4 + 10.0 + 2.25])


def test_a_negative_gap_puts_the_actor_behind() -> None:
    starts = resolve(actors={"follower": car(ahead_of="ego", gap="-gap")})
    assert starts.s[0, 0] == pytest.approx(200.0 - 2.4 - 40.0 - 2.25)


def test_a_chain_resolves_whatever_its_order_in_the_file() -> None:
    truck = {**car(ahead_of="middle", gap="30 m"), "kind": "truck"}
    starts = resolve(actors={"first": truck, "middle": car(ahead_of="ego", gap="20 m")})
    middle = 200.0 + 2.4 + 20.0 + 2.25
    assert starts.s[0].tolist() == pytest.approx([middle + 2.25 + 30.0 + 6.0, middle])


def test_a_gap_counts_from_a_static_object_too() -> None:
    size = {"length": "20 m", "width": "8 m", "height": "10 m"}
    house = {"kind": "building", "s": "500 m", "offset": "-9 m", **size}
    behind = car(ahead_of="house", gap="-1 m")
    starts = resolve(world={"objects": {"house": house}}, actors={"behind": behind})
    assert starts.s[0].tolist() == pytest.approx([500.0 - 10.0 - 1.0 - 2.25, 500.0])
    assert starts.d[0].tolist() == pytest.approx([5.25, -9.0])
    assert starts.sizes[0, 1].tolist() == [20.0, 8.0, 10.0]
    assert starts.reflectivity[0].tolist() == [0.5, 0.4]


def test_offsets_count_from_the_lane_centre_or_the_right_edge() -> None:
    walker = {"kind": "pedestrian", "start": {"offset": "-1 m", "s": "300 m", "speed": "0 m/s"}}
    starts = resolve(
        ego={"offset": "-0.5 m"}, actors={"near": car(s="250 m", offset="0.4 m"), "walker": walker}
    )
    assert starts.ego_d[0] == pytest.approx(5.25 - 0.5)
    assert starts.d[0].tolist() == pytest.approx([5.65, -1.0])


def test_a_size_of_its_own_replaces_the_default() -> None:
    small = {**car(s="250 m"), "size": {"length": "3 m", "width": "1.5 m", "height": "1.4 m"}}
    starts = resolve(actors={"small": small, "wide": car(s="350 m")})
    assert starts.sizes[0].tolist() == [[3.0, 1.5, 1.4], [4.5, 1.8, 1.5]]


def test_a_circle_of_gaps_is_refused_with_its_members() -> None:
    scenario = make_scenario(
        actors={
            "lone": car(ahead_of="a", gap="1 m"),
            "a": car(ahead_of="b", gap="1 m"),
            "b": car(ahead_of="a", gap="1 m"),
        }
    )
    assert gap_circle(scenario) == ("a", "b", "a")
    refused(SpecError, gap_order, scenario, says=r"actors\.a\.start\.ahead_of: .*circle: a → b → a")


def test_an_impossible_start_is_an_error_with_its_field() -> None:
    impossible: list[tuple[dict[str, Any], str]] = [
        ({"ego": {"lane": 3}}, r"ego\.lane: 3 is no lane of a road with lanes 0 to 2"),
        ({"ego": {"lane": "gap / 16 m"}}, r"ego\.lane: 2\.5 is no lane"),
        ({"actors": {"a": car(s="1 m", lane=-1)}}, r"actors\.a\.start\.lane: -1 is no lane"),
        ({"actors": {"a": car(ahead_of="b", gap="1 m")}}, "there is no 'b'"),
        ({"actors": {"a": {**car(s="1 m"), "reflectivity": 1.5}}}, "1.5 is above 1"),
        ({"ego": {"speed": "-1 m/s"}}, r"ego\.speed: -1 m/s"),
    ]
    for changes, message in impossible:
        refused(SpecError, resolve, **changes, says=message)


BEND = {"kind": "curve", "radius": "60 m", "length": "250 m"}


@pytest.mark.parametrize("lane", [0, 1, 2])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_gap_on_a_bend_is_that_along_the_lane(lane: int, side: float) -> None:
    """By the angle about the centre of the bend, which begins after 100 m."""
    starts = resolve(
        world={"road": {**BEND, "radius": f"{60.0 * side} m"}},
        ego={"lane": lane, "s": "130 m"},
        actors={"lead": car(ahead_of="ego", gap="gap", lane=lane),
                "rear": car(ahead_of="ego", gap="-gap", lane=lane)},
        gaps=(0.3, 10.0),
    )  # fmt: skip
    radius = 60.0 - side * 3.5 * (lane + 0.5)
    for run, gap in enumerate((0.3, 10.0)):
        angles = (starts.s[run] - 130.0) / 60.0
        assert angles * radius == pytest.approx([gap + 4.65, -gap - 4.65])


def test_a_gap_along_the_straight_of_a_road_with_a_bend_is_that_of_a_straight_road_to_the_bit() -> (
    None
):
    actors = {"lead": car(ahead_of="ego", gap="gap")}
    bent = resolve(world={"road": BEND}, ego={"s": "31.7 m"}, actors=actors, gaps=(40.1, 7.3))
    straight = resolve(ego={"s": "31.7 m"}, actors=actors, gaps=(40.1, 7.3))
    assert bent.s.tolist() == straight.s.tolist()
    assert straight.s[:, 0].tolist() == [31.7 + gap + 0.5 * (4.5 + 4.8) for gap in (40.1, 7.3)]


OUTSIDE: list[tuple[dict[str, Any], str]] = [
    (car(s="-500 m"), r"start\.s: -500 m is not on"),
    (car(ahead_of="ego", gap="1800 m"), r"start\.gap: 2004\.65 m is not on the road"),
    (car(s="300 m", lane=None, offset="-40 m"), r"start\.offset: -40 m from the right edge"),
    (car(s="300 m", lane=2, offset="2 m"), r"start\.offset"),
    (
        {**car(s="2100 m", lane=None, offset="-3 m"), "kind": "pedestrian"},
        r"start\.s: 2100 m is not on the road",
    ),
]


def test_a_start_where_there_is_no_road_is_refused() -> None:
    for ego, message in (
        ({"s": "2000.1 m"}, r" ego\.s: 2000\.1 m is not on the road"),
        ({"s": "-1 m"}, r" ego\.s: -1 m is not on the road"),
        ({"offset": "-8 m"}, r" ego\.offset: -2\.75 m from the right edge"),
    ):
        refused(SpecError, resolve, ego=ego, says=message)
    for actor, message in OUTSIDE:
        refused(SpecError, resolve, actors={"a": actor}, says=rf" actors\.a\.{message}")
        meant = {**actor, "start": {**actor["start"], "off_road": True}}
        assert resolve(actors={"a": meant}).s.shape == (1, 1)


def test_a_static_object_is_not_far_from_the_road() -> None:
    def placed(s: str) -> Any:
        size = {"length": "12 m", "width": "2.5 m", "height": "3.8 m"}
        truck = {"kind": "parked_truck", "s": s, "offset": "-3 m", **size}
        return resolve(world={"objects": {"truck": truck}})

    for s in ("-500 m", "2500 m"):
        assert placed(s).s.shape == (1, 1)
    for s in ("-500.1 m", "2500.1 m", "70 km"):
        refused(SpecError, placed, s, says=r"objects\.truck\.s: .* more than 500 m off the road")


def test_the_ends_and_edges_of_the_road_belong_to_it() -> None:
    starts = resolve(
        ego={"s": "0 m"},
        actors={
            "last": car(s="2000 m"),
            "right": car(s="300 m", lane=None, offset="-2.5 m"),
            "left": car(s="400 m", lane=None, offset="10.5 m"),
            "walker": {**car(s="300 m", lane=None, offset="-40 m"), "kind": "pedestrian"},
        },
    )
    assert starts.s.shape == (1, 4)
