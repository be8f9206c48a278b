"""How much of a campaign's CPU time is spent outside the simulation, and on what?

Blocks of 1,024 runs of the shipped ODDs (the motorway's with enough replicates, and a hundredth of
the million) go the way of a campaign: planned and stored, executed by the batch engine, digested,
measured and judged, described
as rows, inserted into SQLite with hashes and tallies. CPU time of one process, rounds interleaved,
the warm-up thrown away. The ratio is the time outside the simulation over the whole.

    python benchmarks/outside.py            the whole measurement
    python benchmarks/outside.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import argparse
import shutil
import statistics
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml
from support.results import machine, table, write_result

from adeye.campaign import work
from adeye.campaign.plan import make_plan
from adeye.simulate import engine
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from collections.abc import Sequence

ROOT = Path(__file__).resolve().parent.parent
STAGES = ("plan", "simulation", "digest", "evaluation", "rows", "insert")


@dataclass(frozen=True)
class Size:
    """A campaign of which one block is measured.

    Attributes:
        odd: Name of a shipped ODD.
        replicates: Of each of its test cases.
        runs: In the block.
        fixed: Axes of its first scenario that keep their last level only.
    """

    odd: str
    replicates: int
    runs: int
    fixed: tuple[str, ...] = ()


WHOLE = (
    Size("urban_pedestrian_rain", 1, 1024),
    Size("motorway_chauffeur", 64, 1024),
    Size("million", 1, 1024, fixed=("ego_speed", "relative_speed")),
)
SHORT = (Size("motorway_chauffeur", 1, 8),)


class Stopwatch:
    """CPU time by stage."""

    def __init__(self) -> None:
        """Start."""
        self.us: dict[str, float] = {}
        self._began = time.process_time()

    def lap(self, stage: str, runs: int) -> None:
        """Note the time since the last lap, per run [µs]."""
        now = time.process_time()
        self.us[stage] = 1e6 * (now - self._began) / runs
        self._began = now


def copied(size: Size, folder: Path) -> Path:
    """Copy the shipped files, with the replicates of a size, and return the ODD's file."""
    for name in ("odd", "scenarios_db"):
        shutil.copytree(ROOT / name, folder / name, dirs_exist_ok=True)
    path = folder / "odd" / f"{size.odd}.yaml"
    content = yaml.safe_load(path.read_text("utf-8"))
    parameters = content["scenarios"][0]["sweep"]["parameters"]
    for name in size.fixed:
        parameters[name] = [parameters[name]["to"]]
    path.write_text(yaml.safe_dump({**content, "replicates": size.replicates}), "utf-8")
    return path


def measure_once(size: Size, folder: Path) -> dict[str, Any]:
    """Execute and store one block of a new campaign; times per run [µs] and what was in it."""
    odd = copied(size, folder)
    with Repository.open(folder / "adeye.db") as repository:
        watch = Stopwatch()
        plan = make_plan(odd, backend="batch")
        stored = repository.plan_campaign(plan.record(), plan.planned(), block_size=size.runs)
        watch.lap("plan", stored.planned)
        block = repository.claim_block(campaign=stored.campaign)
        if block is None:
            raise RuntimeError("a new campaign has no work")
        cases = [plan.cases[item.ordinal] for item in block.to_execute]
        context, runs = plan.work, len(cases)
        watch.lap("claim", runs)
        trace = engine.run(
            cases, backend=context.backend, variant=context.variant, base_dirs=context.folders
        )
        watch.lap("simulation", runs)
        trace.digests()
        watch.lap("digest", runs)
        evaluation = work.evaluate(trace, cases, context.requirements, context.faults)
        watch.lap("evaluation", runs)
        engines = [context.engines[case.architecture.architecture] for case in cases]
        rows = work.describe(trace, evaluation, engines)
        watch.lap("rows", runs)
        repository.complete_block(block, rows)
        watch.lap("insert", runs)
    watch.us["insert"] += watch.us.pop("claim")
    return {
        "runs": runs,
        "events": len(rows.events.run) / runs,
        "verdicts": len(rows.verdicts.run) / runs,
        "rows_of_trace": float(trace.length.mean()),
        "us": watch.us,
    }


def measure(rounds: int, sizes: Sequence[Size] = WHOLE) -> list[dict[str, Any]]:
    """Measure every size, one after the other in each round.

    Args:
        rounds: How often, beside the warm-up.
        sizes: What.

    Returns:
        For each size the medians, per run and stage [µs], and the share outside the simulation.
    """
    taken: list[list[dict[str, Any]]] = [[] for _ in sizes]
    for number in range(rounds + 1):
        for size, found in zip(sizes, taken, strict=True):
            with tempfile.TemporaryDirectory() as folder:
                once = measure_once(size, Path(folder))
            if number:
                found.append(once)
    return [_median(size, found) for size, found in zip(sizes, taken, strict=True)]


def _median(size: Size, found: Sequence[dict[str, Any]]) -> dict[str, Any]:
    us = {stage: statistics.median(item["us"][stage] for item in found) for stage in STAGES}
    whole = sum(us.values())
    return {
        **{key: found[0][key] for key in ("runs", "events", "verdicts", "rows_of_trace")},
        "odd": size.odd,
        "rounds": len(found),
        "us": us,
        "least_us": {stage: min(item["us"][stage] for item in found) for stage in STAGES},
        "ratio": (whole - us["simulation"]) / whole,
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print a table and write the result."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--smoke", action="store_true", help="one short round")
    parser.add_argument("--rounds", type=int, default=5, help="rounds, at least 3")
    given = parser.parse_args(arguments)
    if not given.smoke and given.rounds < 3:
        parser.error("the median of fewer than 3 rounds says nothing")
    found = measure(1, SHORT) if given.smoke else measure(given.rounds)
    rows = [
        [
            item["odd"],
            str(item["runs"]),
            f"{item['events']:.1f}",
            f"{item['verdicts']:.1f}",
            *(f"{item['us'][stage]:.1f}" for stage in STAGES),
            f"{item['ratio']:.0%}",
        ]
        for item in found
    ]
    stages = [f"{stage} [µs/run]" if stage == STAGES[0] else stage for stage in STAGES]
    print(table(["ODD", "runs", "events/run", "verdicts/run", *stages, "outside, ratio"], rows))
    if not given.smoke:
        print(f"wrote {write_result('outside', {'machine': machine(), 'sizes': found})}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
