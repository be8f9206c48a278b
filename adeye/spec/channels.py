"""The channels that an architecture may name, with their parameters.

``reference:cc`` in an ODD stands for such an architecture, where others have the name of a file;
``reference:reg157@eu-2022-1426`` has an edition, ``reference:cc+jrc-coasting`` a variant.
"""

from __future__ import annotations

import ipaddress
import math
import re
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Final, Literal, NamedTuple, get_args

from pydantic import AfterValidator, Field, StringConstraints

from adeye.errors import SourceLocation, SpecError, suggest
from adeye.identity import canonical
from adeye.spec import quantity as q
from adeye.spec.document import Problem, finds
from adeye.spec.programs import (
    LEAD_SIGNALS,
    NEAREST,
    OBJECT_SIGNALS,
    Deadlines,
    FmuUse,
    ProgramParameters,
    VariableName,
)
from adeye.spec.sensors import (
    NonNegativeDuration,
    NonNegativeLength,
    PluginPath,
    PositiveFrequency,
    PositiveLength,
)
from adeye.spec.supervisor import OF_OBJECTS, PositiveAcceleration, Supervisor
from adeye.units import Dimension, shown

# --- A reference driver as an architecture: ground truth, one channel and the vehicle of another --

ReferenceVariant = Literal[
    "jrc",
    "jrc-guard",
    "jrc-lateral",
    "jrc-release",
    "jrc-raw-acceleration",
    "jrc-ttc-end",
    "jrc-coasting",
    "jrc-first-step",
    "jrc-perception",
    "jrc-no-emergency",
    "jrc-rss-lateral",
    "jrc-beside",
    "jrc-lead",
    "jrc-distance",
    "esmini",
    "esmini-gravity",
    "esmini-reaction",
    "esmini-perception",
]


class ReferenceParameters(q.Record):
    """Reference channel: which driver of UN R157 drives, and how it drives without a conflict."""

    model: Literal["cc", "fsm", "rss", "reg157"] = "cc"
    """Careful and competent driver, fuzzy safety model, responsibility-sensitive safety, or the
    cut-in rule of paragraph 5.2.5.2 made a driver."""
    edition: Literal["r157", "r157-01", "eu-2022-1426", "eu-2022-1426-standing"] = "r157-01"
    """Whose numbers hold; it changes ``reg157`` only."""
    variant: q.Many[ReferenceVariant] = ()
    """Differences of published code to the text, by name; ``jrc`` and ``esmini`` are all of one."""
    standstill_gap: PositiveLength = 2.0
    max_acceleration: PositiveAcceleration = 1.5
    comfort_deceleration: PositiveAcceleration = 2.5
    """Most that it slows down by to follow a vehicle that the model sees no conflict with."""


PREFIX: Final = "reference:"
MODELS: Final[tuple[str, ...]] = get_args(ReferenceParameters.model_fields["model"].annotation)
EDITIONS: Final[tuple[str, ...]] = get_args(ReferenceParameters.model_fields["edition"].annotation)
VARIANTS: Final[tuple[str, ...]] = get_args(ReferenceVariant)

_SENSOR, _CHANNEL = "truth", "driver"


class ReferenceName(NamedTuple):
    """What a name of a reference driver says.

    >>> ReferenceName("reg157", "eu-2022-1426", ("jrc-guard",)).architecture
    'reference_reg157_eu_2022_1426_jrc_guard'
    >>> ReferenceName("cc").architecture
    'reference_cc'
    """

    model: str
    edition: str = ReferenceParameters().edition
    variant: tuple[str, ...] = ()

    @property
    def architecture(self) -> str:
        """Id of the architecture; the usual edition is not part of it."""
        other = [self.edition] if self.edition != ReferenceParameters().edition else []
        return "_".join(["reference", self.model, *other, *self.variant]).replace("-", "_")


def read_name(text: str, where: SourceLocation) -> ReferenceName | None:
    """Read the name of a reference driver.

    Args:
        text: ``reference:MODEL``, with ``@EDITION`` and any number of ``+VARIANT`` if wanted.
        where: Its place.

    Returns:
        None for what does not begin with ``reference:``.

    Raises:
        SpecError: There is no such model, edition or variant, or a variant is named twice.
    """
    if not text.startswith(PREFIX):
        return None
    head, *variant = text.removeprefix(PREFIX).split("+")
    model, _, edition = head.partition("@")
    if "@" not in head:
        edition = ReferenceParameters().edition
    for what, name, known in (
        ("reference driver", model, MODELS),
        ("edition", edition, EDITIONS),
        *(("variant", name, VARIANTS) for name in variant),
    ):
        if name not in known:
            near = suggest(name, known)
            listed = f"Take one of {', '.join(known)}."
            remedy = f"{near} {listed}" if near.endswith("?") else listed
            raise SpecError(f"{text!r}: there is no {what} {name!r}", where=where, remedy=remedy)
    if len(set(variant)) < len(variant):
        raise SpecError(
            f"{text!r} names a variant twice", where=where, remedy="Name each variant once."
        )
    return ReferenceName(model, edition, tuple(variant))


def reference_content(
    name: ReferenceName, vehicle: Mapping[str, Any], rate: float | str, no_lag: float | str
) -> dict[str, Any]:
    """Make the content of the architecture that a reference driver is.

    The models' delays and ramps are those of driver and brakes together, so that the brakes answer
    at once: a lag of the vehicle would count twice.

    Args:
        name: Which driver.
        vehicle: Content of the vehicle that it drives.
        rate: Of sensor and driver, that of the master clock: it looks at every tick.
        no_lag: A duration of nothing, written as in ``vehicle``.
    """
    parameters: dict[str, Any] = {"model": name.model, "edition": name.edition}
    if name.variant:
        parameters["variant"] = list(name.variant)
    of = " with ".join([name.edition, *([", ".join(name.variant)] if name.variant else [])])
    return {
        "architecture": name.architecture,
        "title": f"Reference driver {name.model} of {of}",
        "vehicle": {**vehicle, "acceleration_lag": no_lag},
        "sensors": {_SENSOR: {"kind": "ground_truth", "rate": rate}},
        "channels": {
            _CHANNEL: {
                "kind": "reference",
                "links": [_SENSOR],
                "rate": rate,
                "parameters": parameters,
            }
        },
        "switch": {"policy": "fixed_priority", "priority": [_CHANNEL], "default": _CHANNEL},
    }


# --- The channels that an architecture may name, with their parameters ----------------------------

FilePath = Annotated[str, StringConstraints(min_length=1, max_length=1000)]
_Nfc: Final = AfterValidator(canonical)
CommandWord = Annotated[
    str,
    StringConstraints(max_length=4096, pattern="^[^\\x00]*$"),
    # A file has the name that it has, which is identified as such.
    AfterValidator(lambda word: word if word.startswith("./") else canonical(word)),
]


class _Channel(q.Record):
    links: q.Many[str] = ()
    """What it receives: sensor ids, ``channels.<id>`` and ``switch``."""
    rate: PositiveFrequency = 20.0
    delay: NonNegativeDuration = 0.0
    """Compute time: its command acts this long after the observation [s]."""
    realises: q.Identifier | None = None
    cost: Annotated[q.Number, Field(ge=0.0)] = 0.0
    text: str = ""


class TrackingParameters(q.Record):
    """How a channel makes tracks of detections."""

    confirm_hits: Annotated[int, Field(ge=1, le=10)] = 3
    """Detections that confirm a track: what has fewer is not reacted to."""
    confirm_window: Annotated[int, Field(ge=0, le=30)] = 0
    """Samples among which these detections must be, of the sensor that began the track; 0 for any
    number. A track that is not confirmed is forgotten after 0.25 s without a detection anyway."""
    coast: NonNegativeDuration = 0.5
    """How long a confirmed track lives without a detection [s]."""
    gate: PositiveLength = 4.0

    @finds
    def _window_has_room(self) -> Iterator[Problem]:
        if 0 < self.confirm_window < self.confirm_hits:
            text = (
                f"{self.confirm_hits} detections never come in {self.confirm_window} samples; "
                "at least as many samples are needed, or 0 for any number"
            )
            yield ("confirm_window",), text


class NominalParameters(TrackingParameters, q.GrownRecord):
    """Nominal channel: tracking, car following, lane keeping and emergency braking."""

    later: ClassVar[tuple[str, ...]] = ("rear_sight",)

    time_gap: Annotated[q.Duration, Field(gt=0.0)] = 1.8
    standstill_gap: PositiveLength = 4.0
    max_acceleration: PositiveAcceleration = 1.5
    comfort_deceleration: PositiveAcceleration = 2.5
    emergency_deceleration: PositiveAcceleration = 8.0
    emergency_threshold: PositiveAcceleration = 3.5
    """Required deceleration from which it brakes with the emergency deceleration."""
    lateral_margin: NonNegativeLength = 0.3
    """How much nearer than touching an object's side must come to count as in the path [m]."""
    rear_sight: NonNegativeLength = 0.0
    """How far behind the ego its sensors see the lanes beside it [m]; at 0 it enters none, and
    stands where its own ends."""


Weight = Annotated[q.Number, Field(ge=0.0)]


class TrajectoryParameters(TrackingParameters):
    """Trajectory channel: prediction, a fan of candidate trajectories, the least cost, control."""

    horizon: Annotated[q.Duration, Field(ge=1.0, le=8.0)] = 4.0
    """How far ahead it looks [s]."""
    time_gap: Annotated[q.Duration, Field(gt=0.0)] = 1.8
    standstill_gap: PositiveLength = 4.0
    max_acceleration: PositiveAcceleration = 1.5
    comfort_deceleration: PositiveAcceleration = 2.5
    emergency_deceleration: PositiveAcceleration = 8.0
    max_lateral_acceleration: PositiveAcceleration = 5.0
    """With the emergency deceleration, the ellipse of what the tyres are taken to hold."""
    max_jerk: Annotated[q.Jerk, Field(gt=0.0)] = 25.0
    """How quickly the commanded acceleration changes at most [m/s³]."""
    lateral_margin: NonNegativeLength = 0.3
    """Distance from an object below which a trajectory counts as too near [m]."""
    uncertainty_growth: Annotated[q.Speed, Field(ge=0.0)] = 0.1
    """How fast that distance grows with the time of the prediction [m/s]."""
    lane_change_time: Annotated[q.Duration, Field(gt=0.0)] = 4.0
    """Of a lane change without haste [s]."""
    nudge: q.Length = Field(default=0.4, ge=0.0, le=2.0)
    """How far beside the centre of the lane it may drive [m]."""
    rear_sight: NonNegativeLength = 0.0
    """How far behind the ego its sensors see the lanes beside it [m]; at 0 it never enters one."""
    follower_deceleration: PositiveAcceleration = 3.0
    """Deceleration that a lane change may ask of who comes from behind."""
    weight_collision: Weight = 1000.0
    weight_headway: Weight = 32.0
    weight_progress: Weight = 0.1
    weight_comfort: Weight = 1.0
    weight_jerk: Weight = 0.3
    weight_offset: Weight = 10.0
    """Of the distance from the centre of the lane, squared [1/m²]."""
    weight_lane_change: Weight = 60.0
    """Of leaving the lane; at the default only to avoid a collision, at 2 also to overtake."""
    weight_shoulder: Weight = 80.0
    """Of being on the shoulder."""
    weight_change: Weight = 0.5
    """Of another choice than before."""


class PolicyParameters(TrackingParameters):
    """Policy channel: what a policy from outside observes and how it is asked."""

    policy: PluginPath
    """A callable or an object with ``predict``: ``./file.py:name`` or ``module:name``."""
    observation: Literal["kinematics", "kinematics_flat"] = "kinematics"
    nearest: Annotated[int, Field(ge=1, le=8)] = 8
    """How many objects it observes, the nearest ones."""
    normalised: bool = True
    """Whether observation and action are numbers from -1 to 1, not in SI units."""


class ProcessParameters(ProgramParameters):
    """Process channel: a program, what it is told, and when it is stopped."""

    command: Annotated[q.Many[CommandWord], Field(min_length=1)]
    """The program and its arguments. Words that begin with ``./`` are files of the project,
    relative to this file, and part of a result's identity; any other program is found on the
    PATH."""
    values: q.Free = {}
    """What the program is told about how to drive, as identified: keys sorted, text in NFC."""


TCP: Final = r"^tcp://(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+):([0-9]{1,5})$"
UNPROTECTED: Final = "unprotected"
"""Word that a channel on another host needs."""


class Place(NamedTuple):
    """Where a channel on a host answers.

    >>> Place.read("tcp://[::1]:7000"), Place.read("tcp://bench.local:7000").is_here
    (Place(host='::1', port=7000), False)
    """

    host: str
    port: int

    @classmethod
    def read(cls, address: str) -> Place:
        """Read an address.

        Raises:
            ValueError: It is none.
        """
        found = re.fullmatch(TCP, address)
        if found is None or not 0 < int(found[2]) < 2**16:
            raise ValueError(f"{shown(address)} is no address like tcp://127.0.0.1:7000")
        return cls(found[1].strip("[]"), int(found[2]))

    @property
    def is_here(self) -> bool:
        """Whether it is at the loop-back interface, whatever names are resolved to."""
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return self.host == "localhost"


def _require_place(text: str) -> str:
    Place.read(text)
    return text


class RemoteParameters(Deadlines):
    """Remote channel: where it answers, what it says that it is, and when it is given up."""

    address: Annotated[str, AfterValidator(_require_place)]
    """``tcp://HOST:PORT``: what listens there gets a connection for each run."""
    version: Annotated[
        str,
        StringConstraints(pattern=q.LINE, max_length=200),
        _Nfc,
        # Classes of characters are not in every dialect that reads a schema.
        Field(json_schema_extra={"pattern": r"\S"}),
    ]
    """What it must say that it is in its first line. It stands in a result's identity for the
    content that nobody here can read."""
    network: Literal["loopback", "unprotected"] = "loopback"
    """Other addresses than those of the loop-back interface take ``unprotected``: whoever is on the
    way can read, alter and give answers."""
    values: q.Free = {}
    """What it is told about how to drive, as identified: keys sorted, text in NFC."""

    @property
    def place(self) -> Place:
        """Its address."""
        return Place.read(self.address)

    @finds
    def _is_meant(self) -> Iterator[Problem]:
        if self.network != UNPROTECTED and not self.place.is_here:
            text = (
                f"{self.address} is not on this machine, and nothing protects the way there: "
                "whoever is on it can read, alter and give answers. Write network: unprotected, "
                "or lead a tunnel, such as that of ssh -L, to an address on this machine"
            )
            yield ("address",), text


Topic = Literal[
    "tf", "odom", "objects", "imu", "fix", "points", "adeye/observation", "clock", "ackermann_cmd"
]
TopicName = Annotated[
    str, StringConstraints(pattern="^[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*$")
]


class NodeParameters(ProcessParameters):
    """A program that is a node of a middleware."""

    start_deadline: Annotated[q.Duration, Field(gt=0.0)] = 60.0
    """Longest until it is connected, and to its first answer, by the wall clock [s]: the nodes of a
    block begin all at once."""


class RosParameters(NodeParameters):
    """ROS channel: a program that is a node, and what its topics are called."""

    topics: dict[Topic, TopicName] = {}
    """Names of topics that it calls otherwise, without the slash at the beginning."""


EGO_SIGNALS: Final[Mapping[str, Dimension]] = {
    "speed": Dimension.SPEED,
    "acceleration": Dimension.ACCELERATION,
    "yaw_rate": Dimension.ANGULAR_RATE,
    "heading": Dimension.ANGLE,
    "lane_offset": Dimension.LENGTH,
    "to_right_edge": Dimension.LENGTH,
    "to_left_edge": Dimension.LENGTH,
    "curvature": Dimension.CURVATURE,
    "desired_speed": Dimension.SPEED,
}
"""What a channel knows of the ego, in the order in which policies observe it."""

SIGNALS: Final[Mapping[str, Dimension]] = {
    "time": Dimension.TIME,
    **{f"ego.{name}": dimension for name, dimension in EGO_SIGNALS.items()},
    **{f"lead.{name}": dimension for name, dimension in LEAD_SIGNALS.items()},
    **{
        f"objects.{number}.{name}": dimension
        for number in range(1, NEAREST + 1)
        for name, dimension in OBJECT_SIGNALS.items()
    },
}
"""What an FMU can be told, and what each signal measures."""


def _require_signal(text: str) -> str:
    if text not in SIGNALS:
        raise ValueError(f"there is no signal {shown(text)}. {suggest(text, SIGNALS)}")
    return text


FmuSignal = Annotated[str, AfterValidator(_require_signal)]


class FmuCommand(q.SparseRecord):
    """Which variables of an FMU are the command of its channel."""

    acceleration: VariableName
    """[m/s²]"""
    steering_angle: VariableName
    """Of the front wheels, to the left [rad]."""


class FmuParameters(TrackingParameters, FmuUse):
    """FMU channel: what it is told and which of its variables are the command."""

    inputs: Annotated[dict[VariableName, FmuSignal], Field(min_length=1)]
    """Which signal each input variable gets; it is converted to the unit that the variable has."""
    outputs: FmuCommand
    master: Literal["jacobi", "gauss_seidel"] = "jacobi"
    """With ``jacobi`` the step to the present tick was done with the inputs of the tick before;
    with ``gauss_seidel`` the inputs of the present one are set before it is done."""


Rating = Annotated[int, Field(ge=0, le=8)]


class StopRatings(q.GrownRecord):
    """How safe each kind of place is to stand in, from 0 for a refuge to 8 for contact.

    The worst cell under the ego counts. Sight ends at the inner edge of the road: where who comes
    from behind at the speed limit cannot stop within it, a lane is rated as a curve.
    """

    later: ClassVar[tuple[str, ...]] = ("refuge", "verge")

    refuge: Rating = 0
    """Parking bay or rest area."""
    hard_shoulder: Rating = 1
    verge: Rating = 2
    """Free ground beside the shoulder, where the map says that it carries a vehicle."""
    slow_lane_in_sight: Rating = 3
    """The rightmost lane, where one need not brake hard to stop within the sight distance."""
    slow_lane: Rating = 4
    fast_lane: Rating = 5
    curve: Rating = 6
    off_road: Rating = 7
    """Beside lanes and shoulder, where the map does not say what the ground is."""


OF_PLANNED_STOP: Final = ("stop", "rear_sight", "ratings")
"""Parameters of the safety channel that only a planned stop reads."""

BESIDE_NUMBERS: Final = (*OF_PLANNED_STOP, "supervisor")
"""Parameters of the safety channel that are not among the numbers of its compiled step, and no part
of the identity where they are left out."""


class SafetyParameters(q.GrownRecord):
    """Safety channel: monitors with debounce and a safe stop."""

    later: ClassVar[tuple[str, ...]] = BESIDE_NUMBERS

    staleness: Annotated[q.Duration, Field(gt=0.0)] = 0.2
    confirm: NonNegativeDuration = 0.1
    """How long a monitor must hold before it is confirmed [s]."""
    heal: NonNegativeDuration = 1.0
    stop_deceleration: PositiveAcceleration = 4.0
    """Deceleration of the minimal-risk stop [m/s²]."""
    emergency_deceleration: PositiveAcceleration = 8.0
    danger_threshold: PositiveAcceleration = 4.5
    """Required deceleration from which an object ahead is a danger [m/s²]."""
    max_command: PositiveAcceleration = 10.0
    max_lane_offset: PositiveLength = 1.0
    lateral_margin: NonNegativeLength = 0.2
    stop: Literal["in_lane", "planned"] = "in_lane"
    """Whether it stops in its lane, or chooses where and how hard among many stops; then the
    monitor ``last_safe_stop`` asks whether one would still be there at the next tick."""
    rear_sight: NonNegativeLength = 0.0
    """How far behind the ego its sensors see the lanes beside it [m]; at 0 a planned stop enters or
    crosses none."""
    ratings: StopRatings = StopRatings()
    """Which places a planned stop prefers."""
    supervisor: Supervisor | None = None
    """Monitors of its own choice, with counters and levels, instead of the built-in four; then
    ``staleness``, ``confirm``, ``heal``, ``danger_threshold`` and ``max_command`` are not read."""

    @finds
    def _has_stops_to_ask_for(self) -> Iterator[Problem]:
        if self.supervisor is not None and self.stop != "planned":
            for name, monitor in self.supervisor.monitors.items():
                if monitor.kind == "last_safe_stop":
                    text = f"{name!r} asks for the last safe stop, which takes stop: planned"
                    yield ("supervisor", "monitors", name, "kind"), text


class NominalChannel(_Channel):
    """The built-in nominal channel."""

    kind: Literal["nominal"]
    parameters: NominalParameters = NominalParameters()


class SafetyChannel(_Channel):
    """The built-in safety channel."""

    kind: Literal["safety"]
    parameters: SafetyParameters = SafetyParameters()

    STRUCTURE: ClassVar[tuple[str, ...]] = ("stop", "monitors")

    @property
    def stop(self) -> str:
        """How it stops: with a planner it has one monitor more."""
        return self.parameters.stop

    @property
    def monitors(self) -> list[list[Any]] | None:
        """Name, kind and what it watches of each monitor of a supervisor; None without one."""
        supervisor = self.parameters.supervisor
        if supervisor is None:
            return None
        return [
            [name, monitor.kind, list(getattr(monitor, "watches", ()))]
            for name, monitor in supervisor.monitors.items()
        ]

    @property
    def object_monitors(self) -> tuple[str, ...]:
        """Names of the monitors that only objects, or what is taken for one, make fire."""
        own = self.monitors or [["object_danger", "object_danger"]]
        return tuple(name for name, kind, *_ in own if kind in OF_OBJECTS)

    @finds
    def _rates_fit(self) -> Iterator[Problem]:
        supervisor = self.parameters.supervisor
        if supervisor is None:
            return
        count = self.rate / supervisor.rate
        if round(count) < 1 or abs(count - round(count)) > 1e-6 * count:
            low = max(1, math.floor(count))
            rates = sorted({self.rate / low, self.rate / (low + 1)})
            nearest = " and ".join(f"{rate:g} Hz" for rate in rates)
            text = (
                f"{supervisor.rate:g} Hz does not divide the channel's {self.rate:g} Hz; the "
                f"nearest that do are {nearest}"
            )
            yield ("parameters", "supervisor", "rate"), text


class TrajectoryChannel(_Channel):
    """The built-in channel that predicts and plans."""

    kind: Literal["trajectory"]
    parameters: TrajectoryParameters = TrajectoryParameters()


class ReferenceChannel(_Channel):
    """The built-in channel that drives as a reference driver of UN R157, on ground truth."""

    kind: Literal["reference"]
    parameters: ReferenceParameters = ReferenceParameters()


class _OutsideChannel(_Channel):
    """A channel with code from outside the package, and what that reads."""

    files: q.Many[FilePath] = ()
    """Files that its code reads, such as weights of a network: paths relative to this file, in its
    folder or below. Their content is part of a result's identity, as the code is."""


class PolicyChannel(_OutsideChannel):
    """The built-in channel that asks a policy from outside the package."""

    kind: Literal["policy"]
    parameters: PolicyParameters


class ProcessChannel(_OutsideChannel):
    """The built-in channel that asks a program of any language, over pipes."""

    kind: Literal["process"]
    parameters: ProcessParameters


class ZenohChannel(_OutsideChannel):
    """The built-in channel that asks a node over zenoh."""

    kind: Literal["zenoh"]
    parameters: NodeParameters


class RosChannel(_OutsideChannel):
    """The built-in channel that asks a node of ROS 1, or of ROS 2 over Cyclone DDS."""

    kind: Literal["ros1", "ros2"]
    parameters: RosParameters


class FmuChannel(_OutsideChannel):
    """The built-in channel that asks an FMU."""

    kind: Literal["fmu"]
    parameters: FmuParameters


class RemoteChannel(_OutsideChannel):
    """The built-in channel that asks what listens at an address, on this host or another one."""

    kind: Literal["remote"]
    parameters: RemoteParameters


class PluginChannel(_OutsideChannel):
    """A channel from outside the package."""

    kind: PluginPath
    parameters: q.Free = {}


CommandChannel = ProcessChannel | RosChannel | ZenohChannel
"""Channels whose program is a command of the user."""

HostedChannel = CommandChannel | FmuChannel | RemoteChannel
"""Channels that are asked outside of this process, each run for itself."""

OutsideChannel = HostedChannel | PolicyChannel | PluginChannel
"""Channels with code from outside the package."""


BuiltInChannel = Annotated[
    NominalChannel
    | SafetyChannel
    | TrajectoryChannel
    | ReferenceChannel
    | PolicyChannel
    | ProcessChannel
    | RosChannel
    | ZenohChannel
    | FmuChannel
    | RemoteChannel,
    Field(discriminator="kind"),
]
Channel = BuiltInChannel | PluginChannel
