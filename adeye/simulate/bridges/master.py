"""An FMU by itself, in a process of its own, stepped from a table of inputs."""

from __future__ import annotations

import csv
import math
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from adeye.errors import InputError, SpecError, UsageError
from adeye.outputs import reads
from adeye.simulate.bridges import fmi
from adeye.simulate.bridges.fmus import Fmus, Step, Wired
from adeye.simulate.bridges.programs import Broken
from adeye.spec.programs import FmuUse
from adeye.units import decimal, shown

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

MOST_STEPS: Final = 10_000_000
TIME: Final = "time"


class Table(NamedTuple):
    """Inputs over time.

    Attributes:
        path: Where they were read.
        times: [s], none below the one before.
        columns: Texts by variable, as long as the times.
        lines: Line of each row.
    """

    path: Path
    times: list[float]
    columns: dict[str, list[str]]
    lines: list[int]


def read_table(path: Path) -> Table:
    """Read inputs over time: a CSV file with a column ``time``.

    Raises:
        InputError: It cannot be read, or a row is wrong.
    """
    reads(path)
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            reader = csv.reader(stream, strict=True)
            header = next(reader, [])
            rows = [(reader.line_num, row) for row in reader if row]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(
            f"{path}: cannot be read as CSV: {error}", remedy="Check the file."
        ) from error
    if TIME not in header or len(set(header)) != len(header) or not rows:
        raise InputError(
            f"{path}:1: needs a column time, each name once, and rows",
            remedy="Write time [s] first, then a column for each input.",
        )
    times: list[float] = []
    for line, row in rows:
        if len(row) != len(header):
            raise InputError(
                f"{path}:{line}: has {len(row)} values, not {len(header)}", remedy="Mend the row."
            )
        time = _number(row[header.index(TIME)], path, line)
        if times and time < times[-1]:
            raise InputError(
                f"{path}:{line}: time {time:g} is before {times[-1]:g}", remedy="Sort the rows."
            )
        times.append(time)
    columns = {name: [row[at] for _, row in rows] for at, name in enumerate(header) if name != TIME}
    return Table(path, times, columns, [line for line, _ in rows])


def _number(text: str, path: Path, line: int) -> float:
    try:
        value = decimal(text.strip())
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(
            f"{path}:{line}: {shown(text)} is no finite number", remedy="Mend the row."
        )
    return value


def simulate(
    file: Path, stop: float, step: float, table: Table | None, start: Mapping[str, Any]
) -> tuple[list[str], Iterator[list[Any]]]:
    """Step an FMU from 0 to an end, and read all its outputs at each step.

    Args:
        file: The FMU.
        stop: End [s].
        step: Length of a step [s].
        table: Inputs; None for those that it starts with.
        start: Start values by variable.

    Returns:
        Names of the columns, and the rows: time [s] and the outputs in the FMU's own units.

    Raises:
        InputError: The file, an input or the times are wrong, or the FMU failed.
    """
    count = _steps(stop, step)
    description = fmi.read_description(file)
    fmi.require_steppable(description, file.name)
    fmi.require_start(description, start)
    outputs = [
        item.name
        for item in description.variables.values()
        if item.causality == "output" and item.is_scalar
    ]
    columns: dict[str, Column] = {} if table is None else _inputs(description, table)
    use = FmuUse(
        file=f"./{file.name}", start=dict(start), step_deadline="60 s", run_deadline="86400 s"
    )
    inputs, plain = (
        [fmi.Wire(name, name, 1.0, 0.0) for name in item] for item in (columns, outputs)
    )
    fmus = Fmus([use], [Wired(file.resolve(), inputs, plain, [])])
    return [TIME, *outputs], _rows(fmus, file, table, columns, (count, step))


def _steps(stop: float, step: float) -> int:
    count = stop / step if step > 0.0 else math.nan
    if not (math.isfinite(count) and 0.0 <= count <= MOST_STEPS):
        raise UsageError(
            f"--stop {stop:g} --step {step:g} are no steps",
            remedy=f"Give times above 0 and at most {MOST_STEPS:,} steps.",
        )
    if abs(count - round(count)) > 1e-6 * max(1.0, count):
        raise UsageError(
            f"--stop {stop:g} is no multiple of --step {step:g}",
            remedy=f"End at {math.floor(count) * step:g} or {math.ceil(count) * step:g}.",
        )
    return round(count)


class Column(NamedTuple):
    """An input over time; one that is not continuous holds its value until the next row."""

    values: list[Any]
    is_continuous: bool


def _inputs(description: fmi.Description, table: Table) -> dict[str, Column]:
    """Read the columns of a table as what the input variables are."""
    found = {}
    for name, texts in table.columns.items():
        try:
            variable = fmi.variable_of(description, name, "input")
        except SpecError as error:
            raise InputError(f"{table.path}:1: {error}") from error
        is_float = variable.kind in fmi.FLOATS
        rows = zip(texts, table.lines, strict=True)
        values = [_value(variable.kind, text.strip(), table.path, line) for text, line in rows]
        found[name] = Column(values, is_float and variable.variability == "continuous")
    return found


def _value(kind: str, text: str, path: Path, line: int) -> Any:
    if kind == "String":
        return text
    if kind == "Boolean" and text in {"true", "false"}:
        return text == "true"
    if kind in fmi.FLOATS:
        return _number(text, path, line)
    with suppress(ValueError):
        if fmi.takes(kind, value := int(text)):
            return value
    raise InputError(f"{path}:{line}: {shown(text)} is no {kind}", remedy="Write a whole number.")


def _rows(
    fmus: Fmus,
    file: Path,
    table: Table | None,
    columns: Mapping[str, Column],
    steps: tuple[int, float],
) -> Iterator[list[Any]]:
    count, size = steps
    try:
        broken = fmus.greet()
        if broken:
            raise _failed(file, broken[0], 0.0)
        for number in range(-1, count):
            begin = max(0, number) * size
            values = [] if table is None else _at(table, columns, begin)
            length = size if number >= 0 else 0.0
            found = fmus.ask({0: Step(values, begin, length, is_before=True)})[0]
            if isinstance(found, Broken):
                raise _failed(file, found, begin)
            yield [(number + 1) * size, *found]
    finally:
        fmus.close()


def _at(table: Table, columns: Mapping[str, Column], time: float) -> list[Any]:
    """Return the inputs at a time: floats between rows, other values of the last row before."""
    times = table.times
    after = next((row for row, at in enumerate(times) if at > time), len(times))
    row = max(0, after - 1)
    found = []
    for column in columns.values():
        value = column.values[row]
        if column.is_continuous and 0 < after < len(times):
            share = (time - times[row]) / (times[after] - times[row])
            value += share * (column.values[after] - value)
        found.append(value)
    return found


def _failed(file: Path, broken: Broken, time: float) -> InputError:
    return InputError(
        f"{shown(file.name)} failed at {time:g} s: {broken.detail}",
        remedy="Its messages are above; other FMUs are not touched by that.",
    )
