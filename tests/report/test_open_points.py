"""Open points: nothing that is not shown is left out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.judge.verdict import Verdict
from adeye.report.verification import KINDS, ORDER, open_points_of
from adeye.store.read.totals import ChannelFailure

if TYPE_CHECKING:
    from adeye.report.model.report import Report


def test_every_verdict_that_is_no_pass_has_a_kind() -> None:
    assert set(KINDS) == (set(Verdict) - {Verdict.PASS}) | {None}
    assert set(KINDS.values()) < set(ORDER)


def test_every_fsr_that_does_not_pass_is_listed(report: Report) -> None:
    expected = {
        (fsr.id, architecture.id)
        for fsr in report.fsrs
        for architecture in report.architectures
        for cell in [report.cell(fsr.id, architecture.id)]
        if cell is None or cell.verdict is not Verdict.PASS
    }
    points = open_points_of(report)
    found = {(item.subject, item.architecture) for item in points if item.architecture}
    whole = {
        (item.subject, item.architecture)
        for item in points
        if item.architecture and not item.scenario
    }
    assert whole == expected != set()
    assert found > whole


def test_scenario_that_did_not_exercise_a_passing_fsr_is_listed(report: Report) -> None:
    assert any(
        (item.subject, item.architecture, item.scenario, item.kind)
        == ("FSR-03", "camera_radar", "lead_braking", "vacuous")
        for item in open_points_of(report)
    )


def test_what_decides_the_gate_comes_first(report: Report) -> None:
    legacy = report.architectures[0].model_copy(update={"is_gate": True})
    changed = report.model_copy(update={"architectures": (legacy, *report.architectures[1:])})
    points = open_points_of(changed)
    decides = [item.decides for item in points]
    assert any(decides)
    assert decides == sorted(decides, reverse=True)


def test_missing_result_is_an_open_point(report: Report) -> None:
    points = open_points_of(report.model_copy(update={"cells": ()}))
    kinds = {item.kind for item in points if item.architecture}
    assert kinds == {"not_run"}


def test_assumptions_waivers_and_findings_are_listed_with_what_rests_on_them(
    report: Report,
) -> None:
    points = {item.kind: item for item in open_points_of(report)}
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
    points = open_points_of(report.model_copy(update={"channel_failures": failures}))
    found = {item.subject: item for item in points if item.kind == "channel_failure"}
    assert [found[name].decides for name in ("nominal", "safety")] == [True, False]
    assert "KeyError: 1" in found["nominal"].text
