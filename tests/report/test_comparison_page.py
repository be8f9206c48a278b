"""The comparison as a page: escaped, inert, drawn where it belongs; in the report only if any."""

from __future__ import annotations

from pathlib import Path

import pytest

from adeye.report.model.report import Report
from adeye.report.page.html import render, render_comparison
from tests.report.browser import Browser
from tests.report.parts import candidate, comparison

OVERLAPS = """(() => {
  const labels = [...document.querySelectorAll(".front .dot text")];
  const boxes = labels.map((label) => label.getBoundingClientRect());
  const beside = (a, b) => a.right <= b.left || b.right <= a.left;
  const above = (a, b) => a.bottom - 2 <= b.top || b.bottom - 2 <= a.top;
  return boxes.some((a, i) => boxes.some((b, j) => i < j && !beside(a, b) && !above(a, b)));
})()"""


def test_page_escapes_what_people_wrote() -> None:
    text = render_comparison(comparison(title="<script>alert(1)</script>"))
    assert "<script>" not in text
    assert "&lt;script&gt;alert(1)" in text


def test_page_says_everything_once() -> None:
    text = render_comparison(comparison())
    for part in ("cheapest that meets all", "dominated by camera_radar", "not applicable",
                 "Chosen points.", "1 more not executed", "efefefefefef"):  # fmt: skip
        assert part in text
    assert text.count("<svg") == 1
    assert render_comparison(comparison()) == text


def test_without_a_cost_there_is_no_picture_and_it_is_said() -> None:
    candidates = (candidate("a", cost=None), candidate("b"))
    text = render_comparison(comparison(candidates=candidates, pairs=(), cheapest=()))
    assert "<svg" not in text
    assert "declares no cost" in text


@pytest.mark.slow
def test_report_has_the_section_exactly_if_there_is_a_comparison(report: Report) -> None:
    assert 'id="comparison"' not in render(report)
    text = render(report.model_copy(update={"comparison": comparison()}))
    assert text.count('id="comparison"') == 1
    assert text.count('id="comparison-table"') == 1
    assert 'href="#comparison"' in text


@pytest.mark.chromium
@pytest.mark.parametrize("dark", [False, True])
def test_page_is_drawn_without_a_problem(browser: Browser, tmp_path: Path, dark: bool) -> None:  # noqa: FBT001 - a case
    path = tmp_path / "compared.html"
    path.write_text(render_comparison(comparison()), "utf-8")
    browser.problems.clear()
    browser.open(path, dark=dark)
    assert browser.problems == []
    assert browser.run("document.documentElement.scrollWidth <= window.innerWidth")
    box = browser.run("(() => { const b = document.querySelector('svg').getBoundingClientRect();"
                      " return [b.width, b.height]; })()")  # fmt: skip
    assert min(box) > 200.0
    assert browser.run("document.querySelectorAll('.front .dot.front').length") == 2
    assert not browser.run(OVERLAPS)
