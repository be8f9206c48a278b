"""One way to lose or falsify evidence, and what must come of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tests.chaos.bench import Bench, Said


@dataclass(frozen=True)
class Way:
    """One way.

    Attributes:
        what: In words.
        code: Exit code that is documented for it.
        said: What the output must name.
        do: Spoils the campaign and asks for the verdict.
        is_slow: Whether it takes long.
    """

    what: str
    code: int
    said: str
    do: Callable[[Bench], Said]
    is_slow: bool = False
