"""Which failures block the gate: all, but for contacts that a reference driver has as well."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final

from adeye.evaluation.preventability import gate_verdict
from adeye.evaluation.verdict import Verdict

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.store.repository import Repository
    from adeye.store.stored import CampaignInfo

EDITION: Final = "r157-01"
"""Edition of the models that a gate names."""


def preventable_by(repository: Repository, campaign: CampaignInfo) -> tuple[str, ...]:
    """Return the reference drivers that the gate of a campaign's ODD names; none without."""
    odd = repository.content("odd", campaign.odd_digest).get("odd")
    gate = odd.get("gate") if isinstance(odd, dict) else None
    return tuple(gate.get("preventable_by", ())) if gate else ()


def without_unpreventable(
    repository: Repository,
    campaign: CampaignInfo,
    fsr: str,
    architecture: str,
    models: Sequence[str],
) -> tuple[Verdict, str]:
    """Fold an FSR that fails for the gate, without contacts that no model avoids.

    Args:
        repository: The database.
        campaign: The campaign.
        fsr: Id of a mandatory FSR that FAILs.
        architecture: Id of an architecture in the gate.
        models: Reference drivers, all of which must have a contact too.

    Returns:
        What the gate takes for the verdict, and why in words; empty if nothing is to be said.
    """
    today = datetime.now(UTC).date()
    (status,) = (
        item
        for item in repository.gate(campaign.id)
        if (item.fsr, item.architecture) == (fsr, architecture)
    )
    until = status.waived_until
    verdict, aside, unknown = gate_verdict(
        status.counts,
        repository.hindsight.benchmarks.failures(campaign.id, fsr, architecture, EDITION),
        models,
        min_exercised=status.min_exercised,
        is_waived=until is not None and until >= today.isoformat(),
        repeated=status.repeated_passes,
    )
    by, notes = ", ".join(models), []
    if aside:
        how = "not blocking: " if verdict is Verdict.PASS else ""
        notes.append(f"{how}unpreventable by {by} ({_runs(aside)})")
    if aside and verdict not in {Verdict.FAIL, Verdict.PASS}:
        notes.append(f"{verdict} without them")
    if unknown:
        notes.append(
            f"{_runs(unknown)} not known to be unpreventable by {by}: "
            f"run `adeye preventability {campaign.number} --model {','.join(models)}`"
        )
    return verdict, "; ".join(notes)


def _runs(count: int) -> str:
    return f"{count:,} run{'' if count == 1 else 's'}"
