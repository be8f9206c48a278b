"""The table of verification: each FSR with its verdicts, margins and worst runs."""

from typing import Any

import pytest

from adeye.judge.verdict import Outcome, Verdict
from adeye.report import verification
from adeye.report.model.concept import VerificationRow
from adeye.report.model.report import Report
from adeye.store.read.totals import ChannelFailure
from adeye.store.records import EventRecord, VerdictRecord
from tests.figures import figures_of
from tests.report.fake import SCENARIOS
from tests.stored import known


@pytest.fixture(scope="module")
def rows(report: Report) -> tuple[VerificationRow, ...]:
    return tuple(
        verification.verification_of(report, {}, dict.fromkeys(SCENARIOS, "full_factorial"))
    )


def test_there_is_a_row_for_each_fsr_and_architecture_the_gate_first(
    rows: tuple[VerificationRow, ...], report: Report
) -> None:
    pairs = {(row.fsr, row.architecture) for row in rows}
    assert len(pairs) == len(rows) == len(report.fsrs) * len(report.architectures)
    flags = [row.is_gate for row in rows]
    assert flags == sorted(flags, reverse=True)


def test_row_says_value_margin_verdict_and_run_of_the_cell(
    rows: tuple[VerificationRow, ...], report: Report
) -> None:
    row = next(row for row in rows if (row.fsr, row.architecture) == ("FSR-02", "legacy_camera"))
    cell = known(report.cell("FSR-02", "legacy_camera"))
    assert (row.verdict, row.run, row.margin) == (cell.verdict, cell.worst_run, cell.margin)
    assert (row.metric, row.design) == ("required_deceleration", "full factorial")
    assert row.value.endswith("m/s²")
    # A truth has neither value nor margin.
    row = next(row for row in rows if row.fsr == "FSR-01")
    assert (row.value, row.margin) == ("", None)
    assert verification.design_words("random") == "random sample"


def test_missing_cell_is_a_row_without_a_verdict_and_an_open_point(report: Report) -> None:
    bare = report.model_copy(update={"cells": ()})
    for row in verification.verification_of(bare, {}, {}):
        assert (row.verdict, row.runs, row.command) == (None, 0, report.command)
    assert {item.kind for item in verification.open_points_of(bare) if item.architecture} == {
        "not_run"
    }


def test_realised_are_the_runs_that_came_about_as_asked(report: Report) -> None:
    words = ["completed", "not_realised", "completed", "completed", "completed"]
    scenarios = ["cut_in"] * 4 + ["lead_braking"]
    figures = figures_of(
        [{"scenario": a, "outcome": b} for a, b in zip(scenarios, words, strict=True)]
    )
    found = {
        item.scenario: item for item in verification.realisations_of(report.factors, {}, figures)
    }
    cut_in = found["cut_in"]
    assert (cut_in.planned, cut_in.executed, cut_in.realised) == (180, 4, 3)
    assert cut_in.outcomes == {Outcome.COMPLETED: 3, Outcome.NOT_REALISED: 1}
    assert found["cut_out_to_stopped"].executed == 0


def test_every_verdict_that_is_no_pass_has_a_kind() -> None:
    assert set(verification.KINDS) == (set(Verdict) - {Verdict.PASS}) | {None}
    assert set(verification.KINDS.values()) < set(verification.ORDER)


def test_every_fsr_that_does_not_pass_is_listed_and_what_a_scenario_did_not_exercise(
    report: Report,
) -> None:
    expected = {
        (fsr.id, architecture.id, "")
        for fsr in report.fsrs
        for architecture in report.architectures
        for cell in [report.cell(fsr.id, architecture.id)]
        if cell is None or cell.verdict is not Verdict.PASS
    }
    points = [item for item in verification.open_points_of(report) if item.architecture]
    found = {(item.subject, item.architecture, item.scenario or "") for item in points}
    assert {place for place in found if not place[2]} == expected != set()
    kinds = {(item.subject, item.architecture, item.scenario): item.kind for item in points}
    assert kinds["FSR-03", "camera_radar", "lead_braking"] == "vacuous"


def test_what_decides_the_gate_comes_first(report: Report) -> None:
    legacy = report.architectures[0].model_copy(update={"is_gate": True})
    changed = report.model_copy(update={"architectures": (legacy, *report.architectures[1:])})
    points = verification.open_points_of(changed)
    decides = [item.decides for item in points]
    assert any(decides)
    assert decides == sorted(decides, reverse=True)


def test_assumptions_waivers_and_findings_are_listed_with_what_rests_on_them(
    report: Report,
) -> None:
    points = {item.kind: item for item in verification.open_points_of(report)}
    assert points["assumption"].text.endswith("FSR-01 rest on it.")
    assert "3 runs" in points["waiver"].text
    assert points["finding"].subject == "SG-09"


def test_failure_of_a_channel_is_an_open_point_that_the_gate_hangs_on_if_it_is_refused(
    report: Report,
) -> None:
    failures = tuple(
        ChannelFailure("camera_radar", name, "channel_error", 2, refused, "KeyError: 1", 0, "")
        for name, refused in (("nominal", 2), ("safety", 0))
    )
    points = verification.open_points_of(report.model_copy(update={"channel_failures": failures}))
    found = {item.subject: item for item in points if item.kind == "channel_failure"}
    assert [found[name].decides for name in ("nominal", "safety")] == [True, False]
    assert "KeyError: 1" in found["nominal"].text


def record(**changes: Any) -> VerdictRecord:
    fields: dict[str, Any] = {
        "fsr_id": "FSR-1",
        "fsr_digest": "a" * 64,
        "verdict": Verdict.PASS,
        "is_exercised": True,
    }
    return VerdictRecord(**{**fields, **changes})


def test_verdict_without_a_number_has_no_margin_and_no_binding() -> None:
    assert verification.margin_of(record()) is None
    assert verification.binding_of(record()) is None
    margin = known(verification.margin_of(record(margin=-1.5, unit="m", robustness_low=-0.15)))
    assert (margin.value, margin.unit, margin.robustness) == (-1.5, "m", -0.15)


def test_verdict_of_a_run_keeps_its_binding_predicate() -> None:
    stored = record(predicate="gap >= 2 m", signal="gap", value=1.2, threshold=2.0, margin=-0.8)
    (told,) = verification.run_verdicts([stored])
    assert told.binding is not None
    assert (told.fsr, told.binding.signal, told.binding.difference) == ("FSR-1", "gap", -0.8)


def test_event_keeps_time_kind_and_text() -> None:
    (event,) = verification.replay_events(
        [EventRecord(1.5, "contact", "lead", "contact with lead")]
    )
    assert (event.time_s, event.kind, event.text) == (1.5, "contact", "contact with lead")
