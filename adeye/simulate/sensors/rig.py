"""The sensors of an architecture, built for a batch and sampled together."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import fields
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.kernel.random import owner_id
from adeye.plugins import Part, load_part
from adeye.ports import SensorContext, SensorModel
from adeye.signals import DETECTION_COLUMNS, ESTIMATE_COLUMNS, Measurement, spec_columns
from adeye.simulate.sensors.camera import PhysicalCameraSensor
from adeye.simulate.sensors.fmu import FmuSensing
from adeye.simulate.sensors.gnss_imu import TOLERANCE, GnssSensor, ImuSensor
from adeye.simulate.sensors.ground_truth import GroundTruthSensor, LocalisationSensor
from adeye.simulate.sensors.lidar import LidarSensor
from adeye.simulate.sensors.radar import RadarSensor
from adeye.simulate.sensors.ranging import RangingSensor
from adeye.simulate.sensors.ultrasonic import UltrasonicSensor
from adeye.simulate.world.clock import period_ticks, ticks
from adeye.spec.sensors import model_name
from adeye.supervision import guest, sealed

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from adeye.signals import Floats, Scene, SceneContext
    from adeye.spec.sensors import Sensor
    from adeye.sweep.case import TestCase
    from adeye.trace import Album

BUILT_IN: Final[dict[str, Callable[[SensorContext], SensorModel]]] = {
    "camera": RangingSensor,
    "camera/physical": PhysicalCameraSensor,
    "radar": RangingSensor,
    "radar/physical": RadarSensor,
    "lidar": RangingSensor,
    "ultrasonic": UltrasonicSensor,
    "gnss": GnssSensor,
    "imu": ImuSensor,
    "lidar/physical": LidarSensor,
    "localisation": LocalisationSensor,
    "ground_truth": GroundTruthSensor,
}

FMU: Final = "fmu"
"""Kind of the sensors that an FMU is: they need to know where its file is."""

DATA_SHEETS: Final[dict[str, tuple[str, ...]]] = {
    "camera": ("range", "distance_noise", "bearing_noise"),
    "camera/physical": ("field_of_view", "columns", "mount.z"),
    "radar": ("range_noise", "bearing_noise", "range_rate_noise"),
    "radar/physical": (
        "false_alarm_rate",
        "range_resolution",
        "bearing_resolution",
        "range_rate_resolution",
    ),
    "lidar": ("range_noise", "bearing_noise"),
    "lidar/physical": ("field_of_view", "beams", "range_noise", "bearing_noise"),
    "ultrasonic": ("field_of_view", "range_noise"),
    "gnss": ("rate", "position_noise", "bias", "bias_time", "speed_noise"),
    "imu": (
        "rate",
        "acceleration_noise",
        "acceleration_bias",
        "yaw_rate_noise",
        "yaw_rate_bias",
        "bias_time",
    ),
}
"""What a channel may know of the accuracy of a sensor beforehand, by model: a field of its record,
or of its mount. Outages are not among it, nor is any fault."""


class Rig:
    """Every sensor of the architecture; a second one of a kind is a second name."""

    def __init__(
        self,
        cases: Sequence[TestCase],
        scene: SceneContext,
        base_dir: Path,
        *,
        only: Collection[str] | None = None,
        album: Album | None = None,
    ) -> None:
        """Build the sensors of a batch.

        Args:
            cases: Test cases of one structure.
            scene: What does not change during the runs.
            base_dir: Folder of the file that names plug-ins and FMUs.
            only: Which of them to build; None for all.
            album: Gets the images of the first run.
        """
        self._sensors: dict[str, SensorModel] = {}
        for name, first in cases[0].architecture.sensors.items():
            if only is not None and name not in only:
                continue
            specs = [case.architecture.sensors[name] for case in cases]
            context = SensorContext(
                sensor_id=name,
                specs=specs,
                scene=scene,
                every=period_ticks(first.rate, scene.step, f"sensors.{name}.rate"),
                latency=ticks(first.latency, scene.step, f"sensors.{name}.latency"),
                owner=owner_id(f"sensor/{name}"),
                jitter=ticks(first.jitter, scene.step, f"sensors.{name}.jitter"),
                others={
                    other: [case.architecture.sensors[other] for case in cases]
                    for other in cases[0].architecture.sensors
                    if other != name
                },
                vehicles=[case.architecture.vehicle for case in cases],
            )
            model = model_name(first)
            if model in BUILT_IN:
                self._sensors[name] = BUILT_IN[model](context)
            elif model == FMU:
                self._sensors[name] = FmuSensing(context, base_dir)
            else:
                self._sensors[name] = _Guest(
                    load_part(first.kind, base_dir, is_sealed=True), context
                )

        for name, sensor in self._sensors.items():
            if album is not None and isinstance(sensor, PhysicalCameraSensor):
                sensor.keep(album.setdefault(name, []))

    def cover(self, name: str, patches: Sequence[Floats]) -> None:
        """Lay patches on the image of a physical camera, in place of those laid on before.

        Args:
            name: Of the camera.
            patches: (B, P, PATCH_WIDTH) each, see ``imaging``; none for what its record says.

        Raises:
            TypeError: It is no physical camera.
        """
        camera = self._sensors[name]
        if not isinstance(camera, PhysicalCameraSensor):
            msg = f"{name} has no image"
            raise TypeError(msg)
        camera.cover(patches)

    def sense(self, scene: Scene) -> dict[str, Measurement]:
        """Return the newest delivered measurement of each sensor."""
        return {name: sensor.sense(scene) for name, sensor in self._sensors.items()}

    def close(self) -> None:
        """End what senses outside of this process."""
        for sensor in self._sensors.values():
            if isinstance(sensor, FmuSensing):
                sensor.close()


class _Guest:
    """A sensor of somebody else: it shares no memory with the world, nor with its readers.

    It may write into what it is shown and into what it has answered; both are copies. What it
    raises ends no more than the batch, under its name.
    """

    def __init__(self, part: Part, context: SensorContext) -> None:
        self._name, self._places = part.name, part.places
        with guest(self._name, "sensor"), sealed(self._name, self._places):
            self._sense = part.build(deepcopy(context)).sense

    def sense(self, scene: Scene) -> Measurement:
        with guest(self._name, "sensor", self._sense), sealed(self._name, self._places):
            answer = self._sense(scene.copy())
            named = ((item.name, getattr(answer, item.name)) for item in fields(Measurement))
            told = Measurement(**{name: _as_told(name, v) for name, v in named if v is not None})
            said = malformed(told, *scene.objects.shape[:2])
            if not said and not (told.stamp <= scene.time + TOLERANCE).all():
                said = f"stamp {told.stamp.max():g} s is after {scene.time:g} s"
            if said:
                raise ValueError(said)
            return told


_KINDS: Final = {
    **dict.fromkeys(("fresh", "alive", "mask"), np.bool_),
    **dict.fromkeys(("source", "hits"), np.int64),
}
"""Types of what is no number of a measurement."""


def _as_told(name: str, values: Any) -> NDArray[Any]:
    """Copy what a sensor answers; what lies below a mask was not measured."""
    if isinstance(values, np.ma.MaskedArray) and (hidden := np.ma.getmaskarray(values).sum()):
        msg = f"its answer has {hidden} masked samples, not numbers"
        raise ValueError(msg)
    kind = _KINDS.get(name, np.float64)
    return np.array(values).astype(kind, casting="same_kind")


def malformed(item: Measurement, runs: int, objects: int) -> str:
    """Say what is wrong with the form of a measurement of B runs with M objects; empty if nothing.

    What is read by compiled code and recorded must lie within what was agreed: a number behind the
    last object would be that of another run.
    """
    # A sensor has as many rows as it may report: one, one an object, or more with false alarms.
    rows, points, values = (
        () if array is None else array.shape[1:2] for array in (item.mask, item.points, item.values)
    )
    shapes = {
        **dict.fromkeys(("stamp", "fresh", "alive"), (runs,)),
        **dict.fromkeys(("mask", "source"), (runs, *rows)),
        "detections": (runs, *rows, len(DETECTION_COLUMNS)),
        "estimate": (runs, len(ESTIMATE_COLUMNS)),
        "points": (runs, *points, 3),
        "hits": (runs, *points),
        "values": (runs, *values),
    }
    if len(rows) != 1:
        return f"mask has shape {item.mask.shape}"
    for name, shape in shapes.items():
        array = getattr(item, name)
        if array is not None and array.shape != shape:
            return f"{name} has shape {array.shape}, not {shape}"
        if name in {"source", "hits"} and array is not None:
            wrong = array[(array < -1) | (array >= objects)]
            if wrong.size:
                return f"{name} names object {wrong[0]}, which is not there"
    if not (np.isfinite(item.stamp).all() and np.isfinite(item.detections[item.mask]).all()):
        return "a stamp or a detection is not finite"
    return ""


def mounts(cases: Sequence[TestCase]) -> dict[str, Floats]:
    """Return the mount pose (B, 4: x, y, z, yaw) of each sensor that has one."""
    found: dict[str, Floats] = {}
    for name, first in cases[0].architecture.sensors.items():
        if hasattr(first, "mount"):
            sensors: list[Any] = [case.architecture.sensors[name] for case in cases]
            poses = [sensor.mount for sensor in sensors]
            found[name] = np.array([[pose.x, pose.y, pose.z, pose.yaw] for pose in poses])
    return found


def data_sheets(cases: Sequence[TestCase]) -> dict[str, dict[str, Floats]]:
    """Return what is known of the accuracy of each sensor (B,), by the fields of its model."""
    found: dict[str, dict[str, Floats]] = {}
    for name, first in cases[0].architecture.sensors.items():
        if model_name(first) in DATA_SHEETS:
            found[name] = spec_columns(
                [case.architecture.sensors[name] for case in cases], data_sheet
            )
    return found


def data_sheet(sensor: Sensor) -> dict[str, float]:
    """Return what is known of the accuracy of a sensor, by the fields of its model."""
    fields = DATA_SHEETS[model_name(sensor)]
    return {field: float(attrgetter(field)(sensor)) for field in fields}
