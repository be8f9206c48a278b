"""Where batches run: here, in threads, or in worker processes that may die without loss."""

from __future__ import annotations

import atexit
import math
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor
from concurrent.futures import wait as wait_for_futures
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection, wait
from typing import Any, Final, Generic

from adeye.errors import PlatformError
from adeye.ports import Done, Result, Task
from adeye.store.location import without_secrets
from adeye.supervision import NOTES_BYTES, at_work, hide, note_in, settle_children

__all__ = ["Done", "InProcess", "Processes", "Threads", "allow_children"]

THREAD_NAME: Final = "block"
"""How the names of threads that execute batches begin."""
_WHILE_IT_ENDS_S: Final = 1.0
"""How long a worker that is told to end may take before it is killed [s]."""
_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM)
"""What a worker leaves to its parent."""


def is_abandoned_work_running() -> bool:
    """Tell whether a thread of this process still executes a batch."""
    return any(item.name.startswith(THREAD_NAME) for item in threading.enumerate())


def kill_workers() -> None:
    """End all worker processes of this one at once, with what they started."""
    for child in multiprocessing.active_children():
        _kill(child.pid)


# Workers ignore SIGTERM, with which Python would end those that nobody closed, and wait for them.
atexit.register(kill_workers)


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
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix=THREAD_NAME)
        self._busy: dict[Future[Result], Task] = {}
        self._is_abandoned = False

    def run(self, tasks: Iterator[Task]) -> Iterator[Done[Task, Result]]:
        """Execute tasks as they come; results arrive in the order in which they end."""
        busy = self._busy
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
                task = busy.pop(future)
                if not future.cancelled():
                    yield Done(task, future.result())

    def drop_waiting(self) -> None:
        """Forget the batches that no thread has begun; they bring no result."""
        for future in list(self._busy):
            future.cancel()

    def abandon(self) -> None:
        """Do not wait for the batches that are running; nobody takes their results."""
        self._pool.shutdown(wait=False, cancel_futures=True)
        self._is_abandoned = True

    def close(self) -> None:
        """Drop what was not begun and wait for what was."""
        if not self._is_abandoned:
            self._pool.shutdown(wait=True, cancel_futures=True)


class Processes(Generic[Task, Result]):
    """Runs batches in worker processes, one batch each at a time.

    A worker that dies takes only its batch with it; the caller decides whether to try it again.
    One that is not done by its deadline is killed with its process group, which is the same to the
    caller. A worker whose parent dies is killed, too, whatever it does. An exception of the work
    itself ends the iteration here, because it is a defect, not an accident.
    """

    def __init__(
        self, work: Callable[[Task], Result], workers: int, deadline_s: float = math.inf
    ) -> None:
        """Prepare; workers start with the first tasks.

        Args:
            work: Importable function from task to result.
            workers: Number of processes.
            deadline_s: How long a batch may take [s].
        """
        self._work = work
        self._count = workers
        self._deadline_s = deadline_s
        self._context = multiprocessing.get_context("spawn")
        self._workers: dict[Connection, _Worker] = {}
        self._early: list[Done[Task, Result]] = []

    def begin(self, task: Task) -> None:
        """Execute a task already, as soon as one that has begun ends if there are as many.

        Their results are the first that ``run`` hands over.
        """
        if len(self._busy()) == self._count:
            self._collect_early()
        self._free().give(task)

    def finish(self, task: Task) -> None:
        """Wait until a task ends that has begun."""
        while all(done.task != task for done in self._early):
            self._collect_early()

    def _collect_early(self) -> None:
        (end, *_) = wait(self._busy())
        assert isinstance(end, Connection)
        self._early.append(self._collect(end))

    def run(self, tasks: Iterator[Task]) -> Iterator[Done[Task, Result]]:
        """Execute tasks as they come; results arrive in the order in which they end."""
        try:
            yield from self._early
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
                for end in wait(busy, self._patience()):
                    assert isinstance(end, Connection)
                    yield self._collect(end)
                yield from self._overdue()
        finally:
            self.close()

    def close(self) -> None:
        """End the workers."""
        workers = list(self._workers.values())
        self._workers.clear()
        until = time.monotonic() + _WHILE_IT_ENDS_S
        for worker in workers:
            worker.end.close()
        for worker in workers:
            worker.stop(until - time.monotonic())

    def abandon(self) -> None:
        """Kill the workers."""
        for worker in self._workers.values():
            worker.kill()
        self.close()

    def _patience(self) -> float | None:
        """Give the time until the first batch is overdue [s]; None for no such time."""
        begun = [worker.began for worker in self._workers.values() if worker.task is not None]
        left = min(begun) + self._deadline_s - time.monotonic()
        return max(0.0, left) if math.isfinite(left) else None

    def _overdue(self) -> Iterator[Done[Task, Result]]:
        """Kill the workers whose batch takes too long."""
        for end in self._busy():
            worker = self._workers[end]
            if time.monotonic() - worker.began < self._deadline_s or end.poll():
                continue
            del self._workers[end]
            worker.kill()
            worker.stop()
            why = f"its worker was killed at its deadline, after {self._deadline_s:g} s"
            yield Done(worker.task, None, why)

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
            code = worker.stop()
            return Done(task, None, f"its worker died with code {code} {worker.where}".rstrip())
        worker.task = None
        if kind == "error":
            raise content
        return Done(task, content)


class _Worker:
    """One process and the end of the pipe to it."""

    def __init__(self, context: Any, work: Callable[[Any], Any]) -> None:
        self.task: Any = None
        self.began = math.inf
        try:
            self.end, other = context.Pipe()
            self._notes = context.RawArray("B", NOTES_BYTES)
            with other:
                self._process = context.Process(
                    target=_serve, args=(other, work, self._notes), daemon=True
                )
                self._process.start()
        except OSError as error:
            raise PlatformError(
                f"a worker process cannot be started: {error.strerror or error}. Use fewer "
                "--workers, or allow more processes and open files (ulimit -u, ulimit -n)."
            ) from error

    def give(self, task: Any) -> None:
        self.task, self.began = task, time.monotonic()
        try:
            self.end.send(task)
        except OSError:
            # It died while idle; the end of its pipe says so at the next wait.
            return

    @property
    def where(self) -> str:
        """Say which plug-ins were at work when it ended; empty for none."""
        return at_work(self._notes)

    def kill(self) -> None:
        """End it at once, with what it started."""
        if self._process.is_alive():
            _kill(self._process.pid)

    def stop(self, patience_s: float = _WHILE_IT_ENDS_S) -> int | None:
        """Let it end, but not for long; return its exit code."""
        self.end.close()
        self._process.join(timeout=max(0.0, patience_s))
        if self._process.is_alive():
            self.kill()
            self._process.join()
        code: int | None = self._process.exitcode
        # What it started is of its group, and has nobody any more who would end it.
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        return code


def _kill(pid: int | None) -> None:
    """Kill a process with its group, if it has one of its own already."""
    if pid is None:
        return
    try:
        own = os.getpgid(pid) == pid
        (os.killpg if own else os.kill)(pid, signal.SIGKILL)
    except ProcessLookupError:
        # It has ended meanwhile.
        return


def _serve(end: Connection, work: Callable[[Any], Any], notes: Any) -> None:
    """Serve tasks until the pipe closes; the parent alone decides about Ctrl-C and SIGTERM."""
    note_in(notes)
    allow_children()
    for name in _SIGNALS:
        # A handler, because who is started here would inherit that a signal is ignored.
        signal.signal(name, lambda _number, _frame: None)
    settle_children(partial(_leave, end))
    os.setpgid(0, 0)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    hide(without_secrets)
    while True:
        try:
            task = end.recv()
        except (EOFError, OSError):
            return
        try:
            answer: tuple[str, Any] = ("done", work(task))
        except BaseException as error:  # noqa: BLE001 - it is raised again in the parent
            answer = ("error", error)
        try:
            end.send(answer)
        except OSError:
            return


def allow_children() -> None:
    """Let plug-ins in this process start processes of their own, as they may in any other.

    Python forbids it to daemonic processes, which workers are so that it ends them; what ends ours
    ends their group.
    """
    multiprocessing.current_process().daemon = False


def _leave(end: Connection) -> None:
    """Make a child of a worker one of its own: it ends when told, and holds no pipe open."""
    for name in _SIGNALS:
        signal.signal(name, signal.SIG_DFL)
    end.close()


def _end_with_parent() -> None:
    """Wait for the end of the parent, and kill this process with what it started."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os.killpg(0, signal.SIGKILL)
