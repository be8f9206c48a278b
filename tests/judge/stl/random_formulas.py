"""Random formulas as nested tuples, with a text for each parser, and their slow evaluation."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from adeye.judge.stl.series import Series
from tests.judge.stl.batch import numbers

NAMES = ("a", "b", "c")
AHEAD = ("always", "eventually")
BACK = ("once", "historically")
WINDOWED = (*AHEAD, *BACK, "until", "since")
BINARY = ("and", "or", "implies", "until", "since")


class Random:
    """A generator of its own, so that formulas do not change with numpy."""

    def __init__(self, seed: int) -> None:
        self.bits = np.random.default_rng(seed)

    def pick(self, *options: Any) -> Any:
        return options[int(self.bits.integers(len(options)))]

    def term(self, depth: int) -> tuple[Any, ...]:
        kind = self.pick("signal", "signal", "+", "-", "*", "abs") if depth else "signal"
        if kind == "signal":
            return ("signal", self.pick(*NAMES))
        if kind == "abs":
            return ("abs", self.term(depth - 1))
        return (kind, self.term(depth - 1), self.term(depth - 1))

    def predicate(self) -> tuple[Any, ...]:
        threshold = ("number", round(float(self.bits.random()), 2))
        return (self.pick("<", "<=", ">", ">="), self.term(2), threshold)

    def formula(
        self, depth: int, *, edges: bool = False, past: bool = False, ahead: bool = True
    ) -> tuple[Any, ...]:
        """Make a formula of this depth; the defaults have operators that look ahead only."""
        if depth == 0:
            return self.predicate()
        kind = self.pick(
            *("and", "or", "implies", "not"),
            *(("until", *AHEAD) if ahead else ()),
            *(("rise", "fall") if edges else ()),
            *(("since", "previous", *BACK) if past else ()),
        )
        operands = [
            self.formula(depth - 1, edges=edges, past=past, ahead=ahead)
            for _ in range(2 if kind in BINARY else 1)
        ]
        if kind in {*BACK, "since"} and self.pick(0, 1):
            return (kind, None, *operands)
        if kind in WINDOWED:
            first = int(self.bits.integers(4))
            return (kind, (first, first + int(self.bits.integers(5))), *operands)
        return (kind, *operands)


def text_of(node: tuple[Any, ...], separator: str) -> str:
    kind, *parts = node
    if kind in {"signal", "number"}:
        return str(parts[0])
    window = ""
    if kind in WINDOWED:
        rows = parts.pop(0)
        window = "" if rows is None else f"[{rows[0]}{separator}{rows[1]}]"
    texts = [text_of(part, separator) for part in parts]
    return (
        f"({texts[0]} {kind}{window} {texts[1]})"
        if len(texts) == 2
        else f"{kind}{window}({texts[0]})"
    )


# --- the slow reference


@dataclass
class Reference:
    """Robustness by the definition, one bound at a time; unknown rows have the widest bound."""

    signals: dict[str, np.ndarray]
    length: int
    is_boolean: bool = False

    def term(self, node: tuple[Any, ...], k: int) -> float:
        kind, *parts = node
        if kind == "number":
            return float(parts[0])
        if kind == "signal":
            return float(self.signals[parts[0]][k])
        values = [self.term(part, k) for part in parts]
        if kind == "abs":
            return abs(values[0])
        if kind == "*":
            return values[0] * values[1]
        return values[0] + values[1] if kind == "+" else values[0] - values[1]

    def bound(self, node: tuple[Any, ...], k: int, sign: int) -> float:  # noqa: PLR0911 - one a case
        """Give the upper (sign 1) or lower (-1) bound."""
        if k >= self.length:
            return sign * (1.0 if self.is_boolean else math.inf)
        kind, *parts = node
        if kind in {"<", "<=", ">", ">="}:
            left, right = (self.term(part, k) for part in parts)
            margin = right - left if kind.startswith("<") else left - right
            if self.is_boolean:
                return 1.0 if margin > 0.0 or (margin == 0.0 and kind.endswith("=")) else -1.0
            return margin
        if kind == "not":
            return -self.bound(parts[0], k, -sign)
        if kind in {"rise", "fall"}:
            return self.edge(kind, parts[0], k, sign)
        if kind in {"previous", "since", *BACK}:
            return self.looking_back(kind, parts, k, sign)
        if kind in AHEAD:
            (first, last), operand = parts
            values = [self.bound(operand, j, sign) for j in range(k + first, k + last + 1)]
            return min(values) if kind == "always" else max(values)
        if kind == "until":
            return self.until(parts, k, sign)
        if kind == "implies":
            kind, parts = "or", [("not", parts[0]), parts[1]]
        values = [self.bound(part, k, sign) for part in parts]
        return min(values) if kind == "and" else max(values)

    def edge(self, kind: str, operand: tuple[Any, ...], k: int, sign: int) -> float:
        if k == 0:
            return -1.0
        if kind == "rise":
            return min(self.bound(operand, k, sign), -self.bound(operand, k - 1, -sign))
        return min(-self.bound(operand, k, -sign), self.bound(operand, k - 1, sign))

    def rows_back(self, window: tuple[int, int] | None, k: int) -> range:
        first, last = window or (0, k)
        return range(max(k - last, 0), k - first + 1)

    def looking_back(self, kind: str, parts: list[Any], k: int, sign: int) -> float:
        most = 1.0 if self.is_boolean else math.inf
        if kind == "previous":
            return self.bound(parts[0], k - 1, sign) if k else -most
        if kind == "since":
            return self.since(parts, k, sign)
        window, operand = parts
        values = [self.bound(operand, j, sign) for j in self.rows_back(window, k)]
        return max(values, default=-most) if kind == "once" else min(values, default=most)

    def since(self, parts: list[Any], k: int, sign: int) -> float:
        window, left, right = parts
        best = -1.0 if self.is_boolean else -math.inf
        for j in self.rows_back(window, k):
            held = min((self.bound(left, i, sign) for i in range(j + 1, k + 1)), default=math.inf)
            best = max(best, min(self.bound(right, j, sign), held))
        return best

    def until(self, parts: list[Any], k: int, sign: int) -> float:
        (first, last), left, right = parts
        best = -math.inf
        for j in range(k + first, k + last + 1):
            held = min((self.bound(left, i, sign) for i in range(k, j)), default=math.inf)
            best = max(best, min(self.bound(right, j, sign), held))
        return best


def traces(random: Random, runs: int, rows: int) -> dict[str, Series]:
    return {name: numbers(random.bits.normal(size=(runs, rows))) for name in NAMES}


def rounded(node: tuple[Any, ...]) -> tuple[Any, ...]:
    """Round the thresholds of a formula."""
    if node[0] == "number":
        return ("number", round(node[1]))
    is_part = [isinstance(part, tuple) and isinstance(part[0], str) for part in node]
    return tuple(rounded(p) if known else p for p, known in zip(node, is_part, strict=True))
