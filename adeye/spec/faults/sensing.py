"""What sensors deliver, and so which faults have a meaning for them."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Final, Literal, NamedTuple, get_args

from adeye.signals import (
    DETECTION_LENGTH,
    DETECTION_RANGE_RATE,
    DETECTION_WIDTH,
    DETECTION_X,
    DETECTION_Y,
    EGO_ACCELERATION,
    EGO_HEADING,
    EGO_SPEED,
    EGO_X,
    EGO_Y,
    EGO_YAW_RATE,
    GNSS_VELOCITY_X,
    GNSS_VELOCITY_Y,
    GNSS_X,
    GNSS_Y,
    IMU_ACCELERATION_X,
    IMU_ACCELERATION_Y,
    IMU_YAW_RATE,
)
from adeye.spec.faults.base import Fault
from adeye.spec.sensors import model_name
from adeye.units import Dimension

if TYPE_CHECKING:
    from adeye.spec.misplaced import Loc
    from adeye.spec.sensors import SensorRecord

DELIVERS: Final[dict[str, tuple[str, ...]]] = {
    "camera": ("detections", "bearings", "classes"),
    "camera/physical": ("detections", "bearings", "classes", "pixels"),
    "radar": ("detections", "bearings", "classes", "range rates"),
    "radar/physical": ("detections", "bearings", "range rates"),
    "lidar": ("detections", "bearings", "classes"),
    "lidar/physical": ("points", "bearings"),
    "ultrasonic": ("detections",),
    "gnss": ("fixes",),
    "imu": ("motion",),
    "localisation": ("ego estimates",),
    "ground_truth": ("detections", "bearings", "classes", "range rates", "ego estimates"),
}
"""What the sensors of each model deliver."""

_OF_PLUGINS: Final = ("detections", "bearings", "classes", "range rates")
"""Every sensor has a list of detections; what else a plug-in has, is not known before it runs."""


def delivered(sensor: SensorRecord) -> tuple[str, ...]:
    """Return what a sensor delivers, and ``range`` if its reach is a parameter of it."""
    found = DELIVERS.get(model_name(sensor), _OF_PLUGINS)
    return (*found, "range") if hasattr(sensor, "range") else found


SignalName = Literal[
    "x",
    "y",
    "range",
    "bearing",
    "range_rate",
    "length",
    "width",
    "ego_x",
    "ego_y",
    "ego_heading",
    "ego_speed",
    "ego_acceleration",
    "ego_yaw_rate",
    "position_x",
    "position_y",
    "velocity_x",
    "velocity_y",
    "acceleration_x",
    "acceleration_y",
    "yaw_rate",
]


class Signal(NamedTuple):
    """A number that sensors measure.

    Attributes:
        needs: What a sensor delivers that has it, all of these, ...
        instead: ... or this.
        column: Of the detection, estimate or values; -1 for what is no column of a detection.
        dimension: What it measures.
    """

    needs: tuple[str, ...]
    column: int
    dimension: Dimension
    instead: str = ""


_SEEN, _OWN, _FIX, _MOTION = ("detections",), ("ego estimates",), ("fixes",), ("motion",)

SIGNALS: Final[dict[str, Signal]] = {
    "x": Signal(_SEEN, DETECTION_X, Dimension.LENGTH),
    "y": Signal(_SEEN, DETECTION_Y, Dimension.LENGTH),
    "range": Signal(_SEEN, -1, Dimension.LENGTH, instead="points"),
    "bearing": Signal((*_SEEN, "bearings"), -1, Dimension.ANGLE, instead="points"),
    "range_rate": Signal((*_SEEN, "range rates"), DETECTION_RANGE_RATE, Dimension.SPEED),
    "length": Signal(_SEEN, DETECTION_LENGTH, Dimension.LENGTH),
    "width": Signal(_SEEN, DETECTION_WIDTH, Dimension.LENGTH),
    "ego_x": Signal(_OWN, EGO_X, Dimension.LENGTH),
    "ego_y": Signal(_OWN, EGO_Y, Dimension.LENGTH),
    "ego_heading": Signal(_OWN, EGO_HEADING, Dimension.ANGLE),
    "ego_speed": Signal(_OWN, EGO_SPEED, Dimension.SPEED),
    "ego_acceleration": Signal(_OWN, EGO_ACCELERATION, Dimension.ACCELERATION),
    "ego_yaw_rate": Signal(_OWN, EGO_YAW_RATE, Dimension.ANGULAR_RATE),
    "position_x": Signal(_FIX, GNSS_X, Dimension.LENGTH),
    "position_y": Signal(_FIX, GNSS_Y, Dimension.LENGTH),
    "velocity_x": Signal(_FIX, GNSS_VELOCITY_X, Dimension.SPEED),
    "velocity_y": Signal(_FIX, GNSS_VELOCITY_Y, Dimension.SPEED),
    "acceleration_x": Signal(_MOTION, IMU_ACCELERATION_X, Dimension.ACCELERATION),
    "acceleration_y": Signal(_MOTION, IMU_ACCELERATION_Y, Dimension.ACCELERATION),
    "yaw_rate": Signal(_MOTION, IMU_YAW_RATE, Dimension.ANGULAR_RATE),
}
"""By name. x and y are in the vehicle frame, range and bearing about the sensor's place; what
begins with ``ego`` is of an ego estimate and, as positions and velocities are, in the map."""


def has_signal(name: str, sensor: SensorRecord) -> bool:
    """Tell whether a sensor measures a signal."""
    signal, found = SIGNALS[name], delivered(sensor)
    return all(need in found for need in signal.needs) or signal.instead in found


class SensorFault(Fault):
    """What faults of sensors have.

    Attributes:
        needs: What a sensor delivers that can have it: one of these; nothing for every sensor.
    """

    fits = ("sensors",)
    needs: ClassVar[tuple[str, ...]] = ()

    def misfits(self, sensor: SensorRecord) -> list[tuple[Loc, str]]:
        """Say what of the fault has no meaning for a sensor: where, and why.

        Args:
            sensor: Its target, as an architecture has it.
        """
        if not self.needs or set(self.needs) & set(delivered(sensor)):
            return []
        has = ", ".join(delivered(sensor))
        asked = " or ".join(self.needs)
        text = f"{self.model} is about {asked}, and a {model_name(sensor)} delivers {has}"
        return [(("model",), text)]


def signals_of(sensor: SensorRecord) -> list[str]:
    """List the signals that a sensor measures."""
    return [name for name in get_args(SignalName) if has_signal(name, sensor)]
