"""Localisation and ground truth: the ego's own state, and for the latter every object."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled
from adeye.kernel.random import normal, normal_pair
from adeye.sensors.delivery import Delivery, make_room, no_measurement
from adeye.signals import (
    DETECTION_CLASS,
    DETECTION_HAS_RANGE_RATE,
    DETECTION_LENGTH,
    DETECTION_RANGE_RATE,
    DETECTION_WIDTH,
    DETECTION_X,
    DETECTION_Y,
    EGO_HEADING,
    EGO_SPEED,
    EGO_X,
    EGO_Y,
    ESTIMATE_PLACE,
    OBJECT_HEADING,
    OBJECT_SPEED,
    OBJECT_X,
    OBJECT_Y,
    PLACE_D,
    PLACE_HEADING,
    PLACE_OFFSET,
    Bools,
    Floats,
    Ints,
    Measurement,
    Scene,
    parameter_record,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.ports import SensorContext

POSE_DRAWS, SPEED_DRAW = 0, 1
"""Pairs of random numbers of a sample: across the lane and heading; speed."""


class LocalisationSensor:
    """Ego pose and own motion, with white noise across the lane, in heading and in speed."""

    def __init__(self, context: SensorContext) -> None:
        """Pack the noise of every run."""
        self._context = context
        self._parameters = parameter_record(
            {
                name: [getattr(spec, name) for spec in context.specs]
                for name in ("lateral_noise", "heading_noise", "speed_noise")
            }
        )
        self._sample_number = 0
        runs = context.scene.runs
        first = no_measurement(runs, len(context.scene.object_ids), with_estimate=True)
        self._delivery = Delivery(context.every, context.latency, first)

    def sense(self, scene: Scene) -> Measurement:
        """Sample if it is time to, and return the newest delivered sample."""
        if self._delivery.is_due(scene.tick):
            sample = _truth(self._context, scene)
            assert sample.estimate is not None
            _add_noise(
                self._parameters,
                self._context.scene.stream_seeds,
                np.uint64(self._context.owner),
                self._sample_number,
                scene.running,
                sample.estimate,
            )
            self._sample_number += 1
            self._delivery.push(scene.tick, sample)
        return self._delivery.newest(scene.tick)


class GroundTruthSensor:
    """The scene as it is: every object and the ego's own state, without error."""

    def __init__(self, context: SensorContext) -> None:
        """Prepare for a batch."""
        self._context = context
        runs = context.scene.runs
        first = no_measurement(runs, len(context.scene.object_ids), with_estimate=True)
        self._delivery = Delivery(context.every, context.latency, first)

    def sense(self, scene: Scene) -> Measurement:
        """Sample if it is time to, and return the newest delivered sample."""
        if self._delivery.is_due(scene.tick):
            sample = _truth(self._context, scene)
            _list_objects(
                scene.ego,
                scene.objects,
                self._context.scene.object_sizes,
                self._context.scene.object_classes,
                scene.running,
                sample.mask,
                sample.detections,
                sample.source,
            )
            self._delivery.push(scene.tick, sample)
        return self._delivery.newest(scene.tick)


def _truth(context: SensorContext, scene: Scene) -> Measurement:
    runs, objects = context.scene.runs, len(context.scene.object_ids)
    sample = no_measurement(runs, objects, with_estimate=True)
    sample.stamp[:] = scene.time
    assert sample.estimate is not None
    sample.estimate[:, :ESTIMATE_PLACE] = scene.ego
    sample.estimate[:, ESTIMATE_PLACE:] = scene.ego_place
    return sample


@compiled
def _add_noise(
    parameters: Any,
    seeds: NDArray[np.uint64],
    owner: np.uint64,
    number: int,
    running: Bools,
    estimate: Floats,
) -> None:
    """Add noise to the estimates of a batch (B, 13) in place, where a run has not ended."""
    for run in range(estimate.shape[0]):
        if not running[run]:
            continue
        record = parameters[run]
        row = estimate[run]
        across, turn = 0.0, 0.0
        if record["lateral_noise"] > 0.0 or record["heading_noise"] > 0.0:
            across, turn = normal_pair(seeds[run], owner, number, POSE_DRAWS)
        if record["lateral_noise"] > 0.0:
            shift = record["lateral_noise"] * across
            s, c = sin_cos(row[ESTIMATE_PLACE + PLACE_HEADING])
            row[EGO_X] -= shift * s
            row[EGO_Y] += shift * c
            row[ESTIMATE_PLACE + PLACE_D] += shift
            row[ESTIMATE_PLACE + PLACE_OFFSET] += shift
        if record["heading_noise"] > 0.0:
            row[EGO_HEADING] += record["heading_noise"] * turn
        if record["speed_noise"] > 0.0:
            noise = record["speed_noise"] * normal(seeds[run], owner, number, SPEED_DRAW)
            row[EGO_SPEED] = max(0.0, row[EGO_SPEED] + noise)


@compiled
def _list_objects(  # noqa: PLR0913, PLR0917 - a kernel
    ego: Floats,
    objects: Floats,
    sizes: Floats,
    classes: Ints,
    running: Bools,
    mask: Bools,
    detections: Floats,
    source: Ints,
) -> None:
    """List every object of a batch in the vehicle frame with its exact range rate."""
    for run in range(ego.shape[0]):
        if not running[run]:
            continue
        s, c = sin_cos(ego[run, EGO_HEADING])
        for thing in range(objects.shape[1]):
            state = objects[run, thing]
            dx, dy = state[OBJECT_X] - ego[run, EGO_X], state[OBJECT_Y] - ego[run, EGO_Y]
            distance = np.sqrt(dx * dx + dy * dy)
            sine, cosine = sin_cos(state[OBJECT_HEADING])
            vx = state[OBJECT_SPEED] * cosine - ego[run, EGO_SPEED] * c
            vy = state[OBJECT_SPEED] * sine - ego[run, EGO_SPEED] * s
            row = make_room(detections[run], source[run], thing, dx * dx + dy * dy)
            detections[run, row, DETECTION_X] = c * dx + s * dy
            detections[run, row, DETECTION_Y] = -s * dx + c * dy
            detections[run, row, DETECTION_RANGE_RATE] = (
                (vx * dx + vy * dy) / distance if distance > 0.0 else 0.0
            )
            detections[run, row, DETECTION_HAS_RANGE_RATE] = 1.0
            detections[run, row, DETECTION_LENGTH] = sizes[run, thing, 0]
            detections[run, row, DETECTION_WIDTH] = sizes[run, thing, 1]
            detections[run, row, DETECTION_CLASS] = classes[thing]
            source[run, row] = thing
            mask[run, thing] = True
