"""Designs with ``samples``: independent draws, and points that fill the space of the axes evenly.

All begin with numbers on (0, 1), one per axis and point, which the axis turns into values: by its
declared distribution, or evenly between its ends.
"""

from __future__ import annotations

from dataclasses import replace
from operator import itemgetter
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from adeye.errors import SourceLocation, SweepError
from adeye.identity import stream_seed
from adeye.kernel.jit import compiled
from adeye.kernel.random import owner_id, uniform
from adeye.sweep.design import Column, Levels, Points, Space, axis_values, small

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from adeye.spec.odd import Level
    from adeye.sweep.axes import Axis

FillingKind = Literal["lhs", "sobol"]
MAX_DRAWS_PER_SAMPLE: Final = 1_000
DRAWS: Final = 4_096
"""Draws of a random design that are made and looked at together."""
HOPELESS: Final = 1_000_000
"""Draws after which a random design without a single feasible point is given up."""
NEAREST_END: Final = 2.0**-32
"""Least distance of a share from 0 and 1, where a quantile may be infinite."""
LARGEST_SOBOL: Final = 2**20


def random_points(space: Space, samples: int, seed: int, stream: str) -> Points:
    """Draw points independently and keep the first feasible ones, whatever the size of the chunks.

    Args:
        space: Axes and relations.
        samples: Number of feasible points to draw.
        seed: Seed of the ODD.
        stream: Name of the stream: the scenario's id in the ODD.

    Raises:
        SweepError: An axis is not numeric, or feasible points are too rare.
    """
    axes = space.axes
    _require_drawable(axes, "random")
    own_seed = np.uint64(stream_seed(seed, 0, f"sweep/{stream}", {}))
    owners = [np.uint64(owner_id(axis.name)) for axis in axes]
    kept: list[NDArray[np.float64]] = []
    limit = min(samples * MAX_DRAWS_PER_SAMPLE, 2**32)
    drawn = found = looked = 0
    while found < samples and drawn < limit:
        count = min(DRAWS, limit - drawn)
        table = np.empty((count, len(axes)))
        for at, (axis, owner) in enumerate(zip(axes, owners, strict=True)):
            _draw(own_seed, owner, drawn, table[:, at])
            table[:, at] = _placed(axis, table[:, at])
        mask = _feasible(space, table)
        kept.append(table[mask])
        missing, found = samples - found, found + int(mask.sum())
        if found >= samples:
            looked = drawn + int(np.flatnonzero(mask)[missing - 1]) + 1
        drawn += count
        if not found and drawn >= HOPELESS:
            break
    if found < samples:
        raise SweepError(
            f"only {found} of {drawn:,} draws fulfil {space.wanted}",
            where=space.where,
            remedy="Widen the ranges or relax the relations.",
        )
    feasible = np.concatenate(kept)
    points = _points(space, feasible[:samples], samples, looked)
    return replace(points, absent=_vanished(axes, table, feasible))


def filling_points(space: Space, kind: FillingKind, samples: int, seed: int, stream: str) -> Points:
    """Place points that fill the space more evenly than chance, and keep the feasible ones.

    The points depend on each other, so they are no random sample. Points that relations exclude
    are left out and not replaced: whatever replaced them would not be of the design.

    Args:
        space: Axes and relations.
        kind: ``lhs``, a Latin hypercube, or ``sobol``, a scrambled Sobol sequence.
        samples: Number of points before relations.
        seed: Seed of the ODD.
        stream: Name of the stream: the scenario's id in the ODD.

    Raises:
        SweepError: An axis is not numeric, the number of points does not fit the design, or none is
            feasible.
    """
    axes, where = space.axes, space.where
    _require_drawable(axes, kind)
    if not axes:
        raise SweepError(
            f"design: {kind} needs at least one axis",
            where=where,
            remedy="Vary something.",
        )
    if kind == "sobol":
        _require_balance(samples, where)
    # The order in which a file lists the axes does not matter.
    order = sorted(range(len(axes)), key=lambda at: axes[at].name)
    shares = np.empty((samples, len(axes)))
    own_seed = stream_seed(seed, 0, f"sweep/{stream}/{kind}", {})
    shares[:, order] = _shares(kind, samples, len(axes), own_seed)
    table = np.empty_like(shares)
    for at, axis in enumerate(axes):
        table[:, at] = _placed(axis, shares[:, at])
    mask = _feasible(space, table)
    if not mask.any():
        raise SweepError(
            f"none of {samples:,} points fulfils {space.wanted}",
            where=where,
            remedy="Widen the ranges or relax the relations.",
        )
    points = _points(space, table[mask], samples, samples)
    return replace(points, absent=_vanished(axes, table, table[mask]))


def _require_balance(samples: int, where: SourceLocation) -> None:
    below = 1 << (samples.bit_length() - 1)
    if samples != below or samples > LARGEST_SOBOL:
        nearest = [n for n in (below, 2 * below) if n <= LARGEST_SOBOL] or [LARGEST_SOBOL]
        raise SweepError(
            f"{samples:,} points of a Sobol sequence do not fill the space evenly; their "
            f"number is a power of two, at most {LARGEST_SOBOL:,}",
            where=where,
            remedy=f"Write samples: {' or '.join(map(str, nearest))}.",
        )


def _shares(kind: FillingKind, samples: int, axes: int, seed: int) -> NDArray[np.float64]:
    """Ask SciPy for the numbers on (0, 1): (N, A)."""
    from scipy.stats import qmc

    generator = np.random.Generator(np.random.PCG64(seed))
    if kind == "lhs":
        shares = qmc.LatinHypercube(axes, seed=generator).random(samples)
    else:
        sequence = qmc.Sobol(axes, scramble=True, bits=30, seed=generator)
        shares = sequence.random_base2(samples.bit_length() - 1)
    return np.asarray(np.clip(shares, NEAREST_END, 1.0 - NEAREST_END), dtype=np.float64)


def _require_drawable(axes: Sequence[Axis], kind: str) -> None:
    for axis in axes:
        if axis.kind != "parameter" and (axis.law is None or axis.law.kind != "choice"):
            raise SweepError(
                f"{axis.name}: design: {kind} draws scenario parameters only",
                where=axis.where,
                remedy="Use another design for paths, or declare a choice.",
            )
        if axis.law is None:
            _require_ends(axis, kind)


def _require_ends(axis: Axis, kind: str) -> None:
    """Refuse values that no draw would know of: only the ends count, the lower one first."""
    low, *others = map(float, axis.values)
    if len(others) < 2 and all(low <= high for high in others):
        return
    ends = sorted(zip(map(float, axis.values), axis.texts, strict=True), key=itemgetter(0))
    first, last = ends[0][1], ends[-1][1]
    wrong = f"{axis.texts[0]} is above {axis.texts[-1]}"
    remedy = f"Write [{first}, {last}]."
    if len(others) > 1:
        wrong = f"of {len(axis):,} values those between, such as {axis.texts[1]}, would not count"
        remedy = f"Write [{first}, {last}]; for single values a choice or another design."
    raise SweepError(
        f"{axis.name}: design: {kind} draws evenly between two ends, the lower one first; {wrong}",
        where=axis.where,
        remedy=remedy,
    )


def _is_choice(axis: Axis) -> bool:
    return axis.law is not None and axis.law.kind == "choice"


def _placed(axis: Axis, shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn numbers on (0, 1) into values; of a choice into numbers of its levels."""
    if axis.law is not None:
        return axis.law.quantile(shares)
    low, high = min(map(float, axis.values)), max(map(float, axis.values))
    return low + (high - low) * shares


def _column(axis: Axis, numbers: NDArray[np.float64]) -> Column:
    if not _is_choice(axis):
        return numbers
    column: Column = axis_values(axis)[numbers.astype(np.int64)]
    return column


def _feasible(space: Space, table: NDArray[np.float64]) -> NDArray[np.bool_]:
    columns = {axis.name: _column(axis, table[:, at]) for at, axis in enumerate(space.axes)}
    return space.feasible(columns, len(table))


def _points(space: Space, table: NDArray[np.float64], raw: int, drawn: int) -> Points:
    """Keep every draw as a level of its own, and levels of choices as what they are."""
    axes = space.axes
    count = len(table)
    own = small(np.arange(count), count)
    values: dict[str, Column] = {}
    levels: dict[str, Levels] = {}
    for at, axis in enumerate(axes):
        if _is_choice(axis):
            values[axis.name] = axis_values(axis)
            levels[axis.name] = small(table[:, at].astype(np.int64), len(axis))
        else:
            values[axis.name], levels[axis.name] = table[:, at] + 0.0, own
    points = Points(values, levels, raw, count, drawn=drawn)
    _require_distinct(points, axes, space.where)
    return points


def _vanished(
    axes: Sequence[Axis], drawn: NDArray[np.float64], feasible: NDArray[np.float64]
) -> dict[str, tuple[Level, ...]]:
    """Find the levels of choices that were drawn, and that relations leave in no point."""
    found: dict[str, tuple[Level, ...]] = {}
    for at, axis in enumerate(axes):
        if _is_choice(axis):
            gone = np.setdiff1d(drawn[:, at], feasible[:, at]).astype(np.int64)
            if gone.size:
                found[axis.name] = tuple(axis.texts[level] for level in gone)
    return found


def _require_distinct(points: Points, axes: Sequence[Axis], where: SourceLocation) -> None:
    """Refuse a sample with repeated points: each is one test case only, and weights are lost."""
    names = tuple(axis.name for axis in axes if axis.kind == "parameter")
    distinct = len(points.distinct(names))
    if distinct < points.count:
        raise SweepError(
            f"{points.count:,} samples have {distinct:,} different points; a point that is drawn "
            "twice would be executed and counted once",
            where=where,
            remedy="Add a parameter that varies continuously, or take design: full_factorial.",
        )


@compiled
def _draw(seed: np.uint64, owner: np.uint64, first: int, out: NDArray[np.float64]) -> None:
    for at in range(out.shape[0]):
        out[at] = uniform(seed, owner, first + at, 0)
