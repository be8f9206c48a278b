"""What does a run cost on an imported road beside one on a straight parametric road?

*Rails* is a vehicle step of reactive traffic beside one on a straight road, there in the arithmetic
that is taken unless somebody says otherwise (``reference``) and in the ``fast`` one, counted as
``rails.py`` does: once with all runs at one place, once with a place for each, whose lines and
lanes do not stay in the cache. *Simulation* is a step of a run of the whole closed loop,
what prepares it included: an ego behind a lead that brakes, every run at its own place. All places
are of the shipped map of a motorway with ramps; how many lanes a map has beside is nothing to a
run, for the road of a place is content. CPU time of one thread, rounds interleaved, as many runs
on both roads; the ratio is what counts.

    python benchmarks/imported.py            the whole measurement
    python benchmarks/imported.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import statistics
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from closed_loop import LANES, Size, reactive_case, scenario, test_cases
from rails import cost_of, on_road
from support.command import drive, ratios, spread

from adeye.kernel.strips import STRIP_LANE
from adeye.maps.carriageway import Lanes
from adeye.maps.places import Asked, places_of
from adeye.simulate import engine
from adeye.spec.places import PlaceRoad, read_map
from adeye.spec.scenario import Road

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.sweep.case import TestCase

MAP = Path(__file__).resolve().parent.parent / "scenarios_db" / "maps" / "ramp.xodr"
BEFORE_M, AFTER_M, EGO_M = 100.0, 1400.0, 100.0
RUNS, RAIL_RUNS = 100, 512


def roads() -> list[Road]:
    """Return the roads of all places of the map that have enough lanes all along."""
    lanes = Lanes.of(read_map(MAP)[0])
    found = places_of(lanes, MAP.stem, Asked("carriageway", BEFORE_M, AFTER_M)).places
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


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure everything once a round."""
    places = roads()
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
            one = cost_of(each[:1] * size.runs, size, "rails")
            all_ = cost_of(each, size, "rails")
            for kind in ("reference", "fast"):
                other = cost_of([case] * size.runs, size, kind)
                pairs[f"rails, {vehicles} vehicles, one place, {kind}"] = (one, other)
                pairs[f"rails, {vehicles} vehicles, a place each, {kind}"] = (all_, other)
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
