"""Blocks on workers that may lack what is here: they refuse to execute other code than was planned.

A result names the code behind it by hashes that the plan took on this machine. So each block says
what a worker must have, and a worker compares: the release and source of adeye, the libraries that
compute, every plug-in and every file that one reads, before the block and after it.

What carries blocks and results may be foreign, too. It is given bytes, so that it shares no object
with the plan, and what it brings back must have the seal that was set where the block was executed.
"""

from __future__ import annotations

import hashlib
import pickle
import platform
import secrets
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.campaign.unchanged import Source, Unchanged, sources
from adeye.campaign.work import BatchResult, BatchTask, execute
from adeye.errors import IntegrityError, PlatformError, SpecError, UnfitWorker
from adeye.ports import Done, ExecutorContext
from adeye.registry import load_part, source_digest
from adeye.store.columns import Dictionary
from adeye.version import __version__

if TYPE_CHECKING:
    from collections.abc import Callable
    from hashlib import _Hash

    from adeye.campaign.plan import CampaignPlan
    from adeye.campaign.work import WorkContext
    from adeye.ports import Executor

COMPUTING: Final = ("highway-env", "llvmlite", "numba", "numpy", "scipy")
"""Packages whose release may decide a result."""

PROTOCOL: Final = 4
"""Of pickles, which every release of Python reads that adeye may meet."""
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
        make: Callable[
            [ExecutorContext[DemandingTask, BatchResult]], Executor[DemandingTask, BatchResult]
        ],
        context: ExecutorContext[DemandingTask, BatchResult],
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
        self._contexts: dict[int, tuple[WorkContext, WorkContext]] = {}
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

    def _accepted(self, done: Done[DemandingTask, BatchResult]) -> Done[BatchTask, BatchResult]:
        """Take a block back if it was given and its result has the seal of its worker."""
        task = self._given.pop(getattr(done.task, "packed", b""), None)
        if task is None:
            raise self._refused("a block that it was not given, or one twice")
        # Whatever its type says: it comes from somebody else.
        result: Any = done.result
        if result is not None and (
            not isinstance(result, BatchResult) or result.seal != seal_of(done.task, result)
        ):
            raise self._refused(f"a result of block {task.block} that is not what its worker made")
        return Done(task, result, done.lost)

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
        known = self._contexts.get(id(task.context))
        if known is None or known[0] is not task.context:
            known = self._contexts[id(task.context)] = (task.context, _absolute(task.context))
        made = DemandingTask.of(self._demand, replace(task, context=known[1]))
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


def execute_as_demanded(item: DemandingTask) -> BatchResult:
    """Execute a block if this worker has what it must have.

    Args:
        item: The block.

    Returns:
        The results under a seal.

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
    return replace(result, seal=seal_of(item, result))


def seal_of(item: DemandingTask, result: BatchResult) -> str:
    """Hash a block and everything that came out of it, in hex.

    It tells what was altered or exchanged on the way. It is no secret: who wants to forge a result
    can make a seal for it.
    """
    digest = hashlib.sha256(item.packed)
    _absorb(replace(result, seal=""), digest)
    return digest.hexdigest()


def _absorb(value: Any, digest: _Hash) -> None:
    """Take a value into a hash: by what it says, not by how it lies in memory."""
    if isinstance(value, np.ndarray):
        digest.update(f"{value.dtype.str} {value.shape} ".encode() + value.tobytes())
        return
    if isinstance(value, Dictionary):
        value = value.words
    if is_dataclass(value):
        value = [getattr(value, item.name) for item in fields(value)]
    if isinstance(value, Mapping):
        value = list(value.items())
    if isinstance(value, tuple | list):
        digest.update(f"{len(value)} of ".encode())
        for item in value:
            _absorb(item, digest)
        return
    digest.update(f"{value!r} ".encode("utf-8", "surrogatepass"))


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
    module = source.name.rpartition(":")[0]
    if not module.endswith(".py"):
        # A module stays as it was first imported, whatever was installed since; a file does not.
        found = _FIRST.setdefault(module, found)
    if found != source.digest:
        raise _refusal(f"its code of {source.name}, which {source.user} names, is another one")


_FIRST: dict[str, str] = {}
"""Digest of each module when it was first needed here."""


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
    return (*own, *((name, _release(name)) for name in COMPUTING))


def _release(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


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
    path = None if source.path is None else source.path.resolve()
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
