"""The analysis of a suite: what is in it, what it leaves out, and what a loss costs."""

import time
from dataclasses import asdict
from itertools import product
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.analysis.suite.analyse import NOTES, analyse, groups_of
from adeye.analysis.suite.conditions import CASES, DEFAULTS, TARGETS
from adeye.analysis.suite.records import Removal, Suite
from adeye.analysis.suite.speeds import SHOWN
from adeye.spec.load import load_architecture, shipped
from tests.analysis.suite.rigs import BUMPER, ROOF, all_around, architecture, radar

NAMES = [condition.id for condition in DEFAULTS]


def test_every_zone_target_condition_case_and_speed_is_there_once() -> None:
    found = analyse(architecture({"eye": radar()}), odd_speed=33.0)
    places = [(item.zone, item.target, item.condition) for item in found.coverage]
    assert sorted(places) == sorted(product([zone.id for zone in found.zones], TARGETS, NAMES))
    speeds = [(item.condition, item.case) for item in found.speeds]
    assert sorted(speeds) == sorted(product(NAMES, (case.id for case in CASES)))
    assert len(found.slacks) == len(NAMES) * len(CASES) * (len(SHOWN) + 1)
    assert [item.condition for item in found.forward] == NAMES
    assert len(found.bearings) == 24 * len(NAMES)


def test_what_is_not_covered_is_blind() -> None:
    found = analyse(architecture({"eye": radar()}))
    blind = {(item.zone, item.target, item.condition): item.area_m2 for item in found.blind_spots}
    for item in found.coverage:
        rest = (1.0 - item.seen_by_1) * item.area_m2
        key = (item.zone, item.target, item.condition)
        assert blind.get(key, 0.0) == pytest.approx(rest, abs=1e-6)


def test_left_out_sensors_are_named_with_the_reason_and_their_costs_are_added_up() -> None:
    others = {
        "gps": {"kind": "gnss", "rate": 10.0},
        "sonar": {"kind": "./own.py:Sonar", "rate": 10.0},
        "truth": {"kind": "ground_truth", "rate": 20.0, "cost": 1.0},
    }
    found = analyse(architecture({"eye": radar(cost=90.0), **others}, cost=500.0))
    assert [item.id for item in found.sensors] == ["eye"]
    assert {item.id: item.why.split(",")[0] for item in found.not_analysed} == {
        "gps": "do not look around",
        "sonar": "plug-ins",
        "truth": "no devices",
    }
    assert (found.sensor_cost, found.cost) == (91.0, 500.0)


def test_sensor_without_a_channel_has_no_say_in_speed_and_that_is_told() -> None:
    built = architecture(
        {"eye": radar(), "spare": all_around()},
        channels={"nominal": {"kind": "nominal", "links": ["eye"], "rate": 20.0}},
    )
    found = analyse(built)
    assert [chain.sensor for chain in found.chains] == ["eye"]
    assert found.notes[: len(NOTES)] == NOTES
    assert any(note.endswith("say in speed: spare.") for note in found.notes)


def test_plug_in_channel_is_told_to_be_assumed() -> None:
    built = architecture(
        {"eye": radar()},
        channels={"own": {"kind": "./own.py:Own", "links": ["eye"], "rate": 20.0}},
        switch={"policy": "fixed_priority", "priority": ["own"], "default": "own"},
    )
    assert any("(own)" in note for note in analyse(built).notes)
    assert not any("(nominal)" in note for note in analyse(architecture({"eye": radar()})).notes)


def test_physical_radar_is_told_to_count_straight_ahead_and_sees_alike_there() -> None:
    physical = analyse(architecture({"eye": radar(fidelity="physical")}))
    assert any("antenna" in note for note in physical.notes)
    assert physical.sensors[0].fidelity == "physical"
    for found in (physical, analyse(architecture({"eye": radar(fidelity="object")}))):
        assert found.forward[0].range_m == pytest.approx(200.0)


def test_same_architecture_gives_the_same_numbers() -> None:
    built = architecture({"eye": radar(), "roof": all_around(range=70.0)})
    assert asdict(analyse(built)) == asdict(analyse(built))


def test_shipped_candidate_reaches_130_in_rain_and_the_legacy_suite_does_not() -> None:
    folder = shipped("odd") / "architectures"
    candidate, legacy = (
        analyse(load_architecture(folder / f"{name}.yaml").spec)
        for name in ("camera_radar", "legacy_camera")
    )
    rain = [item.whole.all_cases_mps["rain"] or 0.0 for item in (legacy, candidate)]
    assert rain[0] < 130.0 / 3.6 < rain[1]
    assert candidate.critical == "front_radar"


@pytest.mark.slow
def test_twelve_sensors_take_less_than_a_second() -> None:
    kind = {"kind": "lidar", "fidelity": "physical", "mount": ROOF, "range": 150.0, "rate": 10.0}
    seen = {"field_of_view": 6.28, "beams": 1800, "layers": 32, "vertical_field_of_view": 0.5}
    radars = {f"radar_{k}": radar() for k in range(11)}
    built = architecture({"lidar": {**kind, **seen}, **radars})
    analyse(built)
    start = time.process_time()
    analyse(built)
    assert time.process_time() - start < 1.0


def suite(sensors: dict[str, Any], **options: Any) -> Suite:
    return analyse(architecture(sensors), **options)


def is_not_better(less: Removal, more: Removal) -> bool:
    return all(
        (getattr(less, name)[condition] or 0.0) <= (getattr(more, name)[condition] or 0.0)
        for name in ("seen", "front_seen", "highest_mps", "all_cases_mps")
        for condition in more.seen
    )


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(0.1, 6.0), st.floats(20.0, 200.0), st.floats(-3.1, 3.1)),
        min_size=1,
        max_size=4,
    )
)
def test_less_is_never_better(drawn: list[tuple[float, float, float]]) -> None:
    sensors = {
        f"eye_{number}": radar(
            field_of_view=angle, range=far, mount={"x": 0.0, "y": 0.0, "z": 2.0, "yaw": yaw}
        )
        for number, (angle, far, yaw) in enumerate(drawn)
    }
    found = suite(sensors)
    assert len(found.removals) == len(sensors)
    assert all(is_not_better(item, found.whole) for item in found.removals)


def test_loss_of_a_sensor_for_low_speeds_only_is_no_gain() -> None:
    # Of crossing pedestrians the wide one sees those of a slow ego, the long one of a fast one.
    found = suite({"wide": radar(range=12.0, field_of_view=3.0), "long": radar(field_of_view=0.2)})
    crossing = next(item for item in found.speeds if item.case == "crossing_pedestrian")
    assert crossing.sensor == "long"
    assert crossing.lowest_mps is not None
    assert crossing.lowest_mps > 10.0
    assert all(is_not_better(item, found.whole) for item in found.removals)


def test_critical_sensor_is_the_long_one() -> None:
    short = {"short": radar(range=60.0)}
    found = suite({"long": radar(range=200.0), **short})
    assert found.critical == "long"
    left = next(item for item in found.removals if item.what == "long")
    assert left.highest_mps["dry_day"] == suite(short).whole.highest_mps["dry_day"]


def test_twins_are_not_critical() -> None:
    found = suite({"one": all_around(), "other": all_around()})
    assert found.critical == ""
    for item in found.removals:
        assert item.seen == found.whole.seen
        assert item.highest_mps == found.whole.highest_mps


def test_without_a_sensor_that_looks_around_nothing_is_left_or_to_lose() -> None:
    found = suite({"truth": {"kind": "ground_truth", "rate": 20.0}})
    assert (found.removals, found.critical) == ((), "")
    (gone,) = suite({"only": radar()}).removals
    for item in (gone, found.whole):
        assert set(item.seen.values()) == {0.0}
        assert set(item.highest_mps.values()) == {None}
        assert set(item.all_cases_mps.values()) == {None}


def test_element_of_several_sensors_and_shared_resource_fall_as_one() -> None:
    pair = {name: radar(realises="radars") for name in ("left", "right")}
    built = architecture({**pair, "camera": all_around(realises="camera")})
    resources = {"radars": ["power_a"], "camera": ["power_a", "mount_b"]}
    groups = list(groups_of(built, list(built.sensors), resources))
    assert groups == [
        ("camera", "sensor", ("camera",)),
        ("left", "sensor", ("left",)),
        ("right", "sensor", ("right",)),
        ("radars", "element", ("left", "right")),
        ("power_a", "resource", ("camera", "left", "right")),
        ("mount_b", "resource", ("camera",)),
    ]


def test_shared_resource_may_take_all() -> None:
    found = suite(
        {"one": radar(realises="one"), "other": all_around(realises="other")},
        resources={"one": ["power"], "other": ["power"]},
    )
    power = next(item for item in found.removals if item.kind == "resource")
    assert set(power.seen.values()) == {0.0}


def test_share_ahead_is_of_the_lane_ahead() -> None:
    found = suite({"eye": radar(range=90.0 - 0.01, field_of_view=3.0)})
    assert found.whole.front_seen["dry_day"] == pytest.approx(90.0 / 150.0, abs=0.01)


def test_worst_condition_is_the_one_in_which_least_is_seen() -> None:
    camera = {"kind": "camera", "mount": BUMPER, "field_of_view": 1.0, "range": 80.0, "rate": 20.0}
    dim = architecture({"eye": {**camera, "night_range": 0.3}})
    assert analyse(dim).worst.id == "night"
    assert analyse(architecture({"eye": radar()})).worst.id == "dry_day"
