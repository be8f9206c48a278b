"""What reaches standard output: harmless text, tables that fit, strict JSON, nothing of others."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import pytest
from typer import Exit

from adeye.cli import output
from adeye.cli.output import BREAKABLE, emit, results, results_apart, stacked, widths_of
from adeye.judge.verdict import Verdict
from adeye.report.words import SYMBOLS
from tests.project import ROOT
from tests.stored import known

# --- what reaches standard output: harmless text, whole tables, strict JSON


class Colour(Enum):
    RED = "red"


@dataclass
class Point:
    x: float
    path: Path


def test_what_a_terminal_would_obey_is_removed() -> None:
    for text, shown in (
        ("cut_in", "cut_in"),
        ("a\x1b[2Jb", "a[2Jb"),
        ("a\x9b31mb", "a31mb"),
        ("a\u202eb", "ab"),
        ("a\r\nb\tc", "a b c"),
        ("m/s² Ä", "m/s² Ä"),
    ):
        assert output.clean(text) == shown
    assert output.clean("a\nb\x07", lines=True) == "a\nb"


def test_json_is_versioned_strict_and_harmless(capsys: pytest.CaptureFixture[str]) -> None:
    content = {"n": [float("nan"), float("inf"), 1.5], "name": "a\x1b\x9b\u202e", "unit": "m/s²"}
    output.emit_json("plan", content)
    text = capsys.readouterr().out
    assert not set("\x1b\x9b\u202e") & set(text)
    assert json.loads(text) == {"schema": "adeye/plan@1", **content, "n": [None, None, 1.5]}


def test_records_become_json() -> None:
    found = output.plain({"p": Point(2.0, Path("a/b")), "c": Colour.RED, 3: {True}})
    assert found == {"p": {"x": 2.0, "path": "a/b"}, "c": "red", "3": [True]}


def test_table_in_a_pipe_is_whole(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    cell = "x" * 400
    output.emit_table(("a", "b"), [[cell, "[bold]y[/bold]"]])
    line = capsys.readouterr().out.splitlines()[-1]
    assert line.split() == [cell, "[bold]y[/bold]"]


def test_table_on_a_narrow_screen_keeps_every_character(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    digest = "0123456789abcdef" * 4
    output.emit_table(("run",), [[digest]])
    lines = capsys.readouterr().out.splitlines()
    assert "".join(line.strip() for line in lines[2:]) == digest
    assert max(map(len, lines)) <= 40
    output.emit_table(("a\x1b",), [["b\x1b[31m"]], title="c\x07")
    assert not {"\x1b", "\x07"} & set(capsys.readouterr().out)


def test_csv_quotes_and_leaves_missing_values_empty(capsys: pytest.CaptureFixture[str]) -> None:
    output.emit_csv(("a", "b"), [['x,"y"', None], [1, 0.1]])
    assert capsys.readouterr().out == 'a,b\n"x,""y""",\n1,0.1\n'


def test_no_verdict_is_told_by_colour_alone() -> None:
    for verdict in (*Verdict, None):
        text = output.verdict_cell(verdict).plain
        assert text.startswith(SYMBOLS[verdict])
        assert len(text) > 2


def test_values_for_people() -> None:
    for value, text in (
        (None, "\N{EN DASH}"),
        (True, "yes"),
        (0.1 + 0.2, "0.3"),
        ((1, "a"), "1, a"),
        ({"a": 1.0}, "a=1"),
        ([], "\N{EN DASH}"),
    ):
        assert output.format_value(value) == text
    shorts = [output.short(digest) for digest in ("a" * 64, "", None)]
    assert shorts == ["a" * 10, "\N{EN DASH}", "\N{EN DASH}"]


def test_value_of_any_shape_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    output.emit_value("Metrics", {"min_ttc_s": {"value": 1.5, "actor": None}})
    output.emit_value("Events", [{"time_s": 2.0, "kind": "contact"}])
    output.emit_value("Parameters", {"gap": 30.0})
    output.emit_value("Tags", ["a", "b"])
    output.emit_value("Nothing", [])
    text = capsys.readouterr().out
    for part in ("min_ttc_s", "1.5", "contact", "gap", "30", "Tags: a, b"):
        assert part in text
    assert "actor" not in text
    assert "Nothing" not in text


def test_talk_goes_to_standard_error_and_closed_standard_output_is_no_error(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    output.talk("hello")
    assert capsys.readouterr() == ("", "hello\n")
    monkeypatch.setattr(sys, "stdout", None)
    output.emit("hello")
    output.emit_table(("a",), [["b"]])


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-16"])
def test_documents_are_utf8(encoding: str, monkeypatch: pytest.MonkeyPatch) -> None:
    bytes_of = io.BytesIO()
    terminal = io.TextIOWrapper(bytes_of, encoding, errors="backslashreplace")
    monkeypatch.setattr(sys, "stdout", terminal)
    output.emit_json("x", {"name": "Ä→\U0001f697", "file": "a\udcff"})
    output.emit_csv(("name",), [["Ä→\U0001f697"], ["a\udcff"]])
    text = bytes_of.getvalue().decode("utf-8")
    document, _, table = text.partition("}\n")
    named = {"name": "Ä→\U0001f697", "file": "a\udcff"}
    assert json.loads(document + "}") == {"schema": "adeye/x@1", **named}
    assert table == "name\nÄ→\U0001f697\na\\udcff\n"


# --- tables that fit, and what becomes of those that do not


HEADERS = ("Scenario", "Fault entry", "Runs", "Least FTTI [s]")
ROWS = [("cut_in", "front_camera_out", "12", "7.45"), ("lead_braking", "none", "3", "none")]
RIGHT = HEADERS[2:]
WHOLE = [12, 16, 4, 14]


def test_columns_are_as_wide_as_their_cells_where_there_is_room() -> None:
    assert widths_of(HEADERS, ROWS, RIGHT, 1000) == WHOLE
    assert widths_of(HEADERS, ROWS, RIGHT, sum(WHOLE)) == WHOLE
    # Without rows there are the headers.
    assert widths_of(("One two", "x"), [], (), 80) == [7, 1]
    assert widths_of(("One two", "x"), [], (), 4) == [3, 1]


def test_numbers_and_short_words_are_never_broken_and_too_narrow_is_told() -> None:
    for available in range(36, sum(WHOLE)):
        widths = known(widths_of(HEADERS, ROWS, RIGHT, available))
        assert sum(widths) == available
        assert widths[0] >= len("lead_braking")
        assert widths[1] >= BREAKABLE
        assert widths[2] >= len("Runs")
        assert widths[3] >= len("Least")
    assert widths_of(HEADERS, ROWS, RIGHT, 34) is None


def test_whole_words_come_before_long_lines() -> None:
    rows = [("a_name_of_nineteen_", "many words " * 20)]
    assert widths_of(("Name", "Meaning"), rows, (), 40) == [19, 21]


def test_stacked_row_has_what_identifies_it_above_its_numbers() -> None:
    assert list(stacked(HEADERS, ROWS, RIGHT, 80)) == [
        "cut_in, front_camera_out",
        "  Runs: 12, Least FTTI [s]: 7.45",
        "lead_braking, none",
        "  Runs: 3, Least FTTI [s]: none",
    ]
    # Without numbers it begins with its first cell.
    assert list(stacked(("a", "b"), [("x", "y")], (), 80)) == ["x", "  b: y"]


def test_stacked_lines_keep_to_the_width_and_lose_nothing() -> None:
    headers = ("Id", *(f"Number {k}" for k in range(20)))
    lines = list(stacked(headers, [("x", *map(str, range(20)))], headers[1:], 40))
    assert max(map(len, lines)) <= 40
    parts = " ".join(lines[1:]).split(", ")
    assert [" ".join(part.split()) for part in parts] == [f"Number {k}: {k}" for k in range(20)]


def test_table_is_stacked_on_a_narrow_terminal_only(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for columns, is_stacked in ((40, True), (60, False)):
        monkeypatch.setenv("COLUMNS", str(columns))
        output.emit_table(HEADERS, ROWS, right=RIGHT)
        lines = capsys.readouterr().out.splitlines()
        assert max(map(len, lines)) <= columns
        assert ("Runs: 12" in lines[1]) == is_stacked


# --- standard output is for results, whatever prints or closes it meanwhile


def say(text: str) -> None:
    print(text)  # noqa: T201 - as code from outside does


def test_what_others_print_goes_to_standard_error(capfd: pytest.CaptureFixture[str]) -> None:
    say("before")
    with results_apart():
        say("a plug-in")
        os.write(1, b"a library\n")
        emit("a result")
        subprocess.run([sys.executable, "-c", "print('a worker')"], check=True)
    say("after")
    sys.stdout.flush()
    written = capfd.readouterr()
    assert written.out == "before\na result\nafter\n"
    assert sorted(written.err.splitlines()) == ["a library", "a plug-in", "a worker"]


def test_it_is_laid_apart_once(capfd: pytest.CaptureFixture[str]) -> None:
    with results_apart():
        stream = results()
        with results_apart():
            assert results() is stream
            emit("a result")
    assert results() is sys.stdout
    assert capfd.readouterr().out == "a result\n"


def test_descriptors_are_given_back_also_after_an_error(capfd: pytest.CaptureFixture[str]) -> None:
    def count() -> int:
        return len(list(Path("/proc/self/fd").iterdir()))

    before = count()
    with pytest.raises(RuntimeError), results_apart():
        raise RuntimeError
    assert count() == before
    say("after")
    assert capfd.readouterr().out == "after\n"


def test_streams_without_a_file_stay_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stdout", stream)
    with results_apart():
        emit("a result")
        say("a plug-in")
    assert stream.getvalue() == "a result\na plug-in\n"


@pytest.mark.parametrize("mischief", ["sys.stdout.close()", "os.close(1)", "sys.stdout = None"])
def test_result_comes_through_although_the_output_was_closed(mischief: str) -> None:
    program = (
        "import os, sys\n"
        "from adeye.cli.output import emit, results_apart\n"
        f"with results_apart():\n    {mischief}\n    emit('a result')\n"
    )
    command = [sys.executable, "-c", program]
    environment = {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "a result\n", "")


def test_what_is_found_about_no_run_is_never_green(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(Exit) as ended:
        output.emit_found("forks", Point(1.0, Path("a")), lambda _: None, json=True, looked_at=0)
    assert ended.value.exit_code == 3
    assert "forks: there is no run to look at" in capsys.readouterr().err


@pytest.mark.parametrize("columns", [80, 120, 200])
def test_no_line_is_wider_than_the_terminal_and_no_word_is_broken(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, columns: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    text = "always((authority.safety and not monitor.object_danger.confirmed) implies x) " * 4
    output.emit_prose(f"  {text}")
    output.emit_table(["a", "b", "n"], [["x", text, "1" * 60]], title=text, right=["n"])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= columns
    known = {*text.split(), "x", "x,", "n:", "b:", "a", "b", "n", "1" * 60}
    assert {word for line in lines for word in line.split()} <= known | {
        "\N{BOX DRAWINGS LIGHT HORIZONTAL}" * n for n in range(200)
    }


def test_prose_that_nobody_looks_at_stays_in_its_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    output.emit_prose("word " * 100)
    assert len(capsys.readouterr().out.splitlines()) == 1
