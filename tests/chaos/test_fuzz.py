"""Spoilt inputs of every parser end with a documented exit code, never with a traceback or a hang.

Each kind takes ``ORDINARY`` inputs in the ordinary run and ``FUZZ`` (60) in the slow one.
An input that fails is named by its kind and seed: ``spoilt(kind, seed)`` makes it again.
"""

from __future__ import annotations

import os
import re
import resource
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final
from unittest.mock import Mock

import numpy as np
import pytest

from adeye.campaign.selection import Keyword, Shard
from adeye.cli import main
from adeye.cli.options import seconds
from adeye.errors import AdeyeError
from adeye.judge.stl.parser import parse_with
from adeye.report.gate.baseline import read_baseline
from adeye.spec.expression import parse
from adeye.spec.load import load_grid
from tests.chaos import mutation
from tests.chaos.mutation import Draw
from tests.test_malformed_inputs import FILES, IN_CONCEPT, IN_ODD, IN_ONE, IN_SCENARIO, IN_TWO

ORDINARY: Final = 40
SLOW: Final = int(os.environ.get("FUZZ", "60"))
LONGEST_S: Final = 5.0
"""Longest processor time of one input."""
MOST_MEMORY_KIB: Final = 512 * 1024
DOCUMENTED: Final = {0, 1, 2, 3, 4, 5}
ROOT: Final = Path(__file__).resolve().parents[2]
PLACE: Final = re.compile(r"[\w./]+\.(?:yaml|py|csv|json):[0-9]+")

CASES_CSV: Final = (
    "ego_speed_mps,other_speed_mps,gap_m,lateral_speed_mps,note\n"
    '30,10,80,1,a\n25.5,20,12,0.4,b\n20,19,5,1.5,"c,d"\n'
)
TABLE_CSV: Final = "time,gap,ttc,mode\n0.0,5,3.0,on\n0.1,4.5,2.5,on\n0.2,4,1.5,off\n0.3,3,9,off\n"
SPEEDS_CSV: Final = "n,dv\n1,80\n2,90\n3,100\n"
GRID_YAML: Final = "width: 30 m\nahead: 60 m\ncell: 0.5 m\n"
FORMULAS: Final = (
    "always ( gap > 2 )",
    "always[0 s, 0.2 s] ( ttc < 2 implies eventually[0 s, 0.1 s] ( gap > 1 ) )",
    "( gap > 1 ) until[0 s, 0.3 s] ( mode == 'off' )",
    "not ( abs ( gap - ttc ) >= 2 ) or once ( mode == 'on' )",
)
EXPRESSIONS: Final = (
    "gap >= ego_speed * 1 s",
    "min ( gap , 10 m ) + abs ( ego_speed ) * 2 s",
    "not ( gap < 5 m and ttc > 2 s ) or x == 1",
)

OPTIONS: Final = (
    "cut_in and not legacy",
    '( gap=30 or "gap=30 m" ) and fault=none',
    "12/345",
    "1h30m 5 min",
)
"""What -k, --shard and --budget take."""


class TooLongError(BaseException):
    """An input took more processor time than any may; a BaseException, so that nobody keeps it."""


@contextmanager
def watched() -> Iterator[None]:
    """Bound the processor time of what is inside, and check that no more was taken."""

    former = signal.signal(signal.SIGPROF, Mock(side_effect=TooLongError))
    signal.setitimer(signal.ITIMER_PROF, 3 * LONGEST_S)
    begin = time.process_time()
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, former)
    assert time.process_time() - begin < LONGEST_S


def listing(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*")}


@dataclass(frozen=True)
class Kind:
    """A parser and what is fed to it.

    Attributes:
        file: What is spoilt; empty for text that is handed over.
        spoil: Makes the input from the valid one and a draw.
        feed: Hands it over and returns the exit code.
        valid: A text that is taken, if there is no file.
        has_place: Whether each refusal names a file and a line.
        writes: What it may leave in the folder.
    """

    file: str
    spoil: Callable[[bytes, Draw], Any]
    feed: Callable[[Any], int]
    valid: str = ""
    has_place: bool = False
    writes: frozenset[str] = frozenset()


def yaml_of(content: bytes, draw: Draw) -> bytes:
    way = mutation.bytes_of if draw.integers(0, 2) else mutation.structure
    return way(content, draw)


def plan(_: Any) -> int:
    return main(["plan", IN_ODD])


def by_raising(read: Callable[[Any], object]) -> Callable[[Any], int]:
    """Turn a function into one that gives the exit code of what it raises."""

    def feed(given: Any) -> int:
        try:
            read(given)
        except AdeyeError as error:
            sys.stderr.write(f"{error}\n")
            return error.exit_code
        return 0

    return feed


def spoilt_formula(_: bytes, draw: Draw) -> str:
    return mutation.formula(FORMULAS, draw)


def spoilt_expression(_: bytes, draw: Draw) -> str:
    return mutation.formula(EXPRESSIONS, draw)


def spoilt_option(_: bytes, draw: Draw) -> str:
    return mutation.formula(OPTIONS, draw)


def options(text: str) -> int:
    """Hand one text to every option with a language of its own; return 0 if one takes it."""
    read = (Keyword.parse, Shard.parse, lambda given: seconds(given, "--budget"))
    return min(by_raising(one)(text) for one in read)


def stl(text: str) -> int:
    return main(["stl", text, "table.csv", "--unit", "ttc=s", "--json"])


KINDS: Final[dict[str, Kind]] = {
    "odd": Kind(IN_ODD, yaml_of, plan, has_place=True),
    "scenario": Kind(IN_SCENARIO, yaml_of, plan, has_place=True),
    "architecture": Kind(IN_ONE, yaml_of, plan, has_place=True),
    "extension": Kind(IN_TWO, yaml_of, plan, has_place=True),
    "concept": Kind(IN_CONCEPT, yaml_of, plan, has_place=True),
    "grid": Kind("grid.yaml", yaml_of, by_raising(lambda _: load_grid("grid.yaml")),
                 has_place=True),
    "data": Kind("odd/speeds.csv", mutation.table, lambda _: main(["plan", "odd/data.yaml"]),
                 has_place=True),
    "baseline": Kind("baseline.json", mutation.tree_of_json,
                     by_raising(lambda _: read_baseline(Path("baseline.json")))),
    "cases": Kind("cases.csv", mutation.table,
                  lambda _: main(["reference", "cases.csv", "--models", "cc", "--json"])),
    "table": Kind("table.csv", mutation.table, lambda _: stl(FORMULAS[0])),
    "formula": Kind("", spoilt_formula, stl, valid=FORMULAS[0]),
    "condition": Kind("", spoilt_formula, by_raising(partial(parse_with, {})), valid=FORMULAS[0]),
    "expression": Kind("", spoilt_expression, by_raising(parse), valid=EXPRESSIONS[0]),
    "option": Kind("", spoilt_option, options, valid=OPTIONS[0]),
}  # fmt: skip


def spoilt(kind: str, seed: int, content: bytes = b"") -> Any:
    """Make the input of a seed."""
    draw = np.random.default_rng([seed, *kind.encode()])
    return KINDS[kind].spoil(content, draw)


@pytest.fixture
def project(tmp_path: Path, unset: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "project"
    shipped = {
        "cases.csv": CASES_CSV,
        "table.csv": TABLE_CSV,
        "odd/speeds.csv": SPEEDS_CSV,
        "grid.yaml": GRID_YAML,
        "baseline.json": next((ROOT / "reports/baselines").glob("*.json")).read_text("utf-8"),
        "odd/data.yaml": FILES[IN_ODD]
        .replace("full_factorial", "random\n      samples: 20")
        .replace("{from: 30 m, to: 50 m, step: 10 m}", "[30 m, 50 m]")
        .replace("[80 km/h, 100 km/h]", "{empirical: speeds.csv, column: dv, unit: km/h}"),
    }  # fmt: skip
    for name, text in {**FILES, **shipped}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    unset.chdir(folder)
    return folder


def fed(
    seeds: range,
    put: Callable[[int], Callable[[], int]],
    flaw: Callable[[int, str], str],
    capfd: pytest.CaptureFixture[str],
) -> Counter[int]:
    """Feed the inputs of some seeds, each put where it is read; count the exit codes."""
    codes: Counter[int] = Counter()
    failed = []
    for seed in seeds:
        feed = put(seed)
        capfd.readouterr()
        try:
            with watched():
                code = feed()
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                raise
            failed.append(f"seed {seed}: {type(error).__name__}: {str(error)[:300]}")
            continue
        said = "".join(capfd.readouterr())
        codes[code] += 1
        if fault := flaw(code, said):
            failed.append(f"seed {seed}: {fault}: exit {code}: {said[:400]}")
    assert not failed, f"{len(failed)} of {len(seeds)}\n" + "\n".join(failed[:20])
    return codes


def fuzz(name: str, seeds: range, project: Path, capfd: pytest.CaptureFixture[str]) -> Counter[int]:
    """Spoil the input of a kind by some seeds; return how often each exit code came."""
    kind = KINDS[name]
    valid = (project / kind.file).read_bytes() if kind.file else b""
    assert kind.feed(valid if kind.file else kind.valid) == 0, capfd.readouterr()
    before = listing(project.parent)
    peak_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    def put(seed: int) -> Callable[[], int]:
        given = spoilt(name, seed, valid)
        if kind.file:
            (project / kind.file).write_bytes(given)
        return partial(kind.feed, given)

    codes = fed(seeds, put, partial(flaw_of, kind), capfd)
    if kind.file:
        (project / kind.file).write_bytes(valid)
    assert listing(project.parent) - before <= kind.writes
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - peak_kib < MOST_MEMORY_KIB
    return codes


def defect_of(code: int, said: str) -> str:
    """Tell what no input may bring about."""
    if code not in DOCUMENTED:
        return "undocumented exit code"
    return "defect" if "Traceback" in said or "defect of adeye" in said else ""


def flaw_of(kind: Kind, code: int, said: str) -> str:
    if found := defect_of(code, said):
        return found
    if code == 2 and not re.search(r"(?m)^[A-Z][A-Za-z]*Error: ", said):
        return "no message"
    if code == 2 and kind.has_place and not PLACE.search(said):
        return "no place"
    if (
        re.search("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]", said)
        and kind.feed is plan
    ):
        return "control characters"
    return ""


@pytest.mark.slow
def test_input_depends_on_its_seed_alone(project: Path) -> None:
    """Whatever was spoilt before: an input that fails must be made again from its seed."""
    for name, kind in KINDS.items():
        valid = (project / kind.file).read_bytes() if kind.file else b""
        once = [spoilt(name, seed, valid) for seed in range(300)]
        assert [spoilt(name, seed, valid) for seed in reversed(range(300))] == once[::-1], name


@pytest.mark.slow
@pytest.mark.parametrize("name", list(KINDS))
def test_spoilt_inputs(name: str, project: Path, capfd: pytest.CaptureFixture[str]) -> None:
    codes = fuzz(name, range(ORDINARY), project, capfd)
    # Most of what is spoilt must not pass, or the spoiling is none.
    assert codes[2] + codes[4] >= ORDINARY // 4, codes


@pytest.mark.chaos
@pytest.mark.slow
@pytest.mark.parametrize("name", list(KINDS))
def test_many_spoilt_inputs(name: str, project: Path, capfd: pytest.CaptureFixture[str]) -> None:
    fuzz(name, range(ORDINARY, ORDINARY + SLOW), project, capfd)
