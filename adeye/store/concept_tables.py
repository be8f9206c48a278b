"""The tables that a concept is taken apart into, for people who ask with SQL."""

from __future__ import annotations

from sqlalchemy import Column, ForeignKeyConstraint, Table

from adeye.store.column_kinds import (
    count_column,
    digest_column,
    flag_column,
    metadata,
    number_column,
    one_of,
    row_hash_column,
    text_column,
)


def _part(name: str, *columns: Column[str] | Column[float] | Column[int] | Column[bool]) -> Table:
    return Table(
        name,
        metadata,
        digest_column("concept_digest", "concept.digest", key=True),
        text_column("id", key=True),
        *columns,
        text_column("content"),
        row_hash_column(),
    )


hazardous_event = _part(
    "hazardous_event",
    text_column("severity"),
    text_column("exposure"),
    text_column("controllability"),
    text_column("asil", null=True),
)
safety_goal = _part(
    "safety_goal",
    text_column("asil"),
    number_column("ftti_s", null=False),
    text_column("safe_state"),
    text_column("text"),
)
fsr = _part(
    "fsr",
    text_column("asil"),
    flag_column("mandatory"),
    count_column("min_exercised"),
    text_column("text"),
    text_column("measure"),
    text_column("threshold_source"),
)
element = _part(
    "element",
    text_column("kind"),
    text_column("asil_capability"),
    flag_column("legacy"),
    text_column("text"),
)
assumption = _part(
    "assumption", text_column("owner"), text_column("valid_until"), text_column("text")
)
allocation = Table(
    "allocation",
    metadata,
    digest_column("concept_digest", key=True),
    text_column("fsr_id", key=True),
    text_column("element_id", key=True),
    row_hash_column(),
    ForeignKeyConstraint(["concept_digest", "fsr_id"], ["fsr.concept_digest", "fsr.id"]),
    ForeignKeyConstraint(
        ["concept_digest", "element_id"], ["element.concept_digest", "element.id"]
    ),
)
decomposition = _part("decomposition", text_column("scheme"), text_column("independence"))
"""By the id of the FSR that is decomposed."""
decomposition_child = Table(
    "decomposition_child",
    metadata,
    digest_column("concept_digest", key=True),
    text_column("fsr_id", key=True),
    text_column("child_id", key=True),
    row_hash_column(),
    ForeignKeyConstraint(
        ["concept_digest", "fsr_id"], ["decomposition.concept_digest", "decomposition.id"]
    ),
    ForeignKeyConstraint(["concept_digest", "child_id"], ["fsr.concept_digest", "fsr.id"]),
)
dependent_failure = _part(
    "dependent_failure", text_column("owner"), text_column("valid_until"), text_column("argument")
)
element_relation = Table(
    "element_relation",
    metadata,
    digest_column("concept_digest", key=True),
    text_column("element_id", key=True),
    text_column("kind", key=True),
    text_column("name", key=True),
    row_hash_column(),
    ForeignKeyConstraint(
        ["concept_digest", "element_id"], ["element.concept_digest", "element.id"]
    ),
    one_of("kind", ("resource", "software", "supplier", "provides", "consumes"), "kind"),
)
