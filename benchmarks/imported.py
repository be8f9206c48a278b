"""What does a run cost on an imported road beside one on a straight parametric road?

*Rails* is a vehicle step of reactive traffic beside one on a straight road, there in the arithmetic
that is taken unless somebody says otherwise (``reference``) and in the ``fast`` one, counted as
``rails.py`` does: once with all runs at one place, once with a place for each, whose lines and
lanes do not stay in the cache, of the shipped map of a motorway with ramps and of one of at least
1,000 lanes. *Traffic* is the same step with all that belongs to it: everything is moved, found on
the road and looked at for contacts, while the ego weaves a little in its lane. *Simulation* is a
step of a run of the whole closed loop, what prepares it included: an ego behind a lead that brakes,
every run at its own place of the shipped map. How many lanes a map has is nothing to a run, for the
road of a place is content. CPU time of one thread, rounds interleaved, as many runs on all roads;
the ratio is what counts.

    python benchmarks/imported.py            the whole measurement
    python benchmarks/imported.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from closed_loop import LANES, SPEED_MPS, Size, reactive_case, scenario, test_cases
from rails import cost_of, on_road
from support.command import drive, ratios, spread
from support.wide_map import MAP, write_wide

from adeye.kernel.strips import STRIP_LANE
from adeye.maps.carriageway import Lanes
from adeye.maps.places import Asked, places_of
from adeye.signals import (
    EGO_HEADING,
    EGO_SPEED,
    PLACE_CURVATURE,
    PLACE_HEADING,
    PLACE_OFFSET,
    Floats,
    Scene,
)
from adeye.simulate import engine
from adeye.simulate.traffic.batch import BatchTraffic
from adeye.spec.places import PlaceRoad, read_map
from adeye.spec.scenario import Road

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.sweep.case import TestCase

BEFORE_M, AFTER_M, EGO_M = 100.0, 1400.0, 100.0
RUNS, RAIL_RUNS = 100, 512
MANY_LANES = 1_000
WHEELBASE_M = 2.9


def roads(path: Path) -> list[Road]:
    """Return the roads of all places of a map that have enough lanes all along."""
    lanes = Lanes.of(read_map(path)[0])
    found = places_of(lanes, path.stem, Asked("carriageway", BEFORE_M, AFTER_M)).places
    laid = [Road.model_validate(PlaceRoad(place).content) for place in found]
    return [road for road in laid if all(own_lanes(strips) >= LANES for _, strips in road.slabs)]


def own_lanes(strips: Sequence[Sequence[float]]) -> int:
    """Count the lanes of the ego's way."""
    return sum(strip[STRIP_LANE] >= 0.0 for strip in strips)


def loop_cost(cases: Sequence[TestCase]) -> float:
    """CPU seconds for a step of a run of the closed loop."""
    start = time.process_time()
    done = engine.run(cases)
    return (time.process_time() - start) / float(done.length.sum())


def traffic_cost(cases: Sequence[TestCase], size: Size) -> float:
    """CPU seconds for a vehicle step of the whole traffic."""
    traffic = BatchTraffic("reference")
    _, scene = traffic.reset(cases)
    steps, taken = round(size.seconds / cases[0].step), 0.0
    for number in range(steps):
        command = weave(scene, number * cases[0].step)
        start = time.process_time()
        scene = traffic.step(command)
        taken += time.process_time() - start
    return taken / (steps * size.runs * size.vehicles)


def weave(scene: Scene, t: float) -> Floats:
    """Return commands (B, 2) of egos that keep their lanes, though not their middles to the bit.

    An ego that is left alone stands in the field beside the first bend, where nobody looks for it,
    and one that holds a straight to the bit turns no corner of the arithmetic.
    """
    place, ego = scene.ego_place, scene.ego
    aside = place[:, PLACE_OFFSET] - 0.2 * np.sin(0.5 * t)
    aslant = np.mod(ego[:, EGO_HEADING] - place[:, PLACE_HEADING] + np.pi, 2.0 * np.pi) - np.pi
    curvature = place[:, PLACE_CURVATURE] - 0.005 * aside - 0.12 * aslant
    angle = np.clip(np.arctan(WHEELBASE_M * curvature), -0.4, 0.4)
    return np.column_stack([np.clip(0.5 * (SPEED_MPS - ego[:, EGO_SPEED]), -2.0, 2.0), angle])


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure everything once a round."""
    places = roads(MAP)
    with tempfile.TemporaryDirectory() as name:
        wide = Path(name) / "wide.xodr"
        written = write_wide(wide, MANY_LANES)
        many = roads(wide)
    runs, seconds = (8, 1.0) if smoke else (RUNS, 15.0)
    spec = scenario(2, seconds, EGO_M)
    straight = [replace(case, scenario=spec) for case in test_cases(Size(2, runs, seconds, 1))]
    laid = [on_road(case, places[k % len(places)]) for k, case in enumerate(straight)]
    found: dict[str, list[tuple[float, float]]] = {}
    for number in range(rounds + 1):
        pairs = {"simulation, a place each": (loop_cost(laid), loop_cost(straight))}
        for vehicles in (5,) if smoke else (5, 20):
            size = Size(vehicles, 8 if smoke else RAIL_RUNS, seconds, 1)
            case = reactive_case(size)
            each = [on_road(case, places[k % len(places)]) for k in range(size.runs)]
            spots = {"one place": each[:1] * size.runs, "a place each": each}
            spots[f"a place each of {written:,} lanes"] = [
                on_road(case, many[k * len(many) // size.runs]) for k in range(size.runs)
            ]
            laid_on = {what: cost_of(cases, size, "rails") for what, cases in spots.items()}
            straight_on = traffic_cost([case] * size.runs, size)
            for what, cases in spots.items():
                took = traffic_cost(cases, size)
                pairs[f"traffic, {vehicles} vehicles, {what}"] = (took, straight_on)
            for kind in ("reference", "fast"):
                other = cost_of([case] * size.runs, size, kind)
                for what, mine in laid_on.items():
                    pairs[f"rails, {vehicles} vehicles, {what}, {kind}"] = (mine, other)
        for what, pair in pairs.items():
            if number:
                found.setdefault(what, []).append(pair)
    return [
        {
            "what": what,
            "imported_ns": 1e9 * statistics.median(mine for mine, _ in pairs),
            "straight_ns": 1e9 * statistics.median(other for _, other in pairs),
            **ratios(pairs),
        }
        for what, pairs in found.items()
    ]


HEADERS = ("a step of", "imported [ns]", "straight [ns]", "ratio (spread)")


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    imported, straight = (f"{item[name]:,.0f}" for name in ("imported_ns", "straight_ns"))
    return [item["what"], imported, straight, spread(item)]


if __name__ == "__main__":
    sys.exit(drive("imported", __doc__, measure, HEADERS, row))
