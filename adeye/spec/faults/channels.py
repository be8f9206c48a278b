"""Faults of channels: of the command that they give, of what is linked to them, and inside them."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from adeye.spec.faults.base import Fault
from adeye.spec.faults.signals import Lag
from adeye.spec.misplaced import Loc, misplaced
from adeye.spec.quantity import Acceleration, Angle, Frequency, Length, Number

Probability = Annotated[Number, Field(ge=0.0, le=1.0)]


class Silent(Fault):
    """A channel says nothing."""

    fits = ("channels",)
    silences = True
    model: Literal["silent"]


class Crash(Fault):
    """A channel says nothing any more."""

    fits = ("channels",)
    silences = True
    model: Literal["crash"]

    @model_validator(mode="after")
    def _does_not_come_back(self) -> Self:
        if self.duration is not None:
            text = "what has crashed does not come back; leave it out, or take the model silent"
            raise misplaced([(("duration",), text)])
        return self


class Slow(Fault):
    """Commands arrive later, with the stamps that they have."""

    fits = ("channels",)
    neutral = ({"by": 0.0},)
    model: Literal["slow"]
    by: Lag
    """How much later [s], rounded up to ticks."""


class _OnCommand(Fault):
    """Something is done to acceleration, steering angle or both."""

    @model_validator(mode="after")
    def _does_something(self) -> Self:
        if not {"acceleration", "steering_angle"} & self.model_fields_set:
            found: list[tuple[Loc, str]] = [
                (("model",), "give acceleration, steering_angle or both")
            ]
            raise misplaced(found)
        return self


class Bias(_OnCommand):
    """Something is added to a channel's command."""

    fits = ("channels",)
    neutral = ({"acceleration": 0.0, "steering_angle": 0.0},)
    model: Literal["bias"]
    acceleration: Acceleration = 0.0
    """[m/s²]."""
    steering_angle: Angle = 0.0
    """[rad]."""


class Scale(_OnCommand):
    """A channel's command is multiplied, as by a wrong unit: 57.3 gives degrees for radians."""

    fits = ("channels",)
    neutral = ({"acceleration": 1.0, "steering_angle": 1.0},)
    model: Literal["scale"]
    acceleration: Number = 1.0
    steering_angle: Number = 1.0


class Oscillating(_OnCommand):
    """A cosine that begins at the onset is added to a channel's command."""

    fits = ("channels",)
    neutral = ({"acceleration": 0.0, "steering_angle": 0.0},)
    model: Literal["oscillating"]
    acceleration: Acceleration = 0.0
    """Amplitude [m/s²]."""
    steering_angle: Angle = 0.0
    """Amplitude [rad]."""
    frequency: Annotated[Frequency, Field(gt=0.0, le=100.0)]
    """[Hz]."""


class PlausibleButWrong(Fault):
    """A channel goes on with a harmless command that has nothing to do with the traffic."""

    fits = ("channels",)
    model: Literal["plausible_but_wrong"]
    acceleration: Acceleration = 0.5
    """[m/s²]."""
    steering_angle: Angle = 0.0
    """[rad]."""


class NotANumber(Fault):
    """Acceleration and steering angle of a channel are no numbers."""

    fits = ("channels",)
    model: Literal["not_a_number"]


class HeartbeatLies(Fault):
    """A channel that is degraded, in fault or silent says ok, with fresh stamps."""

    fits = ("channels",)
    model: Literal["heartbeat_lies"]


class Drop(Fault):
    """Messages of a link are lost; what came last stands."""

    fits = ("links",)
    neutral = ({"probability": 0.0},)
    model: Literal["drop"]
    probability: Probability = 1.0
    """That a message is lost, or begins a burst."""
    burst: Annotated[int, Field(ge=1, le=10_000)] = 1
    """How many messages in a row are lost then."""


class Reorder(Fault):
    """Some messages of a link come later than others that were sent after them."""

    fits = ("links",)
    neutral = ({"probability": 0.0}, {"by": 0.0})
    model: Literal["reorder"]
    probability: Probability = 1.0
    """That a message is held up."""
    by: Lag
    """How long it is held up [s], rounded up to ticks."""


class Duplicate(Fault):
    """The message before comes again in place of a new one, with the stamp of the new one."""

    fits = ("links",)
    neutral = ({"probability": 0.0},)
    model: Literal["duplicate"]
    probability: Probability = 1.0
    """That it comes again."""


class TracksLost(Fault):
    """A channel forgets every object at each of its ticks."""

    fits = ("hooks",)
    model: Literal["tracks_lost"]


class PlannerFrozen(Fault):
    """A channel goes on sending its last command, with fresh stamps and status ok.

    The monitors of a safety channel go on, and its status with them.
    """

    fits = ("hooks",)
    model: Literal["planner_frozen"]


class MonitorsFrozen(Fault):
    """The monitors of a safety channel stay as they were: what is not confirmed never will be."""

    fits = ("hooks",)
    model: Literal["monitors_frozen"]


class MapShifted(Fault):
    """What a channel takes for its lane lies beside the lane."""

    fits = ("hooks",)
    neutral = ({"offset": 0.0},)
    model: Literal["map_shifted"]
    offset: Annotated[Length, Field(ge=-10.0, le=10.0)]
    """To the left [m]."""
