"""How long does a person wait for ``adeye --help``, beside an empty Python and beside all imports?

Three processes, interleaved: Python that does nothing, ``adeye --help``, and Python that imports
all that a campaign needs. User and system time of the child process, the first round thrown away.

    python benchmarks/cli_startup.py            the whole measurement
    python benchmarks/cli_startup.py --smoke    one round, to see that it works
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from support.results import machine, table, write_result

if TYPE_CHECKING:
    from collections.abc import Sequence

ROOT = Path(__file__).resolve().parent.parent
EVERYTHING = (
    "import adeye.api, adeye.reporting, adeye.simulate.traffic.highway, pandas, scipy.stats"
)
COMMANDS = {
    "python -c pass": [sys.executable, "-c", "pass"],
    "adeye --help": [sys.executable, "-m", "adeye", "--help"],
    "everything imported": [sys.executable, "-c", EVERYTHING],
}


def cpu_time(command: Sequence[str]) -> float:
    """Return the CPU time of a child process [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(  # noqa: S603 - commands of this file
        command,
        check=True,
        stdout=subprocess.DEVNULL,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure(rounds: int, *, warm_up: bool) -> dict[str, list[float]]:
    """Measure every command once a round."""
    times: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for number in range(rounds + warm_up):
        for name, command in COMMANDS.items():
            took = cpu_time(command)
            if number >= warm_up:
                times[name].append(took)
    return times


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print a table and write the result."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--smoke", action="store_true", help="one round")
    parser.add_argument("--rounds", type=int, default=7, help="rounds, at least 3")
    given = parser.parse_args(arguments)
    if not given.smoke and given.rounds < 3:
        parser.error("the median of fewer than 3 rounds says nothing")
    times = measure(1 if given.smoke else given.rounds, warm_up=not given.smoke)
    empty = times["python -c pass"]
    rows, found = [], []
    for name, took in times.items():
        ratios = [mine / base for mine, base in zip(took, empty, strict=True) if base > 0.0]
        item = {
            "command": name,
            "median_s": statistics.median(took),
            "ratio": statistics.median(ratios),
            "ratio_least": min(ratios),
            "ratio_most": max(ratios),
        }
        found.append(item)
        spread = f"{item['ratio_least']:.1f} to {item['ratio_most']:.1f}"
        rows.append([name, f"{item['median_s']:.3f}", f"{item['ratio']:.1f} ({spread})"])
    print(table(["command", "CPU time [s]", "ratio to an empty Python (spread)"], rows))
    if not given.smoke:
        print(f"wrote {write_result('cli_startup', {'machine': machine(), 'commands': found})}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
