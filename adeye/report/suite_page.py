"""Sensor suites as an HTML page of their own that needs nothing else: no network, no script."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.outputs import write_atomically
from adeye.report.html import environment, style_policy, styles
from adeye.report.suites import LOSS_HEADS, SENSOR_HEADS, SPEED_HEADS, ZONE_HEADS, suite_views

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from adeye.evaluation.suite.results import Suite


def render_suites(suites: Sequence[Suite], *, title: str = "") -> str:
    """Write the analyses as one page that needs no network.

    Args:
        suites: At least one.
        title: Of the ODD, if there is one.
    """
    style = styles()
    text: str = (
        environment()
        .get_template("suites_page.html.j2")
        .render(
            title=title,
            views=suite_views(suites, every=True),
            notes=list(dict.fromkeys(note for suite in suites for note in suite.notes)),
            speed_heads=SPEED_HEADS,
            zone_heads=ZONE_HEADS,
            loss_heads=LOSS_HEADS,
            sensor_heads=SENSOR_HEADS,
            # The template takes the style as it is: it is our own.
            style=style,
            policy=style_policy(style),
        )
    )
    return text


def write_suites(suites: Sequence[Suite], path: Path, *, title: str = "") -> None:
    """Write the page to a file, whole or not at all.

    Raises:
        PlatformError: The file system refused.
    """
    write_atomically(render_suites(suites, title=title).encode(), path)
