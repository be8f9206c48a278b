"""How much slower or faster is a closed-loop run of adeye than highway-env's own physics step?

Both drive the same number of vehicles for the same time with the same step. highway-env: a straight
three-lane road of its IDM and MOBIL vehicles, stepped with ``Road.act`` and ``Road.step``. adeye:
as many vehicles, all but the ego of the same model, and on top of them a camera, a radar,
localisation, ground truth, nominal and safety channel, switch, contact and the recorded trace.
CPU time of one process, rounds interleaved, the warm-up thrown away. The ratio is what counts.

    python benchmarks/closed_loop.py            the whole measurement
    python benchmarks/closed_loop.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from support.results import machine, table, write_result

from adeye import engine
from adeye.kernel.random import owner_id, uniform
from adeye.spec.load import load_architecture
from adeye.spec.odd import Attributes
from adeye.spec.scenario import LogicalScenario
from adeye.sweep.case import TestCase

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

ROOT = Path(__file__).resolve().parent.parent
STEP_S = 0.05
GAP_M = 40.0
SPEED_MPS = 25.0
LANES = 3


@dataclass(frozen=True)
class Size:
    """A size of the problem.

    Attributes:
        vehicles: On the road, the ego among them.
        runs: In one batch, and as many roads of highway-env.
        seconds: Simulated.
    """

    vehicles: int
    runs: int
    seconds: float


def scenario(vehicles: int, seconds: float) -> LogicalScenario:
    """Describe a platoon of reactive vehicles with the ego in its middle."""
    speed = f"{SPEED_MPS} m/s"
    places = [k for k in range(vehicles) if k != vehicles // 2]
    actors = {
        f"car_{k}": {
            "kind": "car",
            "start": {"lane": k % LANES, "s": f"{100 + GAP_M * k} m", "speed": speed},
            "reactive": {"desired_speed": f"{SPEED_MPS + k % 4} m/s", "lane_changes": True},
        }
        for k in places
    }
    return LogicalScenario.model_validate(
        {
            "scenario": "traffic",
            "title": "Reactive traffic",
            "provenance": {"source": "benchmark"},
            "world": {
                "road": {
                    "length": "10 km",
                    "lanes": LANES,
                    "lane_width": "3.5 m",
                    "shoulder": "3 m",
                    "speed_limit": "130 km/h",
                }
            },
            "environment": {"rain": "0 mm/h", "fog_visibility": "10 km", "friction": 0.9},
            "ego": {
                "lane": (vehicles // 2) % LANES,
                "s": f"{100 + GAP_M * (vehicles // 2)} m",
                "speed": speed,
                "desired_speed": speed,
            },
            "actors": actors,
            "storyboard": {},
            "horizon": f"{seconds} s",
            "tail": "0 s",
        }
    )


def closed_loop(size: Size) -> Callable[[], int]:
    """Prepare a batch of adeye; the function runs it and returns vehicle steps."""
    spec = scenario(size.vehicles, size.seconds)
    architecture = load_architecture(ROOT / "odd" / "architectures" / "camera_radar.yaml").spec
    cases = [
        TestCase(
            scenario_id="traffic",
            scenario=spec,
            parameters={},
            architecture=architecture,
            faults=(),
            fault_entry="none",
            replicate=number,
            seed=1,
            step=STEP_S,
            point={},
            inside_odd=True,
            attributes=Attributes(),
        )
        for number in range(size.runs)
    ]

    def run() -> int:
        trace = engine.run(cases)
        return int((trace.length - 1).sum()) * size.vehicles

    return run


def physics(size: Size) -> Callable[[], int]:
    """Prepare roads of highway-env; the function steps them and returns vehicle steps."""
    from highway_env.road.road import Road, RoadNetwork
    from highway_env.vehicle.behavior import IDMVehicle

    def road(number: int) -> Road:
        made = Road(RoadNetwork.straight_road_network(LANES, length=10_000, speed_limit=36))
        for k in range(size.vehicles):
            lane = made.network.get_lane(("0", "1", k % LANES))
            vehicle = IDMVehicle(
                made,
                lane.position(100 + GAP_M * k, 0),
                lane.heading_at(0),
                SPEED_MPS,
                target_speed=SPEED_MPS + k % 4,
            )
            share = uniform(np.uint64(number), np.uint64(owner_id(f"car_{k}")), 0, 0)
            vehicle.timer = float(share) * vehicle.LANE_CHANGE_DELAY
            made.vehicles.append(vehicle)
        return made

    ticks = round(size.seconds / STEP_S)

    def run() -> int:
        for number in range(size.runs):
            made = road(number)
            for _ in range(ticks):
                made.act()
                made.step(STEP_S)
        return ticks * size.runs * size.vehicles

    return run


def timed(function: Callable[[], int]) -> tuple[float, int]:
    """Return the CPU time per vehicle step [µs] and how many there were."""
    began = time.process_time()
    steps = function()
    return 1e6 * (time.process_time() - began) / steps, steps


def measure(size: Size, rounds: int) -> dict[str, object]:
    """Measure both, one after the other in each round."""
    ours, theirs = closed_loop(size), physics(size)
    ours()  # compile and warm up
    theirs()
    pairs = []
    steps = 0
    for _ in range(rounds):
        mine, steps = timed(ours)
        peer, _ = timed(theirs)
        pairs.append((mine, peer))
    ratios = [mine / peer for mine, peer in pairs]
    return {
        "vehicles": size.vehicles,
        "runs": size.runs,
        "seconds": size.seconds,
        "vehicle_steps": steps,
        "rounds": rounds,
        "adeye_us": statistics.median(mine for mine, _ in pairs),
        "highway_env_us": statistics.median(peer for _, peer in pairs),
        "ratio": statistics.median(ratios),
        "ratio_least": min(ratios),
        "ratio_most": max(ratios),
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print a table and write the result."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--smoke", action="store_true", help="one short round")
    parser.add_argument("--rounds", type=int, default=5, help="rounds, at least 3")
    given = parser.parse_args(arguments)
    if given.smoke:
        found = [measure(Size(3, 2, 1.0), 1)]
    else:
        if given.rounds < 3:
            parser.error("the median of fewer than 3 rounds says nothing")
        sizes = (Size(5, 16, 10.0), Size(20, 16, 10.0))
        found = [measure(size, given.rounds) for size in sizes]
    rows = [
        [
            str(item["vehicles"]),
            str(item["runs"]),
            f"{item['adeye_us']:.1f}",
            f"{item['highway_env_us']:.1f}",
            f"{item['ratio']:.2f} ({item['ratio_least']:.2f} to {item['ratio_most']:.2f})",
        ]
        for item in found
    ]
    headers = ["vehicles", "runs", "adeye [µs/vehicle step]", "highway-env", "ratio (spread)"]
    print(table(headers, rows))
    if not given.smoke:
        print(f"wrote {write_result('closed_loop', {'machine': machine(), 'sizes': found})}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
