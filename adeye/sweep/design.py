"""Designs: which combinations of levels are points, and how many there are before expansion.

Whoever states a probability asks here first, on the stored content of an ODD. Only independent
draws from a declared distribution give intervals; other designs give coverage and worst cases.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from adeye.errors import SourceLocation, SweepError
from adeye.identity import canonical_json
from adeye.kernel.jit import compiled
from adeye.kernel.random import uniform
from adeye.spec.expression import parse
from adeye.sweep.values import situations

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from adeye.spec.expression import Expression
    from adeye.spec.odd import DesignKind, Level
    from adeye.sweep.axes import Axis

# --- Designs: which combinations of levels are points, and how many there are before expansion ----

MAX_RAW_POINTS = 50_000_000
"""Combinations before constraints above which a sweep is refused without being expanded."""
CHUNK = 262_144

MOST_TEXTS = 65_536
"""Levels of one axis whose texts are kept; of more, they are written as they are asked for."""
_MOST_CODES = 2**40

Column = NDArray[np.float64] | NDArray[np.str_]
Levels = NDArray[np.unsignedinteger[Any]]


@dataclass(frozen=True, slots=True)
class Tuples:
    """What a covering design covers: all feasible combinations of some axes at a time.

    Attributes:
        strength: How many axes at a time.
        feasible: Combinations of levels that some point can have; each of them is covered.
        total: All combinations of levels, with those that the relations exclude.
    """

    strength: int
    feasible: int
    total: int


@dataclass(frozen=True)
class Points:
    """The feasible points of a design, column by column; a million take some megabytes.

    Attributes:
        values: Values of the levels in SI, or text, by the name of the axis.
        levels: (N,) which level a point has, by the name of the axis.
        raw: Number of combinations before constraints.
        count: N.
        tuples: What the points cover, of a covering design.
        drawn: Draws that were looked at for the points, of a sample.
        absent: Listed levels that no point has, by the name of the axis: relations exclude them.
    """

    values: dict[str, Column]
    levels: dict[str, Levels]
    raw: int
    count: int
    tuples: Tuples | None = None
    drawn: int | None = None
    absent: Mapping[str, tuple[Level, ...]] = field(default_factory=dict)
    _distinct: dict[tuple[str, ...], NDArray[np.int64]] = field(
        default_factory=dict, compare=False, repr=False
    )
    _texts: dict[str, NDArray[np.object_]] = field(default_factory=dict, compare=False, repr=False)

    @property
    def columns(self) -> dict[str, Column]:
        """(N,) values in SI, or text, by the name of the axis."""
        return {name: self.column(name) for name in self.values}

    def column(self, name: str, rows: Any = slice(None)) -> Column:
        """Give the values of one axis.

        Args:
            name: Of the axis.
            rows: Which points, all unless said.
        """
        values: Column = self.values[name][self.levels[name][rows]]
        return values

    def texts(self, name: str, rows: Any = slice(None)) -> list[str]:
        """Give canonical JSON of the values of one axis.

        Args:
            name: Of the axis.
            rows: Which points, all unless said.
        """
        levels, values = self.levels[name][rows], self.values[name]
        if len(values) > MOST_TEXTS:
            return _texts(values[levels])
        if name not in self._texts:
            self._texts[name] = np.array(_texts(values), dtype=object)
        return list(self._texts[name][levels].tolist())

    def distinct(self, names: tuple[str, ...]) -> NDArray[np.int64]:
        """Number the points that differ in some axes: the first of those that are alike."""
        if names not in self._distinct:
            self._distinct[names] = self._first_of_each(names)
        return self._distinct[names]

    def _first_of_each(self, names: tuple[str, ...]) -> NDArray[np.int64]:
        if not names:
            return np.zeros(1, dtype=np.int64)
        codes = np.zeros(self.count, dtype=np.int64)
        span = 1
        for name in names:
            # Levels of a list or of a zip may have one value.
            unique, same = np.unique(self.values[name], return_inverse=True)
            if span * len(unique) > _MOST_CODES:
                known, codes = np.unique(codes, return_inverse=True)
                span = len(known)
            codes = codes * len(unique) + same[self.levels[name]]
            span *= len(unique)
        if self.count > 1 and bool((codes[1:] > codes[:-1]).all()):
            return np.arange(self.count, dtype=np.int64)
        _, first = np.unique(codes, return_index=True)
        return np.sort(first).astype(np.int64)


def _texts(values: Column) -> list[str]:
    return [canonical_json(value).decode() for value in values.tolist()]


@dataclass(frozen=True, slots=True)
class Relation:
    """A truth-valued relation between parameters that a point must fulfil."""

    expression: Expression
    where: SourceLocation


@dataclass(frozen=True, slots=True)
class Space:
    """What a design is made in.

    Attributes:
        axes: The varied quantities; the last one varies fastest.
        relations: What a point must fulfil.
        fixed: Values of the names that do not vary.
        where: Place of the sweep, for messages.
    """

    axes: Sequence[Axis]
    relations: Sequence[Relation]
    fixed: Mapping[str, float]
    where: SourceLocation

    @property
    def wanted(self) -> str:
        """The relations, for people."""
        texts = [item.expression.text for item in self.relations]
        return " and ".join(f"({text})" if " or " in text else text for text in texts)

    def feasible(self, columns: Mapping[str, Column], count: int) -> NDArray[np.bool_]:
        """Return which points (N,) fulfil every relation.

        Args:
            columns: (N,) values by the name of the axis.
            count: N.
        """
        mask = np.ones(count, dtype=bool)
        for relation in self.relations:
            mask &= holds(relation, columns, self.fixed, count)
        return mask


def full_factorial(space: Space) -> Points:
    """Combine every level of every axis and keep the feasible points.

    Raises:
        SweepError: Too many combinations, or none is feasible.
    """
    axes, where = space.axes, space.where
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
    kept: list[list[Levels]] = []
    for start in range(0, raw, CHUNK):
        flat = np.arange(start, min(start + CHUNK, raw), dtype=np.int64)
        levels = _levels(flat, sizes)
        mask = _feasible(space, levels)
        kept.append([level[mask] for level in levels] or [small(flat[mask], 1)])
    chosen = [np.concatenate(parts) for parts in zip(*kept, strict=True)]
    count = int(chosen[0].shape[0])
    _require_points(count, raw, space)
    return points_of(axes, chosen[: len(axes)], raw, count)


def zipped(space: Space) -> Points:
    """Walk all axes in step and keep the feasible points.

    Raises:
        SweepError: The axes have different lengths, two points are the same, or none is feasible.
    """
    axes, where = space.axes, space.where
    sizes = {len(axis) for axis in axes}
    if len(sizes) > 1:
        lengths = ", ".join(f"{axis.name} ({len(axis)})" for axis in axes)
        raise SweepError(
            f"design: zip needs axes of one length, these have {lengths}",
            where=where,
            remedy="Give each axis as many values as the others.",
        )
    raw = sizes.pop() if sizes else 1
    levels = [small(np.arange(raw), raw) for _ in axes]
    mask = _feasible(space, levels)
    count = int(mask.sum())
    _require_points(count, raw, space)
    _require_different(axes, raw, where)
    return points_of(axes, [level[mask] for level in levels], raw, count)


def draws(
    seed: np.uint64, owner: np.uint64, sample: int, first: int, count: int
) -> NDArray[np.float64]:
    """Draw numbers on (0, 1) that belong to a row of one table.

    Args:
        seed: Of the stream.
        owner: Whose they are.
        sample: Number of the table.
        first: Number of the row.
        count: How many it has.
    """
    out = np.empty(count)
    _draw_row(seed, owner, sample, first * count, out)
    return out


@compiled
def _draw_row(
    seed: np.uint64, owner: np.uint64, sample: int, first: int, out: NDArray[np.float64]
) -> None:
    for at in range(out.shape[0]):
        out[at] = uniform(seed, owner, sample, first + at)


def _levels(flat: NDArray[np.int64], sizes: Sequence[int]) -> list[Levels]:
    if not sizes:
        return []
    found = np.unravel_index(flat, sizes)
    return [small(level, size) for level, size in zip(found, sizes, strict=True)]


def small(level: NDArray[Any], size: int) -> Levels:
    """Keep numbers below ``size`` in as few bytes as they need."""
    return level.astype(np.min_scalar_type(max(size - 1, 0)))


def axis_values(axis: Axis) -> Column:
    """Give the values of an axis's levels in SI, or text."""
    if any(isinstance(value, str) for value in axis.values):
        return np.array([str(value) for value in axis.values])
    # -0.0 is 0.0 everywhere.
    return np.array([float(value) for value in axis.values]) + 0.0


def _feasible(space: Space, levels: Sequence[Levels]) -> NDArray[np.bool_]:
    columns = {
        axis.name: axis_values(axis)[level] for axis, level in zip(space.axes, levels, strict=True)
    }
    return space.feasible(columns, int(levels[0].shape[0]) if levels else 1)


def holds(
    relation: Relation, columns: Mapping[str, Column], fixed: Mapping[str, float], count: int
) -> NDArray[np.bool_]:
    """Tell which points fulfil a relation.

    Args:
        relation: What they must fulfil.
        columns: (N,) values by the name of the axis.
        fixed: Values of the names that do not vary.
        count: N.

    Raises:
        ExpressionError: It is not defined at a point.
        SweepError: It names what is not there.
    """
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


def _require_points(count: int, raw: int, space: Space) -> None:
    if count == 0:
        raise SweepError(
            f"none of {raw:,} combinations fulfils {space.wanted}",
            where=space.where,
            remedy="Relax the relations or widen the axes.",
        )


def _require_different(axes: Sequence[Axis], count: int, where: SourceLocation) -> None:
    """Refuse equal points: they would be one test case that is executed once."""
    first: dict[tuple[float | str, ...], int] = {}
    columns = [situations(axis.values) for axis in axes]
    for number in range(count if axes else 0):
        point = tuple(column[number] for column in columns)
        if point in first:
            told = ", ".join(f"{axis.name} = {axis.texts[number]}" for axis in axes)
            raise SweepError(
                f"points {first[point] + 1} and {number + 1} are the same: {told}",
                where=where,
                remedy="Remove one.",
            )
        first[point] = number


def _absent(axes: Sequence[Axis], levels: Sequence[Levels]) -> dict[str, tuple[Level, ...]]:
    """Find the listed levels of each axis that no point has."""
    found: dict[str, tuple[Level, ...]] = {}
    for axis, level in zip(axes, levels, strict=True):
        there = np.bincount(level, minlength=len(axis)) > 0
        if not there.all():
            # Of a list or a zip, several levels may have one value.
            values = {axis.values[at] for at in np.flatnonzero(there)}
            missing = [
                axis.texts[at] for at in np.flatnonzero(~there) if axis.values[at] not in values
            ]
            if missing:
                found[axis.name] = tuple(dict.fromkeys(missing))
    return found


def points_of(
    axes: Sequence[Axis],
    levels: Sequence[Levels],
    raw: int,
    count: int,
    tuples: Tuples | None = None,
) -> Points:
    """Put points together from the levels that they have.

    Args:
        axes: The varied quantities.
        levels: (N,) for each axis.
        raw: Combinations before constraints.
        count: N.
        tuples: What they cover, of a covering design.
    """
    return Points(
        {axis.name: axis_values(axis) for axis in axes},
        {axis.name: level for axis, level in zip(axes, levels, strict=True)},
        raw,
        count,
        tuples,
        absent=_absent(axes, levels),
    )


# --- What the design of a sweep is: a random sample of a declared population, or chosen points ----

RANDOM: Final = "random"
"""The one design whose points are independent draws from the declared distributions."""


@dataclass(frozen=True, slots=True)
class DesignStatement:
    """What may be said about the points of one scenario.

    Attributes:
        kind: The design.
        is_random_sample: Whether its points are independent draws from the declared population, so
            that intervals and p-values exist.
        distributions: How each axis is distributed, in words, by its name; of chosen points: empty.
        is_declared: Whether any distribution was written down; else each axis is uniform between
            its ends.
        is_conditional: Whether relations cut the distributions off, so that the population is the
            one given that they hold.
        relations: Those, as written.
        drawn: Draws that were looked at for the sample; None if it was not recorded.
        excluded_share: Share of these that the relations excluded; None if it was not recorded,
            and of chosen points.
        population: The population in one sentence, or what the points are if there is none.
    """

    kind: DesignKind
    is_random_sample: bool
    distributions: Mapping[str, str]
    is_declared: bool
    is_conditional: bool
    relations: tuple[str, ...]
    drawn: int | None
    excluded_share: float | None
    population: str


def design_statement(
    odd: Mapping[str, Any], scenario: str, factors: Iterable[Mapping[str, Any]] = ()
) -> DesignStatement:
    """State what the points of a scenario are, from what a campaign stores.

    Args:
        odd: Stored content of the ODD and everything that it names.
        scenario: Id of the scenario in the ODD.
        factors: How the campaign's test cases were counted, ``CampaignInfo.factors``; without it
            the number of excluded draws is not known.

    Raises:
        KeyError: The ODD does not use the scenario.
    """
    sweep = _use(odd, scenario)["sweep"]
    kind: DesignKind = sweep["design"]
    axes: Mapping[str, Any] = sweep["parameters"]
    is_sampled = sweep.get("samples") is not None
    distributions = {name: axis_words(axis) for name, axis in axes.items()} if is_sampled else {}
    relations = _relations(odd, scenario, sweep, axes) if is_sampled else ()
    drawn = next((item.get("drawn") for item in factors if item["scenario"] == scenario), None)
    kept = next((item.get("kept") for item in factors if item["scenario"] == scenario), None)
    share = None if not drawn or kept is None else 1.0 - kept / drawn
    if is_sampled and not relations:
        share = 0.0
    return DesignStatement(
        kind=kind,
        is_random_sample=kind == RANDOM,
        distributions=distributions,
        is_declared=any(isinstance(axis, dict) and "from" not in axis for axis in axes.values()),
        is_conditional=bool(relations),
        relations=relations,
        drawn=drawn,
        excluded_share=share,
        population=_population(kind, distributions, relations, share),
    )


def axis_words(axis: Any) -> str:
    """Say how a stored axis of a sample is distributed.

    >>> axis_words(["80 km/h", "120 km/h"])
    'uniform from 80 km/h to 120 km/h'
    >>> axis_words({"normal": {"mean": "30 m", "sd": "5 m", "min": "10 m"}})
    'normal with mean 30 m and standard deviation 5 m, not below 10 m'
    >>> axis_words({"choice": {"day": 0.8, "night": 0.2}})
    'day 0.8, night 0.2'
    """
    if not isinstance(axis, dict):
        return _between(axis)
    if "from" in axis:
        return _between((axis["from"], axis["to"]))
    if "uniform" in axis:
        return _between(axis["uniform"])
    if "choice" in axis:
        return ", ".join(f"{value} {weight:g}" for value, weight in axis["choice"].items())
    if "empirical" in axis:
        return f"each value in column {axis['column']} of {axis['empirical']} as likely"
    if "normal" in axis:
        law = axis["normal"]
        words = f"normal with mean {law['mean']} and standard deviation {law['sd']}"
    else:
        law = axis["lognormal"]
        words = f"lognormal with median {law['median']} and sigma {law['sigma']:g}"
    return words + "".join(
        f", not {side} {law[end]}"
        for end, side in (("min", "below"), ("max", "above"))
        if end in law
    )


def _between(levels: Sequence[Any]) -> str:
    """Levels of a sample are not its points: it is uniform between the least and the largest."""
    from adeye.sweep.values import quantity_or_text

    ordered = sorted(levels, key=lambda level: float(quantity_or_text(level)[0]))
    return f"uniform from {ordered[0]} to {ordered[-1]}"


def _use(odd: Mapping[str, Any], scenario: str) -> Mapping[str, Any]:
    for use in odd["odd"]["scenarios"]:
        if (use.get("as") or use["use"]) == scenario:
            found: Mapping[str, Any] = use
            return found
    raise KeyError(scenario)


def _relations(
    odd: Mapping[str, Any], scenario: str, sweep: Mapping[str, Any], axes: Mapping[str, Any]
) -> tuple[str, ...]:
    """List the relations that name an axis; the others hold everywhere or nowhere."""
    constraints = odd["scenarios"][scenario].get("constraints", ())
    return tuple(
        text for text in (*sweep["where"], *constraints) if not parse(text).names.isdisjoint(axes)
    )


def _population(
    kind: str, distributions: Mapping[str, str], relations: Sequence[str], share: float | None
) -> str:
    if not distributions:
        return "chosen points, not a random sample: no population, no probability"
    axes = "; ".join(f"{name} {words}" for name, words in distributions.items())
    given = ""
    if relations:
        excluded = "" if share is None else f", which excluded {share:.1%} of the draws"
        given = f", given {' and '.join(relations)}{excluded}"
    if kind == RANDOM:
        return f"independent draws: {axes}{given}"
    return (
        f"a space-filling design ({kind}) over: {axes}{given}; its points depend on each other, so "
        "no interval and no probability"
    )
