"""What every fault has, and the faults of what hands on a signal, of actuators and switch."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Final, Literal, Self

from pydantic import Field, StringConstraints, model_validator

from adeye.spec import quantity as q
from adeye.spec.document import Problem, finds
from adeye.spec.sensors import Share

# --- What every fault has: its target, its onset, and for how long and how often it is there ------

NEGLIGIBLE: Final = 1e-9
"""Distance from a neutral size, in SI, within which a size is read as this: far below what is worth
a test, far above how numbers are rounded. So such a fault changes no bit."""

Target = Annotated[str, StringConstraints(pattern=q.TARGET)]


class Onset(q.Record):
    """When the fault begins: at a time, when a condition over the scene first holds, or between.

    ``between`` draws the time for each run, uniformly and by its seed, so it is another one in
    another replicate and the same in every architecture.
    """

    at: Annotated[q.Duration, Field(ge=0.0)] | None = None
    when: q.Condition | None = None
    between: (
        Annotated[q.Many[Annotated[q.Duration, Field(ge=0.0)]], Field(min_length=2, max_length=2)]
        | None
    ) = None

    @finds
    def _one_onset(self) -> Iterator[Problem]:
        if sum(part is not None for part in (self.at, self.when, self.between)) != 1:
            yield (), "give one of at, when and between"
        elif self.between is not None and self.between[0] > self.between[1]:
            yield ("between",), "the earliest time comes first"


class Fault(q.Record):
    """What every fault has, whatever it does; see the models beside.

    Attributes:
        fits: Kinds of targets that a model is for.
        STRUCTURE: Fields beside id, target and model that are equal inside a batch.
        neutral: Sizes with which it does nothing although it is present: of one of these, all.
        silences: Whether nothing of its target comes through while it is present.
    """

    fits: ClassVar[tuple[str, ...]] = ()
    STRUCTURE: ClassVar[tuple[str, ...]] = ()
    neutral: ClassVar[tuple[dict[str, float], ...]] = ()
    silences: ClassVar[bool] = False

    id: q.Identifier
    target: Target
    model: str
    onset: Onset
    duration: Annotated[q.Duration, Field(ge=0.0)] | None = None
    """How long it lasts [s]; without it, to the end of the run."""
    every: Annotated[q.Duration, Field(gt=0.0)] | None = None
    """It comes again so long after its last onset [s]: an intermittent fault."""
    times: Annotated[int, Field(ge=1, le=10_000)] | None = None
    """How often an intermittent fault comes; without it, to the end of the run."""
    text: str = ""

    @model_validator(mode="after")
    def _rounding_is_nothing(self) -> Self:
        for name, size in (pair for sizes in self.neutral for pair in sizes.items()):
            value = getattr(self, name)
            if value is not None and abs(value - size) <= NEGLIGIBLE:
                # A frozen record, but one that nobody has seen yet.
                self.__dict__[name] = size
        return self

    @finds
    def _model_fits_target(self) -> Iterator[Problem]:
        if self.port not in self.fits:
            fits = " or ".join(self.fits)
            yield (), f"{self.model} is a fault of {fits}, and {self.target} is not one of them"

    @finds
    def _comes_again_after_it_went(self) -> Iterator[Problem]:
        if self.every is None:
            if self.times is not None:
                yield ("times",), "says how often a fault comes again; give every, too"
        elif self.duration is None or self.duration >= self.every:
            yield ("every",), "give a duration that is shorter, or it never goes"

    @property
    def port(self) -> str:
        """Kind of what fails: ``sensors``, ``channels`` and so on."""
        return self.target.split(".", 1)[0]

    @property
    def target_id(self) -> str:
        """Which of its kind fails: the target without its kind, empty where there is just one."""
        return self.target.partition(".")[2]

    @property
    def nothing(self) -> str:
        """The sizes with which it does nothing, in words; empty if it does something."""
        for sizes in self.neutral:
            if all(getattr(self, name) == size for name, size in sizes.items()):
                return " and ".join(f"{name} {size:g}" for name, size in sizes.items())
        return ""

    def executable(self) -> dict[str, object]:
        """The part that a run depends on."""
        part = self.model_dump(mode="json", exclude={"text"})
        for record, name in ((part, "every"), (part, "times"), (part["onset"], "between")):
            # What came later is no part of the identity of what does without it.
            if record[name] is None:
                del record[name]
        return part


# --- Faults of whatever hands on a signal: it comes late, or it stands still ----------------------

LONGEST_LAG: Final = 10.0
"""How late something can come at most [s]: everything up to then is kept."""

Lag = Annotated[q.Duration, Field(ge=0.0, le=LONGEST_LAG)]


class Delay(Fault):
    """What goes through comes later; in order, and with the stamps that it has."""

    fits = ("links", "actuators")
    neutral = ({"by": 0.0},)
    model: Literal["delay"]
    by: Lag
    """How much later [s], rounded up to ticks."""


class Stuck(Fault):
    """The last value before the onset stands; a channel goes on stamping it.

    A switch stays at the channel that acts.
    """

    fits = ("channels", "actuators", "switch")
    model: Literal["stuck"]


# --- Faults of what carries out the acting command: drive, brake, steering and tyres --------------


class _OfActuators(Fault):
    """A fault that not every actuator can have.

    Attributes:
        actuators: Those that can.
    """

    fits = ("actuators",)
    actuators: ClassVar[tuple[str, ...]] = ()

    @finds
    def _actuator_can_have_it(self) -> Iterator[Problem]:
        if self.target_id not in self.actuators:
            known = " or ".join(f"actuators.{name}" for name in self.actuators)
            text = f"{self.model} is a fault of {known}, and {self.target} is not one of them"
            yield ("target",), text


class Loss(_OfActuators):
    """A share of what drive or brake is asked for is missing."""

    actuators = ("drive", "brake")
    neutral = ({"share": 0.0},)
    model: Literal["loss"]
    share: Share


class Fade(_OfActuators):
    """Drive or brake weakens evenly, from the onset until a share of it is missing."""

    actuators = ("drive", "brake")
    neutral = ({"share": 0.0},)
    model: Literal["fade"]
    share: Share
    over: Annotated[q.Duration, Field(gt=0.0)]
    """After which time this share is missing [s]; counted from the first onset."""


class Offset(_OfActuators):
    """The wheels are steered beside what is asked for."""

    actuators = ("steering",)
    neutral = ({"steering_angle": 0.0},)
    model: Literal["offset"]
    steering_angle: q.Angle
    """To the left [rad]."""


class RateLimit(Fault):
    """An actuator follows no quicker than a rate."""

    fits = ("actuators",)
    model: Literal["rate_limit"]
    steering_rate: Annotated[q.AngularRate, Field(ge=0.0)] | None = None
    """Of the steering [rad/s]."""
    jerk: Annotated[q.Jerk, Field(ge=0.0)] | None = None
    """Of drive and brake [m/s³]."""

    @finds
    def _rate_of_its_actuator(self) -> Iterator[Problem]:
        wanted, other = ("jerk", "steering_rate")
        if self.target_id == "steering":
            wanted, other = other, wanted
        if getattr(self, wanted) is None or getattr(self, other) is not None:
            name = other if getattr(self, other) is not None else "model"
            yield (name,), f"the rate of {self.target} is {wanted}; give it alone"

    @property
    def rate(self) -> float:
        """How quickly it follows at most [rad/s] or [m/s³]."""
        return float(self.jerk or 0.0) + float(self.steering_rate or 0.0)


class Friction(Fault):
    """The tyres grip otherwise than the road has it."""

    fits = ("tyres",)
    neutral = ({"factor": 1.0},)
    model: Literal["friction"]
    value: Annotated[q.Number, Field(ge=0.0, le=2.0)] | None = None
    """The friction coefficient."""
    factor: Annotated[q.Number, Field(ge=0.0, le=2.0)] | None = None
    """Of the friction coefficient of the road."""

    @finds
    def _one_of_both(self) -> Iterator[Problem]:
        if (self.value is None) == (self.factor is None):
            name = "model" if self.value is None else "factor"
            yield (name,), "give one of value and factor"


# --- Faults of the switch -------------------------------------------------------------------------


class Late(Fault):
    """Each change of authority takes effect later, beside the handover time of the switch."""

    fits = ("switch",)
    neutral = ({"delay": 0.0},)
    model: Literal["late"]
    delay: Annotated[q.Duration, Field(ge=0.0)]
    """How much later, in whole ticks [s]."""
