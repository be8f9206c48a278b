"""``stl``: evaluate a formula of signal temporal logic on a table."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from adeye.cli.options import Json, named, option, write_rows
from adeye.cli.output import emit_fields, emit_found, verdict_cell, wrote
from adeye.errors import UsageError
from adeye.judge.verdict import Verdict, exit_of_verdict

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from adeye.judge.evaluate import Judgement
    from adeye.judge.stl.table import JudgedTable


def stl(  # noqa: PLR0917 - options
    formula: Annotated[str, typer.Argument(metavar="FORMULA", show_default=False)],
    table: Annotated[Path, typer.Argument(metavar="TABLE", show_default=False)],
    time: Annotated[str | None, option("COLUMN")] = None,
    unit: Annotated[list[str] | None, option("COLUMN=UNIT")] = None,
    words: Annotated[list[str] | None, option("COLUMN=WORD,WORD")] = None,
    set_: Annotated[list[str] | None, option("--set NAME=VALUE")] = None,
    horizon: Annotated[str | None, option("TIME")] = None,
    output: Annotated[Path | None, option("--output -o FILE", callback=named)] = None,
    json: Json = False,
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

    declared = _pairs("--words", words)
    reading = Reading(
        time=time,
        units=_pairs("--unit", unit),
        words={name: [word.strip() for word in text.split(",")] for name, text in declared.items()},
        parameters=_pairs("--set", set_),
        horizon=horizon,
    )
    found = judge_table(formula, read_table(table), reading)
    if output is not None:
        _write(found, output)
    emit_found("stl", found, _print, json=json, document=_document)
    if output is not None:
        wrote(output)
    raise typer.Exit(exit_of_verdict(found.verdict))


def _pairs(option: str, texts: Sequence[str] | None) -> dict[str, str]:
    pairs: dict[str, str] = {}
    for text in texts or ():
        name, sign, value = (part.strip() for part in text.partition("="))
        if not (name and sign and value):
            raise UsageError(f"{option} {text!r} is no pair", remedy="Write NAME=VALUE.")
        if name in pairs:
            raise UsageError(f"{option} names {name!r} twice", remedy="Give it once.")
        pairs[name] = value
    return pairs


def _print(found: JudgedTable) -> None:
    item = found.judgement
    unit = "" if item.unit in {None, "1"} else f" {item.unit}"
    at = "" if item.time_s is None else f" at {item.time_s:.15g} s"
    shown = {
        "Verdict": verdict_cell(item.verdict),
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
    emit_fields(shown)


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


def _document(found: JudgedTable) -> dict[str, object]:
    item = found.judgement
    return {
        "formula": found.formula,
        "verdict": item.verdict,
        "is_exercised": item.is_exercised,
        "robustness": [item.robustness_low, item.robustness_high],
        "robustness_status": _statuses((item.robustness_low, item.robustness_high)),
        "predicate": item.predicate,
        "signal": item.signal,
        "time_s": item.time_s,
        "value": item.value,
        "threshold": item.threshold,
        "difference": _gap(item),
        "unit": item.unit,
        "detail": item.detail,
        "parameters": found.parameters,
        "step_s": found.step_s,
        "horizon_s": found.horizon_s,
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
    write_rows(("time_s", "robustness_low", "robustness_high"), cells, path)
