"""The zoo: channels that misbehave, and the outcome that a run with each of them must have.

A conformance test for what contains channels: whatever a channel does, its run gets the outcome
that says so, and no bit of another run changes. ``ANIMALS`` are one program, ``program.py``;
``values.animal`` says which one it is. ``OBJECTS`` and ``HERDS`` are plug-ins in Python, the two
classes of ``plugin.py``; they have a parameter ``animal``. The product imports nothing of it. Begin
with ``ANIMALS``.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from adeye.packaged import packaged_yaml

COMPLETED: Final = "completed"
PROGRAM: Final = Path(__file__).with_name("program.py")
PLUGIN: Final = Path(__file__).with_name("plugin.py")
TIMEOUT: Final = "channel_timeout"
HANG_DEADLINE_S: Final = 2.0
"""Of an answer of those that hang: short enough to wait for."""
DEADLINE_S: Final = 60.0
"""Of the others: all of them start at the same time, maybe on a busy machine."""


@dataclass(frozen=True, slots=True)
class Animal:
    """One way to misbehave.

    Attributes:
        outcome: What the run's outcome must be.
        detail: A part of the words that must say why; empty for a run that is completed.
        is_machine_dependent: Whether its result must be marked so.
        parameters: What it needs beside the usual.
    """

    outcome: str
    detail: str = ""
    is_machine_dependent: bool = False
    parameters: Mapping[str, Any] = field(default_factory=dict)


def _read() -> Iterator[Mapping[str, Animal]]:
    """Read the animals of each kind, in the order of ``animals.yaml``."""
    written = packaged_yaml(__name__, "animals.yaml")
    for animals in written.values():
        yield {name: Animal(**item) for name, item in animals.items()}


ANIMALS, OBJECTS, HERDS = _read()
"""Every animal by its name: those that are a program, a Python object for each run, and a channel
on a batch of two runs."""

FROM_TICK: Final = 5
"""Observation from which they misbehave."""


def settle(folder: Path) -> str:
    """Put the program and the plug-ins of the zoo into the folder of an architecture.

    The plug-ins are ``./zoo_plugin.py:One`` and ``./zoo_plugin.py:Herd``.

    Returns:
        Name of the program.
    """
    shutil.copyfile(PROGRAM, folder / "zoo.py")
    shutil.copyfile(PLUGIN, folder / "zoo_plugin.py")
    return "./zoo.py"


def parameters(name: str = "", *, program: str = "./zoo.py") -> dict[str, Any]:
    """Return the parameters of a channel of ``kind: process`` that is an animal.

    Args:
        name: Of the animal; without, it behaves.
        program: As ``settle`` returned it.
    """
    animal = ANIMALS[name] if name else Animal(COMPLETED)
    return {
        "command": ["python3", "-I", "-S", "-B", program],
        "values": {"animal": name, "from_tick": FROM_TICK},
        "start_deadline": f"{DEADLINE_S:g} s",
        "step_deadline": f"{HANG_DEADLINE_S if animal.outcome == TIMEOUT else DEADLINE_S:g} s",
        **animal.parameters,
    }
