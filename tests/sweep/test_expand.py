"""Expansion: counting, order, what is feasible and fits the clock."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from adeye.errors import SourceLocation, SpecError, SweepError
from adeye.spec.expression import parse
from adeye.spec.load import OddFiles
from adeye.sweep import covering as feasible
from adeye.sweep import expand as sequence
from adeye.sweep.axes import Axis
from adeye.sweep.covering import FREE, Feasibility
from adeye.sweep.design import Relation, Space
from adeye.sweep.expand import Expansion, LazyCases, expand
from adeye.sweep.groups import check_rates, check_times, guilty_path

# --- Test cases are counted as points × fault entries × architectures × replicates ----------------

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


# --- Test cases by ordinal: a sequence like a list, made chunk by chunk ---------------------------


@pytest.fixture
def expansion(load: Load) -> Expansion:
    return expand(load(replicates=5))


def test_it_is_the_list_of_the_test_cases(expansion: Expansion) -> None:
    cases, whole = LazyCases(expansion), list(expansion.cases())
    assert len(cases) == len(whole) == 60
    assert [cases[ordinal] for ordinal in range(60)] == whole == list(cases)
    assert cases[-1] == whole[-1]
    assert cases[7:31:3] == whole[7:31:3]
    assert cases[58:99] == whole[58:]


def test_ordinal_that_is_not_there_is_an_index_error(expansion: Expansion) -> None:
    cases = LazyCases(expansion)
    for wrong in (60, -61):
        with pytest.raises(IndexError, match=f"test case {wrong} of 60"):
            cases[wrong]


def test_block_is_made_once_whatever_the_order(
    expansion: Expansion, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sequence, "CHUNK", 8)
    made: list[tuple[int, int]] = []
    original = Expansion.cases

    def counted(self: Expansion, start: int = 0, stop: int | None = None) -> Any:
        made.append((start, stop or 0))
        return original(self, start, stop)

    monkeypatch.setattr(Expansion, "cases", counted)
    cases = LazyCases(expansion)
    for ordinal in (40, 47, 44, 41, 48, 46, 49):
        assert cases[ordinal].replicate == ordinal % 5
    assert made == [(40, 48), (48, 56)]


def test_only_some_chunks_are_kept(expansion: Expansion, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sequence, "CHUNK", 2)
    cases = LazyCases(expansion)
    first = cases[0]
    assert cases[0] is first
    for ordinal in range(2, 2 + 2 * sequence.KEPT_CHUNKS):
        cases[ordinal]
    assert cases[0] is not first
    assert cases[0] == first


# --- What can be completed to a whole point: by hand, and where relations hang together -----------

WHERE = SourceLocation("odd.yaml", 9, 7)


def feasibility(sizes: Sequence[int], *relations: str) -> Feasibility:
    axes = []
    for number, size in enumerate(sizes):
        levels = tuple(float(level) for level in range(size))
        axes.append(Axis(f"a{number}", "parameter", (), levels, levels, WHERE))
    return Feasibility(Space(axes, [Relation(parse(text), WHERE) for text in relations], {}, WHERE))


def test_without_relations_everything_is_feasible() -> None:
    found = feasibility([2, 3])
    assert found.completes(np.array([1, FREE]))
    assert found.levels(np.array([FREE, 2]), 0).all()
    assert found.tuples([0, 1]).all()


def test_level_that_no_level_of_another_axis_fits_is_excluded() -> None:
    found = feasibility([3, 3], "a0 < a1")
    assert found.levels(np.array([FREE, FREE]), 0).tolist() == [True, True, False]
    assert found.levels(np.array([1, FREE]), 1).tolist() == [False, False, True]


@pytest.mark.parametrize("most", [0, 2_000])
def test_search_and_list_of_solutions_agree_with_brute_force(
    monkeypatch: pytest.MonkeyPatch, most: int
) -> None:
    monkeypatch.setattr(feasible, "MAX_SOLUTIONS", most)
    sizes = [3, 2, 4, 3]
    found = feasibility(sizes, "a0 + a1 > 0", "a1 != a2", "a0 + a1 + a2 < 5")
    rows = [
        row
        for row in itertools.product(*map(range, sizes))
        if row[0] + row[1] > 0 and row[1] != row[2] and sum(row[:3]) < 5
    ]
    for partial in itertools.product(*(range(-1, size) for size in sizes)):
        fits = any(
            all(want in {FREE, have} for want, have in zip(partial, row, strict=True))
            for row in rows
        )
        assert found.completes(np.array(partial)) == fits, partial


def test_relations_that_exclude_each_other_are_refused() -> None:
    with pytest.raises(SweepError, match="none of 9 combinations fulfils a0 < a1 and a1 < a0"):
        feasibility([3, 3], "a0 < a1", "a1 < a0")


def test_question_that_takes_too_long_is_refused_and_not_guessed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(feasible, "MAX_STEPS", 50)
    # Five pigeons in four holes: no relation alone sees it.
    texts = [f"a{j} != a{k}" for j, k in itertools.combinations(range(5), 2)]
    with pytest.raises(SweepError, match="10 relations tie 5 axes together") as caught:
        feasibility([4] * 5, *texts)
    assert caught.value.where == WHERE


# --- Times and rates must fit the master clock; the message begins with the path of the first -----


def test_shipped_files_fit_the_shipped_clock(load: Load) -> None:
    files = load()
    check_times(files.scenarios["cut_in"].spec, 0.05)
    check_rates(files.architectures["camera_radar"].spec, 0.05)


def test_horizon_that_is_no_whole_number_of_steps_is_told(load: Load) -> None:
    with pytest.raises(SpecError) as caught:
        check_times(load().scenarios["cut_in"].spec, 0.07)
    assert guilty_path(caught.value) == ("horizon",)


def test_rate_that_does_not_divide_the_clock_is_told(load: Load) -> None:
    with pytest.raises(SpecError) as caught:
        check_rates(load().architectures["camera_radar"].spec, 0.04)
    assert guilty_path(caught.value) == ("sensors", "front_camera", "rate")


def test_jitter_that_is_no_whole_number_of_steps_is_told(load: Load) -> None:
    spec = load().architectures["camera_radar"].spec
    radar = spec.sensors["front_radar"].model_copy(update={"jitter": 0.07})
    late = spec.model_copy(update={"sensors": {**spec.sensors, "front_radar": radar}})
    with pytest.raises(SpecError) as caught:
        check_rates(late, 0.05)
    assert guilty_path(caught.value) == ("sensors", "front_radar", "jitter")


def test_handover_that_is_no_whole_number_of_steps_is_told(load: Load) -> None:
    spec = load().architectures["camera_radar"].spec
    switch = spec.switch.model_copy(update={"handover": 0.07})
    with pytest.raises(SpecError) as caught:
        check_rates(spec.model_copy(update={"switch": switch}), 0.05)
    assert guilty_path(caught.value) == ("switch", "handover")
