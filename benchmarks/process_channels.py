"""What does a tick cost with 64 programs as channels, and what to start them?

The shipped candidate in 64 cut-ins at once, with a third channel: a program in Python (kind
process) for each run, against one Python object for each run in this process that answers the same.
Wall time, for programs work in processes of their own: cost of a tick = of 120 ticks less 20, so
that the start of the programs is not in it; start = time of 20 ticks less 20 such ticks. Rounds
interleaved, warm-up thrown away.

    python benchmarks/process_channels.py            the whole measurement
    python benchmarks/process_channels.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from channel_tiers import cut_ins
from support.command import drive, ratios, spread

from adeye.simulate import engine
from adeye.spec.architecture import Architecture
from adeye.spec.quantity import SI
from adeye.testing import zoo

if TYPE_CHECKING:
    from adeye.sweep.case import TestCase

RUNS, SHORT, LONG = 64, 20, 120
GUESTS: dict[str, dict[str, Any]] = {
    "object": {"kind": "./zoo_plugin.py:One"},
    "program": {"kind": "process", "parameters": zoo.parameters()},
}


def with_guest(cases: list[TestCase], guest: dict[str, Any]) -> list[TestCase]:
    """Add a channel without authority to the architecture of test cases."""
    content = cases[0].architecture.model_dump(mode="json")
    content["channels"]["guest"] = {**guest, "links": ["localisation"], "rate": 20.0}
    architecture = Architecture.model_validate(content, context=SI)
    return [replace(case, architecture=architecture) for case in cases]


def took(cases: list[TestCase], folder: Path, ticks: int) -> float:
    """Wall time of so many ticks of a batch [s]."""
    name = cases[0].architecture.architecture
    begin = time.perf_counter()
    engine.run(cases, backend="batch", base_dirs={name: folder}, most_ticks=ticks)
    return time.perf_counter() - begin


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure without a guest and with each of them once a round."""
    runs = 4 if smoke else RUNS
    plain = cut_ins(runs)
    batches = {"none": plain, **{name: with_guest(plain, item) for name, item in GUESTS.items()}}
    ticks: dict[str, list[float]] = {name: [] for name in batches}
    starts: dict[str, list[float]] = {name: [] for name in batches}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        zoo.settle(folder)
        for number in range(rounds + 1):
            for kind, cases in batches.items():
                short, long = took(cases, folder, SHORT), took(cases, folder, LONG)
                if number:
                    ticks[kind].append((long - short) / (LONG - SHORT))
                    starts[kind].append(short - SHORT * ticks[kind][-1])
    costs = {kind: differences(ticks[kind], ticks["none"]) for kind in GUESTS}
    return [
        {
            "channel": kind,
            "runs": runs,
            "tick_ms": 1e3 * statistics.median(ticks[kind]),
            "us": 1e6 * statistics.median(costs[kind]) / runs,
            "start_ms": 1e3 * statistics.median(differences(starts[kind], starts["none"])) / runs,
            **ratios(list(zip(costs[kind], costs["object"], strict=True))),
        }
        for kind in GUESTS
    ]


def differences(times: list[float], others: list[float]) -> list[float]:
    """Subtract, round by round."""
    return [one - other for one, other in zip(times, others, strict=True)]


HEADERS = (
    "channel",
    "runs in a batch",
    "ms per tick",
    "µs per run and tick",
    "ms to start a run",
    "ratio to object (spread)",
)


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    numbers = [f"{item['tick_ms']:.1f}", f"{item['us']:,.0f}", f"{item['start_ms']:.1f}"]
    return [item["channel"], str(item["runs"]), *numbers, spread(item)]


if __name__ == "__main__":
    sys.exit(drive("process_channels", __doc__, measure, HEADERS, row))
