"""What does a tick cost with programs, FMUs and nodes as channels, and what to start them?

The shipped candidate in 8 cut-ins at once, with a third channel: one Python object for each run in
this process, a program in Python (kind process), the shipped FMU, and the nodes of the guide on
zenoh, ROS 2 and ROS 1, as far as these are installed; and the built-in nominal channel once more.
Wall time, for programs work in processes of their own: cost of a tick = of 420 ticks less 20, so
that the start of the programs is not in it; start = time of 20 ticks less 20 such ticks. Rounds
interleaved, warm-up thrown away.

    python benchmarks/process_channels.py            the whole measurement
    python benchmarks/process_channels.py --smoke    one short round, to see that it works
"""

from __future__ import annotations

import os
import shutil
import statistics
import sys
import tempfile
import time
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from channel_tiers import cut_ins
from support.command import drive, ratios, spread

from adeye.simulate import engine
from adeye.simulate.bridges.middleware import ROS_1
from adeye.spec.architecture import Architecture
from adeye.spec.quantity import SI
from adeye.testing import zoo

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from docs import walk

if TYPE_CHECKING:
    from adeye.sweep.case import TestCase

ROOT = Path(__file__).resolve().parent.parent
RUNS, SHORT, LONG = 8, 20, 420
FOLLOW: dict[str, Any] = {
    "file": "./follow_and_keep.fmu",
    "inputs": {"v": "ego.speed", "v_set": "ego.desired_speed", "offset": "ego.lane_offset"},
    "outputs": {"acceleration": "a", "steering_angle": "delta"},
}
MODULES = {"fmu": "fmpy", "zenoh": "zenoh", "ros2": "cyclonedds"}


def node(kind: str) -> dict[str, Any]:
    """Return a node of the guide as a channel."""
    command = ["./ros1_node.py"] if kind == "ros1" else ["python", f"./{kind}_node.py"]
    return {"kind": kind, "parameters": {"command": command, "values": {"gain": 0.4}}}


def guests() -> dict[str, dict[str, Any]]:
    """Return the channels that can be had here."""
    found: dict[str, dict[str, Any]] = {
        "object": {"kind": "./zoo_plugin.py:One"},
        "built in": {"kind": "nominal"},
        "program": {"kind": "process", "parameters": zoo.parameters()},
        "fmu": {"kind": "fmu", "parameters": FOLLOW},
        **{kind: node(kind) for kind in ("zenoh", "ros2", "ros1")},
    }
    missing = {kind for kind, module in MODULES.items() if find_spec(module) is None}
    missing |= set() if Path(ROS_1, "rospy").is_dir() else {"ros1"}
    return {kind: item for kind, item in found.items() if kind not in missing}


def settle(folder: Path) -> None:
    """Put there what the channels are made of."""
    zoo.settle(folder)
    shutil.copy(ROOT / "odd" / "architectures" / "fmus" / "follow_and_keep.fmu", folder)
    page = (ROOT / "docs" / "guide" / "middleware.md").read_text("utf-8")
    for name, text in walk.files_of(page).items():
        (folder / Path(name).name).write_text(text, "utf-8")
        (folder / Path(name).name).chmod(0o755)
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"


def with_guest(cases: list[TestCase], guest: dict[str, Any]) -> list[TestCase]:
    """Add a channel without authority to the architecture of test cases."""
    content = cases[0].architecture.model_dump(mode="json")
    content["channels"]["guest"] = {**guest, "links": ["localisation"], "rate": 20.0}
    architecture = Architecture.model_validate(content, context=SI)
    return [replace(case, architecture=architecture) for case in cases]


def took(cases: list[TestCase], folder: Path, ticks: int) -> float:
    """Wall time of so many ticks of a batch [s]."""
    name = cases[0].architecture.architecture
    begin = time.perf_counter()
    trace = engine.run(cases, backend="batch", base_dirs={name: folder}, most_ticks=ticks)
    spent = time.perf_counter() - begin
    failed = next((event for event in trace.channel_events if event is not None), None)
    if failed is not None:  # who is silent costs nothing
        raise SystemExit(f"{failed.channel} failed at {failed.time:g} s: {failed.detail}")
    return spent


def measure(rounds: int, smoke: bool) -> list[dict[str, Any]]:  # noqa: FBT001 - as drive calls it
    """Measure without a guest and with each of them once a round."""
    runs, known = 2 if smoke else RUNS, guests()
    plain = cut_ins(runs)
    batches = {"none": plain, **{name: with_guest(plain, item) for name, item in known.items()}}
    ticks: dict[str, list[float]] = {name: [] for name in batches}
    starts: dict[str, list[float]] = {name: [] for name in batches}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        settle(folder)
        for number in range(rounds + 1):
            for kind, cases in batches.items():
                short, long = took(cases, folder, SHORT), took(cases, folder, LONG)
                if number:
                    ticks[kind].append((long - short) / (LONG - SHORT))
                    starts[kind].append(short - SHORT * ticks[kind][-1])
    costs = {kind: differences(ticks[kind], ticks["none"]) for kind in known}
    return [
        {
            "channel": kind,
            "runs": runs,
            "tick_ms": 1e3 * statistics.median(ticks[kind]),
            "us": 1e6 * statistics.median(costs[kind]) / runs,
            "start_ms": 1e3 * statistics.median(differences(starts[kind], starts["none"])) / runs,
            **ratios(list(zip(costs[kind], costs["object"], strict=True))),
        }
        for kind in known
    ]


def differences(times: list[float], others: list[float]) -> list[float]:
    """Subtract, round by round."""
    return [one - other for one, other in zip(times, others, strict=True)]


HEADERS = (
    "channel",
    "runs in a batch",
    "ms per tick",
    "µs per run and tick",
    "ms to start a run",
    "ratio to object (spread)",
)


def row(item: dict[str, Any]) -> list[str]:
    """Write one line of the table."""
    numbers = [f"{item['tick_ms']:.1f}", f"{item['us']:,.0f}", f"{item['start_ms']:.1f}"]
    return [item["channel"], str(item["runs"]), *numbers, spread(item)]


if __name__ == "__main__":
    sys.exit(drive("process_channels", __doc__, measure, HEADERS, row))
