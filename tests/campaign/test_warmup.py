"""Warming up: one test case of each structure is executed, and nothing is kept."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from adeye.campaign import warmup, work
from adeye.campaign.warmup import warm_up
from adeye.errors import PlatformError

if TYPE_CHECKING:
    from adeye.campaign.runner import Progress
    from adeye.campaign.work import BatchResult, BatchTask
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
