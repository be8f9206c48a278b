"""What every fault has: its target, its onset, and for how long and how often it is there."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Final, Literal

from pydantic import Field, StringConstraints

from adeye.spec.document import Problem, finds
from adeye.spec.quantity import TARGET, Condition, Duration, Identifier, Many, Record

# --- What every fault has: its target, its onset, and for how long and how often it is there ------

Target = Annotated[str, StringConstraints(pattern=TARGET)]


class Onset(Record):
    """When the fault begins: at a time, when a condition over the scene first holds, or between.

    ``between`` draws the time for each run, uniformly and by its seed, so it is another one in
    another replicate and the same in every architecture.
    """

    at: Annotated[Duration, Field(ge=0.0)] | None = None
    when: Condition | None = None
    between: (
        Annotated[Many[Annotated[Duration, Field(ge=0.0)]], Field(min_length=2, max_length=2)]
        | None
    ) = None

    @finds
    def _one_onset(self) -> Iterator[Problem]:
        if sum(part is not None for part in (self.at, self.when, self.between)) != 1:
            yield (), "give one of at, when and between"
        elif self.between is not None and self.between[0] > self.between[1]:
            yield ("between",), "the earliest time comes first"


class Fault(Record):
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

    id: Identifier
    target: Target
    model: str
    onset: Onset
    duration: Annotated[Duration, Field(ge=0.0)] | None = None
    """How long it lasts [s]; without it, to the end of the run."""
    every: Annotated[Duration, Field(gt=0.0)] | None = None
    """It comes again so long after its last onset [s]: an intermittent fault."""
    times: Annotated[int, Field(ge=1, le=10_000)] | None = None
    """How often an intermittent fault comes; without it, to the end of the run."""
    text: str = ""

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

Lag = Annotated[Duration, Field(ge=0.0, le=LONGEST_LAG)]


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
