"""What reaches standard output: harmless text, whole tables, strict JSON."""

import io
import json
import sys
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import pytest

from adeye.cli import output
from adeye.judge.verdict import Verdict
from adeye.report.words import SYMBOLS


class Colour(Enum):
    RED = "red"


@dataclass
class Point:
    x: float
    path: Path


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("cut_in", "cut_in"),
        ("a\x1b[2Jb", "a[2Jb"),
        ("a\x9b31mb", "a31mb"),
        ("a\u202eb", "ab"),
        ("a\r\nb\tc", "a b c"),
        ("m/s² Ä", "m/s² Ä"),
    ],
)
def test_what_a_terminal_would_obey_is_removed(text: str, shown: str) -> None:
    assert output.clean(text) == shown


def test_lines_stay_only_where_asked() -> None:
    assert output.clean("a\nb\x07", lines=True) == "a\nb"


def test_json_is_versioned_strict_and_without_control_characters(
    capsys: pytest.CaptureFixture[str],
) -> None:
    content = {"n": [float("nan"), float("inf"), 1.5], "name": "a\x1b\x9b\u202e", "unit": "m/s²"}
    output.emit_json("plan", content)
    text = capsys.readouterr().out
    assert not set("\x1b\x9b\u202e") & set(text)
    assert json.loads(text) == {"schema": "adeye/plan@1", **content, "n": [None, None, 1.5]}


def test_records_become_json() -> None:
    found = output.plain({"p": Point(2.0, Path("a/b")), "c": Colour.RED, 3: {True}})
    assert found == {"p": {"x": 2.0, "path": "a/b"}, "c": "red", "3": [True]}


def test_table_in_a_pipe_is_never_wrapped_or_cut(
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


def test_names_in_tables_are_harmless(capsys: pytest.CaptureFixture[str]) -> None:
    output.emit_table(("a\x1b",), [["b\x1b[31m"]], title="c\x07")
    assert not {"\x1b", "\x07"} & set(capsys.readouterr().out)


def test_csv_quotes_and_leaves_missing_values_empty(capsys: pytest.CaptureFixture[str]) -> None:
    output.emit_csv(("a", "b"), [['x,"y"', None], [1, 0.1]])
    assert capsys.readouterr().out == 'a,b\n"x,""y""",\n1,0.1\n'


@pytest.mark.parametrize("verdict", [*Verdict, None])
def test_no_verdict_is_told_by_colour_alone(verdict: Verdict | None) -> None:
    text = output.verdict_cell(verdict).plain
    assert text.startswith(SYMBOLS[verdict])
    assert len(text) > 2


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "\N{EN DASH}"),
        (True, "yes"),
        (0.1 + 0.2, "0.3"),
        ((1, "a"), "1, a"),
        ({"a": 1.0}, "a=1"),
        ([], "\N{EN DASH}"),
    ],
)
def test_values_for_people(value: object, text: str) -> None:
    assert output.format_value(value) == text


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


def test_talk_goes_to_standard_error(capsys: pytest.CaptureFixture[str]) -> None:
    output.talk("hello")
    assert capsys.readouterr() == ("", "hello\n")


def test_closed_standard_output_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", None)
    output.emit("hello")
    output.emit_table(("a",), [["b"]])


def test_short_digest_of_no_run_is_a_dash() -> None:
    assert (output.short("a" * 64), output.short(""), output.short(None)) == (
        "a" * 10,
        "\N{EN DASH}",
        "\N{EN DASH}",
    )


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-16"])
def test_documents_are_utf8_whatever_the_terminal(
    encoding: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    bytes_of = io.BytesIO()
    terminal = io.TextIOWrapper(bytes_of, encoding, errors="backslashreplace")
    monkeypatch.setattr(sys, "stdout", terminal)
    output.emit_json("x", {"name": "Ä→\U0001f697", "file": "a\udcff"})
    output.emit_csv(("name",), [["Ä→\U0001f697"], ["a\udcff"]])
    text = bytes_of.getvalue().decode("utf-8")
    document, _, table = text.partition("}\n")
    assert json.loads(document + "}") == {
        "schema": "adeye/x@1",
        "name": "Ä→\U0001f697",
        "file": "a\udcff",
    }
    assert table == "name\nÄ→\U0001f697\na\\udcff\n"
