"""Conformance of executors: every task comes back once, whatever its worker does."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from typing import Final

from adeye.ports import Done, Executor, ExecutorContext
from adeye.testing.demands import demand

WORKERS: Final = 2
DIES: Final = "die"
RAISES: Final = "raise"
_MANY: Final = 200
_MOST_AHEAD: Final = 50


def answer(task: str) -> str:
    """Work of the check: give a task back, die of it, or raise.

    Args:
        task: ``die``, ``raise``, or anything else.

    Raises:
        ValueError: The task says so.
    """
    if task == DIES:
        os._exit(3)
    if task == RAISES:
        msg = "the work raised"
        raise ValueError(msg)
    return f"answer to {task}"


class _Tasks(Iterator[str]):
    """Tasks that count who asks for them, and may come back after their end."""

    def __init__(self, tasks: Sequence[str]) -> None:
        self.waiting = list(tasks)
        self.asked = 0
        self.threads: set[int] = set()

    def __next__(self) -> str:
        self.threads.add(threading.get_ident())
        if not self.waiting:
            raise StopIteration
        self.asked += 1
        return self.waiting.pop(0)


def check_executor(
    make: Callable[[ExecutorContext[str, str]], Executor[str, str]],
    *,
    is_isolated: bool = False,
    address: str = "",
) -> None:
    """Check that an executor keeps the contract of ``ports.Executor``.

    Every task comes back once with its own result; tasks are asked for in the caller's thread, few
    ahead of their execution, and again after the last; an exception of the work is the caller's; it
    may be closed twice, and before it has ended.

    Args:
        make: Makes an executor.
        is_isolated: Whether a worker that dies takes only its task with it.
        address: Of its scheduler.

    Raises:
        AssertionError: Names the first rule that it breaks.
    """
    context = ExecutorContext(answer, WORKERS, address)
    with closing(make(context)) as executor:
        _check_all_come_back(executor)
        _check_asked_again(executor)
    with closing(make(context)) as executor:
        _check_raises(executor)
    if is_isolated:
        with closing(make(context)) as executor:
            _check_death(executor)
    executor = make(context)
    first = next(executor.run(_Tasks(["a", "b", "c"])), None)
    demand(first is not None, "no result of three tasks comes while somebody waits for it")
    executor.close()
    executor.close()


def _check_all_come_back(executor: Executor[str, str]) -> None:
    names = [f"task {number}" for number in range(_MANY)]
    tasks = _Tasks(names)
    ended: list[Done[str, str]] = []
    for done in executor.run(tasks):
        if not ended:
            demand(
                tasks.asked <= _MOST_AHEAD,
                f"{tasks.asked} tasks are asked for before the first result: each of them is kept "
                "from everybody else",
            )
        ended.append(done)
    demand(sorted(done.task for done in ended) == sorted(names), "a task is lost, or comes twice")
    wrong = [done for done in ended if done.result != f"answer to {done.task}" or done.lost]
    demand(not wrong, f"results are not those of their tasks: {wrong[:1]}")
    demand(
        tasks.threads == {threading.get_ident()}, "tasks are asked for outside the caller's thread"
    )


def _check_asked_again(executor: Executor[str, str]) -> None:
    tasks = _Tasks(["first"])
    seen = []
    for done in executor.run(tasks):
        seen.append(done.task)
        if done.task == "first":
            # As a block that was lost: it comes back after the iterator has ended.
            tasks.waiting.append("again")
    demand(seen == ["first", "again"], "what comes back after the last task is not executed")


def _check_raises(executor: Executor[str, str]) -> None:
    try:
        list(executor.run(_Tasks([RAISES, "a"])))
    except ValueError as error:
        demand("the work raised" in str(error), f"another error than that of the work: {error}")
    else:
        demand(is_kept=False, rule="an exception of the work is not raised in the caller")


def _check_death(executor: Executor[str, str]) -> None:
    ended = {done.task: done for done in executor.run(_Tasks(["a", DIES, "b", "c"]))}
    demand(set(ended) == {"a", DIES, "b", "c"}, "a worker that dies takes other tasks with it")
    dead = ended[DIES]
    demand(dead.result is None and bool(dead.lost), "a worker's death is not told")
    others = [name for name in "abc" if ended[name].result != f"answer to {name}"]
    demand(not others, "a worker that dies takes results with it")
