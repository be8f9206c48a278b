"""How many times faster is the judged closed loop of adeye than highway-env's own physics step?

Both drive as many vehicles for the same time with the same step. highway-env: a straight
three-lane road of its IDM and MOBIL vehicles, stepped with ``Road.act`` and ``Road.step``, nothing
else. adeye: as many vehicles, all but the ego and its lead of the same model, and on top of them
camera, radar, localisation, ground truth, nominal and safety channel, switch, contact, the trace
and its digest, every built-in metric and the verdicts of the motorway's requirements.

The scenes are critical: the lead brakes hard, close ahead, on wet roads, so that the safety channel
takes over in many runs and does not always succeed; how often is printed and required.

CPU time of one process and one thread, rounds interleaved, the warm-up thrown away. The ratio, per
step of all vehicles, is what counts.

    python benchmarks/closed_loop.py            the whole measurement
    python benchmarks/closed_loop.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import statistics
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from support.command import drive, ratios, spread

from adeye.campaign.work import evaluate
from adeye.kernel.random import owner_id, uniform
from adeye.simulate import engine
from adeye.simulate.recorder import Memory
from adeye.spec.load import load_odd
from adeye.spec.odd import Attributes
from adeye.spec.scenario import LogicalScenario
from adeye.sweep.case import TestCase

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from adeye.trace import Trace

ROOT = Path(__file__).resolve().parent.parent
ODD = ROOT / "odd" / "motorway_chauffeur.yaml"
STEP_S = 0.05
GAP_M = 40.0
SPEED_MPS = 25.0
LANES = 3
PARAMETERS = {
    "ego_speed": (20.0, 36.0),
    "gap": (10.0, 35.0),
    "deceleration": (6.0, 9.5),
    "begins": (0.5, 4.0),
    "friction": (0.5, 0.9),
}
"""Ends of what varies from run to run, in SI."""


@dataclass(frozen=True)
class Size:
    """A size of the problem.

    Attributes:
        vehicles: On the road, the ego among them.
        runs: In one batch.
        seconds: Simulated.
        roads: Of highway-env.
    """

    vehicles: int
    runs: int
    seconds: float
    roads: int


SIZES = (
    Size(2, 1024, 15.0, 6),
    Size(5, 1024, 15.0, 4),
    Size(20, 512, 15.0, 2),
    Size(50, 128, 15.0, 1),
)


def scenario(vehicles: int, seconds: float, at: float = 2000.0 + 0.4 * GAP_M) -> LogicalScenario:
    """Describe a lead that brakes hard, in the midst of reactive vehicles; the ego begins there."""
    actors = reactive_actors(range(vehicles - 2), 2000 - GAP_M * (vehicles // 2))
    actors["lead"] = {
        "kind": "car",
        "start": {"lane": 1, "ahead_of": "ego", "gap": "gap", "speed": "ego_speed"},
    }
    content = motorway(seconds, actors)
    content["parameters"] = {
        "ego_speed": {"default": "25 m/s", "range": ["0 m/s", "40 m/s"]},
        "gap": {"default": "30 m", "range": ["1 m", "100 m"]},
        "deceleration": {"default": "6 m/s^2", "range": ["1 m/s^2", "10 m/s^2"]},
        "begins": {"default": "1 s", "range": ["0 s", "20 s"]},
        "friction": {"default": 0.9, "range": [0.1, 1.0]},
    }
    content["environment"]["friction"] = "friction"
    content["ego"] = {
        "lane": 1,
        "s": f"{at} m",
        "speed": "ego_speed",
        "desired_speed": "ego_speed",
    }
    content["storyboard"] = {
        "brake": {
            "actor": "lead",
            "when": "time >= begins",
            "stop": {"rate": "deceleration", "jerk": "20 m/s^3"},
        }
    }
    return LogicalScenario.model_validate(content)


def reactive_actors(places: Iterable[int], first: float) -> dict[str, Any]:
    """Describe reactive vehicles; none of them drives exactly on the centre of a lane."""
    return {
        f"car_{k}": {
            "kind": "car",
            "start": {
                "lane": k % LANES,
                "offset": f"{0.3 - 0.1 * (k % 5)} m",
                "s": f"{first + GAP_M * k} m",
                "speed": f"{SPEED_MPS} m/s",
            },
            "reactive": {"desired_speed": f"{SPEED_MPS + k % 4} m/s", "lane_changes": True},
        }
        for k in places
    }


def motorway(seconds: float, actors: dict[str, Any]) -> dict[str, Any]:
    """Describe what the scenarios of the benchmarks share."""
    return {
        "scenario": "traffic",
        "title": "Traffic",
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
        "actors": actors,
        "storyboard": {},
        "horizon": f"{seconds} s",
        "tail": "0 s",
    }


def reactive_case(size: Size) -> TestCase:
    """Make a test case of an ego amid reactive vehicles, where nothing happens."""
    middle = size.vehicles // 2
    places = [k for k in range(size.vehicles) if k != middle]
    content = motorway(size.seconds + 5.0, reactive_actors(places, 100.0))
    content["ego"] = {
        "lane": middle % LANES,
        "s": f"{100 + GAP_M * middle} m",
        "speed": f"{SPEED_MPS} m/s",
        "desired_speed": f"{SPEED_MPS} m/s",
    }
    return _case(LogicalScenario.model_validate(content), {}, 0)


def _case(spec: LogicalScenario, parameters: dict[str, float], number: int) -> TestCase:
    return TestCase(
        scenario_id="traffic",
        scenario=spec,
        parameters=parameters,
        architecture=load_odd(ODD).architectures["camera_radar"].spec,
        faults=(),
        fault_entry="none",
        replicate=number,
        seed=1,
        step=STEP_S,
        point={},
        inside_odd=True,
        attributes=Attributes(),
    )


def test_cases(size: Size) -> list[TestCase]:
    """Draw the test cases of a batch."""
    first = _case(scenario(size.vehicles, size.seconds), {}, 0)
    return [
        replace(
            first,
            parameters={
                name: low + (high - low) * float(uniform(np.uint64(1), np.uint64(at), run, 0))
                for at, (name, (low, high)) in enumerate(PARAMETERS.items())
            },
            replicate=run,
        )
        for run in range(size.runs)
    ]


def closed_loop(size: Size, variant: str = "reference") -> Callable[[], Trace]:
    """Prepare a batch of adeye; the function runs and judges it."""
    cases = test_cases(size)
    requirements = load_odd(ODD).concept.spec.requirements
    memory = Memory()

    def run() -> Trace:
        trace = engine.run(cases, variant=variant, memory=memory)
        evaluate(trace, cases, requirements, ("front_camera_out", "nominal_silent"))
        trace.digests()
        return trace

    return run


def physics(size: Size) -> Callable[[], int]:
    """Prepare roads of highway-env; the function steps them and returns steps of a road."""
    from highway_env.road.road import Road, RoadNetwork
    from highway_env.vehicle.behavior import IDMVehicle

    def road(number: int) -> Road:
        made = Road(RoadNetwork.straight_road_network(LANES, length=10_000, speed_limit=36))
        for k in range(size.vehicles):
            lane = made.network.get_lane(("0", "1", k % LANES))
            vehicle = IDMVehicle(
                made,
                lane.position(100 + GAP_M * k, 0.3 - 0.1 * (k % 5)),
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
        for number in range(size.roads):
            made = road(number)
            for _ in range(ticks):
                made.act()
                made.step(STEP_S)
        return ticks * size.roads

    return run


def criticality(trace: Trace) -> dict[str, float]:
    """Tell in which share of the runs the safety channel took over and the ego hit something.

    Raises:
        RuntimeError: In next to none: then nothing that matters was measured.
    """
    last = trace.length - 1
    rows = np.arange(trace["authority"].shape[1]) < last[:, np.newaxis]
    safety = trace.layout.channels.index("safety")
    taken = float(((trace["authority"] == safety) & rows).any(axis=1).mean())
    touched = float((trace["contact"][np.arange(trace.runs), last] >= 0).mean())
    if trace.runs >= 100 and (taken < 0.2 or touched < 0.02):
        msg = f"the scenes are benign: {taken:.0%} handovers, {touched:.0%} contacts"
        raise RuntimeError(msg)
    return {"handovers": taken, "contacts": touched}


def measure(size: Size, rounds: int, variant: str = "reference") -> dict[str, Any]:
    """Measure both, one after the other in each round."""
    ours, theirs = closed_loop(size, variant), physics(size)
    found: Mapping[str, float] = criticality(ours())
    physics(replace(size, roads=1, seconds=1.0))()
    pairs = []
    for _ in range(rounds):
        began = time.process_time()
        trace = ours()
        mine = 1e6 * (time.process_time() - began) / float((trace.length - 1).sum())
        began = time.process_time()
        steps = theirs()
        pairs.append((mine, 1e6 * (time.process_time() - began) / steps))
    return {
        "vehicles": size.vehicles,
        "variant": variant,
        "runs": size.runs,
        "seconds": size.seconds,
        "rounds": rounds,
        **found,
        "adeye_us": statistics.median(mine for mine, _ in pairs),
        "highway_env_us": statistics.median(peer for _, peer in pairs),
        **ratios([(peer, mine) for mine, peer in pairs]),
    }


def measure_all(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure every size in both variants."""
    if smoke:
        return [measure(Size(3, 4, 2.0, 1), 1)]
    return [measure(size, rounds, variant) for size in SIZES for variant in ("reference", "fast")]


HEADERS = (
    "vehicles",
    "runs",
    "handovers",
    "contacts",
    "adeye [µs/step]",
    "highway-env",
    "ratio (spread)",
)


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    return [
        f"{item['vehicles']} {item['variant']}",
        str(item["runs"]),
        f"{item['handovers']:.0%}",
        f"{item['contacts']:.0%}",
        f"{item['adeye_us']:.2f}",
        f"{item['highway_env_us']:.0f}",
        spread(item, 0),
    ]


if __name__ == "__main__":
    sys.exit(drive("closed_loop", __doc__, measure_all, HEADERS, row))
