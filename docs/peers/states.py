"""States that adeye and other tools are asked about: short decimals, the same in every run."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

ANSWERS: Final = Path(__file__).resolve().parent / "answers"

Range = tuple[float, float]


def draw(count: int, ranges: Sequence[Range], digits: int = 2) -> list[list[float]]:
    """Spread states evenly between the ends of each number, rounded to so many decimals.

    A Kronecker sequence: each number goes on by its own power of a root that is as irrational as
    can be (Roberts 2018, the generalised golden ratio), modulo 1. No generator, no seed.
    """
    root = 2.0
    for _ in range(100):
        root = (1.0 + root) ** (1.0 / (len(ranges) + 1))
    return [
        [
            round(low + (high - low) * ((0.5 + k * root ** -(place + 1)) % 1.0), digits)
            for place, (low, high) in enumerate(ranges)
        ]
        for k in range(count)
    ]


def write(peer: str, version: str, found: dict[str, Any]) -> None:
    """Store what a tool answered: by metric its arguments, states and values."""
    ANSWERS.mkdir(exist_ok=True)
    lines = []
    for metric, (arguments, rows) in found.items():
        inner = ",\n".join("   " + json.dumps([_plain(value) for value in row]) for row in rows)
        lines.append(
            f' {json.dumps(metric)}: {{"arguments": {json.dumps(arguments)}, "rows": [\n{inner}]}}'
        )
    head = f' "peer": {json.dumps(peer)},\n "version": {json.dumps(version)},\n'
    text = "{\n" + head + ' "metrics": {\n' + ",\n".join(lines) + "\n }\n}\n"
    (ANSWERS / f"{peer}.json").write_text(text, "utf-8")


def _plain(value: float | None) -> float | str | None:
    """JSON has no infinity."""
    return value if value is None or math.isfinite(value) else str(value)


def read(peer: str) -> dict[str, Any]:
    """Read what a tool answered; every row ends with its value, None for none."""
    found: dict[str, Any] = json.loads((ANSWERS / f"{peer}.json").read_text("utf-8"))
    for metric in found["metrics"].values():
        metric["rows"] = [
            [float(item) if isinstance(item, str) else item for item in row]
            for row in metric["rows"]
        ]
    return found
