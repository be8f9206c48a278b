"""ReqIF read back by another parser: ids, texts, verdicts, references."""

from typing import Any

import pytest
from lxml import etree

from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.formats.reqif import NAMESPACE, render_reqif, verdict_attribute
from adeye.report.model.report import Report

N = {"r": NAMESPACE}


@pytest.fixture
def report(report: Report) -> Report:
    """The report, compared with no baseline."""
    return report.model_copy(update={"impact": None})


def read(report: Report) -> Any:
    return etree.fromstring(render_reqif(report))


def objects(root: Any) -> dict[str, dict[str, str]]:
    """Read each object's values by the long names of its attributes, as a tool would."""
    names = {
        item.get("IDENTIFIER"): item.get("LONG-NAME")
        for item in root.findall(".//r:ATTRIBUTE-DEFINITION-STRING", N)
    }
    return {
        item.get("IDENTIFIER"): {
            names[value.find(".//r:ATTRIBUTE-DEFINITION-STRING-REF", N).text]: value.get(
                "THE-VALUE"
            )
            for value in item.findall("r:VALUES/r:ATTRIBUTE-VALUE-STRING", N)
        }
        for item in root.findall(".//r:SPEC-OBJECT", N)
    }


def test_ids_and_texts_come_back(report: Report) -> None:
    found = {item["ReqIF.ForeignID"]: item for item in objects(read(report)).values()}
    assert set(found) == {goal.id for goal in report.goals} | {fsr.id for fsr in report.fsrs}
    for fsr in report.fsrs:
        assert found[fsr.id]["ReqIF.Text"] == fsr.text
        assert found[fsr.id]["Measure"] == fsr.formula
        assert found[fsr.id]["ASIL"] == fsr.asil
        assert found[fsr.id]["Safety goals"] == ", ".join(fsr.goals)
    assert found["FSR-02"][verdict_attribute("legacy_camera")].startswith("FAIL")
    assert found["FSR-02"][verdict_attribute("camera_radar")].startswith("PASS")
    assert found["FSR-02"]["Place"] == "odd/concepts/motorway.yaml:60"


def test_identifiers_are_unique_and_every_reference_resolves(report: Report) -> None:
    root = read(report)
    ids = [item.get("IDENTIFIER") for item in root.iter() if item.get("IDENTIFIER")]
    assert len(set(ids)) == len(ids)
    references = [item.text for item in root.iter() if str(item.tag).endswith("-REF")]
    assert len(references) > 50
    assert set(references) <= set(ids)
    assert all(name[0] == "_" for name in ids)


def test_identifiers_stay_from_one_campaign_to_the_next(report: Report) -> None:
    other = report.model_copy(
        update={"campaign": "c-other", "evidence_digest": "0", "created": "2030-01-01T00:00:00"}
    )
    assert set(objects(read(report))) == set(objects(read(other)))


def test_another_concept_has_other_identifiers(report: Report) -> None:
    other = report.model_copy(update={"concept": "another"})
    assert not set(objects(read(report))) & set(objects(read(other)))


def test_relations_lead_from_fsr_to_goal_and_from_child_to_parent(report: Report) -> None:
    root, named = read(report), {}
    for name, values in objects(root).items():
        named[name] = values["ReqIF.ForeignID"]
    found = {
        (
            named[item.find("r:SOURCE/r:SPEC-OBJECT-REF", N).text],
            named[item.find("r:TARGET/r:SPEC-OBJECT-REF", N).text],
        )
        for item in root.findall(".//r:SPEC-RELATION", N)
    }
    satisfied = {(fsr.id, goal) for fsr in report.fsrs for goal in fsr.goals}
    assert found == satisfied | {("FSR-02", "FSR-01"), ("FSR-06", "FSR-01")}


def test_specification_lists_each_fsr_below_its_goals(report: Report) -> None:
    root = read(report)
    listed = root.findall(".//r:SPECIFICATION/r:CHILDREN/r:SPEC-HIERARCHY", N)
    assert [item.get("LONG-NAME") for item in listed] == [goal.id for goal in report.goals]
    below = listed[0].findall("r:CHILDREN/r:SPEC-HIERARCHY", N)
    assert [item.get("LONG-NAME") for item in below] == ["FSR-01", "FSR-02", "FSR-07"]


def test_text_that_xml_cannot_hold_is_left_out(report: Report) -> None:
    first, *others = report.fsrs
    strange = first.model_copy(update={"text": "a\x00<b>&\"'"})
    found = objects(read(report.model_copy(update={"fsrs": (strange, *others)})))
    assert "a<b>&\"'" in {item["ReqIF.Text"] for item in found.values()}


def test_verdict_names_what_is_waived_and_is_unknown_where_results_were_altered(
    report: Report,
) -> None:
    cells = tuple(
        cell.model_copy(update={"counts": {Verdict.PASS: 1, Verdict.NOT_RUN: 2}})
        if (cell.fsr, cell.architecture, cell.scenario) == ("FSR-01", "camera_radar", None)
        else cell
        for cell in report.cells
    )
    said = str(objects(read(report.model_copy(update={"cells": cells}))))
    assert "; waived: 2 NOT RUN" in said
    altered = report.model_copy(update={"exit_code": ExitCode.INTEGRITY, "message": "row 3"})
    said = etree.tostring(read(altered)).decode()
    assert "The gate answers 4: row 3" in said
    assert "PASS" not in said
