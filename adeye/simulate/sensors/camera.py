"""Physical camera: boxes as pixels, seen by contrast, detected as connected parts of the image.

The detector uses the image only: which pixels show what, their class, and edges between surfaces.
The range follows from the lowest row of a part, where the object stands on the flat ground, and has
the error of half a pixel there, ``z² / (f h) / 2``. Where that row cannot be seen, the size that
the class has must do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

import numpy as np

from adeye import signals
from adeye.delivery import insert, no_measurement, sample_at
from adeye.fields import fields_of
from adeye.kernel import raster
from adeye.kernel.detection_range import contrast_threshold
from adeye.kernel.elementary import sin_cos, tan
from adeye.kernel.jit import compiled, inlined
from adeye.kernel.raster import RUN_WIDTH
from adeye.signals import Bools, Floats, Ints, Measurement, Scene, parameter_record, spec_columns
from adeye.simulate.sensors import imaging
from adeye.simulate.sensors.imaging import Image
from adeye.simulate.sensors.sampling import Found, Sampling, Stream, Truth
from adeye.simulate.world.objects import DEFAULT_SIZES
from adeye.simulate.world.weather import light_extinction
from adeye.trace import Picture

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.ports import SensorContext
    from adeye.signals import Surroundings
    from adeye.spec.sensors import PhysicalCamera

# --- From a frame to detections: connected parts, their place from where they touch the ground ----

_TYPICAL: Final = {
    **DEFAULT_SIZES,
    "parked_car": DEFAULT_SIZES["car"],
    "parked_truck": DEFAULT_SIZES["truck"],
}
SIZES: Final = np.array([_TYPICAL.get(kind, (0.0, 0.0, 0.0)) for kind in signals.OBJECT_CLASSES])
"""Length, width and height (11, 3) that a class is taken to have [m]; 0 where it varies."""

_LOWEST: Final = 0.25
"""Least distance of a ground contact below the horizon that gives a range [pixels]."""

# Columns of what is found: the first two and the sizes as in a detection.
(
    FOUND_X,
    FOUND_Y,
    FOUND_LENGTH,
    FOUND_WIDTH,
    FOUND_CLASS,
    FOUND_PIXELS,
    FOUND_SOURCE,
) = range(7)
FOUND: Final = 7


class Memory(NamedTuple):
    """Memory of a camera for one frame after the other.

    Attributes:
        image: The frame.
        runs: (columns * rows, RUN_WIDTH) scratch.
        votes: (M,) scratch.
        items: (K, 7) scratch.
        order: (K,) scratch.
    """

    image: Image
    runs: Ints
    votes: Ints
    items: Floats
    order: Ints


@compiled
def recognise(  # noqa: PLR0913, PLR0917 - a kernel
    parameters: Any,
    patches: Floats,
    classes: Ints,
    memory: Memory,
    first: int,
    stop: int,
    run: int,
    found: Found,
) -> None:
    """Detect what an image shows; the largest parts if there are more than fit.

    Args:
        parameters: Record of the camera and the environment.
        patches: (P, PATCH_WIDTH).
        classes: (M,) of the objects.
        memory: With the image, exposed.
        first: First column in use.
        stop: Column behind the last in use.
        run: Whose image it is.
        found: Out.
    """
    image, runs, items = memory.image, memory.runs, memory.items
    count = raster.find_parts(first, stop, image.span, image.owner, image.nearness, classes, runs)
    kept = 0
    for part in range(count):
        if runs[part, raster.RUN_PARENT] != part or not _is_accepted(
            parameters, patches, runs, part, image
        ):
            continue
        place = _room(items, kept, float(runs[part, raster.PART_PIXELS]))
        if place < 0 or not _locate(parameters, runs[part], image, items[place]):
            continue
        items[place, FOUND_PIXELS] = runs[part, raster.PART_PIXELS]
        items[place, FOUND_SOURCE] = raster.main_owner(part, count, image.owner, runs, memory.votes)
        kept = max(kept, place + 1)
    _name_once(items, kept)
    for place in range(kept):
        x, y = items[place, FOUND_X], items[place, FOUND_Y]
        insert(memory.order, items, place, place, x * x + y * y)
    for row in range(kept):
        item, detection = items[memory.order[row]], found.detections[run, row]
        found.mask[run, row] = True
        found.source[run, row] = int(item[FOUND_SOURCE])
        detection[signals.DETECTION_X], detection[signals.DETECTION_Y] = (
            item[FOUND_X],
            item[FOUND_Y],
        )
        detection[signals.DETECTION_LENGTH] = item[FOUND_LENGTH]
        detection[signals.DETECTION_WIDTH] = item[FOUND_WIDTH]
        detection[signals.DETECTION_CLASS] = item[FOUND_CLASS]


@inlined
def _is_accepted(parameters: Any, patches: Floats, runs: Ints, part: int, image: Image) -> bool:
    """Tell whether a part is large enough, the larger the fainter it is.

    What is told from its background needs a product of contrast and angular size that rises as the
    light falls (Rose 1948, see ``contrast_threshold``). So a part counts as many rows as it fills,
    times the share of its contrast that is left in its nearest pixel; rounded. Of equally near ones
    the leftmost and the rightmost count half each, so that an image and its mirror image tell the
    same. Of a sliver at a side of the image nothing can be told: uprights lean where the camera is
    pitched, so its lower end is not where the object stands.
    """
    rows = runs[part, raster.PART_STOP] - runs[part, raster.PART_TOP]
    columns = runs[part, raster.PART_LAST] - runs[part, raster.PART_FIRST] + 1
    if rows < parameters["min_rows"] or columns < parameters["min_columns"]:
        return False
    if _is_cut(runs[part], image.owner.shape[0]) and not columns > parameters["lean"]:
        return False
    kind = runs[part, raster.RUN_CLASS]
    if kind < 0:
        return True
    share = 0.5 * (
        _share_left(parameters, patches, runs[runs[part, raster.PART_NEAREST]], kind, image)
        + _share_left(parameters, patches, runs[runs[part, raster.PART_NEAREST_LAST]], kind, image)
    )
    return bool(rows * share >= parameters["min_rows"] - 0.5)


@inlined
def _share_left(parameters: Any, patches: Floats, run: Ints, kind: int, image: Image) -> float:
    """Return the contrast of the lowest pixel of a run, as a share of the least that is seen."""
    column, row = run[raster.RUN_COLUMN], run[raster.RUN_STOP] - 1
    transmission, _, _ = imaging.patch_at(patches, column, row)
    share, illuminance = imaging.contrast_at(parameters, kind, transmission, column, row, image)
    return share / contrast_threshold(1.0, illuminance)


@inlined
def _is_cut(part: Ints, columns: int) -> bool:
    """Tell whether a part touches the left or the right edge of the image."""
    return bool(part[raster.PART_FIRST] == 0 or part[raster.PART_LAST] == columns - 1)


@inlined
def _room(found: Floats, kept: int, pixels: float) -> int:
    """Return where a part of so many pixels goes: behind the others, or over a smaller one."""
    if kept < found.shape[0]:
        return kept
    least = 0
    for place in range(1, kept):
        if found[place, FOUND_PIXELS] < found[least, FOUND_PIXELS]:
            least = place
    return least if found[least, FOUND_PIXELS] < pixels else -1


@inlined
def _name_once(found: Floats, kept: int) -> None:
    """Name an object as the source of its largest part only, if it shows in several."""
    for place in range(kept):
        for other in range(place):
            thing = found[place, FOUND_SOURCE]
            if thing >= 0.0 and found[other, FOUND_SOURCE] == thing:
                is_larger = found[place, FOUND_PIXELS] > found[other, FOUND_PIXELS]
                found[other if is_larger else place, FOUND_SOURCE] = -1.0


@inlined
def _depth_of_ground(image: Image, row: float) -> float:
    """Return the depth at which the ground shows in a row [m], infinite from the horizon up."""
    view = image.pinhole
    down = (row + view[raster.VIEW_ROW]) / view[raster.VIEW_FOCAL]
    slope = view[raster.VIEW_PITCH_SINE] + down * view[raster.VIEW_PITCH_COSINE]
    if not slope * view[raster.VIEW_FOCAL] >= _LOWEST:
        return math.inf
    return float(view[raster.VIEW_HEIGHT] / slope)


@inlined
def _depth(part: Ints, size: Floats, image: Image) -> float:
    """Return the depth of a part [m], infinite where nothing tells it.

    Where its contact with the ground is hidden or below the image, no more of it can be seen than
    all, so height and width of its class (seen from behind) and the lower edge of the image bound
    the depth from above; the least bound is taken, because near is the safe side. The lower edge
    alone tells nothing: it goes along with the ego, and so would what is placed there.
    """
    columns, rows = image.owner.shape
    is_cut = part[raster.PART_STOP] == rows
    if is_cut and size[2] <= 0.0:
        return math.inf
    if part[raster.PART_CONTACT] >= 0 and not is_cut:
        # Of the row that the contact lies in only its lower neighbour is known to be free.
        depth = _depth_of_ground(image, part[raster.PART_CONTACT] + 0.5)
        if depth < math.inf:
            return depth
    depth = _depth_of_ground(image, rows - 0.5) if is_cut else math.inf
    focal = image.pinhole[raster.VIEW_FOCAL]
    if size[2] > 0.0:
        depth = min(depth, focal * size[2] / (part[raster.PART_STOP] - part[raster.PART_TOP]))
    if size[1] > 0.0 and not _is_cut(part, columns):
        depth = min(depth, focal * size[1] / (part[raster.PART_LAST] - part[raster.PART_FIRST] + 1))
    if depth == math.inf:
        depth = _depth_of_ground(image, part[raster.PART_STOP] - 0.5)
    return depth


@inlined
def _locate(parameters: Any, part: Ints, image: Image, item: Floats) -> bool:
    """Find place and size of a part in the vehicle frame; tell whether its range is known.

    The nearest face is seen. What stands behind it follows from the class: the object is taken to
    lie along the road, so its centre is half of the class's length behind a face ahead, half of its
    width behind a face beside. So tracks get a length that a face alone does not tell, and meet the
    boxes of sensors that report centres. Where one side of the image cuts it, what is seen may be
    anywhere along its flank and is taken for the centre, which errs by half of the length at most.
    """
    view = image.pinhole
    kind = part[raster.RUN_CLASS]
    size = SIZES[max(kind, 0)]
    length, usual = (size[0], size[1]) if kind >= 0 else (0.0, 0.0)
    depth = _depth(part, size if kind >= 0 else SIZES[-1], image)
    if not depth < math.inf:
        return False
    bottom = (
        part[raster.PART_CONTACT] if part[raster.PART_CONTACT] >= 0 else part[raster.PART_STOP] - 1
    )
    down = (bottom + 0.5 + view[raster.VIEW_ROW]) / view[raster.VIEW_FOCAL]
    middle = 0.5 * (part[raster.PART_FIRST] + part[raster.PART_LAST])
    right = depth * (middle + view[raster.VIEW_COLUMN]) / view[raster.VIEW_FOCAL]
    along = depth * (view[raster.VIEW_PITCH_COSINE] - down * view[raster.VIEW_PITCH_SINE])
    sine, cosine = parameters["yaw_sine"], parameters["yaw_cosine"]
    x, y = cosine * along + sine * right, sine * along - cosine * right
    width = usual
    behind = aside = 0.0
    columns = image.owner.shape[0]
    if abs(x) < abs(y):
        aside = math.copysign(0.5 * usual, y)
    elif not _is_cut(part, columns):
        behind = math.copysign(0.5 * length, x)
        width = (
            depth * (part[raster.PART_LAST] - part[raster.PART_FIRST] + 1) / view[raster.VIEW_FOCAL]
        )
    elif part[raster.PART_LAST] - part[raster.PART_FIRST] == columns - 1:
        behind = math.copysign(0.5 * length, x)
    item[FOUND_X] = parameters["x"] + x + behind
    item[FOUND_Y] = parameters["y"] + y + aside
    item[FOUND_LENGTH], item[FOUND_WIDTH], item[FOUND_CLASS] = length, width, kind
    return True


# --- Physical camera: boxes as pixels, seen by contrast, detected as connected parts of the image -

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
        self._image = imaging.empty_image(columns, rows, objects)
        self._room = objects + SPARE
        self._album: list[Picture] | None = None
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

    def keep(self, album: list[Picture]) -> None:
        """Put each image of the first run into an album from now on; no sample changes."""
        self._album = album

    def frame(self, scene: Scene, run: int = 0) -> Frame:
        """Take a picture as the next sample would; nothing of the sensor changes.

        Args:
            scene: Ground truth.
            run: Whose.
        """
        context, image = self._context.scene, self._image
        parameters = self._parameters[run]
        objects, sizes = scene.objects[run], context.object_sizes[run]
        first, stop = imaging.draw(parameters, scene.ego[run], objects, sizes, image)
        covered = image.owner.T.copy()
        stream = Stream(context.stream_seeds[run], self._owner, self._sample_number)
        first, stop = imaging.expose(
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
        imaging.wipe(image, first, stop)
        return frame

    def _sample(self, scene: Scene) -> Measurement:
        if self._album is not None and scene.running[0]:
            frame = self.frame(scene)
            seen = np.where(frame.objects == raster.NOTHING, raster.GHOST, frame.objects)
            pixels = np.where(frame.visible, seen, raster.NOTHING).astype(np.int16)
            self._album.append(Picture(scene.time, pixels))
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
        **fields_of(mount, "x", "y", "z", "yaw"),
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
        **fields_of(spec, "noise", "transmission", "headlamps"),
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
    rows = np.zeros((len(spec.patches), imaging.PATCH_WIDTH))
    for row, patch in zip(rows, spec.patches.values(), strict=True):
        row[imaging.PATCH_FIRST] = min(patch.column, spec.columns)
        row[imaging.PATCH_STOP] = min(patch.column + patch.columns, spec.columns)
        row[imaging.PATCH_TOP] = min(patch.row, spec.rows)
        row[imaging.PATCH_BOTTOM] = min(patch.row + patch.rows, spec.rows)
        row[imaging.PATCH_TRANSMISSION] = patch.transmission
        row[imaging.PATCH_VARIANCE] = patch.noise * patch.noise
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
        record["miss"] = imaging.log_of_miss(threshold, record["noise"])
        for patch in range(patches.shape[1]):
            variance = own + patches[run, patch, imaging.PATCH_VARIANCE]
            patches[run, patch, imaging.PATCH_MISS] = imaging.log_of_miss(
                threshold, np.sqrt(variance)
            )


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
        first, stop = imaging.draw(record, truth.ego[run], objects, sizes, image)
        stream = Stream(truth.seeds[run], truth.owner, truth.number)
        first, stop = imaging.expose(
            record, laid, stream, objects, sizes, classes, image, first, stop
        )
        recognise(record, laid, classes, memory, first, stop, run, found)
        imaging.wipe(image, first, stop)
