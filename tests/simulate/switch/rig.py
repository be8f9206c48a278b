"""A switch of one run and what it is given: scripted states and commands, tick by tick."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from adeye.ports import SwitchContext, SwitchModel
from adeye.signals import (
    DEGRADED,
    FAULT,
    OK,
    REQUESTS_AUTHORITY,
    SILENT,
    ControlCommand,
    SwitchFaults,
)
from adeye.simulate.switch import make_switch
from adeye.spec.architecture import Switch

STEP = 0.05
IDS = ("nominal", "safety", "third")
NOMINAL, SAFETY, THIRD = range(3)


STATES = {"o": OK, "d": DEGRADED, "r": REQUESTS_AUTHORITY, "f": FAULT, "-": SILENT}


def said(text: str) -> list[tuple[int, ...]]:
    """Return states of channels: a word for a tick, times a number of them, a letter for each."""
    rows: list[tuple[int, ...]] = []
    for word in text.split():
        letters, _, count = word.partition("*")
        rows += [tuple(STATES[letter] for letter in letters)] * int(count or 1)
    return rows


def spec(**changes: object) -> Switch:
    """Return a switch with a fixed priority and changed keys."""
    values: dict[str, object] = {
        "policy": "fixed_priority",
        "priority": ["safety", "nominal"],
        "default": "nominal",
    }
    return Switch.model_validate(values | changes)


def switch(*specs: Switch, channels: tuple[str, ...] = IDS[:2]) -> SwitchModel:
    """Make a switch, one run for each spec."""
    return make_switch(SwitchContext(specs, channels, STEP))


def command(
    index: int, status: int, stamp: float, numbers: tuple[float, float] = (1.0, 0.1)
) -> ControlCommand:
    """Return the command of one channel in one run."""
    return ControlCommand(
        IDS[index],
        np.array([numbers[0]]),
        np.array([numbers[1]]),
        np.array([stamp]),
        np.array([status]),
    )


@dataclass(frozen=True)
class Tick:
    """What the switch decided at a tick.

    Attributes:
        channel: With authority.
        reason: Why.
        acceleration: Acting [m/s²].
        steering: Acting [rad].
    """

    channel: int
    reason: int
    acceleration: float
    steering: float


def ticks(
    made: SwitchModel,
    statuses: str | Sequence[Sequence[int]],
    commands: Sequence[Sequence[tuple[float, float]]] | None = None,
    *,
    stuck: Sequence[bool] | None = None,
    delay: Sequence[float] | None = None,
) -> list[Tick]:
    """Arbitrate fresh commands tick by tick.

    Args:
        made: A switch of one run.
        statuses: Of each channel at each tick, or the text of them. One that is silent here has
            never spoken; what it said before it fell silent would count.
        commands: Acceleration and steering angle of each channel at each tick.
        stuck: Whether the switch is stuck by a fault at each tick.
        delay: How late it is by a fault at each tick.
    """
    found = []
    for tick, row in enumerate(said(statuses) if isinstance(statuses, str) else statuses):
        time = tick * STEP
        numbers = [(1.0, 0.1)] * len(row) if commands is None else commands[tick]
        proposals = [
            command(k, status, -1.0 if status == SILENT else time, numbers[k])
            for k, status in enumerate(row)
        ]
        faults = SwitchFaults(
            np.array([bool(stuck and stuck[tick])]), np.array([delay[tick] if delay else 0.0])
        )
        acting, authority = made.arbitrate(time, proposals, faults)
        found.append(
            Tick(
                int(authority.channel[0]),
                int(authority.reason[0]),
                float(acting[0, 0]),
                float(acting[0, 1]),
            )
        )
    return found


def holders(found: Sequence[Tick]) -> list[int]:
    """Return who had authority at each tick."""
    return [tick.channel for tick in found]


def hands(found: Sequence[Tick]) -> str:
    """Return who had authority at each tick, by first letters; nobody is a dot."""
    return "".join("nst."[tick.channel] for tick in found)
