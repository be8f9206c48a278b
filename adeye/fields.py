"""Fields of records by their names, for those who list some of them."""

from typing import Any


def fields_of(record: object, *names: str) -> dict[str, Any]:
    """Return these fields of a record."""
    return {name: getattr(record, name) for name in names}
