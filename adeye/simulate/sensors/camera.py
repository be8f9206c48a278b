"""Physical camera: boxes as pixels, seen by contrast, detected as connected parts of the image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from adeye.delivery import no_measurement, sample_at
from adeye.kernel.detection_range import contrast_threshold
from adeye.kernel.elementary import sin_cos, tan
from adeye.kernel.jit import compiled
from adeye.kernel.raster import RUN_WIDTH
from adeye.signals import Bools, Floats, Ints, Measurement, Scene, parameter_record, spec_columns
from adeye.simulate.sensors.exposure import (
    PATCH_BOTTOM,
    PATCH_FIRST,
    PATCH_MISS,
    PATCH_STOP,
    PATCH_TOP,
    PATCH_TRANSMISSION,
    PATCH_VARIANCE,
    PATCH_WIDTH,
    expose,
)
from adeye.simulate.sensors.imaging import draw, empty_image, log_of_miss, wipe
from adeye.simulate.sensors.recognition import FOUND, Memory, recognise
from adeye.simulate.sensors.sampling import Found, Sampling, Stream, Truth
from adeye.simulate.world.weather import light_extinction

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.ports import SensorContext
    from adeye.signals import Surroundings
    from adeye.spec.sensors import PhysicalCamera

SPARE: Final = 4
"""Detections that there is room for beyond one of each object: ghosts, and parts of objects."""


@dataclass(frozen=True, slots=True)
class Frame:
    """What the image of one run holds, for tests and pictures; row 0 is at the top.

    Attributes:
        classes: (rows, columns) class of what covers each pixel, -1 for nothing.
        objects: (rows, columns) its number among the objects, -1 for nothing.
        depth: (rows, columns) along the optical axis [m], infinite where nothing is.
        visible: (rows, columns) whether the pixel shows it, or noise where nothing is.
    """

    classes: Ints
    objects: Ints
    depth: Floats
    visible: Bools


class PhysicalCameraSensor(Sampling):
    """A camera with an image and a detector that looks at nothing else."""

    def __init__(self, context: SensorContext) -> None:
        """Pack the parameters of every run."""
        scene = context.scene
        specs = [cast("PhysicalCamera", spec) for spec in context.specs]
        self._parameters = parameter_record(
            {**spec_columns(specs, _numbers), **_environment(scene.surroundings)}
        )
        self._own_patches = np.array([_patches(spec) for spec in specs])
        _fill_misses(self._parameters, self._own_patches)
        self._patches = self._own_patches
        objects = len(scene.object_ids)
        columns, rows = specs[0].columns, specs[0].rows
        self._image = empty_image(columns, rows, objects)
        self._room = objects + SPARE
        self._memory = Memory(
            self._image,
            np.zeros((columns * rows, RUN_WIDTH), dtype=np.int64),
            np.zeros(objects, dtype=np.int64),
            np.zeros((self._room, FOUND)),
            np.zeros(self._room, dtype=np.int64),
        )
        super().__init__(context, no_measurement(scene.runs, self._room, with_estimate=False))

    def cover(self, patches: Sequence[Floats]) -> None:
        """Lay further patches on the image, in place of those laid on before.

        Args:
            patches: (B, P, PATCH_WIDTH) each; those of size 0 change nothing.
        """
        if not patches:
            self._patches = self._own_patches
            return
        laid = np.concatenate((self._own_patches, *patches), axis=1)
        _fill_misses(self._parameters, laid)
        self._patches = laid

    def frame(self, scene: Scene, run: int = 0) -> Frame:
        """Take a picture as the next sample would; nothing of the sensor changes.

        Args:
            scene: Ground truth.
            run: Whose.
        """
        context, image = self._context.scene, self._image
        parameters = self._parameters[run]
        objects, sizes = scene.objects[run], context.object_sizes[run]
        first, stop = draw(parameters, scene.ego[run], objects, sizes, image)
        covered = image.owner.T.copy()
        stream = Stream(context.stream_seeds[run], self._owner, self._sample_number)
        first, stop = expose(
            parameters,
            self._patches[run],
            stream,
            objects,
            sizes,
            context.object_classes,
            image,
            first,
            stop,
        )
        classes = np.append(context.object_classes, -1)
        with np.errstate(divide="ignore"):
            depth = 1.0 / image.nearness.T
        frame = Frame(classes[covered], covered, depth, image.owner.T != -1)
        wipe(image, first, stop)
        return frame

    def _sample(self, scene: Scene) -> Measurement:
        sample = sample_at(scene.time, self._context.scene.runs, self._room)
        truth, found = self._truth(scene), Found.of(sample)
        _sample_batch(self._parameters, self._patches, truth, self._memory, found)
        return sample


def _numbers(spec: PhysicalCamera) -> dict[str, float]:
    """List what the compiled step reads of a camera."""
    mount = spec.mount
    pitch_sine, pitch_cosine = sin_cos(mount.pitch)
    yaw_sine, yaw_cosine = sin_cos(mount.yaw)
    edge = tan(0.5 * spec.field_of_view)
    return {
        "x": mount.x,
        "y": mount.y,
        "z": mount.z,
        "yaw": mount.yaw,
        "yaw_sine": yaw_sine,
        "yaw_cosine": yaw_cosine,
        "pitch_sine": pitch_sine,
        "pitch_cosine": pitch_cosine,
        # The ego's heading along the optical axis, to the right and down in the image.
        "ahead_along": pitch_cosine * yaw_cosine,
        "ahead_right": yaw_sine,
        "ahead_down": -pitch_sine * yaw_cosine,
        "focal": 0.5 * spec.columns / edge,
        "threshold": spec.contrast_threshold,
        "noise": spec.noise,
        "transmission": spec.transmission,
        "headlamps": spec.headlamps,
        # Columns that an upright at the side of the image leans over, from top to bottom.
        "lean": 1.0 + spec.rows * edge * abs(pitch_sine) / pitch_cosine,
        "min_rows": spec.min_pixel_height,
        "min_columns": spec.min_pixel_width,
    }


def _environment(weather: Surroundings) -> dict[str, Any]:
    """List what the compiled step reads of the environment, a column each."""
    runs = len(weather.rain)
    columns = {name: np.zeros(runs) for name in ("extinction", "sun_x", "sun_y")}
    # A sun that is not up shines no more than none: both are below the horizon.
    columns["sun_z"] = np.full(runs, -1.0)
    for run in range(runs):
        columns["extinction"][run] = light_extinction(
            weather.rain[run], weather.fog_visibility[run]
        )
        if weather.sun_elevation[run] >= 0.0:
            up, level = sin_cos(weather.sun_elevation[run])
            sine, cosine = sin_cos(weather.sun_azimuth[run])
            columns["sun_x"][run], columns["sun_y"][run] = level * cosine, level * sine
            columns["sun_z"][run] = up
    return {**columns, "illuminance": weather.illuminance, "miss": 0.0}


def _patches(spec: PhysicalCamera) -> Floats:
    """Return the patches (P, PATCH_WIDTH) of a camera, cut at the edges of the image."""
    rows = np.zeros((len(spec.patches), PATCH_WIDTH))
    for row, patch in zip(rows, spec.patches.values(), strict=True):
        row[PATCH_FIRST] = min(patch.column, spec.columns)
        row[PATCH_STOP] = min(patch.column + patch.columns, spec.columns)
        row[PATCH_TOP] = min(patch.row, spec.rows)
        row[PATCH_BOTTOM] = min(patch.row + patch.rows, spec.rows)
        row[PATCH_TRANSMISSION] = patch.transmission
        row[PATCH_VARIANCE] = patch.noise * patch.noise
    return rows


@compiled
def _fill_misses(parameters: Any, patches: Floats) -> None:
    """Compute how often noise alone does not cross the threshold, which is that by ambient light.

    Args:
        parameters: (B,) records; ``miss`` is written.
        patches: (B, P, PATCH_WIDTH); ``PATCH_MISS`` is written.
    """
    for run in range(parameters.shape[0]):
        record = parameters[run]
        threshold = contrast_threshold(record["threshold"], record["illuminance"])
        own = record["noise"] * record["noise"]
        record["miss"] = log_of_miss(threshold, record["noise"])
        for patch in range(patches.shape[1]):
            variance = own + patches[run, patch, PATCH_VARIANCE]
            patches[run, patch, PATCH_MISS] = log_of_miss(threshold, np.sqrt(variance))


@compiled
def _sample_batch(
    parameters: Any, patches: Floats, truth: Truth, memory: Memory, found: Found
) -> None:
    """Sample every run of a batch, one after the other in one image; empty where it has ended."""
    image, classes = memory.image, truth.classes
    for run in range(truth.running.shape[0]):
        if not truth.running[run]:
            continue
        record, laid = parameters[run], patches[run]
        objects, sizes = truth.objects[run], truth.sizes[run]
        first, stop = draw(record, truth.ego[run], objects, sizes, image)
        stream = Stream(truth.seeds[run], truth.owner, truth.number)
        first, stop = expose(record, laid, stream, objects, sizes, classes, image, first, stop)
        recognise(record, laid, classes, memory, first, stop, run, found)
        wipe(image, first, stop)
