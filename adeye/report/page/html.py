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
from adeye.judge.verdict import Verdict
from adeye.outputs import write_atomically
from adeye.report.comparison.records import Comparison
from adeye.report.credibility import NOT_RUN
from adeye.report.model.report import Report
from adeye.report.page.charts import draw_bars, draw_front, draw_trade
from adeye.report.page.replay import pack_replay, script_text
from adeye.report.page.suites import suite_views
from adeye.report.page.views import arrange, filters, goal_structure, ways_of
from adeye.report.templates import environment
from adeye.report.words import MEANINGS

if TYPE_CHECKING:
    from jinja2 import Environment

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
)


def render(report: Report, *, max_bytes: int = MAX_BYTES) -> str:
    """Write a report as one HTML page.

    Args:
        report: The report.
        max_bytes: Size that the page keeps to by leaving out replays, the last first; the page
            lists what it left out with the commands that show it.

    Returns:
        The page, the same for the same report.
    """
    packed = [script_text(pack_replay(replay)) for replay in report.replays]
    page = _fill(report, ())
    room = max_bytes - len(page.encode())
    # Besides its own data, a replay has an entry in the list, with its texts.
    sizes = [len(text.encode()) + 4096 for text in packed]
    shown = len(packed)
    while shown > 0 and sum(sizes[:shown]) > room:
        shown -= 1
    return _fill(report, tuple(packed[:shown]))


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


def write_html(report: Report, path: Path, *, max_bytes: int = MAX_BYTES) -> None:
    """Write the page to a file, whole or not at all.

    Raises:
        PlatformError: The file system refused.
    """
    write_atomically(render(report, max_bytes=max_bytes).encode(), path)


def _fill(report: Report, packed: tuple[str, ...]) -> str:
    script, style = assets()
    page = arrange(report)
    shown = report.replays[: len(packed)]
    return _filled(
        "page.html.j2",
        report=report,
        page=page,
        views=suite_views(report.suites),
        kind_words=WORDS,
        ways=ways_of(report),
        gsn=goal_structure(report),
        verdicts=list(Verdict),
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
