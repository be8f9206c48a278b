"""The one way to write a formula: what it asks for, apart from how it is spelt."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.evaluation.stl.syntax import (
    Arithmetic,
    Assertion,
    Comparison,
    Connective,
    Constant,
    Edge,
    Equality,
    Not,
    Past,
    Previous,
    Signal,
    Since,
    Temporal,
    Until,
    children,
    window_of,
)

if TYPE_CHECKING:
    from adeye.evaluation.stl.syntax import Node


def canonical(node: Node) -> str:
    """Write a node in prefix notation, so that two spellings of one formula come out equal.

    Spaces, redundant parentheses and the names of parameters are gone. Numbers are in SI, as the
    shortest text that reads back: they are not rounded, because a threshold in the last digit
    decides a run that lies on it. A unit is converted with one rounding, so ``100 cm`` is ``1 m``.

    >>> from adeye.evaluation.stl.formula import parse_formula
    >>> canonical(parse_formula("always[0 s, 500 ms] ((gap)>=100 cm)").root)
    '(always [0.0,0.5] (>= gap 1.0{1,0,0}))'
    """
    match node:
        case Constant(value=value, exponents=exponents):
            # Zero has no sign, as nothing is below the one and not below the other.
            dimension = ",".join(map(str, exponents)) if any(exponents) else ""
            return f"{value + 0.0!r}{{{dimension}}}"
        case Signal(name=name) | Assertion(name=name):
            return name
    window = window_of(node)
    words = [_head(node)]
    if window is not None:
        words.append(f"[{window.first_s + 0.0!r},{window.last_s + 0.0!r}]")
    words += [canonical(child) for child in children(node)]
    return f"({' '.join(words)})"


def _head(node: Node) -> str:
    """Name what a node does with its parts."""
    match node:
        case Equality(is_negated=is_negated):
            return "!=" if is_negated else "=="
        case Not():
            return "not"
        case Previous():
            return "previous"
        case Until():
            return "until"
        case Since():
            return "since"
        case (
            Arithmetic(operator=operator)
            | Comparison(operator=operator)
            | Connective(operator=operator)
            | Edge(operator=operator)
            | Temporal(operator=operator)
            | Past(operator=operator)
        ):
            return operator
        case _:
            msg = f"{type(node).__name__} has no parts"
            raise TypeError(msg)
