"""A declared distribution in SI: what it can yield, and its quantiles.

A draw is the quantile of a number on (0, 1), so a law serves independent draws and space-filling
designs alike. The normal quantile is ``scipy.special.ndtri``, within some units in the last place;
another version of SciPy may round another way. That is why points are stored as values: what a run
depends on is the value, not the way to it.
"""

from __future__ import annotations

import csv
import hashlib
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.errors import SweepError, placed, suggest
from adeye.kernel.relation import differences
from adeye.outputs import require_plain
from adeye.spec.odd import Distribution
from adeye.units import UNITS, decimal

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from contextlib import AbstractContextManager
    from pathlib import Path

    from numpy.typing import NDArray

    from adeye.errors import SourceLocation
    from adeye.spec.load import OddFiles
    from adeye.spec.odd import Level

# --- A declared distribution in SI: what it can yield, and its quantiles --------------------------


@dataclass(frozen=True, eq=False)
class Law:
    """How the values of one axis are distributed; each kind uses its own fields.

    Attributes:
        kind: ``uniform``, ``normal``, ``lognormal``, ``empirical`` or ``choice``.
        low: Least value that it can yield, minus infinity if there is none.
        high: Largest one.
        centre: Mean of the normal, or of the logarithm.
        spread: Standard deviation of the same.
        values: (N,) of an empirical law, in ascending order.
        weights: (L,) of the levels of a choice.
    """

    kind: str
    low: float = -math.inf
    high: float = math.inf
    centre: float = 0.0
    spread: float = 1.0
    values: NDArray[np.float64] | None = None
    weights: tuple[float, ...] = ()

    def quantile(self, share: NDArray[np.float64]) -> NDArray[np.float64]:
        """Give the values below which the law lies with some probability.

        Args:
            share: (N,) probabilities, 0 < share < 1.

        Returns:
            (N,) values in SI; of a choice the numbers of its levels.
        """
        if self.kind == "uniform":
            return self.low + (self.high - self.low) * share
        if self.kind == "choice":
            ends = np.cumsum(self.weights)
            found = np.searchsorted(ends, share, side="right")
            return np.minimum(found, len(ends) - 1).astype(np.float64)
        if self.kind == "empirical":
            assert self.values is not None
            at = np.minimum((share * len(self.values)).astype(np.int64), len(self.values) - 1)
            return self.values[at]
        if self.kind == "lognormal":
            low = math.log(self.low) if self.low > 0.0 else -math.inf
            high = math.log(self.high)
            made: NDArray[np.float64] = np.exp(self._normal(share, low, high))
        else:
            made = self._normal(share, self.low, self.high)
        # Rounding may not lead out of the ends.
        return np.minimum(np.maximum(made, self.low), self.high)

    def mass(self) -> float:
        """Tell how much of the normal law lies between the ends."""
        from scipy.special import ndtr

        low, high = self._ends()
        # The upper tail as the lower one of the mirror image, where numbers are finer.
        return float(ndtr(-low) - ndtr(-high) if low > 0.0 else ndtr(high) - ndtr(low))

    def _ends(self) -> tuple[float, float]:
        low, high = self.low, self.high
        if self.kind == "lognormal":
            low, high = (math.log(low) if low > 0.0 else -math.inf), math.log(high)
        return (low - self.centre) / self.spread, (high - self.centre) / self.spread

    def _normal(self, share: NDArray[np.float64], low: float, high: float) -> NDArray[np.float64]:
        from scipy.special import ndtr, ndtri

        first, last = (low - self.centre) / self.spread, (high - self.centre) / self.spread
        # Above the mean the same law upside down, whose tail is not lost near 1.
        side = -1.0 if first > 0.0 else 1.0
        below, above = ndtr(side * first), ndtr(side * last)
        made: NDArray[np.float64] = ndtri(below + (above - below) * share)
        return self.centre + side * self.spread * made


def of_axis(name: str, where: SourceLocation) -> AbstractContextManager[None]:
    """Say of an error that is raised in here which axis it is about, and where it stands."""
    return placed(where, f"{name}: ", caught=SweepError, raised=SweepError)


def require_mass(law: Law) -> None:
    """Refuse a law that its ends cut off so far that nothing is left to draw from.

    Raises:
        SweepError: The ends are empty, or hold less than a billionth of the law.
    """
    if not law.low < law.high:
        raise SweepError(
            f"from {law.low:g} to {law.high:g} (SI) nothing is left",
            remedy="Give min below max.",
        )
    if law.kind in {"normal", "lognormal"} and not law.mass() >= 1e-9:
        raise SweepError(
            f"only {law.mass():.2g} of the {law.kind} distribution lies between its ends",
            remedy="Move min and max towards the mean.",
        )


# --- From a distribution that a sweep declares to the axis and the law behind it ------------------

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
    spec: Distribution, folder: Path, value: Callable[[Level], float]
) -> tuple[Law, tuple[Level, ...]]:
    """Read a declared distribution of a scenario parameter.

    Args:
        spec: What the sweep declares.
        folder: Of the ODD, for data files.
        value: Reads a quantity of the parameter in SI.

    Returns:
        The law, and values as text that tell its unit and its ends.

    Raises:
        SweepError: A quantity is not acceptable, or nothing is left between the ends.
    """
    texts: tuple[Level, ...]
    if spec.uniform is not None:
        low, high = map(value, spec.uniform)
        law, texts = Law("uniform", low, high), spec.uniform
    elif spec.empirical is not None:
        data = read_data(spec, folder)
        # Which refuses another unit than the parameter's.
        low, high = map(value, data.ends)
        return Law("empirical", low, high, values=data.values), data.ends
    else:
        law, texts = _bell(spec, value)
    require_mass(law)
    return law, texts


def levels_of(spec: Distribution | Sequence[Level]) -> tuple[Level, ...]:
    """Return a list, or the values of a choice, whose keys are text in YAML, as in one."""
    if isinstance(spec, Distribution):
        return tuple(_level(text) for text in spec.choice or {})
    return tuple(spec)


def _level(text: str) -> Level:
    if text in {"true", "false"}:
        return text == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _bell(spec: Distribution, value: Callable[[Level], float]) -> tuple[Law, tuple[Level, ...]]:
    shape = spec.normal or spec.lognormal
    assert shape is not None
    low = -math.inf if shape.min is None else value(shape.min)
    high = math.inf if shape.max is None else value(shape.max)
    ends = tuple(end for end in (shape.min, shape.max) if end is not None)
    if spec.normal is not None:
        # A mean may lie beyond the ends; a deviation is a difference, no value of the parameter.
        mean, sd = value(spec.normal.mean), value(spec.normal.sd)
        if not sd > 0.0:
            raise SweepError(f"a standard deviation of {spec.normal.sd} is not positive")
        return Law("normal", low, high, mean, sd), (spec.normal.mean, *ends)
    assert spec.lognormal is not None
    median = value(spec.lognormal.median)
    if not median > 0.0:
        raise SweepError(f"a lognormal median of {spec.lognormal.median} is not positive")
    if high <= 0.0:
        raise SweepError(f"a lognormal value is never below {shape.max}")
    law = Law("lognormal", max(low, 0.0), high, math.log(median), spec.lognormal.sigma)
    return law, (spec.lognormal.median, *ends)


def read_data(spec: Distribution, folder: Path) -> DataFile:
    """Read the column of a data file.

    Args:
        spec: An empirical distribution.
        folder: Of the ODD.

    Raises:
        SweepError: There is no such file, column or unit, or a value is not a finite number.
    """
    assert spec.empirical is not None
    assert spec.column is not None
    if spec.unit is not None and spec.unit not in UNITS:
        raise SweepError(f"{spec.unit!r} is no unit", remedy=suggest(spec.unit, UNITS))
    path = folder / spec.empirical
    try:
        require_plain(path, MAX_BYTES)
        content = path.read_bytes()
        rows = list(csv.reader(content.decode("utf-8-sig").splitlines()))
    except (OSError, ValueError, csv.Error) as error:
        raise SweepError(
            f"{spec.empirical!r} cannot be read: {error}",
            remedy="Name a text file with comma-separated values, relative to the ODD.",
        ) from error
    headers = [item.strip() for item in rows[0]] if rows else []
    if headers.count(spec.column) > 1:
        raise SweepError(
            f"{spec.empirical} has column {spec.column!r} {headers.count(spec.column)} times",
            remedy="Rename the others.",
        )
    for line, row in enumerate(rows[1:], start=2):
        if row and len(row) != len(headers):
            raise SweepError(
                f"{path}:{line}: a row of {len(row)} cells, and {len(headers)} columns",
                remedy="Give each row a cell for each column; decimals are written with a point.",
            )
    if spec.column not in headers:
        raise SweepError(
            f"{spec.empirical} has no column {spec.column!r}",
            remedy=suggest(spec.column, headers),
        )
    at = headers.index(spec.column)
    numbers = [
        _number(row, at, f"{path}:{line}") for line, row in enumerate(rows[1:], start=2) if row
    ]
    if not numbers:
        raise SweepError(f"{spec.empirical} has no values")
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
                with of_axis(name, where):
                    data = read_data(axis, files.odd.path.parent)
                found[data.path] = data.digest
    return found


def _number(row: list[str], at: int, place: str) -> float:
    text = row[at].strip() if at < len(row) else ""
    try:
        number = decimal(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise SweepError(
            f"{place}: {text!r} is not a finite number",
            remedy="Remove the row, or write a number; the unit stands in the ODD.",
        )
    return number


def require_within(law: Law, ends: tuple[float, float]) -> None:
    """Refuse a law that can yield what is outside the range of its parameter.

    Raises:
        SweepError: It can.
    """
    low, high = ends
    if differences(law.low, low) < 0.0 or differences(law.high, high) > 0.0:
        raise SweepError(
            f"a {law.kind} distribution from {law.low:g} to {law.high:g} (SI) leaves the "
            f"scenario's range from {low:g} to {high:g}",
            remedy="Give it min and max inside the range, or widen the range in the scenario.",
        )
