"""Where batches run: here, in threads, or in worker processes that may die without loss."""

from __future__ import annotations

import multiprocessing
import os
import signal
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor
from concurrent.futures import wait as wait_for_futures
from multiprocessing.connection import Connection, wait
from typing import TYPE_CHECKING, Any, Generic

from adeye.ports import Done, Result, Task

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

__all__ = ["Done", "InProcess", "Processes", "Threads"]


class InProcess(Generic[Task, Result]):
    """Runs every batch here, one after the other."""

    def __init__(self, work: Callable[[Task], Result]) -> None:
        self._work = work

    def run(self, tasks: Iterator[Task]) -> Iterator[Done[Task, Result]]:
        """Execute tasks in their order."""
        for task in tasks:
            yield Done(task, self._work(task))

    def close(self) -> None:
        """Nothing is held."""


class Threads(Generic[Task, Result]):
    """Runs batches in threads of this process, one batch each at a time.

    Pays where batches are compiled code, which releases the interpreter's lock. Tasks are asked
    for and results handed over in the caller's thread. An exception of the work ends the iteration.
    """

    def __init__(self, work: Callable[[Task], Result], threads: int) -> None:
        """Prepare.

        Args:
            work: Function from task to result; it may share nothing that it changes.
            threads: How many.
        """
        self._work = work
        self._count = threads
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="block")

    def run(self, tasks: Iterator[Task]) -> Iterator[Done[Task, Result]]:
        """Execute tasks as they come; results arrive in the order in which they end."""
        busy: dict[Future[Result], Task] = {}
        while True:
            # One more than there are threads, so that none waits while a result is handed over.
            while len(busy) <= self._count:
                # The iterator is asked again after its end: a batch that failed comes back.
                task = next(tasks, None)
                if task is None:
                    break
                busy[self._pool.submit(self._work, task)] = task
            if not busy:
                return
            ended, _ = wait_for_futures(busy, return_when=FIRST_COMPLETED)
            for future in ended:
                yield Done(busy.pop(future), future.result())

    def close(self) -> None:
        """Drop what was not begun and wait for what was."""
        self._pool.shutdown(wait=True, cancel_futures=True)


class Processes(Generic[Task, Result]):
    """Runs batches in worker processes, one batch each at a time.

    A worker that dies takes only its batch with it; the caller decides whether to try it again.
    A worker whose parent dies reads the end of its pipe and ends. An exception of the work itself
    ends the iteration here, because it is a defect, not an accident.
    """

    def __init__(self, work: Callable[[Task], Result], workers: int) -> None:
        """Prepare; workers start with the first tasks.

        Args:
            work: Importable function from task to result.
            workers: Number of processes.
        """
        self._work = work
        self._count = workers
        self._context = multiprocessing.get_context("spawn")
        self._workers: dict[Connection, _Worker] = {}

    def run(self, tasks: Iterator[Task]) -> Iterator[Done[Task, Result]]:
        """Execute tasks as they come; results arrive in the order in which they end."""
        try:
            while True:
                while len(self._busy()) < self._count:
                    # The iterator is asked again after its end: a batch that was lost comes back.
                    task = next(tasks, None)
                    if task is None:
                        break
                    self._free().give(task)
                busy = self._busy()
                if not busy:
                    return
                for end in wait(busy):
                    assert isinstance(end, Connection)
                    yield self._collect(end)
        finally:
            self.close()

    def close(self) -> None:
        """End the workers."""
        for worker in self._workers.values():
            worker.stop()
        self._workers.clear()

    def _busy(self) -> list[Connection]:
        return [end for end, worker in self._workers.items() if worker.task is not None]

    def _free(self) -> _Worker:
        """Return a worker without a task; it starts with its first one."""
        for worker in self._workers.values():
            if worker.task is None:
                return worker
        started = _Worker(self._context, self._work)
        self._workers[started.end] = started
        return started

    def _collect(self, end: Connection) -> Done[Task, Result]:
        worker = self._workers[end]
        task: Task = worker.task
        try:
            kind, content = end.recv()
        except (EOFError, OSError):
            del self._workers[end]
            return Done(task, None, f"its worker died with code {worker.stop()}")
        worker.task = None
        if kind == "error":
            raise content
        return Done(task, content)


class _Worker:
    """One process and the end of the pipe to it."""

    def __init__(self, context: Any, work: Callable[[Any], Any]) -> None:
        self.end, other = context.Pipe()
        self.task: Any = None
        self._process = context.Process(target=_serve, args=(other, work), daemon=True)
        self._process.start()
        other.close()

    def give(self, task: Any) -> None:
        self.task = task
        try:
            self.end.send(task)
        except OSError:
            # It died while idle; the end of its pipe says so at the next wait.
            return

    def stop(self) -> int | None:
        self.end.close()
        self._process.join(timeout=1.0)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        code: int | None = self._process.exitcode
        return code


def _serve(end: Connection, work: Callable[[Any], Any]) -> None:
    """Serve tasks until the pipe closes; the parent alone decides about Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    while True:
        try:
            task = end.recv()
        except (EOFError, OSError):
            return
        try:
            answer: tuple[str, Any] = ("done", work(task))
        except Exception as error:  # noqa: BLE001 - it is raised again in the parent
            answer = ("error", error)
        try:
            end.send(answer)
        except OSError:
            return
