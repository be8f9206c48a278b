"""Comparison of a small executed campaign: laws, counts that agree with SQL, what is refused."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from typing import Any

import pytest

from adeye.judge.verdict import Verdict
from adeye.report.comparison.compare import compare, overview
from adeye.report.comparison.records import CompareOptions, Comparison, Difference
from adeye.report.page.charts import draw_front
from adeye.report.page.html import render_comparison
from adeye.store.repository import Repository
from tests.project import Executed
from tests.sql import rows
from tests.suites import build_half


def compared(executed: Executed, **options: Any) -> Comparison:
    with Repository.open(executed.db, create=False) as repository:
        campaign = repository.find_campaign(executed.summary.campaign)
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
    assert not is_same(everything.differences_of("camera_radar", "legacy_camera"))


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
        for item in everything.differences_of("camera_radar", "legacy_camera")
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
    assert [(item.a, item.b) for item in found.pairs] == [
        ("legacy_camera", "camera_radar"),
        ("legacy_camera", "twin"),
    ]


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
        assert [(one.scenario, one.missing == one.planned) for one in item.unexecuted] == [
            ("cut_in", True),
            ("lead_braking", True),
        ]
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
        told = found.differences_of(pair.a, pair.b)
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
    with Repository.open(mini.db, create=False) as repository:
        campaign = repository.find_campaign(mini.summary.campaign)
        odd = repository.content("odd", campaign.odd_digest)
        one = {**odd, "architectures": {"camera_radar": odd["architectures"]["camera_radar"]}}
        assert overview(repository, campaign, one) is None
        both = overview(repository, campaign, odd)
    assert both is not None
    assert both.baseline == "camera_radar"
    assert {item.kind for item in both.differences} == {"all"}
    assert suites.db != mini.db
