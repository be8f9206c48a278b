"""Designs: which combinations of levels are points, and how many there are before expansion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from adeye.errors import SourceLocation, SweepError
from adeye.identity import stream_seed
from adeye.kernel.random import owner_id, uniform

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.spec.expression import Expression
    from adeye.sweep.axes import Axis

MAX_RAW_POINTS = 50_000_000
"""Combinations before constraints above which a sweep is refused without being expanded."""
CHUNK = 262_144
MAX_DRAWS_PER_SAMPLE = 1_000

Column = NDArray[np.float64] | NDArray[np.str_]


@dataclass(frozen=True, slots=True)
class Points:
    """The feasible points of a design, column by column.

    Attributes:
        columns: (N,) values in SI, or text, by the name of the axis.
        texts: (N,) values as written, by the name of the axis.
        raw: Number of combinations before constraints.
    """

    columns: dict[str, Column]
    texts: dict[str, NDArray[np.str_]]
    raw: int
    count: int


@dataclass(frozen=True, slots=True)
class Relation:
    """A truth-valued relation between parameters that a point must fulfil."""

    expression: Expression
    where: SourceLocation


def full_factorial(
    axes: Sequence[Axis],
    relations: Sequence[Relation],
    fixed: Mapping[str, float],
    where: SourceLocation,
) -> Points:
    """Combine every level of every axis and keep the feasible points.

    Args:
        axes: The varied quantities; the last one varies fastest.
        relations: What a point must fulfil.
        fixed: Values of the names that do not vary.
        where: Place of the sweep, for messages.

    Raises:
        SweepError: Too many combinations, or none is feasible.
    """
    sizes = [len(axis) for axis in axes]
    raw = math.prod(sizes)
    if raw > MAX_RAW_POINTS:
        factors = " × ".join(f"{axis.name} ({len(axis)})" for axis in axes)
        raise SweepError(
            f"the sweep has {raw:,} combinations: {factors}; at most {MAX_RAW_POINTS:,} are "
            "looked at",
            where=where,
            remedy="Take fewer levels, or design: random with samples.",
        )
    kept: list[NDArray[np.int64]] = []
    for start in range(0, raw, CHUNK):
        flat = np.arange(start, min(start + CHUNK, raw), dtype=np.int64)
        levels = _levels(flat, sizes)
        kept.append(flat[_feasible(axes, levels, relations, fixed)])
    flat = np.concatenate(kept)
    return _points(axes, _levels(flat, sizes), raw, relations, where)


def zipped(
    axes: Sequence[Axis],
    relations: Sequence[Relation],
    fixed: Mapping[str, float],
    where: SourceLocation,
) -> Points:
    """Walk all axes in step and keep the feasible points.

    Raises:
        SweepError: The axes have different lengths, or no point is feasible.
    """
    sizes = {len(axis) for axis in axes}
    if len(sizes) > 1:
        lengths = ", ".join(f"{axis.name} ({len(axis)})" for axis in axes)
        raise SweepError(
            f"design: zip needs axes of one length, these have {lengths}",
            where=where,
            remedy="Give each axis as many values as the others.",
        )
    raw = sizes.pop() if sizes else 1
    levels = [np.arange(raw, dtype=np.int64) for _ in axes]
    mask = _feasible(axes, levels, relations, fixed) if axes else np.ones(raw, dtype=bool)
    return _points(axes, [level[mask] for level in levels], raw, relations, where)


@dataclass(frozen=True, slots=True)
class RandomDesign:
    """A seeded uniform sample between the ends of each axis.

    Attributes:
        samples: Number of feasible points to draw.
        seed: Seed of the ODD.
        stream: Name of the stream: the scenario's id in the ODD.
    """

    samples: int
    seed: int
    stream: str

    def draw(
        self,
        axes: Sequence[Axis],
        relations: Sequence[Relation],
        fixed: Mapping[str, float],
        where: SourceLocation,
    ) -> Points:
        """Draw points one by one and keep the feasible ones.

        Raises:
            SweepError: An axis is not numeric, or feasible points are too rare.
        """
        for axis in axes:
            if axis.kind != "parameter":
                raise SweepError(
                    f"{axis.name}: design: random draws scenario parameters only",
                    where=axis.where,
                    remedy="Use another design for paths.",
                )
        seed = stream_seed(self.seed, 0, f"sweep/{self.stream}", {})
        ends = [(min(map(float, axis.values)), max(map(float, axis.values))) for axis in axes]
        owners = [owner_id(axis.name) for axis in axes]
        rows: list[list[float]] = []
        draws = self.samples * MAX_DRAWS_PER_SAMPLE
        for draw in range(draws):
            if len(rows) == self.samples:
                break
            row = [
                low + (high - low) * float(uniform(np.uint64(seed), np.uint64(owner), draw, 0))
                for (low, high), owner in zip(ends, owners, strict=True)
            ]
            point = {axis.name: np.array([x]) for axis, x in zip(axes, row, strict=True)}
            if all(bool(_holds(item, point, fixed, 1)[0]) for item in relations):
                rows.append(row)
        if len(rows) < self.samples:
            raise SweepError(
                f"only {len(rows)} of {draws:,} draws fulfil "
                f"{' and '.join(item.expression.text for item in relations)}",
                where=where,
                remedy="Widen the ranges or relax the relations.",
            )
        table = np.array(rows, dtype=np.float64).reshape(self.samples, len(axes))
        columns: dict[str, Column] = {axis.name: table[:, i] for i, axis in enumerate(axes)}
        texts = {name: np.array([repr(float(x)) for x in col]) for name, col in columns.items()}
        return Points(columns, texts, self.samples, self.samples)


def _levels(flat: NDArray[np.int64], sizes: Sequence[int]) -> list[NDArray[np.int64]]:
    if not sizes:
        return []
    return [np.asarray(level, dtype=np.int64) for level in np.unravel_index(flat, sizes)]


def _column(axis: Axis, level: NDArray[np.int64]) -> Column:
    if any(isinstance(value, str) for value in axis.values):
        return np.array([str(value) for value in axis.values])[level]
    return np.array([float(value) for value in axis.values])[level]


def _feasible(
    axes: Sequence[Axis],
    levels: Sequence[NDArray[np.int64]],
    relations: Sequence[Relation],
    fixed: Mapping[str, float],
) -> NDArray[np.bool_]:
    count = int(levels[0].shape[0]) if levels else 1
    columns = {axis.name: _column(axis, level) for axis, level in zip(axes, levels, strict=True)}
    mask = np.ones(count, dtype=bool)
    for relation in relations:
        mask &= _holds(relation, columns, fixed, count)
    return mask


def _holds(
    relation: Relation, columns: Mapping[str, Column], fixed: Mapping[str, float], count: int
) -> NDArray[np.bool_]:
    names: dict[str, Column | float] = {**fixed, **columns}
    for name in relation.expression.names:
        if name not in names:
            raise SweepError(
                f"'{relation.expression.text}' names {name!r}, which the sweep does not have",
                where=relation.where,
                remedy=f"It may use {', '.join(sorted(names))}.",
            )
    result = relation.expression.evaluate({name: names[name] for name in relation.expression.names})
    return np.broadcast_to(np.asarray(result, dtype=bool), (count,))


def _points(
    axes: Sequence[Axis],
    levels: Sequence[NDArray[np.int64]],
    raw: int,
    relations: Sequence[Relation],
    where: SourceLocation,
) -> Points:
    count = int(levels[0].shape[0]) if levels else 1
    if count == 0:
        wanted = " and ".join(item.expression.text for item in relations)
        raise SweepError(
            f"none of {raw:,} combinations fulfils {wanted}",
            where=where,
            remedy="Relax the relations or widen the axes.",
        )
    columns = {axis.name: _column(axis, level) for axis, level in zip(axes, levels, strict=True)}
    texts = {
        axis.name: np.array([str(text) for text in axis.texts])[level]
        for axis, level in zip(axes, levels, strict=True)
    }
    return Points(columns, texts, raw, count)
