"""Read what halving the step changed in a campaign."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from adeye.campaign.lookup import find_called
from adeye.errors import InputError
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.store.halving import UncertaintyRecord


@dataclass(frozen=True)
class UncertaintyTable:
    """What halving the step changed in a campaign.

    Attributes:
        campaign: Id.
        odd: Id of its ODD.
        step_s: Its step [s].
        lines: By scenario, architecture, metric or FSR, and unit.
    """

    campaign: str
    odd: str
    step_s: float
    lines: tuple[UncertaintyRecord, ...]


def uncertainty_table(db: str | Path | None, what: str | None = None) -> UncertaintyTable:
    """Read the numeric uncertainty of a campaign.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        what: A campaign, or an ODD's file or id; None for the latest campaign.

    Raises:
        InputError: There is no such campaign, or it has no uncertainty.
    """
    with Repository.open(db, create=False) as repository:
        info = find_called(repository, what)
        odd = repository.content("odd", info.odd_digest)["odd"]
        lines = repository.hindsight.half_steps.uncertainty(info.id)
    if odd.get("uncertainty") is None:
        raise InputError(
            f"campaign {info.id[:12]} of {info.odd} was judged without numeric uncertainty",
            remedy="Write `uncertainty: {situations: 20}` into the ODD and run it again.",
        )
    if not lines:
        raise InputError(
            f"campaign {info.id[:12]} of {info.odd} has no numeric uncertainty yet",
            remedy="Its twins with half the step are not all executed; run it again to go on.",
        )
    return UncertaintyTable(info.id, info.odd, float(odd["step"]), lines)
