"""Fields of records by their names, for those who list some of them, and texts by their places."""

from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

_Loc: TypeAlias = tuple[str | int, ...]


def fields_of(record: object, *names: str) -> dict[str, Any]:
    """Return these fields of a record."""
    return {name: getattr(record, name) for name in names}


def texts_in(content: Any, loc: _Loc = ()) -> Iterator[tuple[_Loc, str]]:
    """Give every text of a content with its place in it."""
    if isinstance(content, str):
        yield loc, content
    elif isinstance(content, Mapping):
        for key, item in content.items():
            yield from texts_in(item, (*loc, key))
    elif isinstance(content, list | tuple):
        for at, item in enumerate(content):
            yield from texts_in(item, (*loc, at))
