"""``export``: options, messages, what is left to be told."""

import json
from pathlib import Path
from typing import Any

import pytest

from adeye.cli.results.query import FileFormat, Table
from adeye.report.formats import tables as exporting
from adeye.report.formats.tables import FORMATS
from adeye.store.read.export import TABLES


def test_choices_are_those_of_the_export() -> None:
    assert [item.value for item in FileFormat] == list(FORMATS)
    assert [item.value for item in Table] == list(TABLES)


def test_folder_of_parquet_by_default(adeye: Any, mini: Any, folder: Path) -> None:
    ended = adeye("export", "1", "--db", str(mini.db), "-o", "out")
    assert (ended.code, ended.out) == (0, "")
    assert "wrote out" in ended.err
    assert "28 runs, " in ended.err
    assert "note:" not in ended.err
    assert {path.suffix for path in (folder / "out").iterdir()} == {".parquet", ".json"}


def test_file_is_what_its_name_says(adeye: Any, mini: Any, folder: Path) -> None:
    assert adeye("export", "--db", str(mini.db), "--table", "verdicts", "-o", "v.jsonl").ok
    first = json.loads((folder / "v.jsonl").read_text("utf-8").partition("\n")[0])
    assert first["ordinal"] == 0


def test_missing_results_are_told(adeye: Any, mini: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    written = exporting.Written("abc", 28, 20, {"runs": 20})
    monkeypatch.setattr(exporting, "export_campaign", lambda *_, **__: written)
    ended = adeye("export", "--db", str(mini.db), "-o", "out")
    assert "note: 8 of 28 test cases have no result: they are NOT_RUN in verdicts" in ended.err


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ((), "nothing to write is named"),
        (("-o", "out", "--run", "abab"), "--run chooses what --osi writes"),
        (("--osi", "traces", "--run", "ffffffff"), "ffffffff"),
        (("-o", "--table"), "stands where"),
        (("-o", "x.csv", "--format", "parquet"), "promises csv"),
        (("-o", "x", "--table", "tables"), "tables"),
        (("99", "-o", "x"), "campaign '99'"),
    ],
)
def test_wrong_use_is_refused(
    adeye: Any, mini: Any, folder: Path, arguments: tuple[str, ...], part: str
) -> None:
    assert part in adeye("export", "--db", str(mini.db), *arguments).refused
    assert list(folder.iterdir()) == []
