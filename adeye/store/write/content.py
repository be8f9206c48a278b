"""Save what users wrote: ODDs, scenarios, architectures and concepts with their parts."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

from sqlalchemy import Connection, Table

from adeye.errors import ExpressionError
from adeye.identity import canonical_json, digest
from adeye.judge.stl.formula import parse_formula
from adeye.judge.stl.syntax import response_time
from adeye.spec.concept import Assumption, Concept, DependentFailure, Requirement, scheme
from adeye.store import tables
from adeye.store.encoding import Row, json_text, row
from adeye.store.ledger import insert_rows
from adeye.store.records import ContentRecord

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
    budgets = {item.id: _response(item) for item in concept.requirements}
    parts: list[tuple[Table, list[Row]]] = [
        (tables.hazardous_event, _parts(tables.hazardous_event, key, concept.hazardous_events)),
        (
            tables.safety_goal,
            _parts(
                tables.safety_goal,
                key,
                concept.safety_goals,
                lambda item: {"asil": concept.goal_asil(item.id), "ftti_s": item.ftti},
            ),
        ),
        (
            tables.fsr,
            _parts(tables.fsr, key, concept.requirements, more=lambda item: budgets[item.id]),
        ),
        (tables.element, _parts(tables.element, key, concept.elements)),
        (tables.assumption, _parts(tables.assumption, key, concept.assumptions, _valid_until)),
        (
            tables.allocation,
            [
                row(tables.allocation, (key, item.id, element))
                for item in concept.requirements
                for element in dict.fromkeys(item.allocation)
            ],
        ),
        (
            tables.element_relation,
            [
                row(tables.element_relation, (key, item.id, kind, name))
                for item in concept.elements
                for kind, name in item.relations
            ],
        ),
        (
            tables.decomposition,
            _parts(
                tables.decomposition,
                key,
                concept.decompositions,
                lambda item: {"id": item.requirement, "scheme": scheme(concept, item)},
            ),
        ),
        (
            tables.decomposition_child,
            [
                row(tables.decomposition_child, (key, item.requirement, child))
                for item in concept.decompositions
                for child in item.into
            ],
        ),
        (
            tables.dependent_failure,
            _parts(tables.dependent_failure, key, concept.dependent_failures, _valid_until),
        ),
    ]
    for table, rows in parts:
        insert_rows(connection, table, rows, ignore_existing=True)
    return key


def _parts(
    table: Table,
    key: str,
    items: Iterable[Any],
    told: Callable[[Any], Mapping[str, Any]] = lambda _: {},
    more: Callable[[Any], Mapping[str, Any]] = lambda _: {},
) -> list[Row]:
    """Make the rows of a table of parts.

    Args:
        table: Its columns are called as what the parts have.
        key: Digest of the concept.
        items: The parts.
        told: Gives the columns that a part has otherwise.
        more: Gives what is written into the content beside the part.
    """
    rows = []
    for item in items:
        content = json_text({**item.model_dump(mode="json"), **more(item)})
        values = {"concept_digest": key, "content": content, **told(item)}
        names = table.columns.keys()[:-1]
        found = [values[name] if name in values else getattr(item, name) for name in names]
        rows.append(row(table, found))
    return rows


def _valid_until(item: Assumption | DependentFailure) -> dict[str, str]:
    return {"valid_until": item.valid_until.isoformat()}


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
