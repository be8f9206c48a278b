"""What a report tells of decompositions, dependent failures and broken integrity rules."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.report.concept_parts import Decomposition, DependentFailure, IntegrityFinding
from adeye.spec.decomposition import scheme
from adeye.store.check_views import RULES

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from datetime import date

    from adeye.spec.concept import Concept
    from adeye.store.checking import Violation


def decompositions_of(concept: Concept) -> Iterator[Decomposition]:
    """List the decompositions with the scheme that their children make."""
    for item in concept.decompositions:
        yield Decomposition(
            fsr=item.requirement,
            into=item.into,
            scheme=scheme(concept, item),
            independence=item.independence,
            dfa=item.dfa,
        )


def dependent_failures_of(concept: Concept, today: date) -> Iterator[DependentFailure]:
    """List the records of the dependent-failure analysis."""
    for item in concept.dependent_failures:
        yield DependentFailure(
            id=item.id,
            covers=item.covers,
            argument=item.argument,
            owner=item.owner,
            valid_until=item.valid_until.isoformat(),
            is_expired=item.valid_until < today,
        )


def findings_of(violations: Iterable[Violation]) -> Iterator[IntegrityFinding]:
    """Say what breaks an integrity rule, and what to do about it."""
    rules = {rule.name: rule for rule in RULES}
    for item in violations:
        rule = rules[item.rule]
        yield IntegrityFinding(
            rule=rule.name,
            text=rule.text,
            part=item.part,
            id=item.id,
            detail=item.detail,
            remedy=rule.remedy,
        )
