"""The SARIF log: what the format asks for."""

from __future__ import annotations

from typing import Any

import jsonschema

from adeye.errors import SourceLocation
from adeye.report.formats.sarif import FINGERPRINT, SarifResult, SarifRule, sarif_log

LOCATION = {
    "type": "object",
    "properties": {
        "physicalLocation": {
            "type": "object",
            "required": ["artifactLocation", "region"],
            "properties": {
                "artifactLocation": {
                    "type": "object",
                    "required": ["uri"],
                    "properties": {"uri": {"type": "string", "pattern": r"^[^\\]+$"}},
                },
                "region": {
                    "type": "object",
                    "required": ["startLine"],
                    "properties": {
                        "startLine": {"type": "integer", "minimum": 1},
                        "startColumn": {"type": "integer", "minimum": 1},
                    },
                },
            },
        },
        "id": {"type": "integer", "minimum": -1},
        "message": {"$ref": "#/$defs/message"},
        "logicalLocations": {"type": "array"},
    },
    "additionalProperties": False,
}
SHAPE: dict[str, Any] = {
    "$defs": {
        "message": {
            "type": "object",
            "required": ["text"],
            "properties": {"text": {"type": "string", "minLength": 1}},
        },
        "location": LOCATION,
    },
    "type": "object",
    "required": ["version", "runs"],
    "properties": {
        "version": {"const": "2.1.0"},
        "$schema": {"type": "string", "format": "uri"},
        "runs": {
            "type": "array",
            "items": {
                "type": "object",
                "required": ["tool", "results"],
                "properties": {
                    "tool": {
                        "type": "object",
                        "required": ["driver"],
                        "properties": {
                            "driver": {
                                "type": "object",
                                "required": ["name", "rules"],
                                "properties": {
                                    "rules": {
                                        "type": "array",
                                        "uniqueItems": True,
                                        "items": {"type": "object", "required": ["id"]},
                                    }
                                },
                            }
                        },
                    },
                    "results": {
                        "type": "array",
                        "items": {
                            "type": "object",
                            "required": ["message", "ruleId", "ruleIndex", "level"],
                            "properties": {
                                "level": {"enum": ["none", "note", "warning", "error"]},
                                "kind": {
                                    "enum": [
                                        *("notApplicable", "pass", "fail"),
                                        *("review", "open", "informational"),
                                    ]
                                },
                                "message": {"$ref": "#/$defs/message"},
                                "locations": {
                                    "type": "array",
                                    "items": {"$ref": "#/$defs/location"},
                                },
                                "relatedLocations": {
                                    "type": "array",
                                    "items": {"$ref": "#/$defs/location"},
                                },
                                "partialFingerprints": {
                                    "type": "object",
                                    "additionalProperties": {"type": "string"},
                                },
                            },
                        },
                    },
                },
            },
        },
    },
}
"""What SARIF 2.1.0 asks of the parts that are written, in its own words."""

PLACE = SourceLocation("odd/a.yaml", 3, 5)
RULE = SarifRule("R1", "Something holds.", "Make it hold.")


def require_sarif(log: dict[str, Any]) -> None:
    """Hold a log against the shape of the format, and every index against what it points at."""
    jsonschema.Draft202012Validator(SHAPE).validate(log)
    for run in log["runs"]:
        rules = run["tool"]["driver"]["rules"]
        assert len({rule["id"] for rule in rules}) == len(rules)
        for result in run["results"]:
            assert rules[result["ruleIndex"]]["id"] == result["ruleId"]
            # Of the kinds only fail has a level (SARIF 2.1.0, 3.27.10).
            assert (result["level"] == "none") == (result.get("kind", "fail") != "fail")


def result(**changes: Any) -> SarifResult:
    fields: dict[str, Any] = {"rule": "R1", "text": "x", "name": "a/b", "where": PLACE}
    return SarifResult(**(fields | changes))


def test_log_has_the_shape_of_the_format() -> None:
    require_sarif(sarif_log([RULE], [result(), result(where=None, related=((PLACE, "beside"),))]))


def test_same_key_has_the_same_fingerprint_and_another_another() -> None:
    log = sarif_log([RULE], [result(key=("a",)), result(key=("a",), text="y"), result(key=("b",))])
    first, second, third = (
        item["partialFingerprints"][FINGERPRINT] for item in log["runs"][0]["results"]
    )
    assert first == second != third


def test_fingerprint_that_hosts_look_at_follows_our_own() -> None:
    log = sarif_log([RULE], [result(key=("a",)), result(key=("b",))])
    own, other = (item["partialFingerprints"] for item in log["runs"][0]["results"])
    assert own["primaryLocationLineHash"] == f"{own[FINGERPRINT][:16]}:1"
    assert own["primaryLocationLineHash"] != other["primaryLocationLineHash"]


def test_places_are_relative_to_a_root_that_is_declared() -> None:
    (run,) = sarif_log([RULE], [result()])["runs"]
    place = run["results"][0]["locations"][0]["physicalLocation"]["artifactLocation"]
    assert place["uriBaseId"] in run["originalUriBaseIds"]


def test_result_without_a_place_has_no_location_that_a_host_would_refuse() -> None:
    (only,) = sarif_log([RULE], [result(where=None)])["runs"][0]["results"]
    assert "locations" not in only


def test_result_without_a_key_has_no_fingerprint() -> None:
    (only,) = sarif_log([RULE], [result()])["runs"][0]["results"]
    assert "partialFingerprints" not in only


def test_path_is_written_as_a_uri() -> None:
    spaced = SourceLocation("my odd/ä#1.yaml", 1, 1)
    (only,) = sarif_log([RULE], [result(where=spaced)])["runs"][0]["results"]
    uri = only["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
    assert uri == "my%20odd/%C3%A4%231.yaml"
