"""Workers elsewhere: they execute what was planned, or say why they refuse."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from adeye.campaign import remote
from adeye.campaign.executors import InProcess
from adeye.campaign.plan import CampaignPlan
from adeye.campaign.work import BatchResult, BatchTask, execute
from adeye.errors import IntegrityError, PlatformError
from adeye.ports import Done, ExecutorContext
from tests.campaign.work import Again
from tests.conftest import MakeProject
from tests.project import CANDIDATE, CANDIDATE_ONLY, MINI, Executed, Project
from tests.refusals import refused
from tests.stored import stored

CHANNEL: str = stored("plugins")["steady"]


@pytest.fixture
def project(make_project: MakeProject) -> Project:
    made = make_project({**MINI, "faults": [], "architectures": CANDIDATE_ONLY})
    folder = made.folder / "odd" / "architectures"
    (folder / "steady.py").write_text(CHANNEL)
    (folder / "weights.bin").write_bytes(b"1")
    with made.edited(CANDIDATE) as candidate:
        steady = {"kind": "./steady.py:Steady", "links": ["localisation"]}
        candidate["channels"]["nominal"] = {**steady, "files": ["weights.bin"]}
    return made


def required(demand: remote.Demand) -> None:
    remote._required.cache_clear()
    remote._required(demand)


def a_task(plan: CampaignPlan) -> BatchTask:
    return BatchTask(1, (plan.cases[0],), (), plan.work)


@pytest.mark.slow
def test_worker_that_has_everything_executes_as_here(mini: Executed) -> None:
    task = a_task(mini.plan)
    made = remote.DemandingTask.of(remote.demand_of(mini.plan), task)
    there, here = opened(remote.execute_as_demanded(made)).runs, execute(task).runs
    assert there is not None
    assert here is not None
    assert there.trace_digests == here.trace_digests
    assert there.result_digests == here.result_digests


def test_another_release_and_another_source_of_adeye_are_refused(mini: Executed) -> None:
    demand = remote.demand_of(mini.plan)
    for name in ("adeye", "Python", "numba", "highway-env"):
        releases = tuple((key, "0.0.1" if key == name else value) for key, value in demand.releases)
        with pytest.raises(PlatformError, match=rf"it has {name} .*, the campaign 0\.0\.1"):
            required(replace(demand, releases=releases))
    with pytest.raises(PlatformError, match="its source of adeye is another one"):
        required(replace(demand, code="0" * 64))


@pytest.mark.parametrize(
    ("file", "changed", "missing"),
    [
        ("steady.py", r"its code of \./steady\.py:Steady", "it cannot load ./steady"),
        ("weights.bin", "its file .*weights", "its file"),
    ],
)
def test_other_file_is_refused(project: Project, file: str, changed: str, missing: str) -> None:
    demand = remote.demand_of(project.plan())
    required(demand)
    path = project.folder / "odd" / "architectures" / file
    path.write_bytes(path.read_bytes() + b"\n# other")
    refused(PlatformError, required, demand, says=changed)
    path.unlink()
    refused(PlatformError, required, demand, says=missing)


def test_module_installed_anew(make_project: MakeProject, monkeypatch: pytest.MonkeyPatch) -> None:
    made = make_project({**MINI, "faults": [], "architectures": CANDIDATE_ONLY})
    module = made.folder / "installed_elsewhere.py"
    module.write_text(CHANNEL)
    monkeypatch.syspath_prepend(str(made.folder))
    with made.edited(CANDIDATE) as candidate:
        steady = {"kind": "installed_elsewhere:Steady", "links": ["localisation"]}
        candidate["channels"]["nominal"] = steady
    demand = remote.demand_of(made.plan())
    required(demand)
    module.write_text(CHANNEL + "# a later release\n")
    # This process still has the code that it imported first, whatever a new plan hashes.
    with pytest.raises(PlatformError, match="installed_elsewhere is in memory as it was before"):
        required(demand)


@pytest.mark.slow
def test_file_that_changes_in_a_block(project: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = project.plan()

    def edit_and_execute(task: BatchTask) -> Any:
        (project.folder / "odd" / "architectures" / "weights.bin").write_bytes(b"22")
        return execute(task)

    remote._required.cache_clear()
    monkeypatch.setattr(remote, "execute", edit_and_execute)
    with pytest.raises(IntegrityError, match=r"weights\.bin.*was changed"):
        remote.execute_as_demanded(remote.DemandingTask.of(remote.demand_of(plan), a_task(plan)))


def make_elsewhere(
    plan: CampaignPlan, seen: list[remote.DemandingTask], traces: Path | None
) -> remote.Elsewhere:
    def work(item: remote.DemandingTask) -> Any:
        seen.append(item)
        return remote.sealed(item, BatchResult(failure=f"block {item.open()[1].block}"))

    context: ExecutorContext[Any, Any] = ExecutorContext(work)
    return remote.Elsewhere(plan, lambda context: InProcess(context.work), context, traces)


def test_tasks_come_back_as_they_were(project: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(project.folder)
    project.odd = Path("odd/tested.yaml")
    plan = project.plan()
    seen: list[remote.DemandingTask] = []
    task = a_task(plan)
    tasks = Again(task)
    executor = make_elsewhere(plan, seen, None)
    results: list[Any] = []
    for done in executor.run(tasks):
        assert done.result is not None
        results.append((done.task is task, done.result.failure))
        if len(results) == 1:
            tasks.waiting.append(task)
    assert results == [(True, "block 1")] * 2
    for item in seen:
        demand, opened = item.open()
        context = opened.context
        assert opened.execute == task.execute
        assert all(folder.is_absolute() for folder in context.folders.values())
        assert context.odd_folder == project.folder.resolve() / "odd"
        assert all(source.folder.is_absolute() for source in demand.sources)
    monkeypatch.chdir("/")
    required(seen[0].open()[0])


def test_folder_of_traces_has_to_be_shared(mini: Executed, tmp_path: Path) -> None:
    seen: list[remote.DemandingTask] = []
    executor = make_elsewhere(mini.plan, seen, tmp_path / "traces")
    list(executor.run(iter([a_task(mini.plan)])))
    demand, _ = seen[0].open()
    assert demand.marked is not None
    required(demand)
    elsewhere_mark = (tmp_path / "not_here" / demand.marked[0].name, demand.marked[1])
    with pytest.raises(PlatformError, match=r"does not share the folder .*not_here"):
        required(replace(demand, marked=elsewhere_mark))
    executor.close()
    assert list((tmp_path / "traces").iterdir()) == []


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_folder_of_traces_that_cannot_be_written_is_told(mini: Executed, tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(PlatformError, match="cannot be written"):
        make_elsewhere(mini.plan, [], tmp_path / "traces")


Change = Callable[[Any], Iterable[Any]]
"""What becomes of what an executor brings, one after the other."""


def altered(done: Any) -> Any:
    """A verdict that is another one, below the seal of the true one."""
    result = opened(done.result)
    result.runs.verdicts.verdict[:] = 0
    return replace(done, result=done.result[:32] + pickle.dumps(result))


def opened(found: bytes) -> Any:
    return pickle.loads(found[32:])  # noqa: S301 - made here


class Sly(bytes):
    """May have code of its own, which shows the true bytes only to who compares."""


def another_task(done: Any) -> Any:
    demand, task = done.task.open()
    return replace(done, task=remote.DemandingTask.of(demand, replace(task, block=7)))


MADE = "a result of block 1 that is not what its worker made"
GIVEN = "a block that it was not given, or one twice"
TAMPERING: dict[str, tuple[Change, str]] = {
    "verdicts": (lambda found: map(altered, found), MADE),
    "words": (lambda found: (replace(done, result="all is well") for done in found), MADE),
    "no seal": (lambda found: (replace(done, result=done.result[32:]) for done in found), MADE),
    "own bytes": (lambda found: (replace(done, result=Sly(done.result)) for done in found), MADE),
    "text": (lambda found: ("all is well" for _ in found), GIVEN),
    "task": (lambda found: map(another_task, found), GIVEN),
    "twice": (lambda found: (again for done in found for again in (done, done)), GIVEN),
}


@pytest.mark.parametrize("name", TAMPERING)
def test_executor_that_alters_what_it_carries_is_named(mini: Executed, name: str) -> None:
    change, message = TAMPERING[name]
    refused(IntegrityError, carry, mini, change, says=rf"executor own:Pool brought {message}")


def carry(mini: Executed, change: Change, *tasks: BatchTask) -> None:
    """Let an executor of somebody else carry tasks."""

    class Pool(InProcess[Any, Any]):
        def run(self, tasks: Iterator[Any]) -> Iterator[Done[Any, Any]]:
            yield from change(super().run(tasks))

    context: ExecutorContext[Any, Any] = ExecutorContext(remote.execute_as_demanded)
    executor = remote.Elsewhere(mini.plan, lambda it: Pool(it.work), context, name="own:Pool")
    list(executor.run(iter(tasks or (a_task(mini.plan),))))


def test_executor_that_asks_for_no_task_is_named(mini: Executed) -> None:
    with pytest.raises(IntegrityError, match="executor own:Pool ended without taking its tasks"):
        carry(mini, lambda _: ())


@pytest.mark.slow
def test_results_of_two_blocks_that_an_executor_exchanges_are_refused(mini: Executed) -> None:
    def exchanged(found: Any) -> Iterator[Any]:
        one, other = found
        yield replace(one, result=other.result)

    first = a_task(mini.plan)
    with pytest.raises(IntegrityError, match="not what its worker made"):
        carry(mini, exchanged, first, replace(first, block=2, execute=(mini.plan.cases[1],)))


def test_what_an_executor_carries_shares_nothing_with_the_plan(mini: Executed) -> None:
    seen: list[remote.DemandingTask] = []
    executor = make_elsewhere(mini.plan, seen, None)
    list(executor.run(iter([a_task(mini.plan)])))
    _, task = seen[0].open()
    task.context.requirements[0].__dict__.clear()
    task.execute[0].architecture.sensors.clear()
    assert mini.plan.work.requirements[0].id
    assert mini.plan.cases[0].architecture.sensors
