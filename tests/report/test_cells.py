"""Cells that neither a terminal nor a spreadsheet obeys."""

import csv
import io
from typing import Any

import pytest

from adeye.report.cells import clean, csv_cell


@pytest.mark.parametrize(
    "text",
    [
        "=1+1", "+1+1", "-1+1", "@SUM(A1)", "=cmd|' /C calc'!A0", "  =1+1", "\t=1+1", "\r=1+1",
        "\n=1+1", "\x00=1+1", "\x1b=1+1", "\uff1d1+1", "\uff0b1+1", "\uff0d1+1", "\uff20SUM(A1)",
        "=", "-x", "+4912", "-2+3",
    ],
)  # fmt: skip
def test_formula_is_text_for_a_spreadsheet(text: str) -> None:
    is_harmless = text in {"=", "+4912"}
    cell = csv_cell(text)
    assert cell.startswith("'") is not is_harmless
    assert cell.removeprefix("'") == clean(text)


@pytest.mark.parametrize(
    "value",
    ["", "a=b", "cut_in", "-1.5", "+0.10", "-1e-3", " -2 ", "-", "+", "'quoted", 1, -1, -0.5, None],
)
def test_what_is_no_formula_stays_as_it_is(value: Any) -> None:
    assert csv_cell(value) == value


@pytest.mark.parametrize(
    ("value", "cell"),
    [
        (True, "true"),
        (False, "false"),
        (b"\x1b]0;x", "1b5d303b78"),
        ("a\x1b[31mb", "a[31mb"),
        ("a\nb", "a b"),
        ("x\u202ey", "xy"),
    ],
)
def test_everything_else_is_plain_text(value: Any, cell: str) -> None:
    assert csv_cell(value) == cell


def test_cells_survive_a_reader() -> None:
    values = ["'=1", 'a"b', "a,b", "x"]
    text = io.StringIO()
    csv.writer(text).writerow(map(csv_cell, values))
    assert next(csv.reader(io.StringIO(text.getvalue()))) == values
