"""A fault: what fails, how, from when and for how long."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Mapping
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Final,
    Literal,
    TypeAlias,
    Union,
    get_args,
    get_origin,
)

from pydantic import ConfigDict, Discriminator, Field, GetJsonSchemaHandler, Tag, TypeAdapter
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from adeye.spec import fault_base, sensor_faults
from adeye.spec.architecture import HEALTH
from adeye.spec.document import Problem, finds
from adeye.spec.fault_base import Fault as Fault
from adeye.spec.fault_base import Lag
from adeye.spec.fault_base import Late as Late
from adeye.spec.fault_base import Onset as Onset
from adeye.spec.quantity import Acceleration, Angle, Frequency, Length, Number
from adeye.spec.sensor_faults import SensorFault as SensorFault
from adeye.spec.sensors import Share

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from adeye.spec.architecture import Architecture

# --- Faults of channels: of the command that they give, of what is linked to them, and inside
# them.


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

    @finds
    def _does_not_come_back(self) -> Iterator[Problem]:
        if self.duration is not None:
            text = "what has crashed does not come back; leave it out, or take the model silent"
            yield ("duration",), text


class Slow(Fault):
    """Commands arrive later, with the stamps that they have."""

    fits = ("channels",)
    neutral = ({"by": 0.0},)
    model: Literal["slow"]
    by: Lag
    """How much later [s], rounded up to ticks."""


class _OnCommand(Fault):
    """Something is done to acceleration, steering angle or both."""

    @finds
    def _does_something(self) -> Iterator[Problem]:
        if not {"acceleration", "steering_angle"} & self.model_fields_set:
            yield ("model",), "give acceleration, steering_angle or both"


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
    probability: Share = 1.0
    """That a message is lost, or begins a burst."""
    burst: Annotated[int, Field(ge=1, le=10_000)] = 1
    """How many messages in a row are lost then."""


class Reorder(Fault):
    """Some messages of a link come later than others that were sent after them."""

    fits = ("links",)
    neutral = ({"probability": 0.0}, {"by": 0.0})
    model: Literal["reorder"]
    probability: Share = 1.0
    """That a message is held up."""
    by: Lag
    """How long it is held up [s], rounded up to ticks."""


class Duplicate(Fault):
    """The message before comes again in place of a new one, with the stamp of the new one."""

    fits = ("links",)
    neutral = ({"probability": 0.0},)
    model: Literal["duplicate"]
    probability: Share = 1.0
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


# --- A fault: what fails, how, from when and for how long -----------------------------------------


def _models_of(module: str) -> Iterator[type[Fault]]:
    """Give the records of a module whose model is a word, in the order of the file."""
    for item in vars(sys.modules[module]).values():
        is_own = isinstance(item, type) and issubclass(item, Fault) and item.__module__ == module
        if is_own and get_origin(item.model_fields["model"].annotation) is Literal:
            yield item


MODELS: Final[tuple[type[Fault], ...]] = tuple(
    record
    for module in (sensor_faults.__name__, __name__, fault_base.__name__)
    for record in _models_of(module)
)
"""The record of every model; those of one kind of target have names of their own."""


def model_of(record: type[Fault]) -> str:
    """Return the name of a model, as files have it."""
    name: str = get_args(record.model_fields["model"].annotation)[0]
    return name


def _port_of(value: Any) -> str:
    """Tell by which kind of target a fault is to be read: its own, if that has such a model.

    A model that is none of its target's is read as what it is elsewhere: that record knows what it
    is a fault of, and says so.
    """
    given = value if isinstance(value, Mapping) else getattr(value, "__dict__", {})
    port, model = str(given.get("target")).split(".", 1)[0], given.get("model")
    named = [record for record in MODELS if model_of(record) == model]
    if named and not any(port in record.fits for record in named):
        return named[0].fits[0]
    return port if port in _PORTS else _PORTS[0]


def _of_port(port: str) -> Any:
    """Return the union of the models for a kind of target."""
    records = tuple(record for record in MODELS if port in record.fits)
    if len(records) == 1:
        return Annotated[records[0], Tag(port), Field(title=port)]
    return Annotated[Union[records], Field(discriminator="model", title=port), Tag(port)]  # noqa: UP007 - made of a list


class _InSchemaOfAny:
    """Lets several kinds fit in the JSON Schema, where some have a record in common."""

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        made = handler(core)
        made["anyOf"] = made.pop("oneOf")
        return made


_PORTS: Final = tuple(dict.fromkeys(port for record in MODELS for port in record.fits))

if TYPE_CHECKING:
    AnyFault = Fault
else:
    AnyFault = Annotated[
        Union[tuple(_of_port(port) for port in _PORTS)],  # noqa: UP007 - made of a list
        Discriminator(_port_of),
        _InSchemaOfAny(),
    ]
    """A scripted fault, by kind of target and model."""

FAULT: Final[TypeAdapter[Fault]] = TypeAdapter(AnyFault, config=ConfigDict(defer_build=True))
"""Reads a fault of any model."""


# --- Planned faults that change nothing, as far as their records and the architecture tell --------

Injected: TypeAlias = "tuple[tuple[Fault, ...], Architecture]"
"""The faults of an entry, and the architecture that has them."""

_ADDS: Final = frozenset({"ghost", "stale", "stuck", "heartbeat_lies"})
"""Models after which a target says something although it had been silenced."""

_REPLACES: Final = frozenset({"stuck", "stuck_at", "plausible_but_wrong", "not_a_number"})
"""Models that put a value in the place of whatever it was."""

_ALTERS: Final = frozenset(
    {"bias", "scale", "drift", "noise", "quantise", "spike", "bit_flip", "oscillating"}
    | {"loss", "fade", "offset", "friction", *_REPLACES}
)
"""Models that change a value, and have no memory of it once they are gone."""


def idle_faults(declared: Iterable[str], injected: Iterable[Injected]) -> list[tuple[str, str]]:
    """List the faults that do nothing in some entry, or that no entry uses.

    Args:
        declared: Ids of all faults.
        injected: Faults of each entry as they are planned, with the architecture.

    Returns:
        Id and reason, each once, in the order of the ids.
    """
    found: dict[str, dict[str, None]] = {name: {} for name in declared}
    used: set[str] = set()
    for faults, architecture in injected:
        used |= {fault.id for fault in faults}
        for fault in faults:
            for reason in _reasons(fault, faults, architecture):
                found.setdefault(fault.id, {})[reason] = None
    for name, reasons in found.items():
        if name not in used:
            reasons["is injected in no test case"] = None
    return [(name, reason) for name, reasons in found.items() for reason in reasons]


def _reasons(fault: Fault, faults: Sequence[Fault], architecture: Architecture) -> Iterator[str]:
    if fault.nothing:
        yield f"changes nothing: {fault.model} with {fault.nothing}"
    for at, other in enumerate(faults):
        if _masks(other, fault, faults):
            yield f"is masked by {other.id}, which silences {other.target} all the while"
        elif at > faults.index(fault) and _replaces(other, fault) and _covers(other, fault):
            yield f"is masked by {other.id}, which replaces what {other.target} gives all the while"
    name = architecture.architecture
    channels, sensors = _heard(architecture)
    kind, reader = fault.port, fault.target_id.partition(".")[0]
    if kind == "sensors" and fault.target_id not in sensors:
        yield f"acts on {fault.target}, which no channel of {name} that can act is linked to"
    elif kind in {"channels", "hooks", "links"} and reader not in channels:
        yield f"acts on channel {reader} of {name}, which no channel that acts looks at"
    elif kind == "switch" and len(architecture.switch.priority) < 2:
        yield f"acts on the switch of {name}, which has one channel only"


def _masks(one: Fault, other: Fault, faults: Sequence[Fault]) -> bool:
    """Tell whether one fault takes away what the other changes, whenever that is present."""
    target = other.target
    if other.port in {"hooks", "links"}:
        # Of a silenced channel nobody sees what goes on inside it, nor what it is shown.
        target = f"channels.{other.target_id.partition('.')[0]}"
    if one is other or not (one.silences and one.target == target and one.every is None):
        return False
    is_before = faults.index(one) < faults.index(other)
    if is_before and other.model in _ADDS:
        return False
    covers = _covers(one, other)
    # Of two that silence it at the same time, the later one is masked.
    return covers and (is_before or not (other.silences and _covers(other, one)))


def _replaces(one: Fault, other: Fault) -> bool:
    """Tell whether one fault takes away what another changes that is applied before it."""
    is_set = one.model == "friction" and getattr(one, "value", None) is not None
    return (
        (is_set or one.model in _REPLACES)
        and other.model in _ALTERS
        and one.every is None
        and (one.target, getattr(one, "signal", None))
        == (other.target, getattr(other, "signal", None))
    )


def _covers(one: Fault, other: Fault) -> bool:
    """Tell whether one fault is present whenever the other is, where their records tell that."""
    lasts, needed = (math.inf if item.duration is None else item.duration for item in (one, other))
    if other.every is not None:
        needed += math.inf if other.times is None else (other.times - 1) * other.every
    if one.onset == other.onset and one.onset.between is None:
        return lasts >= needed
    begins, first = one.onset.at, other.onset.at if other.onset.between is None else None
    last = first
    if other.onset.between is not None:
        first, last = other.onset.between
    if begins == 0.0 and lasts == math.inf:
        return True
    return (
        begins is not None
        and first is not None
        and last is not None
        and begins <= first
        and begins + lasts >= last + needed
    )


def _heard(architecture: Architecture) -> tuple[set[str], set[str]]:
    """Find the channels that can act, or that such look at, and the sensors that they look at."""
    switch = architecture.switch
    open_, channels = [*switch.priority, switch.default], set[str]()
    sensors: set[str] = set()
    while open_:
        name = open_.pop()
        if name in channels or name not in architecture.channels:
            continue
        channels.add(name)
        for link in architecture.channels[name].links:
            if link.startswith("channels."):
                open_.append(link.removeprefix("channels."))
            else:
                sensors.add(link.removeprefix(HEALTH))
    return channels, sensors
