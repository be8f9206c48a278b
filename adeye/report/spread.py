"""Summarise each metric over the runs of a scenario and architecture, each number with its run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.report.model import Extreme, MetricSummary

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from adeye.store.figures import Figures

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
    """Give least, median and greatest value of each metric and the runs that they come from.

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
