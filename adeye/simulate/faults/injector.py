"""What an injector is built with, and what it is told at each tick.

An injector has ``apply``, which takes what flows between two stages and the moment. It returns the
very same object where its fault is active in no run, otherwise a changed copy in which the other
runs keep every bit.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar, cast

import numpy as np

from adeye import signals
from adeye.kernel.jit import compiled
from adeye.kernel.random import normal, uniform
from adeye.signals import Authority, Bools, ControlCommand, Floats, Measurement, spec_columns
from adeye.simulate.channels.guard import silenced

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.signals import Ints, SceneContext
    from adeye.spec.architecture import Architecture
    from adeye.spec.fault import Fault

# --- Rows of what flows between the stages: copies, and the rows of one tick in those of another --

Rows = TypeVar("Rows", Measurement, ControlCommand, Authority, "Floats")


def copied(thing: Rows) -> Rows:
    """Copy the arrays of a thing, so that a later change leaves this one as it was."""
    return cast("Rows", _copied(thing))


def _copied(thing: Any) -> Any:
    if isinstance(thing, Authority):
        return Authority(thing.channel.copy(), thing.reason.copy())
    return thing.copy()


def take_rows(target: Rows, source: Rows, runs: Bools) -> None:
    """Overwrite some rows of a thing with those of another of its kind.

    What the source does not have is empty in the target then: NaN, false, -1.

    Args:
        target: In and out.
        source: Where the rows come from.
        runs: (B,) which.
    """
    if isinstance(target, np.ndarray):
        target[runs] = cast("Any", source)[runs]
        return
    for field in fields(target):
        rows = getattr(target, field.name)
        if not isinstance(rows, np.ndarray):
            continue
        other = getattr(source, field.name)
        rows[runs] = _empty(rows) if other is None else other[runs]


def _empty(rows: NDArray[Any]) -> Any:
    if rows.dtype.kind == "f":
        return np.nan
    return rows.dtype.kind != "b" and -1


_NOTHING: Final[Mapping[str, float]] = {
    "stamp": -1.0,
    "fresh": False,
    "mask": False,
    "source": -1,
    "hits": -1,
    "values": np.nan,
    "status": signals.SILENT,
    "plan": np.nan,
    "tracks": np.nan,
    "candidates": np.nan,
    "candidate_costs": np.nan,
    "chosen": -1,
    "channel": signals.NO_CHANNEL,
    "reason": signals.REASON_NONE,
}
"""What stands in the arrays of a thing before there is one; 0 in the others."""


def nothing_yet(thing: Rows) -> Rows:
    """Return what a thing was before there was any: no sample, no command, no authority."""
    nothing = copied(thing)
    if isinstance(nothing, np.ndarray):
        nothing[:] = 0.0
        return nothing
    for field in fields(nothing):
        rows = getattr(nothing, field.name)
        # A sensor that has not delivered yet is alive all the same, if it is.
        if isinstance(rows, np.ndarray) and field.name != "alive":
            rows[:] = _NOTHING.get(field.name, 0.0)
    return nothing


class Past(Generic[Rows]):
    """What a thing was at the newest ticks."""

    def __init__(self, ticks: int) -> None:
        """Keep so many ticks before the present one."""
        self._kept: deque[Rows] = deque(maxlen=ticks + 1)

    def add(self, thing: Rows) -> None:
        """Keep a copy of what it is at the present tick."""
        self._kept.appendleft(copied(thing))

    def write(self, target: Rows, ago: Ints, runs: Bools) -> None:
        """Overwrite rows of a thing with what they were some ticks ago.

        Args:
            target: In and out.
            ago: (B,) ticks; where there was nothing yet, that is written.
            runs: (B,) which.
        """
        for age in np.unique(ago[runs]):
            has_been = age < len(self._kept)
            source = self._kept[age] if has_been else nothing_yet(target)
            take_rows(target, source, runs & (ago == age))


class Queue(Generic[Rows]):
    """Hands on what was put in some ticks ago, in order, while a fault is there.

    From the onset on, what was handed on last stands until the first thing that was put in since
    then has come through.
    """

    def __init__(self, lags: Ints) -> None:
        """Take the lag of each run (B,) in ticks."""
        self._lags = lags
        self._past: Past[Rows] = Past(int(lags.max(initial=0)))
        self._count = np.zeros(lags.shape, dtype=np.int64)

    def apply(self, thing: Rows, active: Bools) -> tuple[Rows, Bools]:
        """Return what comes out, and where it only stands.

        Args:
            thing: What is put in; returned itself if no run is active.
            active: (B,) where the fault is there.
        """
        self._past.add(thing)
        # How many things have been put in since the onset, with this one.
        self._count = np.where(active, self._count + 1, 0)
        stands = active & (self._count <= self._lags)
        if not active.any():
            return thing, stands
        late = copied(thing)
        self._past.write(late, np.minimum(self._lags, self._count), active)
        return late, stands


# --- What an injector is built with, and what it is told at each tick -----------------------------

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
        nothing = nothing_yet(measurement)
        last = nothing if self._last is None else self._last
        faulty = measurement.copy()
        take_rows(faulty, nothing, active)
        faulty.alive[active] = False
        faulty.stamp[active] = last.stamp[active]
        if faulty.estimate is not None and last.estimate is not None:
            faulty.estimate[active] = last.estimate[active]
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
