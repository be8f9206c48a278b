"""The points of one scenario of an ODD: its axes, its relations and its design."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.errors import ExpressionError, SourceLocation, SweepError, suggest
from adeye.spec.quantity import require_dimension
from adeye.sweep.axes import Axis, AxisReader, default_values, quantity_or_text
from adeye.sweep.covering import covering
from adeye.sweep.design import Points, Relation, full_factorial, zipped
from adeye.sweep.sampling import RandomDesign, SpaceFillingDesign
from adeye.units import Dimension

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.spec.load import OddFiles
    from adeye.spec.odd import Sweep
    from adeye.sweep.sampling import FillingKind


def read_points(files: OddFiles, number: int) -> tuple[tuple[Axis, ...], Points]:
    """Read the sweep of a scenario and find its feasible points.

    Args:
        files: The ODD and everything it names.
        number: Of the scenario in the ODD.

    Returns:
        The axes and the points of the design.

    Raises:
        SweepError: An axis or a relation is not acceptable, or no point is feasible.
    """
    use = files.odd.spec.scenarios[number]
    reader = AxisReader(files, use.name, files.scenarios[use.name])
    axes = _axes(files, number, reader)
    fixed = default_values(files.scenarios[use.name].spec)
    for name, text in use.parameters.items():
        at = files.odd.locate(("scenarios", number, "parameters", name))
        axis = reader.read(name, (text,), at)
        _refuse_varied(axis, axes)
        if axis.kind == "parameter":
            fixed[name] = float(axis.values[0])
    relations = _relations(files, number, axes)
    return axes, _designed(files, number, axes, relations, fixed)


def _refuse_varied(fixed: Axis, axes: Sequence[Axis]) -> None:
    """Refuse what a use fixes and varies, or fixes a part of what it varies, and the reverse."""
    for axis in axes:
        one, other = fixed.name.split("."), axis.name.split(".")
        length = min(len(one), len(other))
        if one[:length] == other[:length]:
            raise SweepError(
                f"{fixed.name} is fixed for this use, and {axis.name} is swept at {axis.where}",
                where=fixed.where,
                remedy="Remove one of them.",
            )


def _designed(
    files: OddFiles,
    number: int,
    axes: Sequence[Axis],
    relations: Sequence[Relation],
    fixed: Mapping[str, float],
) -> Points:
    use = files.odd.spec.scenarios[number]
    sweep, where = use.sweep, files.odd.locate(("scenarios", number, "sweep"))
    if sweep.design in {"pairwise", "t_wise"}:
        return covering(axes, sweep.strength or 2, relations, fixed, where)
    if sweep.samples is not None:
        _check_samples(files, sweep.samples, where)
        seed = files.odd.spec.seed
        if sweep.design == "random":
            return RandomDesign(sweep.samples, seed, use.name).draw(axes, relations, fixed, where)
        kind: FillingKind = "lhs" if sweep.design == "lhs" else "sobol"
        filling = SpaceFillingDesign(kind, sweep.samples, seed, use.name)
        return filling.points(axes, relations, fixed, where)
    combine = full_factorial if sweep.design == "full_factorial" else zipped
    return combine(axes, relations, fixed, where)


def _axes(files: OddFiles, number: int, reader: AxisReader) -> tuple[Axis, ...]:
    odd, base = files.odd, ("scenarios", number, "sweep")
    sweep = odd.spec.scenarios[number].sweep
    if sweep.design == "list":
        names = _listed(files, number, sweep)
        return tuple(
            reader.read(
                name,
                tuple(point[name] for point in sweep.points),
                odd.locate((*base, "points", 0, name)),
                distinct=False,
            )
            for name in names
        )
    return tuple(
        reader.read(
            name, spec, odd.locate((*base, "parameters", name)), distinct=sweep.design != "zip"
        )
        for name, spec in sweep.parameters.items()
    )


def _listed(files: OddFiles, number: int, sweep: Sweep) -> tuple[str, ...]:
    """Return the names that every point of a list has."""
    names = tuple(dict.fromkeys(name for point in sweep.points for name in point))
    for at, point in enumerate(sweep.points):
        missing = [name for name in names if name not in point]
        if missing:
            raise SweepError(
                f"point {at + 1} has no {', '.join(missing)}",
                where=files.odd.locate(("scenarios", number, "sweep", "points", at)),
                remedy="Every point of a list names the same parameters.",
            )
    return names


def _relations(files: OddFiles, number: int, axes: Sequence[Axis]) -> list[Relation]:
    use = files.odd.spec.scenarios[number]
    scenario = files.scenarios[use.name]
    relations = [
        Relation(item, files.odd.locate(("scenarios", number, "sweep", "where", at)))
        for at, item in enumerate(use.sweep.where)
    ]
    relations += [
        Relation(item, scenario.locate(("constraints", at)))
        for at, item in enumerate(scenario.spec.constraints)
    ]
    known: dict[str, Dimension | None] = {axis.name: _dimension(axis) for axis in axes}
    for name, parameter in scenario.spec.parameters.items():
        known[name] = quantity_or_text(parameter.default)[1]
    for relation in relations:
        _check_relation(relation, known)
    return relations


def _check_relation(relation: Relation, known: Mapping[str, Dimension | None]) -> None:
    for name in sorted(relation.expression.names - known.keys()):
        raise SweepError(
            f"'{relation.expression.text}' names {name!r}, which the sweep does not have",
            where=relation.where,
            remedy=suggest(name, sorted(known)),
        )
    try:
        require_dimension(relation.expression, Dimension.NONE, known)
    except ExpressionError as error:
        raise SweepError(error.message, where=relation.where, remedy=error.remedy) from error


def _dimension(axis: Axis) -> Dimension | None:
    """Tell what an axis by path measures; None for text."""
    found = {quantity_or_text(text)[1] for text in axis.texts}
    return found.pop() if len(found) == 1 else None


def _check_samples(files: OddFiles, samples: int, where: SourceLocation) -> None:
    limit = files.odd.spec.max_test_cases
    if samples > limit:
        raise SweepError(
            f"{samples:,} samples are above the limit of {limit:,} test cases",
            where=where,
            remedy="Draw fewer, or raise max_test_cases in the ODD.",
        )
