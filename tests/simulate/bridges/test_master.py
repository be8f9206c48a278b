"""FMUs by themselves, stepped from tables of inputs."""

import csv
import math
from pathlib import Path

import pytest

from adeye.errors import InputError, UsageError
from adeye.simulate.bridges.master import read_table, simulate
from tests.refusals import refused
from tests.simulate.bridges.fmus import Var, build_fmu, cruise

DATA = Path(__file__).resolve().parents[4] / "shared" / "data" / "fmu"
REFERENCES = {"BouncingBall": (3.0, 0.01), "Dahlquist": (10.0, 0.1), "Feedthrough": (2.0, 0.1)}


@pytest.mark.parametrize("version", ["fmi2", "fmi3"])
@pytest.mark.parametrize("model", REFERENCES)
def test_outputs_are_those_that_were_published(model: str, version: str) -> None:
    file = DATA / version / f"{model}.fmu"
    if not file.exists():
        pytest.skip("the reference FMUs are not here")
    stop, step = REFERENCES[model]
    header, rows = simulate(file, stop, step, None, {})
    with (DATA / f"{model}_out.csv").open(newline="") as stream:
        published = list(csv.DictReader(stream))
    found = [dict(zip(header, row, strict=True)) for row in rows]
    assert len(found) == len(published)
    shared = [name for name in header if name in published[0]]
    assert len(shared) >= 2
    for mine, theirs in zip(found, published, strict=True):
        for name in shared:
            text = theirs[name]
            if text in {"true", "false"} or isinstance(mine[name], str):
                assert str(mine[name]).lower() == text.lower(), name
            else:
                assert float(mine[name]) == float(text), (name, theirs["time"])


def integrator(folder: Path) -> Path:
    variables = [
        Var("u", "input"),
        Var("w", "input", variability="discrete"),
        Var("y", "output"),
        Var("z", "output"),
    ]
    return build_fmu(folder, "integrator", variables, "v[2] += h * v[0]; v[3] = v[1];")


def test_continuous_inputs_are_interpolated_and_others_held(tmp_path: Path) -> None:
    table = tmp_path / "in.csv"
    table.write_text("time,u,w\n0,0,1\n1,10,5\n1.5,10,7\n")
    _, rows = simulate(integrator(tmp_path), 2.0, 0.5, read_table(table), {})
    found = list(rows)
    assert [row[0] for row in found] == [0.0, 0.5, 1.0, 1.5, 2.0]
    # Inputs are those of the beginning of a step: 0, 5, 10, 10.
    assert [row[1] for row in found] == [0.0, 0.0, 2.5, 7.5, 12.5]
    assert [row[2] for row in found] == [1.0, 1.0, 1.0, 5.0, 7.0]


def test_start_values_are_set(tmp_path: Path) -> None:
    table = tmp_path / "in.csv"
    table.write_text("time,wanted\n0,10\n")
    _, rows = simulate(cruise(tmp_path), 0.1, 0.1, read_table(table), {"gain": 2.0})
    assert [row[1] for row in rows] == [20.0, 20.0]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("t,u\n0,1\n", "in.csv:1: needs a column time"),
        ("time,u\n0,1\n1\n", "in.csv:3: has 1 values, not 2"),
        ("time,u\n1,1\n0,1\n", "in.csv:3: time 0 is before 1"),
        ("time,u\n0,nan\n", "in.csv:2: 'nan' is no finite number"),
        ("time,u\n0,1,5\n", "in.csv:2: has 3 values"),
        ("time,nope\n0,1\n", "no variable 'nope'"),
        ("time,y\n0,1\n", "no input but output"),
        ("time,u\n", "needs a column time"),
    ],
)
def test_wrong_table_is_refused_with_its_line(tmp_path: Path, text: str, says: str) -> None:
    table = tmp_path / "in.csv"
    table.write_text(text)
    file = integrator(tmp_path)
    refused(InputError, lambda: simulate(file, 1.0, 0.5, read_table(table), {}), says=says)


@pytest.mark.parametrize(("stop", "step"), [(1.0, 0.0), (math.nan, 0.1), (-1.0, 0.1), (1.0, 0.3)])
def test_times_that_are_no_steps_are_refused(tmp_path: Path, stop: float, step: float) -> None:
    refused(UsageError, simulate, integrator(tmp_path), stop, step, None, {}, says="--stop")


def test_failure_of_a_step_is_told_with_its_time(tmp_path: Path) -> None:
    file = build_fmu(tmp_path, "bad", [Var("y", "output")], "", status="t > 0.25 ? fmi2Error : OK")
    _, rows = simulate(file, 1.0, 0.1, None, {})
    refused(InputError, list, rows, says="'bad.fmu' failed at 0.3 s")
