"""Save what users wrote: ODDs, scenarios, architectures and concepts with their parts."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Final

from adeye.errors import ExpressionError
from adeye.identity import canonical_json, digest
from adeye.judge.stl.formula import parse_formula
from adeye.judge.stl.syntax import response_time
from adeye.spec.concept import scheme
from adeye.store import tables
from adeye.store.encoding import Row, json_text, row
from adeye.store.ledger import insert_rows
from adeye.store.records import ContentRecord

if TYPE_CHECKING:
    from sqlalchemy import Connection, Table

    from adeye.spec.concept import Concept, Requirement

CONTENT_TABLES: Final = {
    "odd": tables.odd,
    "scenario": tables.scenario,
    "architecture": tables.architecture,
    "concept": tables.concept,
}


FOLDER: Final = "plugin_folder"
"""Key that older releases stored beside an architecture's own; it tells where its file was."""


def executable_digest(kind: str, text: str) -> str:
    """Hash what a run depends on of stored content: no texts, no places of files.

    Args:
        kind: ``scenario``, ``architecture`` or ``faults``.
        text: Its stored content.

    Raises:
        ValueError: It is not such content.
    """
    from adeye.spec.architecture import Architecture
    from adeye.spec.fault import FAULT
    from adeye.spec.quantity import SI
    from adeye.spec.scenario import LogicalScenario
    from adeye.sweep.case import content_digest

    content = json.loads(text)
    if kind == "scenario":
        return content_digest(LogicalScenario.model_validate(content, context=SI))
    if kind == "faults":
        return digest([FAULT.validate_python(item, context=SI).executable() for item in content])
    content.pop(FOLDER, None)
    return content_digest(Architecture.model_validate(content, context=SI))


def save_content(connection: Connection, kind: str, record: ContentRecord) -> str:
    """Save one piece of content unless it is there; return its digest."""
    table = CONTENT_TABLES[kind]
    text = canonical_json(record.content).decode()
    values = (record.digest, record.id, record.version, text)
    insert_rows(connection, table, [row(table, values)], ignore_existing=True)
    return record.digest


def concept_record(concept: Concept) -> ContentRecord:
    """Describe a concept as content."""
    return ContentRecord(concept.concept, "", concept.model_dump(mode="json"))


def save_concept(connection: Connection, concept: Concept) -> str:
    """Save a concept and its parts unless they are there; return its digest."""
    key = save_content(connection, "concept", concept_record(concept))
    parts: list[tuple[Table, list[Row]]] = [
        (tables.hazardous_event, _hazardous_events(key, concept)),
        (tables.safety_goal, _safety_goals(key, concept)),
        (tables.fsr, [_fsr(key, item) for item in concept.requirements]),
        (tables.element, _elements(key, concept)),
        (tables.assumption, _assumptions(key, concept)),
        (tables.allocation, _allocations(key, concept)),
        (tables.element_relation, _relations(key, concept)),
        (tables.decomposition, _decompositions(key, concept)),
        (tables.decomposition_child, _children(key, concept)),
        (tables.dependent_failure, _dependent_failures(key, concept)),
    ]
    for table, rows in parts:
        insert_rows(connection, table, rows, ignore_existing=True)
    return key


def _hazardous_events(key: str, concept: Concept) -> list[Row]:
    return [
        row(
            tables.hazardous_event,
            (
                key,
                item.id,
                item.severity,
                item.exposure,
                item.controllability,
                item.asil,
                json_text(item.model_dump(mode="json")),
            ),
        )
        for item in concept.hazardous_events
    ]


def _safety_goals(key: str, concept: Concept) -> list[Row]:
    return [
        row(
            tables.safety_goal,
            (
                key,
                item.id,
                concept.goal_asil(item.id),
                item.ftti,
                item.safe_state,
                item.text,
                json_text(item.model_dump(mode="json")),
            ),
        )
        for item in concept.safety_goals
    ]


def _fsr(key: str, item: Requirement) -> Row:
    return row(
        tables.fsr,
        (
            key,
            item.id,
            item.asil,
            item.mandatory,
            item.min_exercised,
            item.text,
            item.measure,
            item.threshold_source,
            json_text({**item.model_dump(mode="json"), **_response(item)}),
        ),
    )


def _response(item: Requirement) -> dict[str, float | str]:
    """Give the time that the formula leaves to respond [s], for the rules; nothing for none."""
    try:
        formula = parse_formula(item.formula or "", None, item.constants)
    except ExpressionError:
        # What is no formula is refused with its place where a plan is made.
        return {}
    time = response_time(formula.root)
    if time is None:
        return {}
    return {"response_s": time if math.isfinite(time) else "unbounded"}


def _elements(key: str, concept: Concept) -> list[Row]:
    return [
        row(
            tables.element,
            (
                key,
                item.id,
                item.kind,
                item.asil_capability,
                item.legacy,
                item.text,
                json_text(item.model_dump(mode="json")),
            ),
        )
        for item in concept.elements
    ]


def _assumptions(key: str, concept: Concept) -> list[Row]:
    return [
        row(
            tables.assumption,
            (
                key,
                item.id,
                item.owner,
                item.valid_until.isoformat(),
                item.text,
                json_text(item.model_dump(mode="json")),
            ),
        )
        for item in concept.assumptions
    ]


def _allocations(key: str, concept: Concept) -> list[Row]:
    return [
        row(tables.allocation, (key, item.id, element))
        for item in concept.requirements
        for element in dict.fromkeys(item.allocation)
    ]


def _relations(key: str, concept: Concept) -> list[Row]:
    return [
        row(tables.element_relation, (key, item.id, kind, name))
        for item in concept.elements
        for kind, name in item.relations
    ]


def _decompositions(key: str, concept: Concept) -> list[Row]:
    return [
        row(
            tables.decomposition,
            (
                key,
                item.requirement,
                scheme(concept, item),
                item.independence,
                json_text(item.model_dump(mode="json")),
            ),
        )
        for item in concept.decompositions
    ]


def _children(key: str, concept: Concept) -> list[Row]:
    return [
        row(tables.decomposition_child, (key, item.requirement, child))
        for item in concept.decompositions
        for child in item.into
    ]


def _dependent_failures(key: str, concept: Concept) -> list[Row]:
    return [
        row(
            tables.dependent_failure,
            (
                key,
                item.id,
                item.owner,
                item.valid_until.isoformat(),
                item.argument,
                json_text(item.model_dump(mode="json")),
            ),
        )
        for item in concept.dependent_failures
    ]
