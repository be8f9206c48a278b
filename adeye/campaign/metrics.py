"""Metrics from outside the package: loaded as the ODD lists them, in every process."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from adeye.errors import UsageError
from adeye.evaluation.metrics import METRICS, register_metric
from adeye.registry import Part, load_part, require
from adeye.store.plugin_metrics import is_free
from adeye.supervision import guest

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from adeye.evaluation.metrics.registry import Measure
    from adeye.evaluation.series import TraceSeries
    from adeye.ports import MetricColumn

_REGISTERED: Final[dict[str, tuple[str, str]]] = {}
"""Name of the plug-in and digest of its source behind each column that is not built in."""


def use_plugin_metrics(names: Sequence[str], folder: Path) -> tuple[Part, ...]:
    """Register the metrics of an ODD, and those of no other ODD.

    The uid of each gets the digest of its source, so that a verdict on it is of this very code.

    Args:
        names: Entry points, ``module:Class`` or ``./file.py:Class``.
        folder: Folder of the ODD's file.

    Returns:
        What was loaded.

    Raises:
        SpecError: There is no such class, or it is no metric.
        UsageError: It lacks an attribute, has one that is not allowed, or its column is taken.
    """
    parts = tuple(load_part(name, folder) for name in names)
    wanted = {(part.name, part.source_digest) for part in parts}
    for column in [key for key, owner in _REGISTERED.items() if owner not in wanted]:
        del METRICS[column]
        del _REGISTERED[column]
    for part in parts:
        owner = (part.name, part.source_digest)
        if owner in _REGISTERED.values():
            continue
        require(part, "metric", ("compute",))
        before = set(METRICS)
        with guest(part.name, "metric"):
            register_metric(part.obj)
        for column in set(METRICS) - before:
            found = METRICS[column]
            if not is_free(column):
                del METRICS[column]
                raise UsageError(
                    f"metric {found.uid}: column {column!r} is a word of SQL or of the database",
                    remedy="Give it a name of its own with its unit, such as top_speed_mps.",
                )
            uid = f"{found.uid}#{part.source_digest[:12]}"
            measure = _visiting(part.name, found.measure)
            METRICS[column] = replace(found, uid=uid, measure=measure, plugin=part.name)
            _REGISTERED[column] = owner
    return parts


def _visiting(name: str, measure: Measure) -> Measure:
    """Say who works while a metric is computed."""

    def visit(series: TraceSeries) -> MetricColumn:
        with guest(name):
            return measure(series)

    return visit


def plugin_of(column: str) -> str | None:
    """Name the plug-in that a metric comes from; None for a built-in one."""
    owner = _REGISTERED.get(column)
    return None if owner is None else owner[0]
