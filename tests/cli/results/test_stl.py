"""``stl``: verdict, explanation and series of a formula on a table, and the exit codes."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest

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


def test_exit_code(adeye: Any, table: str) -> None:
    for formula, code in (
        ("always(gap > 2)", 0),
        ("always(gap > 4)", 1),
        ("always(gpa > 4)", 2),
        ("always(brake implies eventually[0 s, 1 s](gap > 5))", 3),
        ("always(gap > 10 implies brake)", 3),
        ("always(1 / (gap - 4) > 0)", 3),
    ):
        assert adeye("stl", formula, table).code == code, formula


def test_json_has_the_whole_series_and_null_for_what_is_open(adeye: Any, table: str) -> None:
    done = adeye("stl", "always(eventually[0 s, 1 s](gap > 5))", table, "--json")
    found = done.document
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


def test_an_empty_cell_is_an_error_with_its_line(adeye: Any, folder: Path) -> None:
    (folder / "drive.csv").write_text("t,gap\n0,1\n1,\n2,3\n", "utf-8")
    done = adeye("stl", "always(gap > 0)", "drive.csv")
    assert done.code == 3
    assert "ERROR" in done.out
    assert "line 3: gap is empty" in done.out


def test_options_that_do_not_fit_are_usage_errors(adeye: Any, table: str) -> None:
    for option, message in (
        (["--unit", "gap"], "--unit 'gap' is no pair"),
        (["--set", "a=1", "--set", "a=2"], "--set names 'a' twice"),
        (["--unit", "gpa=m"], "no column 'gpa'"),
        (["--time", "clock"], "no column 'clock'"),
        (["--words", "brake=off,on"], "drive.csv:2:3: 'false' is none of the words off, on"),
    ):
        said = adeye("stl", "always(gap > 0 and brake == on)", table, *option).refused
        assert message in said
        assert "Traceback" not in said


def test_json_tells_what_null_means(adeye: Any, table: str) -> None:
    found = adeye("stl", "always(eventually[0 s, 1 s](gap > 5))", table, "--json").document
    assert found["robustness_status"] == ["value", "+inf"]
    assert found["series"]["robustness_high_status"] == ["+inf"] * 4
    assert found["series"]["robustness_low_status"] == ["value"] * 4
    found = adeye("stl", "always(1 / (gap - 4) > 0)", table, "--json").document
    assert found["robustness"] == [None, None]
    assert found["robustness_status"] == ["undefined", "undefined"]
    assert found["series"]["robustness_low_status"] == ["undefined"] * 4
    cut = adeye("stl", "eventually[5 s, 6 s](gap > 5)", table, "--json").document
    assert cut["robustness_status"] == ["-inf", "+inf"]


def test_window_beyond_any_trace_is_a_trace_that_ends_too_early(adeye: Any, table: str) -> None:
    for last in ("1e3 s", "1e20 s", "1e300 s"):
        done = adeye("stl", f"always(eventually[0 s, {last}](gap > 10))", table, "--json")
        assert (done.code, done.document["verdict"]) == (3, "INCONCLUSIVE")
    assert adeye("stl", "always(eventually[1e20 s, 1e300 s](gap > 10))", table).code == 3


def test_what_was_not_tried_has_no_difference(adeye: Any, table: str) -> None:
    done = adeye("stl", "always(gap > 10 implies gap > 2)", table)
    assert "VACUOUS" in done.out
    assert "Difference" not in done.out
    found = adeye("stl", "always(gap > 10 implies gap > 2)", table, "--json").document
    assert found["difference"] is None


def test_times_since_1970_are_shown_with_their_fraction(adeye: Any, folder: Path) -> None:
    rows = (f"{1_700_000_000 + k / 10:.1f},{9 - k}" for k in range(5))
    (folder / "drive.csv").write_text("\n".join(("t,gap", *rows)), "utf-8")
    assert "at 1700000000.4 s" in adeye("stl", "always(gap > 5)", "drive.csv").out


def test_a_slip_among_truth_values_has_its_line(adeye: Any, folder: Path) -> None:
    (folder / "drive.csv").write_text("t,gap,brake\n0,1,true\n1,1,flase\n2,1,\n", "utf-8")
    said = adeye("stl", "always(brake)", "drive.csv").refused
    assert "drive.csv:3:3: 'flase' among the truth values of column 'brake'" in said
    words = ("--words", "brake=true,false,flase")
    assert adeye("stl", "always(brake == true)", "drive.csv", *words).code == 3


def test_a_long_formula_is_not_repeated_whole(adeye: Any, table: str) -> None:
    done = adeye("stl", "always(" + " and ".join(["gap > 1"] * 300) + ")", table)
    assert done.code == 2
    assert len(done.err) < 500
