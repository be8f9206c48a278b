"""Write a campaign to files for other programs: typed tables, and what they are, in one folder.

A folder has a file for each table and ``export.json``, which says what was exported by which
release, names every column with its unit, and holds the SHA-256 of each file.
"""

from __future__ import annotations

import hashlib
import json
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

from adeye.errors import UsageError
from adeye.outputs import replacing, replacing_folder
from adeye.report.files import guarding
from adeye.report.table_files import FORMATS, FileFormat, open_table
from adeye.store.export import CampaignExport, open_export
from adeye.store.export_columns import TABLES
from adeye.version import __version__

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from adeye.report.table_files import TableFile
    from adeye.store.location import Place

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
        "odd": campaign.odd,
        "title": campaign.title,
        "planned": campaign.planned,
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
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        table = source.tables[name]
        columns = [
            {key: value for key, value in asdict(column).items() if value}
            for column in table.columns
        ]
        found[path.name] = {
            "table": name,
            "text": table.text,
            "rows": rows[name],
            "sha256": digest,
            "columns": columns,
        }
    return found
