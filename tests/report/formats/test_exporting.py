"""Tables for other programs: files that open as they were written, whole or not at all."""

import builtins
import hashlib
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import duckdb
import pandas as pd
import pyarrow.parquet as pq
import pytest

from adeye.errors import InputError, UsageError
from adeye.report.formats import GSN_FORMS, check_exports, render_export, tables
from adeye.report.formats import tables as table_files
from adeye.report.model.report import Report
from adeye.store.read.export import TABLES, CampaignExport, ExportColumn
from adeye.version import __version__


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("form", tables.FORMATS)
def test_folder_has_every_table_and_says_what_it_is(tmp_path: Path, mini: Any, form: Any) -> None:
    folder = tmp_path / "deep" / "out"
    written = tables.export_campaign(mini.db, None, folder, file_format=form)
    about = json.loads((folder / tables.CONTENTS).read_text("utf-8"))
    assert contents(folder).keys() == {tables.CONTENTS, *(f"{name}.{form}" for name in TABLES)}
    assert about["tool"] == f"adeye {__version__}"
    assert (about["campaign"], about["planned"], about["done"]) == (written.campaign, 28, 28)
    assert written.rows["runs"] == 28
    for name, file in about["files"].items():
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == file["sha256"]
        assert written.rows[file["table"]] == file["rows"] > 0
    units = {
        column["name"]: column.get("unit") for column in about["files"][f"runs.{form}"]["columns"]
    }
    assert units["ego_speed_mps"] == "m/s"
    assert units["min_ttc_s"] == "s"
    assert "provenance" not in about
    assert list(folder.parent.iterdir()) == [folder]


def test_queries_over_views_run_over_the_files(tmp_path: Path, mini: Any) -> None:
    from adeye.store.read.query import run_query

    tables.export_campaign(mini.db, None, tmp_path / "out")
    for name, table in TABLES.items():
        columns = ", ".join(item.name for item in table.columns if not item.is_provenance)
        order = ", ".join(table.order)
        sql = f"SELECT {columns} FROM {{}} ORDER BY {order}"  # noqa: S608
        stored = run_query(mini.db, sql.format(table.view)).rows
        file = tmp_path / "out" / f"{name}.parquet"
        assert duckdb.execute(sql.format(f"'{file}'")).fetchall() == list(stored)


def test_same_campaign_gives_the_same_bytes(tmp_path: Path, mini: Any) -> None:
    for form in tables.FORMATS:
        tables.export_campaign(mini.db, None, tmp_path / f"a.{form}", tables=["verdicts"])
        tables.export_campaign(mini.db, "1", tmp_path / f"b.{form}", tables=["verdicts"])
        assert (tmp_path / f"a.{form}").read_bytes() == (tmp_path / f"b.{form}").read_bytes()


def test_provenance_is_written_if_asked_for(tmp_path: Path, mini: Any) -> None:
    tables.export_campaign(mini.db, None, tmp_path / "out", file_format="csv", with_provenance=True)
    about = json.loads((tmp_path / "out" / tables.CONTENTS).read_text("utf-8"))
    assert about["provenance"]
    assert about["created_at"]
    assert "executed_at" in (tmp_path / "out" / "runs.csv").read_text("utf-8").partition("\n")[0]


def test_export_takes_the_place_of_the_former_one(tmp_path: Path, mini: Any) -> None:
    folder = tmp_path / "out"
    tables.export_campaign(mini.db, None, folder, file_format="csv", tables=["runs", "events"])
    tables.export_campaign(mini.db, None, folder, file_format="jsonl", tables=["events"])
    assert contents(folder).keys() == {tables.CONTENTS, "events.jsonl"}
    assert list(tmp_path.iterdir()) == [folder]


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
@pytest.mark.parametrize("name", ["out", "runs.csv"])
def test_failure_leaves_what_was_there(
    tmp_path: Path, mini: Any, monkeypatch: pytest.MonkeyPatch, name: str, error: BaseException
) -> None:
    output = tmp_path / name
    tables.export_campaign(mini.db, None, output)
    before = contents(output) if output.is_dir() else output.read_bytes()
    real = CampaignExport.chunks

    def failing(self: CampaignExport) -> Iterator[Any]:
        yield next(real(self))
        raise error

    monkeypatch.setattr(CampaignExport, "chunks", failing)
    with pytest.raises(BaseException, match=r"No space|^$"):
        tables.export_campaign(mini.db, None, output)
    assert (contents(output) if output.is_dir() else output.read_bytes()) == before
    with pytest.raises(BaseException, match=r"No space|^$"):
        tables.export_campaign(mini.db, None, tmp_path / f"new_{name}")
    assert list(tmp_path.iterdir()) == [output]


@pytest.mark.parametrize(
    ("name", "options", "part"),
    [
        ("runs.csv", {"tables": ["runs", "events"]}, "2 tables are asked for"),
        ("runs.csv", {"file_format": "parquet"}, "promises csv"),
        ("theirs", {}, "holds something else"),
        ("mixed", {}, "holds something else"),
        ("file", {}, "without the ending of a table"),
    ],
)
def test_what_an_export_is_not_is_left_alone(
    tmp_path: Path, mini: Any, name: str, options: Any, part: str
) -> None:
    for folder in ("theirs", "mixed"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "thesis.txt").write_text("x", "utf-8")
    (tmp_path / "mixed" / tables.CONTENTS).write_text("{}", "utf-8")
    (tmp_path / "file").write_text("x", "utf-8")
    with pytest.raises(UsageError, match=part):
        tables.export_campaign(mini.db, None, tmp_path / name, **options)
    assert (tmp_path / "theirs" / "thesis.txt").read_text("utf-8") == "x"
    assert (tmp_path / "file").read_text("utf-8") == "x"
    assert not (tmp_path / "runs.csv").exists()


def test_result_says_how_much_is_missing(tmp_path: Path, mini: Any) -> None:
    written = tables.export_campaign(mini.db, None, tmp_path / "out.jsonl", tables=["fsr_status"])
    assert isinstance(written, tables.Written)
    assert (written.planned, written.done, list(written.rows)) == (28, 28, ["fsr_status"])


def test_form_is_that_of_the_file(report: Report) -> None:
    for form, name, begin in (
        ("sarif", "a.sarif", b"{"),
        ("reqif", "a.reqif", b"<?xml"),
        ("gsn", "a.svg", b"<svg"),
        ("gsn", "a.mmd", b"flowchart"),
        ("gsn", "a.json", b"{"),
    ):
        assert render_export(report, form, Path(name)).startswith(begin)
    # The JSON of a goal structure is not that of SARIF.
    assert "nodes" in json.loads(render_export(report, "gsn", Path("a.json")))


def test_known_ends_are_taken_and_others_refused_with_what_is_allowed() -> None:
    for end in GSN_FORMS:
        check_exports({"gsn": Path(f"a{end}"), "sarif": Path("b")})
    for name in ("a.png", "a"):
        with pytest.raises(UsageError, match="no form of a goal structure") as error:
            check_exports({"gsn": Path(name)})
        assert all(end in str(error.value) for end in GSN_FORMS)


COLUMNS = (
    ExportColumn("name", "text"),
    ExportColumn("gap_m", "number", "m", "bumper to bumper"),
    ExportColumn("count", "count"),
    ExportColumn("is_first", "flag"),
)
ROWS: list[tuple[Any, ...]] = [
    ("=cmd", 0.1, 2**53 + 1, True),
    (None, None, None, None),
    ("a\x1b[31m\nb", -0.0, -1, False),
]


def write(path: Path, form: tables.FileFormat, *parts: Sequence[tuple[Any, ...]]) -> bytes:
    with tables.open_table(path, form, COLUMNS, {"campaign": "abc"}) as file:
        for part in parts:
            file.add([[row[place] for row in part] for place in range(len(COLUMNS))])
    assert file.rows == sum(map(len, parts))
    return path.read_bytes()


def test_parquet_keeps_types_texts_and_units_and_others_read_it(tmp_path: Path) -> None:
    path = tmp_path / "t.parquet"
    write(path, "parquet", ROWS)
    table = pq.read_table(path)
    names = [column.name for column in COLUMNS]
    assert [str(field.type) for field in table.schema] == ["string", "double", "int64", "bool"]
    assert table.to_pylist() == [dict(zip(names, row, strict=True)) for row in ROWS]
    field = table.schema.field("gap_m")
    assert field.metadata == {b"unit": b"m", b"description": b"bumper to bumper"}
    assert json.loads(table.schema.metadata[b"adeye"]) == {"campaign": "abc"}
    sql = f"SELECT SUM(gap_m), COUNT(*), SUM(is_first::INT) FROM '{path}'"  # noqa: S608
    assert duckdb.execute(sql).fetchall() == [(0.1, 3, 1)]
    frame = pd.read_parquet(path)
    assert list(frame.columns) == names
    assert frame["gap_m"].sum() == 0.1


def test_groups_and_bytes_do_not_depend_on_the_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(table_files, "GROUP_ROWS", 4)
    rows = [(f"n{number}", number / 3, number, number % 2 == 0) for number in range(11)]
    for form in tables.FORMATS:
        whole = write(tmp_path / "a", form, rows)
        in_parts = write(tmp_path / "b", form, rows[:1], rows[1:3], [], rows[3:10], rows[10:])
        assert whole == in_parts
    write(tmp_path / "c", "parquet", rows)
    about = pq.read_metadata(tmp_path / "c")
    assert [about.row_group(k).num_rows for k in range(about.num_row_groups)] == [4, 4, 3]


def test_table_without_rows_has_its_columns(tmp_path: Path) -> None:
    for form, text in (("csv", "name,gap_m,count,is_first\n"), ("jsonl", "")):
        assert write(tmp_path / "t", form, []).decode() == text  # type: ignore[arg-type]
    write(tmp_path / "t.parquet", "parquet", [])
    empty = pq.read_table(tmp_path / "t.parquet")
    assert (empty.num_rows, empty.column_names) == (0, [column.name for column in COLUMNS])


def test_csv_is_harmless_and_json_is_exact(tmp_path: Path) -> None:
    assert write(tmp_path / "t.csv", "csv", ROWS).decode().splitlines() == [
        "name,gap_m,count,is_first",
        "'=cmd,0.1,9007199254740993,true",
        ",,,",
        "a[31m b,-0.0,-1,false",
    ]
    lines = write(tmp_path / "t.jsonl", "jsonl", ROWS).decode().splitlines()
    assert [tuple(json.loads(line).values()) for line in lines] == ROWS


def test_value_of_another_type_is_refused_not_bent(tmp_path: Path) -> None:
    import pyarrow as pa

    with (
        pytest.raises((pa.ArrowInvalid, pa.ArrowTypeError)),
        tables.open_table(tmp_path / "t", "parquet", COLUMNS, {}) as file,
    ):
        file.add([["a"], ["no number"], [1], [True]])


def test_without_pyarrow_the_message_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = builtins.__import__

    def without(name: str, *arguments: Any) -> Any:
        if name.startswith("pyarrow"):
            raise ImportError(name)
        return real(name, *arguments)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputError, match=r"pip install 'adeye\[columnar\]'"):
        tables.open_table(tmp_path / "t", "parquet", COLUMNS, {})
    assert list(tmp_path.iterdir()) == []
    tables.open_table(tmp_path / "t.csv", "csv", COLUMNS, {}).__exit__(None, None, None)


def test_columns_of_a_query_are_typed_by_their_values() -> None:
    rows = [(1, 1, "x", None, b"\x00\xff", 7), (2, 0.5, None, None, None, "y")]
    columns, values = tables.typed_columns(
        ("a", "b", "c", "d", "e", "f"), [*rows, (3, float("inf"), *rows[0][2:])]
    )
    assert [column.kind for column in columns] == [
        "count", "number", "text", "text", "text", "text"
    ]  # fmt: skip
    assert values == [
        [1, 2, 3], [1.0, 0.5, None], ["x", None, "x"], [None] * 3, ["00ff", None, "00ff"],
        ["7", "y", "7"],
    ]  # fmt: skip
    assert tables.typed_columns(("a",), [])[1] == [[]]
