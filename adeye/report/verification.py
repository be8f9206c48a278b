"""The verification table: every FSR for every architecture, from its goals to its evidence."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.evaluation.verdict import Outcome
from adeye.report.contents import measure_text
from adeye.report.designs import is_sample
from adeye.report.verification_parts import Realisation, VerificationRow
from adeye.report.words import margin_text, unit_text, value_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from adeye.report.model import Cell, Factors, Fsr, Report
    from adeye.spec.concept import Requirement
    from adeye.store.figures import Figures


def design_words(design: str) -> str:
    """Name a design of points for people.

    >>> design_words("full_factorial"), design_words("random")
    ('full factorial', 'random sample')
    """
    return f"{design} sample" if is_sample(design) else design.replace("_", " ")


def verification_of(
    report: Report, requirements: Mapping[str, Requirement], designs: Mapping[str, str]
) -> Iterator[VerificationRow]:
    """Write a row for each FSR and architecture, those of the gate first.

    Args:
        report: With its cells.
        requirements: FSRs by id.
        designs: Design of the points by scenario.
    """
    for architecture in sorted(report.architectures, key=lambda item: not item.is_gate):
        for fsr in report.fsrs:
            cell = report.cell(fsr.id, architecture.id)
            item = requirements.get(fsr.id)
            yield VerificationRow(
                goals=fsr.goals,
                fsr=fsr.id,
                asil=fsr.asil,
                mandatory=fsr.mandatory,
                architecture=architecture.id,
                is_gate=architecture.is_gate,
                allocation=fsr.allocation,
                metric=_metric(cell, item),
                threshold=fsr.formula if item is None else measure_text(item),
                threshold_source=fsr.threshold_source,
                value=_value(cell),
                margin=cell.margin if cell is not None and margin_text(cell) else None,
                verdict=None if cell is None else cell.verdict,
                runs=0 if cell is None else cell.runs,
                exercised=0 if cell is None else cell.exercised,
                min_exercised=1 if cell is None else cell.min_exercised,
                design=_design(report, fsr, designs),
                run=None if cell is None else cell.worst_run,
                command=report.command if cell is None else cell.command,
            )


def realisations_of(
    factors: tuple[Factors, ...], designs: Mapping[str, str], figures: Figures
) -> Iterator[Realisation]:
    """Count what became of the planned test cases of each scenario."""
    for item in factors:
        own: Any = figures.of_scenario(item.scenario)
        words = own.outcome.words
        counts = np.bincount(own.outcome.codes, minlength=len(words)).tolist()
        yield Realisation(
            scenario=item.scenario,
            design=design_words(designs.get(item.scenario, "")),
            planned=item.test_cases,
            executed=len(own),
            outcomes={Outcome(word): n for word, n in zip(words, counts, strict=True) if n},
        )


def _metric(cell: Cell | None, item: Requirement | None) -> str:
    if item is not None and item.bound is not None:
        return item.bound.metric
    return "" if cell is None or cell.binding is None else cell.binding.signal


def _value(cell: Cell | None) -> str:
    # Without a margin the value is a truth or a word, and says nothing beside a threshold.
    if cell is None or not margin_text(cell) or cell.binding is None or cell.binding.value is None:
        return ""
    return value_text(cell.binding.value, unit_text(cell.binding.unit))


def _design(report: Report, fsr: Fsr, designs: Mapping[str, str]) -> str:
    names = [item.id for item in report.scenarios if not fsr.scenarios or item.id in fsr.scenarios]
    kinds = dict.fromkeys(design_words(designs[name]) for name in names if name in designs)
    return ", ".join(kinds)
