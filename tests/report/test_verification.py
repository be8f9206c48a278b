"""The verification table: one row for each FSR and architecture, with its evidence."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from adeye.judge.verdict import Outcome
from adeye.report.verification import design_words, realisations_of, verification_of
from adeye.store.read.bulk import Figures, Labels
from tests.report.fake import SCENARIOS

if TYPE_CHECKING:
    from adeye.report.model.concept import VerificationRow
    from adeye.report.model.report import Report


@pytest.fixture(scope="module")
def rows(report: Report) -> tuple[VerificationRow, ...]:
    return tuple(verification_of(report, {}, dict.fromkeys(SCENARIOS, "full_factorial")))


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
    cell = report.cell("FSR-02", "legacy_camera")
    assert cell is not None
    assert (row.verdict, row.run, row.margin) == (cell.verdict, cell.worst_run, cell.margin)
    assert (row.metric, row.design) == ("required_deceleration", "full factorial")
    assert row.value.endswith("m/s²")


def test_truth_has_neither_value_nor_margin(rows: tuple[VerificationRow, ...]) -> None:
    row = next(row for row in rows if row.fsr == "FSR-01")
    assert (row.value, row.margin) == ("", None)


def test_missing_cell_is_a_row_without_a_verdict(report: Report) -> None:
    bare = report.model_copy(update={"cells": ()})
    for row in verification_of(bare, {}, {}):
        assert (row.verdict, row.runs, row.command) == (None, 0, report.command)


def test_random_design_is_called_a_sample() -> None:
    assert design_words("random") == "random sample"


def test_realised_are_the_runs_that_came_about_as_asked(report: Report) -> None:
    count = 5
    words = ["completed", "not_realised", "completed", "completed", "completed"]
    nothing = np.zeros(count)
    figures = Figures(
        ordinal=np.arange(count),
        scenario=Labels.of(["cut_in"] * 4 + ["lead_braking"]),
        architecture=Labels.of(["a"] * count),
        fault_entry=Labels.of(["none"] * count),
        replicate=np.zeros(count, dtype=np.int64),
        outcome=Labels.of(words),
        points={},
        metrics={},
        duration_s=nothing,
        machine_dependent=np.zeros(count, dtype=np.bool_),
    )
    found = {item.scenario: item for item in realisations_of(report.factors, {}, figures)}
    cut_in = found["cut_in"]
    assert (cut_in.planned, cut_in.executed, cut_in.realised) == (180, 4, 3)
    assert cut_in.outcomes == {Outcome.COMPLETED: 3, Outcome.NOT_REALISED: 1}
    assert found["cut_out_to_stopped"].executed == 0
