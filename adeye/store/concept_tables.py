"""The tables that a concept is taken apart into, for people who ask with SQL."""

from __future__ import annotations

from sqlalchemy import Column, ForeignKeyConstraint, Table

from adeye.store import column_kinds

metadata = column_kinds.metadata
_digest, _text = column_kinds.digest_column, column_kinds.text_column
_number, _count = column_kinds.number_column, column_kinds.count_column
_flag, _row_hash, _one_of = (
    column_kinds.flag_column,
    column_kinds.row_hash_column,
    column_kinds.one_of,
)


def _part(name: str, *columns: Column[str] | Column[float] | Column[int] | Column[bool]) -> Table:
    return Table(
        name,
        metadata,
        _digest("concept_digest", "concept.digest", key=True),
        _text("id", key=True),
        *columns,
        _text("content"),
        _row_hash(),
    )


hazardous_event = _part(
    "hazardous_event",
    _text("severity"),
    _text("exposure"),
    _text("controllability"),
    _text("asil", null=True),
)
safety_goal = _part(
    "safety_goal", _text("asil"), _number("ftti_s", null=False), _text("safe_state"), _text("text")
)
fsr = _part(
    "fsr",
    _text("asil"),
    _flag("mandatory"),
    _count("min_exercised"),
    _text("text"),
    _text("measure"),
    _text("threshold_source"),
)
element = _part("element", _text("kind"), _text("asil_capability"), _flag("legacy"), _text("text"))
assumption = _part("assumption", _text("owner"), _text("valid_until"), _text("text"))
allocation = Table(
    "allocation",
    metadata,
    _digest("concept_digest", key=True),
    _text("fsr_id", key=True),
    _text("element_id", key=True),
    _row_hash(),
    ForeignKeyConstraint(["concept_digest", "fsr_id"], ["fsr.concept_digest", "fsr.id"]),
    ForeignKeyConstraint(
        ["concept_digest", "element_id"], ["element.concept_digest", "element.id"]
    ),
)
decomposition = _part("decomposition", _text("scheme"), _text("independence"))
"""By the id of the FSR that is decomposed."""
decomposition_child = Table(
    "decomposition_child",
    metadata,
    _digest("concept_digest", key=True),
    _text("fsr_id", key=True),
    _text("child_id", key=True),
    _row_hash(),
    ForeignKeyConstraint(
        ["concept_digest", "fsr_id"], ["decomposition.concept_digest", "decomposition.id"]
    ),
    ForeignKeyConstraint(["concept_digest", "child_id"], ["fsr.concept_digest", "fsr.id"]),
)
dependent_failure = _part(
    "dependent_failure", _text("owner"), _text("valid_until"), _text("argument")
)
element_relation = Table(
    "element_relation",
    metadata,
    _digest("concept_digest", key=True),
    _text("element_id", key=True),
    _text("kind", key=True),
    _text("name", key=True),
    _row_hash(),
    ForeignKeyConstraint(
        ["concept_digest", "element_id"], ["element.concept_digest", "element.id"]
    ),
    _one_of("kind", ("resource", "software", "supplier", "provides", "consumes"), "kind"),
)
