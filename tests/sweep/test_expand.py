"""Expansion: counting, order, what is feasible and fits the clock."""

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from adeye.errors import SourceLocation, SpecError, SweepError
from adeye.spec.expression import parse
from adeye.sweep import covering as feasible
from adeye.sweep import expand as sequence
from adeye.sweep.axes import Axis
from adeye.sweep.case import TestCase
from adeye.sweep.covering import FREE, Feasibility
from adeye.sweep.design import Relation, Space
from adeye.sweep.expand import Expansion, LazyCases, expand
from adeye.sweep.groups import check_rates, check_times, guilty_path
from tests.refusals import refused
from tests.sweep.conftest import CAMERA_OUT, Load

# --- Test cases are counted as points × fault entries × architectures × replicates ----------------


RADAR_OUT = {**CAMERA_OUT, "id": "radar_out", "target": "sensors.front_radar"}


def cases_of(load: Load, parameters: dict[str, Any] | None, **changes: Any) -> list[TestCase]:
    """Expand the sweep of some axes, or that of ``load``, and list its test cases."""
    of_sweep = {"design", "where", "samples"} & changes.keys()
    sweep = {"parameters": parameters, **{name: changes.pop(name) for name in of_sweep}}
    return list(expand(load(sweep if parameters else None, **changes)).cases())


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
    axes = {"faults.camera_out.duration": ["1 s", "2 s"]}
    cases = cases_of(load, axes, faults=[CAMERA_OUT])
    assert len(cases) == 2 * (1 + 2)
    assert {f.duration for case in cases for f in case.faults} == {1.0, 2.0}


@pytest.mark.parametrize("name", ["sweep", "parameters"])
def test_what_is_written_into_a_fault_that_no_test_case_has_is_refused(
    load: Load, name: str
) -> None:
    length = "faults.camera_out.duration"
    sweep = {
        "parameters": {"gap": ["30 m"], **({length: ["1 s", "2 s"]} if name == "sweep" else {})}
    }
    fixed = {"parameters": {length: "1 s"}} if name == "parameters" else {}
    for entries in ([], ["none"], ["radar_out"]):
        files = load(sweep, faults=[CAMERA_OUT, RADAR_OUT], use={"faults": entries, **fixed})
        caught = refused(
            SweepError, expand, files, says="no test case of scenario cut_in has fault"
        )
        assert caught.where is not None
        assert "Name camera_out in `faults`" in caught.remedy
    assert expand(load(sweep, faults=[CAMERA_OUT], use=fixed)).count > 2


def test_relations_and_scenario_constraints_exclude_points(load: Load) -> None:
    axes = {"ego_speed": ["20 km/h", "50 km/h"], "relative_speed": ["-50 km/h", "-10 km/h"]}
    expansion = expand(load({"parameters": axes, "where": ["relative_speed <= -10 km/h"]}))
    assert (expansion.factors[0].raw, expansion.factors[0].points) == (4, 3)


def test_zip_walks_axes_in_step(load: Load) -> None:
    axes = {"ego_speed": ["80 km/h", "100 km/h", "100 km/h"], "gap": ["30 m", "40 m", "50 m"]}
    points = [case.point for case in cases_of(load, axes, design="zip")][:3]
    assert [point["gap"] for point in points] == [30.0, 40.0, 50.0]
    assert points[1]["ego_speed"] == points[2]["ego_speed"]


def test_list_takes_the_points_as_written(load: Load) -> None:
    sweep = {"design": "list", "points": [{"gap": "30 m"}, {"gap": "55 m"}]}
    points = [case.point["gap"] for case in expand(load(sweep)).cases()][:2]
    assert points == [30.0, 55.0]


def test_random_is_seeded_and_inside_the_ends(load: Load) -> None:
    axes = {"gap": ["30 m", "60 m"], "ego_speed": ["60 km/h", "130 km/h"]}
    drawn = {"design": "random", "samples": 20, "where": ["gap >= ego_speed * 1 s"]}
    first, again, other = (
        [case.point for case in cases_of(load, axes, seed=seed, **drawn)][:20] for seed in (7, 7, 8)
    )
    assert first == again != other
    assert all(30.0 <= float(p["gap"]) <= 60.0 for p in first)
    assert all(float(p["gap"]) >= float(p["ego_speed"]) for p in first)
    assert len({p["gap"] for p in first}) == 20


def test_a_billion_combinations_are_refused_before_expansion(load: Load) -> None:
    thousand = {"from": "30 m", "to": "59.97 m", "step": "0.03 m"}
    camera = "architecture.sensors.front_camera"
    axes = {"gap": thousand, f"{camera}.range": thousand}
    axes[f"{camera}.mount.x"] = {"from": "0 m", "to": "0.999 m", "step": "0.001 m"}
    refused(SweepError, expand, load({"parameters": axes}), says=r"1,000,000,000 combinations")


def test_more_test_cases_than_the_limit_are_refused(load: Load) -> None:
    with pytest.raises(SweepError, match="12 test cases, above the limit of 11"):
        expand(load(max_test_cases=11))


def test_point_outside_the_odd_is_refused_or_marked(load: Load) -> None:
    limits = {"dynamic_elements": {"ego_speed": {"max": "100 km/h"}}}
    with pytest.raises(SweepError, match="ego_speed: 120 km/h is above the ODD's maximum 100 km/h"):
        cases_of(load, None, attributes=limits)
    cases = cases_of(load, None, attributes=limits, outside="robustness")
    found = {(case.inside_odd, float(case.point["ego_speed"]) < 30.0) for case in cases}
    assert found == {(True, True), (False, False)}


def test_rate_that_does_not_divide_the_clock_is_located(load: Load) -> None:
    with pytest.raises(SpecError, match=r"camera_radar.yaml:\d+:\d+: sensors.front_camera.rate"):
        expand(load(step="0.04 s", architectures=["architectures/camera_radar.yaml"]))


def test_adding_a_sensor_leaves_every_situation(load: Load) -> None:
    cases = cases_of(load, None)
    for one, other in zip(cases[:6], cases[6:], strict=True):
        assert one.situation_digest == other.situation_digest
        assert one.stream_seed == other.stream_seed
        assert one.digest != other.digest


def test_relation_that_the_fixed_values_break_is_refused(load: Load) -> None:
    use = {"parameters": {"ego_speed": "20 km/h", "relative_speed": "-50 km/h"}}
    refused(SweepError, expand, load({}, use=use), says="none of 1 combinations fulfils")


def test_whole_numbers_stay_whole_on_their_way_into_a_file(load: Load) -> None:
    cases = cases_of(load, {"scenario.world.road.lanes": [2, 3]})
    assert [case.scenario.world.road.lanes for case in cases] == [2, 3, 2, 3]


def test_swept_rate_and_horizon_are_checked_against_the_clock(load: Load) -> None:
    for path, value, said in (
        ("architecture.sensors.front_camera.rate", "7 Hz", "sensors.front_camera.rate: 7 Hz"),
        ("scenario.horizon", "1.01 s", "horizon: 1.01 s is no whole"),
    ):
        refused(SweepError, cases_of, load, {path: [value]}, says=rf"example.yaml:\d+:\d+: {said}")


def test_point_of_another_variant_does_not_lead_out_of_the_odd(load: Load) -> None:
    speeds = {"scenario.ego.speed": ["ego_speed + 30 km/h", "ego_speed"]}
    axes = {"ego_speed": ["80 km/h", "120 km/h"], **speeds}
    limits = {"dynamic_elements": {"ego_speed": {"max": "120 km/h"}}}
    assert all(case.inside_odd for case in cases_of(load, axes, design="zip", attributes=limits))


def test_fixed_values_are_in_every_test_case(load: Load) -> None:
    use = {"parameters": {"rain": "5 mm/h", "architecture.vehicle.mass": 2000}}
    cases = cases_of(load, None, use=use)
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


def test_what_does_not_fit_the_clock_is_told_with_its_path(load: Load) -> None:
    files = load()
    scenario, spec = files.scenarios["cut_in"].spec, files.architectures["camera_radar"].spec
    check_times(scenario, 0.05)
    check_rates(spec, 0.05)
    radar = spec.sensors["front_radar"].model_copy(update={"jitter": 0.07})
    late = spec.model_copy(update={"sensors": {**spec.sensors, "front_radar": radar}})
    switch = spec.switch.model_copy(update={"handover": 0.07})
    slow = spec.model_copy(update={"switch": switch})
    checks: tuple[tuple[Any, Any, float, str], ...] = (
        (check_times, scenario, 0.07, "horizon"),
        (check_rates, spec, 0.04, "sensors.front_camera.rate"),
        (check_rates, late, 0.05, "sensors.front_radar.jitter"),
        (check_rates, slow, 0.05, "switch.handover"),
    )
    for check, content, step, path in checks:
        caught = refused(SpecError, check, content, step)
        assert guilty_path(caught) == tuple(path.split("."))
