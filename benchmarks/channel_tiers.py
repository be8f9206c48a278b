"""What does a channel cost in each tier: compiled function, NumPy on the batch, Python object?

The controllers are those of docs/guide/channel-tiers.md, each added in turn as a third channel to
the shipped candidate, in the cut-ins of the motorway ODD. Cost = CPU time with it minus CPU time
without it, per run and tick. Rounds interleaved in one process, warm-up thrown away.

    python benchmarks/channel_tiers.py            the whole measurement
    python benchmarks/channel_tiers.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from support.command import drive, ratios, spread

from adeye.campaign.plan import make_plan
from adeye.simulate import engine
from adeye.spec.load import load_architecture

if TYPE_CHECKING:
    from adeye.sweep.case import TestCase

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "guide" / "channel-tiers.md"
TIERS = {"compiled": "tier_compiled.py", "NumPy": "tier_batch.py", "object": "tier_object.py"}


def folder_with_examples(where: Path) -> Path:
    """Write the examples of the page, and one architecture for each of them."""
    sys.path.insert(0, str(ROOT))
    from docs import walk

    for name, text in walk.files_of(PAGE.read_text("utf-8")).items():
        (where / Path(name).name).write_text(text, "utf-8")
    shipped = (ROOT / "odd" / "architectures" / "camera_radar.yaml").read_text("utf-8")
    (where / "camera_radar.yaml").write_text(shipped, "utf-8")
    for tier, file in TIERS.items():
        (where / f"{tier}.yaml").write_text(
            "extends: camera_radar.yaml\n"
            f"architecture: {tier.lower()}\n"
            f"title: {tier}\n"
            "channels:\n"
            f"  third: {{kind: './{file}:Cruise', links: [localisation], rate: 20 Hz}}\n",
            "utf-8",
        )
    return where


def cut_ins(runs: int) -> list[TestCase]:
    """Take fault-free cut-ins of the candidate, repeated up to a number of runs."""
    plan = make_plan(ROOT / "odd" / "motorway_chauffeur.yaml", backend="batch")
    found = [
        case
        for case in plan.cases
        if case.scenario_id == "cut_in"
        and case.architecture.architecture == "camera_radar"
        and case.fault_entry == "none"
    ]
    return [found[k % len(found)] for k in range(runs)]


def cost(cases: list[TestCase], folder: Path) -> tuple[float, int]:
    """CPU seconds of a batch, and its run-ticks."""
    name = cases[0].architecture.architecture
    start = time.process_time()
    trace = engine.run(cases, backend="batch", base_dirs={name: folder})
    return time.process_time() - start, int(trace.length.sum())


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure every tier once a round."""
    sizes = {tier: 8 if smoke else (64 if tier == "object" else 1024) for tier in TIERS}
    found: dict[str, list[tuple[float, float]]] = {tier: [] for tier in TIERS}
    with tempfile.TemporaryDirectory() as name:
        folder = folder_with_examples(Path(name))
        batches = {}
        for tier, runs in sizes.items():
            plain = cut_ins(runs)
            architecture = load_architecture(folder / f"{tier}.yaml").spec
            extended = [replace(case, architecture=architecture) for case in plain]
            batches[tier] = (plain, extended)
        for number in range(rounds + 1):
            for tier, (plain, extended) in batches.items():
                without, ticks = cost(plain, folder)
                with_it, _ = cost(extended, folder)
                if number:
                    found[tier].append((with_it / ticks, without / ticks))
    return [
        {
            "tier": tier,
            "runs": sizes[tier],
            "ns": 1e9 * statistics.median(one - other for one, other in pairs),
            **ratios(pairs),
        }
        for tier, pairs in found.items()
    ]


HEADERS = ("channel", "runs in a batch", "ns per run and tick", "ratio to none (spread)")


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    return [item["tier"], str(item["runs"]), f"{item['ns']:,.0f}", spread(item)]


if __name__ == "__main__":
    sys.exit(drive("channel_tiers", __doc__, measure, HEADERS, row))
