"""The SARIF log: what the format asks for beyond its schema."""

from __future__ import annotations

from typing import Any

from adeye.errors import SourceLocation
from adeye.report.formats.sarif import FINGERPRINT, SarifResult, SarifRule, sarif_log

PLACE = SourceLocation("odd/a.yaml", 3, 5)
RULE = SarifRule("R1", "Something holds.", "Make it hold.")


def require_sarif(log: dict[str, Any]) -> None:
    """Hold every index of a log against what it points at, and every level against its kind."""
    for run in log["runs"]:
        rules = run["tool"]["driver"]["rules"]
        assert len({rule["id"] for rule in rules}) == len(rules)
        for item in run["results"]:
            assert rules[item["ruleIndex"]]["id"] == item["ruleId"]
            # Of the kinds only fail has a level (SARIF 2.1.0, 3.27.10).
            assert (item["level"] == "none") == (item.get("kind", "fail") != "fail")


def result(**changes: Any) -> SarifResult:
    fields: dict[str, Any] = {"rule": "R1", "text": "x", "name": "a/b", "where": PLACE}
    return SarifResult(**(fields | changes))


def log_of(*found: SarifResult) -> dict[str, Any]:
    return sarif_log([RULE], found)


def written(*found: SarifResult) -> list[dict[str, Any]]:
    results: list[dict[str, Any]] = log_of(*found)["runs"][0]["results"]
    return results


def test_same_key_has_the_same_fingerprint_and_another_another() -> None:
    found = written(result(key=("a",)), result(key=("a",), text="y"), result(key=("b",)))
    first, second, third = (item["partialFingerprints"][FINGERPRINT] for item in found)
    assert first == second != third


def test_fingerprint_that_hosts_look_at_follows_our_own() -> None:
    found = written(result(key=("a",)), result(key=("b",)))
    own, other = (item["partialFingerprints"] for item in found)
    assert own["primaryLocationLineHash"] == f"{own[FINGERPRINT][:16]}:1"
    assert own["primaryLocationLineHash"] != other["primaryLocationLineHash"]


def test_places_are_uris_relative_to_a_root_that_is_declared() -> None:
    (run,) = log_of(result(where=SourceLocation("my odd/ä#1.yaml", 1, 1)))["runs"]
    place = run["results"][0]["locations"][0]["physicalLocation"]["artifactLocation"]
    assert place["uriBaseId"] in run["originalUriBaseIds"]
    assert place["uri"] == "my%20odd/%C3%A4%231.yaml"


def test_result_has_no_location_that_a_host_would_refuse_and_no_fingerprint_of_nothing() -> None:
    (only,) = written(result(where=None))
    assert {"locations", "partialFingerprints"}.isdisjoint(only)
    (placed,) = written(result())
    assert "locations" in placed
