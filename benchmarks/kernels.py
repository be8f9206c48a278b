"""Which compiled functions does a first start wait for?

A process with an empty cache of compiled code executes and judges one test case of each structure
of the shipped motorway ODD. What the compiler takes for each function is its CPU time without that
of functions which it compiles meanwhile; what is inlined counts where it is. Beside it is the
number of argument types that a function is compiled for. A table of one machine: kernels.md.

    python benchmarks/kernels.py            the whole measurement
    python benchmarks/kernels.py --smoke    with the cache of the user: what is compiled is little
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from typing import Any

from support.command import drive

ROOT = Path(__file__).resolve().parent.parent
SCRIPT = """
import collections, json, sys, time
import adeye.kernel.linking as linking
took, times, inner = collections.Counter(), collections.Counter(), [0.0]
compile_one = linking.Kernel.compile

def compile(self, signature):
    began = time.process_time()
    inner.append(0.0)
    try:
        return compile_one(self, signature)
    finally:
        whole = time.process_time() - began
        name = f"{self.py_func.__module__}:{self.py_func.__qualname__}"
        took[name] += whole - inner.pop()
        times[name] += 1
        inner[-1] += whole

linking.Kernel.compile = compile
from adeye.campaign.plan import make_plan
from adeye.campaign.warmup import warm_up
warm_up(make_plan("odd/motorway_chauffeur.yaml"))
json.dump({name: [took[name], times[name]] for name in took}, sys.stdout)
"""


def compiled(environment: dict[str, str]) -> dict[str, tuple[float, int]]:
    """Return CPU time [s] and number of compilations of each function, in a process of its own."""
    done = subprocess.run(  # noqa: S603 - the script of this file
        [sys.executable, "-c", SCRIPT],
        check=True, cwd=ROOT, env=environment, capture_output=True, text=True,
    )  # fmt: skip
    return {
        name: (float(took), int(count)) for name, (took, count) in json.loads(done.stdout).items()
    }


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Compile everything once a round; return functions by what they take, all others last."""
    took: dict[str, list[float]] = defaultdict(list)
    counts: dict[str, int] = {}
    for _ in range(rounds):
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        with tempfile.TemporaryDirectory() as folder:
            if not smoke:
                environment["XDG_CACHE_HOME"] = folder
                for name in ("NUMBA_CACHE_DIR", "ADEYE_NUMBA_CACHE_DIR"):
                    environment.pop(name, None)
            for name, (seconds, count) in compiled(environment).items():
                took[name].append(seconds)
                counts[name] = count
    median = {name: statistics.median(values) for name, values in took.items()}
    whole = sum(median.values())
    names = sorted(median, key=lambda name: -median[name])
    found = [(name, median[name], counts[name]) for name in names]
    return [
        {"function": name, "cpu_s": seconds, "compiled": count, "share": seconds / whole}
        for name, seconds, count in [("all", whole, sum(counts.values())), *found]
    ]


HEADERS = ("function", "CPU [s]", "share", "compiled")


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    share = f"{100.0 * item['share']:.1f} %"
    return [item["function"], f"{item['cpu_s']:.2f}", share, str(item["compiled"])]


if __name__ == "__main__":
    sys.exit(drive("kernels", __doc__, measure, HEADERS, row))
