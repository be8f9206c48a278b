"""Every integrity rule finds the defect that is sown for it, no other rule does, none is hidden."""

from __future__ import annotations

import json
import sqlite3
from collections import Counter
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.errors import InputError, PlatformError
from adeye.judge.stl.batch import HELD, NEEDED, SPARE
from adeye.spec.concept import (
    Asil,
    Assumption,
    Concept,
    Decomposition,
    DependentFailure,
    Element,
    HazardousEvent,
    Requirement,
    SafetyGoal,
    Waiver,
)
from adeye.store.read.checking import Violation, check_campaign, check_plan, count_unknown
from adeye.store.read.query import run_query
from adeye.store.repository import Repository
from adeye.store.rules import RULES

# ruff: noqa: S608 - names of this file
LATER = date(2999, 12, 31)
TEXTS: dict[str, Any] = dict.fromkeys(
    (
        "function",
        "malfunction",
        "situation",
        "severity_rationale",
        "exposure_rationale",
        "controllability_rationale",
    ),
    "text",
)


def fsr(name: str, goal: str, asil: str, *elements: str, **more: Any) -> Requirement:
    fields: dict[str, Any] = {
        "id": name,
        "goals": (goal,),
        "text": f"{name} holds",
        "formula": "always(gap >= 2)",
        "threshold_source": "made up",
        "asil": asil,
        "allocation": elements,
    }
    return Requirement(**{**fields, **more})


def element(name: str, asil: Asil, *resources: str, **more: Any) -> Element:
    return Element(
        id=name, kind="sensor", text=name, asil_capability=asil, resources=resources, **more
    )


def sound() -> Concept:
    """Make a concept of which every rule holds: two goals, one requirement that is decomposed."""
    return Concept(
        concept="sound",
        title="Sound",
        hazardous_events=(
            HazardousEvent(id="HE1", severity="S3", exposure="E4", controllability="C3", **TEXTS),
            HazardousEvent(id="HE2", severity="S2", exposure="E4", controllability="C3", **TEXTS),
        ),
        safety_goals=(
            SafetyGoal(
                id="SG1",
                text="text",
                hazardous_events=("HE1",),
                safe_state="standstill",
                ftti="1 s",
                ftti_rationale="text",
            ),
            SafetyGoal(
                id="SG2",
                text="text",
                hazardous_events=("HE2",),
                safe_state="standstill",
                ftti="2 s",
                ftti_rationale="text",
                emergency_operation="drive slowly",
                eotti="20 s",
                eotti_rationale="text",
            ),
        ),
        elements=(
            element("camera", "B", "power_a", "clock", consumes=("map",)),
            element("radar", "B", "power_b", "clock"),
            element("switch", "D"),
            element("map_server", "B", "power_c", provides=("map",)),
            element("power_a", "D"),
            element("power_b", "D"),
        ),
        requirements=(
            fsr("FSR1", "SG1", "D", "switch"),
            fsr("FSR2", "SG1", "D", "switch"),
            fsr("FSR2a", "SG1", "B(D)", "camera"),
            fsr("FSR2b", "SG1", "B(D)", "radar"),
            fsr(
                "FSR3",
                "SG2",
                "C",
                "switch",
                fdti="1 s",
                frti="1 s",
                emergency_operation_interval="10 s",
            ),
        ),
        assumptions=(Assumption(id="A1", text="dry", owner="me", valid_until=LATER),),
        waivers=(Waiver(requirement="FSR3", reason="text", author="me", expires=LATER),),
        decompositions=(
            Decomposition(
                requirement="FSR2",
                into=("FSR2a", "FSR2b"),
                independence="light and radio",
                dfa=("DFA1",),
            ),
        ),
        dependent_failures=(
            DependentFailure(
                id="DFA1", covers=("clock",), argument="text", owner="me", valid_until=LATER
            ),
        ),
    )


@pytest.fixture(scope="module")
def sound_database(
    tmp_path_factory: pytest.TempPathFactory, empty: bytes, make_example: Callable[[], Any]
) -> bytes:
    """A campaign of the sound concept, executed; its triggers are gone."""
    example = make_example()
    concept = sound()
    example.requirements, example.concept = concept.requirements, lambda: concept
    path = tmp_path_factory.mktemp("sound") / "adeye.db"
    path.write_bytes(empty)
    with Repository.open(path, create=False) as repository:
        example.campaign(repository, 8)
        assert repository.verify() == ()
    with closing(sqlite3.connect(path)) as raw:
        found = raw.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'").fetchall()
        for (name,) in found:
            raw.execute(f"DROP TRIGGER {name}")
        raw.execute("PRAGMA journal_mode = DELETE")
    return path.read_bytes()


@pytest.fixture
def database(tmp_path: Path, sound_database: bytes) -> Path:
    path = tmp_path / "adeye.db"
    path.write_bytes(sound_database)
    return path


def violations(path: Path) -> tuple[Violation, ...]:
    checked = check_campaign(path)
    assert checked is not None
    return checked.violations


def broken(path: Path) -> set[str]:
    return {item.rule for item in violations(path)}


Sow = Callable[[sqlite3.Connection], object]


def sql(*statements: str) -> Sow:
    def sow(raw: sqlite3.Connection) -> None:
        for statement in statements:
            assert raw.execute(statement).rowcount > 0, statement

    return sow


def content(table: str, name: str, **changes: Any) -> Sow:
    """Edit what the content of a part says."""

    def sow(raw: sqlite3.Connection) -> None:
        (text,) = raw.execute(f"SELECT content FROM {table} WHERE id = ?", (name,)).fetchone()
        edited = json.dumps({**json.loads(text), **changes})
        raw.execute(f"UPDATE {table} SET content = ? WHERE id = ?", (edited, name))

    return sow


def copied(table: str, source: str, name: str, **changes: Any) -> Sow:
    """Add a part like another one; ``content`` is made of the others."""

    def sow(raw: sqlite3.Connection) -> None:
        raw.row_factory = sqlite3.Row
        found = dict(raw.execute(f"SELECT * FROM {table} WHERE id = ?", (source,)).fetchone())
        raw.row_factory = None
        inside = changes.pop("inside", {})
        found |= {"id": name, **changes}
        found["content"] = json.dumps({**json.loads(found["content"]), "id": name, **inside})
        marks = ", ".join("?" * len(found))
        raw.execute(f"INSERT INTO {table} VALUES ({marks})", tuple(found.values()))

    return sow


def relation(name: str, kind: str, what: str) -> str:
    return (
        "INSERT INTO element_relation SELECT concept_digest, "
        f"'{name}', '{kind}', '{what}', row_hash FROM element WHERE id = '{name}'"
    )


def both(*sown: Sow) -> Sow:
    return lambda raw: [sow(raw) for sow in sown]


@dataclass(frozen=True)
class Defect:
    name: str
    rule: str
    sow: Sow
    ids: tuple[str, ...]


DEFECTS = (
    Defect(
        "ASIL of a hazard typed in",
        "hazard_asil",
        sql("UPDATE hazardous_event SET asil = 'B' WHERE id = 'HE1'"),
        ("HE1",),
    ),
    Defect(
        "class of a hazard that there is not",
        "hazard_asil",
        sql("UPDATE hazardous_event SET exposure = 'E9' WHERE id = 'HE2'"),
        ("HE2",),
    ),
    Defect(
        "hazard without goal",
        "hazard_without_goal",
        copied("hazardous_event", "HE1", "HE3"),
        ("HE3",),
    ),
    Defect(
        "goal below its hazard",
        "goal_asil",
        sql("UPDATE safety_goal SET asil = 'A' WHERE id = 'SG2'"),
        ("SG2",),
    ),
    Defect(
        "goal without FSR",
        "goal_without_fsr",
        copied("safety_goal", "SG2", "SG3"),
        ("SG3",),
    ),
    Defect("ASIL lost", "asil_lost", sql("UPDATE fsr SET asil = 'B' WHERE id = 'FSR3'"), ("FSR3",)),
    Defect(
        "FSR without allocation",
        "fsr_without_allocation",
        sql("DELETE FROM allocation WHERE fsr_id = 'FSR1'"),
        ("FSR1",),
    ),
    Defect(
        "FSR without measure",
        "fsr_without_measure",
        sql("UPDATE fsr SET measure = '' WHERE id = 'FSR1'"),
        ("FSR1",),
    ),
    Defect(
        "threshold from nowhere",
        "threshold_without_source",
        sql("UPDATE fsr SET threshold_source = '  ' WHERE id = 'FSR1'"),
        ("FSR1",),
    ),
    *(
        Defect(
            f"threshold from {word}",
            "threshold_without_source",
            sql(f"UPDATE fsr SET threshold_source = '{word}' WHERE id = 'FSR1'"),
            ("FSR1",),
        )
        for word in ("TBD", "Todo.", "?", "n/a", "Unknown", "none", "-")
    ),
    Defect(
        "formula that gives more time than the budget",
        "response_beyond_budget",
        content("fsr", "FSR1", fdti=0.2, frti=0.2, response_s=0.5),
        ("FSR1",),
    ),
    Defect(
        "formula that gives unbounded time",
        "response_beyond_budget",
        content("fsr", "FSR1", fdti=0.2, response_s="unbounded"),
        ("FSR1",),
    ),
    Defect(
        "element that is not capable",
        "element_capability",
        sql("UPDATE element SET asil_capability = 'A' WHERE id = 'camera'"),
        ("FSR2a",),
    ),
    Defect(
        "decomposition of D into B and A",
        "illegal_decomposition",
        sql("UPDATE fsr SET asil = 'A(D)' WHERE id = 'FSR2b'"),
        ("FSR2",),
    ),
    Defect(
        "decomposition with another goal's ASIL in brackets",
        "illegal_decomposition",
        sql("UPDATE fsr SET asil = 'B(C)' WHERE id = 'FSR2b'"),
        ("FSR2",),
    ),
    Defect(
        "decomposition without brackets",
        "illegal_decomposition",
        sql("UPDATE fsr SET asil = 'B' WHERE id = 'FSR2a'"),
        ("FSR2",),
    ),
    Defect(
        "decomposition into three",
        "illegal_decomposition",
        both(
            copied("fsr", "FSR2a", "FSR2c", asil="QM(D)"),
            sql(
                "INSERT INTO decomposition_child SELECT concept_digest, id, 'FSR2c', row_hash "
                "FROM decomposition",
                "INSERT INTO allocation SELECT concept_digest, 'FSR2c', 'map_server', row_hash "
                "FROM decomposition",
                "INSERT INTO campaign_fsr SELECT campaign_id, 'FSR2c', architecture, scenario, "
                "fsr_digest, asil, mandatory, min_exercised, applies, in_gate, applicable, reason, "
                "waived_until, planned, row_hash FROM campaign_fsr WHERE fsr_id = 'FSR2a'",
                "INSERT INTO tally SELECT work_id, campaign_id, 'FSR2c', fsr_digest, architecture, "
                "scenario, verdict, runs, exercised, worst_robustness, worst_margin, worst_unit, "
                "worst_result_digest, row_hash FROM tally WHERE fsr_id = 'FSR2a'",
            ),
            content(
                "dependent_failure", "DFA1", covers=["clock", "map_server", "power_c", "power_a"]
            ),
        ),
        ("FSR2",),
    ),
    Defect(
        "decomposition on one element",
        "decomposition_elements",
        both(
            sql("UPDATE allocation SET element_id = 'camera' WHERE fsr_id = 'FSR2b'"),
            content(
                "dependent_failure",
                "DFA1",
                covers=["clock", "camera", "power_a", "map_server", "power_c"],
            ),
        ),
        ("FSR2", "FSR2"),
    ),
    Defect(
        "no argument for independence",
        "independence_argument",
        sql("UPDATE decomposition SET independence = ''"),
        ("FSR2",),
    ),
    Defect(
        "element that states no resources",
        "independence_unknown",
        sql("DELETE FROM element_relation WHERE element_id = 'radar'"),
        ("radar",),
    ),
    Defect(
        "shared power", "common_cause", sql(relation("radar", "resource", "power_a")), ("FSR2",)
    ),
    Defect(
        "shared software",
        "common_cause",
        sql(
            relation("radar", "software", "tracker"),
            relation("camera", "software", "tracker"),
        ),
        ("FSR2",),
    ),
    Defect(
        "one supplier",
        "common_cause",
        sql(relation("radar", "supplier", "one"), relation("camera", "supplier", "one")),
        ("FSR2",),
    ),
    Defect(
        "common source of what both consume",
        "common_cause",
        sql(relation("radar", "consumes", "map")),
        ("FSR2", "FSR2"),
    ),
    Defect(
        "common source behind the power of both",
        "common_cause",
        sql(relation("power_a", "resource", "battery"), relation("power_b", "resource", "battery")),
        ("FSR2",),
    ),
    Defect(
        "shared clock that no record covers",
        "common_cause",
        content("dependent_failure", "DFA1", covers=["wiring"]),
        ("FSR2",),
    ),
    Defect(
        "record that the decomposition does not name",
        "common_cause",
        content("decomposition", "FSR2", dfa=[]),
        ("FSR2",),
    ),
    Defect(
        "expired record of the DFA",
        "expired_dfa",
        sql("UPDATE dependent_failure SET valid_until = '2001-01-31'"),
        ("DFA1",),
    ),
    Defect(
        "expired assumption",
        "expired_assumption",
        sql("UPDATE assumption SET valid_until = '2001-01-31'"),
        ("A1",),
    ),
    Defect(
        "expired waiver",
        "expired_waiver",
        content("concept", "sound", waivers=[{"requirement": "FSR3", "expires": "2001-01-31"}]),
        ("FSR3",),
    ),
    Defect("budget above the FTTI", "fhti_budget", content("fsr", "FSR3", fdti=1.5), ("FSR3",)),
    Defect(
        "budget above the FTTI over two FSRs",
        "fhti_budget",
        both(
            content("fsr", "FSR1", fdti=0.6),
            content("fsr", "FSR2", frti=0.6),
        ),
        ("SG1",),
    ),
    Defect(
        "emergency operation above the EOTTI",
        "emergency_operation",
        content("fsr", "FSR3", emergency_operation_interval=21.0),
        ("FSR3",),
    ),
    Defect(
        "emergency operation that the goal does not know",
        "emergency_operation",
        content("fsr", "FSR1", emergency_operation_interval=1.0),
        ("FSR1",),
    ),
    Defect(
        "FSR without scenario",
        "fsr_without_scenario",
        sql("UPDATE campaign_fsr SET planned = 0 WHERE fsr_id = 'FSR1'"),
        ("FSR1",),
    ),
    Defect(
        "hazard without its scenario",
        "hazard_without_scenario",
        content("hazardous_event", "HE2", scenarios=["fog"]),
        ("HE2",),
    ),
    Defect(
        "orphan scenario",
        "orphan_scenario",
        sql("""UPDATE campaign SET factors = '[{"scenario":"cut_in"},{"scenario":"fog"}]'"""),
        ("fog",),
    ),
    Defect(
        "not applicable in the gate",
        "not_applicable_in_gate",
        sql(
            "UPDATE campaign_fsr SET applicable = 0 WHERE fsr_id = 'FSR1' "
            "AND architecture = 'new' AND scenario = 'cut_in'",
            "DELETE FROM tally WHERE fsr_id = 'FSR1' AND architecture = 'new' "
            "AND scenario = 'cut_in'",
        ),
        ("FSR1",),
    ),
    Defect(
        "deleted run",
        "not_run",
        sql("DELETE FROM run WHERE number = 3"),
        ("braking",),
    ),
    Defect(
        "deleted tally",
        "stale_evidence",
        sql("DELETE FROM tally WHERE fsr_id = 'FSR1' AND architecture = 'new'"),
        ("FSR1",),
    ),
    Defect(
        "runs outside the ODD",
        "outside_odd",
        sql("UPDATE campaign_case SET inside_odd = 0 WHERE ordinal = 0"),
        ("FSR1", "FSR2", "FSR2a", "FSR2b", "FSR3"),
    ),
    Defect(
        "older numerics",
        "older_version",
        sql("UPDATE run SET numerics_version = 0 WHERE number = 1"),
        ("legacy",),
    ),
    Defect(
        "code that changed midway",
        "older_version",
        sql("UPDATE run SET plugins_digest = 'other' WHERE number = 1"),
        ("legacy",),
    ),
    Defect(
        "vacuous FSR",
        "vacuous_fsr",
        sql("UPDATE tally SET exercised = 0 WHERE fsr_id = 'FSR1'"),
        ("FSR1",),
    ),
)


OVERRULED = {
    # The records that these write cover the power, too.
    ("decomposition into three", "shared power"),
    ("decomposition on one element", "shared power"),
    # What the one edit deletes or moves, the other edit needs.
    ("decomposition on one element", "element that states no resources"),
    ("element that states no resources", "shared power"),
    ("element that states no resources", "common source behind the power of both"),
}
"""Pairs in which one edit takes back the other."""


def sown(path: Path, *defects: Defect) -> None:
    with closing(sqlite3.connect(path, isolation_level=None)) as raw:
        raw.execute("PRAGMA foreign_keys = OFF")
        for defect in defects:
            defect.sow(raw)


def test_sound_campaign_breaks_no_rule(database: Path) -> None:
    assert violations(database) == ()


@pytest.mark.parametrize("defect", DEFECTS, ids=lambda defect: defect.name)
def test_defect_is_found_by_its_rule_and_by_no_other(database: Path, defect: Defect) -> None:
    sown(database, defect)
    found = violations(database)
    assert {item.rule for item in found} == {defect.rule}
    assert tuple(item.id for item in found) == defect.ids
    assert all(item.detail and "None" not in item.detail for item in found)


def test_every_rule_has_a_defect() -> None:
    assert {defect.rule for defect in DEFECTS} == {rule.name for rule in RULES if rule.has_view}


@pytest.mark.slow
def test_no_defect_hides_another(tmp_path: Path, sound_database: bytes) -> None:
    hidden, tried = set(), set()
    for at, one in enumerate(DEFECTS):
        for shift in (1, 4):
            other = DEFECTS[(at + shift) % len(DEFECTS)]
            tried.add((one.name, other.name))
            path = tmp_path / f"{at}-{shift}.db"
            path.write_bytes(sound_database)
            sown(path, one, other)
            if not broken(path) >= {one.rule, other.rule}:
                hidden.add((one.name, other.name))
    assert hidden == OVERRULED & tried


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "needed", "details"),
    [
        (NEEDED, 1, ["exercised in none of 8 runs: gap >= 9 never held"]),
        (HELD, 2, ["exercised for new in 1 different results, 2 are needed"]),
        (SPARE, 1, []),
    ],
)
def test_what_the_gate_takes_for_vacuous_is_a_finding(
    repository: Repository, example: Any, kind: int, needed: int, details: list[str]
) -> None:
    example.repeat(kind)
    example.requirements = tuple(
        item.model_copy(update={"min_exercised": needed}) for item in example.requirements
    )
    checked = check_campaign(repository.location, example.campaign(repository, 8))
    assert checked is not None
    found = [item for item in checked.violations if item.rule == "vacuous_fsr"]
    assert [item.detail for item in found if item.id == "FSR1"] == details


@pytest.mark.slow
def test_one_view_has_what_all_have(database: Path) -> None:
    sown(database, *DEFECTS[:2], DEFECTS[-1])
    expected = [(item.rule, item.part, item.id, item.detail) for item in violations(database)]
    found = run_query(database, "SELECT rule, part, id, detail FROM v_check ORDER BY 1, 2, 3, 4")
    assert sorted(found.rows) == sorted(expected)
    for rule in (rule for rule in RULES if rule.has_view):
        run_query(database, f"SELECT * FROM {rule.view}")


@pytest.mark.slow
def test_a_campaign_is_judged_by_its_own_concept(
    repository: Repository, example: Any, make_example: Callable[[], Any]
) -> None:
    sick = example.campaign(repository, 4)
    healthy = make_example()
    concept = sound()
    healthy.requirements, healthy.concept = concept.requirements, lambda: concept
    well = healthy.campaign(repository, 8)
    first, second = (check_campaign(repository.location, name) for name in (sick, well))
    assert first is not None
    assert second is not None
    assert {item.rule for item in first.violations} == {
        "asil_lost",
        "element_capability",
        "fsr_without_scenario",
    }
    assert second.violations == ()
    assert set(second.fsr_digests) == {item.id for item in concept.requirements}


def test_nothing_to_check_is_told_from_no_findings(repository: Repository, tmp_path: Path) -> None:
    assert check_campaign(repository.location) is None
    assert check_campaign(repository.location, odd="motorway") is None
    assert check_campaign(tmp_path / "none.db") is None
    with pytest.raises(InputError, match="no such file"):
        check_campaign(tmp_path / "none.db", "1")
    with pytest.raises(InputError, match="run an ODD first"):
        check_campaign(repository.location, "1")


def test_results_that_are_neither_planned_nor_there_are_counted(
    repository: Repository, example: Any
) -> None:
    first = example.campaign(repository, 4)
    second = repository.plan_campaign(example.record(), example.cases(8), block_size=3).campaign
    results = [case.result_digest for case in example.cases(12)]
    # The second campaign asks for eight, four of which are there.
    assert count_unknown(repository.location, second, [results[:6], results[6:]]) == (4, 12)
    assert count_unknown(repository.location, first, [results]) == (8, 12)
    assert count_unknown(repository.location, first, [results[:4] * 300]) == (0, 1200)
    assert count_unknown(repository.location, first, []) == (0, 0)


def test_foreign_database_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    path.touch()
    with pytest.raises(PlatformError, match="not made by adeye"):
        check_campaign(path)


def planned(example: Any, concept: Concept) -> tuple[Violation, ...]:
    """Ask about a concept that is planned in one scenario and never saved."""
    example.requirements, example.concept = concept.requirements, lambda: concept
    return check_plan(example.record(), Counter({("new", "cut_in", True): 1}))


def test_plan_of_a_sound_concept_breaks_no_rule(example: Any) -> None:
    assert planned(example, sound()) == ()


def test_plan_is_asked_what_needs_no_evidence(example: Any) -> None:
    late = DependentFailure(
        id="DFA1", covers=("clock",), argument="x", owner="me", valid_until=date(2001, 1, 31)
    )
    concept = sound().model_copy(update={"dependent_failures": (late,)})
    assert planned(example, concept) == (
        Violation("expired_dfa", "dependent_failure", "DFA1", "was valid until 2001-01-31"),
    )


# --- independence ---------------------------------------------------------------------------------

NAMES = tuple("abcdef")


@st.composite
def graphs(draw: st.DrawFn) -> tuple[Element, ...]:
    """Elements that use each other, and resources, software and suppliers that some share."""
    found = []
    for name in NAMES:
        resources = draw(st.sets(st.sampled_from(("p", "q", *NAMES)), max_size=2)) - {name}
        provides = draw(st.sets(st.sampled_from("xyz"), max_size=1))
        consumes = draw(st.sets(st.sampled_from("xyz"), max_size=1))
        found.append(
            element(
                name,
                "D",
                *sorted(resources),
                supplier=draw(st.sampled_from((None, "m", "n"))),
                software=tuple(sorted(draw(st.sets(st.sampled_from("st"), max_size=1)))),
                provides=tuple(sorted(provides)),
                consumes=tuple(sorted(consumes)),
            )
        )
    offered = {name for item in found for name in item.provides}
    return tuple(
        item.model_copy(update={"consumes": tuple(n for n in item.consumes if n in offered)})
        for item in found
    )


def reached(elements: tuple[Element, ...], start: str) -> set[tuple[str, str]]:
    """Follow what an element depends on, one step after the other, in plain Python."""
    by_name = {item.id: item for item in elements}
    found = {("element", start)}
    waiting = [start]
    while waiting:
        item = by_name[waiting.pop()]
        next_to = {("supplier", item.supplier)} if item.supplier else set()
        next_to |= {("software", name) for name in item.software}
        next_to |= {("element" if name in by_name else "resource", name) for name in item.resources}
        next_to |= {
            ("element", other.id)
            for other in elements
            if set(other.provides).intersection(item.consumes)
        }
        waiting += [name for kind, name in next_to - found if kind == "element"]
        found |= next_to
    return found


@pytest.fixture(scope="module")
def maker(make_example: Callable[[], Any]) -> Callable[[], Any]:
    return make_example


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(elements=graphs(), covered=st.sets(st.sampled_from(("p", "s", "m", "a", "c"))))
def test_common_causes_are_what_both_reach(
    maker: Callable[[], Any], elements: tuple[Element, ...], covered: set[str]
) -> None:
    shared = reached(elements, "a") & reached(elements, "b")
    expected = {
        f"FSR2a and FSR2b share {kind} {name}" for kind, name in shared if name not in covered
    }
    base = sound()
    record = DependentFailure.model_construct(
        id="DFA1", covers=tuple(sorted(covered)), argument="x", owner="me", valid_until=LATER
    )
    requirements = (
        fsr("FSR2", "SG1", "D", "a"),
        fsr("FSR2a", "SG1", "B(D)", "a"),
        fsr("FSR2b", "SG1", "B(D)", "b"),
        fsr("FSR3", "SG2", "C", "c"),
    )
    concept = base.model_copy(
        update={
            "elements": elements,
            "requirements": requirements,
            "dependent_failures": (record,),
        }
    )
    found = planned(maker(), concept)
    assert {item.detail for item in found if item.rule == "common_cause"} == expected
