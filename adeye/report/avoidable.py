"""What a report says about preventability: the cells of runs beside reference drivers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from adeye.evaluation.preventability import tabulate_cells
from adeye.report.assessment_parts import AvoidableRun, CellTally, Preventability

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from adeye.evaluation.preventability import Comparison

LISTED: Final = 12
"""Findings that are listed with their commands; ``adeye preventability --json`` has all."""


def preventability_of(
    found: Sequence[Comparison],
    counts: tuple[int, int],
    commands: tuple[str, Callable[[str], str]],
) -> Preventability:
    """Tell what is known of the conflicts of a campaign.

    Args:
        found: Runs beside drives of reference drivers.
        counts: Executed runs, and contacts that no drive is held against.
        commands: Evaluates the conflicts, and reproduces a run.
    """
    complete, replay = commands
    findings = [item for item in found if item.cell == "only_model"]
    findings.sort(key=lambda item: (-(item.impact_speed_mps or 0.0), item.run, item.model))
    executed, open_contacts = counts
    return Preventability(
        executed=executed,
        compared=len({item.run for item in found}),
        open_contacts=open_contacts,
        tallies=tuple(_tallies(found)),
        findings=len(findings),
        listed=tuple(_listed(item, replay) for item in findings[:LISTED]),
        command=complete,
    )


def _tallies(found: Sequence[Comparison]) -> Iterator[CellTally]:
    for edition in sorted({item.edition for item in found}):
        for row in tabulate_cells(item for item in found if item.edition == edition):
            yield CellTally(
                scenario=row.scenario,
                architecture=row.architecture,
                model=row.model,
                edition=edition,
                counts=dict(row.counts),
            )


def _listed(item: Comparison, replay: Callable[[str], str]) -> AvoidableRun:
    return AvoidableRun(
        run=item.run,
        drive=item.drive,
        scenario=item.scenario,
        architecture=item.architecture,
        fault_entry=item.fault_entry,
        model=item.model,
        edition=item.edition,
        impact_speed_mps=item.impact_speed_mps,
        command=replay(item.run),
        drive_command=replay(item.drive),
    )
