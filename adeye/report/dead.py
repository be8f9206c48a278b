"""Find swept axes that move no metric: they cost runs and say nothing."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from adeye.report.model import DeadAxis
from adeye.store.tables import METRIC_IDS
from adeye.sweep.present import axis_text

Row = Mapping[str, Any]


def dead_axes(
    rows: Sequence[Row], odd: Mapping[str, Any], command: Callable[[str], str]
) -> Iterator[DeadAxis]:
    """List the axes of each scenario that change no metric of any pair of runs.

    Args:
        rows: Results with ``scenario``, ``architecture``, ``fault_entry``, ``replicate``,
            ``point`` and the metrics.
        odd: Stored content of the ODD.
        command: Completes a command line with the database.
    """
    by_scenario: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        by_scenario[row["scenario"]].append(row)
    for scenario, own in sorted(by_scenario.items()):
        for axis in sorted({name for row in own for name in row["point"]}):
            levels = {row["point"][axis] for row in own if axis in row["point"]}
            if len(levels) > 1 and not moves(own, axis):
                shown = ", ".join(axis_text(axis, value, odd, scenario) for value in sorted(levels))
                query = f'adeye query "SELECT * FROM v_runs_{scenario}"'  # noqa: S608 - shown only
                yield DeadAxis(scenario=scenario, axis=axis, values=shown, command=command(query))


def moves(rows: Iterable[Row], axis: str) -> bool:
    """Tell whether two runs that differ in one axis only differ in any metric."""
    seen: dict[Hashable, tuple[Any, ...]] = {}
    for row in rows:
        if axis not in row["point"]:
            continue
        others = tuple(sorted((k, v) for k, v in row["point"].items() if k != axis))
        key = (row["architecture"], row["fault_entry"], row["replicate"], others)
        metrics = tuple(row[name] for name in METRIC_IDS)
        if seen.setdefault(key, metrics) != metrics:
            return True
    return False
