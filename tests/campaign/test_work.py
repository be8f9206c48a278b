"""The work of one block: run, measure, judge, describe."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from adeye.campaign import work
from adeye.campaign.work import BatchResult, BatchTask, evaluate, execute
from adeye.errors import SpecError
from adeye.evaluation.verdict import Outcome, Verdict
from adeye.store.tables import METRIC_IDS
from adeye.sweep.case import TestCase
from adeye.trace import Trace

if TYPE_CHECKING:
    from tests.project import Executed

Candidates = tuple[list[TestCase], Trace]


def task(mini: Executed, cases: list[TestCase], **changes: Any) -> BatchTask:
    return BatchTask(
        **{"block": 1, "execute": tuple(cases), "judge": (), **changes}, context=mini.plan.work
    )


def test_block_is_executed_and_judged(mini: Executed, cut_ins: Candidates) -> None:
    cases, trace = cut_ins
    result = execute(task(mini, cases))
    assert result.failure == ""
    assert [run.test_case for run in result.runs] == [case.digest for case in cases]
    assert [run.trace_digest for run in result.runs] == trace.digests()
    first = result.runs[0]
    assert first.outcome is Outcome.COMPLETED
    assert first.trace_rows == trace.length[0]
    assert first.duration_s == pytest.approx(25.0)
    assert set(first.metrics) == set(METRIC_IDS)
    fsrs = [item.id for item in mini.plan.files.concept.spec.requirements]
    assert [item.fsr_id for item in first.verdicts] == fsrs
    digests = {item.requirement.id: item.digest for item in mini.plan.requirements}
    assert all(item.fsr_digest == digests[item.fsr_id] for item in first.verdicts)


def test_metric_has_a_finite_value_or_says_why_not(mini: Executed, cut_ins: Candidates) -> None:
    for run in execute(task(mini, cut_ins[0])).runs:
        for name, item in run.metrics.items():
            assert (item.value is not None and math.isfinite(item.value)) is (
                item.status == "value"
            ), name
        assert run.metrics["impact_speed_mps"].status == "no_conflict"
        assert run.metrics["min_distance_m"].actor == "cutter"


def test_result_that_exists_is_only_judged_on_what_it_lacks(
    mini: Executed, cut_ins: Candidates
) -> None:
    cases, trace = cut_ins
    judge = ((cases[0], "a" * 64, ("FSR-03",)),)
    result = execute(task(mini, cases[1:2], judge=judge))
    assert len(result.runs) == 1
    assert [item.fsr_id for item in result.verdicts["a" * 64]] == ["FSR-03"]
    assert result.verdicts["a" * 64][0].verdict is Verdict.PASS
    assert result.judged_traces == {"a" * 64: trace.digests()[0]}


def test_empty_block_has_no_results(mini: Executed) -> None:
    assert execute(task(mini, [])) == BatchResult()


def test_defect_is_recorded_with_the_block(
    mini: Executed, cut_ins: Candidates, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr(work, "run_batch", broken)
    result = execute(task(mini, cut_ins[0]))
    assert (result.runs, result.failure) == ((), "ZeroDivisionError: by zero")


def test_wrong_input_is_the_users_business(mini: Executed, cut_ins: Candidates) -> None:
    case = cut_ins[0][0]
    camera = case.architecture.sensors["front_camera"].model_copy(update={"rate": 7.0})
    sensors = {**case.architecture.sensors, "front_camera": camera}
    odd = replace(case, architecture=case.architecture.model_copy(update={"sensors": sensors}))
    with pytest.raises(SpecError, match=r"sensors\.front_camera\.rate"):
        execute(task(mini, [odd]))


def test_description_does_not_depend_on_the_batch(mini: Executed, cut_ins: Candidates) -> None:
    cases, trace = cut_ins
    requirements = mini.plan.files.concept.spec.requirements
    whole = evaluate(trace, cases, requirements, mini.plan.faults)
    alone = execute(task(mini, cases[2:3])).runs[0]
    key = mini.plan.engines["camera_radar"]
    together = work.describe(trace, 2, whole, key)
    assert replace(together, executed_by="", executed_at=None) == replace(
        alone, executed_by="", executed_at=None
    )
