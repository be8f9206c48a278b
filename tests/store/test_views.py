"""The files of SQL: each view has its own."""

import json
import random  # noqa: TID251 - tests may draw
import sqlite3
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Any

import pytest

from adeye.judge.verdict import Verdict, fold_runs
from adeye.store import catalogue as catalog
from adeye.store import sql
from adeye.store.records import BlockCase, ContentRecord
from adeye.store.views import identifier, view_ddl
from tests.store.conftest import Store, sha
from tests.store.former_views import FORMER, make_former

JUDGED = [item for item in Verdict if item is not Verdict.NOT_RUN]
WAIVABLE = (Verdict.INVALID, Verdict.INCONCLUSIVE, Verdict.NOT_RUN)


def one(raw: sqlite3.Connection, sql: str, *values: Any) -> Any:
    raw.row_factory = sqlite3.Row
    (found,) = raw.execute(sql, values).fetchall()
    return found


GATE = "SELECT * FROM v_gate WHERE campaign = ? AND fsr = ? AND architecture = ?"


def test_planned_but_empty_is_not_run_and_optional_is_not_in_the_gate(store: Store) -> None:
    campaign = store.campaign(8)
    assert store.rows("SELECT DISTINCT fsr FROM v_gate ORDER BY fsr") == [("FSR1",), ("FSR3",)]
    gate = one(store.raw, GATE, campaign, "FSR3", "new")
    assert (gate["planned"], gate["verdict"]) == (0, "NOT_RUN")


@pytest.mark.parametrize(("suite", "verdict"), [("new", "ERROR"), ("legacy", None)])
def test_what_cannot_be_judged_in_the_gate(store: Store, suite: str, verdict: str | None) -> None:
    store.example.not_applicable = {"FSR1": {suite: "no such signal"}}
    gate = one(store.raw, GATE, store.campaign(4), "FSR1", suite)
    assert (gate["verdict"], gate["reason"], gate["applicable"]) == (verdict, "no such signal", 0)


def test_every_view_can_be_read_before_anything_is_stored(raw: sqlite3.Connection) -> None:
    for view in view_ddl():
        assert raw.execute(f"SELECT * FROM {view}").fetchall() == []  # noqa: S608


@pytest.mark.parametrize("min_exercised", [1, 2])
def test_sql_folds_as_the_evaluation_does(store: Store, min_exercised: int) -> None:
    """An architecture for each pair of verdicts; what has no result is in blocks of its own."""
    first = store.example.requirements[0]
    store.example.requirements = (first.model_copy(update={"min_exercised": min_exercised}),)
    every = combinations_with_replacement(Verdict, 2)
    pairs = {f"a{number}": pair for number, pair in enumerate(every)}
    planned = [(name, at, pair[at]) for name, pair in pairs.items() for at in range(2)]
    planned.sort(key=lambda item: item[2] is Verdict.NOT_RUN)
    store.example.verdict_of = lambda case, _: planned[case.ordinal][2]
    cases = [
        store.example.case(
            4 * at,
            test_case=sha(f"{name} {at}"),
            architecture=name,
            architecture_content=ContentRecord(name, "", {"sensors": name}),
            structure=str(verdict is Verdict.NOT_RUN),
        )
        for name, at, verdict in planned
    ]
    plan = store.plan(cases)
    while (block := store.repository.claim_block(campaign=plan.campaign)) is not None:
        if planned[block.cases[0].ordinal][2] is Verdict.NOT_RUN:
            assert store.repository.quarantine_block(block, "no result")
        else:
            assert store.complete(block)
    store.raw.row_factory = sqlite3.Row
    gates, states = (
        {item["architecture"]: item for item in store.rows(f"SELECT * FROM {view}")}  # noqa: S608
        for view in ("v_gate", "v_fsr_status")
    )
    assert len(pairs) == 28
    for name, verdicts in pairs.items():
        waived = {item: verdicts.count(item) for item in WAIVABLE if item in verdicts}
        folded = fold_runs(verdicts, min_exercised=min_exercised)
        assert gates[name]["verdict"] == folded, verdicts
        folded = fold_runs(verdicts, min_exercised=min_exercised, waived=waived)
        assert gates[name]["verdict_waived"] == folded, verdicts
        assert states[name]["verdict"] == fold_runs(verdicts), verdicts
        counts = {item: states[name][f"n_{item.lower()}"] for item in Verdict}
        assert counts == {item: verdicts.count(item) for item in Verdict}


def test_verdicts_of_a_run_are_a_json_object(store: Store) -> None:
    store.example.verdict_of = lambda _case, fsr: Verdict.FAIL if fsr == "FSR2" else Verdict.PASS
    store.campaign(1)
    run = one(store.raw, "SELECT * FROM v_runs")
    assert json.loads(run["verdicts"]) == {"FSR1": "PASS", "FSR2": "FAIL"}
    assert json.loads(run["parameters"]) == {"ego_speed": 20.0}
    shown = (run["min_distance_m"], run["min_ttc_s"], run["min_ttc_s_status"])
    assert shown == (3.0, None, "no_conflict")


def test_withdrawn_run_is_no_run_and_no_part_of_a_pair(store: Store) -> None:
    campaign = store.campaign(8)
    ask = "SELECT ordinal FROM v_runs ORDER BY ordinal"
    pairs = "SELECT run_a, run_b FROM v_architecture_pairs"
    assert (len(store.rows(ask)), len(store.rows(pairs))) == (8, 4)
    run = store.repository.find_run("1", campaign=campaign).result_digest
    store.vouched(campaign)
    assert store.rows(ask) == [(ordinal,) for ordinal in range(8) if ordinal != 1]
    assert [row for row in store.rows("SELECT run FROM v_runs_cut_in") if row[0] == run] == []
    told = [tuple(row) for row in store.rows(pairs)]
    assert (len(told), [row for row in told if run in row]) == (3, [])


def test_unjudged_case_shows_an_empty_object(store: Store) -> None:
    store.campaign([store.example.case(2, inside_odd=False)])
    assert one(store.raw, "SELECT verdicts FROM v_runs")["verdicts"] == "{}"


def test_planned_case_without_a_run_is_not_run_in_v_verdicts(store: Store) -> None:
    store.plan(4)
    assert store.rows("SELECT DISTINCT verdict FROM v_verdicts") == [("NOT_RUN",)]


def test_pairs_share_situation_and_fault_and_differ_in_architecture(store: Store) -> None:
    store.campaign(8)
    named = "SELECT architecture_a, architecture_b, min_distance_m_difference"
    pairs = f"{named}, * FROM v_architecture_pairs"
    told = store.rows(pairs)
    assert [tuple(row)[:3] for row in told] == [("legacy", "new", 1.0)] * 4
    # Without noted numbers they are found by digest.
    store.raw.execute("DROP TRIGGER case_run_no_delete")
    store.raw.execute("DELETE FROM case_run")
    assert store.rows(pairs) == told


@pytest.mark.parametrize(("yaw", "pairs"), [({"yaw": 0.0}, 1), ({"yaw": 0.1}, 0), ({}, 1)])
def test_pair_has_equal_values(store: Store, yaw: dict[str, float], pairs: int) -> None:
    store.campaign([store.example.case(0, point={"yaw": 0.0}), store.example.case(1, point=yaw)])
    assert store.rows("SELECT count(*) FROM v_architecture_pairs") == [(pairs,)]


def test_coverage_counts_planned_done_and_exercised(store: Store) -> None:
    store.example.judge(Verdict.VACUOUS, 0)
    assert store.complete(store.claim(store.plan(12, block_size=8).campaign))
    found = store.rows(
        "SELECT planned, done, exercised FROM v_coverage "
        "WHERE scenario = 'cut_in' AND architecture = 'legacy' AND fault_entry = 'none'"
    )
    assert found == [(3, 2, 1)]


def test_timeline_is_in_order(store: Store) -> None:
    store.campaign(1)
    found = store.rows("SELECT seq, time_s, kind, subject FROM v_timeline")
    assert found == [(0, 0.5, "storyboard", "cutter"), (1, 1.5, "handover", "safety")]


def three(example: Any, ordinal: int) -> Any:
    """A case of three architectures, one of which has an axis of its own, under two faults."""
    point, rest = divmod(ordinal, 8)
    architecture = ("legacy", "new", "new", "third")[rest % 4]
    own = {0: {"yaw": 0.0}, 1: {"yaw": 0.0}, 2: {"yaw": 0.1}, 3: {"pitch": 0.2}}[rest % 4]
    fault = ("none", "blind")[rest // 4]
    speed = 20.0 + point
    return example.case(
        0,
        test_case=sha(f"{speed} {architecture} {own} {fault}"),
        situation=sha(f"three {speed}"),
        architecture=architecture,
        architecture_content=ContentRecord(architecture, "", {"sensors": [architecture, own]}),
        fault_entry=fault,
        faults=[] if fault == "none" else [{"id": fault}],
        parameters={"ego_speed": speed},
        point={"ego_speed": speed, **own},
        inside_odd=point % 3 != 0,
        point_index=point,
    )


def complete(store: Store, campaign: str, blocks: int) -> None:
    for _ in range(blocks):
        block = store.claim(campaign)
        assert store.complete(block, verdicts=store.example.judged(block))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_views_tell_what_they_told_when_they_looked_at_every_case(store: Store, seed: int) -> None:
    picks = random.Random(seed)  # noqa: S311 - made up
    judged: dict[tuple[str, str], Verdict] = {}

    def verdict_of(case: BlockCase, fsr: str) -> Verdict:
        return judged.setdefault((case.result_digest, fsr), picks.choice(JUDGED))

    store.example.verdict_of = verdict_of
    store.example.margin_of = lambda case: len(case.result_digest) / 7.0
    cases = [three(store.example, ordinal) for ordinal in range(48)]
    whole = store.plan(cases, block_size=8)
    complete(store, whole.campaign, 6)
    # Half of the results of this one are there, most of its blocks are not done.
    store.example.with_odd("2")
    more = store.plan([*cases[:12], *store.example.cases(16)], block_size=6)
    complete(store, more.campaign, 2)
    block = store.claim(more.campaign)
    assert store.repository.quarantine_block(block, "no result")
    # Results are all there, verdicts are missing.
    store.example.thresholds["FSR1"] = "3 m"
    again = store.plan(cases, block_size=8)
    assert again.to_judge
    complete(store, again.campaign, 1)
    make_former(store.raw)
    for view, former in FORMER.items():
        now, before = (store.raw.execute(f"SELECT * FROM {name}") for name in (view, former))  # noqa: S608
        assert [item[0] for item in now.description] == [item[0] for item in before.description]
        rows = sorted(now.fetchall(), key=str)
        assert len(rows) > 10
        assert rows == sorted(before.fetchall(), key=str), view
    assert store.repository.verify() == ()


def columns(raw: sqlite3.Connection, view: str) -> list[str]:
    return [item[0] for item in raw.execute(f"SELECT * FROM {view}").description]  # noqa: S608


def test_identifier_is_safe_whatever_the_text() -> None:
    plain = {"cut_in": "cut_in", "Cut In!": "cut_in", "9 lives": "x_9_lives"}
    hostile = {"'; DROP TABLE run; --": "drop_table_run", "": "x_", "é": "x_"}
    for text, name in (plain | hostile).items():
        assert identifier(text) == name


def test_each_parameter_is_a_typed_column_with_its_unit(store: Store) -> None:
    store.campaign(8)
    found = store.rows("SELECT ego_speed_mps FROM v_runs_cut_in ORDER BY ordinal")
    assert found == [(20.0,), (20.0,), (21.0,), (21.0,)]
    assert {type(value) for (value,) in found} == {float}
    assert "ego_speed" in columns(store.raw, "v_runs_braking")


def test_view_follows_new_parameters(store: Store) -> None:
    store.campaign(4)
    assert "gap" not in columns(store.raw, "v_runs_cut_in")
    case = store.example.case(
        0,
        test_case="a" * 64,
        parameters={"ego_speed": 20.0, "gap": 7.0},
        point={"gap": 7.0, "architecture.sensors.camera.kind": "wide"},
    )
    asked = "SELECT gap, architecture_sensors_camera_kind FROM v_runs_cut_in WHERE campaign = ?"
    assert store.rows(asked, (store.campaign([case]),)) == [(7.0, "wide")]


def test_parameter_named_like_a_column_gets_a_name_of_its_own(store: Store) -> None:
    case = store.example.case(0, parameters={"outcome": 1.0, "a.b": 2.0, "a_b": 3.0}, point={})
    store.campaign([case])
    names = columns(store.raw, "v_runs_cut_in")
    assert len(names) == len(set(names))
    assert sum(name.startswith("outcome") for name in names) == 2
    assert sum(name.startswith("a_b") for name in names) == 2
    assert store.rows("SELECT outcome FROM v_runs_cut_in") == [("completed",)]


def test_scenarios_with_one_identifier_get_two_views(store: Store) -> None:
    store.campaign([store.example.case(0), store.example.case(4, scenario="Cut-In")])
    with store.repository._database.read() as connection:
        views = [name for name in catalog.views(connection) if name.startswith("v_runs_cut_in")]
    assert len(views) == 2
    for view in views:
        assert len(store.rows(f"SELECT * FROM {view}")) == 1  # noqa: S608


def test_hostile_names_make_no_sql(store: Store) -> None:
    hostile = "x') FROM run; DROP TABLE run; --"
    cases = [
        store.example.case(0, parameters={hostile: 1.0}, point={hostile: "'"}),
        store.example.case(4, scenario=hostile),
    ]
    store.campaign(cases)
    assert store.repository.info().rows["run"] == 2
    assert store.repository.verify() == ()
    assert len(store.rows("SELECT * FROM v_runs_cut_in")) == 1


def test_parameter_may_be_called_like_a_word_of_sql(store: Store) -> None:
    words = ("on", "order", "Group", "limit", "values", "null")
    parameters = {word: float(place) for place, word in enumerate(words)}
    store.campaign([store.example.case(0, parameters=parameters)])
    asked = ", ".join(f'"{word.lower()}"' for word in words)
    assert store.rows(f"SELECT {asked} FROM v_runs_cut_in") == [tuple(parameters.values())]  # noqa: S608


def test_long_names_that_differ_at_their_end_are_kept_apart(store: Store) -> None:
    """A server cuts names to 63 bytes; scenarios and parameters have longer ones."""
    long = "x" * 63
    parameters = {f"{long}a": 1.0, f"{long}b": 2.0}
    cases = [
        store.example.case(at, scenario=f"{long}{end}", parameters=parameters, point={})
        for at, end in ((0, "a"), (4, "b"))
    ]
    for count in (1, 2):
        # The second plan finds the views of the first.
        store.campaign(cases[:count])
    with store.repository._database.read() as connection:
        views = [name for name in catalog.views(connection) if name.startswith("v_runs_x")]
    assert len(views) == 2
    for view in views:
        names = columns(store.raw, view)
        assert len([name for name in names if name.startswith("xxx")]) == 2
    assert store.repository.verify() == ()


FOLDER = Path(sql.__file__).parent


def test_every_view_has_a_file_and_every_file_makes_the_view_of_its_name() -> None:
    names = {path.stem for path in FOLDER.glob("v_*.sql")}
    # One is put together from the others, and those of the scenarios are made from one.
    assert names == {*view_ddl()} - {"v_check"} | {"v_runs_scenario"}
    for name in names:
        made = "$view" if name == "v_runs_scenario" else name
        assert sql.statement(name).startswith(f"CREATE VIEW {made} AS\n")
    for ddl in view_ddl().values():
        assert "-- " not in ddl
        assert "$" not in ddl.replace("'$.", "")


def test_tags_are_found_whatever_has_them(store: Store) -> None:
    example = store.example
    content = {
        "odd": {"odd": "motorway", "tags": {"release": "r1"}},
        "scenarios": {"cut_in": {"tags": {"r157": "4.4.1", "nhtsa": "", "team": "planning"}}},
        "architectures": {"new": {"tags": {"team": "sensors"}}, "legacy": {}},
    }
    example.odd = ContentRecord("motorway", "1", content)
    first = example.requirements[0]
    example.requirements = (first.model_copy(update={"tags": {"team": "brakes"}}),)
    example.parts = {"tags": {"owner": "safety"}}
    campaign = store.campaign(4)
    found = store.rows("SELECT kind, id, tag, text FROM v_tags WHERE campaign = ?", (campaign,))
    assert sorted(found) == [
        ("architecture", "new", "team", "sensors"),
        ("concept", "example", "owner", "safety"),
        ("fsr", "FSR1", "team", "brakes"),
        ("odd", "motorway", "release", "r1"),
        ("scenario", "cut_in", "r157", "4.4.1"),
        ("scenario", "cut_in", "team", "planning"),
    ]
