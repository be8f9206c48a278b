"""Triggers that keep results from being changed or deleted, per dialect."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from adeye.store.catalog import LONGEST_NAME
from adeye.store.tables import INSERT_ONLY

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


def _sqlite(table: str) -> tuple[str, ...]:
    return tuple(
        f"CREATE TRIGGER {table}_no_{action.lower()} BEFORE {action} ON {table}\n"
        f"BEGIN SELECT RAISE(ABORT, '{table} is insert-only'); END"
        for action in ("UPDATE", "DELETE")
    )


def _postgresql(table: str) -> tuple[str, ...]:
    # Cut as the server would cut it, so that a trigger is found by its name.
    return tuple(
        f"CREATE TRIGGER {f'{table}_no_{action.lower()}'[:LONGEST_NAME]} "
        f"BEFORE {action} ON {table}\n"
        f"FOR EACH {each} EXECUTE FUNCTION insert_only()"
        for action, each in (("UPDATE", "ROW"), ("DELETE", "ROW"), ("TRUNCATE", "STATEMENT"))
    )


_DIALECTS: Final[Mapping[str, Callable[[str], tuple[str, ...]]]] = MappingProxyType(
    {"sqlite": _sqlite, "postgresql": _postgresql}
)


def trigger_ddl(dialect: str = "sqlite") -> tuple[str, ...]:
    """Write the statements that create every trigger.

    Raises:
        KeyError: The dialect has no triggers written for it.
    """
    return tuple(
        statement for table in INSERT_ONLY for statement in insert_only_ddl(table.name, dialect)
    )


def insert_only_ddl(table: str, dialect: str = "sqlite") -> tuple[str, ...]:
    """Write the statements that make one table insert-only; its name is an identifier."""
    return _DIALECTS[dialect](table)
