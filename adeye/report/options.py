"""What a comparison is asked: which architectures, measured by what; refused where it is wrong."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from adeye.errors import UsageError, suggest

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

CONFIDENCE: Final = 0.95
DEFAULT_OBJECTIVES: Final = ("failures", "availability", "cost")
OBJECTIVES: Final = {
    "failures": "lower",
    "margin": "higher",
    "availability": "higher",
    "cost": "lower",
}
"""What candidates can be measured by, and which way is better.

``failures``: shared test cases in which a mandatory FSR fails or is undecided. ``margin``: least
robustness of those FSRs. ``availability``: share of fault-free runs without a takeover. ``cost``.
"""


@dataclass(frozen=True)
class CompareOptions:
    """What is compared and how.

    Attributes:
        architectures: Ids; none: all of the campaign.
        baseline: The one that all others are compared with; None: every pair.
        confidence: Of intervals.
        objectives: What the front is made of.
        epsilon: Difference that does not count, by objective.
    """

    architectures: Sequence[str] = ()
    baseline: str | None = None
    confidence: float = CONFIDENCE
    objectives: Sequence[str] = DEFAULT_OBJECTIVES
    epsilon: Mapping[str, float] = field(default_factory=dict)

    def chosen(self, known: Sequence[str]) -> list[str]:
        """Give the architectures to compare in the order of the ODD, the baseline first.

        Args:
            known: Those of the ODD.

        Raises:
            UsageError: One is unknown, or there are fewer than two.
        """
        wanted = list(dict.fromkeys(self.architectures)) or list(known)
        if self.baseline is not None and self.baseline not in wanted:
            wanted.append(self.baseline)
        for name in wanted:
            if name not in known:
                raise UsageError(
                    f"the campaign has no architecture {name!r}, but {', '.join(known)}",
                    remedy=suggest(name, known),
                )
        if len(wanted) < 2:
            raise UsageError(
                f"there is nothing to compare {wanted[0]!r} with"
                if wanted
                else "the campaign has no architecture",
                remedy="Name two architectures of one campaign, or list more of them in the ODD.",
            )
        return sorted(wanted, key=lambda name: (name != self.baseline, known.index(name)))

    def check(self) -> None:
        """Refuse what cannot be computed.

        Raises:
            UsageError: Confidence, an objective or an epsilon is unknown, repeated or out of
                range.
        """
        if not 0.5 <= self.confidence < 1.0:
            raise UsageError(
                f"confidence is {self.confidence:g}", remedy="Give one from 0.5 to below 1."
            )
        if not self.objectives:
            raise UsageError(
                "no objective is given", remedy=f"Give some of {', '.join(OBJECTIVES)}."
            )
        for number, name in enumerate(self.objectives):
            _check_objective(name)
            if name in self.objectives[:number]:
                raise UsageError(
                    f"objective {name!r} is given twice",
                    remedy="Give each once; the first decides between equals.",
                )
        for name, value in self.epsilon.items():
            _check_objective(name)
            if not 0.0 <= value < float("inf"):
                raise UsageError(
                    f"epsilon of {name} is {value:g}", remedy="Give a finite number, 0 or more."
                )
            if name not in self.objectives:
                raise UsageError(
                    f"epsilon of {name} has no effect: the objectives are "
                    f"{', '.join(self.objectives)}",
                    remedy=f"Leave it out, or add {name} to the objectives.",
                )


def _check_objective(name: str) -> None:
    if name not in OBJECTIVES:
        allowed = f"Allowed: {', '.join(OBJECTIVES)}."
        near = suggest(name, OBJECTIVES)
        raise UsageError(
            f"there is no objective {name!r}",
            remedy=near if near == allowed else f"{near} {allowed}",
        )
