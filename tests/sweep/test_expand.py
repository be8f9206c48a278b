"""Test cases are counted as points × fault entries × architectures × replicates."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest

from adeye.errors import SpecError, SweepError
from adeye.spec.load import OddFiles
from adeye.sweep.expand import expand

Load = Callable[..., OddFiles]

CAMERA_OUT = {
    "id": "camera_out",
    "target": "sensors.front_camera",
    "model": "drop_out",
    "onset": {"at": "2 s"},
}
RADAR_OUT = {**CAMERA_OUT, "id": "radar_out", "target": "sensors.front_radar"}


def test_factors_multiply(load: Load) -> None:
    expansion = expand(load(faults=[CAMERA_OUT], replicates=3))
    assert [factor.test_cases for factor in expansion.factors] == [6 * 2 * 3, 6 * 2 * 3]
    cases = list(expansion.cases())
    assert len(cases) == expansion.count == 72
    assert len({case.digest for case in cases}) == 72


def test_none_is_always_among_the_fault_entries(load: Load) -> None:
    expansion = expand(load(faults=[CAMERA_OUT], use={"faults": ["camera_out"]}))
    assert expansion.factors[0].fault_entries == ("none", "camera_out")


def test_double_fault_is_one_entry(load: Load) -> None:
    faults = [CAMERA_OUT, RADAR_OUT]
    expansion = expand(load(faults=faults, use={"faults": [["camera_out", "radar_out"]]}))
    assert expansion.factors[1].fault_entries == ("none", "camera_out+radar_out")
    both = [case for case in expansion.cases() if case.fault_entry != "none"]
    assert {len(case.faults) for case in both} == {2}


def test_fault_without_its_target_does_not_count_for_that_architecture(load: Load) -> None:
    expansion = expand(load(faults=[RADAR_OUT]))
    assert expansion.factors[0].fault_entries == ("none",)
    assert expansion.factors[1].fault_entries == ("none", "radar_out")


def test_fault_whose_target_nobody_has_is_an_error(load: Load) -> None:
    lost = {**CAMERA_OUT, "target": "sensors.rear_camera"}
    with pytest.raises(SweepError, match=r"no architecture has sensors\.rear_camera"):
        expand(load(faults=[lost]))


def test_axis_of_one_architecture_is_dropped_for_the_others(load: Load) -> None:
    axis = "architecture.sensors.front_radar.range"
    sweep = {"parameters": {"gap": ["30 m", "60 m"], axis: ["150 m", "200 m"]}}
    expansion = expand(load(sweep))
    assert [factor.points for factor in expansion.factors] == [2, 4]
    ranges = {case.architecture.sensors.get("front_radar") for case in expansion.cases()}
    assert {getattr(radar, "range", None) for radar in ranges} == {None, 150.0, 200.0}


def test_fault_axis_varies_only_the_entries_that_have_the_fault(load: Load) -> None:
    sweep = {"parameters": {"faults.camera_out.duration": ["1 s", "2 s"]}}
    cases = list(expand(load(sweep, faults=[CAMERA_OUT])).cases())
    assert len(cases) == 2 * (1 + 2)
    assert {f.duration for case in cases for f in case.faults} == {1.0, 2.0}


def test_relations_and_scenario_constraints_exclude_points(load: Load) -> None:
    sweep = {
        "parameters": {
            "ego_speed": ["20 km/h", "50 km/h"],
            "relative_speed": ["-50 km/h", "-10 km/h"],
        },
        "where": ["relative_speed <= -10 km/h"],
    }
    expansion = expand(load(sweep))
    assert expansion.factors[0].raw == 4
    assert expansion.factors[0].points == 3


def test_zip_walks_axes_in_step(load: Load) -> None:
    sweep = {
        "design": "zip",
        "parameters": {
            "ego_speed": ["80 km/h", "100 km/h", "100 km/h"],
            "gap": ["30 m", "40 m", "50 m"],
        },
    }
    points = [case.point for case in expand(load(sweep)).cases()][:3]
    assert [point["gap"] for point in points] == [30.0, 40.0, 50.0]
    assert points[1]["ego_speed"] == points[2]["ego_speed"]


def test_list_takes_the_points_as_written(load: Load) -> None:
    sweep = {"design": "list", "points": [{"gap": "30 m"}, {"gap": "55 m"}]}
    points = [case.point["gap"] for case in expand(load(sweep)).cases()][:2]
    assert points == [30.0, 55.0]


def test_random_is_seeded_and_inside_the_ends(load: Load) -> None:
    sweep = {
        "design": "random",
        "samples": 20,
        "parameters": {"gap": ["30 m", "60 m"], "ego_speed": ["60 km/h", "130 km/h"]},
        "where": ["gap >= ego_speed * 1 s"],
    }
    first = [case.point for case in expand(load(sweep)).cases()][:20]
    again = [case.point for case in expand(load(sweep)).cases()][:20]
    other = [case.point for case in expand(load(sweep, seed=8)).cases()][:20]
    assert first == again != other
    assert all(30.0 <= float(p["gap"]) <= 60.0 for p in first)
    assert all(float(p["gap"]) >= float(p["ego_speed"]) for p in first)
    assert len({p["gap"] for p in first}) == 20


def test_steps_include_both_ends_exactly(load: Load) -> None:
    sweep = {"parameters": {"gap": {"from": "10 m", "to": "60 m", "step": "10 m"}}}
    values = [case.point["gap"] for case in expand(load(sweep)).cases()][:6]
    assert values == [10.0, 20.0, 30.0, 40.0, 50.0, 60.0]


@pytest.mark.slow
def test_a_billion_combinations_are_refused_before_expansion(load: Load) -> None:
    thousand = {"from": "30 m", "to": "59.97 m", "step": "0.03 m"}
    axis = "architecture.sensors.front_camera.range"
    sweep = {
        "parameters": {
            "gap": thousand,
            axis: thousand,
            "architecture.sensors.front_camera.mount.x": {
                "from": "0 m",
                "to": "0.999 m",
                "step": "0.001 m",
            },
        }
    }
    with pytest.raises(SweepError, match=r"1,000,000,000 combinations"):
        expand(load(sweep))


def test_more_test_cases_than_the_limit_are_refused(load: Load) -> None:
    with pytest.raises(SweepError, match="12 test cases, above the limit of 11"):
        expand(load(max_test_cases=11))


def test_point_outside_the_odd_is_refused_or_marked(load: Load) -> None:
    limits = {"dynamic_elements": {"ego_speed": {"max": "100 km/h"}}}
    with pytest.raises(SweepError, match="ego_speed: 120 km/h is above the ODD's maximum 100 km/h"):
        list(expand(load(attributes=limits)).cases())
    cases = list(expand(load(attributes=limits, outside="robustness")).cases())
    assert {(case.inside_odd, float(case.point["ego_speed"]) < 30.0) for case in cases} == {
        (True, True),
        (False, False),
    }


def test_rate_that_does_not_divide_the_clock_is_located(load: Load) -> None:
    with pytest.raises(SpecError, match=r"camera_radar.yaml:\d+:\d+: sensors.front_camera.rate"):
        expand(load(step="0.04 s", architectures=["architectures/camera_radar.yaml"]))


def test_adding_a_sensor_leaves_every_situation(load: Load) -> None:
    cases = list(expand(load()).cases())
    legacy, candidate = cases[:6], cases[6:]
    for one, other in zip(legacy, candidate, strict=True):
        assert one.situation_digest == other.situation_digest
        assert one.stream_seed == other.stream_seed
        assert one.digest != other.digest


def test_cost_and_texts_are_no_part_of_the_identity(load: Load) -> None:
    sweep = {"parameters": {"architecture.cost": [1, 2]}}
    cases = [
        case
        for case in expand(load(sweep)).cases()
        if case.architecture.architecture == "camera_radar"
    ]
    assert cases[0].digest == cases[1].digest


def test_situation_depends_on_seed_replicate_and_parameters(load: Load) -> None:
    cases = list(expand(load(replicates=2)).cases())[:4]
    other = next(iter(expand(load(seed=1)).cases()))
    digests = [case.situation_digest for case in [*cases, other]]
    assert all(a != b for a, b in pairwise(sorted(digests)))


def test_clock_and_horizon_are_in_the_test_case_not_in_the_stream(load: Load) -> None:
    one = next(iter(expand(load()).cases()))
    finer = next(iter(expand(load(step="0.025 s")).cases()))
    assert one.situation_digest == finer.situation_digest
    assert one.stream_seed == finer.stream_seed
    assert one.digest != finer.digest


def test_relation_that_the_fixed_values_break_is_refused(load: Load) -> None:
    use = {"parameters": {"ego_speed": "20 km/h", "relative_speed": "-50 km/h"}}
    with pytest.raises(SweepError, match="none of 1 combinations fulfils"):
        expand(load({}, use=use))


def test_whole_numbers_stay_whole_on_their_way_into_a_file(load: Load) -> None:
    sweep = {"parameters": {"scenario.world.road.lanes": [2, 3]}}
    cases = list(expand(load(sweep)).cases())
    assert [case.scenario.world.road.lanes for case in cases] == [2, 3, 2, 3]


def test_swept_rate_is_checked_against_the_clock(load: Load) -> None:
    sweep = {"parameters": {"architecture.sensors.front_camera.rate": ["7 Hz"]}}
    with pytest.raises(SweepError, match=r"example.yaml:\d+:\d+: sensors.front_camera.rate: 7 Hz"):
        list(expand(load(sweep)).cases())


def test_swept_horizon_is_checked_against_the_clock(load: Load) -> None:
    with pytest.raises(SweepError, match=r"example.yaml:\d+:\d+: horizon: 1.01 s is no whole"):
        list(expand(load({"parameters": {"scenario.horizon": ["1.01 s"]}})).cases())


def test_point_of_another_variant_does_not_lead_out_of_the_odd(load: Load) -> None:
    sweep = {
        "design": "zip",
        "parameters": {
            "ego_speed": ["80 km/h", "120 km/h"],
            "scenario.ego.speed": ["ego_speed + 30 km/h", "ego_speed"],
        },
    }
    limits = {"dynamic_elements": {"ego_speed": {"max": "120 km/h"}}}
    assert all(case.inside_odd for case in expand(load(sweep, attributes=limits)).cases())


def test_the_point_that_leaves_the_odd_is_the_one_that_is_told(load: Load) -> None:
    sweep = {"parameters": {"ego_speed": ["80 km/h", "125 km/h", "110 km/h"]}}
    limits = {"dynamic_elements": {"ego_speed": {"max": "100 km/h"}}}
    with pytest.raises(SweepError, match="ego_speed: 125 km/h is above"):
        list(expand(load(sweep, attributes=limits)).cases())


def test_fixed_values_are_in_every_test_case(load: Load) -> None:
    mass = "architecture.vehicle.mass"
    use = {"parameters": {"rain": "5 mm/h", mass: 2000}}
    cases = list(expand(load(use=use)).cases())
    assert {case.parameters["rain"] for case in cases} == {5e-3 / 3600}
    assert {case.architecture.vehicle.mass for case in cases} == {2000.0}
    assert "rain" not in cases[0].point
