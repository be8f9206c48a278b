"""Verdicts as columns: the record of one run is what its row says."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
import pytest

from adeye.judge.evaluate import (
    ERROR,
    FAIL,
    INCONCLUSIVE,
    INVALID,
    PASS,
    VACUOUS,
    VERDICTS,
    Judgement,
    JudgementColumns,
)
from adeye.judge.verdict import Verdict

NAN = math.nan


@pytest.fixture
def columns() -> JudgementColumns:
    return JudgementColumns(
        fsr_id="FSR-01",
        fsr_digest="d" * 64,
        runs=np.array([2, 5]),
        verdict=np.array([PASS, ERROR]),
        exercised=np.array([True, False]),
        numbers=np.array([[0.5, math.inf, 5.0, 1.25, 7.0, 2.0], [NAN] * 6]),
        actor=np.array([1, -1]),
        binding=np.array([0, 1]),
        bindings=(("m", "gap", "gap > 2 m"), (None, None, None)),
        detail=np.array([1, 0]),
        details=("a signal has a sample that is not a finite number", None),
        objects=("lead", "cutter"),
    )


def test_every_verdict_has_its_code() -> None:
    codes = {
        PASS: Verdict.PASS,
        FAIL: Verdict.FAIL,
        INCONCLUSIVE: Verdict.INCONCLUSIVE,
        VACUOUS: Verdict.VACUOUS,
        INVALID: Verdict.INVALID,
        ERROR: Verdict.ERROR,
    }
    assert {code: VERDICTS[code] for code in codes} == codes
    assert set(VERDICTS) == set(Verdict) - {Verdict.NOT_RUN}


def test_record_of_a_run_is_its_row(columns: JudgementColumns) -> None:
    assert columns.of_run(2) == Judgement(
        fsr_id="FSR-01",
        fsr_digest="d" * 64,
        verdict=Verdict.PASS,
        is_exercised=True,
        robustness_low=0.5,
        robustness_high=math.inf,
        margin=5.0,
        unit="m",
        signal="gap",
        predicate="gap > 2 m",
        time_s=1.25,
        actor="cutter",
        value=7.0,
        threshold=2.0,
    )


def test_what_is_not_there_is_none(columns: JudgementColumns) -> None:
    found = columns.of_run(5)
    assert found is not None
    given = {"fsr_id", "fsr_digest", "verdict", "is_exercised", "detail"}
    assert found.verdict is Verdict.ERROR
    assert found.detail == "a signal has a sample that is not a finite number"
    for item in fields(Judgement):
        assert item.name in given or getattr(found, item.name) is None


@pytest.mark.parametrize("run", [0, 3, 6])
def test_run_that_the_fsr_does_not_concern_has_no_record(
    columns: JudgementColumns, run: int
) -> None:
    assert columns.of_run(run) is None
