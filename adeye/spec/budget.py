"""Timing budgets of a safety goal: what its FSRs allow for detection and for reaction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.spec.concept import Requirement

_ROUNDING_S: Final = 1e-9


@dataclass(frozen=True, slots=True)
class Budget:
    """What is allowed for handling a fault.

    Attributes:
        fsrs: Ids of the FSRs that state it, each once.
        fdti: For its detection [s]; None if no FSR states it.
        frti: For the reaction [s]; None if no FSR states it.
    """

    fsrs: tuple[str, ...]
    fdti: float | None
    frti: float | None

    @property
    def total(self) -> float:
        """What is stated, together [s]; at least that much is allowed for handling."""
        return (self.fdti or 0.0) + (self.frti or 0.0)

    @property
    def is_complete(self) -> bool:
        """Whether detection and reaction are both stated, so that the total is the FHTI."""
        return self.fdti is not None and self.frti is not None

    def exceeds(self, ftti: float) -> bool:
        """Tell whether it is more than a fault-tolerant time interval [s]."""
        return self.total > ftti + _ROUNDING_S


def budgets_of(requirements: Sequence[Requirement], goal: str) -> list[Budget]:
    """List the budgets of a safety goal.

    An FSR with both parts is a budget of its own. The largest detection and the largest reaction
    that stand alone are one together: one FSR detects, another one reacts.

    Args:
        requirements: Of the concept.
        goal: Id of the safety goal.
    """
    own = [item for item in requirements if goal in item.goals]
    found = [Budget((i.id,), i.fdti, i.frti) for i in own if i.fdti and i.frti]
    detect = max(((i.fdti, i.id) for i in own if i.fdti and not i.frti), default=None)
    react = max(((i.frti, i.id) for i in own if i.frti and not i.fdti), default=None)
    if detect is not None or react is not None:
        names = tuple(part[1] for part in (detect, react) if part is not None)
        fdti = None if detect is None else detect[0]
        frti = None if react is None else react[0]
        found.append(Budget(names, fdti, frti))
    return found
