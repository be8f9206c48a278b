"""What changed from one campaign to another: nothing with itself, and exactly what was planted."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from adeye.answers import diff_campaigns
from adeye.errors import UsageError
from adeye.judge.verdict import Verdict
from adeye.report.gate.difference import _JUDGED_BY, Difference, _why, find_difference, grouped
from adeye.report.gate.edits import edits_between
from adeye.store.read.bulk import Made
from adeye.store.repository import Repository
from tests.project import CANDIDATE, CONCEPT, Executed, Project, one_scenario
from tests.sql import rows
from tests.stored import known, stored

METRIC: str = stored("plugins")["top_speed"]


@pytest.fixture(scope="module")
def edited(mini: Executed, tmp_path_factory: pytest.TempPathFactory) -> Project:
    """The mini campaign, and one of the same ODD with six edits, of which five change a result."""
    folder = tmp_path_factory.mktemp("edited") / "project"
    project = Project(folder)
    shutil.copytree(mini.project.folder, folder, dirs_exist_ok=True)
    with project.edited(CONCEPT) as concept:
        fsrs = {item["id"]: item for item in concept["requirements"]}
        fsrs["FSR-02"]["bound"]["at_most"] = 1.0
        fsrs["FSR-01"]["text"] = "Touch nobody."
    with project.edited("scenarios_db/motorway/lead_braking.yaml") as scenario:
        scenario["parameters"]["time_gap"]["default"] = "1.9 s"
    with project.edited_odd() as odd:
        odd["title"] = "Another"
        odd["scenarios"][0]["sweep"]["parameters"]["gap"] = ["30 m", "55 m"]
        odd["faults"][0]["duration"] = "4 s"
    project.run()
    return project


def difference(project: Project, old: str | None = None, new: str | None = None) -> Difference:
    return diff_campaigns(project.db, old, new)


@pytest.fixture(scope="module")
def found(edited: Project) -> Difference:
    return difference(edited)


def test_campaign_does_not_differ_from_itself(edited: Project) -> None:
    for name in ("1", "2"):
        same = difference(edited, name, name)
        assert same.is_empty
        assert same.old == same.new


def test_exactly_the_edits_that_were_planted_are_named(found: Difference) -> None:
    assert {(edit.path, edit.old, edit.new) for edit in found.edits} == {
        ("title", "", "Another"),
        ("scenarios.cut_in.sweep.parameters.gap", '["30 m","50 m"]', '["30 m","55 m"]'),
        ("scenarios.lead_braking.parameters.time_gap.default", "2 s", "1.9 s"),
        ("faults.front_camera_out.duration", "3.0", "4.0"),
    }
    assert {(item.fsr, item.kind) for item in found.fsrs} == {
        ("FSR-01", "changed"),
        ("FSR-02", "changed"),
    }


def test_test_cases_are_those_that_the_edits_concern(edited: Project, found: Difference) -> None:
    changes = {(item.kind, item.case.scenario, item.why) for item in found.cases}
    assert changes == {
        ("added", "cut_in", ()),
        ("removed", "cut_in", ()),
        ("changed", "cut_in", ("faults",)),
        ("changed", "lead_braking", ("parameters",)),
    }
    for item in found.cases:
        if item.kind == "changed" and item.case.scenario == "cut_in":
            assert item.case.fault == "front_camera_out"
            assert "gap 30 m" in item.case.values
        elif item.kind == "added":
            assert "gap 55 m" in item.case.values
    results = "SELECT result_digest FROM campaign_case WHERE campaign_id = ?"
    then, now = ({row[0] for row in rows(edited.db, results, side.campaign)}
                 for side in (found.old, found.new))  # fmt: skip
    assert {item.old_run for item in found.cases} - {""} == then - now
    assert {item.new_run for item in found.cases} - {""} == now - then
    assert sum(count for _, count in grouped(found.cases)) == len(found.cases)


def test_verdicts_that_are_others_are_those_of_the_view(edited: Project, found: Difference) -> None:
    sql = (
        "SELECT v.fsr, v.scenario, v.architecture, v.fault_entry, c.point, t.replicate, v.verdict "
        "FROM v_verdicts v JOIN campaign_case c ON c.campaign_id = v.campaign AND "
        "c.ordinal = v.ordinal JOIN test_case t ON t.digest = c.test_case_digest "
        "WHERE v.campaign = ?"
    )
    then, now = (
        {tuple(row[:6]): row[6] for row in rows(edited.db, sql, side.campaign)}
        for side in (found.old, found.new)
    )
    turned = {key for key in then if key in now and then[key] != now[key]}
    assert turned
    assert len(found.flips) == len(turned)
    for flip in found.flips:
        at = (flip.fsr, flip.case.scenario, flip.case.architecture, flip.case.fault)
        assert (known(flip.old), known(flip.new)) in {
            (Verdict(then[key]), Verdict(now[key])) for key in turned if key[:4] == at
        }
    tightened = [flip for flip in found.flips if flip.fsr == "FSR-02"]
    assert {(flip.old, flip.new) for flip in tightened} == {(Verdict.PASS, Verdict.FAIL)}
    assert all(
        known(flip.old_margin).value > 0.0 > known(flip.new_margin).value for flip in tightened
    )


def test_old_results_are_told_under_the_new_threshold(found: Difference) -> None:
    changes = {item.fsr: item for item in found.fsrs}
    assert [edit.path for edit in changes["FSR-01"].edits] == ["text"]
    assert not changes["FSR-01"].is_measured_otherwise
    assert changes["FSR-01"].rejudged == ()
    (edit,) = changes["FSR-02"].edits
    assert (edit.path, edit.old, edit.new) == ("bound.at_most", "6.0", "1.0")
    told = {item.architecture: item for item in changes["FSR-02"].rejudged}
    radar = told["camera_radar"]
    assert set(radar.before) == {"PASS"}
    # Only results that are of the new campaign too were judged by it.
    assert 0 < radar.under_new["FAIL"] < radar.before["PASS"]
    assert radar.not_judged == radar.under_new["NOT_RUN"] > 0
    assert sum(radar.under_new.values()) == radar.before["PASS"]
    assert known(radar.worst).value < 0.0


def test_turned_around_everything_is_the_other_way(edited: Project, found: Difference) -> None:
    back = difference(edited, "2", "1")
    assert {(edit.path, edit.new, edit.old) for edit in back.edits} == {
        (edit.path, edit.old, edit.new) for edit in found.edits
    }
    assert len(back.flips) == len(found.flips)
    assert len(back.cases) == len(found.cases)
    assert {(move.fsr, move.architecture, move.scenario, move.pairs) for move in back.moves} == {
        (move.fsr, move.architecture, move.scenario, move.pairs) for move in found.moves
    }


def test_slower_sensor_moves_margins_and_nothing_else_is_named(
    edited: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    project = Project(tmp_path / "project")
    shutil.copytree(edited.folder, project.folder, dirs_exist_ok=True)
    with project.edited(CANDIDATE) as candidate:
        candidate["sensors"]["front_camera"]["latency"] = "0.2 s"
    project.run()
    found = difference(project)
    (edit,) = found.edits
    assert edit.path == "architectures.camera_radar.sensors.front_camera.latency"
    assert found.fsrs == ()
    assert {(item.kind, item.case.architecture, item.why) for item in found.cases} == {
        ("changed", "camera_radar", ("architecture",))
    }
    age = [move for move in found.moves if move.fsr == "FSR-08"]
    assert {move.unit for move in age} == {"s"}
    assert all(move.lost == move.pairs for move in age)
    moves = found.moves
    assert all(abs(move.new_margin - move.old_margin) > move.tolerance > 0.0 for move in moves)
    wide = {"m": 1000.0, "s": 1000.0, "m/s^2": 1000.0, "1": 1000.0, "m/s": 1000.0}
    monkeypatch.setattr("adeye.store.read.totals.tolerance", lambda *_: wide)
    assert difference(project).moves == ()


def test_metric_whose_code_changed_is_named_and_its_margins_are_not_compared(
    tmp_path: Path,
) -> None:
    project = Project(tmp_path / "project", one_scenario(gap=["40 m"]))
    (project.folder / "odd" / "top_speed.py").write_text(METRIC)
    with project.edited_odd() as odd:
        odd["plugins"] = ["./top_speed.py:TopSpeed"]
    with project.edited(CONCEPT) as concept:
        concept["requirements"][0] |= {"bound": {"metric": "top_speed_mps", "at_most": "99 m/s"}}
        concept["requirements"][0].pop("formula", None)
        fsr = concept["requirements"][0]["id"]
    project.run()
    path = project.folder / "odd" / "top_speed.py"
    path.write_text(path.read_text().replace("speed.max", "0.5 * speed.max"))
    assert path.read_text() != METRIC
    project.run()
    found = difference(project)
    (change,) = found.fsrs
    assert (change.fsr, change.kind, change.is_measured_otherwise) == (fsr, "changed", True)
    assert [edit.path for edit in change.edits] == [_JUDGED_BY]
    assert {item.why for item in found.cases} == {("plugins",)}
    assert fsr not in {move.fsr for move in found.moves}


def test_campaigns_are_named_by_their_place_before_the_latest(edited: Project) -> None:
    for old, new in ((None, None), ("@{-1}", "latest"), ("1", "mini"), ("@{-1}", None)):
        found = difference(edited, old, new)
        assert (found.old.number, found.new.number) == (1, 2)
    for name in ("@{-2}", "@{-0}x"):
        with pytest.raises(Exception, match=r"no campaign 2 before number 2|@\{-0\}x"):
            difference(edited, name)
    with pytest.raises(UsageError, match="no campaign 1 before number 1"):
        difference(edited, None, "1")


def test_withdrawn_result_is_no_pass_any_more(
    edited: Project, found: Difference, tmp_path: Path
) -> None:
    db = shutil.copyfile(edited.db, tmp_path / "copied.db")
    changed = next(
        item
        for item in found.cases
        if (item.kind, item.case.scenario) == ("changed", "lead_braking")
        and item.case.architecture == "camera_radar"
    )
    with Repository.open(db, create=False) as repository:
        repository.evidence.withdraw(changed.new_run, author="A", reason="B")
        old, new = (repository.find_campaign(name) for name in ("1", "2"))
        after = find_difference(repository, old, new)
    flips = [flip for flip in after.flips if flip.new_run == changed.new_run]
    assert {flip.new for flip in flips} == {Verdict.NOT_RUN}
    assert {flip.new_margin for flip in flips} == {None}
    assert Verdict.PASS in {flip.old for flip in flips}


@pytest.mark.parametrize(
    ("then", "now", "paths"),
    [
        ({"a": 1}, {"a": 1}, []),
        ({"a": 1}, {"b": 1}, ["b", "a"]),
        ({"faults": [{"id": "x", "at": 1}, {"id": "y"}]}, {"faults": [{"id": "y"}]}, ["faults.x"]),
        ([{"id": "x"}, {"id": "y"}], [{"id": "y"}, {"id": "x"}], []),
        ({"levels": [1, 2]}, {"levels": [1, 3]}, ["levels"]),
        ({"uses": [{"use": "a", "as_id": "b", "n": 1}]}, {"uses": [{"use": "a", "as_id": "b"}]},
         ["uses.b.n"]),
        ({"a": {}}, {"a": []}, ["a"]),
    ],
)  # fmt: skip
def test_edits_are_at_the_values_that_differ(then: Any, now: Any, paths: list[str]) -> None:
    assert [edit.path for edit in edits_between(then, now)] == paths
    copied = json.loads(json.dumps(then))
    assert list(edits_between(then, copied)) == []


@pytest.mark.parametrize(
    ("now", "why"), [("ab", "numerics"), ("cd", "plugins"), (None, "plugins or numerics")]
)
def test_what_is_not_executed_does_not_tell_its_plugins_from_adeye(
    now: str | None, why: str
) -> None:
    then = Made("s", "a", "[]", "{}", 1, 0.05, "ab")
    told = _why(lambda _, digest: digest, then, replace(then, plugins_digest=now))
    assert told == (why,)
    moved = replace(then, plugins_digest=now, seed=2)
    told = _why(lambda _, digest: digest, then, moved)
    assert told == (("seed", "plugins") if why == "plugins" else ("seed",))
