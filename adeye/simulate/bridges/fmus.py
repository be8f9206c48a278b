"""The FMUs of a batch: one for each run, each driven by a program of its own."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from adeye.errors import SpecError
from adeye.plugins import locate_file
from adeye.simulate.bridges import fmi, fmu_program
from adeye.simulate.bridges.programs import INVALID_OUTPUT, Broken, Children, ceilings_of
from adeye.units import shown

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from adeye.spec.programs import FmuUse
    from adeye.units import Dimension


class Wired(NamedTuple):
    """An FMU that has been checked: its file, and how it is wired."""

    file: Path
    inputs: list[fmi.Wire]
    outputs: list[fmi.Wire]
    initial: list[fmi.Wire]


class Step(NamedTuple):
    """What an FMU is asked at a tick.

    Attributes:
        inputs: Values of its inputs in SI, in the order in which they are wired.
        begin: Where the step begins [s].
        size: Its length [s]; 0 for none.
        is_before: Whether the inputs are set before the step, else behind it.
    """

    inputs: Sequence[float]
    begin: float
    size: float
    is_before: bool


def wire_fmu(
    use: FmuUse,
    base_dir: Path,
    inputs: Sequence[tuple[str, str, Dimension]],
    outputs: Sequence[tuple[str, str, Dimension]],
    initial: Sequence[tuple[str, str, Dimension]] = (),
) -> Wired:
    """Read the description of an FMU and connect its variables, see ``fmi.wire``.

    Raises:
        InputError: fmpy is not installed.
        SpecError: There is no such FMU, or its variables do not fit.
    """
    file = locate_file(use.file, base_dir)
    description = fmi.read_description(file)
    fmi.require_steppable(description, file.name)
    fmi.require_start(description, use.start)
    wired = Wired(
        file,
        fmi.wire(description, inputs, "input"),
        fmi.wire(description, outputs, "output"),
        fmi.wire(description, initial, "parameter"),
    )
    for wire in wired.initial:
        if wire.variable in use.start:
            raise SpecError(
                f"{shown(wire.variable)} has a start value, and is what {wire.signal} is put into",
                remedy="Give one of the two.",
            )
    return wired


def wire_each(uses: Sequence[FmuUse], wire: Callable[[Any], Wired]) -> list[Wired]:
    """Wire the FMU of every run; what several runs use alike is read once."""
    wired: list[Wired] = []
    for run, use in enumerate(uses):
        first = uses.index(use)
        wired.append(wired[first] if first < run else wire(use))
    return wired


class Fmus:
    """The instances of a batch, each in a process of its own.

    Attributes:
        ticks: How often each has answered.
    """

    def __init__(
        self,
        uses: Sequence[FmuUse],
        wired: Sequence[Wired],
        starts: Sequence[Mapping[str, Any]] | None = None,
        reads: Sequence[Sequence[Path]] = (),
    ) -> None:
        """Start the program of every run; what they say of it is read by ``greet``.

        Args:
            uses: How the FMU of each run is used.
            wired: How it is wired.
            starts: Start values of each run beside those of its use.
            reads: Files that it may read beside its own, of each run.

        Raises:
            PlatformError: The system lets no program be started.
        """
        self._uses = uses
        self._wired = wired
        self.ticks = [0] * len(uses)
        self._children = Children(fmu_program.__file__)
        self._starts = [
            {**use.start, **more}
            for use, more in zip(uses, starts or [{}] * len(uses), strict=True)
        ]
        for run, use in enumerate(uses):
            own = (wired[run].file, *(reads[run] if reads else ()))
            self._children.start(run, (), ceilings_of(use), use.run_deadline, own)

    def greet(self) -> dict[int, Broken]:
        """Tell every program which FMU it drives; return those that do not."""
        lines = {}
        for run, (use, wires) in enumerate(zip(self._uses, self._wired, strict=True)):
            content = {
                "hello": fmu_program.GREETING,
                "file": str(wires.file),
                "start": self._starts[run],
                "inputs": [wire.variable for wire in wires.inputs],
                "outputs": [wire.variable for wire in wires.outputs],
                "sub_steps": use.sub_steps,
            }
            lines[run] = _line(content)
        starts = {run: use.start_deadline for run, use in enumerate(self._uses)}
        answers = self._children.ask(lines, starts)
        broken = {}
        for run, answer in answers.items():
            if isinstance(answer, Broken):
                broken[run] = answer
            elif _read(answer).get("hello") != fmu_program.GREETING:
                broken[run] = Broken(INVALID_OUTPUT, f"its program answers {answer[:60]!r}")
        return broken

    def step(self, asked: Mapping[int, Step]) -> dict[int, list[float] | Broken]:
        """Step the FMUs of some runs, and read their outputs.

        Args:
            asked: By run.

        Returns:
            Outputs in SI, each finite, in the order in which they are wired; or why there are none.
        """
        return {
            run: values if isinstance(values, Broken) else self._in_si(run, values)
            for run, values in self.ask(asked).items()
        }

    def ask(self, asked: Mapping[int, Step]) -> dict[int, list[Any] | Broken]:
        """Step the FMUs of some runs, and return their outputs as they are, see ``step``."""
        lines = {}
        for run, step in asked.items():
            wires = self._wired[run].inputs
            content = {
                "tick": self.ticks[run],
                "time": step.begin,
                "step": step.size,
                "set": [wire.to_variable(v) for wire, v in zip(wires, step.inputs, strict=True)],
                "before": step.is_before,
            }
            lines[run] = _line(content)
        deadlines = {run: self._uses[run].of_answer(begins=not self.ticks[run]) for run in lines}
        found: dict[int, list[Any] | Broken] = {}
        for run, answer in self._children.ask(lines, deadlines).items():
            found[run] = answer if isinstance(answer, Broken) else self._values(run, answer)
            self.ticks[run] += 1
        return found

    @property
    def strays(self) -> int:
        """Processes that the FMUs have left behind."""
        return self._children.strays

    def finish(self, patience: float) -> dict[int, str]:
        """Tell every program that its run is over, see ``Children.finish``."""
        return self._children.finish(patience)

    def end(self, run: int) -> None:
        """End the program of a run; it is not waited for."""
        self._children.end(run)

    def close(self) -> None:
        """End every program and wait until they have."""
        self._children.close()

    def _values(self, run: int, line: bytes) -> list[Any] | Broken:
        content = _read(line)
        values = content.get("values")
        is_whole = isinstance(values, list) and len(values) == len(self._wired[run].outputs)
        if content.get("tick") == self.ticks[run] and isinstance(values, list) and is_whole:
            return values
        return Broken(INVALID_OUTPUT, f"its program answers {line[:60]!r}")

    def _in_si(self, run: int, values: Sequence[Any]) -> list[float] | Broken:
        found = []
        for wire, value in zip(self._wired[run].outputs, values, strict=True):
            is_number = isinstance(value, int | float)
            number = float(wire.to_signal(value)) if is_number else math.nan
            if not math.isfinite(number):
                said = f"{wire.signal} {value} ({wire.variable}) is no finite number"
                return Broken(INVALID_OUTPUT, said)
            found.append(number)
        return found


def _line(content: Mapping[str, Any]) -> bytes:
    return json.dumps(content, separators=(",", ":")).encode("ascii") + b"\n"


def _read(line: bytes) -> dict[str, Any]:
    """Read a line of our own program, which an FMU may have spoilt."""
    try:
        content = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}
