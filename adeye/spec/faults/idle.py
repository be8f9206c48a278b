"""Planned faults that change nothing, as far as their records and the architecture tell."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, TypeAlias

from adeye.spec.architecture import HEALTH

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from adeye.spec.architecture import Architecture
    from adeye.spec.faults.base import Fault

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
