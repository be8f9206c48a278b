"""The goal structure as Mermaid text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.report.formats.gsn import argument_of, quoted, render_mermaid
from tests.report.fake import build_report

if TYPE_CHECKING:
    from adeye.report.model.report import Report


def test_every_node_and_relation_is_one_line(report: Report) -> None:
    argument = argument_of(report)
    lines = render_mermaid(argument).splitlines()
    assert lines[0] == "flowchart LR"
    assert sum(" --> " in line or " -.- " in line for line in lines) == len(argument.edges)
    assert sum("<b>" in line for line in lines) == len(argument.nodes)
    assert sum(line.startswith("  class n") for line in lines) == len(argument.nodes)


def test_no_text_ends_its_label() -> None:
    text = render_mermaid(argument_of(build_report('"]; <script>\n#1')))
    assert "<script>" not in text
    assert all(line.count('"') in {0, 2} for line in text.splitlines())


def test_ampersand_is_not_read_as_a_code() -> None:
    assert quoted("a & b") == "a #amp; b"
