"""What the report says of decompositions, dependent failures and broken rules."""

from __future__ import annotations

from datetime import date
from typing import TYPE_CHECKING

import pytest

from adeye.report.concept import decompositions_of, dependent_failures_of, findings_of
from adeye.spec.concept import Decomposition, DependentFailure
from adeye.spec.load import load_odd, shipped
from adeye.store.read.checking import Violation
from adeye.store.rules import RULES

if TYPE_CHECKING:
    from adeye.spec.concept import Concept


@pytest.fixture(scope="module")
def concept() -> Concept:
    """The shipped concept with a record and a decomposition put beside it."""
    found = load_odd(shipped("odd") / "motorway_chauffeur.yaml").concept.spec
    first, second, third, *others = found.requirements
    parts = [item.model_copy(update={"asil": "B(D)"}) for item in (second, third)]
    record = DependentFailure(
        id="DFA-1",
        covers=("power_a",),
        argument="buffered",
        owner="me",
        valid_until=date(2026, 1, 31),
    )
    step = Decomposition(
        requirement=first.id, into=(second.id, third.id), independence="two", dfa=("DFA-1",)
    )
    return found.model_copy(
        update={
            "requirements": (first, *parts, *others),
            "decompositions": (step,),
            "dependent_failures": (record,),
        }
    )


def test_decomposition_says_its_scheme(concept: Concept) -> None:
    (item,) = decompositions_of(concept)
    assert item.scheme.count("B(D)") == 2
    assert (item.fsr, item.into, item.dfa) == ("FSR-01", ("FSR-02", "FSR-03"), ("DFA-1",))


@pytest.mark.parametrize(("today", "expired"), [(31, False), (32, True)])
def test_record_expires_after_its_last_day(concept: Concept, today: int, *, expired: bool) -> None:
    day = date(2026, 1, 31) if today == 31 else date(2026, 2, 1)
    (item,) = dependent_failures_of(concept, day)
    assert item.is_expired is expired


def test_finding_says_its_rule_and_the_remedy() -> None:
    (item,) = findings_of([Violation(RULES[0].name, "fsr", "FSR-1", "is wrong")])
    assert (item.text, item.remedy, item.id) == (RULES[0].text, RULES[0].remedy, "FSR-1")
