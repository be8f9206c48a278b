"""Judge a campaign for a gate: verify, fold its verdicts, compare it with a baseline."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from adeye.errors import IntegrityError
from adeye.judge.verdict import ExitCode, Verdict, exit_code
from adeye.report.gate.baseline import (
    Baseline,
    Finding,
    Kind,
    deciding,
    gate_code_of,
    read_baseline,
    write_baseline,
)
from adeye.report.gate.changes import Snapshot, Tolerances, changes, check_same_odd, state_of
from adeye.report.gate.snapshot import MAX_CASES, case_keys, take_down
from adeye.report.words import counted, unit_text
from adeye.store.read.totals import (
    ChannelFailure,
    channel_failures,
    gate_code,
    preventable_by,
    totals,
    without_unpreventable,
)
from adeye.store.records import CampaignInfo
from adeye.store.repository import Repository

MAX_ALTERED: Final = 20
"""Altered rows that are named; ``adeye db verify`` names all."""


@dataclass(frozen=True)
class GateResult:
    """What a gate found.

    Attributes:
        campaign: Id of the campaign.
        number: Its number.
        state: The campaign as a baseline would keep it.
        work: ``complete``, ``running``, ``interrupted`` or ``quarantined``.
        baseline: File that it was compared with, if any.
        own: What was found in the campaign, what decides first.
        changes: What differs from the baseline, what decides first.
        exit_code: The answer.
        message: Why, with every exit code that applies.
        is_written: Whether the baseline was written.
        channel_failures: How channels failed, also where that is mastered.
        contacts: Runs that a contact ended, by architecture.
    """

    campaign: str
    number: int
    state: Baseline
    work: str
    baseline: str
    own: tuple[Finding, ...]
    changes: tuple[Finding, ...]
    exit_code: ExitCode
    message: str
    is_written: bool = False
    channel_failures: tuple[ChannelFailure, ...] = ()
    contacts: Mapping[str, int] = field(default_factory=dict)

    def __bool__(self) -> bool:
        """Be as true as the gate."""
        return self.exit_code == ExitCode.OK

    @property
    def findings(self) -> tuple[Finding, ...]:
        """All of them."""
        return self.own + self.changes


def judge_campaign(
    repository: Repository,
    campaign: CampaignInfo,
    path: Path | None,
    tolerances: Tolerances,
    *,
    may_lack: bool = False,
    edits: str = "",
) -> GateResult:
    """Judge a stored campaign, against a baseline if there is one.

    Args:
        repository: The database.
        campaign: The campaign.
        path: The baseline; None for the verdicts of the campaign alone.
        tolerances: Losses of margin that do not count.
        may_lack: Whether the file may not exist, because it will be written.
        edits: Why the campaign is not what its files plan now; then its evidence is not theirs.

    Raises:
        InputError: The file is no baseline, or is of another ODD.
        IntegrityError: The baseline was edited.
    """
    is_there = path is not None and not (may_lack and not path.exists())
    then = read_baseline(path) if path is not None and is_there else None
    altered = repository.verify()
    own = [
        Finding(Kind.INTEGRITY, f"the database is not as it was written: {item}")
        for item in altered[:MAX_ALTERED]
    ]
    if len(altered) > MAX_ALTERED:
        more = f"{counted(len(altered) - MAX_ALTERED)} more; adeye db verify names all"
        own.append(Finding(Kind.INTEGRITY, more))
    code, message = gate_code(repository, campaign)
    try:
        snapshot = _snapshot(repository, campaign, code)
    except IntegrityError as error:
        # What was altered is named, not only what cannot be folded any more.
        raise IntegrityError("\n".join([*map(str, own), str(error)])) from error
    now = snapshot.state
    if now.accounted < now.planned:
        left = f"{counted(now.accounted)} of {counted(now.planned)} test cases are accounted for"
        text = f"{left}; the campaign is {campaign.state}. Run it again, it goes on"
        own.append(Finding(Kind.MISSING, text))
    if edits:
        own.append(Finding(Kind.CHANGED, edits))
    set_aside = _set_aside(repository, campaign)
    own += map(set_aside, state_of(now))
    failures = channel_failures(repository, campaign)
    own += [
        Finding(
            Kind.UNDECIDED if item.refused else Kind.NOTE,
            str(item),
            decides=item.refused > 0,
            architecture=item.architecture,
        )
        for item in failures
    ]
    changed: list[Finding] = []
    if then is not None:
        check_same_odd(then, now, str(path))
        units = [cell.margin.unit for cell in (*then.cells, *now.cells) if cell.margin]
        tolerances.check([*then.fsrs, *now.fsrs], units)
        tolerances = replace(tolerances, steps=_steps(repository, campaign))
        changed = list(map(set_aside, changes(then, snapshot, tolerances)))
    decided = gate_code_of([*own, *changed], code)
    return GateResult(
        campaign=campaign.id,
        number=campaign.number,
        state=now,
        work=campaign.state,
        baseline="" if then is None else str(path),
        own=tuple(own),
        changes=tuple(changed),
        exit_code=decided,
        message=_message(decided, code, message, [*own, *changed]),
        channel_failures=failures,
        contacts=repository.contacts(campaign.id),
    )


def _steps(
    repository: Repository, campaign: CampaignInfo
) -> dict[tuple[str, str, str], dict[str, float]]:
    """Read what the step is worth in the margins of a campaign, in their units."""
    found: dict[tuple[str, str, str], dict[str, float]] = defaultdict(dict)
    for item in repository.hindsight.half_steps.uncertainty(campaign.id):
        worth = item.difference.uncertainty
        if item.difference.kind == "fsr" and worth is not None:
            unit = unit_text(item.difference.unit) or "1"
            found[item.difference.name, item.architecture, item.scenario][unit] = worth
    return dict(found)


def _set_aside(repository: Repository, campaign: CampaignInfo) -> Callable[[Finding], Finding]:
    """Let contacts that no reference driver of the ODD's gate avoids not decide."""
    models = preventable_by(repository, campaign)
    judged = {(item.fsr, item.architecture) for item in repository.gate(campaign.id)}
    known: dict[tuple[str, str], tuple[Verdict, str]] = {}

    def set_aside(item: Finding) -> Finding:
        key = item.fsr, item.architecture
        is_failure = item.decides and item.kind in {Kind.FAILING, Kind.NEWLY_FAILING}
        if not (models and is_failure and key in judged):
            return item
        if key not in known:
            known[key] = without_unpreventable(repository, campaign, *key, models)
        verdict, note = known[key]
        text = f"{item.text}; {note}" if note else item.text
        return replace(item, text=text, decides=verdict is not Verdict.PASS)

    return set_aside


def _snapshot(repository: Repository, campaign: CampaignInfo, code: ExitCode) -> Snapshot:
    odd = repository.content("odd", campaign.odd_digest)
    kept = list(odd["architectures"]) if campaign.planned <= MAX_CASES else []
    compared = repository.compared(campaign.id, kept, is_named=True)
    state = take_down(repository, campaign, totals(repository, campaign), compared, code)
    keys = case_keys(compared)
    return Snapshot(
        state,
        runs={
            (compared.architecture[row], key): compared.result[row] for row, key in enumerate(keys)
        },
        points={key: int(compared.point[row]) for row, key in enumerate(keys)},
    )


def _message(decided: ExitCode, own: ExitCode, why: str, findings: list[Finding]) -> str:
    """Say the answer, and every other exit code that applies."""
    codes = {own, *(item.kind.code for item in deciding(findings))} - {ExitCode.OK, decided}
    if decided is ExitCode.OK:
        return why
    others = [f"{int(code)} ({code.meaning})" for code in sorted(codes)]
    also = f"; also {', '.join(others)}" if others else ""
    return f"Exit code {int(decided)} ({decided.meaning}){also}."


def update_baseline(result: GateResult, path: Path, *, accepts_incomplete: bool) -> GateResult:
    """Write a campaign as the new baseline, unless its evidence is incomplete.

    Args:
        result: Of the campaign, compared with the former baseline if there is one.
        path: Where to.
        accepts_incomplete: Write it also if evidence is incomplete; never if a row was altered.

    Returns:
        With the exit code of the campaign alone: a baseline may hold failures, it excuses none.

    Raises:
        PlatformError: The file cannot be written.
    """
    codes = {ExitCode(result.state.exit_code), *(item.kind.code for item in deciding(result.own))}
    code = exit_code(codes)
    refused = codes & {ExitCode.INTEGRITY, ExitCode.INCOMPLETE}
    if accepts_incomplete:
        refused -= {ExitCode.INCOMPLETE}
    if refused:
        worst = exit_code(refused)
        text = f"The baseline was not written: {worst.meaning}"
        remedy = "" if worst is ExitCode.INTEGRITY else ", unless --accept-incomplete is given"
        return replace(result, exit_code=worst, message=f"{text}{remedy}.")
    write_baseline(result.state, path)
    text = f"Wrote the baseline: {code.meaning}."
    return replace(result, exit_code=code, message=text, is_written=True)
