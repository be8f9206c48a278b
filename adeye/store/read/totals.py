"""The verdict of every FSR for every architecture over all scenarios, and the gate's exit code.

A channel that raised, died, hung or answered nonsense blocks it too, though everything passes: what
masters the failure hides that the channel is defect. It does not where a mandatory FSR about the
silence of the channel passes in the run, or where the ODD allows it.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Final, Literal

from adeye.errors import IntegrityError, amount
from adeye.judge.preventability import gate_verdict
from adeye.judge.verdict import (
    WAIVABLE,
    ExitCode,
    Verdict,
    exercised_of,
    exit_code,
    fold_runs,
    gate_exit,
)
from adeye.store.evidence.vouched import Withdrawal
from adeye.store.records import LEFT_OUT, RAISED, of_fields
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from adeye.spec.concept import Requirement
    from adeye.store.records import (
        CampaignInfo,
        Finding,
        FsrStatus,
        NeverHeld,
        RunRef,
        VerdictRecord,
    )

# --- Which failures block the gate: all, but for contacts that a reference driver has as well -----

EDITION: Final = "r157-01"
"""Edition of the models that a gate names."""
_ALLOW: Final = "`gate: {channel_failures: allow}`"
_REMEDY: Final = f"mend the channel, or allow it: {_ALLOW}"
_TIME: Final = re.compile(r"^at \S+ s: ")
"""When it happened in the run differs from run to run."""


def preventable_by(repository: Repository, campaign: CampaignInfo) -> tuple[str, ...]:
    """Return the reference drivers that the gate of a campaign's ODD names; none without."""
    return tuple(_gate_of(repository, campaign).get("preventable_by", ()))


def tolerance(repository: Repository, campaign: CampaignInfo) -> dict[str, float]:
    """Return the loss of margin that the gate of a campaign's ODD tolerates, by unit."""
    return dict(_gate_of(repository, campaign).get("tolerance", {}))


def _gate_of(repository: Repository, campaign: CampaignInfo) -> Mapping[str, Any]:
    return _of_odd(repository, campaign, "gate") or {}


def _of_odd(repository: Repository, campaign: CampaignInfo, key: str) -> Any:
    odd = repository.content("odd", campaign.odd_digest).get("odd")
    return odd.get(key) if isinstance(odd, dict) else None


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
        blocking: In how many it does, or would if the architecture were in it.
        detail: What happened most often: exception, file and line.
        others: How many other things happened.
        why: What is said to the gate about it; empty where the architecture is in none.
        is_twin: The runs are twins with half the step, which the uncertainty rests on.
    """

    architecture: str
    channel: str
    outcome: str
    runs: int
    refused: int
    detail: str
    others: int
    why: str
    blocking: int = 0
    is_twin: bool = False

    @property
    def blocking_in_words(self) -> str:
        """Say in how many runs, or twins, it blocks the gate, or would."""
        return _runs(self.blocking, is_twin=self.is_twin)

    def __str__(self) -> str:
        """Say it in one sentence without an end."""
        told = _runs(self.runs, is_twin=self.is_twin)
        more = f", and {self.others:,} more" if self.others else ""
        detail = f" ({self.detail}{more})" if self.detail else ""
        text = f"{self.outcome} of channel {self.channel} in {told} of "
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
    details: dict[tuple[str, str, str, bool], Counter[str]] = defaultdict(Counter)
    unmastered: Counter[tuple[str, str, str, bool]] = Counter()
    for architecture, channel, told, is_mastered, is_twin, count in repository.failed_channels(
        campaign.id, about
    ):
        outcome, _, detail = told.partition(": ")
        key = architecture, channel, outcome, is_twin
        details[key][_TIME.sub("", detail).partition("\n")[0]] += count
        unmastered[key] += 0 if is_mastered else count
    allows = channel_policy(repository, campaign) == "allow"
    found = []
    for key, counts in sorted(details.items()):
        is_in_gate = key[0] in campaign.gate
        blocking = 0 if allows else unmastered[key]
        refused = blocking if is_in_gate else 0
        by = ", ".join(fsr for fsr, channel in about if channel == key[1])
        if refused:
            where = _runs(refused, is_twin=key[3])
            why = f"refused: in {where} no mandatory FSR about it passes ({_REMEDY})"
        else:
            why = "allowed by the ODD" if unmastered[key] else f"which {by} is about"
        detail = max(sorted(counts), key=counts.__getitem__)
        found.append(
            ChannelFailure(
                *key[:3],
                is_twin=key[3],
                runs=counts.total(),
                refused=refused,
                detail=detail,
                others=len(counts) - 1,
                why=why if is_in_gate else "",
                blocking=blocking,
            )
        )
    return tuple(found)


def contacts_in_words(repository: Repository, campaign: CampaignInfo) -> list[str]:
    """Say of each architecture in the gate in how many runs it touched something, if in any."""
    found = repository.contacts(campaign.id)
    return [f"contact in {_runs(found[name])} of {name}" for name in campaign.gate if name in found]


def _about_silence(repository: Repository, campaign: CampaignInfo) -> list[tuple[str, str]]:
    """Pair each mandatory FSR with the channels whose failure its formula is about."""
    from adeye.judge.stl.formula import parse_formula
    from adeye.judge.stl.syntax import silence_of

    return [
        (item.id, channel)
        for item in _requirements(repository, campaign)
        if item.mandatory and item.formula is not None
        for channel in silence_of(parse_formula(item.formula, None, item.constants).root)
    ]


def _requirements(repository: Repository, campaign: CampaignInfo) -> tuple[Requirement, ...]:
    from adeye.spec.concept import Concept
    from adeye.spec.quantity import SI

    concept = repository.content("concept", campaign.concept_digest)
    return tuple(Concept.model_validate(concept, context=SI).requirements)


def _beside_contact(repository: Repository, campaign: CampaignInfo, fsr: str) -> list[str]:
    """List what an FSR is judged by beside the contact: it may fail of that in the same run."""
    from adeye.judge.stl.formula import parse_formula
    from adeye.judge.stl.syntax import names_in

    (item,) = (item for item in _requirements(repository, campaign) if item.id == fsr)
    if item.formula is None:
        names = [] if item.bound is None else [item.bound.metric]
    else:
        names = list(names_in(parse_formula(item.formula, None, item.constants).root))
    return [name for name in names if name != "contact"]


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
    failures = repository.hindsight.benchmarks.failures(campaign.id, fsr, architecture, EDITION)
    others = _beside_contact(repository, campaign, fsr)
    verdict, aside, unknown = gate_verdict(
        status.counts,
        [{} for _ in failures] if others else failures,
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
    if others and any(failures):
        notes.append(
            f"{fsr} is about {', '.join(others)}, too: write what forbids contacts as an FSR of "
            "its own to have unpreventable ones set aside"
        )
    if unknown:
        notes.append(
            f"{_runs(unknown)} not known to be unpreventable by {by}: "
            f"run `adeye preventability {campaign.number} --model {','.join(models)}`"
        )
    return verdict, "; ".join(notes)


def _runs(count: int, *, is_twin: bool = False) -> str:
    return f"{amount(count, 'twin')} with half the step" if is_twin else amount(count, "run")


# --- The verdict of every FSR for every architecture over all scenarios, and the gate's exit code -

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
    return of_fields(
        Total,
        first,
        is_mandatory=gate is not None,
        is_in_gate=first.architecture in campaign.gate,
        verdict=verdict,
        counts={key: count for key, count in counts.items() if count},
        exercised=0 if any(item.decides for item in never_held) else exercised,
        worst=worst[0] if worst else None,
        note="" if first.is_applicable else first.reason or "not applicable",
        never_held=never_held,
    )


def standing_for(
    repository: Repository,
    campaign: CampaignInfo,
    item: FsrStatus | Total,
    verdict: Verdict | None,
    scenario: str | None = None,
) -> tuple[tuple[RunRef, VerdictRecord], ...]:
    """Return the run that shows why an FSR has its verdict, at most one.

    It is the one with the least margin. Where a verdict is no matter of margins, only a run that
    has it shows why.

    Args:
        repository: Where the campaign is.
        campaign: The campaign.
        item: Which FSR and architecture.
        verdict: Over the runs.
        scenario: Of these runs; None for all.
    """
    return repository.worst_runs(
        campaign.id,
        item.fsr,
        architecture=item.architecture,
        scenario=scenario,
        verdict=verdict if verdict in _EXPLAINED else None,
        limit=1,
    )


def explained(record: VerdictRecord) -> str:
    """Say in words why a run has no verdict; nothing of one that has."""
    if record.verdict not in _EXPLAINED or not record.detail:
        return ""
    return ", ".join(filter(None, (record.signal, record.detail)))


def asked_for(verdict: Verdict, never_held: Sequence[NeverHeld]) -> Verdict:
    """Take a PASS for VACUOUS that hangs on implications whose antecedent never held."""
    is_empty = verdict is Verdict.PASS and any(item.decides for item in never_held)
    return Verdict.VACUOUS if is_empty else verdict


def _never(item: Total) -> list[str]:
    """Say what an FSR was never asked for."""
    return [f"{part.antecedent} never held" for part in item.never_held]


def _beside(item: Total) -> list[str]:
    """Say what stands beside a PASS: what was never asked for, and runs that are waived."""
    waived = sum(item.counts.get(verdict, 0) for verdict in WAIVABLE)
    return [*_never(item), *([f"{_runs(waived)} waived"] if waived else [])]


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
    for _, record in standing_for(repository, campaign, item, item.verdict):
        if reason := explained(record):
            return f" ({reason})"
    return ""


def _named(unsound: Sequence[Finding]) -> str:
    """Name what is not as it was written; no verdict is folded from it."""
    named = _first(list(map(str, unsound)))
    return f"The database is not as it was written: {named}. Run 'adeye db verify'."


def _first(texts: Sequence[str]) -> str:
    """Join the first of some texts, and count the others."""
    more = [f"{len(texts) - _NAMED} more"] if len(texts) > _NAMED else []
    return "; ".join([*texts[:_NAMED], *more])


def _told(withdrawn: Sequence[Withdrawal]) -> str:
    """Say of withdrawn results which, by whom and why; nothing if there is none."""
    said = [f"{item.result_digest[:12]} by {item.author}: {item.reason}" for item in withdrawn]
    if not said:
        return ""
    return f"{amount(len(said), 'result is', 'results are')} withdrawn ({_first(said)})"


def withdrawn_in_words(repository: Repository, campaign: CampaignInfo) -> str:
    """Say which results of a campaign are withdrawn, by whom and why; empty for none."""
    return _told(repository.evidence.withdrawals(campaign.id))


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


def _altered(repository: Repository, campaign: CampaignInfo, *, has_old: bool) -> str:
    """Say what of a campaign is not as it was written, or not as it comes out again; else ""."""
    unsound = repository.unsound(campaign.id)
    if unsound:
        return _named(unsound)
    try:
        if has_old:
            repository.require_sound(campaign.id)
    except IntegrityError as error:
        return str(error)
    return repository.uncertified(campaign.id)


def gate_code(
    repository: Repository, campaign: CampaignInfo, *, has_old: bool = False
) -> tuple[ExitCode, str]:
    """Decide the exit code of a campaign and say why.

    Args:
        repository: The database.
        campaign: The campaign.
        has_old: Whether it rests on rows that were not just written, so that each is compared.
    """
    altered = _altered(repository, campaign, has_old=has_old)
    if altered:
        return ExitCode.INTEGRITY, altered
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
        text = f"{item.fsr} {item.verdict or Verdict.ERROR} for {item.architecture}"
        verdict, note = in_gate(repository, campaign, item, models)
        verdicts[item.architecture].append(verdict)
        if verdict is not Verdict.PASS:
            why = _why(repository, campaign, item)
            reasons.append(f"{text}{note and f' ({note})'}{why}")
            continue
        aside += [f"{text}, {note}"] if note else []
        if said := _beside(item):
            beside.append(f"{item.fsr} for {item.architecture}: {'; '.join(said)}")
        repeated |= Counter({item.architecture: item.repeated})
    planned, accounted, lost = _accounted(repository, campaign)
    code = gate_exit(verdicts, planned=planned, accounted=accounted)
    reasons += [*lost, *_unasked(verdicts)]
    failures = channel_failures(repository, campaign)
    raised, again = failed_parts(repository, campaign)
    reasons += raised
    if raised or any(item.refused for item in failures):
        code = exit_code([code, ExitCode.INCOMPLETE])
    told = sorted(failures, key=lambda item: not item.refused)
    if code is not ExitCode.OK:
        return code, "; ".join([*reasons, *aside, *map(str, told)]) or code.meaning
    # A contact that no FSR forbids and a failure that is mastered are green, and are said.
    beside += [_repeats(count, name) for name, count in repeated.items() if count]
    if injected := repository.injected_faults(campaign.id):
        from adeye.spec.fault import idle_faults

        beside += [f"fault {name} {reason}" for name, reason in idle_faults((), injected)]
    beside += _empty_events(repository, campaign)
    beside += [*again, *_other_traffic(campaign)]
    beside += _left_out(repository.content("odd", campaign.odd_digest).get(LEFT_OUT, {}))
    if _of_odd(repository, campaign, "uncertainty"):
        beside += _changed_by_step(repository, campaign)
    also = [*contacts_in_words(repository, campaign), *beside, *map(str, told)]
    return code, _passed(campaign, aside, also)


def _empty_events(repository: Repository, campaign: CampaignInfo) -> list[str]:
    """Name the events that began in no run, and do not say that they need not, or did nothing."""
    unbegun = [
        (*item,) for *item, is_optional in repository.unbegun_events(campaign.id) if not is_optional
    ]
    told = {
        "began in no run": unbegun,
        "changed nothing in any run": repository.idle_events(campaign.id),
    }
    return [
        f"{what}: {', '.join(f'{event} of {scenario}' for scenario, event in found)}"
        for what, found in told.items()
        if found
    ]


def _changed_by_step(repository: Repository, campaign: CampaignInfo) -> list[str]:
    """Say where half the step gives other verdicts, or too few margins to tell what it is worth.

    Only of what is mandatory in the gate.
    """
    asked = {
        (item.fsr, item.architecture)
        for item in totals(repository, campaign)
        if item.is_in_gate and item.is_mandatory
    }
    told: dict[str, None] = {}
    for item in repository.hindsight.half_steps.uncertainty(campaign.id):
        found, whose = item.difference, f"{item.difference.name} for {item.architecture}"
        if found.kind != "fsr" or (found.name, item.architecture) not in asked:
            continue
        if found.differing:
            # An FSR with margins in several units has a record for each.
            which = ", ".join(f"{count} {change}" for change, count in found.changes.items())
            count = f"{found.differing:,} of {amount(found.sampled, 'verdict')}"
            told[f"{whose}: half the step changes {count} of {item.scenario} ({which})"] = None
        if found.pairs and found.uncertainty is None:
            count = f"{found.pairs:,} of {amount(found.sampled, 'margin')}"
            told[f"{whose}: {count} of {item.scenario} do not tell what the step is worth"] = None
    return list(told)


def refused_in_words(repository: Repository, campaign: CampaignInfo) -> list[str]:
    """Say which parts failed so that the gate refuses a campaign, whatever else is said of it."""
    failures = [str(item) for item in channel_failures(repository, campaign) if item.refused]
    return [
        f"the gate does not let campaign {campaign.id[:10]} pass: {text}"
        for text in (*failed_parts(repository, campaign)[0], *failures)
    ]


def failed_parts(repository: Repository, campaign: CampaignInfo) -> tuple[list[str], list[str]]:
    """Say which results came out only when they were tried again, and which metrics failed.

    Returns:
        Those that are refused, as code from outside raised something, and the others.
    """
    refused, others = list[str](), list[str]()
    allows = channel_policy(repository, campaign) == "allow"
    for detail, count in repository.tried_again(campaign.id).items():
        why = detail.removeprefix(RAISED).partition("\n")[0].rstrip(".")
        text = f"{amount(count, 'result')} came out only when their block was tried again: {why}"
        if allows or not detail.startswith(RAISED):
            others.append(text)
        else:
            refused.append(f"{text} (mend the part, or allow it: {_ALLOW})")
    for metric, is_twin, count in repository.unmeasured(campaign.id):
        told = _runs(count, is_twin=is_twin)
        text = f"metric {metric} raised in {told}, or gave what is no value"
        if allows:
            others.append(text)
        else:
            refused.append(f"{text} (mend it, or allow it: {_ALLOW})")
    return refused, others


def _other_traffic(campaign: CampaignInfo) -> Iterator[str]:
    """Say by what traffic was simulated, if it is not what a run without options takes."""
    backend, variant = (str(campaign.provenance.get(key, "")) for key in ("backend", "variant"))
    if backend and (backend, variant.partition("-")[0]) != ("batch", "reference"):
        yield f"traffic was simulated by {backend} {variant}, which is not the default"


def _left_out(left_out: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """Say of each scenario on maps which places it does not take, where nobody chose them."""
    for scenario, item in left_out.items():
        if first := item.get("first"):
            yield f"{scenario} takes place at {first} only, the first of its places"
        if maps := item.get("maps"):
            yield f"{scenario} has no place on {', '.join(maps)}"
        if refused := len(item.get("refused", ())):
            places = amount(refused + item["left"], "place")
            yield f"{scenario} cannot start at {refused:,} of {places}, which are left out"


def in_gate(
    repository: Repository, campaign: CampaignInfo, item: Total, models: Sequence[str]
) -> tuple[Verdict, str]:
    """Return what the gate takes for the verdict of an FSR, and why, if it is not its own."""
    if item.verdict is not Verdict.FAIL or not models:
        return item.verdict or Verdict.ERROR, ""
    verdict, note = without_unpreventable(repository, campaign, item.fsr, item.architecture, models)
    return asked_for(verdict, item.never_held), note


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
