"""Which failures block the gate: all, but for contacts that a reference driver has as well.

A channel that raised, died, hung or answered nonsense blocks it too, though everything passes: what
masters the failure hides that the channel is defect. It does not where a mandatory FSR about the
silence of the channel passes in the run, or where the ODD allows it.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Final, Literal

from adeye.evaluation.preventability import gate_verdict
from adeye.evaluation.stl.formula import parse_formula
from adeye.evaluation.stl.syntax import silence_of
from adeye.evaluation.verdict import Verdict
from adeye.spec.concept import Concept
from adeye.spec.quantity import SI

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.store.repository import Repository
    from adeye.store.stored import CampaignInfo

EDITION: Final = "r157-01"
"""Edition of the models that a gate names."""
_REMEDY: Final = "mend the channel, or allow it: `gate: {channel_failures: allow}`"
_TIME: Final = re.compile(r"^at \S+ s: ")
"""When it happened in the run differs from run to run."""


def preventable_by(repository: Repository, campaign: CampaignInfo) -> tuple[str, ...]:
    """Return the reference drivers that the gate of a campaign's ODD names; none without."""
    return tuple(_gate_of(repository, campaign).get("preventable_by", ()))


def _gate_of(repository: Repository, campaign: CampaignInfo) -> Mapping[str, Any]:
    odd = repository.content("odd", campaign.odd_digest).get("odd")
    gate = odd.get("gate") if isinstance(odd, dict) else None
    return gate or {}


@dataclass(frozen=True, slots=True)
class ChannelFailure:
    """How one channel of an architecture failed in the runs of a campaign.

    Attributes:
        architecture: Id.
        channel: Id.
        outcome: ``channel_error``, ``channel_timeout``, ``channel_invalid_output`` or
            ``channel_killed``.
        runs: In how many runs.
        refused: In how many of them it blocks the gate.
        detail: What happened most often: exception, file and line.
        others: How many other things happened.
        why: What is said to the gate about it; empty where the architecture is in none.
    """

    architecture: str
    channel: str
    outcome: str
    runs: int
    refused: int
    detail: str
    others: int
    why: str

    def __str__(self) -> str:
        """Say it in one sentence without an end."""
        more = f", and {self.others:,} more" if self.others else ""
        detail = f" ({self.detail}{more})" if self.detail else ""
        text = f"{self.outcome} of channel {self.channel} in {_runs(self.runs)} of "
        return f"{text}{self.architecture}{detail}{self.why and f', {self.why}'}"


def channel_policy(repository: Repository, campaign: CampaignInfo) -> Literal["refuse", "allow"]:
    """Return what the gate of a campaign's ODD says to failures of channels."""
    says = _gate_of(repository, campaign).get("channel_failures")
    return "allow" if says == "allow" else "refuse"


def channel_failures(repository: Repository, campaign: CampaignInfo) -> tuple[ChannelFailure, ...]:
    """List how channels failed, and say whether that blocks the gate.

    Args:
        repository: The database.
        campaign: The campaign.
    """
    if not repository.failed_channels(campaign.id):
        return ()
    about = _about_silence(repository, campaign)
    details: dict[tuple[str, str, str], Counter[str]] = defaultdict(Counter)
    unmastered: Counter[tuple[str, str, str]] = Counter()
    for architecture, channel, told, is_mastered, count in repository.failed_channels(
        campaign.id, about
    ):
        outcome, _, detail = told.partition(": ")
        key = architecture, channel, outcome
        details[key][_TIME.sub("", detail).partition("\n")[0]] += count
        unmastered[key] += 0 if is_mastered else count
    allows = channel_policy(repository, campaign) == "allow"
    found = []
    for key, counts in sorted(details.items()):
        is_in_gate = key[0] in campaign.gate
        refused = unmastered[key] if is_in_gate and not allows else 0
        by = ", ".join(fsr for fsr, channel in about if channel == key[1])
        if refused:
            why = f"refused: in {_runs(refused)} no mandatory FSR about it passes ({_REMEDY})"
        else:
            why = "allowed by the ODD" if unmastered[key] else f"which {by} is about"
        detail = max(sorted(counts), key=counts.__getitem__)
        found.append(
            ChannelFailure(
                *key,
                runs=counts.total(),
                refused=refused,
                detail=detail,
                others=len(counts) - 1,
                why=why if is_in_gate else "",
            )
        )
    return tuple(found)


def contacts_in_words(repository: Repository, campaign: CampaignInfo) -> list[str]:
    """Say of each architecture in the gate in how many runs it touched something, if in any."""
    found = repository.contacts(campaign.id)
    return [f"contact in {_runs(found[name])} of {name}" for name in campaign.gate if name in found]


def _about_silence(repository: Repository, campaign: CampaignInfo) -> list[tuple[str, str]]:
    """Pair each mandatory FSR with the channels whose failure its formula is about."""
    concept = repository.content("concept", campaign.concept_digest)
    read = Concept.model_validate(concept, context=SI)
    return [
        (item.id, channel)
        for item in read.requirements
        if item.mandatory and item.formula is not None
        for channel in silence_of(parse_formula(item.formula, None, item.constants).root)
    ]


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
