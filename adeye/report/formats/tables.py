"""Tables as files: Parquet, CSV, or one JSON document a line, written part by part.

Parquet and JSON hold texts as they are stored; CSV is for people and spreadsheets and is made
harmless for them, see ``cells``. The same rows in the same parts give the same bytes.

A folder has a file for each table and ``export.json``, which says what was exported by which
release, names every column with its unit, and holds the SHA-256 of each file.
"""

from __future__ import annotations

import csv
import json
import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Literal, Self, get_args

from adeye.errors import UsageError, needing
from adeye.fields import fields_of
from adeye.identity import file_digest
from adeye.outputs import replacing, replacing_folder
from adeye.report.cells import csv_cell
from adeye.report.files import guarding
from adeye.store.location import Place
from adeye.store.read.export import TABLES, CampaignExport, ExportColumn, Kind, open_export
from adeye.version import __version__

# --- Tables as files: Parquet, CSV, or one JSON document a line, written part by part -------------

FileFormat = Literal["parquet", "csv", "jsonl"]
FORMATS: Final[tuple[FileFormat, ...]] = get_args(FileFormat)

GROUP_ROWS: Final = 16_384
"""Rows of a group of a Parquet file, which a reader can skip by its least and largest values."""


class TableFile(ABC):
    """A file that rows are added to; a context that closes it."""

    rows = 0

    @abstractmethod
    def add(self, columns: Sequence[Sequence[Any]]) -> None:
        """Add rows, given by column."""

    def __enter__(self) -> Self:
        """Return the file, which is open."""
        return self

    @abstractmethod
    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Close the file."""


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
        MissingExtra: Parquet is asked for, and pyarrow is not installed.
    """
    if file_format == "parquet":
        return _ParquetFile(path, columns, metadata)
    return (_CsvFile if file_format == "csv" else _JsonLinesFile)(path, columns)


def require_parquet() -> Any:
    """Import pyarrow with its Parquet writer.

    Raises:
        MissingExtra: It is not installed.
    """
    with needing("Parquet", "columnar", otherwise="write csv or jsonl"):
        import pyarrow as pa
        import pyarrow.parquet
    assert pyarrow.parquet is not None
    return pa


class _ParquetFile(TableFile):
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
        # By the second name pandas finds what it has in the attrs of a data frame.
        about = {"adeye": written, "PANDAS_ATTRS": written}
        self._schema = self._pa.schema(fields, metadata=about)
        self._writer = self._pa.parquet.ParquetWriter(path, self._schema, compression="zstd")
        self._waiting: list[Any] = []
        self._waiting_rows = 0

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

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None and self._waiting_rows:
            self._write(self._waiting_rows)
        self._writer.close()


class _TextFile(TableFile):
    def __init__(self, path: Path, columns: Sequence[ExportColumn]) -> None:
        self._file = path.open("w", encoding="utf-8", newline="")
        self._names = [column.name for column in columns]

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


# --- Write a campaign to files for other programs: typed tables, and what they are, in one folder -

CONTENTS: Final = "export.json"
SCHEMA: Final = "adeye/export@1"


@dataclass(frozen=True, slots=True)
class Written:
    """What an export wrote.

    Attributes:
        campaign: Id.
        planned: Test cases.
        done: Those with a result.
        rows: By table.
    """

    campaign: str
    planned: int
    done: int
    rows: Mapping[str, int]


def export_campaign(
    place: Place,
    campaign: str | None,
    output: Path,
    *,
    file_format: FileFormat | None = None,
    tables: Sequence[str] = (),
    with_provenance: bool = False,
) -> Written:
    """Write tables of a campaign, all of them or nothing.

    Args:
        place: The database, as everywhere.
        campaign: Its number or the beginning of its id; None for the latest.
        output: A file if it ends like one of ``FORMATS``, else a folder.
        file_format: Of the files; default: how the output ends, Parquet for a folder.
        tables: Tables to write; default: all of them into a folder, ``runs`` into a file.
        with_provenance: Whether to write what differs between two executions of one plan, too:
            when a run was executed, and where the campaign comes from.

    Raises:
        InputError: Something asked for is not there, or Parquet cannot be written.
        UsageError: A file is asked for more than one table or for another form than it promises,
            a name ends in an unknown form, or a folder holds something that is not an export.
        PlatformError: The database cannot be read, or the file system refused.
    """
    promised = output.suffix.lower().removeprefix(".")
    is_file = promised in FORMATS
    chosen = file_format or (_format(promised) if is_file else "parquet")
    names = list(dict.fromkeys(tables)) or (["runs"] if is_file else list(TABLES))
    _require_place(output, names, chosen if is_file else None)
    with (
        guarding(place, {"output": output}),
        open_export(place, campaign, names, with_provenance=with_provenance) as source,
    ):
        about = _about(source, with_provenance=with_provenance)
        if is_file:
            with replacing(output) as file:
                rows = _write(source, {names[0]: file}, chosen, about)
        else:
            with replacing_folder(output) as folder:
                places = {name: folder / f"{name}.{chosen}" for name in names}
                rows = _write(source, places, chosen, about)
                contents = {**about, "files": _files(source, places, rows)}
                text = json.dumps(contents, indent=1, ensure_ascii=False, sort_keys=True)
                (folder / CONTENTS).write_text(f"{text}\n", "utf-8")
        return Written(source.campaign.id, source.campaign.planned, source.done, rows)


def _format(name: str) -> FileFormat:
    return next(item for item in FORMATS if item == name)


def _require_place(output: Path, names: Sequence[str], chosen: FileFormat | None) -> None:
    """Refuse to write where something else is, or would be expected."""
    if chosen is not None:
        if len(names) > 1:
            raise UsageError(
                f"{str(output)!r} is one file, and {len(names)} tables are asked for",
                remedy="Name a folder, or one table.",
            )
        if output.suffix.lower() != f".{chosen}":
            raise UsageError(
                f"{str(output)!r} promises {output.suffix[1:]}, and {chosen} is asked for",
                remedy=f"Let its name end in .{chosen}.",
            )
        return
    # A number is no form: results.2 or nightly-1.4 are folders.
    if output.suffix and not output.suffix[1:].isdigit() and not output.is_dir():
        raise UsageError(
            f"{str(output)!r} ends in {output.suffix}, which is no form of tables",
            remedy=f"End a file in .{', .'.join(FORMATS)}; make the folder first if it is one.",
        )
    if output.is_dir():
        known = {CONTENTS, *(f"{name}.{form}" for name in TABLES for form in FORMATS)}
        found = {item.name for item in output.iterdir()}
        if found and (CONTENTS not in found or not found <= known):
            raise UsageError(
                f"folder {str(output)!r} holds something else than an export",
                remedy="Name another folder; an export takes the place of the former one only.",
            )
    elif output.exists():
        raise UsageError(
            f"{str(output)!r} is a file without the ending of a table",
            remedy=f"Name a folder, or a file in .{', .'.join(FORMATS)}.",
        )


def _about(source: CampaignExport, *, with_provenance: bool) -> dict[str, Any]:
    campaign = source.campaign
    about: dict[str, Any] = {
        "schema": SCHEMA,
        "tool": f"adeye {__version__}",
        "campaign": campaign.id,
        **fields_of(campaign, "odd", "title", "planned"),
        "done": source.done,
    }
    if with_provenance:
        about["provenance"] = dict(campaign.provenance)
        about["created_at"] = campaign.created_at
    return about


def _write(
    source: CampaignExport,
    places: Mapping[str, Path],
    file_format: FileFormat,
    about: Mapping[str, Any],
) -> dict[str, int]:
    with ExitStack() as stack:
        files: dict[str, TableFile] = {}
        for name, path in places.items():
            table = source.tables[name]
            metadata = {**about, "table": name, "text": table.text}
            files[name] = stack.enter_context(
                open_table(path, file_format, table.columns, metadata)
            )
        for chunk in source.chunks():
            files[chunk.table].add(chunk.columns)
    return {name: file.rows for name, file in files.items()}


def _files(
    source: CampaignExport, places: Mapping[str, Path], rows: Mapping[str, int]
) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, path in places.items():
        table = source.tables[name]
        columns = [
            {key: value for key, value in asdict(column).items() if value}
            for column in table.columns
        ]
        found[path.name] = {
            "table": name,
            "text": table.text,
            "rows": rows[name],
            "sha256": file_digest(path),
            "columns": columns,
        }
    return found
