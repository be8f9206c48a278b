"""What is written into the tables of a concept's parts."""

import sqlite3
from typing import Any

import pytest
from sqlalchemy.exc import IntegrityError

from adeye.spec.concept import Element
from adeye.store.evidence_tables import element_relation
from adeye.store.repository import Repository


def with_relations(example: Any) -> Any:
    concept = example.concept()
    camera = Element(
        id="camera",
        kind="sensor",
        text="front camera",
        asil_capability="B",
        resources=("power", "power"),
        supplier="one",
        provides=("objects",),
    )
    return concept.model_copy(update={"elements": (camera,)})


def test_relations_of_elements_are_rows(
    repository: Repository, raw: sqlite3.Connection, example: Any
) -> None:
    key = repository.save_concept(with_relations(example))
    found = raw.execute("SELECT * FROM element_relation ORDER BY kind").fetchall()
    assert [row[:4] for row in found] == [
        (key, "camera", "provides", "objects"),
        (key, "camera", "resource", "power"),
        (key, "camera", "supplier", "one"),
    ]
    assert repository.verify() == ()


def test_relation_of_another_kind_is_refused() -> None:
    (check,) = [
        item for item in element_relation.constraints if "CheckConstraint" in type(item).__name__
    ]
    assert "kind = 'software'" in str(getattr(check, "sqltext", ""))


@pytest.mark.parametrize(
    "action", ["UPDATE element_relation SET name = 'x'", "DELETE FROM element_relation"]
)
def test_relations_are_insert_only(
    repository: Repository, raw: sqlite3.Connection, example: Any, action: str
) -> None:
    repository.save_concept(with_relations(example))
    with pytest.raises((sqlite3.IntegrityError, IntegrityError), match="insert-only"):
        raw.execute(action)
