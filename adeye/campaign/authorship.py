"""Who wrote a value of a file that an ODD varies: the place in the ODD, if the ODD did."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from adeye.spec.expression import Expression
from adeye.sweep.axes import AxisReader

if TYPE_CHECKING:
    from collections.abc import Iterator

    from adeye.errors import SourceLocation
    from adeye.spec.load import OddFiles
    from adeye.spec.quantity import Record
    from adeye.sweep.axes import Kind
    from adeye.sweep.groups import Group

Path = tuple[str, ...]


def author(
    files: OddFiles, group: Group, record: Record, path: Path, kind: Kind = "scenario"
) -> SourceLocation | None:
    """Find the axis or fixed value of an ODD behind a value of a scenario or another file.

    It is the one that wrote the value or a part above it; else one whose parameter the formula
    there uses; else one that wrote into the same section, because what is wrong may be wrong
    together. Of several the last in the ODD.

    Args:
        files: The ODD and everything it names.
        group: Whose points are looked at.
        record: With what the ODD writes into it.
        path: Dotted path of the value below the record, as the sweep writes it.
        kind: Of the record.

    Returns:
        None if the ODD has no part in it.
    """
    written = [*_written(files, group, kind)]
    formula = _at(record, path)
    names = formula.names if isinstance(formula, Expression) else frozenset()
    wrote = [where for _, own, where in written if own and path[: len(own)] == own]
    used = [where for name, own, where in written if not own and name in names]
    beside = [where for _, own, where in written if own and path[:1] == own[:1]]
    return next((found[-1] for found in (wrote, used, beside) if found), None)


def _written(files: OddFiles, group: Group, of: Kind) -> Iterator[tuple[str, Path, SourceLocation]]:
    """List name, path (empty for a parameter) and place of what the ODD gives a record."""
    reader = AxisReader(files, group.use.name, group.scenario)
    number = files.odd.spec.scenarios.index(group.use)
    for name in group.use.parameters:
        where = files.odd.locate(("scenarios", number, "parameters", name))
        kind, path = reader.resolve(name, where)
        if kind in {"parameter", of}:
            yield name, path, where
    for axis in group.axes:
        if axis.kind in {"parameter", of}:
            yield axis.name, axis.path, axis.where


def _at(record: Any, path: Path) -> Any:
    """Return what a record has at a dotted path; None if there is no such thing."""
    for part in path:
        children = record if isinstance(record, Mapping) else getattr(record, "__dict__", {})
        if part not in children:
            return None
        record = children[part]
    return record
