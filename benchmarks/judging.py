"""What does it cost to measure the metrics of a run, family by family?

The runs are those of ``closed_loop``: a lead that brakes hard in the midst of reactive vehicles.
They are recorded once; then each family of metrics is computed on them by itself, after the
conflicts that all of them read. CPU time of one process and one thread, the least of some rounds.

    python benchmarks/judging.py            the whole measurement
    python benchmarks/judging.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING, Any

from closed_loop import Size, test_cases
from support.command import drive

from adeye.judge.evaluate import PART_RUNS
from adeye.judge.metrics import METRICS, compute_metrics
from adeye.judge.series import TraceSeries
from adeye.simulate import engine
from adeye.simulate.recorder import Memory
from adeye.store.tables import TABLES

if TYPE_CHECKING:
    from adeye.trace import Trace

SIZES = (Size(2, PART_RUNS, 15.0, 1), Size(5, PART_RUNS, 15.0, 1), Size(20, PART_RUNS, 15.0, 1))
FAMILIES = ("avoidance", "comfort", "exposure", "meeting", "severity")


def seconds(trace: Trace, names: list[str], *, ready: bool) -> float:
    """Measure metrics on fresh series; with ``ready``, the conflicts are measured before [s]."""
    series = TraceSeries(trace)
    if ready:
        _ = series.worst_conflicts
    began = time.process_time()
    compute_metrics(trace, series, {name: METRICS[name] for name in names})
    return time.process_time() - began


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure the families, one after the other in each round."""
    found = []
    for size in (Size(3, 16, 1.0, 1),) if smoke else SIZES:
        trace = engine.run(test_cases(size), memory=Memory())
        later = list(TABLES["criticality"])
        groups = {"first": [name for name in METRICS if name not in later], "later": later}
        for family in FAMILIES:
            module = f"adeye.judge.metrics.{family}"
            groups[family] = [n for n in later if METRICS[n].measure.__module__ == module]
        for names in groups.values():
            seconds(trace, names, ready=True)
        item: dict[str, Any] = {"vehicles": size.vehicles, "runs": size.runs}
        for group, names in groups.items():
            times = [seconds(trace, names, ready=group != "first") for _ in range(rounds)]
            item[f"{group}_us"] = 1e6 * min(times) / size.runs
        found.append(item)
    return found


GROUPS = ("first", "later", *FAMILIES)
HEADERS = ("vehicles", "runs", *(f"{group} [µs/run]" for group in GROUPS), "ratio later/first")


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    cells = [f"{item[f'{group}_us']:.1f}" for group in GROUPS]
    ratio = item["later_us"] / item["first_us"]
    return [str(item["vehicles"]), str(item["runs"]), *cells, f"{ratio:.2f}"]


if __name__ == "__main__":
    sys.exit(drive("judging", __doc__, measure, HEADERS, row))
