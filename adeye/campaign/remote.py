"""Batches on other machines: what a worker must have, and a Dask cluster that holds them.

A result names the code behind it by hashes that the plan took on this machine. So each block says
what a worker must have, and a worker compares: the release and source of adeye, the libraries that
compute, every plug-in and every file that one reads, before the block and after it.

What carries blocks and results may be foreign, too. It carries bytes, so that it shares no object
with the plan or with what is judged, and what it brings back must have the seal that was set where
the block was executed.

The only module that imports Dask. What the cluster holds is lost with it and costs only time: this
process alone writes to the database, and whatever has not come back is executed again.

A worker may be any: another release of Python, another adeye, none. So it gets no code, only the
name of a function and bytes, and nothing before its releases are compared. One that cannot take
part is told and left out; the batches that it refused go to others.
"""

from __future__ import annotations

import asyncio
import hashlib
import logging
import os
import pickle
import platform
import secrets
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Final, Generic

from adeye.campaign.executors import allow_children
from adeye.campaign.parts import Source, Unchanged, sources
from adeye.campaign.work import BatchResult, BatchTask, WorkContext, execute
from adeye.errors import IntegrityError, PlatformError, SpecError, UnfitWorker, UsageError, needing
from adeye.notices import notice, waiting_for
from adeye.plugins import load_part, source_digest
from adeye.ports import Done, Executor, ExecutorContext, Result, Task
from adeye.version import __version__, release_of

if TYPE_CHECKING:
    from adeye.campaign.plan import CampaignPlan

# --- Blocks on workers that may lack what is here: they refuse to execute other code than was
# planned.

COMPUTING: Final = ("highway-env", "llvmlite", "numba", "numpy", "scipy")
"""Packages whose release may decide a result."""

PROTOCOL: Final = 4
"""Of pickles, which every release of Python reads that adeye may meet."""
_SEAL_BYTES: Final = 32
_OWN: Final = "adeye:run"
"""Any name in the package; its digest is that of all files of the package."""


@dataclass(frozen=True)
class Demand:
    """What a worker must have so that its results are those of the plan.

    Attributes:
        releases: Release by name: of adeye, Python and the packages that compute.
        code: Digest of the source of adeye.
        sources: Plug-ins and the files that they read.
        marked: File in a folder that workers have to share, and what it says; None for no folder.
    """

    releases: tuple[tuple[str, str], ...]
    code: str
    sources: tuple[Source, ...]
    marked: tuple[Path, str] | None = None


@dataclass(frozen=True)
class DemandingTask:
    """A block with what its worker must have, as bytes: nobody on its way alters it by accident.

    Attributes:
        packed: Three pickles: of the releases, which are texts and can be read whatever else is
            another one, of the whole demand, and of the block.
    """

    packed: bytes

    @classmethod
    def of(cls, demand: Demand, task: BatchTask) -> DemandingTask:
        """Pack what a worker must have, and the block."""
        parts = pickle.dumps(demand), pickle.dumps(task)
        return cls(pickle.dumps((demand.releases, *parts), protocol=PROTOCOL))

    @property
    def releases(self) -> tuple[tuple[str, str], ...]:
        """Releases that a worker must have; only one that has them can read the rest."""
        found: tuple[tuple[str, str], ...] = pickle.loads(self.packed)[0]  # noqa: S301 - packed here
        return found

    def open(self) -> tuple[Demand, BatchTask]:
        """Return what a worker must have, and the block."""
        _, demand, task = pickle.loads(self.packed)  # noqa: S301 - packed here
        return pickle.loads(demand), pickle.loads(task)  # noqa: S301 - packed here


class Elsewhere:
    """Executes blocks by an executor whose workers may be anywhere.

    Relative paths are made absolute, because a worker has another working folder.
    """

    def __init__(
        self,
        plan: CampaignPlan,
        make: Callable[[ExecutorContext[DemandingTask, bytes]], Executor[DemandingTask, bytes]],
        context: ExecutorContext[DemandingTask, bytes],
        traces: Path | None = None,
        name: str = "",
    ) -> None:
        """Note what workers must have and make the executor.

        Args:
            plan: What is executed.
            make: Makes the executor.
            context: What it is made with.
            traces: Folder that workers write traces to; None if they write none.
            name: Of the executor, for people.

        Raises:
            PlatformError: The folder cannot be written to.
        """
        self._mark = None if traces is None else _mark(traces)
        self._demand = demand_of(plan, self._mark)
        self._given: dict[bytes, BatchTask] = {}
        self._name = name
        self._executor = make(context)

    def run(self, tasks: Iterator[BatchTask]) -> Iterator[Done[BatchTask, BatchResult]]:
        """Execute tasks as they come.

        Raises:
            IntegrityError: What the executor brings is not what a worker made of a block, or it
                ends without having asked for any.
        """
        demanding = _Demanding(tasks, self._demanding)
        for done in self._executor.run(demanding):
            yield self._accepted(done)
        # Asked again and again, it would end again and again, and the campaign never.
        if not demanding.was_asked:
            raise IntegrityError(
                f"executor {self._name} ended without taking its tasks. Correct the executor: its "
                "run() takes tasks until there are no more; or run with another one to go on."
            )

    def _accepted(self, done: Done[DemandingTask, bytes]) -> Done[BatchTask, BatchResult]:
        """Take a block back if it was given and its result has the seal of its worker."""
        # Whatever its type says: it comes from somebody else.
        told: Any = done
        block = getattr(getattr(told, "task", None), "packed", None)
        task = self._given.pop(block, None) if type(block) is bytes else None
        if block is None or task is None:
            raise self._refused("a block that it was not given, or one twice")
        found, result = told.result, None
        if found is not None:
            # Bytes proper have no code of their own that could tell another thing each time.
            if type(found) is not bytes or found[:_SEAL_BYTES] != _seal(block, found[_SEAL_BYTES:]):
                raise self._refused(
                    f"a result of block {task.block} that is not what its worker made"
                )
            result = pickle.loads(found[_SEAL_BYTES:])  # noqa: S301 - packed by a worker of ours
        return Done(task, result, told.lost)

    def _refused(self, what: str) -> IntegrityError:
        return IntegrityError(
            f"executor {self._name} brought {what}. Nothing of it is kept; correct the executor, "
            "or run with another one to go on."
        )

    def close(self) -> None:
        """End what was started."""
        self._executor.close()
        if self._mark is not None:
            with suppress(OSError):
                self._mark[0].unlink(missing_ok=True)

    def _demanding(self, task: BatchTask) -> DemandingTask:
        made = DemandingTask.of(self._demand, replace(task, context=_absolute(task.context)))
        self._given[made.packed] = task
        return made


class _Demanding(Iterator[DemandingTask]):
    """Tasks with what their workers must have, and whether somebody asked for one.

    Asked again after its end, it looks again; a generator would have ended for good.
    """

    def __init__(
        self, tasks: Iterator[BatchTask], demanding: Callable[[BatchTask], DemandingTask]
    ) -> None:
        self.was_asked = False
        self._tasks, self._demanding = tasks, demanding

    def __next__(self) -> DemandingTask:
        self.was_asked = True
        return self._demanding(next(self._tasks))


def demand_of(plan: CampaignPlan, marked: tuple[Path, str] | None = None) -> Demand:
    """Say what a worker must have.

    Args:
        plan: What is executed.
        marked: File in a folder that it has to share, and what it says.
    """
    return Demand(_releases(), _own_digest(), tuple(map(_absolute_source, sources(plan))), marked)


def execute_as_demanded(item: DemandingTask) -> bytes:
    """Execute a block if this worker has what it must have.

    Args:
        item: The block.

    Returns:
        The results under a seal, see ``sealed``.

    Raises:
        UnfitWorker: It has not; the message names what is missing or another one.
        IntegrityError: A plug-in or a file was changed while the block was executed.
    """
    _require_releases(item.releases)
    demand, task = item.open()
    unchanged = _required(demand)
    unchanged.check()
    result = execute(task)
    unchanged.check()
    return sealed(item, result)


def sealed(item: DemandingTask, result: BatchResult) -> bytes:
    """Pack what came out of a block, behind a hash of both.

    It tells what was altered or exchanged on the way. It is no secret: who wants to forge a result
    can make a seal for it.
    """
    content = pickle.dumps(result, protocol=PROTOCOL)
    return _seal(item.packed, content) + content


def _seal(block: bytes, result: bytes) -> bytes:
    return hashlib.sha256(hashlib.sha256(block).digest() + result).digest()


@cache
def _required(demand: Demand) -> Unchanged:
    """Compare once what a demand says; what is on disk is compared again around each block."""
    _require_releases(demand.releases)
    if demand.code != _own_digest():
        raise _refusal("its source of adeye is another one, of the same release")
    if demand.marked is not None and _read(demand.marked[0]) != demand.marked[1]:
        raise _refusal(
            f"it does not share the folder {demand.marked[0].parent}, where traces are kept; "
            "share it, or run without --traces"
        )
    for source in demand.sources:
        if source.path is None:
            _require_code(source)
        elif not source.is_as_planned():
            raise _refusal(f"its file {source.path} is missing or another one")
    return Unchanged(demand.sources)


def _require_releases(wanted: tuple[tuple[str, str], ...]) -> None:
    found = dict(_releases())
    for name, release in wanted:
        if why := differing(name, release, found.get(name, "")):
            raise _refusal(why)


def differing(name: str, wanted: str, found: str) -> str:
    """Say what a worker has instead of a release; empty if it has it.

    Args:
        name: Of what there are releases.
        wanted: Release with which a campaign is planned; empty for none.
        found: Release that the worker has; empty for none.
    """
    if wanted == found:
        return ""
    return f"it has {name} {found or 'not at all'}, the campaign {wanted or 'does without it'}"


def _require_code(source: Source) -> None:
    try:
        found = load_part(source.name, source.folder).source_digest
    except SpecError as error:
        named = f"{source.name}, which {source.user} names"
        raise _refusal(f"it cannot load {named}: {error}") from error
    if found != source.digest:
        raise _refusal(f"its code of {source.name}, which {source.user} names, is another one")


def _refusal(why: str) -> UnfitWorker:
    refusal = UnfitWorker(
        f"worker on {platform.node()}: {why}. Install on all workers what this machine has, start "
        "them again, and run again to go on."
    )
    refusal.why = why
    return refusal


@cache
def _releases() -> tuple[tuple[str, str], ...]:
    own = (("adeye", __version__), ("Python", platform.python_version()))
    return (*own, *((name, release_of(name)) for name in COMPUTING))


@cache
def _own_digest() -> str:
    """Hash the package once in a process: what is imported stays, whatever is installed since."""
    return source_digest(_OWN, Path())


def _absolute(context: WorkContext) -> WorkContext:
    keep = context.keep
    return replace(
        context,
        folders={name: folder.resolve() for name, folder in context.folders.items()},
        odd_folder=context.odd_folder.resolve(),
        keep=None if keep is None else replace(keep, folder=keep.folder.resolve()),
    )


def _absolute_source(source: Source) -> Source:
    path = None if source.path is None else Path.cwd() / source.path
    return replace(source, folder=source.folder.resolve(), path=path)


def _mark(folder: Path) -> tuple[Path, str]:
    """Write a file that only who shares the folder can read."""
    word = secrets.token_hex(16)
    path = folder.resolve() / f"shared-{word[:8]}.mark"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(word, "ascii")
    except OSError as error:
        raise PlatformError(
            f"{path} cannot be written: {error.strerror}. Free space or run without --traces."
        ) from error
    return path, word


def _read(path: Path) -> str:
    try:
        return path.read_text("ascii")
    except (OSError, UnicodeDecodeError):
        return ""


# --- Batches on a Dask cluster: one that is there, or one that is started on this machine ---------

PATIENCE_S: Final = 600.0
"""How long a cluster may have no worker [s]; the Dask setting ``adeye.patience`` is another one."""
SETTLE_S: Final = 10.0
"""How long others may still come to a cluster all of whose workers are unfit [s]."""

_POLL_S: Final = 0.5
_CONNECT_S: Final = 20.0
_FETCH_S: Final = 30.0
_CLOSE_S: Final = 5.0
_TELL_EVERY_S: Final = 60.0
_RUNNING: Final = "running"
_NAMED: Final = 5
"""Workers that one message names."""
_RELEASES: Final = ("adeye", *COMPUTING)


@dataclass(eq=False)
class _Worker(Generic[Task]):
    """A worker that the scheduler knows.

    Attributes:
        address: Where it is.
        name: As it was started, or its address.
        threads: Batches that it executes at once.
        is_known: Whether its releases are known to be those of this machine.
        unfit: Why it cannot take part; empty unless that is known.
        flying: What it was given, the first one first.
    """

    address: str
    name: str
    threads: int
    is_known: bool = False
    unfit: str = ""
    flying: dict[Any, Task] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """For people."""
        return f"worker {self.name} at {self.address}"

    @property
    def is_fit(self) -> bool:
        """Whether it may get batches."""
        return self.is_known and not self.unfit


class DaskExecutor(Generic[Task, Result]):
    """Runs batches on the workers of a Dask cluster.

    Each batch goes to one worker, so that it is known who lost or refused it. A worker that dies
    takes only what it was executing with it, and the database counts how often that happens.
    """

    def __init__(self, context: ExecutorContext[Task, Result]) -> None:
        """Connect to the scheduler, or start one with workers on this machine if none is given.

        Raises:
            UsageError: Dask is not installed, or the address is none.
            PlatformError: The scheduler does not answer.
        """
        self._dask, self._distributed = _modules()
        self._work = context.work
        self._address = context.address
        self._cluster: Any = None
        self._arrived: SimpleQueue[Any] = SimpleQueue()
        self._workers: dict[str, _Worker[Task]] = {}
        self._flying: dict[Any, _Worker[Task]] = {}
        self._back: deque[Task] = deque()
        self._asked: dict[str, Future[Any]] = {}
        self._idle_since: float | None = None
        self._has_worked = False
        self._patience = float(self._dask.config.get("adeye.patience", PATIENCE_S))
        self._own = self._distributed.versions.get_versions(_RELEASES)["packages"]
        _quieten(self._distributed)
        self._client = self._connect() if context.address else self._start(context.workers)

    def run(self, tasks: Iterator[Task]) -> Iterator[Done[Task, Result]]:
        """Execute tasks as they come; results arrive in the order in which they end.

        Raises:
            PlatformError: The scheduler is lost, there is no worker, or none that is fit.
        """
        try:
            while True:
                yield from self._survey()
                while True:
                    worker = self._free()
                    # The iterator is asked again after its end: a batch that was lost comes back.
                    if not self._back and (worker is not None or not self._flying):
                        self._back.extend(task for task in (next(tasks, None),) if task is not None)
                    if worker is None or not self._back:
                        break
                    self._submit(self._back.popleft(), worker)
                if not self._flying and not self._back:
                    return
                self._require_worker()
                for future in self._ended():
                    # One before it may have told that their worker is unfit.
                    done = self._collect(future) if future in self._flying else None
                    if done is not None:
                        yield done
        finally:
            with suppress(Exception):
                self._client.cancel(list(self._flying), force=True)
            self._flying.clear()
            self._back.clear()
            for worker in self._workers.values():
                worker.flying.clear()

    def close(self) -> None:
        """Leave the cluster; end the one that was started here."""
        for asked in self._asked.values():
            asked.cancel()
        # Whatever is wrong with a cluster that is left is no concern of what was executed.
        with suppress(Exception):
            self._client.close(timeout=_CLOSE_S)
        if self._cluster is not None:
            with suppress(Exception):
                self._cluster.close(timeout=_CLOSE_S)
            self._cluster = None

    def _connect(self) -> Any:
        try:
            with waiting_for(f"the Dask scheduler at {self._address} to answer"):
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

    def _survey(self) -> Iterator[Done[Task, Result]]:
        """Look which workers there are; what one was executing that is gone is lost.

        Raises:
            PlatformError: The scheduler is lost.
        """
        self._require_scheduler()
        try:
            with waiting_for(f"the Dask scheduler at {self._address} to answer"):
                threads = self._client.nthreads()
                if any(address not in self._workers for address in threads):
                    known = self._client.scheduler_info(n_workers=-1)["workers"]
                    self._meet(threads, known)
        except (OSError, ValueError, RuntimeError) as error:
            raise self._lost_scheduler() from error
        for address in self._workers.keys() - threads.keys():
            yield from self._bury(self._workers.pop(address))
        for address, asked in list(self._asked.items()):
            if asked.done():
                del self._asked[address]
                self._compare(self._workers.get(address), asked)

    def _meet(self, threads: dict[str, int], known: dict[str, Any]) -> None:
        """Ask new workers for their releases, as any release of Dask on any Python answers."""
        for address in threads.keys() - self._workers.keys():
            name = str(known.get(address, {}).get("name", address))
            self._workers[address] = _Worker(address, name, int(threads[address]))
            question = self._client.scheduler.broadcast(
                msg={"op": "versions", "packages": list(_RELEASES)},
                workers=[address],
                on_error="ignore",
            )
            # Whoever does not answer keeps nobody else waiting.
            asked = asyncio.run_coroutine_threadsafe(question, self._client.loop.asyncio_loop)
            asked.add_done_callback(lambda _: self._arrived.put(None))
            self._asked[address] = asked

    def _compare(self, worker: _Worker[Task] | None, asked: Future[Any]) -> None:
        """Let a worker take part if it has the releases of this machine."""
        answers = {} if asked.cancelled() or asked.exception() is not None else asked.result()
        if worker is None or worker.address not in answers:
            # It is asked again, if it is still there.
            self._workers.pop("" if worker is None else worker.address, None)
            return
        found = answers[worker.address]["packages"]
        worker.is_known = True
        for name in ("python", *_RELEASES):
            # What is no installed package, such as a folder on the path, says itself what it is.
            if name == "adeye" and None in (self._own[name], found.get(name)):
                continue
            shown = (_dask_release(self._own[name]), _dask_release(found.get(name)))
            if why := differing(name.replace("python", "Python"), *shown):
                self._leave_out(worker, why)
                return

    def _leave_out(self, worker: _Worker[Task], why: str) -> None:
        """Give a worker nothing any more; what it has goes to others."""
        worker.unfit = why
        notice(f"{worker.text} cannot take part: {why}")
        self._take_back(worker, list(worker.flying))

    def _take_back(self, worker: _Worker[Task], futures: list[Any]) -> None:
        self._back.extend(worker.flying[future] for future in futures)
        for future in futures:
            self._forget(future)
        with suppress(Exception):
            self._client.cancel(futures, force=True)

    def _bury(self, worker: _Worker[Task]) -> Iterator[Done[Task, Result]]:
        """Tell what was lost with a worker; what only waited there goes to others."""
        if (asked := self._asked.pop(worker.address, None)) is not None:
            asked.cancel()
        dead = list(worker.flying.items())[: worker.threads]
        if not dead:
            notice(f"{worker.text} has left the Dask scheduler at {self._address}")
        with suppress(Exception):
            self._client.cancel([future for future, _ in dead], force=True)
        for future, _ in dead:
            self._forget(future)
        self._take_back(worker, list(worker.flying))
        for _, task in dead:
            yield Done(task, None, f"its {worker.text} died")

    def _forget(self, future: Any) -> Task:
        return self._flying.pop(future).flying.pop(future)

    def _free(self) -> _Worker[Task] | None:
        """Find the worker with most room: one batch a thread, where the way is long one more."""
        more = 1 if self._cluster is None else 0
        rooms = [
            (worker.threads + more - len(worker.flying), worker)
            for worker in self._workers.values()
            if worker.is_fit
        ]
        room, worker = max(rooms, key=lambda item: item[0], default=(0, None))
        return worker if room > 0 else None

    def _submit(self, task: Task, worker: _Worker[Task]) -> None:
        # ``pickle.loads`` is there whatever else is not, and finds by its name what it shall call.
        call = pickle.dumps(_Call(self._work, task), protocol=PROTOCOL)
        # Pure tasks with equal arguments would be one: a batch that comes back is another attempt.
        future = self._client.submit(
            pickle.loads, call, pure=False, retries=0, workers=[worker.address]
        )
        self._flying[future] = worker
        worker.flying[future] = task
        future.add_done_callback(self._arrived.put)

    def _require_worker(self) -> None:
        """Tell that there is no worker that is fit.

        Raises:
            PlatformError: There has been none for too long, or those that are there refuse.
        """
        if any(worker.is_fit for worker in self._workers.values()):
            self._idle_since = None
            return
        now = time.monotonic()
        self._idle_since = now if self._idle_since is None else self._idle_since
        idle = now - self._idle_since
        unfit = [worker for worker in self._workers.values() if worker.unfit]
        reasons = "; ".join(f"{worker.text}: {worker.unfit}" for worker in unfit[:_NAMED])
        if len(unfit) > _NAMED:
            reasons += f"; and {len(unfit) - _NAMED} more"
        none_ever = bool(unfit) and not (self._has_worked or self._asked)
        if none_ever and idle >= SETTLE_S:
            raise PlatformError(
                f"no worker of the Dask scheduler at {self._address} can take part: {reasons}. "
                "Install on the workers what this machine has, start them again, and run again."
            )
        if idle > self._patience:
            raise PlatformError(
                f"the Dask scheduler at {self._address} has had no worker for "
                f"{self._patience:g} s{f' but unfit ones ({reasons})' if unfit else ''}. "
                "Start workers and run again to go on; DASK_ADEYE__PATIENCE=3600 waits longer."
            )
        if idle >= _POLL_S:
            kind = "no worker that can take part" if unfit else "no worker"
            notice(
                f"the Dask scheduler at {self._address} has {kind}; waiting, "
                f"for {SETTLE_S if none_ever else self._patience:g} s at most",
                topic=f"no worker {self._address}",
                every_s=_TELL_EVERY_S,
            )

    def _ended(self) -> list[Any]:
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
        return [future for future in dict.fromkeys(ended) if future in self._flying]

    def _collect(self, future: Any) -> Done[Task, Result] | None:
        """Fetch what came of a batch; None if it has to be executed before anything can."""
        worker = self._flying[future]
        if future.status == "error":
            return self._failed(future, worker)
        try:
            kind, content = future.result(timeout=_FETCH_S)
        except TimeoutError:
            # The worker may have died with the result in its memory; then it is gone soon.
            self._require_scheduler()
            self._arrived.put(future)
            return None
        except CancelledError:
            self._require_scheduler()
            return Done(self._forget(future), None, "the Dask scheduler dropped it")
        except OSError as error:
            raise self._lost_scheduler() from error
        if kind == "raised":
            raise content
        if kind == "unfit":
            self._leave_out(worker, content)
            return None
        self._has_worked = True
        return Done(self._forget(future), content)

    def _failed(self, future: Any, worker: _Worker[Task]) -> Done[Task, Result] | None:
        """Tell a worker that died from one that cannot work at all; the work itself never fails."""
        error = future.exception()
        if isinstance(error, self._distributed.scheduler.KilledWorker):
            return Done(self._forget(future), None, f"its {worker.text} died (KilledWorker)")
        self._leave_out(worker, f"it cannot execute a batch: {type(error).__name__}: {error}")
        return None

    def _require_scheduler(self) -> None:
        if self._client.status != _RUNNING:
            raise self._lost_scheduler()

    def _lost_scheduler(self) -> PlatformError:
        return PlatformError(
            f"the Dask scheduler at {self._address} is lost. Results so far are kept; start it and "
            "its workers and run again to go on."
        )


class _Call:
    """A call that is made where it is unpickled: the name of ``perform``, and bytes."""

    def __init__(self, work: Callable[[Any], Any], task: Any) -> None:
        self._packed = pickle.dumps((work, task), protocol=PROTOCOL)

    def __reduce__(self) -> tuple[Callable[[bytes], tuple[str, Any]], tuple[bytes]]:
        return perform, (self._packed,)


def perform(packed: bytes) -> tuple[str, Any]:
    """Execute a batch on a worker.

    Args:
        packed: The work and the task.

    Returns:
        ``done`` with the result, ``raised`` with what the work raised, or ``unfit`` with why this
        worker cannot take part.
    """
    try:
        work, task = pickle.loads(packed)  # noqa: S301 - packed by who sent it
    except Exception as error:  # noqa: BLE001 - it is told in the caller's process
        return "unfit", f"it cannot execute a batch: {type(error).__name__}: {error}"
    # Dask starts its workers as daemons.
    allow_children()
    try:
        return "done", work(task)
    except UnfitWorker as error:
        return "unfit", error.why or str(error)
    except Exception as error:  # noqa: BLE001 - it is raised again in the caller's process
        return "raised", error


def _dask_release(found: str | None) -> str:
    """Write a release as people do: of Python without the state of its development."""
    return "" if found is None else found.removesuffix(".final.0")


def _modules() -> tuple[Any, Any]:
    with needing("the executor dask", "distributed"):
        import dask
        import distributed
    return dask, distributed


def _quieten(distributed: Any) -> None:
    """Keep Dask's log from the terminal: what of it matters, the messages here say.

    Each of its loggers has a level and a handler of its own.
    """
    warnings.simplefilter("ignore", distributed.versions.VersionMismatchWarning)
    if os.environ.get("ADEYE_DEBUG", "0") in {"", "0"}:
        for name in list(logging.root.manager.loggerDict):
            if name.partition(".")[0] == "distributed":
                logging.getLogger(name).setLevel(logging.CRITICAL)


def _processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
