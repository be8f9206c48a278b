"""The switch of an architecture: whose command acts, by which policy, and how authority passes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Annotated, Any, Final, Literal, Self

from pydantic import Field, model_serializer

from adeye.spec.document import Loc, Problem, finds, repeated
from adeye.spec.quantity import Acceleration, AngularRate, Duration, Identifier, Jerk, Many, Record
from adeye.spec.sensors import NonNegativeAngle, NonNegativeDuration

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
NEEDED: Final[dict[str, tuple[str, ...]]] = {
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
        known = KEYS[self.policy]
        listed = ", ".join(key for key in Switch.model_fields if key in known)
        for key in sorted(self.model_fields_set - known):
            yield (key,), f"{key} is no key of the policy {self.policy}; its keys are {listed}"
        for key in NEEDED.get(self.policy, ()):
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
        known = KEYS[self.policy]
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
KEYS: Final[dict[str, frozenset[str]]] = {
    "fixed_priority": _COMMON | _REQUESTS,
    "hysteresis": _COMMON | {"debounce"} | _RETURN,
    "voting": _COMMON | _REQUESTS | _VOTE,
    # What-if of any other policy: its keys may stay in the file.
    "stuck": _COMMON | _REQUESTS | _RETURN | _VOTE,
}
"""Which keys each policy knows."""
