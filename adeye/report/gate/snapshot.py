"""Take down a campaign as a baseline, from the database alone."""

from __future__ import annotations

import json
import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from adeye.identity import digest
from adeye.judge.evaluate import VERDICTS
from adeye.judge.pairing import NOT_JUDGED, NOT_RUN
from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.claims import designs_of
from adeye.report.gate.baseline import (
    LETTERS,
    Baseline,
    BaselineCase,
    BaselineCases,
    BaselineCell,
    BaselineFsr,
)
from adeye.report.model.part import Margin
from adeye.signals import Ints
from adeye.store.read.bulk import Compared
from adeye.store.read.totals import Total, channel_policy
from adeye.store.records import CampaignInfo, FsrStatus
from adeye.store.repository import Repository

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
    totals: Sequence[Total],
    compared: Compared,
    code: ExitCode,
) -> Baseline:
    """Make a baseline of a campaign.

    Args:
        repository: The database.
        campaign: The campaign.
        totals: Its FSRs over all scenarios.
        compared: Its test cases with their verdicts; of no architecture if there are more than
            are kept.
        code: Exit code of the campaign.
    """
    odd: Mapping[str, Any] = repository.content("odd", campaign.odd_digest)
    status = repository.fsr_status(campaign.id)
    progress = repository.progress(campaign.id)
    made = campaign.provenance
    return Baseline(
        odd=campaign.odd,
        campaign=campaign.id,
        odd_digest=campaign.odd_digest,
        concept_digest=campaign.concept_digest,
        numerics=" ".join(
            str(made.get(name, "unknown")) for name in ("backend", "variant", "numerics_version")
        ),
        gate=tuple(sorted(campaign.gate)),
        channel_failures=channel_policy(repository, campaign),
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
                [*map(_total_cell, totals), *(_cell(item) for item in status if item.scenario)],
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
    digests = dict(zip(compared.fsrs, compared.fsr_digests, strict=True))
    mandatory = {item.fsr for item in repository.gate(campaign.id)}
    return {
        item.fsr: BaselineFsr.of(item, digest=digests[item.fsr], mandatory=item.fsr in mandatory)
        for item in sorted(status, key=lambda item: item.fsr)
    }


def _total_cell(item: Total) -> BaselineCell:
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
