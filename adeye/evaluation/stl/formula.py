"""A parsed formula: what it reads, how far it looks ahead, whether it fits the signals."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

from adeye.errors import ExpressionError
from adeye.evaluation.stl.check import check_condition
from adeye.evaluation.stl.lexer import cut
from adeye.evaluation.stl.parser import Parameters, parse_with
from adeye.evaluation.stl.syntax import (
    Condition,
    Node,
    first_looking_back,
    future_reach,
    names_in,
    needed_time,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.errors import SourceLocation
    from adeye.evaluation.stl.series import SignalEntry


@dataclass(frozen=True, slots=True)
class Formula:
    """A formula of signal temporal logic.

    Attributes:
        text: What the user wrote.
        where: Place of the text in a file, if it came from one.
        root: Abstract syntax.
        names: Signals that it reads, in the order of the text.
        reach_s: Time after an obligation's start that its truth may depend on [s]; infinite for an
            operator without a window below another one.
        parameters: Those that it names, with their values in SI.
    """

    text: str
    where: SourceLocation | None
    root: Condition
    names: tuple[str, ...]
    reach_s: float
    parameters: tuple[tuple[str, float], ...] = ()

    def quote(self, node: Node) -> str:
        """Give the part of the text that a node was read from, on one line."""
        return " ".join(self.text[slice(*node.span)].split())

    def needed_tail_s(self, horizon_s: float) -> float:
        """Give the time that must be simulated after the horizon to decide every obligation [s].

        Args:
            horizon_s: Last time at which an obligation of an outermost operator may start [s].
        """
        return max(0.0, needed_time(self.root, horizon_s) - horizon_s)

    def check(self, dictionary: Mapping[str, SignalEntry]) -> None:
        """Refuse names that do not exist and kinds or dimensions that do not fit.

        Args:
            dictionary: The signals that a formula may name.

        Raises:
            ExpressionError: The first misfit, with a suggestion.
        """
        check_condition(self.root, dictionary, self.text, self.where)


def parse_formula(
    text: str, where: SourceLocation | None = None, parameters: Parameters = MappingProxyType({})
) -> Formula:
    """Parse a formula.

    Args:
        text: The formula, for example ``always (contact == false and gap > 2 m)``.
        where: Place of the text in a file, for messages.
        parameters: Words that stand for a constant.

    Returns:
        The formula.

    Raises:
        ExpressionError: The text is no formula; the message gives the position in it. Or it would
            look back from the first row only, before which there is nothing.
    """
    root, used = parse_with(parameters, text, where)
    looking_back = first_looking_back(root)
    if looking_back is not None:
        part = " ".join(text[slice(*looking_back.span)].split())
        raise ExpressionError(
            f"formula '{cut(text)}', character {looking_back.span[0] + 1}: '{part}' would look "
            "back from the first row only",
            where=where,
            remedy=f"Ask for it at every row: always({part}).",
        )
    named = tuple((name, parameters[name][0]) for name in sorted(used))
    return Formula(text, where, root, names_in(root), future_reach(root), named)
