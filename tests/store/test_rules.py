"""A formula must not give more time than the requirement says that detection and reaction take."""

import itertools
import re
import sqlite3
from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest

from adeye.campaign.check import over_budget
from adeye.spec.asil import ASIL_ORDER, determine_asil
from adeye.store.read.checking import EVIDENCE_RULES, Violation, check_campaign, check_plan
from adeye.store.rules import BUDGET_RULES, CAMPAIGN_RULES, CONCEPT_RULES, RULES, check_view_ddl
from adeye.store.views import view_ddl
from tests.store.conftest import Store
from tests.stored import known

LATE = "always(contact implies eventually[0 s, 2 s](gap > 1))"
EITHER = "always(contact implies (gap > 1 or eventually(gap > 1)))"
NESTED = "always(contact implies eventually[0 s, 1 s](eventually[0 s, 1 s](gap > 1)))"


def planned(example: Any, rule: str) -> list[Violation]:
    """Ask a rule about what an example plans."""
    violations = check_plan(example.record(), Counter({("new", "cut_in", True): 1}))
    return [item for item in violations if item.rule == rule]


def found(example: Any, **changes: Any) -> list[str]:
    first, *others = example.requirements
    example.requirements = (first.model_copy(update=changes), *others)
    return [item.detail for item in planned(example, BUDGET_RULES[0].name)]


def violations(store: Store) -> tuple[Violation, ...]:
    checked = known(check_campaign(store.repository.location, rules=EVIDENCE_RULES))
    return checked.violations


@pytest.mark.parametrize(
    ("formula", "fdti", "frti", "gives", "budget"),
    [
        (LATE, 0.5, 1.0, "2.0 s", "1.5 s"),
        (LATE, 1.5, None, "2.0 s", "1.5 s"),
        (LATE, None, 1.0, "2.0 s", "1.0 s"),
        (NESTED, 1.0, None, "2.0 s", "1.0 s"),
        (EITHER, 1.0, None, "unbounded time", "1.0 s"),
        # The same in other words.
        ("always(contact implies not always[0 s, 2 s](gap <= 1))", 1.0, None, "2.0 s", "1.0 s"),
        ("always(not contact or eventually[0 s, 2 s](gap > 1))", 1.0, None, "2.0 s", "1.0 s"),
        ("always(eventually[0 s, 2 s](gap > 1) or not contact)", 1.0, None, "2.0 s", "1.0 s"),
        ("always(contact implies always[2 s, 3 s](gap > 1))", 1.0, None, "2.0 s", "1.0 s"),
        # Within the budget, or nothing that asks for a response.
        ("always(contact implies not eventually[0 s, 2 s](gap <= 1))", 1.0, None, "", ""),
        ("always(contact or eventually[0 s, 2 s](gap > 1))", 1.0, None, "", ""),
        (LATE, 1.0, 1.0, "", ""),
        (LATE, None, None, "", ""),
        ("eventually[0 s, 9 s](gap > 1)", 1.0, None, "", ""),
        ("always(eventually[0 s, 9 s](gap > 1) implies contact)", 1.0, None, "", ""),
        ("always(contact implies always[0 s, 9 s](gap > 1))", 1.0, None, "", ""),
    ],
)
def test_formula_that_gives_more_time_is_found(
    example: Any, formula: str, fdti: float | None, frti: float | None, gives: str, budget: str
) -> None:
    said = [f"the formula gives {gives} to respond, fdti and frti give {budget}"]
    assert found(example, formula=formula, fdti=fdti, frti=frti) == (said if gives else [])


def test_plan_rules_ask_no_table_of_results() -> None:
    views = check_view_ddl()
    for rule in (rule for rule in CAMPAIGN_RULES if rule.has_view):
        words = views[rule.view]
        is_about_runs = any(name in words for name in ("tally", " run ", "v_case_counts"))
        assert rule.needs_evidence == is_about_runs, rule.name


def test_campaign_that_was_only_planned_has_not_run(store: Store) -> None:
    store.plan(8, block_size=3)
    assert [(item.rule, item.id, item.detail) for item in violations(store)] == [
        ("not_run", scenario, f"2 of 2 test cases of {architecture} have no result")
        for scenario in ("braking", "cut_in")
        for architecture in ("legacy", "new")
    ]


def test_another_threshold_makes_evidence_stale_until_it_is_judged(store: Store) -> None:
    store.campaign(8)
    store.example.thresholds["FSR1"] = "another"
    plan = store.plan(8, block_size=3)
    assert ("stale_evidence", "FSR1") in {(item.rule, item.id) for item in violations(store)}
    store.work_off(plan.campaign)
    assert violations(store) == ()


def test_requirement_of_scenarios_that_are_not_planned_has_none(example: Any) -> None:
    changed = example.requirements[0].model_copy(update={"scenarios": ("fog",)})
    example.requirements = (changed, *example.requirements[1:])
    assert {item.id for item in planned(example, "fsr_without_scenario")} == {"FSR1", "FSR3"}


@pytest.fixture
def memory() -> Iterator[sqlite3.Connection]:
    """A database in memory with the view of the ASIL of hazards."""
    connection = sqlite3.connect(":memory:")
    connection.execute(
        "CREATE TABLE hazardous_event (concept_digest, id, severity, exposure, controllability)"
    )
    connection.execute(check_view_ddl()["v_hazard_asil"])
    yield connection
    connection.close()


def test_asil_of_every_combination_is_that_of_the_formula(memory: sqlite3.Connection) -> None:
    known = {
        (f"S{s}", f"E{e}", f"C{c}") for s, e, c in itertools.product(range(4), range(5), range(4))
    }
    unknown = {("S4", "E4", "C3"), ("S3", "", "C3"), ("S3", "E4", "c3")}
    expected: dict[str, str | None] = {}
    for classes in known | unknown:
        event = "".join(classes)
        expected[event] = determine_asil(*classes) if classes in known else "unknown"
        memory.execute("INSERT INTO hazardous_event VALUES ('c', ?, ?, ?, ?)", (event, *classes))
    assert dict(memory.execute("SELECT event, asil FROM v_hazard_asil")) == expected
    assert len(expected) == 83


def test_rank_counts_what_stands_before_the_brackets(memory: sqlite3.Connection) -> None:
    ddl = check_view_ddl()["v_check_asil_lost"]
    case = known(re.search(r"CASE substr\(f\.asil, 1, 1\) .*? END", ddl))
    words: dict[str, int] = {word: rank for rank, word in enumerate(ASIL_ORDER)}
    words |= {"B(D)": 2, "QM(D)": 0, "x": -9, "": -9}
    for word, rank in words.items():
        found = memory.execute(f"SELECT {case[0]} FROM (SELECT ? AS asil) f", (word,))  # noqa: S608
        assert found.fetchone() == (rank,)


@pytest.mark.parametrize(
    "budgets",
    [
        {"FSR1": (1.0, 0.5)},
        {"FSR1": (1.0, 0.6)},
        {"FSR1": (1.0, None), "FSR2": (None, 0.5)},
        {"FSR1": (1.0, None), "FSR2": (None, 0.6)},
        {"FSR1": (1.6, None)},
        {"FSR1": (None, None), "FSR2": (0.1, 0.2)},
        {"FSR1": (0.1, 0.2), "FSR2": (0.5, 1.0000000001)},
    ],
    ids=str,
)
def test_time_budgets_are_those_that_the_plan_warns_of(example: Any, budgets: Any) -> None:
    """The goal of the example has an FTTI of 1.5 s."""
    example.requirements = tuple(
        item.model_copy(update=dict(zip(("fdti", "frti"), budgets[item.id], strict=True)))
        if item.id in budgets
        else item
        for item in example.requirements
    )
    exceeded = planned(example, "fhti_budget")
    assert len(exceeded) == len(list(over_budget(example.concept())))


def test_every_rule_is_a_view_and_says_what_to_do() -> None:
    views = view_ddl()
    assert len({rule.name for rule in RULES}) == len(RULES) >= 18
    for rule in RULES:
        assert re.fullmatch(r"[a-z_]+", rule.name)
        assert rule.text.endswith(".")
        assert rule.remedy.endswith(".")
        if rule.has_view:
            written = views[rule.view]
            assert not re.search(r"RANK|BRACKET|LETTER|DECOMPOSED|ITS_SIDE|JUDGED", written)
        else:
            assert rule.view == ""
    assert not any(rule.needs_evidence for rule in CONCEPT_RULES)
