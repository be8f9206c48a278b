"""Localisation and ground truth: the ego's own state, and for the latter every object."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from adeye import signals
from adeye.delivery import insert, no_measurement, sample_at
from adeye.fields import fields_of
from adeye.kernel.boxes import wrap_to_pi
from adeye.kernel.elementary import sin_cos
from adeye.kernel.jit import compiled
from adeye.kernel.random import normal_pairs
from adeye.signals import Floats, Ints, Measurement, Scene, parameter_record, spec_columns
from adeye.simulate.sensors.sampling import (
    Found,
    Sampling,
    Truth,
    rear_axles,
    sample_like,
    velocity_at,
)

if TYPE_CHECKING:
    from adeye.ports import SensorContext

POSE_DRAWS, SPEED_DRAW = 0, 1
"""Pairs of random numbers of a sample: across the lane and heading; speed."""


class LocalisationSensor(Sampling):
    """Ego pose and own motion, with white noise across the lane, in heading and in speed."""

    def __init__(self, context: SensorContext) -> None:
        """Pack the noise of every run."""
        self._parameters = parameter_record(spec_columns(context.specs, _noise))
        runs = context.scene.runs
        self._draws = (np.zeros(runs), np.zeros(runs), np.zeros(runs), np.zeros(runs))
        self._empty = no_measurement(runs, len(context.scene.object_ids), with_estimate=True)
        super().__init__(context, self._empty)

    def _sample(self, scene: Scene) -> Measurement:
        estimate: Floats = np.empty((len(scene.ego), len(signals.ESTIMATE_COLUMNS)))
        _estimate(self._parameters, self._truth(scene), scene.ego_place, self._draws, estimate)
        return sample_like(self._empty, scene.time, estimate=estimate)


class GroundTruthSensor(Sampling):
    """The scene as it is: every object and the ego's own state, without error."""

    def __init__(self, context: SensorContext) -> None:
        """Prepare for a batch."""
        objects = len(context.scene.object_ids)
        self._rear = rear_axles(context)
        self._places: Floats = np.zeros((objects, 3))
        self._order: Ints = np.zeros(objects, dtype=np.int64)
        super().__init__(context, no_measurement(context.scene.runs, objects, with_estimate=True))

    def _sample(self, scene: Scene) -> Measurement:
        sample = sample_at(scene.time, self._context.scene.runs, len(self._order))
        sample.estimate = np.concatenate((scene.ego, scene.ego_place), axis=1)
        found = Found.of(sample)
        _list_objects(self._truth(scene), self._rear, self._places, self._order, found)
        return sample


def _noise(spec: Any) -> dict[str, float]:
    """List what the compiled step reads of a localisation."""
    return fields_of(spec, "lateral_noise", "heading_noise", "speed_noise")


@compiled
def _estimate(
    parameters: Any,
    truth: Truth,
    place: Floats,
    draws: tuple[Floats, Floats, Floats, Floats],
    estimate: Floats,
) -> None:
    """Estimate the state and the place of every ego; exactly where its run has ended.

    Args:
        parameters: (B,) record of the noise.
        truth: What is true.
        place: (B, 6) places.
        draws: (B,) scratch each.
        estimate: (B, 13) out.
    """
    across, turn, faster, rest = draws
    normal_pairs(truth.seeds, truth.owner, truth.number, POSE_DRAWS, across, turn)
    normal_pairs(truth.seeds, truth.owner, truth.number, SPEED_DRAW, faster, rest)
    for run in range(estimate.shape[0]):
        row = estimate[run]
        for column in range(signals.ESTIMATE_PLACE):
            row[column] = truth.ego[run, column]
        for column in range(row.shape[0] - signals.ESTIMATE_PLACE):
            row[signals.ESTIMATE_PLACE + column] = place[run, column]
        if not truth.running[run]:
            continue
        record = parameters[run]
        if record["lateral_noise"] > 0.0:
            shift = record["lateral_noise"] * across[run]
            s, c = sin_cos(row[signals.ESTIMATE_PLACE + signals.PLACE_HEADING])
            row[signals.EGO_X] -= shift * s
            row[signals.EGO_Y] += shift * c
            row[signals.ESTIMATE_PLACE + signals.PLACE_D] += shift
            row[signals.ESTIMATE_PLACE + signals.PLACE_OFFSET] += shift
        if record["heading_noise"] > 0.0:
            turned = row[signals.EGO_HEADING] + record["heading_noise"] * turn[run]
            row[signals.EGO_HEADING] = wrap_to_pi(turned)
        if record["speed_noise"] > 0.0:
            # Of a standing ego it is below zero half of the time: cut, its mean would be wrong.
            row[signals.EGO_SPEED] += record["speed_noise"] * faster[run]


@compiled
def _list_objects(truth: Truth, rear: Floats, places: Floats, order: Ints, found: Found) -> None:
    """List every object of a batch in the vehicle frame with its exact range rate.

    Args:
        truth: What is true; where a run has ended nothing is listed.
        rear: (B,) how far the rear axle is behind the ego's box centre [m].
        places: (M, 3) scratch: place and range rate of each.
        order: (M,) scratch.
        found: Out.
    """
    for run in range(truth.running.shape[0]):
        if not truth.running[run]:
            continue
        ego = truth.ego[run]
        s, c = sin_cos(ego[signals.EGO_HEADING])
        forward, aside = velocity_at(ego, rear[run], 0.0)
        for thing in range(truth.objects.shape[1]):
            state = truth.objects[run, thing]
            dx, dy = (
                state[signals.OBJECT_X] - ego[signals.EGO_X],
                state[signals.OBJECT_Y] - ego[signals.EGO_Y],
            )
            distance = np.sqrt(dx * dx + dy * dy)
            sine, cosine = sin_cos(state[signals.OBJECT_HEADING])
            vx = state[signals.OBJECT_SPEED] * cosine - (forward * c - aside * s)
            vy = state[signals.OBJECT_SPEED] * sine - (forward * s + aside * c)
            places[thing, 0] = c * dx + s * dy
            places[thing, 1] = -s * dx + c * dy
            places[thing, 2] = (vx * dx + vy * dy) / distance if distance > 0.0 else 0.0
            insert(order, places, thing, thing, dx * dx + dy * dy)
        for row in range(truth.objects.shape[1]):
            thing = order[row]
            found.mask[run, row] = True
            found.source[run, row] = thing
            detection = found.detections[run, row]
            detection[signals.DETECTION_X] = places[thing, 0]
            detection[signals.DETECTION_Y] = places[thing, 1]
            detection[signals.DETECTION_RANGE_RATE] = places[thing, 2]
            detection[signals.DETECTION_HAS_RANGE_RATE] = 1.0
            detection[signals.DETECTION_LENGTH] = truth.sizes[run, thing, 0]
            detection[signals.DETECTION_WIDTH] = truth.sizes[run, thing, 1]
            detection[signals.DETECTION_CLASS] = truth.classes[thing]
