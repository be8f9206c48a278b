"""The drawing of a goal structure: everything is in it, nothing overlaps."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from itertools import combinations
from typing import TYPE_CHECKING

from adeye.report.formats.gsn import Box, argument_of, place_boxes, render_svg
from tests.report.fake import build_report

if TYPE_CHECKING:
    from adeye.report.model.report import Report

SVG = "{http://www.w3.org/2000/svg}"


def overlap(first: Box, second: Box) -> bool:
    across = first.x < second.x + second.width and second.x < first.x + first.width
    return across and abs(first.y - second.y) < (first.height + second.height) / 2.0


def ten_fsrs(report: Report) -> Report:
    more = tuple(
        report.fsrs[0].model_copy(update={"id": f"FSR-1{number}", "goals": ("SG-01", "SG-02")})
        for number in range(3)
    )
    return report.model_copy(update={"fsrs": (*report.fsrs, *more)})


def test_no_two_boxes_of_ten_fsrs_overlap(report: Report) -> None:
    boxes = place_boxes(argument_of(ten_fsrs(report)))
    assert [pair for pair in combinations(boxes.values(), 2) if overlap(*pair)] == []


def test_every_node_is_placed_on_the_drawing(report: Report) -> None:
    argument = argument_of(ten_fsrs(report))
    root = ET.fromstring(render_svg(argument))  # noqa: S314 - written by ourselves
    drawn = {group.get("id") for group in root.iter(f"{SVG}g")}
    assert drawn == {item.id for item in argument.nodes}
    width, height = float(root.get("width", "0")), float(root.get("height", "0"))
    for box in place_boxes(argument).values():
        assert box.x >= 0.0
        assert box.x + box.width <= width
        assert box.height / 2.0 <= box.y <= height - box.height / 2.0


def test_children_stand_to_the_right_of_what_they_support(report: Report) -> None:
    argument = argument_of(report)
    boxes = place_boxes(argument)
    for edge in argument.edges:
        if edge.relation == "supported_by":
            assert boxes[edge.source].x + boxes[edge.source].width < boxes[edge.target].x


def test_text_of_the_user_is_no_markup_and_needs_no_network() -> None:
    text = render_svg(argument_of(build_report("<script>alert(1)</script>\0&")))
    root = ET.fromstring(text)  # noqa: S314 - written by ourselves
    assert not list(root.iter(f"{SVG}script"))
    assert "http" not in text.replace("http://www.w3.org/2000/svg", "")


def test_long_argument_without_evidence_is_drawn(report: Report) -> None:
    bare = report.model_copy(update={"fsrs": (), "cells": (), "goals": (), "worst_cases": ()})
    assert place_boxes(argument_of(bare))["G-top"].height > 0.0
