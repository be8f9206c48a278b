"""Which executor a name means: a built-in one, one of an installed package, or a class."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import partial
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from adeye.campaign.remote import DaskExecutor, Elsewhere, execute_as_demanded
from adeye.errors import UsageError, suggest
from adeye.plugins import Part, load_part, require
from adeye.ports import Done, Executor, ExecutorContext
from adeye.supervision import guest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from adeye.campaign.plan import CampaignPlan

GROUP: Final = "adeye.executors"
"""Entry points under which packages offer executors."""

THREADS: Final = "threads"
PROCESSES: Final = "processes"
DASK: Final = "dask"
HERE: Final = (THREADS, PROCESSES)
"""Executors of this machine, which have what this process has."""

_METHODS: Final = ("run", "close")


@dataclass(frozen=True, slots=True)
class NamedExecutor:
    """An executor that a user asked for by name.

    Attributes:
        name: ``dask``, an entry point, ``module:Class`` or ``./file.py:Class``.
        workers: How many tasks at once; None for its own choice.
        address: Of its scheduler; empty for none.
    """

    name: str
    workers: int | None = None
    address: str = ""

    @property
    def text(self) -> str:
        """For people."""
        where = f" at {self.address}" if self.address else ""
        count = "" if self.workers is None else f" with {self.workers} workers"
        return f"executor {self.name}{where}{count}"

    def open(self, plan: CampaignPlan, traces: Path | None = None) -> Elsewhere:
        """Make it for a plan.

        Args:
            plan: What is executed.
            traces: Folder that its workers write traces to; None if they write none.

        Raises:
            InputError: There is no such executor, or it is none.
            PlatformError: It cannot begin.
        """
        context = ExecutorContext(execute_as_demanded, self.workers, self.address)
        return Elsewhere(plan, find_executor(self.name), context, traces, self.name)


def find_executor(name: str) -> Callable[[ExecutorContext[Any, Any]], Any]:
    """Find what makes an executor from its context.

    Args:
        name: As in ``NamedExecutor``.

    Raises:
        InputError: There is no such executor, or it is none.
    """
    if name == DASK:
        return DaskExecutor
    offered = {item.name: item.value for item in entry_points(group=GROUP)}
    if ":" not in name and name not in offered:
        known = suggest(name, sorted({*HERE, DASK, *offered}))
        raise UsageError(
            f"there is no executor {name!r}", remedy=f"{known} A class is named module:Class."
        )
    part = load_part(offered.get(name, name), Path())
    require(part, "executor", _METHODS)
    return partial(_PluginExecutor, part)


class _PluginExecutor:
    """An executor of somebody else, of which it is known when it works."""

    def __init__(self, part: Part, context: ExecutorContext[Any, Any]) -> None:
        self._name = part.name
        with guest(self._name, "executor"):
            self._executor: Executor[Any, Any] = part.build(context)

    def run(self, tasks: Iterator[Any]) -> Iterator[Done[Any, Any]]:
        with guest(self._name, "executor"):
            found = iter(self._executor.run(tasks))
        while True:
            with guest(self._name, "executor"):
                done: Any = next(found, None)
                if done is None:
                    return
                # Read here, once: an attribute may have code of its own.
                task, result, lost = (getattr(done, item.name, None) for item in fields(Done))
                why = "" if result is not None else f"{self._name} gave no result and no reason"
                done = Done(task, result, str(lost or "") or why)
            yield done

    def close(self) -> None:
        with guest(self._name, "executor"):
            self._executor.close()


def asked_executor(
    name: str | None, threads: int | None, workers: int | None, address: str | None
) -> NamedExecutor | None:
    """Check what was asked for together.

    Args:
        name: Executor; None for threads or processes, as the plan needs.
        threads: As asked for.
        workers: As asked for.
        address: Of a scheduler.

    Returns:
        The executor, None if it is one of this machine.

    Raises:
        UsageError: Some of it excludes something else of it.
    """
    if threads is not None and workers is not None:
        raise _exclusive("--threads and --workers")
    if name in {None, *HERE} and address:
        raise UsageError(
            "--scheduler needs an executor that has one", remedy="Give --executor dask, too."
        )
    if threads is not None and name not in {None, THREADS}:
        raise _exclusive(f"--executor {name} and --threads")
    if workers is not None and name == THREADS:
        raise _exclusive("--executor threads and --workers")
    if name is None or name in HERE:
        return None
    if name == DASK and address and workers is not None:
        raise UsageError(
            "--workers says how many a cluster on this machine has; the one at --scheduler has "
            "its own",
            remedy="Give one of the two.",
        )
    return NamedExecutor(name, workers, address or "")


def _exclusive(what: str) -> UsageError:
    return UsageError(f"{what} exclude each other", remedy="Give one of the two.")
