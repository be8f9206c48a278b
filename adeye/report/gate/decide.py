"""Judge a campaign for a gate: verify, fold its verdicts, compare it with a baseline."""

from __future__ import annotations

import json
import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from adeye.errors import IntegrityError, amount
from adeye.identity import digest
from adeye.judge.pairing import NOT_JUDGED, NOT_RUN
from adeye.judge.verdict import VERDICTS, ExitCode, Verdict, exit_code
from adeye.report.claims import designs_of
from adeye.report.gate.baseline import (
    LETTERS,
    Baseline,
    BaselineCase,
    BaselineCases,
    BaselineCell,
    BaselineFsr,
    Finding,
    Kind,
    deciding,
    gate_code_of,
    read_baseline,
    write_baseline,
)
from adeye.report.gate.changes import (
    Snapshot,
    Tolerances,
    changes,
    check_same_odd,
    compared_units,
    state_of,
)
from adeye.report.model.part import Margin
from adeye.report.words import counted, unit_text
from adeye.signals import Ints
from adeye.store.read import totals
from adeye.store.read.bulk import Compared
from adeye.store.records import UNJUDGED, CampaignInfo, FsrStatus
from adeye.store.repository import Repository

# --- Take down a campaign as a baseline, from the database alone ----------------------------------


MAX_CASES: Final = 5_000
"""Test cases whose margins are kept; above, a baseline would be no file to commit."""
DIGITS: Final = 7
"""Significant digits of what is kept."""

_BY_VERDICT: Final = {verdict: letter for letter, verdict in LETTERS.items()}
_LETTER: Final = {
    **{code: _BY_VERDICT[Verdict(str(word))] for code, word in enumerate(VERDICTS)},
    NOT_RUN: _BY_VERDICT[Verdict.NOT_RUN],
    NOT_JUDGED: _BY_VERDICT[None],
}


def take_down(
    repository: Repository,
    campaign: CampaignInfo,
    whole: Sequence[totals.Total],
    compared: Compared,
    code: ExitCode,
) -> Baseline:
    """Make a baseline of a campaign.

    Args:
        repository: The database.
        campaign: The campaign.
        whole: Its FSRs over all scenarios.
        compared: Its test cases with their verdicts; of no architecture if there are more than
            are kept.
        code: Exit code of the campaign.
    """
    odd: Mapping[str, Any] = repository.content("odd", campaign.odd_digest)
    status = repository.fsr_status(campaign.id)
    progress = repository.progress(campaign.id)
    made = campaign.provenance
    return Baseline.of(
        campaign,
        campaign=campaign.id,
        numerics=" ".join(
            str(made.get(name, "unknown")) for name in ("backend", "variant", "numerics_version")
        ),
        gate=tuple(sorted(campaign.gate)),
        channel_failures=totals.channel_policy(repository, campaign),
        preventable_by=tuple(sorted(totals.preventable_by(repository, campaign))),
        uncertainty=(odd["odd"].get("uncertainty") or {"situations": 0})["situations"],
        attributes=digest(odd["odd"].get("attributes") or {}),
        tolerance=totals.tolerance(repository, campaign),
        exit_code=code,
        planned=progress.planned,
        accounted=progress.accounted,
        architectures=_digests(odd["architectures"]),
        scenarios=_digests(odd["scenarios"]),
        faults=_digests({str(fault["id"]): fault for fault in odd["odd"]["faults"]}),
        designs=dict(sorted(designs_of(odd).items())),
        fsrs=_fsrs(repository, campaign, status, compared),
        cells=tuple(
            sorted(
                [*map(_total_cell, whole), *(_cell(item) for item in status if item.scenario)],
                key=lambda cell: (cell.fsr, cell.architecture, cell.scenario or ""),
            )
        ),
        cases=_cases(compared) if len(compared) == progress.planned else None,
    )


def _digests(parts: Mapping[str, Any]) -> dict[str, str]:
    return {name: digest(parts[name]) for name in sorted(parts)}


def _fsrs(
    repository: Repository,
    campaign: CampaignInfo,
    status: Sequence[FsrStatus],
    compared: Compared,
) -> dict[str, BaselineFsr]:
    digests = compared.digest_of
    mandatory = {item.fsr for item in repository.gate(campaign.id)}
    return {
        item.fsr: BaselineFsr.of(item, digest=digests[item.fsr], mandatory=item.fsr in mandatory)
        for item in sorted(status, key=lambda item: item.fsr)
    }


def _total_cell(item: totals.Total) -> BaselineCell:
    run, judged = item.worst or (None, None)
    margin, unit = (judged.margin, judged.unit) if judged else (None, None)
    return BaselineCell.of(
        item,
        scenario=None,
        counts=_counts(item.counts),
        margin=_margin(margin, unit, judged.robustness_low if judged else None),
        run=run.result_digest if run else None,
    )


def _cell(item: FsrStatus) -> BaselineCell:
    return BaselineCell.of(
        item,
        counts=_counts(item.counts),
        margin=_margin(item.worst_margin, item.unit, item.worst_robustness),
        run=item.worst_run,
    )


def _counts(counts: Mapping[Verdict, int]) -> dict[Verdict, int]:
    return {verdict: counts[verdict] for verdict in Verdict if counts.get(verdict)}


def _margin(margin: float | None, unit: str | None, robustness: float | None) -> Margin | None:
    if margin is None or not math.isfinite(margin):
        return None
    return Margin(value=rounded(margin), unit=unit or "1", robustness=_known(robustness))


def rounded(value: float) -> float:
    """Keep the digits that a baseline keeps.

    >>> rounded(1.23456789), rounded(-0.0)
    (1.234568, 0.0)
    """
    return float(f"{value:.{DIGITS}g}") + 0.0


def _known(value: float | None) -> float | None:
    return rounded(value) if value is not None and math.isfinite(value) else None


def case_keys(compared: Compared) -> list[str]:
    """Name each test case (N,) so that its pair in another campaign has the same name.

    The name is over the situation (scenario, parameters, replicate, seed), the content of the
    faults and the swept values of the architecture: over all that is not the architecture itself.

    Args:
        compared: Test cases.
    """
    faults = [
        digest([_executable(item) for item in json.loads(text)]) for text in compared.faults.words
    ]
    axes = sorted(compared.axes)
    return [
        digest(
            [
                compared.situation_digests[row],
                compared.fault_entry[row],
                faults[compared.faults.codes[row]],
                [
                    [name, _word(compared.axes[name][row])]
                    for name in axes
                    if compared.axes[name][row] is not None
                ],
            ]
        )[:16]
        for row in range(len(compared))
    ]


def _executable(fault: Mapping[str, Any]) -> Mapping[str, Any]:
    return {name: value for name, value in fault.items() if name != "text"}


def _word(value: Any) -> Any:
    return value if isinstance(value, float | int) else str(value)


def _cases(compared: Compared) -> tuple[BaselineCases, ...]:
    keys = case_keys(compared)
    groups: dict[tuple[str, str], list[int]] = defaultdict(list)
    for row in range(len(compared)):
        groups[compared.architecture[row], compared.scenario[row]].append(row)
    return tuple(
        _group(compared, keys, name, np.array(sorted(rows, key=keys.__getitem__)))
        for name, rows in sorted(groups.items())
    )


def _group(
    compared: Compared, keys: Sequence[str], name: tuple[str, str], rows: Ints
) -> BaselineCases:
    judged = (compared.verdict[rows] != NOT_JUDGED).any(axis=0)
    columns = np.flatnonzero(judged)
    return BaselineCases(
        architecture=name[0],
        scenario=name[1],
        fsrs=tuple(compared.fsrs[column] for column in columns),
        measures=tuple(measure_of(compared, rows, int(column)) for column in columns),
        rows=tuple(
            BaselineCase(
                key=keys[row],
                fault=compared.fault_entry[row],
                verdicts="".join(_LETTER[int(compared.verdict[row, column])] for column in columns),
                margins=tuple(_known(float(compared.margin[row, column])) for column in columns),
                robustness=tuple(
                    _known(float(compared.robustness[row, column])) for column in columns
                ),
            )
            for row in rows.tolist()
        ),
    )


def measure_of(compared: Compared, rows: Ints, column: int) -> str | None:
    """Return unit and signal of the margins of an FSR; None where they differ between test cases.

    Args:
        compared: Test cases.
        rows: Those that are looked at.
        column: Of the FSR.
    """
    known = rows[np.isfinite(compared.margin[rows, column])]
    codes = np.unique(compared.measured[known, column])
    if len(codes) != 1 or codes[0] < 0:
        return None
    unit, signal = compared.measures[codes[0]]
    return f"{unit} {signal}"


MAX_ALTERED: Final = 20
"""Altered rows that are named; ``adeye db verify`` names all."""


@dataclass(frozen=True)
class GateResult:
    """What a gate found.

    Attributes:
        campaign: Id of the campaign.
        number: Its number.
        state: The campaign as a baseline would keep it.
        work: ``complete``, ``running``, ``interrupted``, ``to be judged`` or ``quarantined``.
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
    channel_failures: tuple[totals.ChannelFailure, ...] = ()
    contacts: Mapping[str, int] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Name the campaign, the answer and how much was found."""
        found = f"{self.exit_code.name}, {amount(len(self.findings), 'finding')}"
        return f"<GateResult {self.campaign[:10]}: {found}>"

    def __bool__(self) -> bool:
        """Be as true as the gate."""
        return self.exit_code == ExitCode.OK

    @property
    def findings(self) -> tuple[Finding, ...]:
        """All of them."""
        return self.own + self.changes


_RUN: Final = "Run it again, it goes on"
_GOES_ON: Final = {
    "running": "Wait for it",
    UNJUDGED: "The others have results without verdicts; 'adeye judge' judges these, "
    "or says what it takes",
}
"""What is to be done about a campaign in a state; else it is run again."""


@dataclass(frozen=True)
class GateOptions:
    """What a gate is asked.

    Attributes:
        baseline: File to compare with; None for the verdicts of the campaign alone.
        tolerances: Losses of margin that do not count.
        is_update: Write the baseline instead.
        accepts_incomplete: Write it also from incomplete evidence.
        junit: JUnit XML to write.
    """

    baseline: Path | None = None
    tolerances: Tolerances = field(default_factory=Tolerances)
    is_update: bool = False
    accepts_incomplete: bool = False
    junit: Path | None = None


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
    if told := repository.uncertified(campaign.id):
        own.append(Finding(Kind.INTEGRITY, told))
    code, message = totals.gate_code(repository, campaign)
    try:
        snapshot = _snapshot(repository, campaign, code)
    except IntegrityError as error:
        # What was altered is named, not only what cannot be folded any more.
        raise IntegrityError("\n".join([*map(str, own), str(error)])) from error
    now = snapshot.state
    if now.accounted < now.planned:
        left = f"{counted(now.accounted)} of {counted(now.planned)} test cases are accounted for"
        text = f"{left}; the campaign is {campaign.state}. {_GOES_ON.get(campaign.state, _RUN)}"
        own.append(Finding(Kind.MISSING, text))
    if told := totals.withdrawn_in_words(repository, campaign):
        own.append(Finding(Kind.MISSING, told))
    if edits:
        own.append(Finding(Kind.CHANGED, edits))
    own += map(_set_aside(repository, campaign), state_of(now))
    failures = totals.channel_failures(repository, campaign)
    own += [
        Finding(
            Kind.UNDECIDED if item.refused else Kind.NOTE,
            str(item),
            decides=item.refused > 0,
            architecture=item.architecture,
        )
        for item in failures
    ]
    refused, _ = totals.failed_parts(repository, campaign)
    own += [Finding(Kind.UNDECIDED, text, decides=True) for text in refused]
    changed: list[Finding] = []
    if then is not None:
        check_same_odd(then, now, str(path))
        tolerances.check([*then.fsrs, *now.fsrs], sorted(compared_units(then, now)))
        tolerances = tolerances.of_gate(totals.tolerance(repository, campaign))
        tolerances = replace(tolerances, steps=_steps(repository, campaign))
        # What did not fail before was avoided by somebody: no reference driver excuses it.
        changed = list(changes(then, snapshot, tolerances))
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
    models = totals.preventable_by(repository, campaign)
    judged = {(item.fsr, item.architecture) for item in repository.gate(campaign.id)}
    known: dict[tuple[str, str], tuple[Verdict, str]] = {}

    def set_aside(item: Finding) -> Finding:
        key = item.fsr, item.architecture
        is_failure = item.decides and item.kind is Kind.FAILING
        if not (models and is_failure and key in judged):
            return item
        if key not in known:
            known[key] = totals.without_unpreventable(repository, campaign, *key, models)
        verdict, note = known[key]
        text = f"{item.text}; {note}" if note else item.text
        # Without them it may be undecided, which is no failure: the run says so, too.
        kind = item.kind if verdict in {Verdict.FAIL, Verdict.PASS} else Kind.UNDECIDED
        return replace(item, kind=kind, text=text, decides=verdict is not Verdict.PASS)

    return set_aside


def _snapshot(repository: Repository, campaign: CampaignInfo, code: ExitCode) -> Snapshot:
    odd = repository.content("odd", campaign.odd_digest)
    kept = list(odd["architectures"]) if campaign.planned <= MAX_CASES else []
    compared = repository.compared(campaign.id, kept, is_named=True)
    state = take_down(repository, campaign, totals.totals(repository, campaign), compared, code)
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
