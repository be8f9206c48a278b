"""``query``: one SELECT over the views, read-only and bounded, or a saved one by its name."""

from __future__ import annotations

import re
import sys
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from adeye.cli.completion import complete_queries
from adeye.cli.options import Db, Json
from adeye.cli.output import clean, emit, emit_csv, emit_json, emit_table, talk

if TYPE_CHECKING:
    from adeye.store.query import QueryResult

_NAME: Final = re.compile(r"[\w-]+")
_ROWS: Final = 10_000


class Format(str, Enum):  # noqa: UP042 - typer before 0.13 shows the name of a StrEnum
    """How rows are printed."""

    table = "table"
    csv = "csv"
    json = "json"


Sql = Annotated[
    str | None,
    typer.Argument(
        metavar="[SQL]",
        help="One SELECT, the name of a saved query, or - for standard input.",
        autocompletion=complete_queries,
    ),
]
FormatOption = Annotated[
    Format,
    typer.Option("--format", "-f", envvar="ADEYE_FORMAT", help="How rows are printed."),
]
MaxRows = Annotated[
    int,
    typer.Option(
        "--max-rows", min=1, metavar="N", envvar="ADEYE_MAX_ROWS", help="Most rows to print."
    ),
]
Timeout = Annotated[
    float,
    typer.Option(
        "--timeout-s",
        min=0.1,
        metavar="SECONDS",
        envvar="ADEYE_TIMEOUT_S",
        help="Longest time that the query may run.",
    ),
]
ListSaved = Annotated[
    bool,
    typer.Option("--list", "-l", envvar="ADEYE_LIST", help="List the saved queries."),
]


def query(
    sql: Sql = None,
    *,
    db: Db = None,
    format: FormatOption = Format.table,
    json: Json = False,
    max_rows: MaxRows = _ROWS,
    timeout_s: Timeout = 10.0,
    list_saved: ListSaved = False,
) -> None:
    """Ask the database in SQL. Nothing can be changed by it.

    The views v_runs, v_runs_<scenario>, v_verdicts, v_fsr_status, v_gate, v_architecture_pairs,
    v_coverage and v_timeline are stable. A planned run without a result is NOT_RUN in all of them.
    Saved queries are about the latest campaign; without SQL they are listed.
    """
    wanted = Format.json if json else format
    if list_saved or sql is None:
        _list(wanted)
        return
    from adeye.store.query import run_query

    result = run_query(db, _statement(sql), max_rows=max_rows, timeout_s=timeout_s)
    _print(result, wanted)
    if not result.rows:
        talk(f"note: no rows{_reason(db, sql)}")
    if result.is_cut:
        talk(f"note: only the first {max_rows} rows are printed; see --max-rows.")


def _statement(sql: str) -> str:
    """Find the statement behind what was typed.

    Raises:
        UsageError: It is one word, and no saved query.
    """
    from adeye.cli.queries import SAVED
    from adeye.errors import UsageError, suggest

    if sql == "-":
        return sys.stdin.read()
    if sql in SAVED:
        return SAVED[sql].sql
    if _NAME.fullmatch(sql):
        raise UsageError(f"there is no saved query {sql!r}", remedy=suggest(sql, SAVED))
    return sql


def _reason(db: str | None, sql: str) -> str:
    """Say why a saved query has no rows, if that is for want of what it asks about."""
    from adeye.cli.queries import SAVED
    from adeye.store.query import run_query

    saved = SAVED.get(sql)
    if saved is None:
        return ""
    # A query that finds nothing is good news only where there was something to find.
    ((basis,),) = run_query(db, saved.basis).rows
    return "" if basis else f", and that says nothing: {saved.lacking}"


def _list(wanted: Format) -> None:
    from adeye.cli.queries import SAVED

    if wanted is Format.json:
        emit_json("query-list", {"queries": list(SAVED.values())})
        return
    rows = [[item.name, item.text] for item in SAVED.values()]
    if wanted is Format.csv:
        emit_csv(("name", "text"), rows)
    else:
        emit_table(("Saved query", "Answers"), rows)
        emit(
            "\nWithout a campaign that was executed ('adeye run ODD') none of them tells anything."
        )


def _print(result: QueryResult, wanted: Format) -> None:
    if wanted is Format.csv:
        emit_csv(result.columns, result.rows)
    elif wanted is Format.json:
        names = _distinct(result.columns)
        rows = [dict(zip(names, row, strict=True)) for row in result.rows]
        emit_json("query", {"columns": names, "rows": rows, "is_cut": result.is_cut})
    else:
        numeric = {
            clean(name)
            for column, name in enumerate(result.columns)
            if any(_is_number(row[column]) for row in result.rows)
        }
        emit_table(result.columns, result.rows, right=numeric)


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
