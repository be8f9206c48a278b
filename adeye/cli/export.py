"""``export``: a campaign as typed tables for DuckDB, pandas and others, in files of their kind."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from adeye.cli.options import CampaignId, Db
from adeye.cli.output import clean, talk, wrote
from adeye.cli.writing import named_place

if TYPE_CHECKING:
    from adeye.report.exporting import Written


class FileFormat(str, Enum):  # noqa: UP042 - typer before 0.13 shows the name of a StrEnum
    """Form of files."""

    parquet = "parquet"
    csv = "csv"
    jsonl = "jsonl"


class Table(str, Enum):  # noqa: UP042 - see above
    """What is exported."""

    runs = "runs"
    verdicts = "verdicts"
    events = "events"
    fsr_status = "fsr_status"


Output = Annotated[
    Path,
    typer.Option(
        "--output",
        "-o",
        metavar="FOLDER|FILE",
        envvar="ADEYE_OUTPUT",
        callback=named_place,
        help="Folder for a file per table, or one file in .parquet, .csv or .jsonl.",
    ),
]
FormatOption = Annotated[
    FileFormat | None,
    typer.Option(
        "--format",
        "-f",
        envvar="ADEYE_EXPORT_FORMAT",
        help="Form of the files; default: how FILE ends, parquet for a folder.",
    ),
]
Tables = Annotated[
    list[Table] | None,
    typer.Option(
        "--table",
        "-t",
        envvar="ADEYE_TABLE",
        help="What to export, may be repeated; default: all into a folder, runs into a file.",
    ),
]
WithProvenance = Annotated[
    bool,
    typer.Option(
        "--with-provenance",
        envvar="ADEYE_WITH_PROVENANCE",
        help="Also write when runs were executed, and where the campaign comes from.",
    ),
]


def export(
    output: Output,
    campaign: CampaignId = None,
    *,
    db: Db = None,
    format: FormatOption = None,
    table: Tables = None,
    with_provenance: WithProvenance = False,
) -> None:
    """Write a campaign as typed tables: runs, verdicts, events, status of the FSRs.

    Columns are those of the views v_runs, v_verdicts, v_timeline and v_fsr_status; in runs,
    parameters and verdicts are columns of their own. Parquet carries the unit and the meaning of
    each column and needs adeye[columnar]. The same campaign gives the same files, also from
    another database, unless --with-provenance adds what differs. Everything is written or nothing.
    """
    from adeye.report.exporting import export_campaign

    written = export_campaign(
        db,
        campaign,
        output,
        file_format=None if format is None else format.value,
        tables=[item.value for item in table or ()],
        with_provenance=with_provenance,
    )
    wrote(output)
    _tell(written)


def _tell(written: Written) -> None:
    rows = ", ".join(f"{count:,} {name}" for name, count in written.rows.items())
    talk(f"campaign {clean(written.campaign[:10])}: {rows}")
    missing = written.planned - written.done
    if missing:
        talk(
            f"note: {missing:,} of {written.planned:,} test cases have no result: they are "
            "NOT_RUN in verdicts, and not in runs."
        )
