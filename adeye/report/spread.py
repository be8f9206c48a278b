"""Summarise each metric over the runs of a scenario and architecture, each number with its run."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Any

from adeye.report.model import Extreme, MetricSummary
from adeye.store.tables import METRIC_IDS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

UNITS = {"mps": "m/s", "mps2": "m/s²", "mps3": "m/s³", "m": "m", "s": "s"}


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
    rows: Sequence[Mapping[str, Any]], command: Callable[[str], str]
) -> Iterator[MetricSummary]:
    """Give least, median and greatest value of each metric and the runs that they come from.

    Args:
        rows: Results as ``v_runs`` shows them.
        command: Command line that reproduces a run.
    """
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = defaultdict(list)
    for row in rows:
        groups[row["scenario"], row["architecture"]].append(row)
    for (scenario, architecture), own in sorted(groups.items()):
        for name in METRIC_IDS:
            found = sorted((row[name], row["run"]) for row in own if row[name] is not None)
            title, unit = metric_title(name)

            def extreme(at: int, found: list[tuple[float, str]] = found) -> Extreme | None:
                if not found:
                    return None
                value, run = found[at]
                return Extreme(value=value, run=run, command=command(run))

            yield MetricSummary(
                metric=name,
                title=title,
                unit=unit,
                scenario=scenario,
                architecture=architecture,
                runs=len(own),
                undefined=len(own) - len(found),
                minimum=extreme(0),
                median=extreme((len(found) - 1) // 2),
                maximum=extreme(-1),
            )
