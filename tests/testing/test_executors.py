"""The check of executors passes those that are shipped, and names what another one breaks."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from adeye.campaign.executors import InProcess, Processes, Threads
from adeye.ports import Done, ExecutorContext
from adeye.testing import check_executor
from adeye.testing.executors import answer

pytestmark = pytest.mark.filterwarnings("ignore:This process .* is multi-threaded")


@pytest.mark.slow
def test_shipped_executors_conform() -> None:
    check_executor(lambda context: InProcess(context.work))
    check_executor(lambda context: Threads(context.work, context.workers or 1))
    check_executor(lambda context: Processes(context.work, context.workers or 1), is_isolated=True)


class Broken:
    """Executes here, but for one rule."""

    def __init__(self, rule: str, context: ExecutorContext[str, str]) -> None:
        self.rule, self.work = rule, context.work

    def run(self, tasks: Iterator[str]) -> Iterator[Done[str, str]]:
        if self.rule == "hoards":
            tasks = iter(list(tasks))
        for number, task in enumerate(tasks):
            if self.rule == "drops" and number == 7:
                continue
            try:
                done: Done[str, str] = Done(task, self.work(task))
            except ValueError:
                if self.rule == "swallows":
                    continue
                raise
            if self.rule == "mixes up" and number == 3:
                done = Done(task, "answer to another")
            yield done
            if self.rule == "repeats" and number == 5:
                yield done

    def close(self) -> None:
        self.closed = getattr(self, "closed", 0) + 1
        if self.rule == "closes once" and self.closed == 2:
            msg = "closed twice"
            raise AssertionError(msg)


RULES = {
    "hoards": "asked for before the first result",
    "drops": "a task is lost",
    "repeats": "comes twice",
    "mixes up": "not those of their tasks",
    "swallows": "not raised in the caller",
    "closes once": "closed twice",
}


@pytest.mark.parametrize("rule", RULES)
def test_broken_rule_is_named(rule: str) -> None:
    with pytest.raises(AssertionError, match=RULES[rule]):
        check_executor(lambda context: Broken(rule, context))


def test_whoever_ends_with_the_tasks_does_not_execute_what_comes_back() -> None:
    class Ending(InProcess[Any, Any]):
        def run(self, tasks: Iterator[Any]) -> Iterator[Done[Any, Any]]:
            task = next(tasks, None)
            while task is not None:
                following = next(tasks, None)
                yield Done(task, answer(task))
                task = following

    with pytest.raises(AssertionError, match="comes back after the last task"):
        check_executor(lambda context: Ending(context.work))


@pytest.mark.slow
def test_death_of_a_worker_is_told() -> None:
    class Silent(Processes[Any, Any]):
        def run(self, tasks: Iterator[Any]) -> Iterator[Done[Any, Any]]:
            return (done for done in super().run(tasks) if not done.lost)

    with pytest.raises(AssertionError, match="takes other tasks with it"):
        check_executor(lambda context: Silent(context.work, 2), is_isolated=True)


def test_tasks_are_asked_for_by_the_caller() -> None:
    class Aside(InProcess[Any, Any]):
        def run(self, tasks: Iterator[Any]) -> Iterator[Done[Any, Any]]:
            while True:
                with ThreadPoolExecutor(1) as aside:
                    task = aside.submit(next, tasks, None).result()
                if task is None:
                    return
                yield Done(task, self._work(task))

    with pytest.raises(AssertionError, match="outside the caller's thread"):
        check_executor(lambda context: Aside(context.work))
