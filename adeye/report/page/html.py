"""The report as one HTML file that needs nothing else: no network, no server, no other file.

Text comes into the page escaped; data for the script comes as inert JSON; scripts and styles run
only if they are the shipped ones, by their hash in the content security policy.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from adeye.analysis.dependence import WORDS
from adeye.analysis.suite.records import Suite
from adeye.fields import fields_of
from adeye.judge.verdict import ExitCode, Verdict
from adeye.outputs import write_atomically
from adeye.report.comparison.records import Comparison
from adeye.report.credibility import NOT_RUN
from adeye.report.formats.matrix import grouped, matrix_of
from adeye.report.model.report import Report
from adeye.report.page.charts import draw_bars, draw_front, draw_trade
from adeye.report.page.replay import pack_replay, script_text
from adeye.report.page.suites import suite_views
from adeye.report.templates import environment
from adeye.report.words import MEANINGS

if TYPE_CHECKING:
    from jinja2 import Environment


import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from adeye.analysis.suite.records import matching
from adeye.judge.verdict import WORST_FIRST
from adeye.report import words
from adeye.report.claims import Claim, refusals_of
from adeye.report.formats.gsn import argument_of, drawing_of
from adeye.report.formats.matrix import By
from adeye.report.model.report import Architecture, Cell, Fsr

# --- What the page shows, in the order in which it shows it: worst first --------------------------

_NO_MARGIN = float("inf")


@dataclass(frozen=True, slots=True)
class Badge:
    """A verdict as a sign, a word and a class of the style sheet."""

    word: str
    symbol: str
    style: str


@dataclass(frozen=True, slots=True)
class ArchitectureCard:
    """One architecture in the headline."""

    architecture: Architecture
    badge: Badge
    counts: tuple[tuple[Badge, int], ...]
    """Mandatory FSRs per verdict."""
    worst: str
    cost: str


@dataclass(frozen=True, slots=True)
class MatrixCell:
    """One cell of the verdict matrix."""

    number: int
    architecture: str
    scenario: str
    """Empty for all scenarios together."""
    badge: Badge
    margin: str
    exercised: str
    hint: str
    run: str


@dataclass(frozen=True, slots=True)
class MatrixRow:
    """One FSR of the verdict matrix."""

    number: int
    """Its place in the concept, from 1."""
    fsr: Fsr
    cells: tuple[MatrixCell, ...]


@dataclass(frozen=True, slots=True)
class Page:
    """The matrix of a report, ready for the template and the script."""

    gate: Badge
    cards: tuple[ArchitectureCard, ...]
    architectures: tuple[Architecture, ...]
    """Those in the gate first."""
    rows: tuple[MatrixRow, ...]
    details: tuple[dict[str, Any], ...]
    """What the script shows for each cell, by its number."""


def badge(verdict: Verdict | None) -> Badge:
    """Return the sign, word and style class of a verdict; None is "not applicable"."""
    style = "NOT_APPLICABLE" if verdict is None else verdict.value
    return Badge(words.verdict_word(verdict), words.SYMBOLS[verdict], style)


def arrange(report: Report) -> Page:
    """Put a report into the order of the page.

    Rows are FSRs, the most urgent for the gate first, then for the compared architectures.
    """
    architectures = report.gate_first
    fsrs = report.urgent_first(
        (item for item in architectures if item.is_gate),
        (item for item in architectures if not item.is_gate),
    )
    rows: list[MatrixRow] = []
    details: list[dict[str, Any]] = []
    for fsr in fsrs:
        cells: list[MatrixCell] = []
        for architecture in architectures:
            for scenario in (None, *(item.id for item in report.scenarios)):
                cell = report.cell(fsr.id, architecture.id, scenario)
                cells.append(_matrix_cell(len(details), fsr, architecture, scenario, cell))
                details.append(_detail(fsr, architecture, scenario, cell))
        rows.append(MatrixRow(report.fsrs.index(fsr) + 1, fsr, tuple(cells)))
    cards = tuple(_card(report, architecture) for architecture in architectures)
    gates = [report.verdict_of(item.id) for item in architectures if item.is_gate]
    gate = min(gates, key=WORST_FIRST.index) if gates else Verdict.NOT_RUN
    code = report.exit_code
    if code is ExitCode.INTEGRITY or (code is not ExitCode.OK and gate is Verdict.PASS):
        # What the cells tell may be what somebody wrote there, or the gate refuses what they do
        # not tell, as a part that failed.
        gate = Verdict.FAIL if code is ExitCode.FAILED else Verdict.ERROR
    return Page(badge(gate), cards, tuple(architectures), tuple(rows), tuple(details))


def filters() -> dict[str, Any]:
    """Functions that the template calls."""
    return {
        "badge": badge,
        "binding": words.binding_sentence,
        "margin": words.margin_text,
        "axis_end": axis_end,
        "refusals_of": refusals_of,
        "worst_first": worst_first,
        "unit": words.unit_text,
        "degrees": math.degrees,
        "matching": matching,
        **fields_of(words, "counted", "number", "quantity", "metres", "percent"),
        **fields_of(words, "forward_text", "left_speed", "speed_text"),
    }


def _robustness(cell: Cell | None) -> float:
    if cell is None or cell.margin is None or cell.margin.robustness is None:
        return _NO_MARGIN
    return cell.margin.robustness


def _matrix_cell(
    position: int, fsr: Fsr, architecture: Architecture, scenario: str | None, cell: Cell | None
) -> MatrixCell:
    is_judged = scenario is None or not fsr.scenarios or scenario in fsr.scenarios
    verdict = Verdict.NOT_RUN if cell is None and is_judged else None
    mark = badge(verdict if cell is None else cell.verdict)
    if cell is None and not is_judged:
        mark = Badge("not judged here", words.SYMBOLS[None], "NOT_APPLICABLE")
    place = "all scenarios" if scenario is None else scenario
    hint = f"{fsr.id}, {architecture.id}, {place}: {mark.word}"
    if cell is not None and cell.binding is not None:
        hint += f"\n{words.binding_sentence(cell.binding)}"
    if cell is not None:
        hint += f"\n{cell.command}"
    return MatrixCell(
        number=position,
        architecture=architecture.id,
        scenario=scenario or "",
        badge=mark,
        # Beside any other verdict a margin would read as if it meant something.
        margin=words.margin_text(cell)
        if cell is not None and cell.verdict in {Verdict.PASS, Verdict.FAIL}
        else "",
        exercised="" if cell is None else cell.exercised_text.replace(" of ", "/"),
        hint=hint,
        run="" if cell is None or cell.worst_run is None else cell.worst_run,
    )


def _detail(
    fsr: Fsr, architecture: Architecture, scenario: str | None, cell: Cell | None
) -> dict[str, Any]:
    lines: list[tuple[str, str]] = []
    if cell is None:
        lines.append(("Runs", "no result is recorded here"))
    else:
        counts = [
            f"{words.counted(runs)} {words.verdict_word(verdict)}"
            for verdict, runs in cell.counts.items()
        ]
        lines.append(("Runs", f"{words.counted(cell.runs)}: " + (", ".join(counts) or "none")))
        lines.append(("Exercised", cell.exercised_text))
        if cell.margin is not None:
            text = words.quantity(cell.margin.value, cell.margin.unit, signed=True)
            if cell.margin.robustness is not None:
                text += f" (robustness {words.number(cell.margin.robustness, signed=True)})"
            lines.append(("Worst margin", text))
        if cell.binding is not None:
            lines.append(("Binding predicate", words.binding_sentence(cell.binding)))
        if cell.worst_run is not None:
            lines.append(("Worst run", cell.worst_run))
        if cell.note:
            lines.append(("Note", cell.note))
    return {
        "title": f"{fsr.id} \N{MIDDLE DOT} {architecture.id} \N{MIDDLE DOT} "
        f"{scenario or 'all scenarios'}",
        "style": badge(Verdict.NOT_RUN if cell is None else cell.verdict).style,
        "text": fsr.text,
        "lines": lines,
        "run": "" if cell is None else cell.worst_run or "",
        "time": None if cell is None or cell.binding is None else cell.binding.time_s,
        "command": "" if cell is None else cell.command,
    }


def _card(report: Report, architecture: Architecture) -> ArchitectureCard:
    cells = [report.cell(fsr.id, architecture.id) for fsr in report.fsrs if fsr.mandatory]
    states = Counter(Verdict.NOT_RUN if cell is None else cell.verdict for cell in cells)
    counts = tuple((badge(state), states[state]) for state in WORST_FIRST if states[state])
    worst = min((cell for cell in cells if cell is not None), key=_robustness, default=None)
    text = ""
    if worst is not None and _robustness(worst) < _NO_MARGIN:
        text = f"{worst.fsr} {words.margin_text(worst) or words.verdict_word(worst.verdict)}"
    cost = "" if architecture.cost is None else f"{architecture.cost:,g}"
    verdict = report.verdict_of(architecture.id)
    return ArchitectureCard(architecture, badge(verdict), counts, text, cost)


# --- What the page shows of confidence ------------------------------------------------------------


def axis_end(said: Sequence[Claim]) -> float:
    """Choose a round end that every bound is left of: 1, 2 or 5 times a power of ten, at most 1."""
    largest = max((end for item in said for end in _ends(item)), default=0.0)
    if largest <= 0.0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(largest))
    end = next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= largest)
    return min(1.0, end)


def _ends(claim: Claim) -> Iterator[float]:
    for value in (claim.share, claim.upper):
        if value is not None:
            yield value
    for span in (claim.interval, claim.upper_varied):
        if span is not None:
            yield span.high


# --- The traceability matrix both ways and the goal structure, as the page shows them -------------

WAYS: Final[tuple[tuple[By, str, tuple[By, ...]], ...]] = (
    ("hazard", "Forwards: what answers a hazardous event", ("goal", "fsr", "element", "scenario")),
    ("element", "Backwards: what an element is there for", ("fsr", "goal", "hazard", "scenario")),
    ("scenario", "Backwards: what a scenario is there for", ("fsr", "goal", "hazard", "element")),
)
"""Columns that the matrix is read from, with a title and the others that are shown."""


def worst_first(verdicts: Mapping[str, int]) -> list[tuple[Verdict | None, int]]:
    """List verdicts with how many cells have each, the worst first; None is "not applicable"."""
    counts = [
        (None if name == "NOT_APPLICABLE" else Verdict(name), count)
        for name, count in verdicts.items()
    ]
    return sorted(counts, key=lambda item: WORST_FIRST.index(item[0]))


def goal_structure(report: Report) -> str:
    """Draw the argument of a report as an SVG that can stand inside of a page.

    Its ids get a beginning of their own, so that none is one of the page.
    """
    return drawing_of(argument_of(report), "gsn-")


# --- The report as one HTML file that needs nothing else: no network, no server, no other file ----

MAX_BYTES: Final = 10_000_000
"""Largest page; replays that do not fit are left out and listed, the last first."""

SCRIPTS: Final = (
    "decode.js",
    "palette.js",
    "world.js",
    "scene.js",
    "timeline.js",
    "plots.js",
    "readout.js",
    "player.js",
    "page.js",
)
STYLES: Final = (
    "page.css",
    "tables.css",
    "compare.css",
    "assessment.css",
    "player.css",
    "suites.css",
    "faults.css",
    "verification.css",
    "evidence.css",
    "where.css",
)


def render(report: Report, *, max_bytes: int = MAX_BYTES, is_of_run: bool = False) -> str:
    """Write a report as one HTML page.

    Args:
        report: The report.
        is_of_run: Whether the page is about its one replay, which then comes first.
        max_bytes: Size that the page keeps to by leaving out replays, the last first; the page
            lists what it left out with the commands that show it.

    Returns:
        The page, the same for the same report.
    """
    packed = [script_text(pack_replay(replay)) for replay in report.replays]
    page = _fill(report, (), is_of_run=is_of_run)
    room = max_bytes - len(page.encode())
    # Besides its own data, a replay has an entry in the list, with its texts.
    sizes = [len(text.encode()) + 4096 for text in packed]
    shown = len(packed)
    while shown > 0 and sum(sizes[:shown]) > room:
        shown -= 1
    return _fill(report, tuple(packed[:shown]), is_of_run=is_of_run)


def render_comparison(comparison: Comparison) -> str:
    """Write a comparison as an HTML page of its own, the same for the same comparison."""
    _, style = assets()
    return _filled(
        "compare.html.j2",
        comparison=comparison,
        front=draw_front(comparison),
        policy=_policy("", style),
        style=style,
    )


def write_html(
    report: Report, path: Path, *, max_bytes: int = MAX_BYTES, is_of_run: bool = False
) -> None:
    """Write the page to a file, whole or not at all; see ``render``.

    Raises:
        PlatformError: The file system refused.
    """
    page = render(report, max_bytes=max_bytes, is_of_run=is_of_run)
    write_atomically(page.encode(), path)


def _fill(report: Report, packed: tuple[str, ...], *, is_of_run: bool) -> str:
    script, style = assets()
    page = arrange(report)
    shown = report.replays[: len(packed)]
    return _filled(
        "page.html.j2",
        report=report,
        is_of_run=is_of_run,
        page=page,
        views=suite_views(report.suites),
        kind_words=WORDS,
        ways=WAYS,
        traced=lambda by: grouped(matrix_of(report, by), by),
        gsn=goal_structure(report),
        verdicts=list(Verdict),
        fail=Verdict.FAIL,
        meanings=MEANINGS,
        serving=lambda goal: [fsr for fsr in report.fsrs if goal in fsr.goals],
        policy=_policy(script, style),
        # The template takes these as they are: the assets are our own, and script_text leaves
        # no markup in the data.
        script=script,
        style=style,
        details=script_text(page.details),
        front=None if report.comparison is None else draw_front(report.comparison),
        bars=None if report.faults is None else draw_bars(report.faults),
        trades=[] if report.faults is None else [(c, draw_trade(c)) for c in report.faults.curves],
        self_test=NOT_RUN if report.self_test is None else report.self_test.text,
        replays=list(zip(shown, packed, strict=True)),
        left_out=report.replays[len(packed) :],
    )


def _filled(template: str, **content: Any) -> str:
    """Return what a template makes of its content."""
    text: str = _pages().get_template(template).render(content)
    return text


@cache
def _pages() -> Environment:
    made = environment("web")
    made.globals.update(filters())
    return made


@cache
def assets() -> tuple[str, str]:
    """Read the script and the style sheet of the page."""
    folder = resources.files("adeye.report") / "web"
    parts = [(folder / name).read_text("utf-8") for name in SCRIPTS]
    script = '(() => {\n"use strict";\n' + "\n".join(parts) + "})();\n"
    return script, styles()


@cache
def styles() -> str:
    """Read the style sheet of every page."""
    folder = resources.files("adeye.report") / "web"
    return "\n".join((folder / name).read_text("utf-8") for name in STYLES)


def _policy(script: str, style: str) -> str:
    return f"script-src {_source(script)}; {style_policy(style)}"


def style_policy(style: str) -> str:
    """Write the policy of a page that has this style and runs no script."""
    return (
        f"default-src 'none'; style-src {_source(style)}; img-src data:; base-uri 'none'; "
        "form-action 'none'"
    )


def _source(text: str) -> str:
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    return f"'sha256-{digest}'"


# --- Sensor suites as an HTML page of their own that needs nothing else: no network, no script ----


def render_suites(suites: Sequence[Suite], *, title: str = "") -> str:
    """Write the analyses as one page that needs no network.

    Args:
        suites: At least one.
        title: Of the ODD, if there is one.
    """
    style = styles()
    return _filled(
        "suites_page.html.j2",
        title=title,
        views=suite_views(suites, every=True),
        notes=list(dict.fromkeys(note for suite in suites for note in suite.notes)),
        # The template takes the style as it is: it is our own.
        style=style,
        policy=style_policy(style),
    )


def write_suites(suites: Sequence[Suite], path: Path, *, title: str = "") -> None:
    """Write the page to a file, whole or not at all.

    Raises:
        PlatformError: The file system refused.
    """
    write_atomically(render_suites(suites, title=title).encode(), path)
