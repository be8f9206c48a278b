"""Verdicts and events of the database as a report has them."""

from __future__ import annotations

from typing import Any

from adeye.judge.verdict import Verdict
from adeye.report.verification import binding_of, margin_of, replay_events, run_verdicts
from adeye.store.records import EventRecord, VerdictRecord


def record(**changes: Any) -> VerdictRecord:
    fields: dict[str, Any] = {
        "fsr_id": "FSR-1",
        "fsr_digest": "a" * 64,
        "verdict": Verdict.PASS,
        "is_exercised": True,
    }
    return VerdictRecord(**{**fields, **changes})


def test_verdict_without_a_number_has_no_margin_and_no_binding() -> None:
    assert margin_of(record()) is None
    assert binding_of(record()) is None
    margin = margin_of(record(margin=-1.5, unit="m", robustness_low=-0.15))
    assert margin is not None
    assert (margin.value, margin.unit, margin.robustness) == (-1.5, "m", -0.15)


def test_verdict_of_a_run_keeps_its_binding_predicate() -> None:
    stored = record(predicate="gap >= 2 m", signal="gap", value=1.2, threshold=2.0, margin=-0.8)
    (told,) = run_verdicts([stored])
    assert told.binding is not None
    assert (told.fsr, told.binding.signal, told.binding.difference) == ("FSR-1", "gap", -0.8)


def test_event_keeps_time_kind_and_text() -> None:
    (event,) = replay_events([EventRecord(1.5, "contact", "lead", "contact with lead")])
    assert (event.time_s, event.kind, event.text) == (1.5, "contact", "contact with lead")
