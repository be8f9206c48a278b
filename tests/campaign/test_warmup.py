"""Warming up: one test case of each structure is executed, and nothing is kept."""

from __future__ import annotations

from typing import Any

import pytest

from adeye.campaign import warmup, work
from adeye.campaign.run import Progress
from adeye.campaign.warmup import _compile_part, _covering, _drive, _judge, compile_aside, warm_up
from adeye.campaign.work import BatchResult, BatchTask, compiled_parts
from adeye.errors import PlatformError
from adeye.judge.evaluate import VERDICTS, Evaluation
from adeye.judge.verdict import Verdict
from adeye.simulate import engine
from tests.conftest import MakeProject


def test_one_case_of_each_structure_is_executed(
    make_project: MakeProject, monkeypatch: pytest.MonkeyPatch
) -> None:
    project = make_project()
    plan = project.plan()
    tasks: list[BatchTask] = []

    def executed(task: BatchTask) -> BatchResult:
        tasks.append(task)
        return work.BatchResult()

    monkeypatch.setattr(warmup, "execute", executed)
    seen: list[Progress] = []
    assert warm_up(plan, seen.append) >= 0.0
    examples = [case.digest for case in plan.examples()]
    assert [task.execute[0].digest for task in tasks] == examples
    assert {len(task.execute) for task in tasks} == {1}
    assert [state.done for state in seen] == list(range(len(examples)))
    assert {state.phase for state in seen} == {"compile"}
    assert not project.db.exists()


def test_case_that_cannot_be_executed_is_named(
    make_project: MakeProject, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = make_project().plan()
    monkeypatch.setattr(warmup, "execute", lambda _: work.BatchResult(failure="OSError: no room"))
    with pytest.raises(PlatformError, match=r"with .*: OSError: no room"):
        warm_up(plan)


@pytest.mark.slow
def test_what_is_compiled_aside_drives_and_judges(
    make_project: MakeProject, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = make_project().plan()
    task = BatchTask(0, (plan.cases[0],), (), plan.work)
    found: list[Evaluation] = []
    lengths: list[int] = []

    def judged(*arguments: Any) -> Evaluation:
        found.append(work.evaluate(*arguments))
        return found[-1]

    def driven(*arguments: Any, **options: Any) -> Any:
        trace = engine.run(*arguments, **options)
        lengths.extend(trace.length.tolist())
        return trace

    monkeypatch.setattr(warmup, "evaluate", judged)
    monkeypatch.setattr(warmup, "run_batch", driven)
    assert _compile_part((_drive, task))
    assert _compile_part((_judge, task))
    # One goes to its end and one only begins, yet its formulas are evaluated.
    assert lengths[0] > 10
    assert lengths[1] == 1
    assert any(
        code == VERDICTS.index(Verdict.PASS) for item in found[0].judged for code in item.verdict
    )


@pytest.mark.slow
def test_failure_aside_is_left_to_the_run(make_project: MakeProject) -> None:
    plan = make_project().plan()
    assert compile_aside(plan)
    task = BatchTask(0, (), (), plan.work)
    assert not _compile_part((_judge, task))


def test_every_part_is_compiled_aside_and_none_for_nothing(make_project: MakeProject) -> None:
    plan = make_project().plan()
    chosen = _covering(plan)
    parts = [compiled_parts(case.architecture, plan.work) for case in chosen]
    assert frozenset().union(*parts) == plan.compiled_parts
    assert {"sensor-camera", "channel-nominal", "traffic-batch-reference-1"} <= plan.compiled_parts
    for number in range(len(parts)):
        assert not parts[number] <= frozenset().union(*parts[:number])


@pytest.mark.slow
def test_cold_cache_is_filled_aside_first_and_a_warm_one_is_not(
    make_project: MakeProject, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = make_project().plan()
    asked: list[object] = []
    monkeypatch.setattr(warmup, "execute", lambda _: work.BatchResult())
    monkeypatch.setattr(warmup, "compile_aside", asked.append)
    monkeypatch.setattr(warmup, "is_cache_warm", lambda *_: False)
    warm_up(plan)
    assert asked == []
    warm_up(plan, aside=True)
    assert asked == [plan]
    monkeypatch.setattr(warmup, "is_cache_warm", lambda *_: True)
    warm_up(plan, aside=True)
    assert asked == [plan]
