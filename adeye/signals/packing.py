"""Numbers of many runs side by side: columns from specs, and records that compiled stages read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from adeye.signals.flow import Floats

_Spec = TypeVar("_Spec")


def spec_columns(
    specs: Sequence[_Spec], read: Callable[[_Spec], Mapping[str, float]]
) -> dict[str, Floats]:
    """Read numbers from the spec of every run.

    Most runs of a batch share one object, which is read once: a validated spec is slow to read.

    Args:
        specs: (B) spec of each run; at least one.
        read: Gives the numbers of a spec by name, of each the same names.

    Returns:
        (B,) columns by name.
    """
    distinct = {id(spec): spec for spec in specs}
    place = {key: index for index, key in enumerate(distinct)}
    of_run = np.array([place[id(spec)] for spec in specs])
    rows = [read(spec) for spec in distinct.values()]
    return {
        name: np.array([row[name] for row in rows], dtype=np.float64)[of_run] for name in rows[0]
    }


def parameter_record(fields: Mapping[str, Any]) -> NDArray[np.void]:
    """Pack one value or column per field into a structured array of float64, one record a run.

    Args:
        fields: Scalars or (B,) columns by name; at least one is a column.

    Returns:
        (B,) structured array; compiled stages read ``record["name"]``.
    """
    columns = {name: np.asarray(value, dtype=np.float64) for name, value in fields.items()}
    runs = max((column.shape[0] for column in columns.values() if column.ndim), default=1)
    packed = np.zeros(runs, dtype=[(name, np.float64) for name in columns])
    for name, column in columns.items():
        packed[name] = column
    return packed
