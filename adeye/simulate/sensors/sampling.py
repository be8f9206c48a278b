"""How the sensors sample: when it is time to, from what is true, into what is delivered later."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np

from adeye import signals
from adeye.delivery import Delivery
from adeye.kernel.jit import inlined
from adeye.kernel.motion import point_velocity
from adeye.signals import Bools, Floats, Ints, Measurement, Scene

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.ports import SensorContext


class Truth(NamedTuple):
    """What a sensor samples, and whose random numbers it draws.

    Attributes:
        running: (B,) runs that have not ended.
        ego: (B, 7) states.
        objects: (B, M, 5) states.
        sizes: (B, M, 3).
        classes: (M,).
        seeds: (B,) stream seeds.
        owner: Owner number of the sensor.
        number: Number of the sample.
    """

    running: Bools
    ego: Floats
    objects: Floats
    sizes: Floats
    classes: Ints
    seeds: NDArray[np.uint64]
    owner: np.uint64
    number: int


class Stream(NamedTuple):
    """Where the random numbers of a sample of one run come from.

    Attributes:
        seed: Stream seed of the run.
        owner: Owner number of the sensor.
        number: Number of the sample.
    """

    seed: np.uint64
    owner: np.uint64
    number: int


class Found(NamedTuple):
    """The detections of a sample with K of them, empty before.

    Attributes:
        mask: (B, K).
        detections: (B, K, 7).
        source: (B, K).
    """

    mask: Bools
    detections: Floats
    source: Ints

    @classmethod
    def of(cls, sample: Measurement) -> Self:
        """Return those of a sample."""
        return cls(sample.mask, sample.detections, sample.source)


class Sampling:
    """A sensor that samples at its rate and delivers after its latency."""

    def __init__(self, context: SensorContext, first: Measurement) -> None:
        """Prepare for a batch.

        Args:
            context: What the sensor is built with.
            first: What is delivered before the first sample arrives.
        """
        self._context = context
        self._owner = np.uint64(context.owner)
        self._sample_number = 0
        self._delivery = Delivery.of(context, first)

    def sense(self, scene: Scene) -> Measurement:
        """Sample if it is time to, and return the newest delivered sample."""
        if self._delivery.is_due(scene.tick):
            self._delivery.push(scene.tick, self._sample(scene))
            self._sample_number += 1
        return self._delivery.newest(scene.tick)

    def _sample(self, scene: Scene) -> Measurement:
        raise NotImplementedError

    def _truth(self, scene: Scene) -> Truth:
        context = self._context.scene
        return Truth(
            scene.running,
            scene.ego,
            scene.objects,
            context.object_sizes,
            context.object_classes,
            context.stream_seeds,
            self._owner,
            self._sample_number,
        )


def sample_like(
    empty: Measurement, time: float, *, estimate: Floats | None = None, values: Floats | None = None
) -> Measurement:
    """Return a sample made at a time [s] by a sensor that never detects anything.

    Args:
        empty: What it delivers before; the sample shares the empty lists of that.
        time: [s].
        estimate: (B, 13) of the ego, see ``signals.ESTIMATE_COLUMNS``.
        values: (B, V) of the ego's motion.
    """
    runs = len(empty.stamp)
    stamp, fresh = np.full(runs, time), np.zeros(runs, dtype=np.bool_)
    return replace(empty, stamp=stamp, fresh=fresh, estimate=estimate, values=values)


@inlined
def velocity_at(ego: Floats, ahead: float, aside: float) -> tuple[float, float]:
    """Return the velocity of a point that moves with the ego, see ``point_velocity``."""
    return point_velocity(ego[signals.EGO_SPEED], ego[signals.EGO_YAW_RATE], ahead, aside)


def rear_axles(context: SensorContext) -> Floats:
    """Return how far the rear axle is behind the box centre (B,) [m]; 0 without vehicle records."""
    if not context.vehicles:
        return np.zeros(context.scene.runs)
    return np.array([0.5 * vehicle.wheelbase for vehicle in context.vehicles])
