"""Batches on a Dask cluster: one that is there, or one that is started on this machine.

The only module that imports Dask. What the cluster holds is lost with it and costs only time: this
process alone writes to the database, and whatever has not come back is executed again.
"""

from __future__ import annotations

import logging
import os
import time
from concurrent.futures import CancelledError
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Final, Generic

from adeye.errors import PlatformError, UsageError
from adeye.ports import Done, Result, Task

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from adeye.ports import ExecutorContext

PATIENCE_S: Final = 600.0
"""How long a cluster may have no worker [s]; the Dask setting ``adeye.patience`` is another one."""

_POLL_S: Final = 0.5
_CONNECT_S: Final = 20.0
_FETCH_S: Final = 30.0
_CLOSE_S: Final = 5.0
_RUNNING: Final = "running"


class DaskExecutor(Generic[Task, Result]):
    """Runs batches on the workers of a Dask cluster.

    A worker that dies takes only its batch with it. Dask gives that to another worker, on a cluster
    of this machine not once: what kills its worker is counted by the database, not twice over.
    """

    def __init__(self, context: ExecutorContext[Task, Result]) -> None:
        """Connect to the scheduler, or start one with workers on this machine if none is given.

        Raises:
            UsageError: Dask is not installed, or the address is none.
            PlatformError: The scheduler does not answer.
        """
        self._dask, self._distributed = _modules()
        self._work = context.work
        self._perform = _performing()
        self._address = context.address
        self._cluster: Any = None
        self._arrived: SimpleQueue[Any] = SimpleQueue()
        self._idle_since: float | None = None
        self._patience = float(self._dask.config.get("adeye.patience", PATIENCE_S))
        _quieten()
        self._client = self._connect() if context.address else self._start(context.workers)

    def run(self, tasks: Iterator[Task]) -> Iterator[Done[Task, Result]]:
        """Execute tasks as they come; results arrive in the order in which they end.

        Raises:
            PlatformError: The scheduler is lost, there is no worker, or one lacks adeye.
        """
        flying: dict[Any, Task] = {}
        try:
            while True:
                room = self._room()
                while len(flying) < room:
                    # The iterator is asked again after its end: a batch that was lost comes back.
                    task = next(tasks, None)
                    if task is None:
                        break
                    flying[self._submit(task)] = task
                if not flying:
                    return
                for future in self._ended(flying):
                    done = self._collect(future, flying[future])
                    if done is None:
                        self._arrived.put(future)
                        continue
                    del flying[future]
                    yield done
        finally:
            with suppress(Exception):
                self._client.cancel(list(flying), force=True)

    def close(self) -> None:
        """Leave the cluster; end the one that was started here."""
        # Whatever is wrong with a cluster that is left is no concern of what was executed.
        with suppress(Exception):
            self._client.close(timeout=_CLOSE_S)
        if self._cluster is not None:
            with suppress(Exception):
                self._cluster.close(timeout=_CLOSE_S)
            self._cluster = None

    def _connect(self) -> Any:
        try:
            return self._distributed.Client(
                self._address, timeout=_CONNECT_S, set_as_default=False, name="adeye"
            )
        except ValueError as error:
            raise UsageError(
                f"--scheduler {self._address!r} is no address: {error}",
                remedy="Write tcp://HOST:PORT, as the scheduler prints it when it starts.",
            ) from error
        except OSError as error:
            raise PlatformError(
                f"the Dask scheduler at {self._address} does not answer within {_CONNECT_S:g} s. "
                "Start it, or check the address and the network between."
            ) from error

    def _start(self, workers: int | None) -> Any:
        # One batch each, as in worker processes; the database counts how often a batch was tried,
        # and a batch that waits behind another one would die with it.
        scheduler = "distributed.scheduler"
        own = {f"{scheduler}.allowed-failures": 0, f"{scheduler}.worker-saturation": 1.0}
        with self._dask.config.set(own):
            self._cluster = self._distributed.LocalCluster(
                n_workers=workers or _processors(),
                threads_per_worker=1,
                processes=True,
                memory_limit=0,
                dashboard_address=None,
                silence_logs=logging.CRITICAL,
            )
        self._address = str(self._cluster.scheduler_address)
        return self._distributed.Client(self._cluster, set_as_default=False, name="adeye")

    def _submit(self, task: Task) -> Any:
        # Pure tasks with equal arguments would be one: a batch that comes back is another attempt.
        packed = self._distributed.protocol.pickle.dumps((self._work, task))
        future = self._client.submit(self._perform, packed, pure=False, retries=0)
        future.add_done_callback(self._arrived.put)
        return future

    def _room(self) -> int:
        """Count the batches that may be there at once.

        One on each thread, and where the way is long one waiting for each worker.

        Raises:
            PlatformError: The scheduler is lost, or has had no worker for too long.
        """
        self._require_scheduler()
        try:
            threads = self._client.nthreads()
        except (OSError, ValueError, RuntimeError) as error:
            raise self._lost_scheduler() from error
        if threads:
            self._idle_since = None
            waiting = len(threads) if self._cluster is None else 0
            return sum(map(int, threads.values())) + waiting
        now = time.monotonic()
        self._idle_since = now if self._idle_since is None else self._idle_since
        if now - self._idle_since > self._patience:
            raise PlatformError(
                f"the Dask scheduler at {self._address} has had no worker for "
                f"{self._patience:g} s. Start workers and run again to go on; "
                "DASK_ADEYE__PATIENCE=3600 waits longer."
            )
        return 1

    def _ended(self, flying: dict[Any, Task]) -> list[Any]:
        """Wait a moment for batches that have ended.

        Raises:
            PlatformError: The scheduler is lost.
        """
        ended = []
        with suppress(Empty):
            ended.append(self._arrived.get(timeout=_POLL_S))
            while True:
                ended.append(self._arrived.get_nowait())
        self._require_scheduler()
        return [future for future in dict.fromkeys(ended) if future in flying]

    def _collect(self, future: Any, task: Task) -> Done[Task, Result] | None:
        """Fetch what came of a batch; None if it has to be executed again before it can be."""
        if future.status == "error":
            return self._failed(future.exception(), task)
        try:
            kind, content = future.result(timeout=_FETCH_S)
        except TimeoutError:
            # The worker died with the result in its memory, and Dask executes the batch again.
            self._require_scheduler()
            return None
        except CancelledError:
            self._require_scheduler()
            return Done(task, None, "the Dask scheduler dropped it")
        except OSError as error:
            raise self._lost_scheduler() from error
        if kind == "raised":
            raise content
        if kind == "lacks":
            raise self._unable(content)
        return Done(task, content)

    def _failed(self, error: BaseException, task: Task) -> Done[Task, Result]:
        """Tell a worker that died from one that cannot work at all; the work itself never fails."""
        if isinstance(error, self._distributed.scheduler.KilledWorker):
            return Done(task, None, "its worker died (KilledWorker)")
        raise self._unable(f"{type(error).__name__}: {error}") from error

    def _unable(self, cause: str) -> PlatformError:
        return PlatformError(
            f"a worker of the Dask scheduler at {self._address} cannot execute a batch: {cause}. "
            "It needs the same adeye and plug-ins as this machine."
        )

    def _require_scheduler(self) -> None:
        if self._client.status != _RUNNING:
            raise self._lost_scheduler()

    def _lost_scheduler(self) -> PlatformError:
        return PlatformError(
            f"the Dask scheduler at {self._address} is lost. Results so far are kept; start it and "
            "its workers and run again to go on."
        )


def _performing() -> Callable[[bytes], tuple[str, Any]]:
    """Make what is sent to the workers: it says what is missing there.

    A function inside another one is sent as its code. What is imported by name where it is missing
    ends the worker, and the next, before anybody is told why.
    """

    def perform(packed: bytes) -> tuple[str, Any]:
        from distributed.protocol.pickle import loads

        try:
            work, task = loads(packed)
        except Exception as error:  # noqa: BLE001 - it is told in the caller's process
            return "lacks", f"{type(error).__name__}: {error}"
        try:
            return "done", work(task)
        except Exception as error:  # noqa: BLE001 - it is raised again in the caller's process
            return "raised", error

    return perform


def _modules() -> tuple[Any, Any]:
    try:
        import dask
        import distributed
    except ImportError as error:
        raise UsageError(
            "the executor dask needs adeye[distributed]",
            remedy="Install it: pip install 'adeye[distributed]'.",
        ) from error
    return dask, distributed


def _quieten() -> None:
    """Keep Dask's log from the terminal: what of it matters, the messages here say.

    Each of its loggers has a level and a handler of its own.
    """
    if os.environ.get("ADEYE_DEBUG", "0") in {"", "0"}:
        for name in list(logging.root.manager.loggerDict):
            if name.partition(".")[0] == "distributed":
                logging.getLogger(name).setLevel(logging.CRITICAL)


def _processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
