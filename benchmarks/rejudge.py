"""How long does it take to judge 10,000 runs again after a threshold has changed?

The shipped ODD of a million cut-ins, thinned to 10,000 test cases and executed once with all traces
kept. Then one threshold is changed at a time, and ``adeye judge`` gives the verdicts: of a bound
from the rows of its metric, of one comparison from the kept extremes, of any other formula from the
kept traces. Median wall and CPU time of the whole call, planning included; a run that was executed
for it ends the benchmark.

    python benchmarks/rejudge.py            three rounds, needs some gigabytes of disk
    python benchmarks/rejudge.py --smoke    few runs and one round, to see that it works
"""

from __future__ import annotations

import re
import shutil
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import yaml
from support.command import drive

from adeye.campaign.plan import make_plan
from adeye.campaign.run import judge_campaign, run_campaign
from adeye.store.evidence.roots import folder_of

ROOT = Path(__file__).resolve().parent.parent
RUNS, FEW = 10_000, 20
BAR_S = 20.0
EDITS = {
    "metric row": ("FSR-02", "at_most: {:.2f}", 6.0, -0.05),
    "kept extreme": ("FSR-06", "ego.lane_offset) <= {:.2f} m", 0.6, -0.01),
    "kept trace": ("FSR-09", "time_gap < {:.2f} s implies", 0.8, -0.01),
}
"""What tells the verdict: FSR, threshold in the concept, its value, and what each round adds."""


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


def judge_again(odd: Path, db: Path, way: str, round_: int) -> tuple[float, float, int]:
    """Change one threshold and judge; return wall and CPU time [s] and the runs."""
    _, written, value, change = EDITS[way]
    concept = odd.parent / "concepts" / "motorway_chauffeur.yaml"
    text = concept.read_text("utf-8")
    before = written.format(value + round_ * change)
    if text.count(before) != 1:
        msg = f"{before!r} is not once in {concept}"
        raise ValueError(msg)
    concept.write_text(text.replace(before, written.format(value + (round_ + 1) * change)), "utf-8")
    began, busy = time.perf_counter(), time.process_time()
    summary = judge_campaign(make_plan(odd), db=db)
    took, busy = time.perf_counter() - began, time.process_time() - busy
    if summary.executed or summary.replayed or summary.to_replay:
        msg = f"{way}: {summary.to_replay} runs need a replay, {summary.replayed} were executed"
        raise RuntimeError(msg)
    return took, busy, summary.judged


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Execute once, then judge again in each round."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        odd, db = project(folder, FEW if smoke else RUNS), folder / "adeye.db"
        plain(odd.parent / "concepts" / "motorway_chauffeur.yaml")
        began = time.perf_counter()
        executed = run_campaign(make_plan(odd), db=db, threads=2, traces="all").executed
        took = time.perf_counter() - began
        kept = sum(path.stat().st_size for path in folder_of(db).iterdir())
        print(f"Executed {executed:,} runs in {took:.1f} s, {kept / 1e9:.2f} GB of traces")
        found = []
        for way in EDITS:
            told = [judge_again(odd, db, way, number) for number in range(rounds)]
            found.append(
                {
                    "way": way,
                    "fsr": EDITS[way][0],
                    "runs": told[0][2],
                    "wall_s": statistics.median(item[0] for item in told),
                    "cpu_s": statistics.median(item[1] for item in told),
                }
            )
    return found


def plain(concept: Path) -> None:
    """Write the thresholds as the rounds do."""
    text = concept.read_text("utf-8")
    for _, written, value, _ in EDITS.values():
        pattern = re.escape(written).replace(re.escape("{:.2f}"), r"([0-9.]+)")
        (found,) = {float(item) for item in re.findall(pattern, text)}
        if found != value:
            msg = f"{written} is {found} in {concept}, not {value}"
            raise ValueError(msg)
        text = re.sub(pattern, written.format(value), text)
    concept.write_text(text, "utf-8")


def row(item: dict[str, Any]) -> list[str]:
    """Write what was found."""
    times = (f"{item[name]:.1f}" for name in ("wall_s", "cpu_s"))
    ratio = f"{item['wall_s'] / BAR_S:.3f}"
    return [item["way"], item["fsr"], f"{item['runs']:,}", *times, ratio]


def main() -> int:
    """Measure and print."""
    headers = ["verdicts from", "FSR", "runs", "wall s", "CPU s", f"ratio to {BAR_S:g} s"]
    return drive("rejudge", __doc__, measure, headers, row)


if __name__ == "__main__":
    sys.exit(main())
