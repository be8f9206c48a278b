"""The table of verdicts that a campaign ends with, the worst first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any, Final

from adeye.cli.output import NONE, clean, emit, emit_table, short, verdict_cell, width

if TYPE_CHECKING:
    from adeye.campaign.summary import CampaignSummary, VerdictLine

WORST_FIRST: Final = (
    "FAIL",
    "ERROR",
    "INVALID",
    "INCONCLUSIVE",
    "NOT_RUN",
    "VACUOUS",
    "PASS",
    None,
)
_SHOWN_TEXT: Final = 60
_WIDE: Final = 145


def ordered(lines: Sequence[VerdictLine]) -> list[VerdictLine]:
    """Sort verdicts: architectures of the gate first, what is mandatory, then the worst."""

    def place(line: VerdictLine) -> tuple[Any, ...]:
        verdict = None if line.verdict is None else str(line.verdict)
        rank = WORST_FIRST.index(verdict)
        return not line.is_gate, line.architecture, not line.mandatory, rank, line.fsr

    return sorted(lines, key=place)


def margin_text(line: VerdictLine) -> str:
    """Write the margin of the worst run with its unit."""
    from adeye.report.words import quantity

    if line.margin is None or not math.isfinite(line.margin):
        return NONE
    return quantity(line.margin, line.unit or "1", signed=True)


def print_verdicts(summary: CampaignSummary) -> None:
    """Print the verdict of every FSR for every architecture, and how to see the worst run."""
    lines = ordered(summary.verdicts)
    for (name, is_gate), group in groupby(lines, lambda line: (line.architecture, line.is_gate)):
        emit(f"\n{clean(name)}{' (gate)' if is_gate else ''}")
        _print_architecture(list(group))
    shown = next((line for line in lines if line.worst_run and str(line.verdict) == "FAIL"), None)
    if shown is not None:
        emit(
            f"\nSee why {clean(shown.architecture)} fails {clean(shown.fsr)}:\n"
            f"  adeye show {short(shown.worst_run)}\n"
            f"  adeye replay {short(shown.worst_run)} --html replay.html"
        )


def _print_architecture(lines: Sequence[VerdictLine]) -> None:
    # On a narrow screen the text would push everything else out of shape.
    has_texts = width() >= _WIDE
    headers = ["FSR", "ASIL", "Verdict", "Exercised", "Worst margin", "Worst run"]
    rows = [
        [
            line.fsr + ("" if line.mandatory else " opt."),
            line.asil,
            verdict_cell(line.verdict),
            line.exercised_text,
            margin_text(line),
            short(line.worst_run),
            *([_cut(line.text)] if has_texts else []),
        ]
        for line in lines
    ]
    headers += ["Requirement"] if has_texts else []
    emit_table(headers, rows, right=("Exercised", "Worst margin"))


def _cut(text: str) -> str:
    line = clean(" ".join(text.split()))
    return line if len(line) <= _SHOWN_TEXT else f"{line[: _SHOWN_TEXT - 1]}…"
