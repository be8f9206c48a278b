"""The verdict of every FSR for every architecture over all scenarios, and the gate's exit code."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from adeye.errors import IntegrityError
from adeye.evaluation.verdict import (
    ExitCode,
    Verdict,
    exercised_of,
    exit_code,
    fold_runs,
    gate_exit,
)
from adeye.store.blocking import (
    channel_failures,
    contacts_in_words,
    preventable_by,
    without_unpreventable,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.store.evidence import Withdrawal
    from adeye.store.repository import Repository
    from adeye.store.rows import VerdictRecord
    from adeye.store.stored import CampaignInfo, Finding, FsrStatus, NeverHeld, RunRef


_NAMED: Final = 3
"""Altered rows that a message names; ``db verify`` names all."""


_EXPLAINED: Final = frozenset({Verdict.ERROR, Verdict.INVALID, Verdict.INCONCLUSIVE})
"""Verdicts of runs that say why in words."""


@dataclass(frozen=True, slots=True)
class Total:
    """One FSR for one architecture, folded over all runs.

    Attributes:
        fsr: Id of the FSR.
        architecture: Id of the architecture.
        asil: ASIL of the FSR.
        is_mandatory: Whether the gate needs it.
        is_in_gate: Whether the architecture decides the exit code.
        verdict: Folded; None where the FSR is not applicable.
        counts: Runs by verdict.
        exercised: Different results in which its precondition held; none where the verdict hangs on
            a nested implication that no run asked for.
        repeated: Further runs in which it held, each with the result of another.
        worst: The run that it holds in least, if any was judged.
        note: Why it is not applicable.
        min_exercised: Different results that must PASS.
        never_held: Nested implications that no run asked for.
    """

    fsr: str
    architecture: str
    asil: str
    is_mandatory: bool
    is_in_gate: bool
    verdict: Verdict | None
    counts: Mapping[Verdict, int]
    exercised: int
    repeated: int
    worst: tuple[RunRef, VerdictRecord] | None
    note: str
    min_exercised: int
    never_held: tuple[NeverHeld, ...] = ()

    @property
    def runs(self) -> int:
        """Runs planned for it."""
        return sum(self.counts.values())


def distinct(runs: int, repeated: int) -> int:
    """Count results: runs without those that repeat one."""
    return max(runs - repeated, min(runs, 1))


def totals(repository: Repository, campaign: CampaignInfo) -> tuple[Total, ...]:
    """Fold every FSR for every architecture; waivers must be valid today.

    Args:
        repository: The database.
        campaign: The campaign.
    """
    gate = {(item.fsr, item.architecture): item for item in repository.gate(campaign.id)}
    nested = repository.never_held(campaign.id)
    groups: dict[tuple[str, str], list[FsrStatus]] = defaultdict(list)
    for item in repository.fsr_status(campaign.id):
        groups[item.fsr, item.architecture].append(item)
    return tuple(
        _total(repository, campaign, items, gate.get(key), nested.get(key, ()))
        for key, items in groups.items()
    )


def _total(
    repository: Repository,
    campaign: CampaignInfo,
    items: list[FsrStatus],
    gate: FsrStatus | None,
    never_held: tuple[NeverHeld, ...],
) -> Total:
    first = items[0]
    counts: Counter[Verdict] = Counter()
    for item in items:
        counts.update(item.counts)
    verdict: Verdict | None = None
    worst: tuple[tuple[RunRef, VerdictRecord], ...] = ()
    if first.is_applicable:
        verdict = gate.verdict if gate else asked_for(_folded(first, counts), never_held)
        worst = repository.worst_runs(
            campaign.id, first.fsr, architecture=first.architecture, limit=1
        )
    exercised = distinct(sum(item.runs_exercised for item in items), first.repeated)
    return Total(
        fsr=first.fsr,
        architecture=first.architecture,
        asil=first.asil,
        is_mandatory=gate is not None,
        is_in_gate=first.architecture in campaign.gate,
        verdict=verdict,
        counts={key: count for key, count in counts.items() if count},
        exercised=0 if any(item.decides for item in never_held) else exercised,
        repeated=first.repeated,
        worst=worst[0] if worst else None,
        note="" if first.is_applicable else first.reason or "not applicable",
        min_exercised=first.min_exercised,
        never_held=never_held,
    )


def asked_for(verdict: Verdict, never_held: Sequence[NeverHeld]) -> Verdict:
    """Take a PASS for VACUOUS that hangs on implications whose antecedent never held."""
    is_empty = verdict is Verdict.PASS and any(item.decides for item in never_held)
    return Verdict.VACUOUS if is_empty else verdict


def _never(item: Total) -> list[str]:
    """Say what an FSR was never asked for."""
    return [f"{part.antecedent} never held" for part in item.never_held]


def _repeats(repeated: int, architecture: str) -> str:
    return f"{repeated:,} runs of {architecture} repeat a result, which counts once"


def _folded(item: FsrStatus, counts: Mapping[Verdict, int]) -> Verdict:
    try:
        return fold_runs(counts, min_exercised=item.min_exercised, repeated=item.repeated_passes)
    except ValueError as error:
        # Nothing that was written counts below zero.
        raise IntegrityError(
            f"{item.fsr} for {item.architecture}: {error}. Run 'adeye db verify'; it names the row."
        ) from error


def _why(repository: Repository, campaign: CampaignInfo, item: Total) -> str:
    """Say why a run has no verdict; a violation is explained by its margin."""
    if item.verdict is None:
        return f" ({item.note})"
    if item.verdict is Verdict.VACUOUS:
        said = _never(item)
        if item.repeated:
            said.append(_repeats(item.repeated, item.architecture))
        if item.min_exercised > 1:
            told = exercised_of(item.verdict, item.exercised, item.runs, item.min_exercised)
            said.insert(0, f"exercised in {told}")
        return f" ({'; '.join(said)})" if said else ""
    if item.verdict not in _EXPLAINED:
        return ""
    found = repository.worst_runs(
        campaign.id, item.fsr, architecture=item.architecture, verdict=item.verdict, limit=1
    )
    said = [text for _, run in found for text in (run.signal, run.detail) if run.detail and text]
    return f" ({', '.join(said)})" if said else ""


def _named(unsound: Sequence[Finding]) -> str:
    """Name what is not as it was written; no verdict is folded from it."""
    named = [str(item) for item in unsound[:_NAMED]]
    if len(unsound) > _NAMED:
        named.append(f"{len(unsound) - _NAMED} more")
    return f"The database is not as it was written: {'; '.join(named)}. Run 'adeye db verify'."


def _told(withdrawn: Sequence[Withdrawal]) -> str:
    """Say of withdrawn results which, by whom and why."""
    said = [
        f"{item.result_digest[:12]} by {item.author}: {item.reason}" for item in withdrawn[:_NAMED]
    ]
    if len(withdrawn) > _NAMED:
        said.append(f"{len(withdrawn) - _NAMED} more")
    return f"{len(withdrawn)} results are withdrawn ({'; '.join(said)})"


def _accounted(repository: Repository, campaign: CampaignInfo) -> tuple[int, int, tuple[str, ...]]:
    """Count planned test cases, and those with evidence; say what became of the others."""
    progress = repository.progress(campaign.id)
    withdrawn = repository.evidence.withdrawals(campaign.id)
    lost = []
    if progress.accounted < progress.planned:
        lost.append(f"{progress.accounted} of {progress.planned} test cases accounted for")
    if withdrawn:
        lost.append(_told(withdrawn))
    return progress.planned, progress.accounted - len(withdrawn), tuple(lost)


def gate_code(repository: Repository, campaign: CampaignInfo) -> tuple[ExitCode, str]:
    """Decide the exit code of a campaign and say why.

    Args:
        repository: The database.
        campaign: The campaign.
    """
    unsound = repository.unsound(campaign.id)
    if unsound:
        return ExitCode.INTEGRITY, _named(unsound)
    verdicts: dict[str, list[Verdict]] = {name: [] for name in campaign.gate}
    reasons: list[str] = []
    aside: list[str] = []
    beside: list[str] = []
    repeated = Counter[str]()
    models = preventable_by(repository, campaign)
    for item in totals(repository, campaign):
        if not (item.is_in_gate and item.is_mandatory):
            continue
        # An FSR that cannot be judged for an architecture in the gate is never green.
        verdict, note = item.verdict or Verdict.ERROR, ""
        text = f"{item.fsr} {verdict} for {item.architecture}"
        if verdict is Verdict.FAIL and models:
            verdict, note = without_unpreventable(
                repository, campaign, item.fsr, item.architecture, models
            )
            verdict = asked_for(verdict, item.never_held)
        verdicts[item.architecture].append(verdict)
        if verdict is not Verdict.PASS:
            why = _why(repository, campaign, item)
            reasons.append(f"{text}{note and f' ({note})'}{why}")
        elif note:
            aside.append(f"{text}, {note}")
        if verdict is Verdict.PASS and (said := _never(item)):
            beside.append(f"{item.fsr} for {item.architecture}: {'; '.join(said)}")
        repeated |= Counter({item.architecture: item.repeated})
    planned, accounted, lost = _accounted(repository, campaign)
    code = gate_exit(verdicts, planned=planned, accounted=accounted)
    reasons += [*lost, *_unasked(verdicts)]
    failures = channel_failures(repository, campaign)
    if any(item.refused for item in failures):
        code = exit_code([code, ExitCode.INCOMPLETE])
    told = sorted(failures, key=lambda item: not item.refused)
    if code is not ExitCode.OK:
        return code, "; ".join([*reasons, *aside, *map(str, told)]) or code.meaning
    # A contact that no FSR forbids and a failure that is mastered are green, and are said.
    beside += [_repeats(count, name) for name, count in repeated.items() if count]
    also = [*contacts_in_words(repository, campaign), *beside, *map(str, told)]
    return code, _passed(campaign, aside, also)


def _unasked(verdicts: Mapping[str, Sequence[Verdict]]) -> list[str]:
    """Say for which architectures in the gate nothing is asked for."""
    names = ", ".join(name for name, found in verdicts.items() if not found)
    return [f"no FSR is mandatory for {names}"] if names else []


def _passed(campaign: CampaignInfo, aside: Sequence[str], also: Sequence[str]) -> str:
    """Say that the gate is green, with what is beside it."""
    gate = ", ".join(campaign.gate)
    passed = f"Every mandatory requirement passes for {gate}"
    if aside:
        passed = f"{'; '.join(aside)}. Nothing else of what is mandatory fails for {gate}"
    return "; ".join([passed, *also]) + ("" if also else ".")
