"""Tables as files: Parquet, CSV, or one JSON document a line, written part by part.

Parquet and JSON hold texts as they are stored; CSV is for people and spreadsheets and is made
harmless for them, see ``cells``. The same rows in the same parts give the same bytes.
"""

from __future__ import annotations

import csv
import json
import math
from typing import TYPE_CHECKING, Any, Final, Literal, Protocol, Self, get_args

from adeye.errors import InputError
from adeye.report.cells import csv_cell
from adeye.store.export_columns import ExportColumn, Kind

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path
    from types import TracebackType

FileFormat = Literal["parquet", "csv", "jsonl"]
FORMATS: Final[tuple[FileFormat, ...]] = get_args(FileFormat)

GROUP_ROWS: Final = 16_384
"""Rows of a group of a Parquet file, which a reader can skip by its least and largest values."""


class TableFile(Protocol):
    """A file that rows are added to; a context that closes it."""

    rows: int

    def add(self, columns: Sequence[Sequence[Any]]) -> None:
        """Add rows, given by column."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...


def open_table(
    path: Path,
    file_format: FileFormat,
    columns: Sequence[ExportColumn],
    metadata: Mapping[str, Any],
) -> TableFile:
    """Make a file for rows.

    Args:
        path: Of the file.
        file_format: Its form.
        columns: Its columns.
        metadata: JSON-able description that a Parquet file carries; the others have no place.

    Raises:
        InputError: Parquet is asked for, and pyarrow is not installed.
    """
    if file_format == "parquet":
        return _ParquetFile(path, columns, metadata)
    return (_CsvFile if file_format == "csv" else _JsonLinesFile)(path, columns)


def require_parquet() -> Any:
    """Import pyarrow with its Parquet writer.

    Raises:
        InputError: It is not installed.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet
    except ImportError as error:
        raise InputError(
            "Parquet needs adeye[columnar]",
            remedy="pip install 'adeye[columnar]', or write csv or jsonl.",
        ) from error
    assert pyarrow.parquet is not None
    return pa


class _ParquetFile:
    def __init__(
        self, path: Path, columns: Sequence[ExportColumn], metadata: Mapping[str, Any]
    ) -> None:
        self._pa = require_parquet()
        types = {
            "text": self._pa.string(),
            "number": self._pa.float64(),
            "count": self._pa.int64(),
            "flag": self._pa.bool_(),
        }
        fields = [
            self._pa.field(
                column.name,
                types[column.kind],
                metadata={
                    key: value
                    for key, value in (("unit", column.unit), ("description", column.text))
                    if value
                },
            )
            for column in columns
        ]
        written = json.dumps(metadata, ensure_ascii=False, sort_keys=True)
        self._schema = self._pa.schema(fields, metadata={"adeye": written})
        self._writer = self._pa.parquet.ParquetWriter(path, self._schema, compression="zstd")
        self._waiting: list[Any] = []
        self._waiting_rows = 0
        self.rows = 0

    def add(self, columns: Sequence[Sequence[Any]]) -> None:
        count = len(columns[0])
        self.rows += count
        arrays = [
            self._pa.array(values, type=field.type)
            for values, field in zip(columns, self._schema, strict=True)
        ]
        self._waiting.append(self._pa.Table.from_arrays(arrays, schema=self._schema))
        self._waiting_rows += count
        while self._waiting_rows >= GROUP_ROWS:
            self._write(GROUP_ROWS)

    def _write(self, rows: int) -> None:
        """Write a group of rows; groups do not depend on the parts in which rows came."""
        table = self._pa.concat_tables(self._waiting)
        self._writer.write_table(table.slice(0, rows).combine_chunks(), row_group_size=rows)
        rest = table.slice(rows)
        self._waiting, self._waiting_rows = [rest], len(rest)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None and self._waiting_rows:
            self._write(self._waiting_rows)
        self._writer.close()


class _TextFile:
    def __init__(self, path: Path, columns: Sequence[ExportColumn]) -> None:
        self._file = path.open("w", encoding="utf-8", newline="")
        self._names = [column.name for column in columns]
        self.rows = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()


class _CsvFile(_TextFile):
    def __init__(self, path: Path, columns: Sequence[ExportColumn]) -> None:
        super().__init__(path, columns)
        self._writer = csv.writer(self._file, lineterminator="\n")
        self._writer.writerow(map(csv_cell, self._names))

    def add(self, columns: Sequence[Sequence[Any]]) -> None:
        self.rows += len(columns[0])
        self._writer.writerows(map(csv_cell, row) for row in zip(*columns, strict=True))


class _JsonLinesFile(_TextFile):
    def add(self, columns: Sequence[Sequence[Any]]) -> None:
        self.rows += len(columns[0])
        for row in zip(*columns, strict=True):
            text = json.dumps(
                dict(zip(self._names, row, strict=True)), ensure_ascii=False, allow_nan=False
            )
            self._file.write(f"{text}\n")


def typed_columns(
    names: Sequence[str], rows: Iterable[Sequence[Any]]
) -> tuple[list[ExportColumn], list[list[Any]]]:
    """Find the kinds of columns whose values are only known by themselves, as those of a query.

    A column of numbers with any fraction is one of numbers, else of counts; numbers among texts
    are written as texts, bytes in hex, an infinity as no value.

    >>> typed_columns(("a", "b"), [(1, "x"), (0.5, None)])[1]
    [[1.0, 0.5], ['x', None]]
    """
    listed = list(rows)
    values = [list(column) for column in zip(*listed, strict=True)] or [[] for _ in names]
    kinds = [_kind(column) for column in values]
    columns = [ExportColumn(name, kind) for name, kind in zip(names, kinds, strict=True)]
    return columns, [
        [_as(kind, value) for value in column] for kind, column in zip(kinds, values, strict=True)
    ]


def _kind(values: Iterable[Any]) -> Kind:
    types = {type(value) for value in values if value is not None}
    if types and types <= {int}:
        return "count"
    return "number" if types and types <= {int, float} else "text"


def _as(kind: Kind, value: Any) -> Any:
    if value is None:
        return None
    if kind == "number":
        return float(value) if math.isfinite(value) else None
    if kind == "text":
        return value.hex() if isinstance(value, bytes) else str(value)
    return value
