"""Save what users wrote: ODDs, scenarios, architectures and concepts with their parts."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from sqlalchemy import Connection, Table

from adeye.errors import ExpressionError
from adeye.identity import canonical_json, digest
from adeye.store import tables
from adeye.store.encoding import row
from adeye.store.ledger import add_row, insert_rows, row_of
from adeye.store.records import ContentRecord
from adeye.store.texts import json_text

if TYPE_CHECKING:
    from adeye.spec.concept import Assumption, Concept, DependentFailure, Requirement

Told = Callable[[Any], Mapping[str, Any]]
"""Gives the columns that a part of a concept has otherwise than under the name of the column."""

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
    values = (record.digest, record.id, record.version, canonical_json(record.content).decode())
    add_row(connection, tables.CONTENT[kind], *values, ignore_existing=True)
    return record.digest


def concept_record(concept: Concept) -> ContentRecord:
    """Describe a concept as content."""
    return ContentRecord(concept.concept, "", concept.model_dump(mode="json"))


def save_concept(connection: Connection, concept: Concept) -> str:
    """Save a concept and its parts unless they are there; return its digest."""
    from adeye.spec.concept import scheme

    key = save_content(connection, "concept", concept_record(concept))

    def save(table: Table, found: Iterable[Sequence[Any]]) -> None:
        rows = [row(table, (key, *values)) for values in found]
        insert_rows(connection, table, rows, ignore_existing=True)

    def save_parts(table: Table, items: Iterable[Any], told: Told = _nothing) -> None:
        rows = [
            row_of(table, item, **{"concept_digest": key, "content": _json(item), **told(item)})
            for item in items
        ]
        insert_rows(connection, table, rows, ignore_existing=True)

    save_parts(tables.hazardous_event, concept.hazardous_events)
    save_parts(
        tables.safety_goal,
        concept.safety_goals,
        lambda item: {"asil": concept.goal_asil(item.id), "ftti_s": item.ftti},
    )
    save_parts(tables.fsr, concept.requirements, _with_response)
    save_parts(tables.element, concept.elements)
    save_parts(tables.assumption, concept.assumptions, _valid_until)
    requirements, decompositions = concept.requirements, concept.decompositions
    save(
        tables.allocation,
        ((item.id, name) for item in requirements for name in dict.fromkeys(item.allocation)),
    )
    save(
        tables.element_relation,
        ((item.id, *relation) for item in concept.elements for relation in item.relations),
    )
    save_parts(
        tables.decomposition,
        decompositions,
        lambda item: {"id": item.requirement, "scheme": scheme(concept, item)},
    )
    save(
        tables.decomposition_child,
        ((item.requirement, child) for item in decompositions for child in item.into),
    )
    save_parts(tables.dependent_failure, concept.dependent_failures, _valid_until)
    return key


def _nothing(_: object) -> Mapping[str, Any]:
    return {}


def _json(item: Any) -> str:
    return json_text(item.model_dump(mode="json"))


def _valid_until(item: Assumption | DependentFailure) -> dict[str, str]:
    return {"valid_until": item.valid_until.isoformat()}


def _with_response(item: Requirement) -> dict[str, str]:
    """Return the content with the time that the formula leaves to respond [s], for the rules."""
    from adeye.judge.stl.formula import parse_formula
    from adeye.judge.stl.syntax import response_time

    try:
        time = response_time(parse_formula(item.formula or "", None, item.constants).root)
    except ExpressionError:
        # What is no formula is refused with its place where a plan is made.
        time = None
    if time is None:
        return {}
    response = {"response_s": time if math.isfinite(time) else "unbounded"}
    return {"content": json_text({**item.model_dump(mode="json"), **response})}
