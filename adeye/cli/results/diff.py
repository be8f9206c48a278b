"""``diff``: what changed from one campaign to another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Final

import typer

from adeye.cli import options as opt
from adeye.cli import output as out
from adeye.errors import UsageError, amount
from adeye.report.words import counted, quantity, verdict_word

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from adeye.report.gate.difference import (
        CaseChange,
        Difference,
        EditTold,
        Flip,
        FsrChange,
        Move,
        Rejudged,
    )
    from adeye.report.model.part import Margin

_Old = Annotated[str | None, typer.Argument(metavar="[OLD]", autocompletion=opt.complete_campaigns)]
_New = Annotated[str | None, typer.Argument(metavar="[NEW]", autocompletion=opt.complete_campaigns)]
_MOST_ROWS: Final = 50
"""Rows of one table; all of them are in the JSON document."""
_MOST_TEXT: Final = 200


def diff(
    old: _Old = None,
    new: _New = None,
    *,
    markdown: bool = False,
    db: opt.Db = None,
    json: opt.Json = False,
) -> None:
    """Tell what changed from one campaign to another. Nothing is executed.

    What was edited in the files; test cases that came, went, or are made otherwise, and of what;
    FSRs with their old and new text, and what the old results say under the new one, as far as they
    were judged by it; verdicts that are others, with both margins; and margins that moved by more
    than the gate of the new campaign tolerates.

    A campaign is named by its number or digest, by the id or file of its ODD, as latest, or as
    @{-1}, which is the one before the latest of that ODD.

    Parameters:
        old: The campaign of before; default: the one before NEW, of the same ODD.
        new: The campaign of after; default: the latest.
        markdown: Print Markdown, as for a comment on a change.

    Examples:
        adeye diff
        adeye diff 3 5 --json
        adeye diff '@{-1}' latest --markdown
    """
    from adeye.answers import diff_campaigns

    if markdown and json:
        raise UsageError("--markdown and --json exclude each other", remedy="Give one of the two.")
    found = diff_campaigns(db, old, new)
    out.emit_found("diff", found, _print_markdown if markdown else _print, json=json)


@dataclass(frozen=True)
class _Section:
    """A table of what changed, for every form of it."""

    title: str
    headers: Sequence[str]
    rows: Sequence[Sequence[str]]
    right: Sequence[str] = ()

    @property
    def left_out(self) -> int:
        """Rows that are not shown."""
        return max(0, len(self.rows) - _MOST_ROWS)


def _print(found: Difference) -> None:
    out.emit_prose(out.clean(_head(found)))
    if found.is_empty:
        out.emit("Nothing differs.")
    for section in _sections(found):
        rows = section.rows[:_MOST_ROWS]
        out.emit_table(section.headers, rows, title=section.title, right=section.right)
        if section.left_out:
            out.emit(f"and {counted(section.left_out)} more; all of them: --json.")


def _print_markdown(found: Difference) -> None:
    lines = [f"### {_escaped(_head(found))}"]
    if found.is_empty:
        lines += ["", "Nothing differs."]
    for section in _sections(found):
        rule = ["--:" if name in section.right else "---" for name in section.headers]
        table = [section.headers, rule, *section.rows[:_MOST_ROWS]]
        lines += ["", f"**{_escaped(section.title)}**", ""]
        lines += [f"| {' | '.join(map(_escaped, row))} |" for row in table]
        if section.left_out:
            lines += ["", f"and {counted(section.left_out)} more"]
    out.emit_document(out.clean("\n".join(lines), lines=True) + "\n")


def _escaped(text: str) -> str:
    """Keep a cell one cell, and what is in it text."""
    flat = " ".join(text.split())
    for mark in ("\\", "|", "<", "*", "`", "["):
        flat = flat.replace(mark, f"\\{mark}")
    return flat


def _head(found: Difference) -> str:
    sides = [
        f"campaign {side.number} of {side.odd} ({out.short(side.campaign)})"
        for side in (found.old, found.new)
    ]
    return f"From {sides[0]} to {sides[1]}"


def _sections(found: Difference) -> Iterator[_Section]:
    sections = (
        _edited(found.edits, "Edited"),
        _fsrs(found.fsrs),
        _rejudged(found.fsrs),
        _cases(found.cases),
        _flips(found.flips),
        _moves(found.moves),
    )
    yield from (section for section in sections if section.rows)


def _edited(edits: Sequence[EditTold], title: str) -> _Section:
    rows = [[edit.path, _text(edit.old), _text(edit.new)] for edit in edits]
    return _Section(title, ("Where", "Old", "New"), rows)


def _text(text: str | None) -> str:
    if text is None:
        return out.NONE
    return text if len(text) <= _MOST_TEXT else f"{text[: _MOST_TEXT - 1]}…"


def _fsrs(changes: Sequence[FsrChange]) -> _Section:
    rows: list[list[str]] = []
    for item in changes:
        if item.kind != "changed":
            sides = (item.old_measure or out.NONE, item.new_measure or out.NONE)
            rows.append([item.fsr, item.kind, *sides])
        rows += [[item.fsr, it.path, _text(it.old), _text(it.new)] for it in item.edits]
    return _Section("FSRs", ("FSR", "What", "Old", "New"), rows)


def _rejudged(changes: Sequence[FsrChange]) -> _Section:
    rows = [
        [item.fsr, told.architecture, _counts(told.before), _counts(told.under_new), _worst(told)]
        for item in changes
        for told in item.rejudged
    ]
    title = "What the old results say under the new FSR"
    return _Section(
        title, ("FSR", "Architecture", "As they were", "Under the new one", "Worst margin"), rows
    )


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{word} {counted(count)}" for word, count in counts.items())


def _worst(told: Rejudged) -> str:
    text = f"{_margin(told.worst)} {out.short(told.run)}" if told.worst else out.NONE
    if told.not_judged:
        text += f"; {amount(told.not_judged, 'result is', 'results are')} not judged by it"
    return text


def _cases(changes: Sequence[CaseChange]) -> _Section:
    from adeye.report.gate.difference import grouped

    rows = [
        [item.kind, counted(count), item.case.text, ", ".join(item.why)]
        for item, count in grouped(changes)
    ]
    return _Section(
        "Test cases", ("Change", "Count", "The first", "What of them"), rows, ("Count",)
    )


def _flips(flips: Sequence[Flip]) -> _Section:
    rows = [
        [
            item.fsr, item.case.text, f"{verdict_word(item.old)} → {verdict_word(item.new)}",
            f"{_margin(item.old_margin)} → {_margin(item.new_margin)}", out.short(item.new_run),
        ]
        for item in flips
    ]  # fmt: skip
    return _Section("Verdicts", ("FSR", "Test case", "Verdict", "Margin", "Run"), rows)


def _moves(moves: Sequence[Move]) -> _Section:
    rows = [
        [
            item.fsr, item.case.text, f"{counted(item.lost)} of {counted(item.pairs)}",
            counted(item.gained),
            f"{quantity(item.old_margin, item.unit, signed=True)} → "
            f"{quantity(item.new_margin, item.unit, signed=True)}",
            out.short(item.new_run),
        ]
        for item in moves
    ]  # fmt: skip
    headers = ("FSR", "Most in", "Lost", "Gained", "Margin", "Run")
    return _Section("Margins that moved", headers, rows, ("Lost", "Gained"))


def _margin(margin: Margin | None) -> str:
    return out.NONE if margin is None else quantity(margin.value, margin.unit, signed=True)
