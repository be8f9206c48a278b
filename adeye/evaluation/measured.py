"""What an FSR measures, apart from how it is spelt: the part of its identity that a user writes."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

from adeye.evaluation.stl.canonical import canonical
from adeye.evaluation.stl.formula import parse_formula
from adeye.evaluation.stl.syntax import nested_implications

if TYPE_CHECKING:
    from adeye.evaluation.stl.parser import Parameters
    from adeye.spec.concept import Requirement


def measured(requirement: Requirement) -> dict[str, Any]:
    """Give what an FSR asks for and where, in the one way that does not tell how it is spelt.

    Formula and bound are in SI with the values of their parameters, see ``stl.canonical``; the
    order of its scenarios does not matter.

    Raises:
        ExpressionError: The formula cannot be read.
    """
    part: dict[str, Any] = requirement.judged()
    part.pop("parameters", None)
    part["scenarios"] = sorted(set(requirement.scenarios))
    if requirement.formula is not None:
        part["formula"] = _formula(requirement)[0]
    elif requirement.bound is not None:
        limit = requirement.bound.limit
        value = requirement.constants[limit][0] if isinstance(limit, str) else limit
        # A whole number may be written without a fraction, and is no other bound for it.
        part["bound"] = {
            **part["bound"],
            requirement.bound.side: None if value is None else float(value),
        }
        part["bound"].pop("unusual_side", None)
    return part


def reads_odd(requirement: Requirement) -> bool:
    """Tell whether a verdict depends on the attributes of the ODD: the formula names ``in_odd``."""
    return requirement.formula is not None and "in_odd" in _formula(requirement)[1]


def nested_antecedents(formula: str | None, constants: Parameters) -> tuple[str, ...]:
    """Quote the antecedents of the implications below the top level of a formula.

    Args:
        formula: Its text; None for a bound, which has none.
        constants: Parameters in SI with their exponents.

    Raises:
        ExpressionError: The formula cannot be read.
    """
    return () if formula is None else _written(formula, tuple(sorted(constants.items())))[2]


def _formula(requirement: Requirement) -> tuple[str, tuple[str, ...], tuple[str, ...]]:
    constants = tuple(sorted(requirement.constants.items()))
    return _written(requirement.formula or "", constants)


@lru_cache(maxsize=1024)
def _written(
    text: str, constants: tuple[tuple[str, tuple[float, tuple[int, int, int]]], ...]
) -> tuple[str, tuple[str, ...], tuple[str, ...]]:
    """Read a formula; give its canonical text, the signals that it names and nested antecedents."""
    formula = parse_formula(text, parameters=dict(constants))
    nested = tuple(formula.quote(node.left) for node in nested_implications(formula.root))
    return canonical(formula.root), formula.names, nested
