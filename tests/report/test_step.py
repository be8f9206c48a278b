"""The sentence of the report about the step."""

from __future__ import annotations

from adeye.judge.uncertainty import Difference
from adeye.report.evidence import step_statements


def line(name: str, unit: str, p95: float | None, pairs: int, differing: int = 0) -> Difference:
    return Difference("fsr", name, unit, 12, pairs, p95, p95, differing, {})


def test_campaign_that_did_not_ask_says_nothing() -> None:
    assert step_statements(()) == ()


def test_largest_of_each_fsr_and_what_is_not_known_are_said() -> None:
    found = [
        line("FSR-02", "m/s²", 0.2, 12),
        line("FSR-02", "m/s²", 0.5, 12, differing=2),
        line("FSR-01", "", None, 0),
        line("FSR-06", "m", 0.1, 9),
        Difference("metric", "min_ttc_s", "s", 12, 12, 7.0, 7.0, 3, {}),
    ]
    (text,) = step_statements(found)
    assert "Known for 2 of 4 margins" in text
    assert "at most FSR-02 0.5 m/s²." in text
    assert "2 verdicts of the sample change" in text
    assert "7" not in text


def test_no_uncertainty_is_not_taken_for_zero() -> None:
    (text,) = step_statements([line("FSR-06", "m", 0.0, 9)])
    assert "Known for 0 of 1" in text
    assert "at most" not in text
