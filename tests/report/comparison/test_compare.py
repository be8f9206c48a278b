"""Comparison of a small executed campaign: laws, counts that agree with SQL, what is refused."""

import json
from collections import Counter
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from adeye.judge.verdict import Verdict
from adeye.report.comparison.candidates import Matching, cost_of, extra_sensor, measuring, suite_of
from adeye.report.comparison.compare import compare, overview
from adeye.report.comparison.records import CompareOptions, Comparison, Difference
from adeye.report.page.charts import draw_front
from adeye.report.page.html import render_comparison
from adeye.store.read.bulk import Labels, encode_points
from adeye.store.repository import Repository
from tests.frozen import as_json, assert_frozen, thinned
from tests.project import Executed
from tests.sql import rows
from tests.stored import known
from tests.suites import build_half


def compared(executed: Executed, **options: Any) -> Comparison:
    with executed.opened() as (repository, campaign):
        return compare(repository, campaign, CompareOptions(**options))


@pytest.fixture(scope="module")
def everything(suites: Executed) -> Comparison:
    return compared(suites)


def is_same(items: Sequence[Difference]) -> bool:
    moved = [item.margin for item in items if item.margin is not None]
    still = [(item.least, item.mean, item.median, item.greatest) == (0, 0, 0, 0) for item in moved]
    agree = {f"{word}/{word}" for word in Verdict}
    return (
        bool(moved)
        and all(still)
        and all(
            item.only_a_fails == item.only_b_fails == 0 and set(item.verdicts) <= agree
            for item in items
        )
    )


def of_all(found: Comparison, a: str, b: str) -> list[Difference]:
    return [item for item in found.differences if (item.a, item.b, item.kind) == (a, b, "all")]


def test_copy_and_one_with_a_sensor_that_nobody_reads_differ_in_nothing(
    everything: Comparison,
) -> None:
    for copy in ("twin", "spare"):
        both = {"camera_radar", copy}
        found = [item for item in everything.differences if {item.a, item.b} == both]
        assert is_same(found)
        told = [item.inference for item in found if item.inference is not None]
        assert {(item.p, item.p_adjusted, item.difference) for item in told} == {(1, 1, 0)}
    # The law can fail.
    assert not is_same(of_all(everything, "camera_radar", "legacy_camera"))


def test_counts_are_those_of_the_documented_view(suites: Executed, everything: Comparison) -> None:
    counted: Counter[tuple[str, ...]] = Counter()
    sql = (
        "SELECT verdicts_a, verdicts_b FROM v_architecture_pairs "
        "WHERE architecture_a = 'camera_radar' AND architecture_b = 'legacy_camera'"
    )
    stored = rows(suites.db, sql)
    for a, b in stored:
        first, second = json.loads(a), json.loads(b)
        for fsr in first.keys() & second.keys():
            counted[fsr, first[fsr], second[fsr]] += 1
    pairs = {(item.a, item.b): item.pairs for item in everything.pairs}
    assert pairs["camera_radar", "legacy_camera"] == len(stored)
    found = {
        (item.fsr, *words.split("/")): count
        for item in of_all(everything, "camera_radar", "legacy_camera")
        for words, count in item.verdicts.items()
    }
    assert found == counted


def test_fault_in_a_part_that_one_lacks_leaves_cases_without_a_partner(
    everything: Comparison,
) -> None:
    pairs = {(item.a, item.b): item for item in everything.pairs}
    lacking = pairs["camera_radar", "no_radar"]
    assert (lacking.pairs, lacking.only_a, lacking.only_b) == (26, 2, 0)
    assert pairs["camera_radar", "twin"].only_a == 0
    assert {item.cases for item in everything.candidates} == {26}


def test_grid_gets_no_probability_and_a_random_design_does(everything: Comparison) -> None:
    by_scenario: dict[str, set[bool]] = {"cut_in": set(), "lead_braking": set(), "": set()}
    for item in everything.differences:
        if item.kind != "category":
            by_scenario[item.cluster].add(item.inference is not None)
            if item.inference is None or item.undecided:
                assert item.margin is None or item.margin.interval is None
    assert by_scenario == {"cut_in": {True}, "lead_braking": {False}, "": {False}}
    assert any("chosen points" in text for text in everything.statements)
    assert any("drawn uniformly" in text for text in everything.statements)


def test_unit_is_the_drawn_point_not_the_run(everything: Comparison) -> None:
    found = [item for item in everything.differences if item.cluster == "cut_in"]
    assert {item.pairs for item in found} == {24}
    assert {item.inference.units for item in found if item.inference is not None} == {12}


def test_random_design_gives_margins_an_interval(everything: Comparison) -> None:
    ranges = [
        item.margin.interval
        for item in everything.differences
        if item.margin is not None and (item.b, item.fsr) == ("no_radar", "FSR-02")
    ]
    assert any(item is not None and item.low < item.high for item in ranges)


def test_baseline_is_the_one_that_all_others_are_compared_with(suites: Executed) -> None:
    found = compared(suites, baseline="legacy_camera", architectures=("twin", "camera_radar"))
    assert {item.a for item in found.pairs} == {"legacy_camera"}
    assert [item.b for item in found.pairs] == ["camera_radar", "twin"]


def test_same_question_has_the_same_answer(suites: Executed, everything: Comparison) -> None:
    assert compared(suites).model_dump_json() == everything.model_dump_json()


def test_wider_confidence_gives_wider_intervals(suites: Executed) -> None:
    names = ("camera_radar", "legacy_camera")
    narrow, wide = (
        [
            item.inference.interval
            for item in compared(suites, architectures=names, confidence=level).differences
            if item.inference is not None
        ]
        for level in (0.8, 0.99)
    )
    assert narrow != wide
    for inner, outer in zip(narrow, wide, strict=True):
        assert outer.low <= inner.low <= inner.high <= outer.high


@pytest.mark.slow
def test_campaign_without_a_run_is_no_evidence_for_anybody(suites: Executed, tmp_path: Any) -> None:
    plan = suites.project.plan()
    with Repository.open(tmp_path / "none.db") as repository:
        planned = repository.plan_campaign(plan.record(), plan.planned())
        found = compare(repository, repository.find_campaign(planned.campaign))
    assert all(item.pairs == 0 < item.incomplete for item in found.pairs)
    assert found.differences == ()
    for item in found.candidates:
        assert (item.cases, item.left_out, item.fault_free) == (0, 26, 0)
        assert (item.availability, item.is_on_front, item.dominated_by) == (None, False, None)
        assert item.unmet
        assert [one.scenario for one in item.unexecuted] == ["cut_in", "lead_braking"]
        assert all(one.missing == one.planned for one in item.unexecuted)
    assert len(found.left_out) == 1
    assert "no test case was executed" in found.left_out[0]
    assert "no test case was executed" in render_comparison(found)
    assert "<svg" not in render_comparison(found)
    assert found.cheapest == ()
    assert draw_front(found) is None


@pytest.fixture(scope="module")
def half(suites: Executed, tmp_path_factory: pytest.TempPathFactory) -> Executed:
    """Execute half of the campaign, as one that was interrupted."""
    return build_half(suites, tmp_path_factory.mktemp("half") / "half.db")


def test_interrupted_campaign_has_one_denominator(half: Executed) -> None:
    """Counts are those of a hand-made join over the runs that both architectures have."""
    found = compared(half)
    runs: dict[tuple[str, ...], dict[str, Any]] = {}
    sql = (
        "SELECT architecture, situation, fault_entry, contact FROM v_runs WHERE outcome IS NOT NULL"
    )
    for architecture, situation, fault, contact in rows(half.db, sql):
        runs.setdefault((situation, fault), {})[architecture] = contact
    names = {item.id for item in found.candidates}
    everywhere = [item for item in runs.values() if names <= item.keys()]
    assert 0 < len(everywhere) < 26
    assert not found.is_complete
    for item in found.candidates:
        assert (item.cases, item.left_out) == (len(everywhere), 26 - len(everywhere))
        assert 0 < item.fault_free <= item.cases
        assert item.unexecuted
        assert any(unmet.verdict is Verdict.NOT_RUN for unmet in item.unmet) or item.failing
    for pair in found.pairs:
        both = [item for item in runs.values() if {pair.a, pair.b} <= item.keys()]
        assert pair.pairs == len(both) > 0
        assert pair.incomplete > 0
        told = of_all(found, pair.a, pair.b)
        (contacts,) = [item for item in told if item.fsr == "FSR-01"]
        assert contacts.pairs == len(both)
        assert not any("NOT_RUN" in words for words in contacts.verdicts)
        assert contacts.only_b_fails + contacts.both_fail == sum(item[pair.b] for item in both)
    assert found.cheapest == ()


def test_interrupted_campaign_keeps_its_drawn_points_as_the_sample(half: Executed) -> None:
    found = [item for item in compared(half).differences if item.cluster == "cut_in"]
    assert found
    for item in found:
        assert item.inference is not None
        assert item.inference.units == 12
        assert item.inference.undecided > 0
        assert item.margin is None or item.margin.interval is None


def test_least_change_is_a_loss_only_below_zero(everything: Comparison) -> None:
    assert everything.is_complete
    assert all(item.left_out == 0 == len(item.unexecuted) for item in everything.candidates)
    changes = [item.margin for item in everything.differences if item.margin is not None]
    losses = [item.loss for item in changes]
    assert None in losses
    assert all(item is None or item < 0.0 for item in losses)
    assert all((item.loss is None) == (item.least >= 0.0) for item in changes)


def test_report_shows_no_comparison_of_one(suites: Executed, mini: Executed) -> None:
    with mini.opened() as (repository, campaign):
        odd = repository.content("odd", campaign.odd_digest)
        one = {**odd, "architectures": {"camera_radar": odd["architectures"]["camera_radar"]}}
        assert overview(repository, campaign, one) is None
        both = overview(repository, campaign, odd)
    assert both is not None
    assert both.baseline == "camera_radar"
    assert {item.kind for item in both.differences} == {"all"}
    assert suites.db != mini.db


# --- Candidates of a comparison: which are on the front, which one to choose, and why -------------


def test_unmet_requirement_tells_where_it_fails(everything: Comparison) -> None:
    for candidate in everything.candidates:
        for unmet in candidate.unmet:
            if unmet.verdict is Verdict.FAIL:
                assert unmet.failing, (candidate.id, unmet.fsr)
                assert max(unmet.failing.values()) <= candidate.failing


def test_leave_one_out_is_found_in_the_campaign(everything: Comparison) -> None:
    found = {(item.sensor, item.with_it, item.without_it) for item in everything.contributions}
    assert ("front_radar", "camera_radar", "no_radar") in found
    assert ("spare_camera", "spare", "camera_radar") in found
    assert not any("legacy_camera" in item for item in found)
    for item in everything.contributions:
        if item.sensor == "spare_camera":
            assert (item.rescued, item.harmed, item.cost) == (0, 0, 40.0)


def test_dearer_copy_is_dominated_by_the_original(suites: Executed) -> None:
    everything = compared(suites, architectures=("camera_radar", "twin", "spare"))
    original, twin = everything.candidate("camera_radar"), everything.candidate("twin")
    assert (twin.failing, twin.availability) == (original.failing, original.availability)
    assert twin.cost is not None
    assert (original.is_on_front, twin.is_on_front) == (True, False)
    assert twin.dominated_by == "camera_radar"
    assert everything.candidate("spare").dominated_by == "camera_radar"


def test_epsilon_takes_a_small_advantage_away(suites: Executed) -> None:
    names, objectives = ("camera_radar", "legacy_camera"), ("cost", "failures")
    exact = compared(suites, architectures=names, objectives=objectives)
    assert exact.candidate("camera_radar").is_on_front
    epsilon = {"failures": 1000.0}
    rough = compared(suites, architectures=names, objectives=objectives, epsilon=epsilon)
    assert rough.candidate("camera_radar").dominated_by == "legacy_camera"


def test_objectives_are_those_asked_for_and_known(suites: Executed) -> None:
    names = ("camera_radar", "twin", "no_radar")
    found = compared(suites, architectures=names, objectives=("margin", "cost"))
    assert [item.name for item in found.objectives] == ["margin", "cost"]
    for item in found.candidates:
        assert item.values["margin"] == item.worst_margin
    # The margin of a violation without a number is not known.
    found = compared(suites, objectives=("margin", "cost"))
    assert found.left_out == ("margin: not known for legacy_camera",)


def test_objective_that_is_not_known_for_all_is_left_out_and_said(suites: Executed) -> None:
    with suites.opened() as (repository, campaign):
        odd = repository.content("odd", campaign.odd_digest)
        for part in odd["architectures"]["twin"]["sensors"].values():
            part["cost"] = 0.0
        odd["architectures"]["twin"]["cost"] = 0.0

        class Priceless:
            """The same database, and nobody says what the twin costs."""

            def __getattr__(self, name: str) -> Any:
                return getattr(repository, name)

            def content(self, *_: str) -> Any:
                return odd

        found = compare(Priceless(), campaign)  # type: ignore[arg-type]
    assert found.left_out == ("cost: not known for twin",)
    assert found.candidate("twin").cost is None


def test_cheapest_passes_every_mandatory_fsr(everything: Comparison) -> None:
    for name in everything.cheapest:
        item = everything.candidate(name)
        assert item.mandatory > 0
        assert item.unmet == ()
    met = [item for item in everything.candidates if not item.unmet]
    assert bool(met) == bool(everything.cheapest)


def test_unmet_fsrs_are_those_of_the_gate(suites: Executed, everything: Comparison) -> None:
    with suites.opened() as (repository, campaign):
        gate = repository.gate(campaign.id)
    for candidate in everything.candidates:
        own = [item for item in gate if item.architecture == candidate.id]
        assert candidate.mandatory == len(own) > 0
        assert {(item.fsr, item.verdict) for item in candidate.unmet} == {
            (item.fsr, item.verdict) for item in own if item.verdict is not Verdict.PASS
        }


def test_sightings_add_up(everything: Comparison) -> None:
    by_name = {(item.architecture, item.sensor): item for item in everything.sightings}
    assert ("spare", "spare_camera") not in by_name
    for name in ("camera_radar", "twin", "spare"):
        camera, radar = by_name[name, "front_camera"], by_name[name, "front_radar"]
        assert camera.runs == radar.runs > 0
        assert camera.shared == radar.shared
        assert camera.first + radar.first + camera.shared <= camera.runs
    alone = by_name["no_radar", "front_camera"]
    assert (alone.first, alone.shared, alone.only) == (alone.runs - alone.never, 0, alone.first)
    assert alone.lead_s is None


def test_first_sighting_is_the_time_of_the_detection_metric(suites: Executed) -> None:
    with suites.opened() as (repository, campaign):
        found = repository.compared(campaign.id, ("camera_radar",))
        times = []
        for digest in found.result:
            stored = known(repository.run_row(digest))
            metric = stored.metrics["first_detection_distance_m"]
            is_seen = metric.status == "value" and metric.value != 0.0
            times.append(metric.time_s if is_seen and metric.time_s is not None else np.nan)
    earliest = np.where(np.isfinite(found.seen_s), found.seen_s, np.inf).min(axis=1)
    assert np.isfinite(times).any()
    assert np.array_equal(np.where(np.isinf(earliest), np.nan, earliest), times, equal_nan=True)


def priced(declared: float, **parts: float) -> dict[str, Any]:
    sensors = {name: {"cost": cost} for name, cost in parts.items()}
    return {"cost": declared, "sensors": sensors, "channels": {"nominal": {"cost": 0.0}}}


def test_declared_cost_is_the_total_where_it_covers_the_parts() -> None:
    cost = known(cost_of(priced(300.0, camera=120.0, radar=90.0)))
    assert (cost.total, cost.declared) == (300.0, 300.0)
    assert cost.parts == {"sensors.camera": 120.0, "sensors.radar": 90.0}
    # Parts that cost more are the total, and what declares no cost is not free.
    assert known(cost_of(priced(100.0, camera=120.0))).total == 120.0
    assert cost_of(priced(0.0, camera=0.0)) is None


def test_sensors_that_measure_and_feed_a_channel() -> None:
    kinds = {"camera": "camera", "spare": "camera", "truth": "ground_truth"}
    sensors = {name: {"kind": kind} for name, kind in kinds.items()}
    sensors["place"] = {"kind": "localisation"}
    links = ["camera", "place", "truth", "switch"]
    content = {"sensors": sensors, "channels": {"nominal": {"links": links}}}
    assert measuring(content) == ["camera"]
    assert suite_of(content) == {"camera": 1}


def parts(*sensors: str, rate: float = 20.0) -> dict[str, Any]:
    return {
        "vehicle": {"length": 4.9},
        "sensors": {name: {"rate": rate} for name in sensors},
        "channels": {"nominal": {"links": list(sensors)}},
    }


def test_sensor_that_one_has_more_is_named_and_only_if_all_else_is_equal() -> None:
    assert extra_sensor(parts("camera", "radar"), parts("camera")) == "radar"
    assert extra_sensor(parts("camera"), parts("camera", "radar")) is None
    assert extra_sensor(parts("camera", "radar"), parts("camera", rate=10.0)) is None
    assert extra_sensor(parts("camera", "radar", "lidar"), parts("camera")) is None
    assert extra_sensor(parts("camera", "radar"), parts("lidar")) is None


def cases(*rows: tuple[str, int, str, dict[str, float]]) -> Any:
    """Make cases of architecture, situation, fault entry and swept values."""
    return SimpleNamespace(
        architecture=Labels.of(row[0] for row in rows),
        situation=np.array([row[1] for row in rows]),
        fault_entry=Labels.of(row[2] for row in rows),
        scenario=Labels.of("cut_in" for _ in rows),
        axes=encode_points(row[3] for row in rows),
    )


def pairs(matching: Matching, a: str, b: str) -> list[tuple[int, int]]:
    first, second = matching.pairs(a, b)
    return list(zip(first.tolist(), second.tolist(), strict=True))


def test_situation_fault_and_axes_of_both_decide() -> None:
    matching = Matching(
        cases(("a", 1, "none", {}), ("a", 1, "out", {}), ("b", 1, "none", {}), ("b", 2, "out", {}))
    )
    assert pairs(matching, "a", "b") == [(0, 2)]
    left, right = ("a", 1, "none", {"yaw": 0.0}), ("a", 1, "none", {"yaw": 2.0})
    matching = Matching(cases(left, right, ("b", 1, "none", {"yaw": 2.0})))
    assert pairs(matching, "a", "b") == [(1, 2)]
    # An axis that only one has leaves all its cases as partners.
    matching = Matching(cases(left, right, ("b", 1, "none", {})))
    assert pairs(matching, "a", "b") == [(0, 2), (1, 2)]
    assert pairs(matching, "b", "a") == [(2, 0), (2, 1)]
    # Nobody of that name has no cases.
    assert len(matching.rows("c")) == 0
    assert pairs(matching, "a", "c") == []


def test_common_cases_are_those_of_everybody() -> None:
    found = [("a", 1), ("a", 2), ("b", 2), ("b", 1), ("c", 2)]
    matching = Matching(cases(*((name, situation, "none", {}) for name, situation in found)))
    common = {name: rows.tolist() for name, rows in matching.common(("a", "b", "c")).items()}
    assert common == {"a": [1], "b": [2], "c": [4]}


def test_comparison_of_five_suites_is_frozen(suites: Executed, everything: Comparison) -> None:
    """Counts, fronts, differences with their worst runs, and which sensor is the first."""
    content = thinned(everything.model_dump(mode="json"), 24)
    assert_frozen("suites_compared.json", as_json(content, suites.project.folder))
    some = compared(
        suites, architectures=("legacy_camera",), baseline="camera_radar", objectives=("cost",)
    )
    content = thinned(some.model_dump(mode="json"), 24)
    assert_frozen("suites_against_one.json", as_json(content, suites.project.folder))
