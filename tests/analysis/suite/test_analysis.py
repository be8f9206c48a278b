"""The analysis as a whole: complete, honest about what it leaves out, quick, the same again."""

import time
from dataclasses import asdict
from itertools import product
from typing import Any

import pytest

from adeye.analysis.suite.analyse import NOTES, analyse
from adeye.analysis.suite.conditions import CASES, DEFAULTS, TARGETS
from adeye.analysis.suite.speeds import SHOWN
from adeye.spec.load import load_architecture, shipped
from tests.analysis.suite.rigs import ROOF, all_around, architecture, radar

NAMES = [condition.id for condition in DEFAULTS]


def test_every_zone_target_condition_case_and_speed_is_there_once() -> None:
    found = analyse(architecture({"eye": radar()}), odd_speed=33.0)
    zones = [zone.id for zone in found.zones]
    assert sorted((item.zone, item.target, item.condition) for item in found.coverage) == sorted(
        product(zones, TARGETS, NAMES)
    )
    assert sorted((item.condition, item.case) for item in found.speeds) == sorted(
        product(NAMES, (case.id for case in CASES))
    )
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


def test_left_out_sensors_are_named_with_the_reason() -> None:
    found = analyse(
        architecture(
            {
                "eye": radar(),
                "gps": {"kind": "gnss", "rate": 10.0},
                "sonar": {"kind": "./own.py:Sonar", "rate": 10.0},
                "truth": {"kind": "ground_truth", "rate": 20.0},
            }
        )
    )
    assert [item.id for item in found.sensors] == ["eye"]
    assert {item.id: item.why.split(",")[0] for item in found.not_analysed} == {
        "gps": "do not look around",
        "sonar": "plug-ins",
        "truth": "no devices",
    }


def test_costs_are_added_up_over_all_sensors() -> None:
    truth = {"kind": "ground_truth", "rate": 20.0, "cost": 1.0}
    found = analyse(architecture({"a": radar(cost=90.0), "b": truth}, cost=500.0))
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


def test_physical_radar_is_told_to_count_straight_ahead() -> None:
    physical = analyse(architecture({"eye": radar(fidelity="physical")}))
    assert any("antenna" in note for note in physical.notes)
    assert physical.sensors[0].fidelity == "physical"


@pytest.mark.parametrize("fidelity", ["object", "physical"])
def test_radar_of_either_fidelity_sees_a_car_of_the_reference_alike(fidelity: str) -> None:
    found = analyse(architecture({"eye": radar(fidelity=fidelity)}))
    assert found.forward[0].range_m == pytest.approx(200.0)


def test_same_architecture_gives_the_same_numbers() -> None:
    built = architecture({"eye": radar(), "roof": all_around(range=70.0)})
    assert asdict(analyse(built)) == asdict(analyse(built))


def test_shipped_candidate_reaches_130_in_rain_and_the_legacy_suite_does_not() -> None:
    folder = shipped("odd") / "architectures"
    found = {
        name: analyse(load_architecture(folder / f"{name}.yaml").spec)
        for name in ("camera_radar", "legacy_camera")
    }
    limit = 130.0 / 3.6
    assert (found["camera_radar"].whole.all_cases_mps["rain"] or 0.0) > limit
    assert (found["legacy_camera"].whole.all_cases_mps["rain"] or 0.0) < limit
    assert found["camera_radar"].critical == "front_radar"


@pytest.mark.slow
def test_twelve_sensors_take_less_than_a_second() -> None:
    lidar: dict[str, Any] = {
        "kind": "lidar",
        "fidelity": "physical",
        "mount": ROOF,
        "field_of_view": 6.28,
        "beams": 1800,
        "layers": 32,
        "vertical_field_of_view": 0.5,
        "range": 150.0,
        "rate": 10.0,
    }
    built = architecture({"lidar": lidar, **{f"radar_{k}": radar() for k in range(11)}})
    analyse(built)
    start = time.process_time()
    analyse(built)
    assert time.process_time() - start < 1.0
