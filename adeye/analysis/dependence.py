"""What the channels of an architecture share: common causes that could fail them together.

Read from the files alone, nothing is simulated. It lists what the files and the package show and no
more: what is left out of them (one supplier, one clock, one wiring harness) has to be found by a
dependent failure analysis of the vehicle itself.
"""

from __future__ import annotations

import posixpath
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Final, Literal, get_args

from adeye.spec.architecture import ACTUATORS, HEALTH
from adeye.spec.channels import (
    CommandChannel,
    FmuChannel,
    OutsideChannel,
    PluginChannel,
    PolicyChannel,
    RemoteChannel,
    SafetyChannel,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from adeye.spec.architecture import Architecture
    from adeye.spec.channels import Channel
    from adeye.spec.concept import Element

Kind = Literal[
    "sensor", "ego_estimate", "map", "resource", "element", "code", "influence", "switch", "vehicle"
]

WORDS: Final[Mapping[Kind, str]] = {kind: kind.replace("_", " ") for kind in get_args(Kind)}
"""The kinds of what is shared, in the order in which they are listed."""

EGO_ESTIMATE: Final = ("localisation", "ground_truth", "gnss", "imu")
"""Kinds of sensors that tell a channel where the ego is and how it moves."""

HOOKED: Final = ("nominal", "safety", "trajectory")
"""Kinds of built-in channels that let faults into themselves."""

WRONG: Final = "plausible_but_wrong"
"""Model that a mistake in code is tried as: any command that nothing tells from a right one."""

PERCEPTION: Final = "simulate/channels/perception/step.py"
PLANNED: Final = "safety, stop: planned"

BUILT_IN_CODE: Final[Mapping[str, tuple[str, tuple[str, ...]]]] = {
    PERCEPTION: (
        "makes tracks of detections and estimates where the ego is",
        ("nominal", "safety", PLANNED, "trajectory", "policy", "fmu"),
    ),
    "simulate/channels/corridor.py": (
        "finds what is in the path and the deceleration that it calls for",
        ("nominal", "safety", PLANNED, "fmu"),
    ),
    "simulate/channels/driving.py": (
        "follows a vehicle and steers along a lane",
        ("nominal", "safety", PLANNED, "trajectory", "reference"),
    ),
    "simulate/channels/policy.py": (
        "describes the ego and the objects around it by numbers",
        ("policy", "fmu"),
    ),
    "simulate/channels/trajectory/cost.py": (
        "predicts where objects will be",
        ("nominal", PLANNED, "trajectory"),
    ),
    "simulate/channels/trajectory/channel.py": (
        "steers along a path that is planned",
        (PLANNED, "trajectory"),
    ),
    "kernel/profiles.py": (
        "paths and speed profiles of what is planned",
        (PLANNED, "trajectory"),
    ),
    "kernel/road.py": (
        "turns places on the road into places in the plane, and back",
        ("nominal", "safety", PLANNED, "trajectory", "policy", "fmu", "reference"),
    ),
}
"""Code of the package that decides something, by its place in it: what it does, and which
channels use it. The numerics below it (arithmetic, compiler) all built-in channels share."""


@dataclass(frozen=True, slots=True)
class Shared:
    """One thing that two channels share.

    Attributes:
        kind: Of the thing.
        what: Its name.
        how: How both depend on it.
        targets: What a fault entry would have to hit, all at once, to see it fail.
        model: Model of those faults, where only one fits; empty otherwise.
    """

    kind: Kind
    what: str
    how: str
    targets: tuple[str, ...] = ()
    model: str = ""


@dataclass(frozen=True, slots=True)
class ChannelPair:
    """Two channels that the switch may give authority to.

    Attributes:
        first: The one of higher priority.
        second: The other.
        shared: What they share, by kind.
        unstated: Parts of either of which the concept states no resource, so that nothing is known
            about what they share with others.
        unread: Those of the two that have code of their own. Which file, package or program that is
            is compared; what it imports and reads, also of this package, is not.
    """

    first: str
    second: str
    shared: tuple[Shared, ...]
    unstated: tuple[str, ...]
    unread: tuple[str, ...]

    def count(self, kind: Kind) -> int:
        """Number of shared things of a kind."""
        return sum(item.kind == kind for item in self.shared)


@dataclass(frozen=True, slots=True)
class Dependencies:
    """What the channels of an architecture share.

    Attributes:
        architecture: Its id.
        title: Of the architecture.
        pairs: Every two channels of the switch's priority list; none for a single channel.
    """

    architecture: str
    title: str
    pairs: tuple[ChannelPair, ...]

    @property
    def count(self) -> int:
        """Number of shared things, over all pairs."""
        return sum(len(pair.shared) for pair in self.pairs)


def dependencies(architecture: Architecture, elements: Iterable[Element]) -> Dependencies:
    """List what every two channels share that the switch may give authority to.

    Args:
        architecture: As it is written; a sweep may vary it.
        elements: Of the concept, with their resources.
    """
    stated = {element.id: element.resources for element in elements}
    pairs = combinations(architecture.switch.priority, 2)
    return Dependencies(
        architecture.architecture,
        architecture.title,
        tuple(_pair(architecture, stated, first, second) for first, second in pairs),
    )


def _pair(
    architecture: Architecture, stated: Mapping[str, Sequence[str]], first: str, second: str
) -> ChannelPair:
    one = _Reach.of(architecture, first, second)
    other = _Reach.of(architecture, second, first)
    shared = [
        *_sensors(architecture, one, other),
        _map(architecture, first, second),
        *_resources(architecture, stated, one, other),
        *_code(architecture, first, second),
        *_influences(architecture, one, other),
        _switch(architecture, stated, one, other),
        Shared(
            "vehicle",
            "drive, brake, steering, tyres",
            "either drives by them, and knows them from the same record of the vehicle",
            (*(f"actuators.{name}" for name in ACTUATORS), "tyres"),
        ),
    ]
    order = list(WORDS)
    parts = dict.fromkeys((*one.parts, *other.parts))
    unstated = tuple(part for part in parts if not stated.get(_element(architecture, part) or ""))
    ordered = sorted(shared, key=lambda item: order.index(item.kind))
    unread = tuple(name for name in (first, second) if any(_own_code(architecture.channels[name])))
    return ChannelPair(first, second, tuple(ordered), unstated, unread)


@dataclass(frozen=True, slots=True)
class _Reach:
    """What a channel is made of and reads, without the other channel of the pair.

    What comes to it through that one is an influence of its own; listing everything behind it once
    more would hide what both really take from the same source.

    Attributes:
        channel: Its id.
        sensors: Sensors by id, with the channels through which they reach it; empty for a link.
        channels: Other channels whose commands it reads, itself or through others.
    """

    channel: str
    sensors: Mapping[str, tuple[str, ...]]
    channels: tuple[str, ...]

    @classmethod
    def of(cls, architecture: Architecture, channel: str, but: str) -> _Reach:
        """Follow the links of a channel, the shortest way first."""
        sensors: dict[str, tuple[str, ...]] = {}
        seen: dict[str, tuple[str, ...]] = {channel: ()}
        waiting = [channel]
        while waiting:
            name = waiting.pop(0)
            for link in architecture.channels[name].links:
                before = link.removeprefix("channels.")
                if link in architecture.sensors:
                    sensors.setdefault(link, seen[name])
                elif link.startswith("channels.") and before not in {*seen, but}:
                    seen[before] = (*seen[name], before)
                    waiting.append(before)
        return cls(channel, sensors, tuple(name for name in seen if name != channel))

    @property
    def parts(self) -> tuple[str, ...]:
        """Everything that it is made of, as targets of faults."""
        channels = (self.channel, *self.channels)
        return (
            *(f"channels.{name}" for name in channels),
            *(f"sensors.{name}" for name in self.sensors),
        )

    def way(self, sensor: str) -> str:
        """Say how a sensor reaches it."""
        through = self.sensors[sensor]
        return f"{self.channel} through {' and '.join(through)}" if through else self.channel


def _sensors(architecture: Architecture, one: _Reach, other: _Reach) -> Iterator[Shared]:
    for name in one.sensors:
        if name not in other.sensors:
            continue
        kind = architecture.sensors[name].kind
        is_ego = kind in EGO_ESTIMATE
        what = (
            "objects and the ego" if kind == "ground_truth" else "the ego" if is_ego else "objects"
        )
        yield Shared(
            "ego_estimate" if is_ego else "sensor",
            name,
            f"{kind}: what {one.way(name)} and {other.way(name)} know of {what}",
            (f"sensors.{name}",),
        )


def _map(architecture: Architecture, first: str, second: str) -> Shared:
    kinds = {name: architecture.channels[name].kind for name in (first, second)}
    both_read = all(kind in HOOKED for kind in kinds.values())
    how = (
        "both read one map"
        if both_read
        else "both are given one map; who has own code may not read it"
    )
    hooked = tuple(f"hooks.{name}" for name, kind in kinds.items() if kind in HOOKED)
    return Shared("map", "road map", how, hooked, "map_shifted" if hooked else "")


def _switch(
    architecture: Architecture, stated: Mapping[str, Sequence[str]], one: _Reach, other: _Reach
) -> Shared:
    how = f"one switch ({architecture.switch.policy}) passes on the command of either"
    own = stated.get(architecture.switch.realises or "", ())
    for reach in (one, other):
        elements = {_element(architecture, part) for part in reach.parts}
        used = {resource for element in elements for resource in stated.get(element or "", ())}
        if common := [resource for resource in own if resource in used]:
            how += f"; it has {' and '.join(common)} in common with {reach.channel}"
    return Shared("switch", "switch", how, ("switch",))


def _element(architecture: Architecture, part: str) -> str | None:
    """Name the element that a part realises."""
    sort, _, name = part.partition(".")
    if sort == "sensors":
        return architecture.sensors[name].realises
    return architecture.channels[name].realises


def _resources(
    architecture: Architecture, stated: Mapping[str, Sequence[str]], one: _Reach, other: _Reach
) -> Iterator[Shared]:
    by_element: tuple[dict[str, list[str]], dict[str, list[str]]] = ({}, {})
    by_resource: tuple[dict[str, list[str]], dict[str, list[str]]] = ({}, {})
    for reach, elements, resources in zip((one, other), by_element, by_resource, strict=True):
        for part in reach.parts:
            element = _element(architecture, part)
            if element is None:
                continue
            elements.setdefault(element, []).append(part)
            for resource in stated.get(element, ()):
                resources.setdefault(resource, []).append(part)
    for sort, (mine, theirs) in (("element", by_element), ("resource", by_resource)):
        for name, parts in mine.items():
            if name not in theirs:
                continue
            # One sensor that both read is listed as that.
            if sort == "element" and parts == theirs[name]:
                continue
            users = tuple(dict.fromkeys((*parts, *theirs[name])))
            how = f"{_names(parts)} for {one.channel}, {_names(theirs[name])} for {other.channel}"
            yield Shared("element" if sort == "element" else "resource", name, how, users)


def _names(parts: Sequence[str]) -> str:
    return ", ".join(part.partition(".")[2] for part in parts)


def _code(architecture: Architecture, first: str, second: str) -> Iterator[Shared]:
    channels = (first, second)
    targets = tuple(f"channels.{name}" for name in channels)
    one, other = architecture.channels[first], architecture.channels[second]
    for module, (text, users) in BUILT_IN_CODE.items():
        if _built_in(one) in users and _built_in(other) in users:
            if module == PERCEPTION and one.kind in HOOKED and other.kind in HOOKED:
                hooks = tuple(f"hooks.{name}" for name in channels)
                yield Shared("code", module, text, hooks, "tracks_lost")
            else:
                yield Shared("code", module, text, targets, WRONG)
    mine, theirs = dict(_own_code(one)), dict(_own_code(other))
    for name, what in mine.items():
        if name in theirs:
            yield Shared("code", name, what, targets, WRONG)


def _built_in(channel: Channel) -> str:
    """Name a channel as ``BUILT_IN_CODE`` does."""
    if isinstance(channel, SafetyChannel) and channel.parameters.stop == "planned":
        return PLANNED
    return channel.kind


def _own_code(channel: Channel) -> Iterator[tuple[str, str]]:
    """List the code and files from outside the package that a channel has, and what each is."""
    if isinstance(channel, PluginChannel):
        yield _source(channel.kind), "code of both plug-ins"
    if isinstance(channel, PolicyChannel):
        yield _source(channel.parameters.policy), "code of both policies"
    if isinstance(channel, CommandChannel):
        program, *rest = channel.parameters.command
        yield posixpath.normpath(program), "program of both, in a process of each one's own"
        for word in rest:
            if word.startswith("./"):
                yield posixpath.normpath(word), "file that both programs are given"
    if isinstance(channel, FmuChannel):
        yield posixpath.normpath(channel.parameters.file), "FMU of both"
    if isinstance(channel, RemoteChannel):
        yield channel.parameters.place.host, "host that both are on"
    if isinstance(channel, OutsideChannel):
        for name in channel.files:
            yield posixpath.normpath(name), "file that both read"


def _source(name: str) -> str:
    """Return the file, or the package, that a plug-in comes from."""
    source = name.rpartition(":")[0]
    return posixpath.normpath(source) if source.endswith(".py") else source.partition(".")[0]


def _influences(architecture: Architecture, one: _Reach, other: _Reach) -> Iterator[Shared]:
    for reads, is_read in ((one, other), (other, one)):
        reader, read = reads.channel, is_read.channel
        links = architecture.channels[reader].links
        if f"channels.{read}" in links:
            yield _influence(
                read,
                reader,
                f"{reader} reads the command and the state of {read}",
                f"channels.{read}",
            )
        for sensor in is_read.sensors:
            if f"{HEALTH}{sensor}" in links:
                yield _influence(
                    sensor,
                    reader,
                    f"{reader} reads whether {sensor}, by which {read} sees, delivers",
                    f"{HEALTH}{sensor}",
                )
    for name in (one.channel, other.channel):
        if "switch" in architecture.channels[name].links:
            how = f"{name} reads who acts, and so what the switch made of the other"
            yield _influence("switch", name, how, "switch")


def _influence(read: str, reader: str, how: str, link: str) -> Shared:
    what = f"{read} \N{RIGHTWARDS ARROW} {reader}"
    return Shared("influence", what, how, (f"links.{reader}.{link}",))
