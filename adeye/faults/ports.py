"""What an injector is built with, and what it is told at each tick.

An injector returns the very same object where its fault is active in no run, otherwise a changed
copy in which the other runs keep every bit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

import numpy as np

from adeye.signals import spec_columns

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.signals import Bools, Floats, Ints, SceneContext
    from adeye.spec.fault import Fault

Thing = TypeVar("Thing")

TICK_TOLERANCE: Final = 1e-6
"""Slack of a time in ticks: multiples of the step are not exact."""


@dataclass(frozen=True, slots=True)
class InjectorContext:
    """What an injector is built with.

    Attributes:
        specs: The fault of each run; they share id, target and model.
        scene: Objects, sizes and stream seeds of the batch.
        step: Master clock [s].
        owner: Owner number of its random draws.
    """

    specs: Sequence[Fault]
    scene: SceneContext
    step: float
    owner: np.uint64

    def column(self, name: str) -> Floats:
        """Return a number of each run's fault (B,), NaN where it is not given."""

        def read(spec: Any) -> dict[str, float]:
            value = getattr(spec, name)
            return {name: np.nan if value is None else float(value)}

        return spec_columns(self.specs, read)[name]

    def ticks(self, name: str) -> Ints:
        """Return a time of each run's fault in ticks (B,), rounded up."""
        return np.ceil(self.column(name) / self.step - TICK_TOLERANCE).astype(np.int64)


@dataclass(frozen=True, slots=True)
class Moment:
    """One tick, as a fault sees it.

    Attributes:
        time: [s].
        active: (B,) runs in which the fault is present.
        age: (B,) time since its first onset [s], NaN before.
    """

    time: float
    active: Bools
    age: Floats


class Injector(Protocol[Thing]):
    """What a fault does to a measurement, a command or whatever its target is."""

    def apply(self, thing: Thing, moment: Moment) -> Thing:
        """Return the thing itself if the fault is active in no run, else a changed copy."""
        ...
