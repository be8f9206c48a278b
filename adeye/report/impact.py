"""What a report says about change: the difference from a baseline, and what became stale."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.report.gate.baseline import deciding
from adeye.report.model.evidence import Change, Impact, StaleFiles

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from adeye.report.gate.baseline import Finding
    from adeye.report.gate.decide import GateResult


def impact_of(
    result: GateResult,
    former: str,
    stale: StaleFiles | str,
    commands: tuple[str, Callable[[str], str]],
) -> Impact:
    """Tell what changed since a baseline.

    Args:
        result: Of the campaign, compared with the baseline.
        former: Id of the campaign that the baseline was written from.
        stale: What of the evidence counts under the files as they are, or why that is not known.
        commands: Asks the gate, and shows a run.
    """
    gate, show = commands
    decides = deciding(result.changes)
    return Impact(
        baseline=result.baseline,
        campaign=former,
        exit_code=result.exit_code,
        message=result.message,
        changes=tuple(_change(item, decides, show) for item in result.changes),
        stale=None if isinstance(stale, str) else stale,
        not_asked=stale if isinstance(stale, str) else "",
        command=gate,
    )


def _change(item: Finding, decides: Sequence[Finding], show: Callable[[str], str]) -> Change:
    return Change(
        kind=item.kind,
        decides=item in decides,
        fsr=item.fsr,
        architecture=item.architecture,
        scenario=item.scenario,
        text=item.text,
        runs=item.runs,
        command=show(item.runs[0]) if item.runs else "",
    )
