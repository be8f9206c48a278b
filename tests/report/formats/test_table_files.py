"""Tables as files: types, units, groups, the same bytes, and what happens without pyarrow."""

import builtins
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import duckdb
import pandas as pd
import pyarrow.parquet as pq
import pytest

from adeye.errors import InputError
from adeye.report.formats import tables as table_files
from adeye.report.formats.tables import FORMATS, FileFormat, open_table, typed_columns
from adeye.store.read.export import ExportColumn

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


def write(path: Path, form: FileFormat, *parts: Sequence[tuple[Any, ...]]) -> bytes:
    with open_table(path, form, COLUMNS, {"campaign": "abc"}) as file:
        for part in parts:
            file.add([[row[place] for row in part] for place in range(len(COLUMNS))])
    assert file.rows == sum(map(len, parts))
    return path.read_bytes()


def test_parquet_keeps_types_texts_and_units(tmp_path: Path) -> None:
    path = tmp_path / "t.parquet"
    write(path, "parquet", ROWS)
    table = pq.read_table(path)
    assert [str(field.type) for field in table.schema] == ["string", "double", "int64", "bool"]
    assert table.to_pylist() == [
        dict(zip((column.name for column in COLUMNS), row, strict=True)) for row in ROWS
    ]
    field = table.schema.field("gap_m")
    assert field.metadata == {b"unit": b"m", b"description": b"bumper to bumper"}
    assert json.loads(table.schema.metadata[b"adeye"]) == {"campaign": "abc"}


def test_duckdb_and_pandas_read_it(tmp_path: Path) -> None:
    path = tmp_path / "t.parquet"
    write(path, "parquet", ROWS)
    sql = f"SELECT SUM(gap_m), COUNT(*), SUM(is_first::INT) FROM '{path}'"  # noqa: S608
    assert duckdb.execute(sql).fetchall() == [(0.1, 3, 1)]
    frame = pd.read_parquet(path)
    assert list(frame.columns) == [column.name for column in COLUMNS]
    assert frame["gap_m"].sum() == 0.1


def test_groups_and_bytes_do_not_depend_on_the_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(table_files, "GROUP_ROWS", 4)
    rows = [(f"n{number}", number / 3, number, number % 2 == 0) for number in range(11)]
    for form in FORMATS:
        whole = write(tmp_path / "a", form, rows)
        in_parts = write(tmp_path / "b", form, rows[:1], rows[1:3], [], rows[3:10], rows[10:])
        assert whole == in_parts
    write(tmp_path / "c", "parquet", rows)
    about = pq.read_metadata(tmp_path / "c")
    assert [about.row_group(k).num_rows for k in range(about.num_row_groups)] == [4, 4, 3]


def write_nothing(path: Path, form: FileFormat) -> Path:
    with open_table(path, form, COLUMNS, {}) as file:
        file.add([[] for _ in COLUMNS])
    return path


def test_table_without_rows_has_its_columns(tmp_path: Path) -> None:
    empty = pq.read_table(write_nothing(tmp_path / "t.parquet", "parquet"))
    assert (empty.num_rows, empty.column_names) == (0, [column.name for column in COLUMNS])
    assert write_nothing(tmp_path / "t.csv", "csv").read_text("utf-8") == (
        "name,gap_m,count,is_first\n"
    )
    assert write_nothing(tmp_path / "t.jsonl", "jsonl").read_text("utf-8") == ""


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
        open_table(tmp_path / "t", "parquet", COLUMNS, {}) as file,
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
        open_table(tmp_path / "t", "parquet", COLUMNS, {})
    assert list(tmp_path.iterdir()) == []
    open_table(tmp_path / "t.csv", "csv", COLUMNS, {}).__exit__(None, None, None)


def test_columns_of_a_query_are_typed_by_their_values() -> None:
    rows = [(1, 1, "x", None, b"\x00\xff", 7), (2, 0.5, None, None, None, "y")]
    columns, values = typed_columns(
        ("a", "b", "c", "d", "e", "f"), [*rows, (3, float("inf"), *rows[0][2:])]
    )
    assert [column.kind for column in columns] == [
        "count", "number", "text", "text", "text", "text"
    ]  # fmt: skip
    assert values == [
        [1, 2, 3], [1.0, 0.5, None], ["x", None, "x"], [None] * 3, ["00ff", None, "00ff"],
        ["7", "y", "7"],
    ]  # fmt: skip
    assert typed_columns(("a",), [])[1] == [[]]
