"""``query|export|stl``: rows of the views, a campaign as tables, a formula on a table."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from adeye.cli import options as opt
from adeye.cli import output as out
from adeye.cli.progress import watching
from adeye.errors import UsageError, amount, suggest
from adeye.judge.verdict import Verdict, exit_of_verdict
from adeye.outputs import replacing, write_atomically

if TYPE_CHECKING:
    from collections.abc import Iterable

    from adeye.judge.stl.table import JudgedTable
    from adeye.judge.verdict import Judgement
    from adeye.report.formats.tables import Written
    from adeye.store.read.query import QueryResult
    from adeye.store.records import CampaignInfo

# --- ``query``: one SELECT over the views, read-only and bounded, or a saved one by its name ------

_NAME: Final = re.compile(r"[\w-]+")
_CAMPAIGN: Final = re.compile(r"(?<!:):campaign\b")
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
    columns: Annotated[str | None, opt.option("VIEW")] = None,
) -> None:
    """Ask the database in SQL. Nothing can be changed by it.

    The views v_runs, v_runs_<scenario>, v_verdicts, v_fsr_status, v_gate, v_architecture_pairs,
    v_coverage and v_timeline are stable. A planned run without a result is NOT_RUN in all of them.
    Saved queries are about the latest campaign or that of --campaign; without SQL they are listed.
    Numbers are in SI, as the ends of columns say.

    Parameters:
        sql: One SELECT, the name of a saved query, or - for standard input.
        format: How rows are printed; parquet needs a file. Default: how FILE ends, else a table.
        output: Write the rows to a file in .csv, .json or .parquet.
        campaign: Ask about this one, by number or beginning of its digest; SQL has it as :campaign.
            Default: the latest.
        max_rows: Most rows to print.
        timeout_s: Longest time that the query may run.
        list_saved: List the saved queries.
        columns: List the columns of a view or table, with their units.

    Examples:
        adeye query failing-fsrs
        adeye query 'SELECT scenario, min_ttc_s FROM v_runs ORDER BY 2' --format csv
        adeye query --columns v_runs
    """
    wanted = _wanted(Format.json if json else format, output)
    if columns is not None:
        if sql is not None or list_saved or output is not None:
            raise UsageError(
                "--columns goes with --db and --format only", remedy="Leave the others out."
            )
        _columns(db, columns, wanted)
        return
    if list_saved or sql is None:
        _list(wanted, output)
        return
    from adeye.store.read.query import run_query

    about = _about(db, campaign)
    statement = _statement(sql, about)
    if not about and _CAMPAIGN.search(statement):
        latest = _campaign(db, None)
        out.talk(f"note: :campaign is the latest, {latest.number} of ODD {latest.odd}")
        about = {"campaign": latest.id}
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
    return {} if campaign is None else {"campaign": _campaign(db, campaign).id}


def _campaign(db: str | None, name: str | None) -> CampaignInfo:
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        return repository.find_campaign(name)


def _statement(sql: str, about: Mapping[str, str]) -> str:
    """Find the statement behind what was typed.

    Raises:
        UsageError: It is one word, and no saved query, or it does not ask about a campaign.
    """
    if sql == "-":
        statement = sys.stdin.read()
    elif _NAME.fullmatch(sql):
        from adeye.store.read.saved import SAVED

        if sql not in SAVED:
            raise UsageError(f"there is no saved query {sql!r}", remedy=suggest(sql, SAVED))
        statement = SAVED[sql].about_one().sql if about else SAVED[sql].sql
    else:
        statement = sql
    if about and not _CAMPAIGN.search(statement):
        raise UsageError(
            "--campaign is given, and the query does not ask about one",
            remedy="Write WHERE campaign = :campaign, or leave --campaign out.",
        )
    return statement


def _reason(db: str | None, sql: str, about: Mapping[str, str]) -> str:
    """Say why a saved query has no rows, if that is for want of what it asks about."""
    from adeye.store.read.query import run_query
    from adeye.store.read.saved import SAVED

    saved = SAVED.get(sql)
    if saved is None:
        return ""
    # A query that finds nothing is good news only where there was something to find.
    asked = saved.about_one() if about else saved
    parameters = about if ":campaign" in asked.basis else {}
    ((basis,),) = run_query(db, asked.basis, parameters=parameters).rows
    return "" if basis else f", and that says nothing: {asked.lacking}"


def _columns(db: str | None, view: str, wanted: Format) -> None:
    from adeye.store.read.query import columns_of

    found = columns_of(db, view)
    if wanted is Format.json:
        out.emit_json("query-columns", {"view": view, "columns": list(found)})
        return
    rows = [[item.name, item.type, item.unit] for item in found]
    emit = out.emit_csv if wanted is Format.csv else out.emit_table
    emit(("column", "type", "unit"), rows)


def _list(wanted: Format, output: Path | None) -> None:
    from adeye.store.read.saved import SAVED

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
    campaign: opt.CampaignId = None,
    *,
    output: Annotated[
        Path | None, opt.option("--output -o FOLDER|FILE", callback=opt.named_place)
    ] = None,
    osi: Annotated[
        Path | None, opt.option("DIR", env="EXPORT_OSI", callback=opt.named_place)
    ] = None,
    run: Annotated[list[str] | None, opt.option("RUN", env="EXPORT_RUN")] = None,
    db: opt.Db = None,
    format: Annotated[FileFormat | None, opt.option("--format -f", env="EXPORT_FORMAT")] = None,
    table: Annotated[list[Table] | None, opt.option("--table -t")] = None,
    with_provenance: bool = False,
    quiet: opt.Quiet = False,
) -> None:
    """Write a campaign as typed tables: runs, verdicts, events, status of the FSRs.

    Columns are those of the views v_runs, v_verdicts, v_timeline and v_fsr_status; in runs,
    parameters and verdicts are columns of their own. Parquet carries the unit and the meaning of
    each column and needs adeye[columnar]. The same campaign gives the same files, also from
    another database, unless --with-provenance adds what differs. Everything is written or nothing.

    With --osi each run is executed again and written as traces of ASAM OSI: what is true, and what
    each sensor detects.

    Parameters:
        output: Folder for a file per table, or one file in .parquet, .csv or .jsonl.
        osi: Folder for traces of ASAM OSI, in single files and in MCAP; needs adeye[osi].
        run: Beginning of the digest of a run for --osi, may be repeated; default: all done ones.
        format: Form of the files; default: how FILE ends, parquet for a folder.
        table: What to export, may be repeated; default: all into a folder, runs into a file.
        with_provenance: Also write when runs were executed, and where the campaign comes from.

    Examples:
        adeye export -o results
        adeye export 3 -o runs.parquet
        adeye export --table verdicts -o verdicts.csv
        adeye export --osi traces --run 3f2a91c04b
    """
    if output is None and osi is None:
        raise UsageError("nothing to write is named", remedy="Name --output or --osi, or both.")
    if run and osi is None:
        raise UsageError("--run chooses what --osi writes", remedy="Name --osi DIR, too.")
    if osi is not None:
        from adeye.reporting import export_osi

        with watching(quiet=quiet) as report:
            count = export_osi(db, campaign, osi, run or (), report=report)
        out.wrote(osi)
        out.talk(f"{amount(count, 'run')} as traces of OSI")
    if output is None:
        return
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


# --- ``stl``: a formula of signal temporal logic on a table ---------------------------------------


def stl(  # noqa: PLR0917 - options
    formula: Annotated[str, typer.Argument(metavar="FORMULA", show_default=False)],
    table: Annotated[Path, typer.Argument(metavar="TABLE", show_default=False)],
    time: Annotated[str | None, opt.option("COLUMN")] = None,
    unit: Annotated[list[str] | None, opt.option("COLUMN=UNIT")] = None,
    words: Annotated[list[str] | None, opt.option("COLUMN=WORD,WORD")] = None,
    set_: Annotated[list[str] | None, opt.option("--set NAME=VALUE")] = None,
    horizon: Annotated[str | None, opt.option("TIME")] = None,
    output: Annotated[Path | None, opt.option("--output -o FILE", callback=opt.named)] = None,
    json: opt.Json = False,
) -> None:
    """Evaluate a formula on a table with a column of times: verdict, robustness, and why.

    The columns are its signals; a column of true and false is a truth value, one of words is
    compared with ==. Rows must be evenly spaced. The robustness is an interval where the table ends
    too early. What is shown is the one condition and row that it comes from.

    Exit codes: 0 it holds, 1 it is violated, 2 wrong input, 3 it is open, vacuous, or reads an
    empty cell.

    Parameters:
        formula: Over the columns, such as 'always(gap > 2 m)'.
        table: CSV file with a line of column names.
        time: Column of the times; default: time, time_s or t.
        unit: Unit of a column, such as gap=m; may be repeated. Others are plain numbers.
        words: All words that a column may have; default: those that occur. May be repeated.
        set_: Value of a parameter of the formula, such as tau=1.5s; may be repeated.
        horizon: Time after the first row, such as '8 s', until which obligations begin; default: to
            the last row. Beyond it, the table was cut short.
        output: Write the robustness at each row as CSV.

    Examples:
        adeye stl 'always(gap > 2 m)' drive.csv --unit gap=m
        adeye stl 'always(brake implies once[0 s, tau](ttc < 2 s))' drive.csv --unit ttc=s --set
            tau=0.5s --json
    """
    from adeye.judge.stl.table import Reading, judge_table, read_table

    declared = opt.pairs_of("--words", words)
    reading = Reading(
        time=time,
        units=opt.pairs_of("--unit", unit),
        words={name: [word.strip() for word in text.split(",")] for name, text in declared.items()},
        parameters=opt.pairs_of("--set", set_),
        horizon=horizon,
    )
    found = judge_table(formula, read_table(table), reading)
    if output is not None:
        _write(found, output)
    out.emit_found("stl", found, _print_judged, json=json, document=_judged_document)
    if output is not None:
        out.wrote(output)
    raise typer.Exit(exit_of_verdict(found.verdict))


def _print_judged(found: JudgedTable) -> None:
    item = found.judgement
    unit = "" if item.unit in {None, "1"} else f" {item.unit}"
    at = "" if item.time_s is None else f" at {item.time_s:.15g} s"
    shown = {
        "Verdict": out.verdict_cell(item.verdict),
        "Robustness": _interval(item.robustness_low, item.robustness_high),
        "Decided by": None if item.predicate is None else f"{item.predicate}{at}",
        "Value": None if item.value is None else f"{item.value:.6g}{unit}",
        "Threshold": None if item.threshold is None else f"{item.threshold:.6g}{unit}",
        "Difference": None if _gap(item) is None else f"{_gap(item):+.6g}{unit}",
        "Why": item.detail,
        "Parameters": ", ".join(
            f"{name} = {value:.6g}" for name, value in found.parameters.items()
        ),
        "Rows": f"{len(found.time_s):,}, one every {found.step_s:.6g} s, obligations over "
        f"{found.horizon_s:.6g} s",
    }
    out.emit_fields(shown)


def _gap(item: Judgement) -> float | None:
    """Give value less threshold; None where nothing was tried, so that nothing was kept either."""
    return None if item.verdict is Verdict.VACUOUS else item.margin


def _statuses(bounds: Iterable[float | None]) -> list[str]:
    """Tell apart what is null in JSON: without a bound on one side, or no robustness at all."""
    return [
        "undefined"
        if bound is None or math.isnan(bound)
        else "value"
        if math.isfinite(bound)
        else "+inf"
        if bound > 0.0
        else "-inf"
        for bound in bounds
    ]


def _interval(low: float | None, high: float | None) -> str | None:
    """Write the robustness: a number, or where the table leaves it open an interval."""
    if low is None or high is None:
        return None
    return f"{low:.6g}" if low == high else f"{low:.6g} to {high:.6g}"


def _judged_document(found: JudgedTable) -> dict[str, object]:
    item = found.judgement
    return {
        "formula": found.formula,
        **out.fields_of(item, "verdict", "is_exercised"),
        "robustness": [item.robustness_low, item.robustness_high],
        "robustness_status": _statuses((item.robustness_low, item.robustness_high)),
        **out.fields_of(item, "predicate", "signal", "time_s", "value", "threshold"),
        "difference": _gap(item),
        **out.fields_of(item, "unit", "detail"),
        **out.fields_of(found, "parameters", "step_s", "horizon_s"),
        "series": {
            "time_s": found.time_s.tolist(),
            "robustness_low": found.robustness_low.tolist(),
            "robustness_high": found.robustness_high.tolist(),
            "robustness_low_status": _statuses(found.robustness_low.tolist()),
            "robustness_high_status": _statuses(found.robustness_high.tolist()),
        },
    }


def _write(found: JudgedTable, path: Path) -> None:
    columns = (found.time_s, found.robustness_low, found.robustness_high)
    rows = zip(*(column.tolist() for column in columns), strict=True)
    # Not a number: nothing is known there, which is an empty cell.
    cells = ([None if cell != cell else cell for cell in row] for row in rows)  # noqa: PLR0124
    opt.write_rows(("time_s", "robustness_low", "robustness_high"), cells, path)
