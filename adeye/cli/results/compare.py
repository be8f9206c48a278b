"""``compare|matrix``: architectures on the same test cases; from hazards to runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from adeye.cli import output as out
from adeye.cli.options import Db, Json, complete_campaigns, named_page, option, sizes_of
from adeye.errors import UsageError, amount, suggest
from adeye.report.words import MINUS, counted, number, quantity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.report.comparison.records import Candidate, Comparison, Difference, Pair
    from adeye.report.formats.matrix import By, TraceGroup

# --- ``compare``: architectures of one campaign on the same test cases ----------------------------

_ALL: Final = "all"


def compare(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[ODD|CAMPAIGN] [ARCHITECTURE]...", autocompletion=complete_campaigns
        ),
    ] = None,
    *,
    baseline: Annotated[str | None, option("NAME")] = None,
    confidence: Annotated[float, option("SHARE")] = 0.95,
    objectives: Annotated[str, option("NAMES")] = "failures,availability,cost",
    epsilon: Annotated[list[str] | None, option("NAME=SIZE")] = None,
    html: Annotated[Path | None, option("FILE", callback=named_page)] = None,
    db: Db = None,
    json: Json = False,
) -> None:
    """Compare the architectures of a campaign on the test cases that they share.

    Nothing is executed. Which suite holds, at what cost, where the others fail, what each FSR
    loses or gains, and which sensor saw the object first. Intervals and p-values are printed for a
    random design only; a grid gets counts and worst cases.

    Parameters:
        names: An ODD's file or id, or a campaign by number or digest; default: the latest. Then the
            architectures; default: all.
        baseline: Compare all others with this architecture, not every pair.
        confidence: Coverage of intervals; only a random design has any.
        objectives: What the Pareto front is made of: some of failures, margin, availability, cost;
            the first decides between equals.
        epsilon: Difference of an objective that does not count, such as cost=10; once for each.
        html: Write the comparison as an HTML page.

    Examples:
        adeye compare
        adeye compare odd/motorway_chauffeur.yaml --baseline legacy_camera
        adeye compare 3 camera_radar legacy_camera --objectives failures,cost --epsilon cost=20
    """
    from adeye.answers import compare_campaign
    from adeye.report.comparison.records import CompareOptions

    comparison = compare_campaign(
        db,
        names or (),
        CompareOptions(
            baseline=baseline,
            confidence=confidence,
            objectives=[word for word in map(str.strip, objectives.split(",")) if word],
            epsilon=sizes_of(epsilon or (), "epsilon", "cost=10"),
        ),
        html=html,
    )
    out.emit_found("compare", comparison, print_comparison, json=json)
    if html is not None:
        out.wrote(html)


def print_comparison(comparison: Comparison) -> None:
    """Print a comparison: the overview first, then what differs, then sensors."""
    _print_overview(comparison)
    for statement in comparison.statements:
        out.emit_line(statement)
    for pair in comparison.pairs:
        _print_pair(comparison, pair)
    _print_sensors(comparison)


def _print_overview(comparison: Comparison) -> None:
    headers = [
        "Architecture", "Sensors", "Cost", "Mandatory FSRs", "Failing cases", "Undecided",
        "Worst margin", "No takeover", "Choice", "Not met",
    ]  # fmt: skip
    rows = [
        [
            item.id + (" (gate)" if item.is_gate else ""),
            item.suite or out.NONE,
            out.NONE if item.cost is None else f"{item.cost.total:,g}",
            f"{item.mandatory - len(item.unmet)} of {item.mandatory}",
            f"{counted(item.failing)} of {counted(item.cases)}",
            counted(item.undecided),
            out.NONE if item.worst_margin is None else number(item.worst_margin, signed=True),
            out.NONE if item.availability is None else f"{100.0 * item.availability:.1f} %",
            place_text(item),
            out.listed([*(unmet.text for unmet in item.unmet), *item.refused]),
        ]
        for item in comparison.by_cost
    ]
    out.emit_table(headers, rows, right=headers[2:8])
    if comparison.cheapest:
        out.emit_line(
            f"Cheapest that meets every mandatory FSR: {out.listed(comparison.cheapest)}."
        )
    elif any(item.is_good for item in comparison.candidates):
        out.emit(
            "Which one meets every mandatory FSR at least cost is not known: a cost is missing, or "
            "one that costs no more was not executed to the end."
        )
    else:
        out.emit("No architecture meets every mandatory FSR.")
    for text in comparison.left_out:
        out.emit_line(f"Objective left out: {text}.")
    _print_unexecuted(comparison)


def _print_unexecuted(comparison: Comparison) -> None:
    """Name what no count is about."""
    for item in comparison.by_cost:
        if item.unexecuted:
            out.emit_line(
                f"Not executed of {item.id}: {out.listed(one.text for one in item.unexecuted)}."
            )
    for item in comparison.by_cost:
        if item.left_out:
            out.emit_line(
                f"Left out of {item.id} above: {counted(item.left_out)} of "
                f"{counted(item.cases + item.left_out)} shared test cases, because not all "
                "architectures have executed them."
            )


def place_text(item: Candidate) -> str:
    """Say whether an architecture is worth choosing."""
    if item.is_on_front:
        return "on the front"
    return f"dominated by {item.dominated_by}" if item.dominated_by else out.NONE


def _print_pair(comparison: Comparison, pair: Pair) -> None:

    found = [
        item
        for item in comparison.differences
        if (item.a, item.b) == (pair.a, pair.b)
        and (item.kind == _ALL or item.only_a_fails + item.only_b_fails > 0)
    ]
    shown = [item for item in found if item.is_different]
    still = [item for item in found if item.kind == _ALL and not item.is_different]
    out.emit("")
    out.emit_line(
        f"A = {pair.a}, B = {pair.b}: {counted(pair.pairs)} pairs executed, "
        f"{counted(pair.incomplete)} not; without a partner {counted(pair.only_a)} of A "
        f"and {counted(pair.only_b)} of B."
    )
    if pair.not_comparable:
        out.emit_line(f"Not applicable to one of them: {out.listed(pair.not_comparable)}.")
    if shown:
        _print_differences(shown)
    same = [item.fsr for item in still if not item.undecided]
    if same:
        out.emit_line(f"No difference at all: {out.listed(same)}.")
    unknown = [f"{item.fsr} ({counted(item.undecided)})" for item in still if item.undecided]
    if unknown:
        out.emit_line(
            f"No difference in what is decided, but pairs are undecided: {out.listed(unknown)}."
        )


def _print_differences(shown: Sequence[Difference]) -> None:

    has_inference = any(item.inference is not None for item in shown)
    headers = [
        "FSR", "Where", "Both pass", "Only A fails", "Only B fails", "Both fail", "Vacuous",
        "Undecided", "Failing, B less A",
    ]  # fmt: skip
    inferred = ["Failing points, B less A", "p", "p (Holm)"] if has_inference else []
    margins = ["Mean margin, B less A", "Largest loss", "Worst run of B"]
    rows = []
    for item in shown:
        cells: list[str] = [item.fsr, "all" if item.kind == _ALL else item.cluster]
        counts = (
            item.both_pass, item.only_a_fails, item.only_b_fails, item.both_fail, item.neutral,
            item.undecided,
        )  # fmt: skip
        cells += [counted(count) for count in counts]
        cells.append(out.NONE if item.difference is None else percent(item.difference))
        if has_inference:
            cells += _inference_cells(item)
        margin = item.margin
        if margin is None:
            cells += [out.NONE, out.NONE, out.NONE]
        else:
            mean = quantity(margin.mean, margin.unit, signed=True)
            mean += " (normalised)" if margin.is_normalised else ""
            if margin.interval is not None:
                low, high = margin.interval.low, margin.interval.high
                mean += f" [{quantity(low, '1', signed=True)}, {quantity(high, '1', signed=True)}]"
            cells.append(mean)
            if margin.loss is None:
                cells += ["none", out.NONE]
            else:
                loss = quantity(margin.loss, margin.unit, signed=True)
                cells += [loss, out.short(margin.least_run_b)]
        rows.append(cells)
    out.emit_table(headers + inferred + margins, rows, right=(headers + inferred + margins)[2:-1])


def _inference_cells(item: Difference) -> list[str]:
    said = item.inference
    if said is None:
        return [out.NONE, out.NONE, out.NONE]
    interval = f"[{percent(said.interval.low)}, {percent(said.interval.high)}]"
    return [f"{percent(said.difference)} {interval}", p_text(said.p), p_text(said.p_adjusted)]


def percent(share: float) -> str:
    """Write a difference of shares.

    >>> percent(0.125), percent(0.0)
    ('+12.5 %', '0 %')
    """
    if share == 0.0:
        return "0 %"
    return f"{MINUS if share < 0.0 else '+'}{100.0 * abs(share):.1f} %"


def p_text(p: float) -> str:
    """Write a p-value; a small one never reads as 0.

    >>> p_text(0.0390625), p_text(0.00001)
    ('0.039', '< 0.001')
    """
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def _print_sensors(comparison: Comparison) -> None:

    if comparison.contributions:
        headers = ["Sensor", "With", "Without", "Cost", "Pairs", "Rescued", "Harmed"]
        rows = [
            [
                item.sensor, item.with_it, item.without_it, f"{item.cost:,g}",
                counted(item.pairs), counted(item.rescued), counted(item.harmed),
            ]
            for item in comparison.contributions
        ]  # fmt: skip
        out.emit_table(headers, rows, title="What one sensor adds", right=headers[3:])
    if comparison.sightings:
        headers = ["Architecture", "Sensor", "First", "Same tick", "Only it", "Never", "Lead"]
        sighted = [
            [
                item.architecture, item.sensor,
                f"{counted(item.first)} of {counted(item.runs)}", counted(item.shared),
                counted(item.only), counted(item.never),
                out.NONE if item.lead_s is None else quantity(item.lead_s, "s"),
            ]
            for item in comparison.sightings
        ]  # fmt: skip
        title = "Which sensor detects the object that matters first"
        out.emit_table(headers, sighted, title=title, right=headers[2:])


# --- ``matrix``: the traceability matrix, from hazards to verdicts and back -----------------------


_SHOWN_GAPS = 3


def matrix(
    campaign: Annotated[
        str | None, typer.Argument(metavar="[CAMPAIGN|ODD]", autocompletion=complete_campaigns)
    ] = None,
    *,
    by: Annotated[str, option("COLUMN", env="MATRIX_BY")] = "hazard",
    db: Db = None,
    csv: bool = False,
    json: Json = False,
) -> None:
    """Show what follows from what: hazardous event, goal, FSR, element, scenario, verdict.

    Forwards it says what a hazard is answered by; backwards, with --by scenario or --by element,
    what something is there for. A gap is where the chain ends before a PASS: a hazard without a
    goal, a goal without an FSR, an element or scenario that nothing needs, and every verdict that
    is not PASS. --csv and --json have one row for each way through the chain.

    Parameters:
        campaign: Number of the campaign, beginning of its digest, id or file of its ODD; default:
            the latest.
        by: What it begins with: hazard, goal, fsr, element, measure, scenario or architecture.
        csv: Print every row of the chain as comma-separated values.

    Examples:
        adeye matrix
        adeye matrix --by scenario
        adeye matrix 3 --csv > matrix.csv
    """
    from adeye.report.formats.matrix import BY, grouped, matrix_of, render_csv
    from adeye.reporting import read_report

    if by not in BY:
        raise UsageError(f"--by {out.clean(by)!r} is no column", remedy=suggest(by, BY))
    if csv and json:
        raise UsageError("--csv and --json exclude each other", remedy="Give one of the two.")
    column: By = by
    report = read_report(db, campaign)
    rows = matrix_of(report, column)
    if csv:
        out.emit_document(out.clean(render_csv(rows, column), lines=True))
    elif json:
        gaps = sum(bool(row.gap) for row in rows)
        content = {"campaign": report.campaign, "by": column, "rows": rows, "gaps": gaps}
        out.emit_json("matrix", content)
    else:
        code = int(report.exit_code)
        answer = f"The gate answers {code}: {report.message}" if code or report.touching else ""
        _print(column, grouped(rows, column), answer)


def _print(by: By, groups: Sequence[TraceGroup], answer: str) -> None:
    columns: list[By] = [
        name for name in ("hazard", "goal", "fsr", "element", "scenario") if name != by
    ]
    headers = (_title(by), *(_title(name) for name in columns), "Verdicts", "Gaps")
    rows = [
        [
            group.id or "none",
            *(", ".join(group.links[name]) for name in columns),
            out.listed([f"{count} {word}" for word, count in group.verdicts.items()]),
            _gaps(group.gaps),
        ]
        for group in groups
    ]
    out.emit_table(headers, rows, sections=range(len(rows)))
    count = len({gap for group in groups for gap in group.gaps})
    out.emit("No gaps." if not count else f"{amount(count, 'gap')}; every row: --csv or --json.")
    if answer:
        out.emit_prose(out.clean(answer))


def _title(by: By) -> str:
    return "FSR" if by == "fsr" else by.capitalize()


def _gaps(gaps: Sequence[str]) -> str:
    shown = "; ".join(gaps[:_SHOWN_GAPS])
    more = len(gaps) - _SHOWN_GAPS
    return f"{shown}; and {more} more" if more > 0 else shown
