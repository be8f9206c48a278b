"""Batches in this process and in workers that may die."""

from __future__ import annotations

import errno
import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from adeye.campaign import executors
from adeye.campaign.executor_names import NamedExecutor, asked_executor, find_executor
from adeye.campaign.executors import Done, InProcess, Processes, Threads
from adeye.campaign.remote import DaskExecutor
from adeye.campaign.run import run_campaign
from adeye.errors import PlatformError, PluginError, SpecError, UsageError
from adeye.ports import ExecutorContext
from tests.campaign.work import DIE, Again, perform
from tests.project import Executed, table_hash
from tests.refusals import refused
from tests.stored import stored

pytestmark = pytest.mark.filterwarnings("ignore:This process .* is multi-threaded")


Children = Callable[[], set[multiprocessing.process.BaseProcess]]


@pytest.fixture
def workers() -> Children:
    """Return the children that this test has started: a guest of another test may keep its own."""
    before = set(multiprocessing.active_children())
    return lambda: set(multiprocessing.active_children()) - before


def test_in_process_runs_in_the_order_of_the_tasks_and_only_when_asked() -> None:
    tasks = Again("echo:a", "echo:b", "echo:c")
    ended = InProcess(perform).run(tasks)
    assert next(ended) == Done("echo:a", "a")
    assert tasks.waiting == ["echo:b", "echo:c"]
    assert [done.result for done in ended] == ["b", "c"]


def test_in_process_exception_is_the_callers() -> None:
    with pytest.raises(ValueError, match="refused x"):
        list(InProcess(perform).run(iter(["raise:x"])))


def test_threads_give_back_every_result_with_its_task_and_ask_again_after_the_end() -> None:
    tasks = [f"echo:{number}" for number in range(7)]
    executor = Threads(perform, 2)
    ended = list(executor.run(iter(tasks)))
    assert sorted(done.task for done in ended) == tasks
    assert all(done.task == f"echo:{done.result}" for done in ended)
    more = Again("echo:a")
    results = []
    for done in executor.run(more):
        results.append(done.result)
        if done.result == "a":
            more.waiting.append("echo:b")
    executor.close()
    assert results == ["a", "b"]


def test_threads_work_at_the_same_time_and_tasks_are_asked_for_here() -> None:
    meeting = threading.Barrier(2, timeout=10.0)
    asked: set[int] = set()

    def tasks() -> Iterator[str]:
        for name in "abcd":
            asked.add(threading.get_ident())
            yield name

    def meet(_name: str) -> int:
        meeting.wait()
        return threading.get_ident()

    executor = Threads(meet, 2)
    used = {done.result for done in executor.run(tasks())}
    executor.close()
    assert len(used) == 2
    assert asked == {threading.get_ident()}
    assert threading.get_ident() not in used


def test_exception_in_a_thread_is_the_callers_and_the_rest_is_dropped() -> None:
    tasks = Again("raise:x", *["echo:a"] * 50)
    executor = Threads(perform, 2)
    with pytest.raises(ValueError, match="refused x"):
        list(executor.run(tasks))
    executor.close()
    assert len(tasks.waiting) > 40


@pytest.mark.slow
def test_processes_give_back_every_result_with_its_task_from_elsewhere() -> None:
    tasks = [*(f"echo:{number}" for number in range(7)), "pid", "pid"]
    ended = list(Processes(perform, 2).run(iter(tasks)))
    assert sorted(done.task for done in ended) == tasks
    assert not any(done.lost for done in ended)
    pids = {str(done.result) for done in ended if done.task == "pid"}
    assert all(done.task in {f"echo:{done.result}", "pid"} for done in ended)
    assert str(os.getpid()) not in pids
    assert 1 <= len(pids) <= 2


@pytest.mark.slow
def test_worker_that_dies_takes_only_its_batch_with_it() -> None:
    ended = list(Processes(perform, 2).run(iter(["echo:a", "die", "echo:b", "echo:c"])))
    results = {done.task: done.result for done in ended}
    assert results == {"echo:a": "a", "die": None, "echo:b": "b", "echo:c": "c"}
    lost = [done.lost for done in ended if done.task == "die"]
    assert lost == [f"its worker died with code {DIE}"]


@pytest.mark.slow
def test_batch_that_was_lost_may_come_back_after_the_end_of_the_tasks() -> None:
    tasks = Again("die")
    ended = Processes(perform, 1).run(tasks)
    assert next(ended).result is None
    tasks.waiting.append("echo:again")
    assert [done.result for done in ended] == ["again"]


@pytest.mark.slow
def test_no_worker_is_left_however_it_ends(workers: Children) -> None:
    list(Processes(perform, 2).run(iter(["echo:a"])))
    assert workers() == set()
    with pytest.raises(ValueError, match="refused x"):
        list(Processes(perform, 2).run(iter(["raise:x", "echo:a"])))
    assert workers() == set()
    ended = Processes(perform, 1).run(iter(["echo:a", "echo:b", "echo:c"]))
    assert next(ended).result == "a"
    assert isinstance(ended, Iterator)
    ended.close()  # type: ignore[attr-defined]
    assert workers() == set()


@pytest.mark.slow
def test_closing_ends_a_worker_that_is_busy(tmp_path: object, workers: Children) -> None:
    place = f"{tmp_path}/pid"
    executor = Processes(perform, 2)
    ended = executor.run(iter([f"hang:{place}", "echo:a"]))
    assert next(ended).result == "a"
    executor.close()
    assert workers() == set()


@pytest.mark.slow
def test_ctrl_c_and_sigterm_are_the_parents_business() -> None:
    for signalled in ("interrupt:on", "terminate:on"):
        ended = list(Processes(perform, 1).run(iter([signalled, "echo:after"])))
        assert [(done.result, done.lost) for done in ended] == [("on", ""), ("after", "")]


def test_no_tasks_are_no_results_and_start_no_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    executor = Processes(perform, 2)
    monkeypatch.setattr(executors, "_Worker", None)
    assert list(executor.run(iter(()))) == []


@pytest.mark.slow
def test_no_more_workers_start_than_there_are_tasks(workers: Children) -> None:
    executor = Processes(perform, 8)
    ended = executor.run(iter(["pid", "pid"]))
    first = next(ended)
    assert len(workers()) == 2
    assert {first.result} | {done.result for done in ended} != {str(os.getpid())}


def test_worker_that_cannot_be_started_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    pool = Processes(perform, workers=1)

    none_left = Mock(side_effect=OSError(errno.EAGAIN, os.strerror(errno.EAGAIN)))
    monkeypatch.setattr(pool._context.Process, "start", none_left)
    with pytest.raises(PlatformError, match=r"temporarily unavailable. Use fewer --workers"):
        list(pool.run(Again("echo:a")))


@pytest.mark.slow
def test_batch_beyond_its_deadline_is_lost(tmp_path: Path) -> None:
    place = tmp_path / "pid"
    started = time.monotonic()
    # A loaded machine takes seconds to begin the worker that follows.
    ended = list(Processes(perform, 1, deadline_s=8.0).run(iter([f"hang:{place}", "echo:after"])))
    assert 8.0 <= time.monotonic() - started < 60.0
    assert [(done.result, done.lost) for done in ended] == [
        (None, "its worker was killed at its deadline, after 8 s"),
        ("after", ""),
    ]
    assert not is_running(int(place.read_text("utf-8")))


@pytest.mark.slow
def test_what_a_worker_started_ends_with_it(tmp_path: Path, workers: Children) -> None:
    place = tmp_path / "pid"
    executor = Processes(perform, 2)
    ended = executor.run(iter([f"child:{place}", "echo:a"]))
    assert next(ended).result == "a"
    wait(lambda: place.exists() and bool(place.read_text("utf-8")), 30.0)
    child = int(place.read_text("utf-8"))
    assert is_running(child)
    executor.abandon()
    assert workers() == set()
    wait(lambda: not is_running(child), 30.0)
    assert not is_running(child)


def wait(condition: Callable[[], bool], most_s: float) -> None:
    """Wait for something, so long at most."""
    until = time.monotonic() + most_s
    while not condition() and time.monotonic() < until:
        time.sleep(0.02)


def is_running(pid: int) -> bool:
    """Tell whether a process runs; one of which only the exit status is left does not."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text("utf-8")
    except OSError:
        return False
    return text.rpartition(")")[2].split()[0] != "Z"


def test_what_no_thread_has_begun_can_be_dropped() -> None:
    go = threading.Event()

    def wait_for_it(name: str) -> str:
        assert go.wait(timeout=30.0)
        return name

    executor = Threads(wait_for_it, 1)
    waiting = Again("a", "b")

    def drop() -> None:
        executor.drop_waiting()
        go.set()

    timer = threading.Timer(0.2, drop)
    timer.start()
    assert [done.result for done in executor.run(waiting)] == ["a"]
    timer.join()
    executor.close()


def test_abandoned_threads_are_not_waited_for() -> None:
    go = threading.Event()
    executor: Threads[str, bool] = Threads(lambda _: go.wait(timeout=30.0), 1)
    ended = executor.run(iter(["a"]))
    thread = threading.Thread(target=lambda: list(ended))
    thread.start()
    while not executors.is_abandoned_work_running():
        time.sleep(0.01)
    executor.abandon()
    executor.close()
    assert executors.is_abandoned_work_running()
    go.set()
    thread.join()


@pytest.mark.slow
@pytest.mark.parametrize("end", ["echo:done", "die:"])
def test_what_a_worker_leaves_behind_ends_with_it(tmp_path: Path, end: str) -> None:
    noted = tmp_path / "pid"
    begun = time.monotonic()
    # Work in a worker may ask a process of its own.
    found = list(Processes(perform, 1).run(iter(["ask:a", f"leave:{noted}", end])))
    assert (found[0].result, len(found)) == ("a", 3)
    # Its child holds no pipe of the worker open: the death is seen at once.
    assert time.monotonic() - begun < 15.0
    pid = int(noted.read_text("ascii"))
    wait(lambda: not is_running(pid), 5.0)
    assert not is_running(pid)


# --- what a name of an executor means, and what excludes what


OWN: str = stored("plugins")["executors"]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "own.py").write_text(OWN, "utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_dask_is_known_by_its_name() -> None:
    assert find_executor("dask") is DaskExecutor


def test_unknown_name_is_refused_with_the_nearest() -> None:
    refused(UsageError, find_executor, "dusk", says=r"no executor 'dusk'.*Did you mean 'dask'\?")


def test_class_without_run_is_no_executor(here: Path) -> None:
    assert here.is_dir()
    with pytest.raises(SpecError, match=r"Deaf has no run\(\), so it is no executor"):
        find_executor("./own.py:Deaf")


def test_executor_whose_answer_raises_is_named(here: Path) -> None:
    make = find_executor(f"{here / 'own.py'}:Raising")
    with pytest.raises(PluginError, match=r"own\.py:Raising raised ValueError: no \(.*own\.py:\d+"):
        list(make(ExecutorContext(str)).run(iter(())))


def test_executor_that_gives_nothing_is_named_as_the_reason(here: Path) -> None:
    make = find_executor(f"{here / 'own.py'}:Mute")
    (done,) = make(ExecutorContext(str)).run(iter(["a"]))
    assert done.result is None
    assert done.lost.endswith("own.py:Mute gave no result and no reason")


@pytest.mark.slow
def test_class_of_a_file_executes_a_campaign(mini: Executed, here: Path) -> None:
    named = NamedExecutor("./own.py:Own", workers=3, address="there")
    assert named.text == "executor ./own.py:Own at there with 3 workers"
    summary = run_campaign(mini.plan, db=here / "own.db", executor=named)
    assert summary.executed == len(mini.plan.cases)
    assert table_hash(here / "own.db") == table_hash(mini.db)
    found = find_executor("./own.py:Own")
    made = found.args[0].obj.made  # type: ignore[attr-defined]
    assert made == [(3, "there"), "closed"]


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ((None, 2, 2, None), "--threads and --workers exclude each other"),
        (("threads", None, 2, None), "--executor threads and --workers exclude"),
        (("processes", 2, None, None), "--executor processes and --threads exclude"),
        (("dask", 2, None, None), "--executor dask and --threads exclude"),
        ((None, None, None, "tcp://a:1"), "--scheduler needs an executor that has one"),
        (("processes", None, None, "tcp://a:1"), "--scheduler needs an executor"),
        (("dask", None, 2, "tcp://a:1"), "the one at --scheduler has its own"),
    ],
)
def test_what_excludes_each_other_is_refused(asked: Any, message: str) -> None:
    refused(UsageError, asked_executor, *asked, says=message)


def test_executors_of_this_machine_need_no_other() -> None:
    assert asked_executor(None, None, 2, None) is None
    assert asked_executor("threads", 2, None, None) is None
    assert asked_executor("processes", None, 2, None) is None
    there = "tcp://a:1"
    assert asked_executor("dask", None, None, there) == NamedExecutor("dask", None, there)
    assert asked_executor("my:Own", None, 4, None) == NamedExecutor("my:Own", 4)
