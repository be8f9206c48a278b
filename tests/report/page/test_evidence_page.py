"""Confidence, coverage of the ODD and the step on the page: placed, in order, and never green."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from lxml import html as lxml_html

from adeye.report.comparison.records import Range
from adeye.report.page.html import render
from adeye.report.page.views import MAX_LINES, arrange_evidence
from tests.report.fake_evidence import claim, claims, coverage, line, refused, step

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.report.model.report import Report
    from tests.report.browser import Browser

PARTS = ("confidence", "odd_coverage", "step_uncertainty")


def section(report: Report, name: str, **changes: Any) -> str:
    """Text of one section of the page."""
    tree: Any = lxml_html.document_fromstring(
        render(report.model_copy(update={"replays": (), **changes}))
    )
    (found,) = tree.xpath(f"//section[@id='{name}']")
    return " ".join(" ".join(found.itertext()).split())


def test_bounds_of_the_gate_come_first_and_lie_on_one_axis(report: Report) -> None:
    view = arrange_evidence(report).confidence
    assert view is not None
    assert [row.claim.is_in_gate for row in view.rows] == [True, True, True, False]
    first, worse, weighted, _ = view.rows
    # The largest end is 0.139.
    assert view.end == "0.20"
    assert (first.dot, first.low, first.high, first.bound) == (0.0, 0.0, 29.8, 24.35)
    assert (worse.share, worse.interval) == ("0.050", "0.010 to 0.14")
    assert (weighted.low, weighted.interval) == (None, "")
    assert weighted.upper == "0.049 (0.030 to 0.090)"


@pytest.mark.parametrize(
    ("upper", "end"),
    [(0.0007, "0.0010"), (0.02, "0.020"), (0.3, "0.50"), (0.6, "1.00"), (1.0, "1.00")],
)
def test_axis_ends_at_a_round_number_that_no_bound_passes(
    report: Report, upper: float, end: str
) -> None:
    found = claims(claim(upper=upper, interval=Range(low=0.0, high=upper / 2)))
    view = arrange_evidence(report.model_copy(update={"confidence": found})).confidence
    assert view is not None
    assert view.end == end
    (row,) = view.rows
    assert row.bound is not None
    assert row.bound <= 100.0


def test_grid_says_that_there_is_no_probability(report: Report) -> None:
    grid = claims(refused("FSR-01", "cut_in", "chosen points, not a random sample"))
    text = section(report, "confidence", confidence=grid)
    assert "No probability is stated." in text
    assert "chosen points, not a random sample. 1 of FSR × architecture" in text
    assert "At most" not in text
    assert "Conditions" not in text


@pytest.mark.slow
def test_mandatory_fsrs_without_a_statement_are_named(report: Report) -> None:
    assert "Nothing is said about FSR-03 , though mandatory" in section(report, "confidence")
    two = claims(
        claim(), refused("FSR-01", "cut_in", "a grid", architecture="lidar", is_in_gate=True)
    )
    text = section(report, "confidence", confidence=two)
    assert "Nothing is said about FSR-01 for lidar" in text


def test_nothing_judged_is_no_confidence(report: Report) -> None:
    assert "No probability is stated." in section(report, "confidence", confidence=claims())


def test_bounds_stand_beside_their_conditions(report: Report) -> None:
    text = section(report, "confidence")
    assert "cut_in : independent draws: gap uniform from 20 m to 60 m." in text
    assert "About this model." in text
    assert "by exposure" in text
    assert "adeye confidence c-5e21a07f" in text
    assert "Per hour" in text


def test_few_test_cases_are_not_drawn_as_none_and_none_is_not_drawn(report: Report) -> None:
    view = arrange_evidence(report).coverage
    assert view is not None
    speed, light = view.rows
    assert [(box.text, box.share) for box in speed.boxes] == [("uncovered", 0.0), ("536", 99.81)]
    assert [(box.text, box.share) for box in light.boxes] == [
        ("535", 99.63),
        ("2", 2.0),
        ("no scenario", 0.0),
    ]
    assert (view.covered_bins, view.bins) == (3, 4)


def test_gaps_of_the_odd_are_told_with_how_many_are_not_listed(report: Report) -> None:
    text = section(report, "odd-coverage")
    assert "feasible pairs covered 1 of 4" in text
    assert "3 in which the scenario did not come about; 1 with an attribute in no bin" in text
    assert "ego_speed × illumination 0 to 60 km/h × day, 60 to 130 km/h × dusk" in text
    assert "and 1 more." in text
    assert "gap >= 20 m" in text


def test_coverage_that_was_not_counted_shows_no_figure(report: Report) -> None:
    found = coverage(refusal="Not counted here: too many.", counted=0, not_judged=0, attributes=())
    text = section(report, "odd-coverage", odd_coverage=found)
    assert "Not counted here: too many." in text
    assert "feasible" not in text


def test_step_that_nobody_asked_about_is_not_taken_for_exact(report: Report) -> None:
    text = section(report, "step", step_uncertainty=step(situations=None, lines=()))
    assert "Not asked for. Margins are taken as exact" in text
    assert "uncertainty: {situations: 20}" in text


def test_twins_that_are_missing_are_said_to_be(report: Report) -> None:
    assert "Not known yet." in section(report, "step", step_uncertainty=step(lines=()))


def test_too_few_pairs_are_no_uncertainty_of_zero(report: Report) -> None:
    text = section(report, "step")
    assert "margins with an uncertainty 1 of 3" in text
    assert "verdicts that half the step changes 2" in text
    assert "FSR-09 cut_ in camera_radar 20 4 too few 0.013 s" in text
    assert "2 PASS → FAIL" in text
    assert "1 more have no value in any pair." in text


def test_long_list_of_metrics_is_cut_and_says_so(report: Report) -> None:
    many = tuple(line(f"metric_{number}", kind="metric") for number in range(MAX_LINES + 7))
    found = step(lines=many)
    view = arrange_evidence(report.model_copy(update={"step_uncertainty": found})).step
    assert view is not None
    assert (len(view.metrics), view.unlisted) == (MAX_LINES, 7)


@pytest.mark.slow
def test_report_without_these_parts_has_no_sections_and_no_links(report: Report) -> None:
    page = render(report.model_copy(update={"replays": (), **dict.fromkeys(PARTS)}))
    tree: Any = lxml_html.document_fromstring(page)
    for name in ("confidence", "odd-coverage", "step"):
        assert tree.xpath(f"//*[@id='{name}']") == []
        assert tree.xpath(f"//nav/a[@href='#{name}']") == []


@pytest.mark.slow
@pytest.mark.parametrize("width", [800, 1280])
@pytest.mark.parametrize("dark", [False, True])
def test_drawn_parts_stay_within_their_boxes(
    browser: Browser, page: Path, width: int, *, dark: bool
) -> None:
    browser.open(page, width=width, dark=dark)
    assert browser.run("document.documentElement.scrollWidth <= window.innerWidth") is True
    inside = """[...document.querySelectorAll('.bin')].every(box => {
      const b = box.getBoundingClientRect();
      return [...box.children].every(e => {
        const r = e.getBoundingClientRect();
        return r.left >= b.left && r.right <= b.right + 0.5 && r.bottom <= b.bottom + 0.5;
      });
    })"""
    assert browser.run("document.querySelectorAll('.bin').length") == 5
    assert browser.run(inside) is True
    # The bars differ from what they lie on, in either scheme.
    colours = "['.part', '.whole'].map(s => getComputedStyle(document.querySelector(s)).fill)"
    assert len(set(browser.run(colours))) == 2


@pytest.mark.slow
def test_filter_hides_the_bounds_of_other_architectures(browser: Browser, page: Path) -> None:
    browser.open(page, width=1280)
    rows = "[...document.querySelectorAll('#confidence tr[data-architecture]')]"
    shown = f"{rows}.filter(row => !row.hidden).length"
    assert browser.run(shown) == 4
    choose = """(() => { const s = document.querySelector('select[name=architecture]');
      s.value = 'legacy_camera'; s.dispatchEvent(new Event('change', {bubbles: true})); })()"""
    browser.run(choose)
    browser.wait(lambda: browser.run(shown) == 1)
