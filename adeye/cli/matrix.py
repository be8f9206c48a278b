"""``matrix``: the traceability matrix, from hazards to verdicts and back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from adeye.cli.completion import complete_campaigns
from adeye.cli.options import Db, Json
from adeye.cli.output import clean, emit, emit_document, emit_json, emit_table, listed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.report.matrix import By, TraceGroup, TraceRow

Campaign = Annotated[
    str | None,
    typer.Argument(
        metavar="[CAMPAIGN|ODD]",
        help="Number of the campaign, beginning of its digest, id or file of its ODD; default: the "
        "latest.",
        autocompletion=complete_campaigns,
    ),
]
ByColumn = Annotated[
    str,
    typer.Option(
        "--by",
        metavar="COLUMN",
        envvar="ADEYE_MATRIX_BY",
        help="What it begins with: hazard, goal, fsr, element, measure, scenario or architecture.",
    ),
]
Csv = Annotated[
    bool,
    typer.Option(
        "--csv", envvar="ADEYE_CSV", help="Print every row of the chain as comma-separated values."
    ),
]
_SHOWN_GAPS = 3


def matrix(
    campaign: Campaign = None,
    *,
    by: ByColumn = "hazard",
    db: Db = None,
    csv: Csv = False,
    json: Json = False,
) -> None:
    """Show what follows from what: hazardous event, goal, FSR, element, scenario, verdict.

    Forwards it says what a hazard is answered by; backwards, with --by scenario or --by element,
    what something is there for. A gap is where the chain ends before a PASS: a hazard without a
    goal, a goal without an FSR, an element or scenario that nothing needs, and every verdict that
    is not PASS. --csv and --json have one row for each way through the chain.
    """
    from adeye.errors import UsageError, suggest
    from adeye.report.matrix import BY, grouped, matrix_of, render_csv
    from adeye.reporting import read_report

    if by not in BY:
        raise UsageError(f"--by {clean(by)!r} is no column", remedy=suggest(by, BY))
    if csv and json:
        raise UsageError("--csv and --json exclude each other", remedy="Give one of the two.")
    column: By = by
    report = read_report(db, campaign)
    rows = matrix_of(report, column)
    if csv:
        emit_document(clean(render_csv(rows, column), lines=True))
    elif json:
        emit_json("matrix", _document(report.campaign, column, rows))
    else:
        _print(column, grouped(rows, column))


def _document(campaign: str, by: By, rows: Sequence[TraceRow]) -> dict[str, Any]:
    gaps = sum(bool(row.gap) for row in rows)
    return {"campaign": campaign, "by": by, "rows": rows, "gaps": gaps}


def _print(by: By, groups: Sequence[TraceGroup]) -> None:
    columns: list[By] = [
        name for name in ("hazard", "goal", "fsr", "element", "scenario") if name != by
    ]
    headers = (_title(by), *(_title(name) for name in columns), "Verdicts", "Gaps")
    rows = [
        [
            group.id or "none",
            *(", ".join(group.links[name]) for name in columns),
            listed([f"{count} {word}" for word, count in group.verdicts.items()]),
            _gaps(group.gaps),
        ]
        for group in groups
    ]
    emit_table(headers, rows, sections=range(len(rows)))
    count = len({gap for group in groups for gap in group.gaps})
    emit("No gaps." if not count else f"{count} gaps; every row: --csv or --json.")


def _title(by: By) -> str:
    return "FSR" if by == "fsr" else by.capitalize()


def _gaps(gaps: Sequence[str]) -> str:
    shown = "; ".join(gaps[:_SHOWN_GAPS])
    more = len(gaps) - _SHOWN_GAPS
    return f"{shown}; and {more} more" if more > 0 else shown
