"""One way to lose or falsify evidence, and what must come of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tests.chaos.bench import Bench, Said, fsr_of
from tests.project import CONCEPT

Do = Callable[[Bench], Said]


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
    do: Do
    is_slow: bool = False


def edited(name: str, edit: Callable[[Any], object], then: Do = Bench.run) -> Do:
    """Edit a YAML file, then ask for the verdict."""

    def do(bench: Bench) -> Said:
        with bench.edited(name) as content:
            edit(content)
        return then(bench)

    return do


def fsr(name: str, then: Do = Bench.run, **changes: Any) -> Do:
    """Change an FSR of the concept, then ask for the verdict."""
    return edited(CONCEPT, lambda concept: fsr_of(concept, name).update(changes), then)
