"""Summarise each metric over the runs of a scenario and architecture, each number with its run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from adeye.report.model.report import DeadAxis, Extreme, MetricSummary
from adeye.signals import Ints
from adeye.store.read.bulk import Figures
from adeye.sweep.values import axis_text

# --- Summarise each metric over the runs of a scenario and architecture, each number with its run -

UNITS = {
    "mps": "m/s",
    "mps2": "m/s²",
    "rad": "rad",
    "mps3": "m/s³",
    "m": "m",
    "s": "s",
    "s2": "s²",
    "radps": "rad/s",
    "radps2": "rad/s²",
}


def metric_title(name: str) -> tuple[str, str]:
    """Split a metric id into words and unit.

    >>> metric_title("min_ttc_s")
    ('min ttc', 's')
    >>> metric_title("contact")
    ('contact', '')
    """
    stem, _, suffix = name.rpartition("_")
    if stem and suffix in UNITS:
        return stem.replace("_", " "), UNITS[suffix]
    return name.replace("_", " "), ""


def summarise(
    figures: Figures, run_of: Callable[[int], str], command: Callable[[str], str]
) -> Iterator[MetricSummary]:
    """Return least, median and greatest value of each metric and the runs that they come from.

    Among equal values the run that was planned first is taken, for the greatest the last.

    Args:
        figures: Executed runs.
        run_of: Result digest of the run of an ordinal.
        command: Command line that reproduces a run.
    """
    pairs = np.stack([figures.scenario.codes, figures.architecture.codes], axis=1)
    cells = [
        (figures.scenario.words[scenario], figures.architecture.words[architecture], pair)
        for pair in np.unique(pairs, axis=0)
        for scenario, architecture in [pair.tolist()]
    ]
    for scenario, architecture, pair in sorted(cells, key=lambda item: item[:2]):
        own = figures.where((pairs == pair).all(axis=1))
        for name, values in own.metrics.items():
            places = np.flatnonzero(~np.isnan(values))
            order = places[np.argsort(values[places], kind="stable")]
            title, unit = metric_title(name)
            extremes: list[Extreme | None] = [None, None, None]
            if len(order):
                extremes = []
                for place in (order[0], order[(len(order) - 1) // 2], order[-1]):
                    run = run_of(int(own.ordinal[place]))
                    value = float(values[place])
                    extremes.append(Extreme(value=value, run=run, command=command(run)))
            yield MetricSummary(
                metric=name,
                title=title,
                unit=unit,
                scenario=scenario,
                architecture=architecture,
                runs=len(own),
                undefined=len(own) - len(order),
                minimum=extremes[0],
                median=extremes[1],
                maximum=extremes[2],
            )


# --- Find swept axes that move no metric: they cost runs and say nothing --------------------------

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
    """Return whether two runs that differ in one axis only differ in any metric.

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
    """Return a number for each row; rows with equal values in all columns have the same."""
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
