"""From a distribution that a sweep declares to the axis and the law behind it."""

from __future__ import annotations

import csv
import hashlib
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.errors import SweepError, suggest
from adeye.kernel.relation import differences
from adeye.spec.distribution import Distribution
from adeye.spec.document import require_plain
from adeye.sweep.law import Law, require_mass
from adeye.units import UNITS, decimal

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    from adeye.errors import SourceLocation
    from adeye.spec.load import OddFiles
    from adeye.spec.odd import Level

MAX_BYTES: Final = 50_000_000
"""Largest data file that is read."""


@dataclass(frozen=True)
class DataFile:
    """Numbers of one column of a data file, and what identifies them.

    Attributes:
        path: As the ODD writes it.
        column: Header of the column.
        digest: sha256 of the whole file, in hex.
        values: (N,) in SI, in ascending order.
        ends: The least and the largest as they are written, with the unit.
    """

    path: str
    column: str
    digest: str
    values: NDArray[np.float64]
    ends: tuple[Level, Level]


def law_of(
    spec: Distribution,
    folder: Path,
    name: str,
    value: Callable[[Level], float],
    where: SourceLocation,
) -> tuple[Law, tuple[Level, ...]]:
    """Read a declared distribution of a scenario parameter.

    Args:
        spec: What the sweep declares.
        folder: Of the ODD, for data files.
        name: Of the axis, for messages.
        value: Reads a quantity of the parameter in SI.
        where: Place of the axis.

    Returns:
        The law, and values as text that tell its unit and its ends.

    Raises:
        SweepError: A quantity is not acceptable, or nothing is left between the ends.
    """
    texts: tuple[Level, ...]
    if spec.choice is not None:
        return Law("choice", weights=tuple(spec.choice.values())), levels_of(spec)
    if spec.uniform is not None:
        low, high = map(value, spec.uniform)
        law, texts = Law("uniform", low, high), spec.uniform
    elif spec.empirical is not None:
        data = read_data(spec, folder, name, where)
        # Which refuses another unit than the parameter's.
        low, high = map(value, data.ends)
        return Law("empirical", low, high, values=data.values), data.ends
    else:
        law, texts = _bell(spec, name, value, where)
    require_mass(law, name, where)
    return law, texts


def levels_of(spec: Distribution) -> tuple[Level, ...]:
    """Give the values of a choice, whose keys are text in YAML, as they would stand in a list."""
    return tuple(_level(text) for text in spec.choice or {})


def _level(text: str) -> Level:
    if text in {"true", "false"}:
        return text == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _bell(
    spec: Distribution, name: str, value: Callable[[Level], float], where: SourceLocation
) -> tuple[Law, tuple[Level, ...]]:
    shape = spec.normal or spec.lognormal
    assert shape is not None
    low = -math.inf if shape.min is None else value(shape.min)
    high = math.inf if shape.max is None else value(shape.max)
    ends = tuple(end for end in (shape.min, shape.max) if end is not None)
    if spec.normal is not None:
        # A mean may lie beyond the ends; a deviation is a difference, no value of the parameter.
        mean, sd = value(spec.normal.mean), value(spec.normal.sd)
        if not sd > 0.0:
            raise SweepError(
                f"{name}: a standard deviation of {spec.normal.sd} is not positive", where=where
            )
        return Law("normal", low, high, mean, sd), (spec.normal.mean, *ends)
    assert spec.lognormal is not None
    median = value(spec.lognormal.median)
    if not median > 0.0:
        raise SweepError(
            f"{name}: a lognormal median of {spec.lognormal.median} is not positive", where=where
        )
    if high <= 0.0:
        raise SweepError(f"{name}: a lognormal value is never below {shape.max}", where=where)
    law = Law("lognormal", max(low, 0.0), high, math.log(median), spec.lognormal.sigma)
    return law, (spec.lognormal.median, *ends)


def read_data(spec: Distribution, folder: Path, name: str, where: SourceLocation) -> DataFile:
    """Read the column of a data file.

    Args:
        spec: An empirical distribution.
        folder: Of the ODD.
        name: Of the axis, for messages.
        where: Its place.

    Raises:
        SweepError: There is no such file, column or unit, or a value is not a finite number.
    """
    assert spec.empirical is not None
    assert spec.column is not None
    if spec.unit is not None and spec.unit not in UNITS:
        raise SweepError(
            f"{name}: {spec.unit!r} is no unit", where=where, remedy=suggest(spec.unit, UNITS)
        )
    path = folder / spec.empirical
    try:
        require_plain(path, MAX_BYTES)
        content = path.read_bytes()
        rows = list(csv.reader(content.decode("utf-8-sig").splitlines()))
    except (OSError, ValueError, csv.Error) as error:
        raise SweepError(
            f"{name}: {spec.empirical!r} cannot be read: {error}",
            where=where,
            remedy="Name a text file with comma-separated values, relative to the ODD.",
        ) from error
    headers = [item.strip() for item in rows[0]] if rows else []
    if spec.column not in headers:
        raise SweepError(
            f"{name}: {spec.empirical} has no column {spec.column!r}",
            where=where,
            remedy=suggest(spec.column, headers),
        )
    at = headers.index(spec.column)
    numbers = [
        _number(row, at, f"{path}:{line}", name, where)
        for line, row in enumerate(rows[1:], start=2)
        if row
    ]
    if not numbers:
        raise SweepError(f"{name}: {spec.empirical} has no values", where=where)
    written = np.sort(np.array(numbers)) + 0.0
    ends: tuple[Level, Level] = (float(written[0]), float(written[-1]))
    values = written
    if spec.unit:
        unit = UNITS[spec.unit]
        ends = (f"{ends[0]!r} {spec.unit}", f"{ends[1]!r} {spec.unit}")
        values = written * unit.numerator / unit.denominator
    digest = hashlib.sha256(content).hexdigest()
    return DataFile(spec.empirical, spec.column, digest, values, ends)


def data_digests(files: OddFiles) -> dict[str, str]:
    """Hash the data files that the distributions of an ODD name: sha256 in hex, by path."""
    found: dict[str, str] = {}
    for number, use in enumerate(files.odd.spec.scenarios):
        for name, axis in use.sweep.parameters.items():
            if isinstance(axis, Distribution) and axis.empirical is not None:
                where = files.odd.locate(("scenarios", number, "sweep", "parameters", name))
                data = read_data(axis, files.odd.path.parent, name, where)
                found[data.path] = data.digest
    return found


def _number(row: list[str], at: int, place: str, name: str, where: SourceLocation) -> float:
    text = row[at].strip() if at < len(row) else ""
    try:
        number = decimal(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise SweepError(
            f"{name}: {place}: {text!r} is not a finite number",
            where=where,
            remedy="Remove the row, or write a number; the unit stands in the ODD.",
        )
    return number


def require_within(law: Law, name: str, ends: tuple[float, float], where: SourceLocation) -> None:
    """Refuse a law that can yield what is outside the range of its parameter.

    Raises:
        SweepError: It can.
    """
    low, high = ends
    if differences(law.low, low) < 0.0 or differences(law.high, high) > 0.0:
        raise SweepError(
            f"{name}: a {law.kind} distribution from {law.low:g} to {law.high:g} (SI) leaves the "
            f"scenario's range from {low:g} to {high:g}",
            where=where,
            remedy="Give it min and max inside the range, or widen the range in the scenario.",
        )
