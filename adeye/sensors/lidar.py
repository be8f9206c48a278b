"""Physical lidar: beams cast at everything around, and the returns that are strong enough."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from adeye.kernel.jit import compiled
from adeye.kernel.scan import BEAM_SLOPE, BEAM_WIDTH, fill_beams
from adeye.kernel.sight import OUTLINE_WIDTH
from adeye.sensors.delivery import Delivery, no_measurement
from adeye.sensors.returns import GROUND, TURNS, sample_batch
from adeye.signals import (
    POINT_COLUMNS,
    Floats,
    Ints,
    Measurement,
    Scene,
    parameter_record,
    spec_columns,
)
from adeye.spec.sensors import PhysicalLidar
from adeye.world.weather import ROAD_REFLECTIVITY, lidar_rain_noise, lidar_range

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.ports import SensorContext
    from adeye.spec.architecture import Architecture

_FREE: Final = 2
"""References to an array that nobody but its frame holds: the frame's, and that of the count."""


FRAMES: Final = 3
"""Samples of a lidar whose memory is in use at a time: delivered, waiting, being made."""


def sample_bytes(architecture: Architecture) -> int:
    """Count the bytes that the returns of one run's lidars take while it is executed.

    Args:
        architecture: Of the run.
    """
    beams = sum(
        spec.beams * spec.layers
        for spec in architecture.sensors.values()
        if isinstance(spec, PhysicalLidar)
    )
    return FRAMES * beams * (len(POINT_COLUMNS) + 2) * np.dtype(np.float64).itemsize


class LidarSensor:
    """A lidar that delivers the returns of its beams; it detects no objects itself.

    Beams stand layer by layer, see ``kernel.scan.fill_beams``. Where a beam's nearest hit returns
    too little light nothing comes back, and what is behind is hidden all the same.
    """

    def __init__(self, context: SensorContext) -> None:
        """Pack the parameters of every run."""
        self._context = context
        scene = context.scene
        specs = [cast("PhysicalLidar", spec) for spec in context.specs]
        self._tables, self._table_of, departure = _tables(specs)
        self._beams = specs[0].beams
        slopes = self._tables[:, BEAM_SLOPE]
        self._parameters = parameter_record(
            {
                **spec_columns(specs, _numbers),
                "departure": departure[self._table_of],
                "has_ground": slopes.min(axis=1)[self._table_of] < 0.0,
                "is_level": np.abs(slopes).max(axis=1)[self._table_of] == 0.0,
                "rain": scene.surroundings.rain,
                "visibility": scene.surroundings.fog_visibility,
                "rain_noise": [lidar_rain_noise(float(r)) for r in scene.surroundings.rain],
            }
        )
        objects, size = len(scene.object_ids), specs[0].beams * specs[0].layers
        # The last column is that of the ground.
        self._reach: Floats = np.zeros((scene.runs, objects + 1))
        _fill_reach(self._parameters, scene.object_reflectivity, self._reach)
        self._looks: Floats = np.zeros((objects, OUTLINE_WIDTH))
        self._spans: Ints = np.zeros((objects, 2 * TURNS), dtype=np.int64)
        self._nearest: Floats = np.full(size, np.inf)
        self._who: Ints = np.full(size, GROUND, dtype=np.int64)
        self._order: Ints = np.zeros((2, size), dtype=np.int64)
        self._ways: Floats = np.zeros((3, size))
        self._frames: list[_Frame] = []
        self._sample_number = 0
        self._nothing = no_measurement(scene.runs, objects, with_estimate=False)
        first = self._shown(self._frame(), -1.0)
        self._delivery = Delivery.of(context, first)

    def sense(self, scene: Scene) -> Measurement:
        """Sample if it is time to, and return the newest delivered sample."""
        if self._delivery.is_due(scene.tick):
            self._delivery.push(scene.tick, self._sample(scene))
        return self._delivery.newest(scene.tick)

    def _shown(self, frame: _Frame, time: float) -> Measurement:
        """Return a sample of a time [s] whose returns are in a frame."""
        runs, nothing = self._context.scene.runs, self._nothing
        return Measurement(
            stamp=np.full(runs, time),
            fresh=np.zeros(runs, dtype=np.bool_),
            alive=np.ones(runs, dtype=np.bool_),
            mask=nothing.mask.copy(),
            detections=nothing.detections.copy(),
            source=nothing.source.copy(),
            points=frame.points,
            hits=frame.hits,
        )

    def _sample(self, scene: Scene) -> Measurement:
        context, frame = self._context.scene, self._frame()
        sample_batch(
            self._parameters,
            context.stream_seeds,
            np.uint64(self._context.owner),
            self._sample_number,
            scene.ego,
            scene.objects,
            context.object_sizes,
            scene.running,
            self._tables,
            self._table_of,
            self._beams,
            self._reach,
            self._looks,
            self._spans,
            self._nearest,
            self._who,
            self._order,
            self._ways,
            frame.points,
            frame.hits,
            frame.returns,
            frame.counts,
        )
        self._sample_number += 1
        return self._shown(frame, scene.time)

    def _frame(self) -> _Frame:
        """Return a frame that nobody looks at any more, or a new one: fresh memory is dear."""
        for frame in self._frames:
            if sys.getrefcount(frame.points) <= _FREE and sys.getrefcount(frame.hits) <= _FREE:
                return frame
        self._frames.append(_Frame.of(self._context.scene.runs, len(self._nearest)))
        return self._frames[-1]


@dataclass(frozen=True, slots=True)
class _Frame:
    """Memory of one sample, and which of its rows are not empty.

    Attributes:
        points: (B, P, 3).
        hits: (B, P).
        returns: (B, P) beams whose rows are not empty, in the first places.
        counts: (B,) how many they are.
    """

    points: Floats
    hits: Ints
    returns: Ints
    counts: Ints

    @classmethod
    def of(cls, runs: int, beams: int) -> _Frame:
        return cls(
            points=np.zeros((runs, beams, len(POINT_COLUMNS))),
            hits=np.full((runs, beams), GROUND, dtype=np.int64),
            returns=np.empty((runs, beams), dtype=np.int64),
            counts=np.zeros(runs, dtype=np.int64),
        )


def _numbers(spec: PhysicalLidar) -> dict[str, float]:
    """List what the compiled step reads of a lidar."""
    return {
        "x": spec.mount.x,
        "y": spec.mount.y,
        "z": spec.mount.z,
        "yaw": spec.mount.yaw,
        "field_of_view": spec.field_of_view,
        "range": spec.range,
        "reference_reflectivity": spec.reference_reflectivity,
        "range_noise": spec.range_noise,
        "bearing_noise": spec.bearing_noise,
        "drop_out": spec.drop_out,
    }


def _tables(specs: Sequence[PhysicalLidar]) -> tuple[Floats, Ints, Floats]:
    """Find the directions of the beams of every run.

    Returns:
        Tables of beams (G, BEAM_WIDTH, P), number of the table of each run (B,), and how far the
        bearings of each depart from the angles in a layer (G,) [rad].
    """
    known: dict[tuple[float, float, float, float], int] = {}
    of_run = np.zeros(len(specs), dtype=np.int64)
    for run, spec in enumerate(specs):
        shape = (
            spec.mount.yaw,
            spec.mount.pitch,
            spec.field_of_view,
            spec.vertical_field_of_view,
        )
        of_run[run] = known.setdefault(shape, len(known))
    beams, layers = specs[0].beams, specs[0].layers
    tables: Floats = np.zeros((len(known), BEAM_WIDTH, beams * layers))
    departure: Floats = np.zeros(len(known))
    for shape, number in known.items():
        departure[number] = fill_beams(*shape, beams, layers, tables[number])
    return tables, of_run, departure


@compiled
def _fill_reach(parameters: Any, reflectivity: Floats, reach: Floats) -> None:
    """Compute the range (B, M + 1) that the weather leaves for each object and the ground [m]."""
    for run in range(reach.shape[0]):
        record = parameters[run]
        for thing in range(reach.shape[1]):
            is_ground = thing == reach.shape[1] - 1
            reach[run, thing] = lidar_range(
                record["range"],
                ROAD_REFLECTIVITY if is_ground else reflectivity[run, thing],
                record["reference_reflectivity"],
                record["rain"],
                record["visibility"],
            )
