"""The faults of sensors: of their bodies, signals, objects and timing."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, Literal, NamedTuple

from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema

from adeye import signals
from adeye.signals import ObjectClass
from adeye.spec.document import Problem
from adeye.spec.fault_base import Fault
from adeye.spec.quantity import Angle, Duration, Length, Many, Number, Speed, quantity_reader
from adeye.spec.sensors import NonNegativeDuration, PhysicalCamera, Share, model_name
from adeye.units import Dimension

if TYPE_CHECKING:
    from adeye.spec.sensors import SensorRecord

# --- What sensors deliver, and so which faults have a meaning for them ----------------------------

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
    "x": Signal(_SEEN, signals.DETECTION_X, Dimension.LENGTH),
    "y": Signal(_SEEN, signals.DETECTION_Y, Dimension.LENGTH),
    "range": Signal(_SEEN, -1, Dimension.LENGTH, instead="points"),
    "bearing": Signal((*_SEEN, "bearings"), -1, Dimension.ANGLE, instead="points"),
    "range_rate": Signal((*_SEEN, "range rates"), signals.DETECTION_RANGE_RATE, Dimension.SPEED),
    "length": Signal(_SEEN, signals.DETECTION_LENGTH, Dimension.LENGTH),
    "width": Signal(_SEEN, signals.DETECTION_WIDTH, Dimension.LENGTH),
    "ego_x": Signal(_OWN, signals.EGO_X, Dimension.LENGTH),
    "ego_y": Signal(_OWN, signals.EGO_Y, Dimension.LENGTH),
    "ego_heading": Signal(_OWN, signals.EGO_HEADING, Dimension.ANGLE),
    "ego_speed": Signal(_OWN, signals.EGO_SPEED, Dimension.SPEED),
    "ego_acceleration": Signal(_OWN, signals.EGO_ACCELERATION, Dimension.ACCELERATION),
    "ego_yaw_rate": Signal(_OWN, signals.EGO_YAW_RATE, Dimension.ANGULAR_RATE),
    "position_x": Signal(_FIX, signals.GNSS_X, Dimension.LENGTH),
    "position_y": Signal(_FIX, signals.GNSS_Y, Dimension.LENGTH),
    "velocity_x": Signal(_FIX, signals.GNSS_VELOCITY_X, Dimension.SPEED),
    "velocity_y": Signal(_FIX, signals.GNSS_VELOCITY_Y, Dimension.SPEED),
    "acceleration_x": Signal(_MOTION, signals.IMU_ACCELERATION_X, Dimension.ACCELERATION),
    "acceleration_y": Signal(_MOTION, signals.IMU_ACCELERATION_Y, Dimension.ACCELERATION),
    "yaw_rate": Signal(_MOTION, signals.IMU_YAW_RATE, Dimension.ANGULAR_RATE),
}
"""By name. x and y are in the vehicle frame, range and bearing about the sensor's place; what
begins with ``ego`` is of an ego estimate and, as positions and velocities are, in the map."""

if TYPE_CHECKING:
    SignalName = str
else:
    SignalName = Literal[tuple(SIGNALS)]


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

    def misfits(self, sensor: SensorRecord) -> list[Problem]:
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
    return [name for name in SIGNALS if has_signal(name, sensor)]


# --- Faults of when samples come and of what they say about it ------------------------------------


class DropOut(SensorFault):
    """A sensor delivers nothing new."""

    silences = True
    model: Literal["drop_out"]


class PowerLoss(SensorFault):
    """A sensor delivers nothing, and once it has power again it takes a while to come up."""

    silences = True
    model: Literal["power_loss"]
    restart: NonNegativeDuration = 0.0
    """From the end of the fault to the first sample that counts again [s]."""


class Freeze(SensorFault):
    """What the newest sample said is said again and again, with new stamps: nobody can tell."""

    model: Literal["freeze"]


class Stale(SensorFault):
    """The newest sample stays; the sensor says that it is well, but the stamp stands still."""

    model: Literal["stale"]


class StaleStamp(SensorFault):
    """Samples are new, and their stamps are not."""

    model: Literal["stale_stamp"]


class ClockDrift(SensorFault):
    """The clock of the sensor is wrong, and so are the stamps."""

    neutral = ({"offset": 0.0, "rate": 0.0},)
    model: Literal["clock_drift"]
    offset: Duration = 0.0
    """What is added to every stamp [s]."""
    rate: Annotated[Number, Field(ge=-0.5, le=0.5)] = 0.0
    """What is added to it in each second since the onset [s]."""


class Delay(SensorFault):
    """Samples come later, with their own stamps; none overtakes another."""

    neutral = ({"by": 0.0, "jitter": 0.0},)
    model: Literal["delay"]
    by: NonNegativeDuration
    """How much later each comes [s]."""
    jitter: NonNegativeDuration = 0.0
    """And up to so much later again, drawn anew for each [s]."""


class SampleLoss(SensorFault):
    """Samples are lost, one by one or in bursts; the one before stays.

    With ``enter`` it is the channel of Gilbert (1960), with ``probability``, too, that of Elliott
    (1963): in each sample a burst may begin or end, and all samples in a burst are lost.
    """

    neutral = ({"probability": 0.0, "enter": 0.0},)
    model: Literal["sample_loss"]
    probability: Share = 0.0
    """Of a sample to be lost outside of bursts."""
    enter: Share = 0.0
    """Probability that a burst begins with a sample."""
    leave: Annotated[Number, Field(gt=0.0, le=1.0)] = 1.0
    """Probability that it is over with the next one; its mean length is 1 / leave samples."""


# --- Faults of the numbers that sensors measure; each is of one signal ----------------------------


def _in_its_unit(value: Any, info: ValidationInfo) -> float:
    """Read a quantity of whatever the signal measures, which stands before it."""
    signal = info.data.get("signal")
    # Without a signal the record is wrong anyway.
    return 0.0 if signal is None else quantity_reader(SIGNALS[signal].dimension)(value, info)


_Size = Annotated[
    float,
    BeforeValidator(_in_its_unit),
    WithJsonSchema({"type": ["string", "number"], "examples": ["1 m", "2 deg", "3 m/s"]}),
]
_LeastZero = Annotated[_Size, Field(ge=0.0)]


class SignalFault(SensorFault):
    """A fault of one of the numbers that a sensor measures."""

    STRUCTURE: ClassVar[tuple[str, ...]] = ("signal",)

    signal: SignalName

    def own_dimensions(self) -> dict[str, Dimension]:
        """Return what the fields that take their unit from the signal are of."""
        dimension = SIGNALS[self.signal].dimension
        names = type(self).model_fields.keys() & {"size", "value"}
        return dict.fromkeys(sorted(names), dimension)

    def misfits(self, sensor: SensorRecord) -> list[Problem]:
        """Say that a sensor does not measure the signal."""
        known = signals_of(sensor)
        if self.signal in known:
            return []
        has = f"measures {', '.join(known)}" if known else "measures none that can be disturbed"
        return [(("signal",), f"a {model_name(sensor)} {has}, and not {self.signal}")]


class Bias(SignalFault):
    """It is too large by the same amount."""

    neutral = ({"size": 0.0},)
    model: Literal["bias"]
    size: _Size


class Scale(SignalFault):
    """It is too large by the same factor."""

    neutral = ({"factor": 1.0},)
    model: Literal["scale"]
    factor: Number


class Drift(SignalFault):
    """It goes away, evenly since the first onset."""

    neutral = ({"size": 0.0},)
    model: Literal["drift"]
    size: _Size
    """How far it goes ..."""
    over: Annotated[Duration, Field(gt=0.0)]
    """... in this time [s]."""


class Noise(SignalFault):
    """White Gaussian noise of its own in every sample."""

    neutral = ({"size": 0.0},)
    model: Literal["noise"]
    size: _LeastZero
    """Standard deviation."""


class Quantise(SignalFault):
    """It comes in steps only: the nearest multiple."""

    neutral = ({"size": 0.0},)
    model: Literal["quantise"]
    size: _LeastZero
    """Of a step; with 0 there are none."""


class StuckAt(SignalFault):
    """It has one value whatever is there."""

    model: Literal["stuck_at"]
    value: _Size


class Spike(SignalFault):
    """It is too large by the same amount, in a few samples."""

    neutral = ({"size": 0.0}, {"probability": 0.0})
    model: Literal["spike"]
    size: _Size
    probability: Share
    """Of a sample to have it."""


class BitFlip(SignalFault):
    """A bit of the 64 of IEEE 754 is the wrong one; the result may be infinite or no number."""

    model: Literal["bit_flip"]
    bit: Annotated[int, Field(ge=0, le=63)]
    """0 is the least of the fraction, 52 the least of the exponent, 63 the sign."""


class Jump(SensorFault):
    """The place of the ego is another one, along the axes of the map, and so is its heading."""

    needs = ("ego estimates", "fixes")
    neutral = ({"x": 0.0, "y": 0.0, "heading": 0.0},)
    model: Literal["jump"]
    x: Length = 0.0
    y: Length = 0.0
    heading: Angle = 0.0

    def misfits(self, sensor: SensorRecord) -> list[Problem]:
        """Say that a sensor does not measure where the ego is, or not its heading."""
        found = super().misfits(sensor)
        if not found and self.heading != 0.0 and "ego estimates" not in delivered(sensor):
            found.append((("heading",), f"a {model_name(sensor)} does not measure the heading"))
        return found


# --- Faults of the list of objects that a sensor reports ------------------------------------------

Classes = Annotated[Many[ObjectClass], Field(min_length=1)]
Bearing = Annotated[Angle, Field(ge=-math.pi, le=math.pi)]


class _OfSome(SensorFault):
    """A fault of some of the objects: those for which all that is given holds."""

    STRUCTURE: ClassVar[tuple[str, ...]] = ("classes",)
    neutral = ({"probability": 0.0},)
    needs = ("detections",)

    probability: Share = 1.0
    """Of each object in each sample."""
    classes: Classes | None = None
    """Of the object itself, whatever the sensor takes it for; all unless given."""


class Miss(_OfSome):
    """Objects that are there are not reported."""

    model: Literal["miss"]
    beyond: Annotated[Length, Field(ge=0.0)] = 0.0
    """Only those farther from the sensor than this [m]."""
    right: Bearing = -math.pi
    """Only those from this bearing, counted at the sensor from the vehicle's x axis ..."""
    left: Bearing = math.pi
    """... on to the left, up to this one."""

    def misfits(self, sensor: SensorRecord) -> list[Problem]:
        """Say that a sensor does not measure bearings, if there is a sector."""
        found = super().misfits(sensor)
        is_sector = (self.right, self.left) != (-math.pi, math.pi)
        if not found and is_sector and "bearings" not in delivered(sensor):
            found.append((("left",), f"a {model_name(sensor)} does not measure bearings"))
        return found


class Ghost(SensorFault):
    """An object is reported that is not there.

    It appears at a place in the vehicle frame and from then on moves in the map, straight on along
    the heading that the ego had, as far as the ego's motion at the time tells.
    """

    STRUCTURE: ClassVar[tuple[str, ...]] = ("taken_for",)
    needs = ("detections",)
    model: Literal["ghost"]
    x: Length
    y: Length = 0.0
    speed: Speed = 0.0
    """Over ground [m/s]."""
    length: Annotated[Length, Field(ge=0.0)] = 4.5
    width: Annotated[Length, Field(ge=0.0)] = 1.8
    taken_for: ObjectClass = "car"


class Misclassify(_OfSome):
    """Objects are taken for some of another class."""

    STRUCTURE: ClassVar[tuple[str, ...]] = ("classes", "taken_for")
    needs = ("classes",)
    model: Literal["misclassify"]
    taken_for: ObjectClass


class Split(_OfSome):
    """An object is reported as two, side by side, each half as wide."""

    model: Literal["split"]


# --- Faults of a sensor's body: where it looks, how far, and through what -------------------------


class BlindSector(SensorFault):
    """Nothing is seen between two bearings: dirt, or something stands in front of it.

    Bearings are seen from the sensor and counted from the vehicle's x axis, left is positive.
    """

    needs = ("bearings",)
    model: Literal["blind_sector"]
    right: Bearing
    """Where it begins [rad]; from there it goes on to the left, through the rear if need be ..."""
    left: Bearing
    """... up to here. There is none if both are the same."""

    @property
    def nothing(self) -> str:
        """That the sector has no width; empty if it has one."""
        return "right and left the same" if self.right == self.left else ""


class RangeLoss(SensorFault):
    """Only what is nearer than a share of the specified range is seen."""

    needs = ("range",)
    neutral = ({"factor": 1.0},)
    model: Literal["range_loss"]
    factor: Share
    """Share of the range that is left; 1 takes nothing away."""


class Miscalibration(SensorFault):
    """The sensor is turned and shifted against what is known of its mount.

    What it reports lies by as much on the other side. What it can see is not changed: to study
    that, vary its mount.
    """

    needs = ("bearings",)
    neutral = ({"yaw": 0.0, "x": 0.0, "y": 0.0},)
    model: Literal["miscalibration"]
    yaw: Annotated[Angle, Field(ge=-math.pi, le=math.pi)] = 0.0
    """How far it is turned to the left [rad]; a whole turn is none."""
    x: Length = 0.0
    """How far ahead of its known place it is [m]."""
    y: Length = 0.0
    """How far to the left of it [m]."""


Pixel = Annotated[int, Field(ge=0, le=1024)]


class _OfPixels(SensorFault):
    """A rectangle of an image; column 0 is at the left, row 0 at the top."""

    needs = ("pixels",)
    column: Pixel = 0
    row: Pixel = 0
    columns: Pixel
    rows: Pixel

    def misfits(self, sensor: SensorRecord) -> list[Problem]:
        """Say that a sensor has no such pixels."""
        found = super().misfits(sensor)
        if isinstance(sensor, PhysicalCamera):
            size = f"the image is {sensor.columns} x {sensor.rows}"
            if self.column + self.columns > sensor.columns:
                found.append((("columns",), f"the last is beyond the right edge, {size}"))
            if self.row + self.rows > sensor.rows:
                found.append((("rows",), f"the last is beyond the lower edge, {size}"))
        return found


class DeadPixels(_OfPixels):
    """Pixels show nothing or, with some transmission, little: single ones, lines, a rectangle."""

    neutral = ({"columns": 0}, {"rows": 0}, {"transmission": 1.0})
    model: Literal["dead_pixels"]
    transmission: Share = 0.0
    """Share of the contrast that passes."""


class PixelNoise(_OfPixels):
    """The contrast of pixels is noisy."""

    neutral = ({"columns": 0}, {"rows": 0}, {"noise": 0.0})
    model: Literal["pixel_noise"]
    noise: Annotated[Number, Field(ge=0.0)]
    """Standard deviation of Gaussian noise on the contrast of each."""


class Blackout(SensorFault):
    """The whole image is dark."""

    needs = ("pixels",)
    neutral = ({"transmission": 1.0},)
    model: Literal["blackout"]
    transmission: Share = 0.0
    """Share of the contrast that passes."""
