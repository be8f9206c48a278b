"""The argument from goals to evidence: its tree, its drawing, its files."""

import json
import xml.etree.ElementTree as ET
from itertools import combinations

import pytest

from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.formats import gsn
from adeye.report.model.report import Report
from tests.report.fake import build_report


@pytest.fixture
def report(report: Report) -> Report:
    """The report, compared with no baseline."""
    return report.model_copy(update={"impact": None})


@pytest.fixture
def sound(report: Report) -> Report:
    """The report without a broken rule."""
    return report.model_copy(update={"findings": ()})


def node(argument: gsn.Argument, name: str) -> gsn.GsnNode:
    return next(item for item in argument.nodes if item.id == name)


def with_verdict(report: Report, fsr: str, verdict: Verdict, scenario: str | None) -> Report:
    cells = tuple(
        cell.model_copy(update={"verdict": verdict})
        if (cell.fsr, cell.architecture, cell.scenario) == (fsr, "camera_radar", scenario)
        else cell
        for cell in report.cells
    )
    return report.model_copy(update={"cells": cells})


def test_every_relation_joins_two_nodes_and_every_node_but_the_top_is_reached(
    report: Report,
) -> None:
    argument = gsn.argument_of(report)
    names = [item.id for item in argument.nodes]
    assert len(set(names)) == len(names)
    assert {edge.source for edge in argument.edges} <= set(names)
    assert {edge.target for edge in argument.edges} == set(names[1:])


def test_argument_is_about_the_gate_only_with_its_assumptions(report: Report) -> None:
    argument = gsn.argument_of(report)
    places = {item.id for item in argument.nodes if item.id.startswith("E-")}
    assert places
    assert all("-camera_radar-" in name for name in places)
    assert "A-AS-01" in argument.children("in_context_of")["G-FSR-01"]


def test_all_passing_supports_the_top_goal_and_what_is_not_exercised_is_undeveloped(
    sound: Report,
) -> None:
    argument = gsn.argument_of(sound)
    assert argument.nodes[0].state == "supported"
    evidence = node(argument, "E-FSR-01-camera_radar-cut_in")
    assert evidence.kind == "solution"
    assert evidence.evidence["evidence_digest"] == sound.evidence_digest
    assert evidence.evidence["command"].startswith("adeye replay")
    item = node(argument, "E-FSR-03-camera_radar-lead_braking")
    assert (item.kind, item.state) == ("goal", "undeveloped")


def test_verdict_of_a_mandatory_fsr_reaches_the_top_and_of_an_optional_one_nothing(
    sound: Report,
) -> None:
    states: dict[Verdict, gsn.State] = {
        Verdict.FAIL: "defeated",
        Verdict.VACUOUS: "undeveloped",
        Verdict.INCONCLUSIVE: "undeveloped",
        Verdict.ERROR: "undeveloped",
    }
    for verdict, state in states.items():
        argument = gsn.argument_of(with_verdict(sound, "FSR-03", verdict, None))
        names = ("G-FSR-03", "G-SG-02", "G-top")
        assert {node(argument, name).state for name in names} == {state}
        assert node(argument, "G-SG-01").state == "supported"
    argument = gsn.argument_of(with_verdict(sound, "FSR-07", Verdict.FAIL, None))
    assert node(argument, "G-FSR-07").state == "defeated"
    assert node(argument, "G-SG-01").state == "supported"


def test_broken_rule_leaves_the_top_undeveloped(report: Report) -> None:
    argument = gsn.argument_of(report)
    assert argument.nodes[0].state == "undeveloped"
    assert "1 finding" in node(argument, "C-findings").text


def test_goal_without_an_fsr_and_no_gate_support_nothing(sound: Report) -> None:
    goal = sound.goals[0].model_copy(update={"id": "SG-09"})
    argument = gsn.argument_of(sound.model_copy(update={"goals": (*sound.goals, goal)}))
    assert node(argument, "G-SG-09").state == "undeveloped"
    assert argument.nodes[0].state == "undeveloped"
    none = tuple(item.model_copy(update={"is_gate": False}) for item in sound.architectures)
    argument = gsn.argument_of(sound.model_copy(update={"architectures": none}))
    assert argument.nodes[0].state != "supported"


def test_fsr_of_two_goals_is_one_node_below_both(sound: Report) -> None:
    first, *others = sound.fsrs
    both = first.model_copy(update={"goals": ("SG-01", "SG-02")})
    argument = gsn.argument_of(sound.model_copy(update={"fsrs": (both, *others)}))
    above = [edge.source for edge in argument.edges if edge.target == "G-FSR-01"]
    assert above == ["S-SG-01", "S-SG-02"]


def test_nothing_is_supported_by_nothing() -> None:
    assert gsn.fold_states([]) == "undeveloped"
    assert gsn.fold_states(["supported", "undeveloped", "defeated"]) == "defeated"
    assert gsn.state_of(None) == "undeveloped"


def test_json_has_its_schema_and_all_nodes(report: Report) -> None:
    argument = gsn.argument_of(report)
    document = json.loads(gsn.render_gsn_json(argument))
    assert document["schema"] == "adeye/gsn@1"
    assert [item["id"] for item in document["nodes"]] == [item.id for item in argument.nodes]
    assert len(document["edges"]) == len(argument.edges)


SVG = "{http://www.w3.org/2000/svg}"


def overlap(first: gsn.Box, second: gsn.Box) -> bool:
    across = first.x < second.x + second.width and second.x < first.x + first.width
    return across and abs(first.y - second.y) < (first.height + second.height) / 2.0


def ten_fsrs(report: Report) -> Report:
    more = tuple(
        report.fsrs[0].model_copy(update={"id": f"FSR-1{number}", "goals": ("SG-01", "SG-02")})
        for number in range(3)
    )
    return report.model_copy(update={"fsrs": (*report.fsrs, *more)})


def test_every_node_of_ten_fsrs_is_placed_on_the_drawing_and_no_two_overlap(
    report: Report,
) -> None:
    argument = gsn.argument_of(ten_fsrs(report))
    boxes = gsn.place_boxes(argument)
    assert [pair for pair in combinations(boxes.values(), 2) if overlap(*pair)] == []
    root = ET.fromstring(gsn.render_svg(argument))  # noqa: S314 - written by ourselves
    drawn = {group.get("id") for group in root.iter(f"{SVG}g")}
    assert drawn == {item.id for item in argument.nodes}
    width, height = float(root.get("width", "0")), float(root.get("height", "0"))
    for box in boxes.values():
        assert box.x >= 0.0
        assert box.x + box.width <= width
        assert box.height / 2.0 <= box.y <= height - box.height / 2.0


def test_children_stand_to_the_right_of_what_they_support(report: Report) -> None:
    argument = gsn.argument_of(report)
    boxes = gsn.place_boxes(argument)
    for edge in argument.edges:
        if edge.relation == "supported_by":
            assert boxes[edge.source].x + boxes[edge.source].width < boxes[edge.target].x


def test_text_of_the_user_is_no_markup_and_needs_no_network() -> None:
    text = gsn.render_svg(gsn.argument_of(build_report("<script>alert(1)</script>\0&")))
    root = ET.fromstring(text)  # noqa: S314 - written by ourselves
    assert not list(root.iter(f"{SVG}script"))
    assert "http" not in text.replace("http://www.w3.org/2000/svg", "")


def test_long_argument_without_evidence_is_drawn(report: Report) -> None:
    bare = report.model_copy(update={"fsrs": (), "cells": (), "goals": (), "worst_cases": ()})
    assert gsn.place_boxes(gsn.argument_of(bare))["G-top"].height > 0.0


def test_every_node_and_relation_is_one_line(report: Report) -> None:
    argument = gsn.argument_of(report)
    lines = gsn.render_mermaid(argument).splitlines()
    assert lines[0] == "flowchart LR"
    assert sum(" --> " in line or " -.- " in line for line in lines) == len(argument.edges)
    assert sum("<b>" in line for line in lines) == len(argument.nodes)
    assert sum(line.startswith("  class n") for line in lines) == len(argument.nodes)


def test_no_text_ends_its_label_and_an_ampersand_is_not_read_as_a_code() -> None:
    text = gsn.render_mermaid(gsn.argument_of(build_report('"]; <script>\n#1')))
    assert "<script>" not in text
    assert all(line.count('"') in {0, 2} for line in text.splitlines())
    assert gsn.quoted("a & b") == "a #amp; b"


def test_gate_that_refuses_leaves_the_top_undeveloped_and_altered_results_everything(
    sound: Report,
) -> None:
    refused = {"exit_code": ExitCode.INCOMPLETE, "message": "channel_error of channel nominal"}
    argument = gsn.argument_of(sound.model_copy(update=refused))
    assert node(argument, "G-top").state == "undeveloped"
    assert node(argument, "G-FSR-01").state == "supported"
    assert node(argument, "C-gate").text == refused["message"]
    altered = {"exit_code": ExitCode.INTEGRITY, "message": "a row was altered"}
    argument = gsn.argument_of(sound.model_copy(update=altered))
    assert {item.state for item in argument.nodes} <= {"", "undeveloped"}


def test_contacts_of_a_green_gate_are_in_its_context(sound: Report) -> None:
    said = {"contacts": {"camera_radar": 2}, "message": "contact in 2 runs of camera_radar"}
    for report, is_told in ((sound, False), (sound.model_copy(update=said), True)):
        names = {item.id for item in gsn.argument_of(report).nodes}
        assert ("C-gate" in names) is is_told


def test_waiver_is_no_evidence(sound: Report) -> None:
    cells = tuple(
        cell.model_copy(update={"counts": {Verdict.PASS: 1, Verdict.NOT_RUN: 2}})
        if (cell.fsr, cell.architecture, cell.scenario) == ("FSR-01", "camera_radar", None)
        else cell
        for cell in sound.cells
    )
    argument = gsn.argument_of(sound.model_copy(update={"cells": cells}))
    assert node(argument, "G-FSR-01").state == "undeveloped"


def test_gate_against_the_baseline_of_the_report_counts(sound: Report) -> None:
    compared = build_report().model_copy(update={"findings": ()})
    assert compared.impact is not None
    assert (sound.answer[0], compared.answer[0]) == (ExitCode.OK, compared.impact.exit_code)
    argument = gsn.argument_of(compared)
    assert node(argument, "G-top").state == "undeveloped"
    assert node(argument, "C-gate").text == compared.impact.message
