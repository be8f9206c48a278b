"""Find swept axes that move no metric: they cost runs and say nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.report.model import DeadAxis
from adeye.sweep.present import axis_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from adeye.signals import Ints
    from adeye.store.figures import Figures

_MOST = 2**62


def dead_axes(
    figures: Figures, odd: Mapping[str, Any], command: Callable[[str], str]
) -> Iterator[DeadAxis]:
    """List the axes of each scenario that change no metric of any pair of runs.

    Args:
        figures: Executed runs.
        odd: Stored content of the ODD.
        command: Completes a command line with the database.
    """
    for scenario in sorted(figures.scenario.words):
        own = figures.of_scenario(scenario)
        for axis in sorted(own.points):
            column = own.points[axis]
            levels = [column.words[code] for code in np.unique(column.codes) if code >= 0]
            if len(levels) > 1 and not moves(own, axis):
                shown = ", ".join(axis_text(axis, value, odd, scenario) for value in sorted(levels))
                query = f'adeye query "SELECT * FROM v_runs_{scenario}"'  # noqa: S608 - shown only
                yield DeadAxis(scenario=scenario, axis=axis, values=shown, command=command(query))


def moves(figures: Figures, axis: str) -> bool:
    """Tell whether two runs that differ in one axis only differ in any metric.

    Args:
        figures: Executed runs of one scenario.
        axis: Name of a swept axis.
    """
    own = figures.where(figures.points[axis].codes >= 0)
    others = [column.codes for name, column in own.points.items() if name != axis]
    group = _groups([own.architecture.codes, own.fault_entry.codes, own.replicate, *others])
    _, first, of_run = np.unique(group, return_index=True, return_inverse=True)
    first_of_run = first[of_run]
    for values in own.metrics.values():
        expected = values[first_of_run]
        if ((values != expected) & ~(np.isnan(values) & np.isnan(expected))).any():
            return True
    return False


def _groups(columns: list[Ints]) -> Ints:
    """Give rows with equal values in all columns one number."""
    group = np.zeros(len(columns[0]), dtype=np.int64)
    count = 1
    for column in columns:
        # What a run lacks is -1.
        levels = int(column.max(initial=-1)) + 2
        if count * levels > _MOST:
            group = np.unique(group, return_inverse=True)[1].astype(np.int64)
            count = len(group)
        group = group * levels + column + 1
        count *= levels
    return group
