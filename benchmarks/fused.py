"""How much could a driver save that fuses the stages of a tick into one compiled loop?

The driver ``stepwise`` calls each stage for all runs of a batch, tick by tick. A fused one would do
the same arithmetic run by run; at best it saves everything that is not arithmetic: Python between
the kernels, copies from stage to stage and rows on their way to the columns. So the time of the
closed loop is put beside the time inside its kernels but the recorder's; their ratio is an upper
bound of the gain, reached only if fusing cost nothing.

CPU time of one process and one thread, rounds one after the other; with a profiler's hook around
every compiled function, whose own cost counts as overhead, so that the bound errs upwards.

    python benchmarks/fused.py            the whole measurement
    python benchmarks/fused.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import cProfile
import pstats
import statistics
import sys
import time
from typing import Any

from closed_loop import Size, test_cases
from support.command import drive, ratios, spread

from adeye.simulate import engine
from adeye.simulate.recorder import Memory

SIZES = (Size(2, 1024, 15.0, 1), Size(5, 1024, 15.0, 1), Size(20, 512, 15.0, 1))
KERNELS = frozenset(
    {
        "_act",
        "_estimate",
        "_arbitrate",
        "_list_objects",
        "_sample_batch",
        "_settle",
        "begin_events",
        "end_runs",
        "fill_motion",
        "locate_all",
        "move_actors",
        "move_egos",
        "react_fast",
        "react_reference",
        "show_placed",
        "sweep_contacts",
        "take_reacted",
    }
)


def kernel_time(cases: list[Any], memory: Memory) -> float:
    """Return the time inside the kernels of a closed loop [s]."""
    profile = cProfile.Profile(time.process_time)
    profile.runcall(engine.run, cases, memory=memory)
    # The profiler sees a compiled function under the place of its source.
    stats: Any = pstats.Stats(profile).stats  # type: ignore[attr-defined]
    found = {name for _, _, name in stats} & KERNELS
    if len(found) < 8:
        msg = f"only {sorted(found)} were seen: the names of the kernels have changed"
        raise RuntimeError(msg)
    return float(sum(value[2] for (_, _, name), value in stats.items() if name in KERNELS))


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure both, one after the other in each round."""
    found = []
    for size in (Size(3, 16, 1.0, 1),) if smoke else SIZES:
        cases, memory = test_cases(size), Memory()
        steps = float((engine.run(cases, memory=memory).length - 1).sum())
        pairs = []
        for _ in range(rounds):
            began = time.process_time()
            engine.run(cases, memory=memory)
            pairs.append((time.process_time() - began, kernel_time(cases, memory)))
        found.append(
            {
                "vehicles": size.vehicles,
                "runs": size.runs,
                "stepwise_us": 1e6 * statistics.median(one for one, _ in pairs) / steps,
                "kernels_us": 1e6 * statistics.median(two for _, two in pairs) / steps,
                **ratios(pairs),
            }
        )
    return found


HEADERS = ("vehicles", "runs", "stepwise [µs/step]", "kernels alone", "bound: ratio (spread)")


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    return [
        str(item["vehicles"]),
        str(item["runs"]),
        f"{item['stepwise_us']:.2f}",
        f"{item['kernels_us']:.2f}",
        spread(item),
    ]


if __name__ == "__main__":
    sys.exit(drive("fused", __doc__, measure, HEADERS, row))
