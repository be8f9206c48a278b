"""SARIF, which code hosts show beside the lines of the files: the log that every finding goes into.

Source:
    OASIS, Static Analysis Results Interchange Format (SARIF) 2.1.0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal

from adeye.identity import digest
from adeye.report.places import uri_of
from adeye.version import __version__

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.errors import SourceLocation
    from adeye.report.parts import Place

SCHEMA: Final = "https://json.schemastore.org/sarif-2.1.0.json"
FINGERPRINT: Final = "adeye/v1"
"""Name of the fingerprint by which a result is known again."""
HOSTS_FINGERPRINT: Final = "primaryLocationLineHash"
"""Name of the one that code hosts look at; they would compute it from the line otherwise."""
ROOT: Final = "%SRCROOT%"
"""What places are relative to. Where it lies is left out: it differs from machine to machine."""

Level = Literal["error", "warning", "note", "none"]
Kind = Literal["fail", "notApplicable"]


@dataclass(frozen=True, slots=True)
class SarifRule:
    """What is checked.

    Attributes:
        id: Its name.
        text: What it asks for.
        help: What to do where it is broken.
        level: How bad that is unless a result says otherwise.
        properties: More about it.
    """

    id: str
    text: str
    help: str
    level: Level = "error"
    properties: tuple[tuple[str, Any], ...] = ()


@dataclass(frozen=True, slots=True)
class SarifResult:
    """Where a rule is broken.

    Attributes:
        rule: Id of the rule.
        text: What is wrong.
        name: What it is about, as ``kind/id``.
        where: Its place in a file, if that is known; code hosts take no result without one.
        related: Other places with what they are.
        level: How bad it is.
        kind: ``fail``, or ``notApplicable`` where nothing could be evaluated.
        key: What makes it the same result in the next log; none for no fingerprint.
        properties: More about it.
    """

    rule: str
    text: str
    name: str
    where: SourceLocation | Place | None
    related: tuple[tuple[SourceLocation | Place, str], ...] = ()
    level: Level = "error"
    kind: Kind = "fail"
    key: tuple[str, ...] = ()
    properties: tuple[tuple[str, Any], ...] = ()


def sarif_log(rules: Sequence[SarifRule], results: Sequence[SarifResult]) -> dict[str, Any]:
    """Write a log of one run of this program.

    Args:
        rules: Every rule that was asked, each id once.
        results: What was found, in the order in which it is listed.
    """
    numbers = {rule.id: number for number, rule in enumerate(rules)}
    driver = {"name": "adeye", "version": __version__, "rules": [_rule(item) for item in rules]}
    run = {
        "tool": {"driver": driver},
        "originalUriBaseIds": {ROOT: {"description": {"text": "The root of the repository."}}},
        "results": [_result(numbers[item.rule], item) for item in results],
    }
    return {"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}


def _rule(item: SarifRule) -> dict[str, Any]:
    made: dict[str, Any] = {
        "id": item.id,
        "shortDescription": {"text": item.text},
        "help": {"text": item.help},
        "defaultConfiguration": {"level": item.level},
    }
    return made | _properties(item.properties)


def _result(number: int, item: SarifResult) -> dict[str, Any]:
    made: dict[str, Any] = {
        "ruleId": item.rule,
        "ruleIndex": number,
        "level": item.level,
        "message": {"text": item.text},
    }
    if item.where is not None:
        name = [{"fullyQualifiedName": item.name}]
        place = {"logicalLocations": name, "physicalLocation": _physical(item.where)}
        made["locations"] = [place]
    if item.kind != "fail":
        made["kind"] = item.kind
    if item.related:
        made["relatedLocations"] = [
            {"id": at, "message": {"text": text}, "physicalLocation": _physical(where)}
            for at, (where, text) in enumerate(item.related)
        ]
    if item.key:
        known = digest(list(item.key))
        made["partialFingerprints"] = {FINGERPRINT: known, HOSTS_FINGERPRINT: f"{known[:16]}:1"}
    return made | _properties(item.properties)


def _physical(where: SourceLocation | Place) -> dict[str, Any]:
    return {
        "artifactLocation": {"uri": uri_of(where.path), "uriBaseId": ROOT},
        "region": {"startLine": where.line, "startColumn": where.column},
    }


def _properties(found: tuple[tuple[str, Any], ...]) -> dict[str, Any]:
    return {"properties": dict(found)} if found else {}
