"""How many times faster is the compiled traffic than highway-env's own physics, step for step?

Both start from the same scenes and do the same work for 300 steps at 15 Hz on a straight road of
four lanes: everybody decides with IDM and MOBIL, moves as a bicycle and is found on its lane, and
all pairs are looked at for contact, with the impacts of highway-env. Nobody begins on the centre
of a lane; they change lanes and touch. ``reference`` computes in highway-env's order and agrees
with it to 1e-9; ``fast`` is simpler algebra. CPU time of one process and one thread, rounds
interleaved scene by scene, compilation thrown away. The ratio is what counts.

    python benchmarks/traffic.py            the whole measurement
    python benchmarks/traffic.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from support.highway_scenes import STEP, Converted, convert, scene
from support.results import machine, table, write_result

from adeye.kernel.jit import compiled
from adeye.kernel.traffic import network as n
from benchmarks.support.crash import advance_crashing_fast, advance_crashing_reference

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from adeye.signals import Floats, Ints

STEPS = 300
ROUNDS = 5
HEADERS = (
    "vehicles",
    "highway-env [µs/step]",
    "reference",
    "fast",
    "ratio of reference (spread)",
    "ratio of fast (spread)",
    "fast to reference",
)


@dataclass(frozen=True)
class Size:
    """A size of the problem.

    Attributes:
        vehicles: On the road.
        seeds: Of the scenes.
        repeats: How often our side drives a scene, so that its time can be read off a clock.
        steps: Of 1/15 s.
    """

    vehicles: int
    seeds: Sequence[int]
    repeats: int
    steps: int = STEPS


# Of each size some scenes are dense, and in some of those vehicles touch.
SIZES = (
    Size(2, range(16), 200),
    Size(5, range(10), 100),
    Size(20, range(3), 40),
    Size(50, range(2), 12),
)


@compiled
def drive_reference(road: n.Road, bodies: Floats, pairs: Ints, corners: Floats, steps: int) -> None:
    """Drive a scene in the reference arithmetic; see ``crash`` for the arguments."""
    for _ in range(steps):
        advance_crashing_reference(road, bodies, pairs, corners, STEP)


@compiled
def drive_fast(road: n.Road, bodies: Floats, pairs: Ints, corners: Floats, steps: int) -> None:
    """Drive a scene in the fast arithmetic."""
    for _ in range(steps):
        advance_crashing_fast(road, bodies, pairs, corners, STEP)


def time_kernel(drive: Callable[..., None], start: Converted, size: Size) -> float:
    """Return the CPU time of a scene in a kernel [s]; the start is left as it is."""
    copies = [
        (
            start.road._replace(vehicles=start.vehicles.copy(), marks=start.marks.copy()),
            start.bodies[0].copy(),
        )
        for _ in range(size.repeats)
    ]
    _, pairs, corners = start.bodies
    began = time.process_time()
    for road, bodies in copies:
        drive(road, bodies, pairs, corners, size.steps)
    return (time.process_time() - began) / size.repeats


def time_highway(road: Any, steps: int) -> float:
    """Return the CPU time of a scene in highway-env [s]."""
    began = time.process_time()
    for _ in range(steps):
        road.act()
        road.step(STEP)
    return time.process_time() - began


def count_events(size: Size) -> tuple[int, int]:
    """Return lane changes and vehicles that touch, in all scenes of a size."""
    changes = contacts = 0
    for seed in size.seeds:
        ours = convert(scene("straight", seed, size.vehicles))
        lanes = ours.marks[:, n.LANE].copy()
        for _ in range(size.steps):
            ours.advance()
            changes += int((ours.marks[:, n.LANE] != lanes).sum())
            lanes = ours.marks[:, n.LANE].copy()
        contacts += int(ours.marks[:, n.CRASHED].sum())
    return changes, contacts


def run_round(size: Size) -> tuple[float, float, float]:
    """Time highway-env, the reference and the fast kernel on all scenes of a size [s]."""
    times = np.zeros(3)
    for seed in size.seeds:
        road = scene("straight", seed, size.vehicles)
        start = convert(road)
        reference = time_kernel(drive_reference, start, size)
        highway = time_highway(road, size.steps)
        fast = time_kernel(drive_fast, start, size)
        times += highway, reference, fast
    return float(times[0]), float(times[1]), float(times[2])


def summary(values: Sequence[float]) -> dict[str, float]:
    """Return median and spread."""
    return {"median": statistics.median(values), "least": min(values), "most": max(values)}


def measure_size(size: Size, rounds: int) -> dict[str, Any]:
    """Measure one size of the problem."""
    changes, contacts = count_events(size)
    start = convert(scene("straight", size.seeds[0], size.vehicles))
    for drive in (drive_reference, drive_fast):
        time_kernel(drive, start, Size(size.vehicles, (0,), 1, 1))
    found = [run_round(size) for _ in range(rounds)]
    scale = 1e6 / (size.steps * len(size.seeds))
    return {
        "vehicles": size.vehicles,
        "scenes": len(size.seeds),
        "steps": size.steps,
        "rounds": rounds,
        "lane_changes": changes,
        "contacts": contacts,
        "highway_env_us": statistics.median(highway for highway, _, _ in found) * scale,
        "reference_us": statistics.median(reference for _, reference, _ in found) * scale,
        "fast_us": statistics.median(fast for _, _, fast in found) * scale,
        "ratio_reference": summary([highway / reference for highway, reference, _ in found]),
        "ratio_fast": summary([highway / fast for highway, _, fast in found]),
        "fast_to_reference": summary([reference / fast for _, reference, fast in found]),
    }


def measure(rounds: int = ROUNDS, sizes: Sequence[Size] = SIZES) -> list[dict[str, Any]]:
    """Measure all sizes.

    Args:
        rounds: Of each size; the median of fewer than 3 says nothing.
        sizes: What to measure.

    Raises:
        RuntimeError: The scenes are benign: nobody changes lanes or nobody touches.
    """
    found = [measure_size(size, rounds) for size in sizes]
    if sizes is SIZES:
        for event in ("lane_changes", "contacts"):
            if not sum(item[event] for item in found):
                msg = f"the scenes have no {event.replace('_', ' ')}, so they measure too little"
                raise RuntimeError(msg)
    return found


def spread(values: dict[str, float], digits: int = 0) -> str:
    """Write median and spread."""
    median, least, most = (f"{values[name]:,.{digits}f}" for name in ("median", "least", "most"))
    return f"{median} ({least} to {most})"


def rows(found: Sequence[dict[str, Any]]) -> list[list[str]]:
    """Write the table's rows."""
    return [
        [
            str(item["vehicles"]),
            f"{item['highway_env_us']:,.0f}",
            f"{item['reference_us']:.3f}",
            f"{item['fast_us']:.3f}",
            spread(item["ratio_reference"]),
            spread(item["ratio_fast"]),
            spread(item["fast_to_reference"], 2),
        ]
        for item in found
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print a table and write the result."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--smoke", action="store_true", help="one short round")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="rounds, at least 3")
    given = parser.parse_args(arguments)
    if given.smoke:
        found = measure(1, [Size(3, (0,), 2, 20)])
    elif given.rounds < 3:
        parser.error("the median of fewer than 3 rounds says nothing")
    else:
        found = measure(given.rounds)
    print(table(HEADERS, rows(found)))
    if not given.smoke:
        print(f"wrote {write_result('traffic', {'machine': machine(), 'sizes': found})}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
