"""The supervisor of a safety channel: monitors, their counters, and what their levels ask for."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Annotated, Final, Literal, get_args

from pydantic import AfterValidator, Field

from adeye.signals import MANOEUVRE_MONITORS
from adeye.spec import quantity as q
from adeye.spec.document import Problem, finds, repeated
from adeye.spec.sensors import NonNegativeDuration, NonNegativeLength, PositiveFrequency

Count = Annotated[int, Field(ge=-1_000_000, le=1_000_000)]
Step = Annotated[int, Field(ge=1, le=1_000_000)]
Level = Annotated[int, Field(ge=1, le=4)]
Watched = Annotated[q.Many[q.Identifier], Field(min_length=1)]
PositiveAcceleration = Annotated[q.Acceleration, Field(gt=0.0)]
PositiveDuration = Annotated[q.Duration, Field(gt=0.0)]

LevelKey = Literal["1", "2", "3", "4"]
"""Levels of criticality as keys, from the mildest."""

Manoeuvre = Literal["continue", "rest_area", "roadside_parking", "stop"]
MANOEUVRES: Final[tuple[Manoeuvre, ...]] = get_args(Manoeuvre)
"""What a level may ask for, from the mildest; what cannot be had gives way to the next."""


class Counter(q.Record):
    """How a monitor is debounced: up when it fires, down when it does not, between two ends."""

    increment: Step = 1
    decrement: Step = 1
    fault: Count = 4
    """Upper end, at which the monitor is confirmed."""
    heal: Count = -4
    """Lower end, at which it is cleared, and at which it begins."""


class OwnCounter(q.Record):
    """What of the counter a monitor has of its own."""

    increment: Step | None = None
    decrement: Step | None = None
    fault: Count | None = None
    heal: Count | None = None


class _Monitor(q.Record):
    level: Level = 4
    """Of criticality, while it is confirmed."""
    counter: OwnCounter = OwnCounter()


class ChannelSilent(_Monitor):
    """A channel is in fault, or its newest command is too old."""

    kind: Literal["channel_silent"]
    watches: Watched
    """Ids of channels."""
    timeout: PositiveDuration = 0.2
    """Greatest age of its newest command [s]."""


class ChannelImplausible(_Monitor):
    """A channel commands no number, or what this vehicle at this speed cannot be meant to do."""

    kind: Literal["channel_implausible"]
    watches: Watched
    """Ids of channels."""
    max_acceleration: PositiveAcceleration = 10.0
    """Greatest magnitude of the acceleration [m/s²]. That of the steering angle is the
    vehicle's."""
    max_lateral_acceleration: PositiveAcceleration = 6.0
    """Greatest lateral acceleration that the steering asks for at the present speed [m/s²]."""
    max_lateral_error: PositiveAcceleration = 4.0
    """Greatest difference between that and what is driven [m/s²], until the safety channel takes
    over."""
    max_jerk: Annotated[q.Jerk, Field(gt=0.0)] = 500.0
    """Greatest change of the acceleration from one command to the next [m/s³]. An emergency braking
    may begin within one command."""
    max_steering_rate: Annotated[q.AngularRate, Field(gt=0.0)] = 5.0
    """Greatest change of the steering angle from one command to the next [rad/s]."""


class ChannelStuck(_Monitor):
    """A channel gives the same command again and again, to the bit, while the vehicle moves.

    Where what a channel reads has noise, so have its commands: one that does not change is no
    decision. It cannot tell from a frozen one a channel whose inputs have no noise.
    """

    kind: Literal["channel_stuck"]
    watches: Watched
    """Ids of channels."""
    timeout: PositiveDuration = 0.5
    """Longest that a command stays the same [s]."""
    min_speed: Annotated[q.Speed, Field(ge=0.0)] = 1.0
    """Below, it may stay the same: who stands holds the brake [m/s]."""


class SensorSilent(_Monitor):
    """A sensor does not deliver, or what it delivers is too old."""

    kind: Literal["sensor_silent"]
    watches: Watched
    """Ids of sensors."""
    timeout: PositiveDuration = 0.1
    """Longest time without a new sample [s]."""
    max_age: PositiveDuration | None = None
    """Greatest age of the newest sample [s]: its latency and the time until the next one count."""


class OffRoad(_Monitor):
    """The centre of the ego is beside everything that carries it: lanes, shoulder, bays, verge."""

    kind: Literal["off_road"]
    margin: NonNegativeLength = 0.0
    """How far beside the edge it may be [m]."""


class LaneDeparture(_Monitor):
    """The ego is too far from the centre of every lane, or off the lanes."""

    kind: Literal["lane_departure"]
    max_offset: Annotated[q.Length, Field(gt=0.0)] = 1.0


class ObjectDanger(_Monitor):
    """An object in the path requires a deceleration from the threshold on."""

    kind: Literal["object_danger"]
    threshold: PositiveAcceleration = 4.5


class CriticalArea(_Monitor):
    """An object is in the strip along the path that the ego is about to drive over."""

    kind: Literal["critical_area"]
    time: NonNegativeDuration = 1.0
    """The strip is as long as the ego and what it drives in this time [s]."""
    width_factor: Annotated[q.Number, Field(gt=0.0)] = 1.2
    """Its width, in widths of the ego."""


class RssDanger(_Monitor):
    """The object ahead is nearer than the longitudinal safe distance of RSS."""

    kind: Literal["rss_danger"]
    response_time: NonNegativeDuration = 0.5
    acceleration: Annotated[q.Acceleration, Field(ge=0.0)] = 1.5
    """Largest of the ego while it responds [m/s²]."""
    least_braking: PositiveAcceleration = 6.0
    """Of the ego [m/s²]."""
    most_braking: PositiveAcceleration = 8.0
    """Of the object ahead [m/s²]."""


class OddExit(_Monitor):
    """The ego leaves a speed or a part of the road; what is not given is not asked."""

    kind: Literal["odd_exit"]
    max_speed: Annotated[q.Speed, Field(ge=0.0)] | None = None
    from_s: q.Length | None = None
    """Along the road [m]."""
    to_s: q.Length | None = None
    from_d: q.Length | None = None
    """From the right edge of the lanes to the left [m]."""
    to_d: q.Length | None = None

    @finds
    def _asks_something(self) -> Iterator[Problem]:
        limits = ("max_speed", "from_s", "to_s", "from_d", "to_d")
        if all(getattr(self, name) is None for name in limits):
            yield ("kind",), f"asks nothing: give one of {', '.join(limits)}"
        for first, last in (("from_s", "to_s"), ("from_d", "to_d")):
            low, high = getattr(self, first), getattr(self, last)
            if low is not None and high is not None and not low < high:
                yield (last,), f"must be more than {first}, which is {low:g} m"
                return


class LastSafeStop(_Monitor):
    """No safe stop would be left once the monitor could be confirmed."""

    kind: Literal["last_safe_stop"]


Monitor = Annotated[
    ChannelSilent
    | ChannelImplausible
    | ChannelStuck
    | SensorSilent
    | OffRoad
    | LaneDeparture
    | ObjectDanger
    | CriticalArea
    | RssDanger
    | OddExit
    | LastSafeStop,
    Field(discriminator="kind"),
]

KINDS: Final[tuple[str, ...]] = tuple(
    get_args(record.model_fields["kind"].annotation)[0] for record in get_args(get_args(Monitor)[0])
)
"""Kinds of monitors; kernels know them by their place here."""
OF_OBJECTS: Final = ("object_danger", "critical_area", "rss_danger")
"""Those of them that fire for nothing but objects, and for what is missing."""


def _all_levels(given: dict[LevelKey, Manoeuvre]) -> dict[LevelKey, Manoeuvre]:
    usual = zip(get_args(LevelKey), MANOEUVRES, strict=True)
    return {level: given.get(level, word) for level, word in usual}


Manoeuvres = Annotated[dict[LevelKey, Manoeuvre], AfterValidator(_all_levels)]


class Supervisor(q.Record):
    """Monitors with counters and levels, and the manoeuvre that each level asks for."""

    rate: PositiveFrequency = 10.0
    """How often the monitors are asked and counted; a whole part of the channel's rate."""
    counter: Counter = Counter()
    """Of every monitor that does not say otherwise."""
    monitors: Annotated[q.ById[Monitor], Field(min_length=1)]
    manoeuvres: Manoeuvres = Field(default_factory=lambda: _all_levels({}))
    """What the highest level among the confirmed monitors asks for."""
    patience: NonNegativeDuration = 60.0
    """How long a manoeuvre is waited for before the next one takes its place [s]."""
    least_distance: NonNegativeLength = 25.0
    """How far ahead a rest area or parking bay must be at least [m]."""
    sight: NonNegativeLength = 1000.0
    """How far ahead the map is searched for one [m]."""

    def counter_of(self, name: str) -> Counter:
        """Return the counter of a monitor."""
        own = self.monitors[name].counter.model_dump(exclude_none=True)
        return self.counter.model_copy(update=own)

    @finds
    def _is_consistent(self) -> Iterator[Problem]:
        if not self.counter.fault > self.counter.heal:
            yield ("counter", "fault"), _ends(self.counter)
        for name, monitor in self.monitors.items():
            if name in MANOEUVRE_MONITORS:
                text = f"{name!r} tells the manoeuvre; give the monitor another name"
                yield ("monitors", name), text
            counter = self.counter_of(name)
            # What is wrong for all is said once.
            if monitor.counter != OwnCounter() and not counter.fault > counter.heal:
                yield ("monitors", name, "counter"), _ends(counter)
            watches = getattr(monitor, "watches", ())
            for at in repeated(watches):
                yield ("monitors", name, "watches", at), f"{name!r} watches {watches[at]!r} twice"
        for (low, mild), (high, harder) in pairwise(self.manoeuvres.items()):
            if MANOEUVRES.index(harder) < MANOEUVRES.index(mild):
                text = f"level {high} asks for {harder!r}, which is milder than {mild!r} of {low}"
                yield ("manoeuvres", high), text


def _ends(counter: Counter) -> str:
    return f"fault must be more than heal, and {counter.fault} is not more than {counter.heal}"
