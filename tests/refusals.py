"""Refusals: a call, the kind of its error, and what it says."""

import re
from collections.abc import Callable
from typing import Any, TypeVar

Kind = TypeVar("Kind", bound=BaseException)


def refused(
    kind: type[Kind] | tuple[type[Kind], ...],
    call: Callable[..., object],
    /,
    *given: Any,
    says: str = "",
    **more: Any,
) -> Kind:
    """Return the error of a call, which says a text or what a pattern matches."""
    try:
        call(*given, **more)
    except kind as error:
        said = str(error)
        assert says in said or re.search(says, said), f"{says!r} is not said of {given}: {said}"
        return error
    raise AssertionError(f"not refused: {given} {more}")
