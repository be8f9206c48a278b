"""Every integrity rule finds the defect that is sown for it, no other rule does, none is hidden."""

from __future__ import annotations

import json
import sqlite3
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adeye.errors import InputError
from adeye.judge.stl.batch import HELD, NEEDED, SPARE
from adeye.spec.concept import Concept, Element
from adeye.store.read.checking import Violation, check_campaign, check_plan, count_unknown
from adeye.store.read.query import run_query
from adeye.store.repository import Repository
from adeye.store.rules import RULES
from tests.store.conftest import Example, Store, requirement
from tests.stored import known, stored

# ruff: noqa: S608 - names of this file
SOUND = Concept.model_validate(stored("sound_concept"))
"""A concept of which every rule holds."""


def judged_by_it(example: Any, concept: Concept = SOUND) -> Any:
    """Give an example the concept."""
    example.requirements, example.concept = concept.requirements, lambda: concept
    return example


@pytest.fixture(scope="module")
def sound_database(tmp_path_factory: pytest.TempPathFactory, empty: bytes) -> bytes:
    """A campaign of the sound concept, executed; its triggers are gone."""
    path = tmp_path_factory.mktemp("sound") / "adeye.db"
    path.write_bytes(empty)
    with Repository.open(path, create=False) as repository:
        judged_by_it(Example()).campaign(repository, 8)
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


def violations(place: Any, *given: Any, **options: Any) -> tuple[Violation, ...]:
    checked = known(check_campaign(place, *given, **options))
    return checked.violations


# --- defects --------------------------------------------------------------------------------------

Sow = Callable[[sqlite3.Connection], object]


def sql(*statements: str) -> Sow:
    def sow(raw: sqlite3.Connection) -> None:
        for statement in statements:
            assert raw.execute(statement).rowcount > 0, statement

    return sow


def edited(table: str, name: str, **columns: str) -> Sow:
    """Edit columns of a part."""
    values = ", ".join(f"{column} = '{value}'" for column, value in columns.items())
    return sql(f"UPDATE {table} SET {values} WHERE id = '{name}'")


def content(table: str, name: str, **changes: Any) -> Sow:
    """Edit what the content of a part says."""

    def sow(raw: sqlite3.Connection) -> None:
        (text,) = raw.execute(f"SELECT content FROM {table} WHERE id = ?", (name,)).fetchone()
        said = json.dumps({**json.loads(text), **changes})
        raw.execute(f"UPDATE {table} SET content = ? WHERE id = ?", (said, name))

    return sow


def covering(*causes: str) -> Sow:
    """Let the record of the DFA cover these causes."""
    return content("dependent_failure", "DFA1", covers=causes)


def copied(table: str, source: str, name: str, **changes: Any) -> Sow:
    """Add a part like another one."""

    def sow(raw: sqlite3.Connection) -> None:
        raw.row_factory = sqlite3.Row
        found = dict(raw.execute(f"SELECT * FROM {table} WHERE id = ?", (source,)).fetchone())
        raw.row_factory = None
        found |= {"id": name, **changes}
        found["content"] = json.dumps({**json.loads(found["content"]), "id": name})
        marks = ", ".join("?" * len(found))
        raw.execute(f"INSERT INTO {table} VALUES ({marks})", tuple(found.values()))

    return sow


def related(kind: str, what: str, *elements: str) -> Sow:
    """Let elements depend on one thing."""
    return sql(
        *(
            "INSERT INTO element_relation SELECT concept_digest, "
            f"'{name}', '{kind}', '{what}', row_hash FROM element WHERE id = '{name}'"
            for name in elements
        )
    )


@dataclass(frozen=True)
class Defect:
    rule: str
    ids: str
    steps: tuple[Sow, ...]


def defect(rule: str, ids: str, *steps: Sow) -> Defect:
    """Say which rule finds it, which ids the findings name, and what is done to a campaign."""
    return Defect(rule, ids, steps)


PLACEHOLDERS = ("  ", "TBD", "Todo.", "?", "n/a", "Unknown", "none", "-")
OF_NEW = "fsr_id = 'FSR1' AND architecture = 'new'"
IN_CUT_IN = f"{OF_NEW} AND scenario = 'cut_in'"
LATE = {"valid_until": "2001-01-31"}
WAIVERS = [{"requirement": "FSR3", "expires": "2001-01-31"}]
POWER = defect("common_cause", "FSR2", related("resource", "power_a", "radar"))
BATTERY = defect("common_cause", "FSR2", related("resource", "battery", "power_a", "power_b"))
SILENT = defect(
    "independence_unknown", "radar", sql("DELETE FROM element_relation WHERE element_id = 'radar'")
)
INTO_THREE = defect(
    "illegal_decomposition",
    "FSR2",
    copied("fsr", "FSR2a", "FSR2c", asil="QM(D)"),
    content("fsr", "FSR2c", formula="always(gap >= 4)"),
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
    covering("clock", "map_server", "power_c", "power_a"),
)
ON_ONE = defect(
    "decomposition_elements",
    "FSR2 FSR2",
    sql("UPDATE allocation SET element_id = 'camera' WHERE fsr_id = 'FSR2b'"),
    covering("clock", "camera", "power_a", "map_server", "power_c"),
)
DEFECTS = (
    # What is typed in, and a class that there is not.
    defect("hazard_asil", "HE1", edited("hazardous_event", "HE1", asil="B")),
    defect("hazard_asil", "HE2", edited("hazardous_event", "HE2", exposure="E9")),
    defect("hazard_without_goal", "HE3", copied("hazardous_event", "HE1", "HE3")),
    defect("goal_asil", "SG2", edited("safety_goal", "SG2", asil="A")),
    defect("goal_without_fsr", "SG3", copied("safety_goal", "SG2", "SG3")),
    # No gate asks for what is optional.
    defect(
        "goal_without_fsr", "SG1", sql("UPDATE fsr SET mandatory = 0 WHERE content LIKE '%SG1%'")
    ),
    defect("asil_lost", "FSR3", edited("fsr", "FSR3", asil="B")),
    defect("fsr_without_allocation", "FSR1", sql("DELETE FROM allocation WHERE fsr_id = 'FSR1'")),
    defect("fsr_without_measure", "FSR1", edited("fsr", "FSR1", measure="")),
    *(
        defect("threshold_without_source", "FSR1", edited("fsr", "FSR1", threshold_source=word))
        for word in PLACEHOLDERS
    ),
    defect("response_beyond_budget", "FSR1",
           content("fsr", "FSR1", fdti=0.2, frti=0.2, response_s=0.5)),
    defect("response_beyond_budget", "FSR1",
           content("fsr", "FSR1", fdti=0.2, response_s="unbounded")),
    defect("element_capability", "FSR2a", edited("element", "camera", asil_capability="A")),
    # D into B and A, the ASIL of another goal in brackets, and no brackets.
    defect("illegal_decomposition", "FSR2", edited("fsr", "FSR2b", asil="A(D)")),
    defect("illegal_decomposition", "FSR2", edited("fsr", "FSR2b", asil="B(C)")),
    defect("illegal_decomposition", "FSR2", edited("fsr", "FSR2a", asil="B")),
    INTO_THREE,
    ON_ONE,
    defect("children_alike", "FSR2", *(
        content("fsr", child, formula=formula, bound=None)
        for child, formula in {
            "FSR2a": "always(gap >= 100 cm)", "FSR2b": "not eventually(gap < 1 m)"
        }.items()
    )),
    defect("independence_argument", "FSR2", sql("UPDATE decomposition SET independence = ''")),
    SILENT,
    POWER,
    defect("common_cause", "FSR2", related("software", "tracker", "radar", "camera")),
    defect("common_cause", "FSR2", related("supplier", "one", "radar", "camera")),
    defect("common_cause", "FSR2 FSR2", related("consumes", "map", "radar")),
    BATTERY,
    # A clock that no record covers, and a record that the decomposition does not name.
    defect("common_cause", "FSR2", covering("wiring")),
    defect("common_cause", "FSR2", content("decomposition", "FSR2", dfa=[])),
    defect("expired_dfa", "DFA1", edited("dependent_failure", "DFA1", **LATE)),
    defect("expired_assumption", "A1", edited("assumption", "A1", **LATE)),
    defect("expired_waiver", "FSR3", content("concept", "sound", waivers=WAIVERS)),
    defect("fhti_budget", "FSR3", content("fsr", "FSR3", fdti=1.5)),
    defect("fhti_budget", "SG1",
           content("fsr", "FSR1", fdti=0.6), content("fsr", "FSR2", frti=0.6)),
    # Above the EOTTI, and what the goal does not know.
    defect("emergency_operation", "FSR3",
           content("fsr", "FSR3", emergency_operation_interval=21.0)),
    defect("emergency_operation", "FSR1",
           content("fsr", "FSR1", emergency_operation_interval=1.0)),
    defect("fsr_without_scenario", "FSR1",
           sql("UPDATE campaign_fsr SET planned = 0 WHERE fsr_id = 'FSR1'")),
    # Both children have to meet it wherever one of them is judged.
    defect("fsr_without_scenario", "FSR2a", sql(
        "UPDATE campaign_fsr SET planned = 0 WHERE fsr_id = 'FSR2a' AND scenario = 'cut_in'"
    )),
    defect("hazard_without_scenario", "HE2", content("hazardous_event", "HE2", scenarios=["fog"])),
    defect("hazard_without_scenario", "HE1 HE2", sql("UPDATE campaign_fsr SET mandatory = 0")),
    defect("orphan_scenario", "fog",
           sql("""UPDATE campaign SET factors = '[{"scenario":"cut_in"},{"scenario":"fog"}]'""")),
    defect("not_applicable_in_gate", "FSR1",
           sql(f"UPDATE campaign_fsr SET applicable = 0 WHERE {IN_CUT_IN}",
               f"DELETE FROM tally WHERE {IN_CUT_IN}")),
    defect("not_run", "braking", sql("DELETE FROM run WHERE number = 3")),
    defect("stale_evidence", "FSR1", sql(f"DELETE FROM tally WHERE {OF_NEW}")),
    defect("outside_odd", "FSR1 FSR2 FSR2a FSR2b FSR3",
           sql("UPDATE campaign_case SET inside_odd = 0 WHERE ordinal = 0")),
    defect("older_version", "legacy", sql("UPDATE run SET numerics_version = 0 WHERE number = 1")),
    defect("older_version", "legacy",
           sql("UPDATE run SET plugins_digest = 'other' WHERE number = 1")),
    defect("vacuous_fsr", "FSR1", sql("UPDATE tally SET exercised = 0 WHERE fsr_id = 'FSR1'")),
)  # fmt: skip
OVERRULED = {
    # The records that these write cover the power, too.
    (INTO_THREE, POWER), (ON_ONE, POWER),
    # What the one edit deletes or moves, the other edit needs.
    (ON_ONE, SILENT), (SILENT, POWER), (SILENT, BATTERY),
}  # fmt: skip
"""Pairs in which one edit takes back the other."""


def sown(path: Path, *defects: Defect) -> None:
    with closing(sqlite3.connect(path, isolation_level=None)) as raw:
        raw.execute("PRAGMA foreign_keys = OFF")
        for step in (step for made in defects for step in made.steps):
            step(raw)


def test_sound_campaign_breaks_no_rule(database: Path) -> None:
    assert violations(database) == ()


@pytest.mark.parametrize("made", DEFECTS, ids=lambda made: made.rule)
def test_defect_is_found_by_its_rule_and_by_no_other(database: Path, made: Defect) -> None:
    sown(database, made)
    found = violations(database)
    assert {item.rule for item in found} == {made.rule}
    assert " ".join(item.id for item in found) == made.ids
    assert all(item.detail and "None" not in item.detail for item in found)


@pytest.mark.parametrize(
    ("made", "part", "detail"),
    [
        (content("fsr", "FSR1", threshold_source="t. b. d."), "fsr", "threshold_source is"),
        (
            content("decomposition", "FSR2", independence="\uff34\uff22\uff24"),
            "decomposition",
            "independence is",
        ),
        (content("safety_goal", "SG1", safe_state="to be determined"), "safety_goal", "safe_state"),
    ],
)
def test_text_that_holds_the_place_of_one_is_found(
    database: Path, made: Sow, part: str, detail: str
) -> None:
    sown(database, defect("placeholder", "", made))
    (found,) = violations(database)
    assert (found.rule, found.part) == ("placeholder", part)
    assert found.detail.startswith(detail)


def test_every_rule_has_a_defect() -> None:
    viewed = {rule.name for rule in RULES if rule.has_view}
    assert {made.rule for made in DEFECTS} == {*viewed, "children_alike"}


@pytest.mark.slow
def test_no_defect_hides_another(tmp_path: Path, sound_database: bytes) -> None:
    hidden, tried = set(), set()
    for at, one in enumerate(DEFECTS):
        for shift in (1, 4):
            other = DEFECTS[(at + shift) % len(DEFECTS)]
            tried.add((one, other))
            path = tmp_path / f"{at}-{shift}.db"
            path.write_bytes(sound_database)
            sown(path, one, other)
            if not {item.rule for item in violations(path)} >= {one.rule, other.rule}:
                hidden.add((one, other))
    assert hidden == OVERRULED & tried


@pytest.mark.parametrize(
    ("kind", "needed", "details"),
    [
        (NEEDED, 1, ["exercised in none of 8 runs: gap >= 9 never held"]),
        (HELD, 2, ["exercised for new in 1 different results, 2 are needed"]),
        (SPARE, 1, []),
    ],
)
def test_what_is_vacuous_is_found(store: Store, kind: int, needed: int, details: list[str]) -> None:
    store.example.repeat(kind)
    store.example.require(min_exercised=needed)
    found = violations(store.repository.location, store.campaign(8))
    told = [item for item in found if item.rule == "vacuous_fsr"]
    assert [item.detail for item in told if item.id == "FSR1"] == details


def test_one_view_has_what_all_have(database: Path) -> None:
    sown(database, *DEFECTS[:2], DEFECTS[-1])
    expected = [(item.rule, item.part, item.id, item.detail) for item in violations(database)]
    found = run_query(database, "SELECT rule, part, id, detail FROM v_check ORDER BY 1, 2, 3, 4")
    assert sorted(found.rows) == sorted(expected)
    for rule in (rule for rule in RULES if rule.has_view):
        run_query(database, f"SELECT * FROM {rule.view}")


def test_a_campaign_is_judged_by_its_own_concept(store: Store) -> None:
    sick = store.campaign(4)
    well = judged_by_it(Example()).campaign(store.repository, 8)
    first, second = (check_campaign(store.repository.location, name) for name in (sick, well))
    assert first is not None
    assert second is not None
    wrong = {"asil_lost", "element_capability", "fsr_without_scenario"}
    assert {item.rule for item in first.violations} == wrong
    assert second.violations == ()
    assert set(second.fsr_digests) == {item.id for item in SOUND.requirements}


def test_nothing_to_check_is_told_from_no_findings(repository: Repository, tmp_path: Path) -> None:
    assert check_campaign(repository.location) is None
    assert check_campaign(repository.location, odd="motorway") is None
    assert check_campaign(tmp_path / "none.db") is None
    with pytest.raises(InputError, match="run an ODD first"):
        check_campaign(repository.location, "1")


def test_results_that_are_neither_planned_nor_there_are_counted(store: Store) -> None:
    first = store.campaign(4)
    second = store.plan(8, block_size=3).campaign
    results = [case.result_digest for case in store.example.cases(12)]
    for campaign, parts, expected in (
        # The second campaign asks for eight, four of which are there.
        (second, [results[:6], results[6:]], (4, 12)),
        (first, [results], (8, 12)),
        (first, [results[:4] * 300], (0, 1200)),
        (first, [], (0, 0)),
    ):
        assert count_unknown(store.repository.location, campaign, parts) == expected


def test_withdrawn_result_that_another_plan_asks_for_is_not_there(store: Store) -> None:
    store.campaign(8)
    later = store.campaign(4)
    results = [[case.result_digest for case in store.example.cases(8)]]
    place = store.repository.location
    assert count_unknown(place, later, results) == (0, 8)
    for digest in (results[0][2], results[0][6]):
        store.repository.evidence.withdraw(digest, author="J. Doe", reason="wrong map")
    # What the later campaign asks for itself is found by a rule of its own.
    assert count_unknown(place, later, results) == (1, 8)
    rules = [item.rule for item in violations(place, later)]
    assert rules.count("not_run") == 1


def planned(concept: Concept) -> tuple[Violation, ...]:
    """Ask about a concept that is planned in one scenario and never saved."""
    record = judged_by_it(Example(), concept).record()
    return check_plan(record, Counter({("new", "cut_in", True): 1}))


def test_plan_is_asked_what_needs_no_evidence() -> None:
    assert planned(SOUND) == ()
    (record,) = SOUND.dependent_failures
    late = record.model_copy(update={"valid_until": date(2001, 1, 31)})
    assert planned(SOUND.model_copy(update={"dependent_failures": (late,)})) == (
        Violation("expired_dfa", "dependent_failure", "DFA1", "was valid until 2001-01-31"),
    )


# --- independence ---------------------------------------------------------------------------------

NAMES = tuple("abcdef")


@st.composite
def graphs(draw: st.DrawFn) -> tuple[Element, ...]:
    """Elements that use each other, and resources, software and suppliers that some share."""

    def some(words: Sequence[str], most: int = 1) -> tuple[str, ...]:
        return tuple(sorted(draw(st.sets(st.sampled_from(words), max_size=most))))

    found = [
        Element(
            id=name,
            kind="sensor",
            text=name,
            asil_capability="D",
            resources=tuple(used for used in some(("p", "q", *NAMES), 2) if used != name),
            supplier=draw(st.sampled_from((None, "m", "n"))),
            software=some("st"),
            provides=some("xyz"),
            consumes=some("xyz"),
        )
        for name in NAMES
    ]
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


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(elements=graphs(), covered=st.sets(st.sampled_from(("p", "s", "m", "a", "c"))))
def test_common_causes(elements: tuple[Element, ...], covered: set[str]) -> None:
    shared = reached(elements, "a") & reached(elements, "b")
    expected = {
        f"FSR2a and FSR2b share {kind} {name}" for kind, name in shared if name not in covered
    }
    (record,) = SOUND.dependent_failures
    concept = SOUND.model_copy(
        update={
            "elements": elements,
            "requirements": (
                requirement("FSR2", asil="D", allocation=("a",)),
                requirement("FSR2a", asil="B(D)", allocation=("a",)),
                requirement("FSR2b", asil="B(D)", allocation=("b",)),
                requirement("FSR3", goals=("SG2",), asil="C", allocation=("c",)),
            ),
            "dependent_failures": (record.model_copy(update={"covers": tuple(sorted(covered))}),),
        }
    )
    found = planned(concept)
    assert {item.detail for item in found if item.rule == "common_cause"} == expected
