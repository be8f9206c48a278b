"""Say where inside a record a reference or value is wrong, so that its line can be shown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

if TYPE_CHECKING:
    from collections.abc import Sequence

Loc = tuple[str | int, ...]


def misplaced(found: Sequence[tuple[Loc, str]]) -> ValidationError:
    """Make the error that a record's validator raises about some of its parts.

    Args:
        found: For each problem its location below the record and what is wrong, with what is
            allowed.

    Returns:
        To be raised inside a validator; the validation of the whole takes over the locations.
    """
    details: list[InitErrorDetails] = [
        InitErrorDetails(
            type=PydanticCustomError("misplaced", "{text}", {"text": text}), loc=loc, input=None
        )
        for loc, text in found
    ]
    return ValidationError.from_exception_data("record", details)


def repeated(names: Sequence[str]) -> list[int]:
    """List the positions at which a name occurs that was there before.

    >>> repeated(["a", "b", "a"])
    [2]
    """
    seen: dict[Any, int] = {}
    return [at for at, name in enumerate(names) if seen.setdefault(name, at) != at]
