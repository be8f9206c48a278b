"""What was edited between two states of what people wrote, value by value.

Named things, such as faults, uses of scenarios and FSRs, are found again by their names, whatever
order they stand in; another list is one value.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from adeye.identity import canonical_json

_NAMES: Final = ("id", "as_id", "use", "requirement")
"""Keys that tell things of a list apart, the first that has a value."""


@dataclass(frozen=True, slots=True)
class Edit:
    """One value that was edited.

    Attributes:
        path: Its place, such as ``scenarios.cut_in.sweep.parameters.gap``.
        old: Before, as JSON unless it is text; None where it was not there.
        new: After.
    """

    path: str
    old: str | None
    new: str | None


def edits_between(then: Any, now: Any, path: str = "") -> Iterator[Edit]:
    """Name every value that differs between two contents, in the order of the new one.

    Args:
        then: Content of before, as JSON types.
        now: Content of after.
        path: Where both stand.

    >>> [str(edit.path) for edit in edits_between({"a": {"b": 1, "c": 2}}, {"a": {"b": 1, "c": 3}})]
    ['a.c']
    """
    if then == now:
        return
    before, after = _named(then), _named(now)
    if before is None or after is None:
        yield Edit(path, _written(then), _written(now))
        return
    for key in dict.fromkeys([*after, *before]):
        below = f"{path}.{key}" if path else key
        if key in before and key in after:
            yield from edits_between(before[key], after[key], below)
        else:
            yield Edit(below, _written(before.get(key)), _written(after.get(key)))


def _named(content: Any) -> Mapping[str, Any] | None:
    """Give the parts of a content by their names; None of what is one value."""
    if isinstance(content, Mapping):
        return content
    if not isinstance(content, list | tuple) or not content:
        return None
    found: dict[str, Any] = {}
    for item in content:
        if not isinstance(item, Mapping):
            return None
        name = next((str(item[key]) for key in _NAMES if item.get(key)), "")
        if not name or name in found:
            return None
        found[name] = item
    return found


def _written(value: Any) -> str | None:
    if value is None or isinstance(value, str):
        return value
    return canonical_json(value).decode()
