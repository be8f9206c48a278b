"""The tables of twins: a row that says less than it must is refused."""

from __future__ import annotations

import sqlite3
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from adeye.store.repository import Repository


@pytest.mark.parametrize(
    ("columns", "values"),
    [
        ("pairs, p95", "13, 0.5"),
        ("pairs, p95", "0, 0.5"),
        ("pairs, p95", "11, CAST(NULL AS REAL)"),
        ("judged_digest", "NULL"),
        ("kind", "'other'"),
    ],
)
def test_line_that_contradicts_itself_is_refused(
    repository: Repository, example: Any, raw: sqlite3.Connection, columns: str, values: str
) -> None:
    example.halved(repository, example.campaign(repository, 4))
    raw.execute("DROP TRIGGER uncertainty_no_update")
    with pytest.raises(sqlite3.IntegrityError, match=r"(?i)check"):
        raw.execute(f"UPDATE uncertainty SET ({columns}) = (SELECT {values})")  # noqa: S608
