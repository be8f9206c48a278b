"""What a report says about change: the difference from a baseline, and what became stale."""

from __future__ import annotations

from collections.abc import Callable

from adeye.report.gate.baseline import deciding
from adeye.report.gate.decide import GateResult
from adeye.report.model.evidence import Change, Impact, StaleFiles


def impact_of(
    result: GateResult,
    former: str,
    stale: StaleFiles | str,
    commands: tuple[str, Callable[[str], str]],
) -> Impact:
    """Return what changed since a baseline.

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
        changes=tuple(
            Change.of(
                item,
                decides=item in decides,
                command=show(item.runs[0]) if item.runs else "",
            )
            for item in result.changes
        ),
        stale=None if isinstance(stale, str) else stale,
        not_asked=stale if isinstance(stale, str) else "",
        command=gate,
    )
