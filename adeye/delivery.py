"""When a sensor samples and when the sample is delivered: rate, latency and jitter in ticks."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Final, Self

import numpy as np

from adeye.kernel.jit import compiled, inlined
from adeye.kernel.random import uniform
from adeye.signals import DETECTION_COLUMNS, Bools, Floats, Ints, Measurement

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.signals import SceneContext
    from adeye.spec.architecture import Vehicle
    from adeye.spec.sensors import Sensor

JITTER_DRAW: Final = 0xFFFFFFFF
"""Index of the draw of a sample's delay: the last one there is, far from any sensor's own draws."""

_ARRAYS: Final = tuple(field.name for field in fields(Measurement))


@dataclass(frozen=True, slots=True)
class SensorContext:
    """What a sensor is built with.

    Attributes:
        sensor_id: Its name in the architecture; owner of its random numbers.
        specs: (B) its spec record in each run.
        scene: What does not change during the runs.
        every: Ticks between two samples.
        latency: Ticks from sample to delivery.
        owner: Owner number of its random stream.
        jitter: Most ticks that a sample comes later than its latency.
        others: (B) spec records of the other sensors of the architecture, by id.
        vehicles: (B) the vehicle record in each run; empty where nobody asks for it.
    """

    sensor_id: str
    specs: Sequence[Sensor]
    scene: SceneContext
    every: int
    latency: int
    owner: int
    jitter: int = 0
    others: Mapping[str, Sequence[Sensor]] = field(default_factory=dict)
    vehicles: Sequence[Vehicle] = ()


def no_measurement(runs: int, objects: int, *, with_estimate: bool) -> Measurement:
    """Return what a sensor delivers before its first sample arrives."""
    first = sample_at(-1.0, runs, objects)
    if with_estimate:
        first.estimate = np.zeros((runs, 13))
    return first


def sample_at(time: float, runs: int, objects: int) -> Measurement:
    """Return a sample made at a time [s] that has detected nothing yet."""
    return Measurement(
        stamp=np.full(runs, time),
        fresh=np.zeros(runs, dtype=np.bool_),
        alive=np.ones(runs, dtype=np.bool_),
        mask=np.zeros((runs, objects), dtype=np.bool_),
        detections=np.zeros((runs, objects, len(DETECTION_COLUMNS))),
        source=np.full((runs, objects), -1, dtype=np.int64),
    )


class Delivery:
    """Holds samples until they are delivered; the newest delivered one stays.

    With jitter each run has delays of its own. Samples never overtake: one that is held up holds up
    those behind it, and of several that arrive at one tick the newest stays.
    """

    def __init__(
        self, every: int, latency: int, first: Measurement, delays: Delays | None = None
    ) -> None:
        """Prepare for a batch.

        Args:
            every: Ticks between two samples.
            latency: Ticks from sample to delivery.
            first: What is delivered before the first sample arrives.
            delays: Draws how much later each sample comes; None for never.
        """
        self._every = every
        self._latency = latency
        self._waiting: deque[tuple[int, Measurement]] = deque()
        self._newest = first
        self._late = None if delays is None else _Late(delays, first)

    @classmethod
    def of(cls, context: SensorContext, first: Measurement) -> Self:
        """Prepare for a batch with the rate, latency and jitter of a sensor.

        Args:
            context: What the sensor is built with.
            first: What is delivered before the first sample arrives.
        """
        delays = None
        if context.jitter > 0:
            delays = Delays(context.scene.stream_seeds, context.owner, context.jitter)
        return cls(context.every, context.latency, first, delays)

    def is_due(self, tick: int) -> bool:
        """Tell whether the sensor samples at a tick."""
        return tick % self._every == 0

    def push(self, tick: int, sample: Measurement) -> None:
        """Take a sample made at a tick."""
        if self._late is not None:
            self._late.push(tick + self._latency, sample)
        else:
            self._waiting.append((tick + self._latency, sample))

    def newest(self, tick: int) -> Measurement:
        """Return the newest sample delivered by a tick; ``fresh`` if it came at this one."""
        if self._late is not None:
            return self._late.newest(tick)
        fresh = False
        while self._waiting and self._waiting[0][0] <= tick:
            self._newest = self._waiting.popleft()[1]
            fresh = True
        self._newest.fresh[:] = fresh
        return self._newest


class Delays:
    """How much later than its latency each sample comes, drawn per run: uniform in whole ticks."""

    def __init__(self, seeds: NDArray[np.uint64], owner: int, most: int) -> None:
        """Prepare for a batch.

        Args:
            seeds: (B,) stream seeds of the runs.
            owner: Owner number of the sensor.
            most: Largest delay [ticks].
        """
        self._seeds = seeds
        self._owner = np.uint64(owner)
        self._most = most
        self._number = 0

    def draw(self) -> Ints:
        """Return the delay (B,) of the next sample [ticks]."""
        delays: Ints = np.empty(self._seeds.shape[0], dtype=np.int64)
        _draw_delays(self._seeds, self._owner, self._number, self._most, delays)
        self._number += 1
        return delays


class _Late:
    """The samples of a sensor with jitter: each run takes its own rows of a sample when due."""

    def __init__(self, delays: Delays, first: Measurement) -> None:
        self._delays = delays
        self._waiting: deque[tuple[Ints, Measurement]] = deque()
        self._newest = first.copy()
        self._due: Ints = np.zeros(first.stamp.shape[0], dtype=np.int64)
        self._tick = -1

    def push(self, tick: int, sample: Measurement) -> None:
        """Take a sample that comes at a tick, or later."""
        self._due = np.maximum(self._due, tick + self._delays.draw())
        self._waiting.append((self._due, sample))

    def newest(self, tick: int) -> Measurement:
        """Return the newest sample delivered by a tick in each run."""
        fresh: Bools = np.zeros(self._due.shape, dtype=np.bool_)
        arriving = [((self._tick < due) & (due <= tick), sample) for due, sample in self._waiting]
        self._tick = tick
        while self._waiting and (self._waiting[0][0] <= tick).all():
            self._waiting.popleft()
        if any(runs.any() for runs, _ in arriving):
            # What was handed out before stays as it was: a fault may go back to it.
            self._newest = self._newest.copy()
        for runs, sample in arriving:
            _take_rows(self._newest, sample, runs)
            fresh |= runs
        self._newest.fresh[:] = fresh
        return self._newest


def _take_rows(newest: Measurement, sample: Measurement, runs: Bools) -> None:
    for name in _ARRAYS:
        target, made = getattr(newest, name), getattr(sample, name)
        if (target is None) != (made is None):
            msg = f"{name} is in only one of a sensor's first measurement and its samples"
            raise ValueError(msg)
        if target is not None:
            target[runs] = made[runs]


@compiled
def _draw_delays(
    seeds: NDArray[np.uint64], owner: np.uint64, number: int, most: int, delays: Ints
) -> None:
    for run in range(seeds.shape[0]):
        share = uniform(seeds[run], owner, number, JITTER_DRAW)
        delays[run] = min(most, int(share * (most + 1)))


@inlined
def insert(order: Ints, places: Floats, count: int, thing: int, distance: float) -> None:
    """Insert an object into the list of those detected, by increasing distance.

    Args:
        order: (M,) objects in order, in and out.
        places: (M, >= 2) x and y of each one's detection in the vehicle frame [m].
        count: How many are in the list.
        thing: Who is inserted.
        distance: Its squared distance [m²].
    """
    row = count
    while row > 0:
        x, y = places[order[row - 1], 0], places[order[row - 1], 1]
        if x * x + y * y <= distance:
            break
        order[row] = order[row - 1]
        row -= 1
    order[row] = thing
