"""What does a vehicle step of the compiled traffic cost beside one of SUMO (libsumo)?

Both drive as many vehicles as fit the question on a straight road of three lanes with steps of
0.05 s, from the same places at the same speeds, in one process, rounds interleaved, CPU time.
The work differs, so this compares costs, not models. SUMO: vehicles in lanes without a heading, its
IDM and its own lane change model, no contact between bodies, one world at a time. adeye: IDM and
MOBIL of highway-env on a kinematic bicycle each, an ego with actuators and tyres, contact swept
over the step, everything located on the road; a batch of worlds.

Needs libsumo: pip install 'adeye[bench]'

    python benchmarks/sumo.py            the whole measurement
    python benchmarks/sumo.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from closed_loop import GAP_M, LANES, SPEED_MPS, STEP_S, Size, reactive_case
from support.command import drive, ratios, spread

from adeye.simulate.traffic import make_traffic

ROOT = Path(__file__).resolve().parent.parent
ROAD_M = 10_000.0
WIDTH_M = 3.5


def network() -> str:
    """Describe the road for SUMO: one edge; its lanes are numbered from the right."""
    lanes = "".join(
        f'<lane id="road_{k}" index="{k}" speed="60" length="{ROAD_M}" width="{WIDTH_M}" '
        f'shape="0,{(k + 0.5) * WIDTH_M} {ROAD_M},{(k + 0.5) * WIDTH_M}"/>'
        for k in range(LANES)
    )
    ends = " ".join(f"road_{k}" for k in range(LANES))
    edge = LANES * WIDTH_M
    return (
        f'<net version="1.20"><edge id="road" from="a" to="b" priority="1">{lanes}</edge>'
        f'<junction id="a" type="dead_end" x="0" y="0" incLanes="" intLanes="" '
        f'shape="0,0 0,{edge}"/>'
        f'<junction id="b" type="dead_end" x="{ROAD_M}" y="0" incLanes="{ends}" intLanes="" '
        f'shape="{ROAD_M},0 {ROAD_M},{edge}"/></net>'
    )


def routes(vehicles: int) -> str:
    """Describe the vehicles for SUMO: places, speeds and desired speeds of the platoon."""
    kinds = "".join(
        f'<vType id="wants_{k}" carFollowModel="IDM" maxSpeed="{SPEED_MPS + k}" accel="3" '
        f'decel="5" tau="1.5" minGap="5" speedDev="0"/>'
        for k in range(4)
    )
    placed = "".join(
        f'<vehicle id="car_{k}" type="wants_{k % 4}" route="along" depart="0" '
        f'departLane="{k % LANES}" departPos="{100 + GAP_M * k}" departSpeed="{SPEED_MPS}"/>'
        for k in range(vehicles)
    )
    return f'<routes>{kinds}<route id="along" edges="road"/>{placed}</routes>'


def cost_of_sumo(folder: Path, size: Size) -> float:
    """CPU seconds for a vehicle step of SUMO."""
    import libsumo

    (folder / "road.net.xml").write_text(network(), "utf-8")
    (folder / "cars.rou.xml").write_text(routes(size.vehicles), "utf-8")
    steps = round(size.seconds / STEP_S)
    files = ["-n", str(folder / "road.net.xml"), "-r", str(folder / "cars.rou.xml")]
    libsumo.start(["sumo", *files, "--step-length", str(STEP_S), "--no-step-log", "--no-warnings"])
    try:
        libsumo.simulationStep()
        start = time.process_time()
        for _ in range(steps):
            libsumo.simulationStep()
        taken = time.process_time() - start
        if libsumo.vehicle.getIDCount() != size.vehicles:
            msg = "vehicles have left the road of SUMO"
            raise RuntimeError(msg)
    finally:
        libsumo.close()
    return taken / (steps * size.vehicles)


def cost_of_batch(size: Size, variant: str) -> float:
    """CPU seconds for a vehicle step of the compiled traffic."""
    traffic = make_traffic("batch", variant)
    traffic.reset([reactive_case(size)] * size.runs)
    command = np.zeros((size.runs, 2))
    steps = round(size.seconds / STEP_S)
    start = time.process_time()
    for _ in range(steps):
        traffic.step(command)
    taken = time.process_time() - start
    if not traffic.ending.running.all():
        msg = "runs have ended"
        raise RuntimeError(msg)
    return taken / (steps * size.runs * size.vehicles)


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure every size and both variants once a round."""
    try:
        import libsumo  # noqa: F401 - only whether it is there
    except ImportError:
        sys.exit("sumo.py needs libsumo: pip install 'adeye[bench]'")
    runs, seconds = (4, 1.0) if smoke else (1024, 15.0)
    found: dict[tuple[int, str], list[tuple[float, float]]] = {}
    for number in range(rounds + 1):
        for vehicles in (2, 5) if smoke else (2, 5, 20, 50):
            size = Size(vehicles, runs if vehicles < 20 else max(4, runs // 4), seconds, 1)
            with tempfile.TemporaryDirectory() as name:
                peer = cost_of_sumo(Path(name), size)
            for variant in ("reference", "fast"):
                mine = cost_of_batch(size, variant)
                if number:
                    found.setdefault((vehicles, variant), []).append((peer, mine))
    return [
        {
            "vehicles": vehicles,
            "variant": variant,
            "sumo_ns": 1e9 * statistics.median(peer for peer, _ in pairs),
            "adeye_ns": 1e9 * statistics.median(mine for _, mine in pairs),
            **ratios(pairs),
        }
        for (vehicles, variant), pairs in found.items()
    ]


HEADERS = ("vehicles", "SUMO [ns/vehicle step]", "adeye", "ratio (spread)")


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    return [
        f"{item['vehicles']} {item['variant']}",
        f"{item['sumo_ns']:,.0f}",
        f"{item['adeye_ns']:,.0f}",
        spread(item, 1),
    ]


if __name__ == "__main__":
    sys.exit(drive("sumo", __doc__, measure, HEADERS, row))
