"""Two architectures compared: by pairs of test cases, with what the numbers allow to say."""

from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from adeye.errors import UsageError
from adeye.judge.verdict import Verdict
from adeye.report.comparison.candidates import _cheapest
from adeye.report.comparison.records import (
    Candidate,
    CompareOptions,
    Cost,
    Unexecuted,
    Unmet,
)
from adeye.report.model.report import Report
from adeye.report.page.html import render, render_comparison
from tests.refusals import refused
from tests.report.browser import Browser
from tests.report.parts import candidate, comparison, difference
from tests.stored import known


def test_counts_must_add_up() -> None:
    refused(ValidationError, difference, pairs=41, says="are not 41 pairs")
    with pytest.raises(ValidationError, match="are not 40 pairs"):
        difference(verdicts={"PASS/PASS": 40, "PASS/FAIL": 1})


def test_comparison_that_contradicts_itself_is_refused() -> None:
    both = (candidate("camera_radar", dominated_by="legacy_camera"), candidate("legacy_camera"))
    for changes, said in (
        ({"cheapest": ("unheard_of",)}, "unheard_of"),
        ({"cheapest": ("legacy_camera",)}, "meeting everything"),
        ({"candidates": both}, "on the front and dominated"),
    ):
        refused(ValidationError, comparison, **changes, says=said)


def test_difference_is_one_if_verdicts_or_margins_move() -> None:
    assert difference().is_different
    margin = known(difference().margin)
    still = margin.model_copy(update={"least": 0.0, "greatest": 0.0})
    same = {"only_a_fails": 0, "only_b_fails": 0, "both_fail": 6}
    assert difference(**same).is_different
    assert not difference(**same, margin=still).is_different
    assert not difference(**same, margin=None).is_different


def test_candidate_is_found_by_its_name() -> None:
    found = comparison()
    assert found.candidate("lidar").dominated_by == "camera_radar"


def test_cheapest_comes_first_and_what_has_no_price_last() -> None:
    names = [("dear", 9.0), ("unknown", None), ("cheap", 1.0)]
    found = comparison(
        candidates=tuple(
            candidate(
                name,
                cost=None if cost is None else Cost(total=cost, declared=cost, parts={}),
            )
            for name, cost in names
        ),
        pairs=(),
        differences=(),
        cheapest=(),
    )
    assert [item.id for item in found.by_cost] == ["cheap", "dear", "unknown"]


def test_cheapest_is_not_known_while_one_that_costs_no_more_is_open() -> None:
    def priced(name: str, total: float, **more: Any) -> Candidate:
        return candidate(name, cost=Cost(total=total, declared=total, parts={}), **more)

    missing = (Unexecuted(scenario="cut_in", planned=4, missing=2),)
    good = priced("good", 5.0, mandatory=1)
    not_run = Unmet(fsr="FSR-01", verdict=Verdict.NOT_RUN)
    failing = Unmet(fsr="FSR-01", verdict=Verdict.FAIL)
    for total, unmet, unexecuted, expected in (
        (5.0, not_run, missing, ()),
        (6.0, not_run, missing, ("good",)),
        (1.0, failing, missing, ("good",)),
        (1.0, Unmet(fsr="FSR-01", verdict=None), missing, ("good",)),
        (1.0, Unmet(fsr="FSR-01", verdict=Verdict.VACUOUS), (), ("good",)),
    ):
        other = priced("other", total, unmet=(unmet,), unexecuted=unexecuted, mandatory=1)
        assert _cheapest((good, other)) == expected
    # A gate lets none pass whose channel fails.
    broken = priced("broken", 1.0, mandatory=1, refused=("channel_error of channel nominal",))
    assert _cheapest((good, broken)) == ("good",)
    with pytest.raises(ValidationError, match="meeting everything"):
        comparison(candidates=(broken,), pairs=(), differences=(), cheapest=("broken",))


def test_words_for_a_suite_and_for_what_it_does_not_meet() -> None:
    assert candidate("a", sensors={"camera": 1, "lidar": 4}).suite == "1 camera + 4 lidars"
    unmet = Unmet(fsr="FSR-01", verdict=Verdict.FAIL, failing={"cut_in": 3, "post": 1})
    assert unmet.text == "FSR-01 FAIL (cut_in 3, post 1)"
    assert Unmet(fsr="FSR-02", verdict=None).text == "FSR-02 not applicable"


KNOWN = ("camera_radar", "twin", "legacy_camera")


def ask(options: CompareOptions) -> None:
    """Check everything that a comparison checks before it reads a test case."""
    options.chosen(KNOWN)
    options.check()


def test_all_are_compared_in_the_order_of_the_odd_and_a_baseline_comes_first() -> None:
    for options, chosen in (
        (CompareOptions(), list(KNOWN)),
        (CompareOptions(("twin", "camera_radar", "twin")), ["camera_radar", "twin"]),
        (
            CompareOptions(("camera_radar",), baseline="legacy_camera"),
            ["legacy_camera", "camera_radar"],
        ),
    ):
        assert options.chosen(KNOWN) == chosen


def test_what_is_measured_by_default_is_allowed() -> None:
    CompareOptions().check()
    CompareOptions(objectives=("margin", "cost"), epsilon={"margin": 0.0, "cost": 20.0}).check()


def test_wrong_question_is_refused() -> None:
    wrong: tuple[tuple[dict[str, Any], str], ...] = (
        ({"architectures": ("camera_radr", "twin")}, "Did you mean 'camera_radar'"),
        ({"architectures": ("twin",)}, "nothing to compare 'twin' with"),
        ({"baseline": "unheard_of"}, "no architecture 'unheard_of'"),
        ({"confidence": 1.0}, "confidence is 1"),
        ({"objectives": ("price",)}, "no objective 'price'"),
        ({"objectives": ()}, "no objective is given"),
        ({"objectives": ("cost", "failures", "cost")}, "'cost' is given twice"),
        ({"epsilon": {"cost": -1.0}}, "epsilon of cost is -1"),
        ({"epsilon": {"cost": float("nan")}}, "epsilon of cost is nan"),
        ({"epsilon": {"cost": float("inf")}}, "epsilon of cost is inf. Give a finite number"),
        ({"epsilon": {"margin": 1.0}}, "epsilon of margin has no effect"),
        ({"epsilon": {"prize": 1.0}}, "no objective 'prize'"),
    )
    for options, part in wrong:
        refused(UsageError, ask, CompareOptions(**options), says=part)


# --- The comparison as a page: escaped, inert, drawn where it belongs; in the report only if any

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
