"""Localisation and ground truth: the ego's own state, and for the latter every object."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.delivery import Delivery, insert, no_measurement, sample_at
from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled
from adeye.kernel.motion import point_velocity
from adeye.kernel.random import normal_pairs
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
    EGO_YAW_RATE,
    ESTIMATE_COLUMNS,
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
    spec_columns,
)
from adeye.simulate.sensors.gnss_imu import rear_axles

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
        self._parameters = parameter_record(spec_columns(context.specs, _noise))
        self._sample_number = 0
        runs = context.scene.runs
        self._draws = (np.zeros(runs), np.zeros(runs), np.zeros(runs), np.zeros(runs))
        self._empty = no_measurement(runs, len(context.scene.object_ids), with_estimate=True)
        self._delivery = Delivery.of(context, self._empty)

    def sense(self, scene: Scene) -> Measurement:
        """Sample if it is time to, and return the newest delivered sample."""
        if self._delivery.is_due(scene.tick):
            estimate: Floats = np.empty((scene.ego.shape[0], len(ESTIMATE_COLUMNS)))
            # It never detects anything, so all its samples share the empty arrays of that.
            sample = replace(
                self._empty,
                stamp=np.full(scene.ego.shape[0], scene.time),
                fresh=np.zeros(scene.ego.shape[0], dtype=np.bool_),
                estimate=estimate,
            )
            _estimate(
                self._parameters,
                self._context.scene.stream_seeds,
                np.uint64(self._context.owner),
                self._sample_number,
                scene.running,
                scene.ego,
                scene.ego_place,
                self._draws,
                estimate,
            )
            self._sample_number += 1
            self._delivery.push(scene.tick, sample)
        return self._delivery.newest(scene.tick)


class GroundTruthSensor:
    """The scene as it is: every object and the ego's own state, without error."""

    def __init__(self, context: SensorContext) -> None:
        """Prepare for a batch."""
        self._context = context
        runs, objects = context.scene.runs, len(context.scene.object_ids)
        self._rear = rear_axles(context)
        self._found: Floats = np.zeros((objects, 3))
        self._order: Ints = np.zeros(objects, dtype=np.int64)
        first = no_measurement(runs, len(context.scene.object_ids), with_estimate=True)
        self._delivery = Delivery.of(context, first)

    def sense(self, scene: Scene) -> Measurement:
        """Sample if it is time to, and return the newest delivered sample."""
        if self._delivery.is_due(scene.tick):
            context = self._context.scene
            sample = sample_at(scene.time, context.runs, len(context.object_ids))
            sample.estimate = np.concatenate((scene.ego, scene.ego_place), axis=1)
            _list_objects(
                scene.ego,
                scene.objects,
                context.object_sizes,
                context.object_classes,
                self._rear,
                scene.running,
                self._found,
                self._order,
                sample.mask,
                sample.detections,
                sample.source,
            )
            self._delivery.push(scene.tick, sample)
        return self._delivery.newest(scene.tick)


def _noise(spec: Any) -> dict[str, float]:
    """List what the compiled step reads of a localisation."""
    return {name: getattr(spec, name) for name in ("lateral_noise", "heading_noise", "speed_noise")}


@compiled
def _estimate(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    seeds: NDArray[np.uint64],
    owner: np.uint64,
    number: int,
    running: Bools,
    ego: Floats,
    place: Floats,
    draws: tuple[Floats, Floats, Floats, Floats],
    estimate: Floats,
) -> None:
    """Estimate the state and the place of every ego; exactly where its run has ended.

    Args:
        parameters: (B,) record of the noise.
        seeds: (B,) stream seeds.
        owner: Owner number of the sensor.
        number: Number of the sample.
        running: (B,).
        ego: (B, 7) states.
        place: (B, 6) places.
        draws: (B,) scratch each.
        estimate: (B, 13) out.
    """
    across, turn, faster, rest = draws
    normal_pairs(seeds, owner, number, POSE_DRAWS, across, turn)
    normal_pairs(seeds, owner, number, SPEED_DRAW, faster, rest)
    for run in range(estimate.shape[0]):
        row = estimate[run]
        for column in range(ESTIMATE_PLACE):
            row[column] = ego[run, column]
        for column in range(row.shape[0] - ESTIMATE_PLACE):
            row[ESTIMATE_PLACE + column] = place[run, column]
        if not running[run]:
            continue
        record = parameters[run]
        if record["lateral_noise"] > 0.0:
            shift = record["lateral_noise"] * across[run]
            s, c = sin_cos(row[ESTIMATE_PLACE + PLACE_HEADING])
            row[EGO_X] -= shift * s
            row[EGO_Y] += shift * c
            row[ESTIMATE_PLACE + PLACE_D] += shift
            row[ESTIMATE_PLACE + PLACE_OFFSET] += shift
        if record["heading_noise"] > 0.0:
            turned = row[EGO_HEADING] + record["heading_noise"] * turn[run]
            row[EGO_HEADING] = wrap_to_pi(turned)
        if record["speed_noise"] > 0.0:
            # Of a standing ego it is below zero half of the time: cut, its mean would be wrong.
            row[EGO_SPEED] += record["speed_noise"] * faster[run]


@compiled
def _list_objects(  # noqa: PLR0913, PLR0917 - a kernel
    ego: Floats,
    objects: Floats,
    sizes: Floats,
    classes: Ints,
    rear: Floats,
    running: Bools,
    found: Floats,
    order: Ints,
    mask: Bools,
    detections: Floats,
    source: Ints,
) -> None:
    """List every object of a batch in the vehicle frame with its exact range rate.

    Args:
        ego: (B, 7) states.
        objects: (B, M, 5) states.
        sizes: (B, M, 3).
        classes: (M,).
        rear: (B,) how far the rear axle is behind the ego's box centre [m].
        running: (B,); where a run has ended nothing is listed.
        found: (M, 3) scratch: place and range rate of each.
        order: (M,) scratch.
        mask: (B, M) out, like the next two empty on entry.
        detections: (B, M, 7) out.
        source: (B, M) out.
    """
    for run in range(ego.shape[0]):
        if not running[run]:
            continue
        s, c = sin_cos(ego[run, EGO_HEADING])
        forward, aside = point_velocity(ego[run, EGO_SPEED], ego[run, EGO_YAW_RATE], rear[run], 0.0)
        for thing in range(objects.shape[1]):
            state = objects[run, thing]
            dx, dy = state[OBJECT_X] - ego[run, EGO_X], state[OBJECT_Y] - ego[run, EGO_Y]
            distance = np.sqrt(dx * dx + dy * dy)
            sine, cosine = sin_cos(state[OBJECT_HEADING])
            vx = state[OBJECT_SPEED] * cosine - (forward * c - aside * s)
            vy = state[OBJECT_SPEED] * sine - (forward * s + aside * c)
            found[thing, 0] = c * dx + s * dy
            found[thing, 1] = -s * dx + c * dy
            found[thing, 2] = (vx * dx + vy * dy) / distance if distance > 0.0 else 0.0
            insert(order, found, thing, thing, dx * dx + dy * dy)
        for row in range(objects.shape[1]):
            thing = order[row]
            mask[run, row] = True
            source[run, row] = thing
            detections[run, row, DETECTION_X] = found[thing, 0]
            detections[run, row, DETECTION_Y] = found[thing, 1]
            detections[run, row, DETECTION_RANGE_RATE] = found[thing, 2]
            detections[run, row, DETECTION_HAS_RANGE_RATE] = 1.0
            detections[run, row, DETECTION_LENGTH] = sizes[run, thing, 0]
            detections[run, row, DETECTION_WIDTH] = sizes[run, thing, 1]
            detections[run, row, DETECTION_CLASS] = classes[thing]
