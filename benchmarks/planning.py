"""What does planning a campaign cost per test case, and does it grow with the plan, or the map?

The shipped ODD of a million cut-ins, thinned to plans of 1,000, 10,000 and 100,000 test cases.
Expanding counts the points, digesting makes the columns with every identity, checking computes the
world of every point, rows are what is written into an empty database, committed. CPU time of one
process per test case, rounds interleaved over the sizes, the first round thrown away. The ratio of
a size's total to that of the smallest says whether planning grows faster than the plan.

Maps are the shipped motorway and one of 16 times as many lanes, its copies side by side: the whole
command ``adeye plan`` in a process of its own, CPU time and the most memory that it had resident.
``ramp_routes`` takes 18 places, as many on both maps; ``ramp`` takes all of most anchors, so that
its plan grows with the map.

    python benchmarks/planning.py            the whole measurement
    python benchmarks/planning.py --million  also with all of the test cases
    python benchmarks/planning.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import argparse
import json
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from support.command import spread
from support.results import machine, table, write_result
from support.wide_map import LANES, MAP, write_wide

from adeye.campaign.check import check_cases
from adeye.campaign.plan import CampaignPlan, make_plan
from adeye.campaign.run import block_size
from adeye.spec.load import load_odd
from adeye.store.repository import Repository
from adeye.sweep.expand import expand

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from adeye.spec.load import OddFiles
    from adeye.spec.odd import ScenarioUse

ROOT = Path(__file__).resolve().parent.parent
ODD = ROOT / "odd" / "million.yaml"
SIZES = (1_000, 10_000, 100_000)
MILLION = 1_000_000
STEPS = ("expand", "digest", "check", "rows")
TEN_TIMES_FEWER = ("gap", "relative_speed", "ego_speed")
"""Axes of ten levels; with one level each the plan is a tenth."""
MANY_LANES = 10_000
MAP_ODDS = ("ramp_routes", "ramp")
PLANNED = """
import contextlib, io, json, re, sys, time
from pathlib import Path
from adeye.cli import main
printed = io.StringIO()
with contextlib.redirect_stdout(printed):
    code = main(["plan", sys.argv[1], "--json"])
if code:
    sys.exit(code)
# What the process had before it became this program counts elsewhere, such as in getrusage.
peak = int(re.findall(r"VmHWM:\\s*(\\d+) kB", Path("/proc/self/status").read_text())[0])
cases = json.loads(printed.getvalue())["test_cases"]
print(json.dumps({"cases": cases, "cpu_s": time.process_time(), "peak_mb": peak / 1000.0}))
"""


def thinned(files: OddFiles, size: int) -> OddFiles:
    """Leave only one level of as many axes as the plan is to shrink by powers of ten."""
    use = files.odd.spec.scenarios[0]
    parameters = dict(use.sweep.parameters)
    for name in TEN_TIMES_FEWER[: len(str(MILLION)) - len(str(size))]:
        axis = parameters[name]
        if not isinstance(axis, tuple):
            parameters[name] = (axis.to,)
    return _with_use(
        files,
        use.model_copy(update={"sweep": use.sweep.model_copy(update={"parameters": parameters})}),
    )


def _with_use(files: OddFiles, use: ScenarioUse) -> OddFiles:
    odd = files.odd.spec.model_copy(update={"scenarios": (use,)})
    return replace(files, odd=replace(files.odd, spec=odd))


def one_round(plan: CampaignPlan) -> dict[str, float]:
    """Measure every step of planning once [µs per test case]."""
    count = plan.expansion.count
    took: dict[str, float] = {}

    def step(name: str, work: Callable[[], object]) -> None:
        began = time.process_time()
        work()
        took[name] = 1e6 * (time.process_time() - began) / count

    def digest() -> None:
        for part in plan.planned():
            part.engine.result_digests(part.test_cases)

    def save() -> None:
        with (
            tempfile.TemporaryDirectory() as folder,
            Repository.open(Path(folder) / "adeye.db") as repository,
        ):
            repository.plan_campaign(plan.record(), plan.planned(), block_size=block_size(plan))

    step("expand", lambda: expand(plan.files))
    step("digest", digest)
    step("check", lambda: check_cases(plan.expansion))
    step("rows", save)
    # Rows are made from the columns, so saving them made the columns again.
    took["rows"] = max(took["rows"] - took["digest"], 0.0)
    return took


def measure(rounds: int, sizes: Sequence[int] = SIZES) -> list[dict[str, object]]:
    """Measure planning at every size.

    Args:
        rounds: How often, after one that is thrown away.
        sizes: Numbers of test cases: powers of ten from 1,000 to 1,000,000.

    Returns:
        One entry per size: median CPU time per test case of each step and of all [µs], and the
        ratio of the latter to that of the smallest size with its spread over the rounds.
    """
    whole = make_plan(ODD)
    plans = {}
    for size in sizes:
        files = thinned(load_odd(ODD), size)
        plans[size] = replace(whole, files=files, expansion=expand(files))
        if plans[size].expansion.count != size:
            msg = f"the plan has {plans[size].expansion.count} test cases instead of {size}"
            raise RuntimeError(msg)
    found: dict[int, list[dict[str, float]]] = {size: [] for size in sizes}
    for number in range(rounds + 1):
        for size, plan in plans.items():
            took = one_round(plan)
            if number:
                found[size].append(took)
    totals = {size: [sum(took.values()) for took in items] for size, items in found.items()}
    least = totals[min(sizes)]
    results: list[dict[str, object]] = []
    for size, items in found.items():
        ratios = [mine / base for mine, base in zip(totals[size], least, strict=True)]
        medians = {f"{name}_us": statistics.median(item[name] for item in items) for name in STEPS}
        results.append(
            {
                "test_cases": size,
                "rounds": rounds,
                **medians,
                "total_us": statistics.median(totals[size]),
                "ratio": statistics.median(ratios),
                "ratio_least": min(ratios),
                "ratio_most": max(ratios),
            }
        )
    return results


def plan_of_map(project: Path, odd: str) -> dict[str, float]:
    """Plan an ODD of a project in a process of its own: test cases, CPU [s], peak [MB]."""
    command = [sys.executable, "-c", PLANNED, f"odd/{odd}.yaml"]
    done = subprocess.run(command, cwd=project, check=True, capture_output=True, text=True)  # noqa: S603
    found: dict[str, float] = json.loads(done.stdout)
    return found


def measure_maps(
    rounds: int, least: int = MANY_LANES, odds: Sequence[str] = MAP_ODDS
) -> list[dict[str, object]]:
    """Measure planning on the shipped motorway and on one of more lanes.

    Args:
        rounds: How often, after one that is thrown away.
        least: Lanes that the larger map has at least.
        odds: That are planned.

    Returns:
        One entry per ODD and map: test cases, median CPU time [s] and most memory [MB], and the
        ratio of the CPU time to that on the shipped map with its spread over the rounds.
    """
    found: dict[tuple[str, int], list[dict[str, float]]] = {}
    with tempfile.TemporaryDirectory() as name:
        projects = {}
        for wanted in (LANES, least):
            project = Path(name) / str(wanted)
            for folder in ("odd", "scenarios_db"):
                shutil.copytree(ROOT / folder, project / folder)
            projects[write_wide(project / MAP.relative_to(ROOT), wanted)] = project
        for number in range(rounds + 1):
            for odd in odds:
                for lanes, project in projects.items():
                    planned = plan_of_map(project, odd)
                    if number:
                        found.setdefault((odd, lanes), []).append(planned)
    results: list[dict[str, object]] = []
    for (odd, lanes), items in found.items():
        ratios = [
            mine["cpu_s"] / base["cpu_s"]
            for mine, base in zip(items, found[odd, LANES], strict=True)
        ]
        results.append(
            {
                "odd": odd,
                "lanes": lanes,
                "test_cases": items[0]["cases"],
                "cpu_s": statistics.median(item["cpu_s"] for item in items),
                "peak_mb": max(item["peak_mb"] for item in items),
                "ratio": statistics.median(ratios),
                "ratio_least": min(ratios),
                "ratio_most": max(ratios),
            }
        )
    return results


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print a table and write the result."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--smoke", action="store_true", help="one short round")
    parser.add_argument("--million", action="store_true", help="also a million test cases")
    parser.add_argument("--rounds", type=int, default=5, help="rounds, at least 3")
    given = parser.parse_args(arguments)
    if not given.smoke and given.rounds < 3:
        parser.error("the median of fewer than 3 rounds says nothing")
    if given.smoke:
        found = measure(1, SIZES[:1])
        maps = measure_maps(1, 2 * LANES, MAP_ODDS[:1])
    else:
        found = measure(given.rounds, (*SIZES, MILLION) if given.million else SIZES)
        maps = measure_maps(given.rounds)
    rows = [
        [
            f"{item['test_cases']:,}",
            *[f"{item[f'{name}_us']:.1f}" for name in STEPS],
            f"{item['total_us']:.1f}",
            spread(item),
        ]
        for item in found
    ]
    headers = ["test cases", *[f"{name} [µs/case]" for name in STEPS], "all", "ratio (spread)"]
    print(table(headers, rows))
    rows = [
        [
            f"{item['odd']}, {item['lanes']:,} lanes",
            f"{item['test_cases']:,}",
            f"{item['cpu_s']:.1f}",
            f"{item['peak_mb']:.0f}",
            spread(item),
        ]
        for item in maps
    ]
    headers = ["adeye plan", "test cases", "CPU [s]", "peak [MB]", "ratio (spread)"]
    print(table(headers, rows))
    if not given.smoke:
        result = {"machine": machine(), "sizes": found, "maps": maps}
        print(f"wrote {write_result('planning', result)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
