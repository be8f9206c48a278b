"""Tables that fit, and what becomes of those that do not."""

from __future__ import annotations

import pytest

from adeye.cli import output
from adeye.cli.output import BREAKABLE, stacked, widths_of

HEADERS = ("Scenario", "Fault entry", "Runs", "Least FTTI [s]")
ROWS = [("cut_in", "front_camera_out", "12", "7.45"), ("lead_braking", "none", "3", "none")]
RIGHT = HEADERS[2:]
WHOLE = [12, 16, 4, 14]


def test_columns_are_as_wide_as_their_cells_where_there_is_room() -> None:
    assert widths_of(HEADERS, ROWS, RIGHT, 1000) == WHOLE
    assert widths_of(HEADERS, ROWS, RIGHT, sum(WHOLE)) == WHOLE


@pytest.mark.parametrize("available", range(36, sum(WHOLE)))
def test_numbers_and_short_words_are_never_broken(available: int) -> None:
    widths = widths_of(HEADERS, ROWS, RIGHT, available)
    assert widths is not None
    assert sum(widths) == available
    assert widths[0] >= len("lead_braking")
    assert widths[1] >= BREAKABLE
    assert widths[2] >= len("Runs")
    assert widths[3] >= len("Least")


def test_whole_words_come_before_long_lines() -> None:
    rows = [("a_name_of_nineteen_", "many words " * 20)]
    assert widths_of(("Name", "Meaning"), rows, (), 40) == [19, 21]


def test_too_narrow_is_told() -> None:
    assert widths_of(HEADERS, ROWS, RIGHT, 34) is None


def test_table_without_rows_needs_its_headers() -> None:
    assert widths_of(("One two", "x"), [], (), 80) == [7, 1]
    assert widths_of(("One two", "x"), [], (), 4) == [3, 1]


def test_stacked_row_has_what_identifies_it_above_its_numbers() -> None:
    assert list(stacked(HEADERS, ROWS, RIGHT, 80)) == [
        "cut_in, front_camera_out",
        "  Runs: 12, Least FTTI [s]: 7.45",
        "lead_braking, none",
        "  Runs: 3, Least FTTI [s]: none",
    ]


def test_stacked_lines_keep_to_the_width_and_lose_nothing() -> None:
    headers = ("Id", *(f"Number {k}" for k in range(20)))
    lines = list(stacked(headers, [("x", *map(str, range(20)))], headers[1:], 40))
    assert max(map(len, lines)) <= 40
    parts = " ".join(lines[1:]).split(", ")
    assert [" ".join(part.split()) for part in parts] == [f"Number {k}: {k}" for k in range(20)]


def test_stacked_table_without_numbers_begins_with_its_first_cell() -> None:
    assert list(stacked(("a", "b"), [("x", "y")], (), 80)) == ["x", "  b: y"]


@pytest.mark.parametrize(("columns", "is_stacked"), [("40", True), ("60", False)])
def test_table_is_stacked_on_a_narrow_terminal_only(
    columns: str,
    is_stacked: bool,  # noqa: FBT001 - a parameter of the test
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    output.emit_table(HEADERS, ROWS, right=RIGHT)
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= int(columns)
    assert ("Runs: 12" in lines[1]) == is_stacked
