"""How long until the first result, with an empty cache of compiled code and with a warm one?

A process plans the shipped motorway ODD, compiles as ``adeye run`` does, and executes and judges
one test case: with a folder for compiled code that is empty, and with the one that the process
before has filled. Wall time of the whole process, and CPU time beside it with that of its children.

    python benchmarks/start.py            the whole measurement
    python benchmarks/start.py --smoke    one warm round, to see that it works
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from support.command import drive, ratios, spread

ROOT = Path(__file__).resolve().parent.parent
SCRIPT = """
import sys
from functools import partial
from adeye.campaign.plan import make_plan
from adeye.campaign.warmup import begin_aside, compile_aside, compile_meanwhile
from adeye.campaign.work import BatchTask, execute
from adeye.kernel.jit import is_cache_warm
aside = None if is_cache_warm() else begin_aside(2)
begun = aside and partial(compile_meanwhile, processes=aside)
plan = make_plan("odd/motorway_chauffeur.yaml", meanwhile=begun)
if aside:
    compile_aside(plan, aside)
result = execute(BatchTask(0, (plan.cases[0],), (), plan.work))
sys.exit(result.failure or 0)
"""


def first_result(cache: Path | None) -> tuple[float, float]:
    """Return wall and CPU time until a process has one judged result [s]."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    if cache is not None:
        environment["XDG_CACHE_HOME"] = str(cache)
        for name in ("NUMBA_CACHE_DIR", "ADEYE_NUMBA_CACHE_DIR"):
            environment.pop(name, None)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    began = time.perf_counter()
    subprocess.run(  # noqa: S603 - the script of this file
        [sys.executable, "-c", SCRIPT], check=True, cwd=ROOT, env=environment
    )
    wall = time.perf_counter() - began
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure cold and warm, one after the other in each round."""
    cold, warm = [], []
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as folder:
            cache = None if smoke else Path(folder)
            cold.append(first_result(cache))
            warm.append(first_result(cache))
    pairs = [(one[0], other[0]) for one, other in zip(cold, warm, strict=True)]
    return [
        {
            "cold_s": statistics.median(wall for wall, _ in cold),
            "cold_cpu_s": statistics.median(cpu for _, cpu in cold),
            "warm_s": statistics.median(wall for wall, _ in warm),
            "warm_cpu_s": statistics.median(cpu for _, cpu in warm),
            **ratios(pairs),
        }
    ]


HEADERS = ("cold [s]", "cold CPU", "warm [s]", "warm CPU", "ratio (spread)")


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    names = ("cold_s", "cold_cpu_s", "warm_s", "warm_cpu_s")
    return [*(f"{item[name]:.2f}" for name in names), spread(item, 1)]


if __name__ == "__main__":
    sys.exit(drive("start", __doc__, measure, HEADERS, row))
