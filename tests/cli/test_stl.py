"""``stl``: verdict, explanation and series of a formula on a table, and the exit codes."""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from pathlib import Path

TABLE = "time,gap,brake\n0,9,false\n0.1,5,false\n0.2,3,true\n0.3,4,true\n"


@pytest.fixture
def table(folder: Path) -> str:
    (folder / "drive.csv").write_text(TABLE, "utf-8")
    return "drive.csv"


def test_what_is_shown_of_a_violation(adeye: Any, table: str) -> None:
    done = adeye("stl", "always(gap > limit)", table, "--unit", "gap=m", "--set", "limit=4m")
    assert done.code == 1
    for text in ("FAIL", "gap > limit at 0.2 s", "3 m", "4 m", "-1 m", "limit = 4", "0.1 s"):
        assert text in done.out


@pytest.mark.parametrize(
    ("formula", "code"),
    [
        ("always(gap > 2)", 0),
        ("always(gap > 4)", 1),
        ("always(gpa > 4)", 2),
        ("always(brake implies eventually[0 s, 1 s](gap > 5))", 3),
        ("always(gap > 10 implies brake)", 3),
        ("always(1 / (gap - 4) > 0)", 3),
    ],
)
def test_exit_code(adeye: Any, table: str, formula: str, code: int) -> None:
    assert adeye("stl", formula, table).code == code


def test_json_has_the_whole_series_and_null_for_what_is_open(adeye: Any, table: str) -> None:
    done = adeye("stl", "always(eventually[0 s, 1 s](gap > 5))", table, "--json")
    found = done.document
    assert found["schema"] == "adeye/stl@1"
    assert found["verdict"] == "INCONCLUSIVE"
    assert found["robustness"] == [-1.0, None]
    assert found["series"]["time_s"] == [0.0, 0.1, 0.2, 0.3]
    assert found["series"]["robustness_low"] == [-1.0] * 4
    assert found["step_s"] == 0.1


def test_the_series_is_written_as_csv(adeye: Any, table: str, folder: Path) -> None:
    done = adeye("stl", "always(gap > 4)", table, "--horizon", "0.2 s", "-o", "rho.csv")
    assert "wrote rho.csv" in done.err
    with (folder / "rho.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    assert rows == [
        ["time_s", "robustness_low", "robustness_high"],
        ["0.0", "-1.0", "-1.0"],
        ["0.1", "-1.0", "-1.0"],
        ["0.2", "-1.0", "-1.0"],
        ["0.3", "", ""],
    ]
    assert adeye("stl", "always(gap > 4)", table, "-o", "no/rho.csv").code == 5


def test_an_empty_cell_is_an_error_with_its_line(adeye: Any, folder: Path) -> None:
    (folder / "drive.csv").write_text("t,gap\n0,1\n1,\n2,3\n", "utf-8")
    done = adeye("stl", "always(gap > 0)", "drive.csv")
    assert done.code == 3
    assert "ERROR" in done.out
    assert "line 3: gap is empty" in done.out


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (["--unit", "gap"], "--unit 'gap' is no pair"),
        (["--set", "a=1", "--set", "a=2"], "--set names 'a' twice"),
        (["--unit", "gpa=m"], "no column 'gpa'"),
        (["--time", "clock"], "no column 'clock'"),
        (["--words", "brake=off,on"], "drive.csv:2:3: 'false' is none of the words off, on"),
    ],
)
def test_options_that_do_not_fit_are_usage_errors(
    adeye: Any, table: str, option: list[str], message: str
) -> None:
    done = adeye("stl", "always(gap > 0 and brake == on)", table, *option)
    assert done.code == 2
    assert message in done.err
    assert "Traceback" not in done.err
