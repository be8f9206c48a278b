"""An architecture: vehicle, sensors, channels with their links, and the switch."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Annotated, Any, ClassVar, Final, Literal, Self

from pydantic import Field, model_serializer

from adeye.errors import suggest
from adeye.spec.channels import Channel, ReferenceChannel, SafetyChannel
from adeye.spec.document import Loc, Problem, finds, repeated
from adeye.spec.plausible import FileRecord, Limits
from adeye.spec.programs import FmuUse, Plant
from adeye.spec.quantity import (
    Acceleration,
    Angle,
    AngularRate,
    ById,
    Duration,
    GrownRecord,
    Identifier,
    Jerk,
    Many,
    Number,
    Record,
    Tags,
    Text,
)
from adeye.spec.sensors import (
    FmuSensor,
    NonNegativeAngle,
    NonNegativeDuration,
    PositiveLength,
    Sensor,
)
from adeye.spec.supervisor import PositiveAcceleration

HEALTH: Final = "health."
"""Begins a link that shows of a sensor only whether it delivers, and when it sampled last."""


NEAR: Final = 2.0
"""How far from the body a sensor may be mounted [m]: masts, roof racks, test rigs. Our choice."""


class Vehicle(GrownRecord):
    """The ego's body and limits; every other part reads them from here."""

    later: ClassVar[tuple[str, ...]] = ("plant",)

    length: PositiveLength
    width: PositiveLength
    height: PositiveLength
    wheelbase: PositiveLength
    mass: Annotated[Number, Field(gt=0.0)] = 1800.0
    max_acceleration: PositiveAcceleration
    max_deceleration: PositiveAcceleration
    max_steering_angle: Annotated[Angle, Field(gt=0.0)]
    max_steering_rate: Annotated[AngularRate, Field(gt=0.0)]
    acceleration_lag: NonNegativeDuration
    """Time constant of the first-order drive and brake response [s]."""
    steering_lag: NonNegativeDuration
    """Time constant of the first-order steering response [s]."""
    plant: Plant | None = None
    """An FMU that moves it, instead of the built-in single-track model."""


# --- The switch: whose command acts, by which policy, and how authority passes -------------------

_REQUESTS: Final = frozenset({"debounce", "latch"})
_RETURN: Final = frozenset({"return_after", "return_degraded"})
_VOTE: Final = frozenset(
    {
        "voters",
        "acceleration_tolerance",
        "steering_tolerance",
        "quorum",
        "vote",
        "without_majority",
    }
)
POLICY_NEEDS: Final[dict[str, tuple[str, ...]]] = {
    "hysteresis": ("return_after",),
    "voting": ("voters", "acceleration_tolerance", "steering_tolerance"),
}
"""Which keys a policy cannot do without, beside those of every policy."""

_LATER: Final = _RETURN | _VOTE | {"handover", "meanwhile", "bumpless"}
"""Keys that came after the first results: what does without them keeps its identity."""


class Bumpless(Record):
    """How fast the acting command may move from the old channel's to the new one's."""

    jerk: Annotated[Jerk, Field(gt=0.0)]
    """Largest rate of the acceleration [m/s³]."""
    steering_rate: Annotated[AngularRate, Field(gt=0.0)]
    """Largest rate of the steering angle [rad/s]."""


class Switch(Record):
    """Who acts, by a policy, and how authority passes from one channel to another.

    ``fixed_priority`` grants requests in order of priority; ``hysteresis`` returns to the default
    after it has been healthy for a while; ``voting`` acts as the majority of its voters agrees;
    ``stuck`` never leaves the default.
    """

    policy: Literal["fixed_priority", "hysteresis", "voting", "stuck"]
    priority: Annotated[Many[Identifier], Field(min_length=1)]
    """Channels, highest priority first."""
    default: Identifier
    """The channel that acts when nobody requests authority."""
    debounce: NonNegativeDuration = 0.0
    """How long a request must stand before it is granted [s]."""
    latch: bool = True
    """Whether authority, once taken by a higher priority, is kept to the end."""
    staleness: Annotated[Duration, Field(gt=0.0)] = 0.2
    """Age of the acting command from which the next channel takes over [s]."""
    realises: Identifier | None = None
    return_after: NonNegativeDuration | None = None
    """Policy hysteresis: the default acts again after it has been healthy, and nobody has requested
    authority, for so long [s]."""
    return_degraded: bool = False
    """Policy hysteresis: whether a degraded default counts as healthy."""
    voters: Annotated[Many[Identifier], Field(min_length=2)] | None = None
    """Policy voting: channels whose commands are compared, the default among them."""
    acceleration_tolerance: Annotated[Acceleration, Field(ge=0.0)] | None = None
    """Policy voting: difference of acceleration up to which two commands agree [m/s²]."""
    steering_tolerance: NonNegativeAngle | None = None
    """Policy voting: difference of steering angle up to which two commands agree [rad]."""
    quorum: Annotated[int, Field(ge=2)] | None = None
    """Policy voting: how many must agree, more than half of the voters; by default just that."""
    vote: Literal["majority", "median"] = "majority"
    """Policy voting: act as a voter of the majority does, or by the median of those that agree with
    it, for acceleration and steering each."""
    without_majority: Identifier | None = None
    """Policy voting: channel that acts without a majority; without it, the ego coasts."""
    handover: NonNegativeDuration = 0.0
    """Time from the decision for another channel until its command acts, whole ticks [s]."""
    meanwhile: Literal["keep", "coast"] = "keep"
    """What acts during a handover: the old channel as long as it is usable, or nobody."""
    bumpless: Bumpless | None = None
    """Limits of the acting command's rates after a handover; without it, it jumps."""

    @finds
    def _keys_fit_policy(self) -> Iterator[Problem]:
        known = POLICY_KEYS[self.policy]
        listed = ", ".join(key for key in Switch.model_fields if key in known)
        for key in sorted(self.model_fields_set - known):
            yield (key,), f"{key} is no key of the policy {self.policy}; its keys are {listed}"
        for key in POLICY_NEEDS.get(self.policy, ()):
            if getattr(self, key) is None:
                yield ("policy",), f"{self.policy} needs {key}"

    @finds
    def _channels_are_listed(self) -> Iterator[Problem]:
        for at in repeated(self.priority):
            yield ("priority", at), f"channel {self.priority[at]!r} occurs twice"
        listed = ", ".join(self.priority)
        named: list[tuple[Loc, str | None]] = [
            (("default",), self.default),
            (("without_majority",), self.without_majority),
            *((("voters", at), name) for at, name in enumerate(self.voters or ())),
        ]
        for loc, name in named:
            if name is not None and name not in self.priority:
                yield loc, f"{name!r} is not in priority: {listed}"

    @finds
    def _a_majority_is_one(self) -> Iterator[Problem]:
        if self.voters is None:
            return
        for at in repeated(self.voters):
            yield ("voters", at), f"channel {self.voters[at]!r} occurs twice"
        if self.default not in self.voters:
            yield ("voters",), f"the default {self.default!r} must be one of the voters"
        count = len(self.voters)
        if self.quorum is not None and not count // 2 < self.quorum <= count:
            text = (
                f"{self.quorum} of {count} voters is no majority; "
                f"give {count // 2 + 1} to {count}, or two majorities could contradict each other"
                if self.quorum <= count
                else f"there are only {count} voters; give {count // 2 + 1} to {count}"
            )
            yield ("quorum",), text

    @model_serializer(mode="wrap")
    def _serialised(self, write: Callable[[Self], dict[str, Any]]) -> dict[str, Any]:
        """Leave out what the policy does not know, and what came later where it is not used."""
        part = write(self)
        known = POLICY_KEYS[self.policy]
        fields = type(self).model_fields
        return {
            key: value
            for key, value in part.items()
            if key in known and (key not in _LATER or getattr(self, key) != fields[key].default)
        }

    @property
    def agreeing(self) -> int:
        """Number of voters that must agree; 0 where nobody votes."""
        if self.voters is None:
            return 0
        return len(self.voters) // 2 + 1 if self.quorum is None else self.quorum


_COMMON: Final = frozenset(Switch.model_fields) - _REQUESTS - _RETURN - _VOTE
POLICY_KEYS: Final[dict[str, frozenset[str]]] = {
    "fixed_priority": _COMMON | _REQUESTS,
    "hysteresis": _COMMON | {"debounce"} | _RETURN,
    "voting": _COMMON | _REQUESTS | _VOTE,
    # What-if of any other policy: its keys may stay in the file.
    "stuck": _COMMON | _REQUESTS | _RETURN | _VOTE,
}
"""Which keys each policy knows."""


# --- The architecture as a whole ------------------------------------------------------------------


class Architecture(FileRecord):
    """One candidate arrangement of vehicle, sensors, channels and switch."""

    later: ClassVar[tuple[str, ...]] = ("beyond_plausible", "tags")

    architecture: Identifier
    title: Text
    text: str = ""
    tags: Tags = {}
    vehicle: Vehicle
    sensors: Annotated[ById[Sensor], Field(min_length=1)]
    channels: Annotated[ById[Channel], Field(min_length=1)]
    switch: Switch
    cost: Annotated[Number, Field(ge=0.0)] = 0.0

    @finds
    def _links_exist(self) -> Iterator[Problem]:
        known = [
            *self.sensors,
            *(f"channels.{name}" for name in self.channels),
            "switch",
            *(f"{HEALTH}{name}" for name in self.sensors),
        ]
        if "switch" in self.sensors:
            text = "'switch' is what links to the switch say; give the sensor another id"
            yield ("sensors", "switch"), text
        for name, channel in self.channels.items():
            for at, link in enumerate(channel.links):
                loc = ("channels", name, "links", at)
                if link not in known:
                    text = f"channel {name!r} links {link!r}, which is none of {', '.join(known)}"
                    near = suggest(link, known)
                    yield loc, f"{text}. {near}" if near.endswith("?") else text
                elif at in repeated(channel.links):
                    yield loc, f"channel {name!r} links {link!r} twice"
            if isinstance(channel, SafetyChannel):
                yield from _unlinked(name, channel, self.sensors, self.channels)
            if isinstance(channel, ReferenceChannel):
                yield from _untrue(name, channel, self.sensors)
        for at, name in enumerate(self.switch.priority):
            if name not in self.channels:
                text = f"{name!r} is no channel of this architecture: {', '.join(self.channels)}"
                yield ("switch", "priority", at), text

    def own_limits(self) -> Limits:
        """The wheels stand below the body, and a sensor on it or near it."""
        body = self.vehicle
        along, across = 0.5 * body.length + NEAR, 0.5 * body.width + NEAR
        return {
            "wheelbase": (0.2, body.length),
            "mount.x": (-along, along),
            "mount.y": (-across, across),
            "mount.z": (0.0, body.height + NEAR),
        }

    @property
    def fmus(self) -> dict[tuple[str, str], FmuUse]:
        """FMUs that are no channels, by where they are named: the vehicle's, those of sensors."""
        found: dict[tuple[str, str], FmuUse] = {
            ("sensors", name): item
            for name, item in self.sensors.items()
            if isinstance(item, FmuSensor)
        }
        if self.vehicle.plant is not None:
            found["vehicle", "plant"] = self.vehicle.plant
        return found

    def executable(self) -> dict[str, object]:
        """The part that a run depends on: never cost, texts or the elements that it realises.

        Nor the names of files that channels read: their content counts, as that of code does, in
        the identity of the result.
        """
        part = self.model_dump(
            mode="json", exclude={*self.later, "architecture", "title", "text", "cost"}
        )
        for record in [*part["sensors"].values(), *part["channels"].values(), part["switch"]]:
            for key in ("cost", "text", "realises", "files"):
                record.pop(key, None)
        return part


def _untrue(
    name: str, channel: ReferenceChannel, sensors: Mapping[str, Sensor]
) -> Iterator[Problem]:
    """Find what keeps a reference driver from seeing the scene as it is at each of its ticks."""
    linked = [sensors[link] for link in channel.links if link in sensors]
    fits = [
        sensor
        for sensor in linked
        if sensor.kind == "ground_truth"
        and sensor.latency == 0.0
        and sensor.jitter == 0.0
        and sensor.rate == channel.rate
    ]
    if len(channel.links) != 1 or len(fits) != 1:
        text = (
            f"channel {name!r} is a reference driver: it links one sensor and nothing else, of "
            f"kind ground_truth, without latency and jitter, at its own {channel.rate:g} Hz"
        )
        yield ("channels", name, "links"), text


def _unlinked(
    name: str, channel: SafetyChannel, sensors: Collection[str], channels: Collection[str]
) -> Iterator[Problem]:
    """Find what the monitors of a channel watch although nothing of it is linked to the channel."""
    supervisor = channel.parameters.supervisor
    for monitor, spec in ({} if supervisor is None else supervisor.monitors).items():
        of_sensors = spec.kind == "sensor_silent"
        there, what = (sensors, "sensor") if of_sensors else (channels, "channel")
        for at, watched in enumerate(getattr(spec, "watches", ())):
            loc = ("channels", name, "parameters", "supervisor", "monitors", monitor, "watches", at)
            link = f"{HEALTH if of_sensors else 'channels.'}{watched}"
            if watched not in there:
                text = f"{monitor!r} watches {watched!r}, which is no {what}: {', '.join(there)}"
                yield loc, text
            elif link not in channel.links and not (of_sensors and watched in channel.links):
                text = (
                    f"{monitor!r} watches {watched!r}, which channel {name!r} does not link; add "
                    f"{link} to its links"
                )
                yield loc, text


ACTUATORS = ("drive", "brake", "steering")
"""What moves the vehicle, as targets of faults."""


def targets_of(architecture: Architecture) -> list[str]:
    """List what of an architecture a fault can be injected into.

    A link is named by the channel that it leads to and what it brings.
    """
    return [
        *(f"sensors.{name}" for name in architecture.sensors),
        *(f"channels.{name}" for name in architecture.channels),
        *(f"hooks.{name}" for name in architecture.channels),
        *(
            f"links.{name}.{link}"
            for name, channel in architecture.channels.items()
            for link in channel.links
        ),
        *(f"actuators.{name}" for name in ACTUATORS),
        "tyres",
        "switch",
    ]
