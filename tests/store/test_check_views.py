"""The views of the rules agree with the formulas of the package."""

import itertools
import re
import sqlite3
from collections import Counter
from collections.abc import Iterator
from typing import Any

import pytest

from adeye.campaign.check import over_budget
from adeye.spec.concept import ASIL_ORDER, determine_asil
from adeye.store.read.checking import check_plan
from adeye.store.rules import CONCEPT_RULES, RULES, check_view_ddl
from adeye.store.views import view_ddl


@pytest.fixture
def memory() -> Iterator[sqlite3.Connection]:
    connection = sqlite3.connect(":memory:")
    yield connection
    connection.close()


def test_asil_of_every_combination_is_that_of_the_formula(memory: sqlite3.Connection) -> None:
    memory.execute(
        "CREATE TABLE hazardous_event (concept_digest, id, severity, exposure, controllability)"
    )
    memory.execute(check_view_ddl()["v_hazard_asil"])
    expected = {}
    for s, e, c in itertools.product(range(4), range(5), range(4)):
        classes = (f"S{s}", f"E{e}", f"C{c}")
        expected["".join(classes)] = determine_asil(*classes)
        memory.execute(
            "INSERT INTO hazardous_event VALUES ('c', ?, ?, ?, ?)", ("".join(classes), *classes)
        )
    assert dict(memory.execute("SELECT event, asil FROM v_hazard_asil")) == expected
    assert len(expected) == 80


@pytest.mark.parametrize("classes", [("S4", "E4", "C3"), ("S3", "", "C3"), ("S3", "E4", "c3")])
def test_unknown_class_has_an_unknown_asil(memory: sqlite3.Connection, classes: Any) -> None:
    memory.execute(
        "CREATE TABLE hazardous_event (concept_digest, id, severity, exposure, controllability)"
    )
    memory.execute(check_view_ddl()["v_hazard_asil"])
    memory.execute("INSERT INTO hazardous_event VALUES ('c', 'e', ?, ?, ?)", classes)
    assert memory.execute("SELECT asil FROM v_hazard_asil").fetchall() == [("unknown",)]


def test_rank_counts_what_stands_before_the_brackets(memory: sqlite3.Connection) -> None:
    ddl = check_view_ddl()["v_check_asil_lost"]
    case = re.search(r"CASE substr\(f\.asil, 1, 1\) .*? END", ddl)
    assert case is not None
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
    found = check_plan(example.record(), Counter({("new", "cut_in", True): 1}))
    exceeded = [item for item in found if item.rule == "fhti_budget"]
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
