"""The traceability matrix both ways and the goal structure, as the page shows them."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from adeye.evaluation.verdict import Verdict
from adeye.report.gsn import argument_of
from adeye.report.gsn_drawing import render_svg
from adeye.report.matrix import By, grouped, matrix_of
from adeye.report.page import SEVERITY

if TYPE_CHECKING:
    from adeye.report.matrix import TraceGroup
    from adeye.report.model import Report

_NAMESPACE: Final = ' xmlns="http://www.w3.org/2000/svg"'
_WAYS: Final[tuple[tuple[By, str, tuple[By, ...]], ...]] = (
    ("hazard", "Forwards: what answers a hazardous event", ("goal", "fsr", "element", "scenario")),
    ("element", "Backwards: what an element is there for", ("fsr", "goal", "hazard", "scenario")),
    ("scenario", "Backwards: what a scenario is there for", ("fsr", "goal", "hazard", "element")),
)


@dataclass(frozen=True, slots=True)
class TraceLine:
    """One thing of a matrix, ready for the template.

    Attributes:
        id: Of the thing; empty for what belongs to none.
        links: Ids by the columns of the way.
        verdicts: Verdict and how many cells have it, the worst first; None is "not applicable".
        gaps: What is missing, each once.
    """

    id: str
    links: tuple[tuple[str, ...], ...]
    verdicts: tuple[tuple[Verdict | None, int], ...]
    gaps: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TraceWay:
    """The matrix from one of its columns.

    Attributes:
        by: The column that the rows are about.
        title: For people.
        columns: The others that are shown.
        lines: One for each thing.
    """

    by: By
    title: str
    columns: tuple[By, ...]
    lines: tuple[TraceLine, ...]


def ways_of(report: Report) -> tuple[TraceWay, ...]:
    """Turn the matrix of a report: from hazardous events on, and back from what was built."""
    return tuple(
        TraceWay(
            by,
            title,
            columns,
            tuple(_line(group, columns) for group in grouped(matrix_of(report, by), by)),
        )
        for by, title, columns in _WAYS
    )


def _line(group: TraceGroup, columns: tuple[By, ...]) -> TraceLine:
    counts = [
        (None if name == "NOT_APPLICABLE" else Verdict(name), count)
        for name, count in group.verdicts.items()
    ]
    counts.sort(key=lambda item: SEVERITY.index(item[0]))
    links = tuple(group.links[column] for column in columns)
    return TraceLine(group.id, links, tuple(counts), group.gaps)


def goal_structure(report: Report) -> str:
    """Draw the argument of a report as an SVG that can stand inside of a page.

    Its ids get a beginning of their own, so that none is one of the page.
    """
    # Inside of HTML an SVG needs no namespace, and the page names no address.
    drawing = render_svg(argument_of(report)).replace(_NAMESPACE, "", 1)
    root = ET.fromstring(drawing)  # noqa: S314 - our own drawing
    for node in root.iter():
        if "id" in node.attrib:
            node.set("id", f"gsn-{node.get('id')}")
    return ET.tostring(root, encoding="unicode")
