"""The FMUs of a batch: what one does is its own run's, and starting one costs little."""

import ctypes
import math
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from adeye.simulate.bridges import fmu_program
from adeye.simulate.bridges.fmi import Wire
from adeye.simulate.bridges.fmus import Fmus, Step, Wired
from adeye.simulate.bridges.programs import Broken
from adeye.spec.programs import FmuUse
from tests.refusals import refused
from tests.simulate.bridges.fmus import SHIPPED, Var, build_fmu

ASKED = Step([], 0.0, 0.1, is_before=True)


def leaking(folder: Path) -> Path:
    """Build an FMU that counts in a global what all its instances do; its state is in ``v``."""
    return build_fmu(folder, "leaking", [Var("y", "output")], "static int n; v[0] += 1 + 10 * n++;")


def batch(file: Path, orders: list[list[int]]) -> dict[int, list[list[float] | Broken]]:
    """Step some runs, at each tick in another order, and return what each has answered."""
    use = FmuUse(file=f"./{file.name}", step_deadline="60 s", run_deadline="600 s")
    runs = len(orders[0])
    fmus = Fmus([use] * runs, [Wired(file, [], [Wire("y", "y", 1.0, 0.0)], [])] * runs)
    found: dict[int, list[list[float] | Broken]] = {run: [] for run in range(runs)}
    try:
        assert fmus.greet() == {}
        for order in orders:
            for run, values in fmus.step(dict.fromkeys(order, ASKED)).items():
                found[run].append(values)
    finally:
        fmus.close()
    return found


def in_a_process(code: str, *arguments: Any) -> str:
    """Execute code that loads an FMU or counts imports."""
    said = subprocess.check_output([sys.executable, "-c", code, *map(str, arguments)], text=True)
    return said.strip()


def test_what_an_fmu_keeps_in_a_global_reaches_no_other_run(tmp_path: Path) -> None:
    file = leaking(tmp_path)
    (alone,) = batch(file, [[0], [0]]).values()
    assert alone == [[12.0], [33.0]]
    for _ in range(2):
        found = batch(file, [[2, 0, 1], [1, 2, 0]])
        assert found == dict.fromkeys(range(3), alone)


def test_a_reset_or_a_kept_state_would_let_it_through(tmp_path: Path) -> None:
    code = """
import sys
from adeye.simulate.bridges.fmu_program import open_fmu
fmu = open_fmu(sys.argv[1], sys.argv[2])
def run(): fmu.step(0.0, 0.1); return fmu.get(["y"])[0]
fmu.begin({}, 0.0)
kept = fmu._fmu.getFMUstate()
first = run()
fmu._fmu.setFMUstate(kept)
restored = run()
fmu._fmu.reset()
fmu.begin({}, 0.0)
print(first, restored, run())
"""
    assert in_a_process(code, leaking(tmp_path), tmp_path / "there") == "12.0 22.0 72.0"


def test_a_fork_of_the_warden_has_all_that_it_needs_to_make_an_instance(tmp_path: Path) -> None:
    code = """
import sys
from adeye.simulate.bridges import fmu_program
fmu_program.prepare()
there = set(sys.modules)
fmu_program.open_fmu(sys.argv[1], sys.argv[2])
print(sorted(set(sys.modules) - there))
"""
    file = SHIPPED / "follow_and_keep.fmu"
    assert in_a_process(code, file, tmp_path / "there") == "[]"


@pytest.mark.parametrize(
    ("kind", "fits", "beyond"),
    [
        ("UInt64", (0, 2**64 - 1), (-1, 2.0**64)),
        ("UInt8", (0, 255), (-0.6, 256)),
        ("Int8", (-128, 127), (-129, 128)),
        ("Integer", (-(2**31), 2**31 - 1), (2**31, -1e300)),
        ("Enumeration", (1, 2), (1e10,)),
    ],
)
def test_number_that_a_type_does_not_have_is_refused(
    kind: str, fits: tuple[float, ...], beyond: tuple[float, ...]
) -> None:
    # C would take another number for it, and say nothing.
    assert [fmu_program._typed(kind, value) for value in fits] == list(fits)
    for value in beyond:
        refused(RuntimeError, fmu_program._typed, kind, value, says=f"is no {kind}, which is from")
    for value in (math.nan, math.inf):
        refused((ValueError, OverflowError), fmu_program._typed, kind, value)


def test_status_that_fmi_does_not_have_is_a_failure() -> None:
    functions = {
        name: SimpleNamespace(restype=kind)
        for name, kind in (("fmi2DoStep", ctypes.c_int), ("fmi2GetVersion", ctypes.c_char_p))
    }
    for good in (0, 1):
        assert fmu_program._called(lambda _, it: it, functions, "fmi2DoStep", good) == good
    assert fmu_program._called(lambda *_: b"2.0", functions, "fmi2GetVersion") == b"2.0"
    with pytest.raises(RuntimeError, match="fmi2DoStep returned status -1"):
        fmu_program._called(lambda *_: -1, functions, "fmi2DoStep", 0.0)
