"""What an injector is built with, and what it is told at each tick.

An injector returns the very same object where its fault is active in no run, otherwise a changed
copy in which the other runs keep every bit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

import numpy as np

from adeye.kernel.jit import compiled
from adeye.kernel.random import normal, uniform
from adeye.signals import spec_columns
from adeye.simulate.channels.guard import silenced
from adeye.simulate.faults.rows import nothing_yet

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from adeye.signals import Bools, ControlCommand, Floats, Ints, Measurement, SceneContext
    from adeye.spec.architecture import Architecture
    from adeye.spec.fault import Fault

# --- What an injector is built with, and what it is told at each tick -----------------------------

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
        architectures: The architecture of each run, which has the target.
    """

    specs: Sequence[Fault]
    scene: SceneContext
    step: float
    owner: np.uint64
    architectures: Sequence[Architecture] = ()

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
        ego: (B, 7) states, see ``signals.EGO_COLUMNS``.
    """

    time: float
    active: Bools
    age: Floats
    ego: Floats


class Injector(Protocol[Thing]):
    """What a fault does to a measurement, a command or whatever its target is."""

    def apply(self, thing: Thing, moment: Moment) -> Thing:
        """Return the thing itself if the fault is active in no run, else a changed copy."""
        ...


# --- Random numbers of faults: by the samples of what fails, one stream for each fault ------------


class Draws:
    """Draws for each sample that a sensor delivers, also those before the fault.

    A sample that is shown again has the same draws. So neither the step nor the other runs of a
    batch, nor when the fault begins, alter what a sample gets.
    """

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        self._seeds = context.scene.stream_seeds
        self._owner = context.owner
        self._number: Ints = np.zeros(len(self._seeds), dtype=np.int64)

    def count(self, measurement: Measurement) -> None:
        """Count the samples that are new at a tick."""
        self._number += measurement.fresh

    def uniforms(self, indices: Ints) -> Floats:
        """Draw from (0, 1) for each index (B, K)."""
        drawn: Floats = np.empty(indices.shape)
        _draw_uniforms(self._seeds, self._owner, self._number, indices, drawn)
        return drawn

    def normals(self, indices: Ints) -> Floats:
        """Draw standard normal numbers for each index (B, K)."""
        drawn: Floats = np.empty(indices.shape)
        _draw_normals(self._seeds, self._owner, self._number, indices, drawn)
        return drawn

    def shares(self, index: int) -> Floats:
        """Draw from (0, 1) once for each run (B,)."""
        indices: Ints = np.full((len(self._seeds), 1), index, dtype=np.int64)
        return self.uniforms(indices)[:, 0]


@compiled
def _draw_uniforms(
    seeds: NDArray[np.uint64], owner: np.uint64, numbers: Ints, indices: Ints, drawn: Floats
) -> None:
    for run in range(indices.shape[0]):
        for item in range(indices.shape[1]):
            drawn[run, item] = uniform(seeds[run], owner, numbers[run], indices[run, item])


@compiled
def _draw_normals(
    seeds: NDArray[np.uint64], owner: np.uint64, numbers: Ints, indices: Ints, drawn: Floats
) -> None:
    for run in range(indices.shape[0]):
        for item in range(indices.shape[1]):
            drawn[run, item] = normal(seeds[run], owner, numbers[run], indices[run, item])


# --- What a fault does to a sensor or a channel; the identity, bit for bit, where it is not
# active.


class DropOut:
    """A sensor delivers nothing new; after the fault its next delivery counts again.

    While active ``alive`` and ``fresh`` are false, there are no detections, and stamp and ego
    estimate stand as they were before.
    """

    def __init__(self, _context: InjectorContext) -> None:
        self._last: Measurement | None = None

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement with the fault in the active runs (B,).

        Args:
            measurement: The newest measurement; returned itself if no run is active.
            moment: Tells where the fault is present.
        """
        active = moment.active
        if not active.any():
            self._last = measurement
            return measurement
        faulty = measurement.copy()
        faulty.fresh[active] = False
        faulty.alive[active] = False
        faulty.mask[active] = False
        faulty.detections[active] = 0.0
        faulty.source[active] = -1
        if self._last is None:
            self._last = nothing_yet(measurement)
        faulty.stamp[active] = self._last.stamp[active]
        if faulty.estimate is not None and self._last.estimate is not None:
            faulty.estimate[active] = self._last.estimate[active]
        if faulty.points is not None:
            faulty.points[active] = 0.0
        if faulty.hits is not None:
            faulty.hits[active] = -1
        if faulty.values is not None:
            faulty.values[active] = np.nan
        # In runs without the fault this is their own newest sample, in the others the old one.
        self._last = faulty
        return faulty


class Silence:
    """A channel says nothing: no new command, stamp frozen, status silent."""

    def __init__(self, _context: InjectorContext) -> None:
        self._last: ControlCommand | None = None

    def apply(self, command: ControlCommand, moment: Moment) -> ControlCommand:
        """Return the command with the fault in the active runs (B,).

        Args:
            command: The newest command; returned itself if no run is active.
            moment: Tells where the fault is present.
        """
        active = moment.active
        if not active.any():
            self._last = command
            return command
        if self._last is None:
            self._last = nothing_yet(command)
        self._last = silenced(command, self._last, active)
        return self._last
