"""What cannot be said about probabilities, reason by reason."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from adeye.report.claims import Claims


@dataclass(frozen=True, slots=True)
class Refusal:
    """One reason why there is no bound.

    Attributes:
        reason: Why.
        scenarios: It holds for; empty where all are meant together.
        fsrs: It holds for.
        is_all: Whether these are all FSRs.
        count: Of FSR and architecture and scenario.
    """

    reason: str
    scenarios: tuple[str, ...]
    fsrs: tuple[str, ...]
    is_all: bool
    count: int


def refusals_of(claims: Claims) -> tuple[Refusal, ...]:
    """Collect the refused claims by their reason, in the order of the first of each."""
    refused = [item for item in claims.claims if item.refusal]
    every = {item.fsr for item in claims.claims}
    found: list[Refusal] = []
    for reason in dict.fromkeys(item.refusal for item in refused):
        about = [item for item in refused if item.refusal == reason]
        fsrs = tuple(dict.fromkeys(item.fsr for item in about))
        found.append(
            Refusal(
                reason=reason,
                scenarios=tuple(dict.fromkeys(item.scenario for item in about if item.scenario)),
                fsrs=fsrs,
                is_all=len(fsrs) == len(every),
                count=len(about),
            )
        )
    return tuple(found)
