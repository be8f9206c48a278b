"""What does a vehicle step on rails cost beside one of the drivers on a straight motorway?

The same platoon on three lanes, once with rails along a line of 60 arcs, whose lanes are cut into
twelve slabs, once on the straight road of the two other kinds of arithmetic. Counted is what
drivers decide and how they move, and that they are shown the ego; not contact, nor where the stage
finds everything. All runs are on one road; ``imported.py`` has one for each. CPU
time of one thread, rounds interleaved; the ratio is what counts.

    python benchmarks/rails.py            the whole measurement
    python benchmarks/rails.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import statistics
import sys
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from closed_loop import LANES, Size, reactive_case
from support.command import drive, ratios, spread

from adeye.kernel.strips import DRIVING, OWN
from adeye.simulate.traffic import rails
from adeye.simulate.traffic.batch import BatchTraffic, show_placed
from adeye.spec.scenario import Road

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.sweep.case import TestCase

ARCS, SLABS, PIECE_M, RADIUS_M, WIDTH_M = 60, 12, 50.0, 800.0, 3.5


def bent(case: TestCase) -> TestCase:
    """Return a test case on a line of arcs instead of its road."""
    line = [(PIECE_M, (-1.0) ** (k // 4) / RADIUS_M) for k in range(ARCS)]
    strips = [
        (DRIVING, OWN, 60.0, k, k * WIDTH_M, 0.0, (k + 1) * WIDTH_M, 0.0) for k in range(LANES)
    ]
    slabs = [(k * ARCS * PIECE_M / SLABS, strips) for k in range(SLABS)]
    content = {"kind": "imported", "length": f"{ARCS * PIECE_M} m", "line": line, "slabs": slabs}
    content |= {"lanes": LANES, "lane_width": f"{WIDTH_M} m", "shoulder": "2.5 m"}
    return on_road(case, Road.model_validate(content | {"speed_limit": "60 m/s"}))


def on_road(case: TestCase, road: Road) -> TestCase:
    """Return a test case on another road."""
    world = case.scenario.world.model_copy(update={"road": road})
    return replace(case, scenario=case.scenario.model_copy(update={"world": world}))


def cost_of(cases: Sequence[TestCase], size: Size, variant: str) -> float:
    """CPU seconds for a vehicle step of test cases of a size."""
    case = cases[0]
    traffic = BatchTraffic("fast" if variant == "rails" else variant)
    traffic.reset(cases)
    stage, everyone = traffic._require_stage(), np.ones(size.runs, dtype=np.bool_)
    step, reacted, laid = case.step, traffic._reacted, traffic._rails
    command = np.zeros((size.runs, 2))
    steps, taken = round(size.seconds / step), 0.0
    for _ in range(steps):
        start = time.process_time()
        if laid is not None:
            rails.react_on_rails(everyone, laid, step, reacted)
        else:
            traffic._react(everyone, traffic._roads, step, reacted)
        taken += time.process_time() - start
        stage.advance(command, reacted, None, None if laid is None else laid.known)
        scene = stage.scene()
        start = time.process_time()
        if laid is not None:
            places = scene.ego_place, scene.object_places
            rails.show_placed(everyone, scene.ego, scene.objects, *places, laid)
        else:
            show_placed(everyone, scene.ego, scene.objects, traffic._roads)
        taken += time.process_time() - start
    return taken / (steps * size.runs * size.vehicles)


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure every size once a round."""
    found: dict[tuple[int, str], list[tuple[float, float]]] = {}
    for number in range(rounds + 1):
        for vehicles in (5,) if smoke else (5, 20):
            size = Size(vehicles, 8 if smoke else 512, 1.0 if smoke else 15.0, 1)
            case = reactive_case(size)
            mine = cost_of([bent(case)] * size.runs, size, "rails")
            for variant in ("fast", "reference"):
                other = cost_of([case] * size.runs, size, variant)
                if number:
                    found.setdefault((vehicles, variant), []).append((mine, other))
    return [
        {
            "vehicles": vehicles,
            "variant": variant,
            "rails_ns": 1e9 * statistics.median(mine for mine, _ in pairs),
            "straight_ns": 1e9 * statistics.median(other for _, other in pairs),
            **ratios(pairs),
        }
        for (vehicles, variant), pairs in found.items()
    ]


HEADERS = ("vehicles", "rails [ns/vehicle step]", "straight", "ratio (spread)")


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    return [
        f"{item['vehicles']}, {item['variant']}",
        f"{item['rails_ns']:,.0f}",
        f"{item['straight_ns']:,.0f}",
        spread(item),
    ]


if __name__ == "__main__":
    sys.exit(drive("rails", __doc__, measure, HEADERS, row))
