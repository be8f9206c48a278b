"""ASIL: its determination for a hazardous event, and its decomposition over two requirements."""

from __future__ import annotations

from itertools import combinations_with_replacement
from typing import Final, Literal

Asil = Literal["QM", "A", "B", "C", "D"]
ASIL_ORDER: tuple[Asil, ...] = ("QM", "A", "B", "C", "D")

RequirementAsil = Literal[
    "QM", "A", "B", "C", "D",
    "QM(A)", "A(A)",
    "QM(B)", "A(B)", "B(B)",
    "QM(C)", "A(C)", "B(C)", "C(C)",
    "QM(D)", "A(D)", "B(D)", "C(D)", "D(D)",
]  # fmt: skip
"""ASIL of a requirement: whole, or what a decomposition left of that of the goal in brackets."""

CHILDREN: Final = 2
"""Requirements that one step of a decomposition gives."""


def determine_asil(severity: str, exposure: str, controllability: str) -> Asil | None:
    """Derive the ASIL of a hazardous event.

    Args:
        severity: ``S0`` to ``S3``.
        exposure: ``E0`` to ``E4``.
        controllability: ``C0`` to ``C3``.

    Returns:
        The ASIL, or None where a class is 0 and no ASIL is assigned.

    Raises:
        ValueError: A class is unknown; it is never taken for QM.

    Source:
        ISO 26262-3:2018, table 4, as quoted in public secondary sources.

    >>> determine_asil("S3", "E4", "C3")
    'D'
    >>> determine_asil("S1", "E2", "C3")
    'QM'
    """
    limits = (("S", 3, severity), ("E", 4, exposure), ("C", 3, controllability))
    total = 0
    unassigned = False
    for letter, top, text in limits:
        if text not in {f"{letter}{value}" for value in range(top + 1)}:
            raise ValueError(f"{text!r} is not one of {letter}0 to {letter}{top}")
        unassigned = unassigned or text[1] == "0"
        total += int(text[1])
    if unassigned:
        return None
    return ASIL_ORDER[max(0, total - 6)]


def own_asil(asil: str) -> Asil:
    """Return what a requirement itself has to meet.

    Raises:
        ValueError: There is no such ASIL.

    >>> own_asil("B(D)")
    'B'
    """
    return ASIL_ORDER[rank(asil)]


def goal_of(asil: str) -> str:
    """Return the ASIL of the goal that a decomposed requirement names; empty for a whole one.

    >>> goal_of("B(D)"), goal_of("B")
    ('D', '')
    """
    return asil.partition("(")[2].removesuffix(")")


def rank(asil: str) -> int:
    """Count an ASIL from 0 for QM to 4 for D; what stands in brackets does not count.

    Raises:
        ValueError: There is no such ASIL.

    >>> rank("QM(D)"), rank("D")
    (0, 4)
    """
    letters: tuple[str, ...] = ASIL_ORDER
    return letters.index(asil.partition("(")[0])


def schemes(parent: str) -> tuple[tuple[Asil, Asil], ...]:
    """List the pairs into which an ASIL may be decomposed in one step.

    Counting from QM as 0 to D as 4, the two children sum up to the parent. QM is not decomposed.

    Args:
        parent: ASIL of the requirement that is decomposed; brackets do not count.

    Source:
        ISO 26262-9:2018, clause 5, as quoted in public secondary sources.

    >>> schemes("C")
    (('B', 'A'), ('C', 'QM'))
    """
    top = rank(parent)
    pairs = combinations_with_replacement(range(top + 1), CHILDREN)
    found = [(high, low) for low, high in pairs if low + high == top and top > 0]
    return tuple((ASIL_ORDER[high], ASIL_ORDER[low]) for high, low in sorted(found))


def scheme_text(children: tuple[str, ...], goal: str) -> str:
    """Write a decomposition as it is read, the higher ASIL first.

    >>> scheme_text(("A", "C(D)"), "D")
    'C(D) + A(D)'
    """
    ordered = sorted(children, key=rank, reverse=True)
    return " + ".join(f"{own_asil(child)}({goal})" for child in ordered)
