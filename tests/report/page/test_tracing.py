"""The matrix both ways and the goal structure, as the page shows them."""

import xml.etree.ElementTree as ET

import pytest

from adeye.judge.verdict import WORST_FIRST, Verdict
from adeye.report.formats.gsn import argument_of
from adeye.report.model.report import Report
from adeye.report.page.views import TraceWay, goal_structure, ways_of


@pytest.fixture(scope="module")
def ways(report: Report) -> dict[str, TraceWay]:
    return {way.by: way for way in ways_of(report)}


def test_both_ways_have_the_same_links(ways: dict[str, TraceWay]) -> None:
    def links(way: TraceWay, column: str) -> set[tuple[str, str]]:
        at = way.columns.index(column)
        return {(line.id, name) for line in way.lines if line.id for name in line.links[at]}

    forwards, backwards = ways["hazard"], ways["element"]
    pairs = links(forwards, "element")
    assert pairs
    assert pairs == {(hazard, element) for element, hazard in links(backwards, "hazard")}
    there = links(ways["scenario"], "fsr")
    assert {name for _, name in there} == {name for _, name in links(forwards, "fsr")}


def test_verdicts_are_counted_the_worst_first(ways: dict[str, TraceWay]) -> None:
    for way in ways.values():
        for line in way.lines:
            ranks = [WORST_FIRST.index(verdict) for verdict, _ in line.verdicts]
            assert ranks == sorted(ranks)
            assert all(count > 0 for _, count in line.verdicts)
    assert ways["hazard"].lines[0].verdicts[0][0] is Verdict.FAIL


def test_line_with_a_verdict_that_is_no_pass_has_a_gap(ways: dict[str, TraceWay]) -> None:
    for line in ways["scenario"].lines:
        is_shown = all(verdict is Verdict.PASS for verdict, _ in line.verdicts)
        assert bool(line.gaps) is not (is_shown and bool(line.verdicts))


def test_drawing_has_every_node_under_an_id_of_its_own(report: Report) -> None:
    text = goal_structure(report)
    root = ET.fromstring(text)  # noqa: S314 - our own drawing
    ids = [node.get("id") for node in root.iter() if node.get("id")]
    assert len(ids) == len(set(ids))
    assert all(str(name).startswith("gsn-") for name in ids)
    drawn = {str(name).removeprefix("gsn-") for name in ids}
    assert drawn == {node.id for node in argument_of(report).nodes}


def test_drawing_stands_in_a_page_without_an_address(report: Report) -> None:
    text = goal_structure(report)
    assert text.startswith("<svg ")
    assert "http" not in text
