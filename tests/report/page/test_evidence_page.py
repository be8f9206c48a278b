"""Confidence, coverage of the ODD and the step on the page: placed, in order, and never green."""

from typing import Any

import pytest
from lxml import html as lxml_html

from adeye.report.comparison.records import Range
from adeye.report.model.report import Report
from adeye.report.page.html import axis_end, render
from tests.report.parts import claim, claims, coverage, line, refused, step

PARTS = ("confidence", "odd_coverage", "step_uncertainty")


def section(report: Report, name: str, **changes: Any) -> str:
    """Text of one section of the page."""
    tree: Any = lxml_html.document_fromstring(
        render(report.model_copy(update={"replays": (), **changes}))
    )
    (found,) = tree.xpath(f"//section[@id='{name}']")
    return " ".join(" ".join(found.itertext()).split())


def test_bounds_of_the_gate_come_first_and_lie_on_one_axis(report: Report) -> None:
    page = lxml_html.document_fromstring(render(report.model_copy(update={"replays": ()})))
    rows = page.xpath("//table[@class='list claims']/tbody/tr")
    assert [bool(row.xpath("td[1]/span")) for row in rows] == [True, True, True, False]
    # The largest end is 0.139.
    assert page.xpath("//table[@class='list claims']/thead//span/text()")[1] == "0.20"
    first, worse, weighted, _ = rows
    places = first.xpath(".//circle/@cx | .//line[@class!='grid']/@x1 | .//line/@x2")
    assert sorted(places) == sorted(["100%", "0.0%", "29.8%", "24.35%", "24.35%", "0.0%"])
    assert worse.xpath(".//circle/@cx") == ["25.0%"]
    assert weighted.xpath(".//line[@class='span']") == []


def test_axis_ends_at_a_round_number_that_no_bound_passes() -> None:
    for upper, end in {0.0007: 0.001, 0.02: 0.02, 0.3: 0.5, 0.6: 1.0, 1.0: 1.0}.items():
        found = axis_end([claim(upper=upper, interval=Range(low=0.0, high=upper / 2))])
        assert found == pytest.approx(end)
        assert found >= upper


def test_grid_and_nothing_judged_say_that_there_is_no_probability(report: Report) -> None:
    grid = claims(refused("FSR-01", "cut_in", "chosen points, not a random sample"))
    text = section(report, "confidence", confidence=grid)
    assert "No probability is stated." in text
    assert "chosen points, not a random sample. 1 of FSR × architecture" in text
    assert "At most" not in text
    assert "Conditions" not in text
    assert "No probability is stated." in section(report, "confidence", confidence=claims())


def test_mandatory_fsrs_without_a_statement_are_named(report: Report) -> None:
    assert "Nothing is said about FSR-03 , though mandatory" in section(report, "confidence")
    two = claims(
        claim(), refused("FSR-01", "cut_in", "a grid", architecture="lidar", is_in_gate=True)
    )
    text = section(report, "confidence", confidence=two)
    assert "Nothing is said about FSR-01 for lidar" in text


def test_bounds_stand_beside_their_conditions(report: Report) -> None:
    text = section(report, "confidence")
    assert "cut_in : independent draws: gap uniform from 20 m to 60 m." in text
    assert "About this model." in text
    assert "by exposure" in text
    assert "0.050 0.010 to 0.14" in text
    assert "0.049 (0.030 to 0.090)" in text
    assert "adeye confidence c-5e21a07f" in text
    assert "Per hour" in text


def test_few_test_cases_are_not_drawn_as_none_and_none_is_not_drawn(report: Report) -> None:
    page = lxml_html.document_fromstring(render(report.model_copy(update={"replays": ()})))
    speed, light = page.xpath("//section[@id='odd-coverage']//dl[@class='bins']/dd")
    found = [
        [
            (box.findtext("b"), [part.get("width") for part in box.xpath(".//rect[@class='part']")])
            for box in row.xpath("span")
        ]
        for row in (speed, light)
    ]
    assert found == [
        [("uncovered", []), ("536", ["99.81%"])],
        [("535", ["99.63%"]), ("2", ["2.0%"]), ("no scenario", [])],
    ]
    assert "feasible bins covered 3 of 4" in section(report, "odd-coverage")


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


def test_step_that_nobody_asked_about_or_is_not_known_is_not_taken_for_exact(
    report: Report,
) -> None:
    text = section(report, "step", step_uncertainty=step(situations=None, lines=()))
    assert "Not asked for. Margins are taken as exact" in text
    assert "uncertainty: {situations: 20}" in text
    assert "Not known yet." in section(report, "step", step_uncertainty=step(lines=()))


def test_too_few_pairs_are_no_uncertainty_of_zero(report: Report) -> None:
    text = section(report, "step")
    assert "margins with an uncertainty 1 of 3" in text
    assert "verdicts that half the step changes 2" in text
    assert "FSR-09 cut_ in camera_radar 20 4 too few 0.013 s" in text
    assert "2 PASS → FAIL" in text
    assert "1 more have no value in any pair." in text


def test_long_list_of_metrics_is_cut_and_says_so(report: Report) -> None:
    many = tuple(line(f"metric_{number}", kind="metric") for number in range(1007))
    text = section(report, "step", step_uncertainty=step(lines=many))
    assert "Metrics 1,000" in text
    assert "metric_ 999" in text
    assert "metric_ 1000" not in text
    assert "7 more metrics are not shown." in text
