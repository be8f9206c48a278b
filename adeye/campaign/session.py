"""What is asked of one execution of a campaign: how much of it, and what ends it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from adeye.campaign.choosing import Choice
from adeye.campaign.stopping import Limits, Stop

DEADLINE_S: Final = 3_600.0
"""How long a worker process may take for one block unless said otherwise [s]."""


@dataclass(frozen=True, slots=True)
class Session:
    """One execution.

    Attributes:
        choice: Which test cases are executed.
        limits: After how much of it no block is begun any more.
        stop: Whether somebody asked it to end.
        deadline_s: How long a worker process may take for one block [s].
    """

    choice: Choice = field(default_factory=Choice)
    limits: Limits = field(default_factory=Limits)
    stop: Stop = field(default_factory=Stop)
    deadline_s: float = DEADLINE_S

    @property
    def has_ended(self) -> bool:
        """Whether something ended it before all was done."""
        return self.stop.asked is not None or bool(self.limits.reached)
