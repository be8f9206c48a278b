"""``query|export``: one SELECT over the views, read-only and bounded; a campaign as tables."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from adeye.cli import options as opt
from adeye.cli import output as out
from adeye.errors import UsageError, suggest
from adeye.outputs import replacing, write_atomically

if TYPE_CHECKING:
    from adeye.report.formats.tables import Written
    from adeye.store.read.query import QueryResult

# --- ``query``: one SELECT over the views, read-only and bounded, or a saved one by its name ------

_NAME: Final = re.compile(r"[\w-]+")
_ROWS: Final = 10_000


class Format(str, Enum):  # noqa: UP042 - typer before 0.13 shows the name of a StrEnum
    """How rows are printed."""

    table = "table"
    csv = "csv"
    json = "json"
    parquet = "parquet"


def query(
    sql: Annotated[
        str | None, typer.Argument(metavar="[SQL]", autocompletion=opt.complete_queries)
    ] = None,
    *,
    db: opt.Db = None,
    format: Annotated[Format | None, opt.option("--format -f")] = None,
    json: opt.Json = False,
    output: Annotated[Path | None, opt.option("--output -o FILE", callback=opt.named)] = None,
    campaign: Annotated[
        str | None, opt.option("--campaign -c CAMPAIGN", autocompletion=opt.complete_campaigns)
    ] = None,
    max_rows: Annotated[int, opt.option("N", min=1)] = _ROWS,
    timeout_s: Annotated[float, opt.option("SECONDS", min=0.1)] = 10.0,
    list_saved: Annotated[bool, opt.option("--list -l")] = False,
) -> None:
    """Ask the database in SQL. Nothing can be changed by it.

    The views v_runs, v_runs_<scenario>, v_verdicts, v_fsr_status, v_gate, v_architecture_pairs,
    v_coverage and v_timeline are stable. A planned run without a result is NOT_RUN in all of them.
    Saved queries are about the latest campaign or that of --campaign; without SQL they are listed.

    Parameters:
        sql: One SELECT, the name of a saved query, or - for standard input.
        format: How rows are printed; parquet needs a file. Default: how FILE ends, else a table.
        output: Write the rows to a file in .csv, .json or .parquet.
        campaign: Ask about this one, by number or beginning of its digest; SQL has it as :campaign.
            Default of saved queries: the latest.
        max_rows: Most rows to print.
        timeout_s: Longest time that the query may run.
        list_saved: List the saved queries.

    Examples:
        adeye query failing-fsrs
        adeye query 'SELECT scenario, min_ttc_s FROM v_runs ORDER BY 2' --format csv
    """
    wanted = _wanted(Format.json if json else format, output)
    if list_saved or sql is None:
        _list(wanted, output)
        return
    from adeye.store.read.query import run_query

    about = _about(db, campaign)
    statement = _statement(sql, about)
    result = run_query(db, statement, parameters=about, max_rows=max_rows, timeout_s=timeout_s)
    if output is None:
        _print(result, wanted)
    else:
        _save(result, wanted, output)
    if not result.rows:
        out.talk(f"note: no rows{_reason(db, sql, about)}")
    if result.is_cut:
        done = "printed" if output is None else "written"
        out.talk(f"note: only the first {max_rows} rows are {done}; see --max-rows.")


def _wanted(chosen: Format | None, output: Path | None) -> Format:
    """Decide how rows are written.

    Raises:
        UsageError: The file does not tell, promises another form, or there is none for Parquet.
    """
    if output is None:
        if chosen is Format.parquet:
            raise UsageError("parquet is not for the screen", remedy="Name a file: -o FILE.parquet")
        return chosen or Format.table
    forms = {f".{item.value}": item for item in Format if item is not Format.table}
    promised = forms.get(output.suffix.lower())
    if promised is None or chosen not in (None, promised):
        allowed = [end for end, item in forms.items() if chosen in (None, item)] or forms
        raise UsageError(
            f"{str(output)!r} does not end in {' or '.join(allowed)}",
            remedy="Rows are written as its name says.",
        )
    return promised


def _about(db: str | None, campaign: str | None) -> dict[str, str]:
    if campaign is None:
        return {}
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        return {"campaign": repository.find_campaign(campaign).id}


def _statement(sql: str, about: Mapping[str, str]) -> str:
    """Find the statement behind what was typed.

    Raises:
        UsageError: It is one word, and no saved query, or it does not ask about a campaign.
    """
    from adeye.cli.queries import SAVED

    if sql == "-":
        statement = sys.stdin.read()
    elif sql in SAVED:
        statement = SAVED[sql].about_one().sql if about else SAVED[sql].sql
    elif _NAME.fullmatch(sql):
        raise UsageError(f"there is no saved query {sql!r}", remedy=suggest(sql, SAVED))
    else:
        statement = sql
    if about and ":campaign" not in statement:
        raise UsageError(
            "--campaign is given, and the query does not ask about one",
            remedy="Write WHERE campaign = :campaign, or leave --campaign out.",
        )
    return statement


def _reason(db: str | None, sql: str, about: Mapping[str, str]) -> str:
    """Say why a saved query has no rows, if that is for want of what it asks about."""
    from adeye.cli.queries import SAVED
    from adeye.store.read.query import run_query

    saved = SAVED.get(sql)
    if saved is None:
        return ""
    # A query that finds nothing is good news only where there was something to find.
    asked = saved.about_one() if about else saved
    parameters = about if ":campaign" in asked.basis else {}
    ((basis,),) = run_query(db, asked.basis, parameters=parameters).rows
    return "" if basis else f", and that says nothing: {asked.lacking}"


def _list(wanted: Format, output: Path | None) -> None:
    from adeye.cli.queries import SAVED

    if output is not None:
        raise UsageError("the list of saved queries is not written to a file", remedy="Name one.")
    if wanted is Format.json:
        out.emit_json("query-list", {"queries": list(SAVED.values())})
        return
    rows = [[item.name, item.text] for item in SAVED.values()]
    if wanted is Format.csv:
        out.emit_csv(("name", "text"), rows)
    else:
        out.emit_table(("Saved query", "Answers"), rows)
        out.emit(
            "\nWithout a campaign that was executed ('adeye run ODD') none of them tells anything."
        )


def _print(result: QueryResult, wanted: Format) -> None:
    if wanted is Format.csv:
        out.emit_csv(result.columns, result.rows)
    elif wanted is Format.json:
        out.emit_document(out.json_text("query", _document(result)))
    else:
        numeric = {
            out.clean(name)
            for column, name in enumerate(result.columns)
            if any(_is_number(row[column]) for row in result.rows)
        }
        out.emit_table(result.columns, result.rows, right=numeric)


def _document(result: QueryResult) -> dict[str, Any]:
    names = _distinct(result.columns)
    rows = [dict(zip(names, row, strict=True)) for row in result.rows]
    return {"columns": names, "rows": rows, "is_cut": result.is_cut}


def _save(result: QueryResult, wanted: Format, output: Path) -> None:
    """Write rows to a file, as a whole or not at all."""
    from adeye.report.formats.tables import open_table, typed_columns

    if wanted is Format.json:
        text = out.json_text("query", _document(result))
        write_atomically(f"{text}\n".encode(), output)
    elif wanted is Format.csv:
        write_atomically(out.csv_text(result.columns, result.rows).encode(), output)
    else:
        columns, values = typed_columns(_distinct(result.columns), result.rows)
        with replacing(output) as place, open_table(place, "parquet", columns, {}) as file:
            file.add(values)
    out.wrote(output)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float)


def _distinct(columns: tuple[str, ...]) -> list[str]:
    """Number names that occur more than once, so that no column is lost.

    >>> _distinct(("a", "b", "a"))
    ['a', 'b', 'a_2']
    """
    names: list[str] = []
    for column in columns:
        name, number = column, 1
        while name in names:
            number += 1
            name = f"{column}_{number}"
        names.append(name)
    return names


# --- ``export``: a campaign as typed tables for DuckDB, pandas and others, in files of their kind -


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


def export(
    output: Annotated[Path, opt.option("--output -o FOLDER|FILE", callback=opt.named_place)],
    campaign: opt.CampaignId = None,
    *,
    db: opt.Db = None,
    format: Annotated[FileFormat | None, opt.option("--format -f", env="EXPORT_FORMAT")] = None,
    table: Annotated[list[Table] | None, opt.option("--table -t")] = None,
    with_provenance: bool = False,
) -> None:
    """Write a campaign as typed tables: runs, verdicts, events, status of the FSRs.

    Columns are those of the views v_runs, v_verdicts, v_timeline and v_fsr_status; in runs,
    parameters and verdicts are columns of their own. Parquet carries the unit and the meaning of
    each column and needs adeye[columnar]. The same campaign gives the same files, also from
    another database, unless --with-provenance adds what differs. Everything is written or nothing.

    Parameters:
        output: Folder for a file per table, or one file in .parquet, .csv or .jsonl.
        format: Form of the files; default: how FILE ends, parquet for a folder.
        table: What to export, may be repeated; default: all into a folder, runs into a file.
        with_provenance: Also write when runs were executed, and where the campaign comes from.

    Examples:
        adeye export -o results
        adeye export 3 -o runs.parquet
        adeye export --table verdicts -o verdicts.csv
    """
    from adeye.report.formats.tables import export_campaign

    written = export_campaign(
        db,
        campaign,
        output,
        file_format=None if format is None else format.value,
        tables=[item.value for item in table or ()],
        with_provenance=with_provenance,
    )
    out.wrote(output)
    _tell(written)


def _tell(written: Written) -> None:
    rows = ", ".join(f"{count:,} {name}" for name, count in written.rows.items())
    out.talk(f"campaign {out.clean(written.campaign[:10])}: {rows}")
    missing = written.planned - written.done
    if missing:
        out.talk(
            f"note: {missing:,} of {written.planned:,} test cases have no result: they are "
            "NOT_RUN in verdicts, and not in runs."
        )
