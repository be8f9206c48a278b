"""Drives one FMU for one run: a program of its own, asked by lines of JSON.

It is told ``{"hello", "file", "start", "inputs", "outputs", "sub_steps"}`` first and
``{"tick", "set", "before", "step", "time"}`` at each tick; it answers with
``{"hello": "adeye/fmu@1"}`` and ``{"tick", "values"}``. The FMU is initialised with the first
inputs. Later ones are set before or after the step, which begins at ``time`` and may have no
length; then the outputs are read. Whatever the FMU does to its process ends this one only, whose
end is told as that of any program.
"""

from __future__ import annotations

import ctypes
import importlib
import json
import math
import os
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

GREETING: Final = "adeye/fmu@1"
"""Name and version of these lines."""

IMPORTS: Final = "encodings.cp437", "fmpy.simulation", "fmpy.validation", "lxml.etree", "zipfile"
"""All that is imported until there is an instance: a fork of the warden has it."""

ACCESSORS: Final = {"Enumeration": {"2.0": "Integer", "3.0": "Int64"}}
"""By which type variables of a type are set and read, where that is not its own."""


ENDS: Final = {
    **{f"Int{bits}": (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) for bits in (8, 16, 32, 64)},
    **{f"UInt{bits}": (0, 2**bits - 1) for bits in (8, 16, 32, 64)},
}
"""Least and most of whole numbers by their type; beyond it C takes another number."""


class Instance:
    """One instance of an FMU for co-simulation, of FMI 2.0 or 3.0."""

    def __init__(self, description: Any, folder: str) -> None:
        """Load the binary and make an instance.

        Args:
            description: What ``fmpy.read_model_description`` returns.
            folder: Where the FMU's files are.
        """
        from fmpy.simulation import instantiate_fmu

        self._version: str = description.fmiVersion
        self._variables = {item.name: item for item in description.modelVariables}
        self._orders: dict[tuple[str, ...], list[tuple[str, list[int], list[int]]]] = {}
        self._fmu: Any = instantiate_fmu(folder, description, fmi_type="CoSimulation")
        self._fmu._call = partial(_called, self._fmu._call, self._fmu._functions)

    def begin(self, start: dict[str, Any], time: float, stop: float | None = None) -> None:
        """Set start values and initialise.

        Args:
            start: Values by variable.
            time: To begin at [s].
            stop: When it will end [s], where that is known.
        """
        constant = {"constant", "fixed", "tunable"}
        early = {
            name: value
            for name, value in start.items()
            if self._variables[name].variability in constant
            or self._variables[name].causality not in {"input"}
        }
        if self._version == "2.0":
            self._fmu.setupExperiment(startTime=time, stopTime=stop)
            self.set(list(early), list(early.values()))
            self._fmu.enterInitializationMode()
        else:
            self.set(list(early), list(early.values()))
            self._fmu.enterInitializationMode(startTime=time, stopTime=stop)
        late = {name: value for name, value in start.items() if name not in early}
        self.set(list(late), list(late.values()))
        self._fmu.exitInitializationMode()

    def set(self, names: Sequence[str], values: Sequence[Any]) -> None:
        """Set variables; a number becomes what the variable's type is."""
        for kind, at, references in self._by_type(tuple(names)):
            setter = getattr(self._fmu, f"set{self._accessor(kind)}")
            setter(references, [_typed(kind, values[place]) for place in at])

    def get(self, names: Sequence[str]) -> list[Any]:
        """Read variables of one value each."""
        found: list[Any] = [None] * len(names)
        for kind, at, references in self._by_type(tuple(names)):
            values = getattr(self._fmu, f"get{self._accessor(kind)}")(references)
            for place, value in zip(at, values, strict=True):
                found[place] = _plain(kind, value)
        return found

    def _by_type(self, names: tuple[str, ...]) -> list[tuple[str, list[int], list[int]]]:
        """Return the types of some variables, with their places among them and references."""
        if names not in self._orders:
            groups: dict[str, tuple[list[int], list[int]]] = {}
            for place, name in enumerate(names):
                variable = self._variables[name]
                at, references = groups.setdefault(variable.type, ([], []))
                at.append(place)
                references.append(variable.valueReference)
            self._orders[names] = [(kind, *group) for kind, group in groups.items()]
        return self._orders[names]

    def step(self, time: float, size: float) -> None:
        """Do one step.

        Args:
            time: It begins at [s].
            size: Its length [s].

        Raises:
            RuntimeError: The FMU did not reach its end.
        """
        done = self._fmu.doStep(currentCommunicationPoint=time, communicationStepSize=size)
        if done is None:
            return
        _, ends, is_early, reached = done
        if ends:
            msg = f"the FMU asked to end the simulation in the step from {time:g} s"
            raise RuntimeError(msg)
        if is_early and reached < time + size - 1e-9 * size:
            msg = f"the FMU returned from the step from {time:g} s at {reached:g} s"
            raise RuntimeError(msg)

    def _accessor(self, kind: str) -> str:
        return ACCESSORS.get(kind, {}).get(self._version, kind)


def _called(call: Callable[..., Any], functions: Any, name: str, *arguments: Any) -> Any:
    """Call a function of an FMU; fmpy takes a status below 0, which FMI does not have, for good."""
    status = call(name, *arguments)
    if functions[name].restype is ctypes.c_int and status < 0:
        msg = f"{name} returned status {status}, which there is not"
        raise RuntimeError(msg)
    return status


def _typed(kind: str, value: Any) -> Any:
    """Turn a number into what variables of a type take; other values stay as they are."""
    if kind == "Boolean":
        return bool(value)
    if kind in {"Real", "Float64", "Float32"}:
        return math.nan if value is None else float(value)
    if kind in {"String", "Binary"}:
        return value
    whole = round(value)
    low, high = ENDS.get(kind, ENDS["Int32"])
    if not low <= whole <= high:
        msg = f"{value:g} is no {kind}, which is from {low} to {high}"
        raise RuntimeError(msg)
    return whole


def _plain(kind: str, value: Any) -> Any:
    if isinstance(value, bytes):
        return value.hex() if kind == "Binary" else value.decode("utf-8", "replace")
    return bool(value) if kind == "Boolean" else value


def open_fmu(file: str, folder: str) -> Instance:
    """Extract an FMU that was checked before, also its description, and make an instance."""
    import fmpy

    fmpy.extract(file, folder)
    return Instance(fmpy.read_model_description(file, validate=False), folder)


def drive(hello: dict[str, Any], lines: Any, answer: Any) -> None:
    """Answer one line after the other until there are no more."""
    instance = open_fmu(hello["file"], str(Path("fmu").resolve()))
    answer({"hello": GREETING})
    inputs, outputs, parts = hello["inputs"], hello["outputs"], hello["sub_steps"]
    has_begun = False
    for line in lines:
        asked = json.loads(line)
        if not has_begun:
            first = dict(zip(inputs, asked["set"], strict=True))
            instance.begin({**hello["start"], **first}, asked["time"])
            has_begun = True
        elif asked["before"]:
            instance.set(inputs, asked["set"])
        for part in range(parts if asked["step"] else 0):
            size = asked["step"] / parts
            instance.step(asked["time"] + part * size, size)
        if not asked["before"]:
            instance.set(inputs, asked["set"])
        answer({"tick": asked["tick"], "values": instance.get(outputs)})


def prepare() -> None:
    """Import what it needs, also what fmpy imports when it is called, see ``warden``."""
    for name in IMPORTS:
        importlib.import_module(name)


def main() -> None:
    """Drive the FMU that the first line names; what it prints goes to standard error."""
    out = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)
    lines = sys.stdin.buffer

    def answer(content: dict[str, Any]) -> None:
        out.write(json.dumps(content, separators=(",", ":")).encode("ascii") + b"\n")

    hello = json.loads(lines.readline())
    try:
        drive(hello, lines, answer)
    except Exception as error:  # noqa: BLE001 - its last line of standard error is what is told
        sys.exit(" ".join(f"{type(error).__name__}: {error}".split()))
