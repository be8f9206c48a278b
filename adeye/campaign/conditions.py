"""Conditions that no result may depend on: batches, orders, lanes, what the processor can do."""

from __future__ import annotations

import hashlib
import os
import platform
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal, TypeVar

import numpy as np

from adeye.campaign.executors import InProcess, Processes, Threads
from adeye.kernel.jit import cache_directory
from adeye.sweep.structure import structure_key

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from adeye.ports import Executor
    from adeye.sweep.case import TestCase

Task = TypeVar("Task")
Result = TypeVar("Result")

Order = Literal["planned", "reversed", "shuffled"]

_ONE: Final = {"here": "here", "threads": "thread", "processes": "process"}
_GLIBC: Final = "-AVX2,-FMA,-AVX2_Usable,-FMA_Usable,-FMA4"
"""What the mathematical library chooses its code by; names of older and newer releases of it."""


@dataclass(frozen=True)
class Mask:
    """A processor that can do less, imitated in child processes.

    Attributes:
        name: For people.
        environment: Variables that hide what this processor can do.
    """

    name: str
    environment: Mapping[str, str]

    @contextmanager
    def applied(self) -> Iterator[None]:
        """Let processes that are started meanwhile have it; this one has read its variables."""
        before = {name: os.environ.get(name) for name in self.environment}
        os.environ.update(self.environment)
        try:
            yield
        finally:
            for name, value in before.items():
                if value is None:
                    os.environ.pop(name, None)
                else:
                    os.environ[name] = value


@dataclass(frozen=True)
class Condition:
    """How a sample is executed.

    Attributes:
        batch: Most runs in a batch.
        order: Of the sample.
        kind: ``here``, ``threads`` or ``processes``.
        lanes: How many of these.
        mask: What the processor may not do; None for nothing.
    """

    batch: int
    order: Order
    kind: Literal["here", "threads", "processes"] = "here"
    lanes: int = 1
    mask: Mask | None = None

    @property
    def name(self) -> str:
        """For people, and the same every time."""
        kind = self.kind if self.lanes > 1 else _ONE[self.kind]
        where = "in this process" if self.kind == "here" else f"in {self.lanes} {kind}"
        masked = f", {self.mask.name}" if self.mask else ""
        return f"batches of {self.batch:,}, {self.order}, {where}{masked}"

    def batches(self, cases: Iterable[TestCase], most: int) -> list[tuple[TestCase, ...]]:
        """Order test cases and cut them into batches of one structure.

        Args:
            cases: In the order of the plan.
            most: Runs that fit into memory together.
        """
        size = max(1, min(self.batch, most))
        groups: dict[str, list[TestCase]] = {}
        for case in self._ordered(list(cases)):
            groups.setdefault(structure_key(case), []).append(case)
        return [
            tuple(group[first : first + size])
            for group in groups.values()
            for first in range(0, len(group), size)
        ]

    def _ordered(self, cases: list[TestCase]) -> list[TestCase]:
        if self.order == "planned":
            return cases
        if self.order == "reversed":
            return cases[::-1]
        return sorted(cases, key=lambda case: _drawn(f"{self.batch} {self.lanes} {case.digest}"))

    def executor(self, work: Callable[[Task], Result]) -> Executor[Task, Result]:
        """Make what executes batches under it."""
        if self.kind == "processes":
            return Processes(work, self.lanes)
        return Threads(work, self.lanes) if self.kind == "threads" else InProcess(work)


CONDITIONS: Final = (
    Condition(1, "shuffled", "processes", 2),
    Condition(7, "reversed"),
    Condition(64, "shuffled", "threads", 2),
    Condition(64, "planned", "processes"),
    Condition(1024, "planned", "threads", 4),
)
"""A result has been seen under one condition; these differ from it and from each other."""


def masks() -> tuple[Mask, ...]:
    """List the lesser processors that this machine can imitate.

    Each hides from one of three what they choose their code by: the mathematical library of the
    system, NumPy, and the compiler of the kernels, whose code then has a folder of its own.
    """
    found = []
    if platform.machine() == "x86_64" and platform.libc_ver()[0] == "glibc":
        hidden = f"glibc.cpu.hwcaps={_GLIBC}"
        found.append(Mask("libm without AVX2 and FMA", {"GLIBC_TUNABLES": hidden}))
    features = _numpy_features()
    if features:
        disabled = {"NPY_DISABLE_CPU_FEATURES": " ".join(features)}
        found.append(Mask(f"NumPy without {', '.join(features)}", disabled))
    folder = cache_directory()
    cached = str(folder.with_name(f"{folder.name}-generic"))
    generic = {"NUMBA_CPU_NAME": "generic", "NUMBA_CACHE_DIR": cached}
    found.append(Mask("kernels for any processor", generic))
    return tuple(found)


def _numpy_features() -> Sequence[str]:
    """List what NumPy has code for, this processor can do, and can be hidden."""
    core: Any = getattr(np, "_core", None) or np.core
    inside = core._multiarray_umath
    dispatched = getattr(inside, "__cpu_dispatch__", ())
    return [name for name in dispatched if inside.__cpu_features__.get(name)]


def _drawn(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
