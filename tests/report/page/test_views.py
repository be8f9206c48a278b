"""The matrix both ways and the goal structure, as the page shows them."""

import xml.etree.ElementTree as ET
from typing import Any

import pytest

from adeye.judge.verdict import WORST_FIRST, ExitCode, Verdict
from adeye.report.formats.gsn import argument_of
from adeye.report.formats.matrix import TraceGroup, grouped, matrix_of
from adeye.report.model.report import Report
from adeye.report.page.html import WAYS, arrange, badge, goal_structure, render, worst_first


def test_architectures_of_the_gate_come_first(report: Report) -> None:
    page = arrange(report)
    assert [item.id for item in page.architectures] == ["camera_radar", "legacy_camera", "lidar"]
    assert page.gate == badge(Verdict.PASS)


def test_worst_gate_decides_the_headline_and_no_gate_is_not_a_pass(report: Report) -> None:
    for is_gate, verdict in ((True, Verdict.FAIL), (False, Verdict.NOT_RUN)):
        changed = tuple(i.model_copy(update={"is_gate": is_gate}) for i in report.architectures)
        page = arrange(report.model_copy(update={"architectures": changed}))
        assert page.gate == badge(verdict)


@pytest.mark.parametrize(
    ("code", "verdict"),
    [(ExitCode.INCOMPLETE, Verdict.ERROR), (ExitCode.FAILED, Verdict.FAIL)],
)
def test_headline_is_green_only_if_the_gate_is_though_all_verdicts_pass(
    report: Report, code: ExitCode, verdict: Verdict
) -> None:
    told = {"exit_code": code, "message": "a metric raised in 2 runs"}
    refused = report.model_copy(update=told)
    assert arrange(refused).gate == badge(verdict)
    headline = render(refused).partition('class="headline')[2].partition("</dl>")[0]
    assert f"Exit code {code.value}</b>" in headline
    assert "a metric raised in 2 runs" in headline


def test_requirements_are_sorted_worst_first_and_optional_last_and_keep_their_number(
    report: Report,
) -> None:
    found = arrange(report).rows
    rows = [row.fsr.id for row in found]
    # All pass in the gate, so that the worst of the others decide; all alike as the concept has it.
    assert rows[:3] == ["FSR-01", "FSR-02", "FSR-06"]
    assert rows[-1] == "FSR-07"
    assert all(report.fsrs[row.number - 1] == row.fsr for row in found)
    legacy = tuple(
        item.model_copy(update={"is_gate": item.id == "legacy_camera"})
        for item in report.architectures
    )
    changed = arrange(report.model_copy(update={"architectures": legacy})).rows
    assert {row.fsr.id for row in changed[:2]} == {"FSR-01", "FSR-02"}


def test_cells_point_to_their_details(report: Report) -> None:
    page = arrange(report)
    for row in page.rows:
        for cell in row.cells:
            detail = page.details[cell.number]
            place = cell.scenario or "all scenarios"
            assert detail["title"] == f"{row.fsr.id} · {cell.architecture} · {place}"
            assert detail["run"] == cell.run
            assert detail["command"]


def test_margin_is_shown_beside_pass_and_fail_only(report: Report) -> None:
    cells = [cell for row in arrange(report).rows for cell in row.cells]
    assert {cell.badge.style for cell in cells if cell.margin} == {"PASS", "FAIL"}


def test_card_counts_mandatory_requirements(report: Report) -> None:
    cards = {card.architecture.id: card for card in arrange(report).cards}
    assert cards["camera_radar"].counts == ((badge(Verdict.PASS), 6),)
    assert cards["legacy_camera"].counts == ((badge(Verdict.FAIL), 2), (badge(Verdict.PASS), 4))
    assert cards["legacy_camera"].worst.startswith("FSR-02 \N{MINUS SIGN}1.61 m/s²")


def test_requirement_not_judged_in_a_scenario_says_so(report: Report) -> None:
    fsrs = tuple(fsr.model_copy(update={"scenarios": ("cut_in",)}) for fsr in report.fsrs)
    cells = tuple(cell for cell in report.cells if cell.scenario in {None, "cut_in"})
    page = arrange(report.model_copy(update={"fsrs": fsrs, "cells": cells}))
    outside = [c for row in page.rows for c in row.cells if c.scenario == "lead_braking"]
    assert {cell.badge.word for cell in outside} == {"not judged here"}


Ways = dict[str, tuple[TraceGroup, ...]]


@pytest.fixture(scope="module")
def ways(report: Report) -> Ways:
    return {by: grouped(matrix_of(report, by), by) for by, _, _ in WAYS}


def test_both_ways_have_the_same_links(ways: Ways) -> None:
    def links(by: str, column: Any) -> set[tuple[str, str]]:
        return {(group.id, name) for group in ways[by] if group.id for name in group.links[column]}

    pairs = links("hazard", "element")
    assert pairs
    assert pairs == {(hazard, element) for element, hazard in links("element", "hazard")}
    there = links("scenario", "fsr")
    assert {name for _, name in there} == {name for _, name in links("hazard", "fsr")}


def test_verdicts_are_counted_the_worst_first(ways: Ways) -> None:
    for groups in ways.values():
        for counts in (worst_first(group.verdicts) for group in groups):
            ranks = [WORST_FIRST.index(verdict) for verdict, _ in counts]
            assert ranks == sorted(ranks)
            assert all(count > 0 for _, count in counts)
    assert worst_first(ways["hazard"][0].verdicts)[0][0] is Verdict.FAIL


def test_line_with_a_verdict_that_is_no_pass_has_a_gap(ways: Ways) -> None:
    for group in ways["scenario"]:
        is_shown = all(word == "PASS" for word in group.verdicts)
        assert bool(group.gaps) is not (is_shown and bool(group.verdicts))


def test_drawing_has_every_node_under_an_id_of_its_own_and_names_no_address(
    report: Report,
) -> None:
    text = goal_structure(report)
    assert text.startswith("<svg ")
    assert "http" not in text
    root = ET.fromstring(text)  # noqa: S314 - our own drawing
    ids = [str(node.get("id")) for node in root.iter() if node.get("id")]
    assert len(ids) == len(set(ids))
    assert set(ids) == {f"gsn-{node.id}" for node in argument_of(report).nodes}
