"""The sensors that an architecture may name, by kind and fidelity.

A camera, radar or lidar comes in two fidelities. ``object`` reports boxes within range and field of
view that geometry leaves visible; it is cheap enough for millions of runs. ``physical`` makes what
the device makes (pixels, returns, signal strength) and detects objects in that.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Final, Literal

from pydantic import AfterValidator, BeforeValidator, Field, StringConstraints

from adeye.errors import suggest
from adeye.spec import quantity as q
from adeye.spec.document import Problem, finds
from adeye.spec.programs import FmuUse, VariableName
from adeye.units import Dimension, shown

PositiveLength = Annotated[q.Length, Field(gt=0.0)]
NonNegativeLength = Annotated[q.Length, Field(ge=0.0)]
PositiveDuration = Annotated[q.Duration, Field(gt=0.0)]
NonNegativeDuration = Annotated[q.Duration, Field(ge=0.0)]
PositiveFrequency = Annotated[q.Frequency, Field(gt=0.0)]
NonNegativeAngle = Annotated[q.Angle, Field(ge=0.0)]
PositiveAngle = Annotated[q.Angle, Field(gt=0.0)]
NonNegativeSpeed = Annotated[q.Speed, Field(ge=0.0)]
NonNegativeNumber = Annotated[q.Number, Field(ge=0.0)]
FieldOfView = Annotated[q.Angle, Field(gt=0.0, le=6.283185307179587)]
NarrowFieldOfView = Annotated[q.Angle, Field(gt=0.0, le=2.8)]
"""Of a camera with a flat image: below 160 degrees."""
Share = Annotated[q.Number, Field(ge=0.0, le=1.0)]

PluginPath = Annotated[str, StringConstraints(pattern=q.PLUGIN)]
"""An entry point: ``module:Class`` or ``./file.py:Class``."""


class Mount(q.Record):
    """Pose of a sensor in the vehicle frame: x forward, y left of the box centre, z up.

    Angles as in ISO 8855: yaw to the left is positive, then pitch with the nose down is positive.
    """

    x: q.Length = 0.0
    y: q.Length = 0.0
    z: q.Length = 0.0
    """Of physical cameras and lidars; the others are drawn in plan view and do not look at it."""
    yaw: q.Angle = 0.0
    """Of whatever looks in a direction: satellite receiver and inertial unit do not look at it."""
    pitch: Annotated[q.Angle, Field(ge=-1.0, le=1.0)] = 0.0
    """Of physical cameras and lidars; the others are drawn in plan view and do not look at it."""


class SensorRecord(q.Record):
    """What every sensor has."""

    STRUCTURE: ClassVar[tuple[str, ...]] = ()
    """Fields beside kind, rate, latency and jitter that shape its arrays: equal inside a batch."""

    rate: PositiveFrequency
    latency: NonNegativeDuration = 0.0
    jitter: NonNegativeDuration = 0.0
    """A sample comes up to this much later than its latency, drawn anew for each [s]."""
    realises: q.Identifier | None = None
    cost: NonNegativeNumber = 0.0
    text: str = ""


class _Ranging(SensorRecord):
    fidelity: Literal["object"] = "object"
    mount: Mount
    field_of_view: FieldOfView
    range: PositiveLength
    min_visible: Annotated[q.Number, Field(gt=0.0, le=1.0)] = 0.5
    """Smallest unoccluded share of an object's angular extent that is detected; never 0, with which
    it would see what is behind it or behind a truck."""


class Camera(_Ranging):
    """Object-level camera: bearing is sharp, distance error grows with the distance squared."""

    kind: Literal["camera"]
    bearing_noise: NonNegativeAngle = 0.0
    distance_noise: Share = 0.0
    """Standard deviation of the distance at full range, as a share of the range."""
    night_range: Share = 1.0
    """Share of the range that is left at night."""


class Radar(_Ranging):
    """Object-level radar: measures the range rate; rain does not shorten its range here."""

    kind: Literal["radar"]
    range_noise: NonNegativeLength = 0.0
    bearing_noise: NonNegativeAngle = 0.0
    range_rate_noise: NonNegativeSpeed = 0.0


class Lidar(_Ranging):
    """Object-level lidar: its range follows the rain and the target's reflectivity."""

    kind: Literal["lidar"]
    reference_reflectivity: Annotated[q.Number, Field(gt=0.0, le=1.0)] = 0.9
    """Reflectivity at which the clear-weather range is specified."""
    range_noise: NonNegativeLength = 0.0
    bearing_noise: NonNegativeAngle = 0.0


class Patch(q.Record):
    """A rectangle of an image, in pixels; column 0 is at the left, row 0 at the top."""

    column: Annotated[int, Field(ge=0)] = 0
    row: Annotated[int, Field(ge=0)] = 0
    columns: Annotated[int, Field(ge=0)]
    rows: Annotated[int, Field(ge=0)]
    transmission: Share = 0.0
    """Share of the contrast that passes: 0 for dead pixels, more for dirt."""
    noise: NonNegativeNumber = 0.0
    """Standard deviation of Gaussian noise on the contrast of its pixels."""


class RaisedMount(Mount):
    """Pose of a sensor that judges distance from its height above the ground."""

    z: PositiveLength


class PhysicalCamera(SensorRecord):
    """Camera with an image: boxes are projected onto pixels, nearest first, and detected there."""

    STRUCTURE: ClassVar[tuple[str, ...]] = ("columns", "rows", "patches")

    kind: Literal["camera"]
    fidelity: Literal["physical"]
    mount: RaisedMount
    field_of_view: NarrowFieldOfView
    """Horizontal; pixels are square."""
    columns: Annotated[int, Field(ge=8, le=1024)] = 160
    rows: Annotated[int, Field(ge=4, le=512)] = 60
    min_pixel_height: Annotated[int, Field(ge=1, le=64)] = 2
    """Least rows of an object that the detector accepts; more where its contrast is weak."""
    min_pixel_width: Annotated[int, Field(ge=1, le=64)] = 1
    """Least columns of an object that the detector accepts."""
    contrast_threshold: Annotated[q.Number, Field(gt=0.0, le=1.0)] = 0.05
    """Contrast from which a pixel shows its object by day."""
    noise: NonNegativeNumber = 0.0
    """Standard deviation of Gaussian noise on the contrast of every pixel."""
    transmission: Share = 1.0
    """Of the whole lens: 0 for a blackout."""
    headlamps: NonNegativeNumber = 20_000.0
    """Intensity of the ego's headlamps straight ahead [cd]; they are always on."""
    patches: q.ById[Patch] = {}

    @finds
    def _fits_the_image(self) -> Iterator[Problem]:
        if self.min_pixel_height > self.rows:
            text = f"an object never fills {self.min_pixel_height} of {self.rows} rows"
            yield ("min_pixel_height",), text
            return
        text = f"it lies outside of the image of {self.columns} x {self.rows}"
        for name, patch in self.patches.items():
            if patch.column >= self.columns or patch.row >= self.rows:
                yield ("patches", name), text


LOWEST_LIDAR: Final = 0.2
"""Least height of a lidar above the ground [m]; a bumper is higher."""


class PhysicalLidar(SensorRecord):
    """Lidar with beams: a return per beam that is strong enough, clustered by the perception."""

    STRUCTURE: ClassVar[tuple[str, ...]] = ("beams", "layers")

    kind: Literal["lidar"]
    fidelity: Literal["physical"]
    mount: Mount
    field_of_view: FieldOfView
    beams: Annotated[int, Field(ge=2, le=4096)] = 900
    """Per layer, evenly over the field of view."""
    layers: Annotated[int, Field(ge=1, le=64)] = 1
    vertical_field_of_view: Annotated[q.Angle, Field(ge=0.0, le=1.5)] = 0.0
    """From the lowest to the highest layer, about the mount's pitch."""
    range: PositiveLength
    """In clear air at the reference reflectivity [m]."""
    reference_reflectivity: Annotated[q.Number, Field(gt=0.0, le=1.0)] = 0.9
    range_noise: NonNegativeLength = 0.0
    bearing_noise: NonNegativeAngle = 0.0
    drop_out: Share = 0.0
    """Share of returns that are lost at random, on top of the weather."""
    cluster_distance: PositiveLength = 1.0
    """Neighbouring returns no further apart belong to one object; far away, two beams may be."""
    min_points: Annotated[int, Field(ge=1, le=1000)] = 2
    """Least returns of an object."""

    @finds
    def _can_make_an_object(self) -> Iterator[Problem]:
        if self.min_points > self.beams * self.layers:
            text = f"{self.beams} beams in {self.layers} layers never give {self.min_points} points"
            yield ("min_points",), text
        elif self.layers > 1 and self.vertical_field_of_view <= 0.0:
            text = f"{self.layers} layers need an angle between the lowest and the highest"
            yield ("vertical_field_of_view",), text

    @finds
    def _is_above_the_ground(self) -> Iterator[Problem]:
        if self.mount.z < LOWEST_LIDAR:
            text = (
                f"mount.z is {self.mount.z:g} m, but a lidar stands at least {LOWEST_LIDAR:g} m "
                "above the ground: what it sees below is taken for the ground"
            )
            yield (), text


MOST_CLUTTER: Final = 50.0
"""Of the mean number of false alarms in a sample, and of that of clutter."""


class PhysicalRadar(SensorRecord):
    """Radar that detects by signal strength in cells of range, angle and range rate."""

    STRUCTURE: ClassVar[tuple[str, ...]] = ()

    kind: Literal["radar"]
    fidelity: Literal["physical"]
    mount: Mount
    field_of_view: FieldOfView
    edge_loss: NonNegativeNumber = 3.0
    """What the antenna loses one way at the edge of the field of view [dB]; Gaussian in between."""
    range: PositiveLength
    """Where a target of the reference cross section is detected half of the time, straight ahead of
    the sensor in clear air [m]."""
    reference_cross_section: Annotated[q.Number, Field(gt=0.0)] = 10.0
    """Radar cross section at which the range is specified [m²]."""
    false_alarm_rate: Annotated[q.Number, Field(gt=0.0, lt=0.5)] = 1e-6
    """Probability that noise alone crosses the threshold in one cell of range and range rate."""
    range_resolution: PositiveLength = 0.5
    bearing_resolution: PositiveAngle = 0.03
    range_rate_resolution: Annotated[q.Speed, Field(gt=0.0)] = 0.2
    max_range_rate: Annotated[q.Speed, Field(gt=0.0)] = 80.0
    """Greater ones are folded into the span from minus this to this: they are ambiguous."""
    elevation_beam: Annotated[q.Angle, Field(gt=0.0, le=1.5)] = 0.17
    """Vertical width of the beam [rad], which decides how much rain is in a cell."""
    clutter: Annotated[q.Number, Field(ge=0.0, le=MOST_CLUTTER)] = 0.2
    """Mean number of detections of standing things at the roadside in a sample."""

    @property
    def cells(self) -> float:
        """Number of cells of range and range rate in which noise may cross the threshold."""
        ranges: float = self.range / self.range_resolution
        rates: float = 2.0 * self.max_range_rate / self.range_rate_resolution
        return max(1.0, ranges) * max(1.0, rates)

    @finds
    def _false_alarms_are_few(self) -> Iterator[Problem]:
        alarms = self.false_alarm_rate * self.cells
        if alarms > MOST_CLUTTER:
            text = (
                f"{self.false_alarm_rate:g} in each of {self.cells:.0f} cells makes {alarms:.0f} "
                f"false alarms a sample, at most {MOST_CLUTTER:.0f} are allowed; lower it or make "
                "the cells of range and range rate larger"
            )
            yield ("false_alarm_rate",), text


class Ultrasonic(SensorRecord):
    """Ultrasonic sensor: the nearest echo in its cone, beyond a blind zone; bearing is unknown."""

    kind: Literal["ultrasonic"]
    mount: Mount
    field_of_view: NarrowFieldOfView
    range: PositiveLength
    blind_zone: NonNegativeLength = 0.2
    """Nearer echoes are lost while the membrane still rings [m]."""
    range_noise: NonNegativeLength = 0.0
    cross_talk: bool = False
    """Whether it also hears the echoes of the other ultrasonic sensors that fire with it."""

    @finds
    def _hears_beyond_its_blind_zone(self) -> Iterator[Problem]:
        if self.blind_zone >= self.range:
            yield ("blind_zone",), f"nothing is left of the range of {self.range:g} m"


class Outage(q.Record):
    """When a receiver has no fix: a tunnel, a street canyon. Its samples go on, without values."""

    begin: NonNegativeDuration
    duration: NonNegativeDuration


class Gnss(SensorRecord):
    """Satellite receiver: place and velocity over ground of its antenna."""

    STRUCTURE: ClassVar[tuple[str, ...]] = ("outages",)

    kind: Literal["gnss"]
    mount: Mount = Mount()
    position_noise: NonNegativeLength = 0.0
    """White, in each axis [m]."""
    bias: NonNegativeLength = 0.0
    """Standard deviation of the slowly changing bias, in each axis [m]."""
    bias_time: PositiveDuration = 100.0
    """Correlation time of the bias [s]."""
    speed_noise: NonNegativeSpeed = 0.0
    """White, of each component of the velocity [m/s]."""
    outages: q.ById[Outage] = {}


class Imu(SensorRecord):
    """Inertial measurement unit: longitudinal and lateral acceleration of its place, yaw rate."""

    kind: Literal["imu"]
    mount: Mount = Mount()
    acceleration_noise: Annotated[q.Acceleration, Field(ge=0.0)] = 0.0
    """White, of a sample [m/s²]."""
    acceleration_bias: Annotated[q.Acceleration, Field(ge=0.0)] = 0.0
    """Standard deviation of the slowly changing bias [m/s²]."""
    yaw_rate_noise: Annotated[q.AngularRate, Field(ge=0.0)] = 0.0
    """White, of a sample [rad/s]."""
    yaw_rate_bias: Annotated[q.AngularRate, Field(ge=0.0)] = 0.0
    """Standard deviation of the slowly changing bias [rad/s]."""
    bias_time: PositiveDuration = 100.0
    """Correlation time of both biases [s]."""


class Localisation(SensorRecord):
    """Ego pose in the map and the vehicle's own motion sensors."""

    kind: Literal["localisation"]
    lateral_noise: NonNegativeLength = 0.0
    heading_noise: NonNegativeAngle = 0.0
    speed_noise: NonNegativeSpeed = 0.0


class GroundTruth(SensorRecord):
    """The scene as it is: every object and the ego's own state, without error."""

    kind: Literal["ground_truth"]


SENSED_OBJECT: Final[Mapping[str, Dimension]] = {
    "present": Dimension.NONE,
    "x": Dimension.LENGTH,
    "y": Dimension.LENGTH,
    "vx": Dimension.SPEED,
    "vy": Dimension.SPEED,
    "heading": Dimension.ANGLE,
    "length": Dimension.LENGTH,
    "width": Dimension.LENGTH,
    "height": Dimension.LENGTH,
    "class": Dimension.NONE,
}
"""What the FMU of a sensor is told of each of the objects nearest to it, in that order: place,
velocity and heading against the sensor, in its frame."""

MOST_SENSED: Final = 16
"""How many objects the FMU of a sensor can be told of, and detect."""

SENSED: Final[Mapping[str, Dimension]] = {
    "time": Dimension.TIME,
    "ego.speed": Dimension.SPEED,
    "ego.acceleration": Dimension.ACCELERATION,
    "ego.yaw_rate": Dimension.ANGULAR_RATE,
    "environment.rain": Dimension.RAIN_RATE,
    "environment.fog_visibility": Dimension.LENGTH,
    "environment.illuminance": Dimension.NONE,
    **{
        f"objects.{number}.{name}": dimension
        for number in range(1, MOST_SENSED + 1)
        for name, dimension in SENSED_OBJECT.items()
    },
}
"""What the FMU of a sensor can be told, and what each signal measures."""


def _require_sensed(text: str) -> str:
    if text not in SENSED:
        raise ValueError(f"there is no signal {shown(text)}. {suggest(text, SENSED)}")
    return text


SensedSignal = Annotated[str, AfterValidator(_require_sensed)]


class FmuDetection(q.SparseRecord):
    """Which outputs of an FMU are one of the detections of its sensor."""

    present: VariableName
    """Whether it is there: above 0.5."""
    x: VariableName
    """In the frame of the sensor [m]."""
    y: VariableName
    range_rate: VariableName | None = None
    """[m/s]; where it is left out, none is measured."""
    length: VariableName | None = None
    """[m]; where it is left out, the depth is unknown."""
    width: VariableName | None = None
    object: VariableName | None = None
    """Number of the object, as it was told, that is behind the detection, 0 for none; where it is
    left out, that of the detection in its list. Channels never see it."""


class FmuSensor(FmuUse, SensorRecord):
    """A sensor that an FMU is: told of the objects around it, it gives detections."""

    STRUCTURE: ClassVar[tuple[str, ...]] = ("slots",)

    kind: Literal["fmu"]
    mount: Mount = Mount()
    inputs: Annotated[dict[VariableName, SensedSignal], Field(min_length=1)]
    """Which signal each input variable gets; it is converted to the unit that the variable has."""
    detections: Annotated[q.Many[FmuDetection], Field(min_length=1, max_length=MOST_SENSED)]
    seed: VariableName | None = None
    """Parameter that gets a whole number below 2^31, another one in each run, for its noise."""

    @property
    def slots(self) -> int:
        """Number of detections that it may give."""
        return len(self.detections)


class PluginSensor(SensorRecord):
    """A sensor from outside the package."""

    kind: PluginPath
    mount: Mount = Mount()
    parameters: q.Free = {}


FIDELITIES: Final = ("camera", "radar", "lidar")
"""Kinds that come in several fidelities."""


def _with_fidelity(value: Any) -> Any:
    """Write out the fidelity that a record without one means, which chooses its model."""
    if isinstance(value, Mapping) and value.get("kind") in FIDELITIES and "fidelity" not in value:
        return {**value, "fidelity": "object"}
    return value


BuiltInSensor = Annotated[
    Annotated[Camera | PhysicalCamera, Field(discriminator="fidelity")]
    | Annotated[Radar | PhysicalRadar, Field(discriminator="fidelity")]
    | Annotated[Lidar | PhysicalLidar, Field(discriminator="fidelity")]
    | Ultrasonic
    | Gnss
    | Imu
    | Localisation
    | GroundTruth
    | FmuSensor,
    Field(discriminator="kind"),
    BeforeValidator(_with_fidelity),
]
Sensor = BuiltInSensor | PluginSensor


def model_name(sensor: SensorRecord) -> str:
    """Name what makes a sensor's samples: its kind, with the fidelity unless it is ``object``."""
    kind: str = getattr(sensor, "kind", "")
    fidelity = getattr(sensor, "fidelity", "object")
    return kind if fidelity == "object" else f"{kind}/{fidelity}"
