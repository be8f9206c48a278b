"""How long does it take to judge 10,000 runs again after a threshold has changed?

The shipped ODD of a million cut-ins, thinned to 10,000 test cases and executed once with all traces
kept. Then one threshold is changed at a time, and ``adeye judge`` gives the verdicts: of a bound
from the rows of its metric, of one comparison from the kept extremes, of any other formula from the
kept traces. Wall and CPU time of the whole call, planning included; a run that was executed for it
ends the benchmark.

    python benchmarks/rejudge.py            the whole measurement, needs some gigabytes of disk
    python benchmarks/rejudge.py --smoke    few runs, to see that it works
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from pathlib import Path

import yaml
from support.results import machine, table, write_result

from adeye.campaign.keeping import folder_of
from adeye.campaign.plan import make_plan
from adeye.campaign.runner import judge_campaign, run_campaign

ROOT = Path(__file__).resolve().parent.parent
RUNS, FEW = 10_000, 20
BAR_S = 20.0
EDITS = {
    "metric row": ("FSR-02", "at_most: 6.0", "at_most: 5.5"),
    "kept extreme": ("FSR-06", "ego.lane_offset) <= 0.6 m", "ego.lane_offset) <= 0.5 m"),
    "kept trace": ("FSR-09", "time_gap < 0.8 s implies", "time_gap < 0.7 s implies"),
}
"""What tells the verdict: FSR, what the concept says, what it says instead."""


def project(folder: Path, runs: int) -> Path:
    """Copy the shipped files and thin the ODD."""
    for name in ("odd", "scenarios_db"):
        shutil.copytree(ROOT / name, folder / name)
    path = folder / "odd" / "million.yaml"
    odd = yaml.safe_load(path.read_text("utf-8"))
    parameters = odd["scenarios"][0]["sweep"]["parameters"]
    for name in ("friction", "rain", "lateral_speed", "cutter_acceleration"):
        parameters[name] = {
            "friction": [0.9],
            "rain": ["0 mm/h"],
            "lateral_speed": ["1.3 m/s"],
            "cutter_acceleration": [f"{value} m/s^2" for value in (-3, -1.5, 0, 1.5, 3)],
        }[name]
    if runs < RUNS:
        parameters |= {"ego_speed": ["130 km/h"], "relative_speed": ["-14 km/h"]}
        parameters |= {"gap": ["30 m", "60 m"]}
    path.write_text(yaml.safe_dump(odd, sort_keys=False), "utf-8")
    return path


def judge_again(odd: Path, db: Path, way: str) -> tuple[float, float, int]:
    """Change one threshold and judge; return wall and CPU time [s] and the runs."""
    _, before, after = EDITS[way]
    concept = odd.parent / "concepts" / "motorway_chauffeur.yaml"
    text = concept.read_text("utf-8")
    if text.count(before) != 1:
        msg = f"{before!r} is not once in {concept}"
        raise ValueError(msg)
    concept.write_text(text.replace(before, after), "utf-8")
    began, busy = time.perf_counter(), time.process_time()
    summary = judge_campaign(make_plan(odd), db=db)
    took, busy = time.perf_counter() - began, time.process_time() - busy
    if summary.executed or summary.replayed or summary.to_replay:
        msg = f"{way}: {summary.to_replay} runs need a replay, {summary.replayed} were executed"
        raise RuntimeError(msg)
    return took, busy, summary.judged


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--smoke", action="store_true", help="few runs, nothing is kept")
    smoke = parser.parse_args().smoke
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        odd, db = project(folder, FEW if smoke else RUNS), folder / "adeye.db"
        began = time.perf_counter()
        executed = run_campaign(make_plan(odd), db=db, threads=2, traces="all").executed
        took = time.perf_counter() - began
        kept = sum(path.stat().st_size for path in folder_of(db).iterdir())
        print(f"Executed {executed:,} runs in {took:.1f} s, {kept / 1e9:.2f} GB of traces")
        found = {way: judge_again(odd, db, way) for way in EDITS}
    rows = [
        [way, EDITS[way][0], f"{runs:,}", f"{seconds:.1f}", f"{busy:.1f}"]
        for way, (seconds, busy, runs) in found.items()
    ]
    print(table(["verdicts from", "FSR", "runs", "wall s", "CPU s"], rows))
    worst = max(seconds for seconds, _, _ in found.values())
    print(f"The slowest takes {worst:.1f} s; the bar is {BAR_S:g} s.")
    if not smoke:
        result = {"machine": machine(), "executed": executed, "trace_bytes": kept}
        ways = {
            way: {"wall_s": seconds, "cpu_s": busy, "runs": runs}
            for way, (seconds, busy, runs) in found.items()
        }
        print(f"Wrote {write_result('rejudge', {**result, 'ways': ways})}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
