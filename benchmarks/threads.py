"""How many times the runs of one thread do two threads finish in the same time?

Blocks of critical runs (see ``closed_loop``) are executed, judged and digested by one thread and by
two, side by side in each round; wall time of the same number of blocks. On a machine that has other
work to do the ratio says how busy it is, not how well threads scale: the load is printed.

    python benchmarks/threads.py            the whole measurement
    python benchmarks/threads.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

from closed_loop import Size, closed_loop
from support.command import drive, ratios, spread

if TYPE_CHECKING:
    from collections.abc import Callable

    from adeye.trace import Trace

BLOCKS = 4
SIZES = (Size(5, 1024, 10.0, 1), Size(20, 512, 10.0, 1))


def wall(work: list[Callable[[], Trace]]) -> float:
    """Return how long some threads take for all blocks, each with work of its own [s]."""
    began = time.perf_counter()
    with ThreadPoolExecutor(len(work)) as pool:
        shares = [pool.submit(_repeat, item, BLOCKS // len(work)) for item in work]
        for share in shares:
            share.result()
    return time.perf_counter() - began


def _repeat(work: Callable[[], Trace], times: int) -> None:
    for _ in range(times):
        work()


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure both, one after the other in each round."""
    found = []
    for size in (Size(3, 16, 1.0, 1),) if smoke else SIZES:
        work = [closed_loop(size), closed_loop(size)]
        for item in work:
            item()
        pairs = [(wall(work[:1]), wall(work)) for _ in range(rounds)]
        found.append(
            {
                "vehicles": size.vehicles,
                "runs": size.runs * BLOCKS,
                "processors": os.cpu_count(),
                "load": os.getloadavg()[0],
                "one_thread_s": min(one for one, _ in pairs),
                "two_threads_s": min(two for _, two in pairs),
                **ratios(pairs),
            }
        )
    return found


HEADERS = ("vehicles", "runs", "load", "one thread [s]", "two threads", "ratio (spread)")


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    return [
        str(item["vehicles"]),
        str(item["runs"]),
        f"{item['load']:.1f}",
        f"{item['one_thread_s']:.2f}",
        f"{item['two_threads_s']:.2f}",
        spread(item),
    ]


if __name__ == "__main__":
    sys.exit(drive("threads", __doc__, measure, HEADERS, row))
