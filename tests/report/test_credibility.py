"""The self-test beside a database: read back only if it is of the same code, and never made up."""

from pathlib import Path
from typing import Any

from adeye.report import credibility
from adeye.report.formats.json import parse_json, render_json
from adeye.report.model.report import Report
from adeye.report.page.html import render

GOOD = credibility.SelfTestResult(
    version="1.2.3",
    numerics_version=3,
    created="2026-01-02T03:04:05",
    masters=34,
    detected=34,
    low=0.897,
    confidence=0.95,
)
SAME: dict[str, Any] = {"adeye": "1.2.3", "numerics_version": 3}


def test_result_is_read_back(tmp_path: Path) -> None:
    assert credibility.write_result(GOOD, tmp_path / "new").name == credibility.RESULT
    assert credibility.read_result(tmp_path / "new", SAME) == GOOD


def test_result_of_other_code_and_what_cannot_be_read_do_not_count(tmp_path: Path) -> None:
    assert credibility.read_result(tmp_path, SAME) is None
    credibility.write_result(GOOD, tmp_path)
    for change in ({"adeye": "1.2.4"}, {"numerics_version": 4}, {"adeye": None}):
        assert credibility.read_result(tmp_path, {**SAME, **change}) is None
    for content in ("", "{}", '{"version": "1.2.3"}', "\0"):
        (tmp_path / credibility.RESULT).write_text(content)
        assert credibility.read_result(tmp_path, SAME) is None


def test_result_is_good_only_if_all_is() -> None:
    assert GOOD.is_good
    for change in (
        {"detected": 33},
        {"masters": 0, "detected": 0},
        {"undetected": ("never_brakes",)},
        {"rejected_twins": ("never_brakes",)},
    ):
        assert not GOOD.model_copy(update=change).is_good


def test_text_names_what_was_not_detected() -> None:
    assert GOOD.text == (
        "Known-bad masters: 34 of 34 detected (exact 95 % interval: at least 89.7 % of masters of "
        "this kind); version 1.2.3, 2026-01-02T03:04:05 UTC."
    )
    bad = GOOD.model_copy(
        update={"detected": 33, "undetected": ("ghost",), "rejected_twins": ("late",)}
    )
    assert "33 of 34" in bad.text
    assert "not detected: ghost; good twins rejected: late" in bad.text


def test_page_and_json_say_it_or_that_it_was_not_run(report: Report) -> None:
    assert report.self_test is None
    assert credibility.NOT_RUN in render(report)
    tested = report.model_copy(update={"self_test": GOOD})
    assert "34 of 34 detected" in render(tested)
    assert parse_json(render_json(tested)).self_test == GOOD


def test_bits_are_promised_where_no_other_library_computes_them() -> None:
    assert credibility.determinism("batch", "reference-1").startswith("Class portable")
    assert credibility.determinism("highway", "highway-env-1.12.1").startswith(
        "Class same platform"
    )
    # A database that does not say promises no more than the least.
    assert credibility.determinism("", "").startswith("Class same platform")
