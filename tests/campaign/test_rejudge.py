"""Judging again, whatever it reads; and the same result counts once."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from adeye.campaign import work
from adeye.campaign.run import judge_campaign, run_campaign
from adeye.campaign.summary import CampaignSummary
from adeye.errors import IntegrityError
from adeye.judge.metrics import METRICS
from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.gate import decide
from adeye.report.gate.changes import Tolerances
from adeye.store.evidence.roots import folder_of
from adeye.store.read.totals import Total, totals
from adeye.store.repository import Repository
from adeye.store.write import results as writing
from tests.project import CANDIDATE, CONCEPT, MINI, Project, count_rows, one_scenario
from tests.sql import alter, rows
from tests.stored import known, stored

# --- judging again gives the rows that judging the runs directly gives, whatever it reads


METRIC_PLUGIN: str = stored("plugins")["touchy"]

FAULTS = ("none", "front_camera_out", "nominal_silent", "never")
ODD: dict[str, Any] = {
    **MINI,
    "scenarios": [
        *one_scenario("cut_in", *FAULTS, ego_speed=["80 km/h", "120 km/h"], gap=["30 m"])[
            "scenarios"
        ],
        *one_scenario("lead_braking", time_gap=["1 s", "2 s"])["scenarios"],
    ],
    "faults": [
        *MINI["faults"],
        # It never acts: what does not fail in its runs is invalid.
        {**MINI["faults"][1], "id": "never", "onset": {"when": "cutter.gap >= 900 m"}},
    ],
    "plugins": ["./touchy.py:Touchy"],
}

FSRS = stored("fsrs")
OWN: dict[str, Any] = FSRS["own"]
"""FSRs beside the shipped ones, each of another kind."""

OTHER: dict[str, Any] = FSRS["other"]
"""The same with other thresholds."""

FROM_TRACES = {"OWN-BOTH"}
"""FSRs of more than one comparison."""


def edit(project: Project) -> None:
    """Change every threshold."""
    with project.edited(CONCEPT) as concept:
        for item in concept["requirements"]:
            new = OTHER.get(item["id"])
            if isinstance(new, str):
                item["formula"] = new
            elif new is not None:
                side = next(key for key in item["bound"] if key != "metric")
                item["bound"][side] = new


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Project:
    project = Project(tmp_path_factory.mktemp("project"), ODD)
    (project.folder / "odd" / "touchy.py").write_text(METRIC_PLUGIN, "utf-8")
    with project.edited("scenarios_db/motorway/lead_braking.yaml") as scenario:
        # With the larger time gap the lead never brakes: those runs are invalid for every FSR.
        brake = scenario["storyboard"]["brake"]
        brake["when"] = "time >= if_(time_gap > 1.5 s, 100 s, 1 s)"
    with project.edited(CONCEPT) as concept:
        pattern = next(item for item in concept["requirements"] if item["id"] == "FSR-01")
        bare = {key: value for key, value in pattern.items() if key not in {"formula", "bound"}}
        concept["requirements"] = [
            pattern,
            *({**bare, "mandatory": False, "id": name, **own} for name, own in OWN.items()),
        ]
    return project


def verdicts(db: Path, campaign: str) -> list[tuple[Any, ...]]:
    """Read every column of every verdict of a campaign, in the order of the plan."""
    sql = "SELECT * FROM v_verdicts WHERE campaign = ? ORDER BY ordinal, fsr"
    return rows(db, sql, campaign)


def differences(one: list[tuple[Any, ...]], other: list[tuple[Any, ...]]) -> Iterator[Any]:
    assert len(one) == len(other)
    for left, right in zip(one, other, strict=True):
        if left != right:
            yield left, right


@pytest.fixture(scope="module")
def fresh(made: Project, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Judge the edited project in a database of its own, and the project before it in another."""
    folder = tmp_path_factory.mktemp("rejudging")
    before, kept, direct = (folder / f"{name}.db" for name in ("before", "kept", "direct"))
    plan = made.plan()
    run_campaign(plan, db=before)
    run_campaign(plan, db=kept, traces="all")
    edit(made)
    summary = run_campaign(made.plan(), db=direct)
    return before, kept, verdicts(direct, summary.campaign)


@pytest.mark.slow
def test_every_way_is_the_same(made: Project, fresh: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    before, kept, direct = fresh
    kinds = {row[10] for row in direct}
    assert {"PASS", "FAIL", "INCONCLUSIVE", "VACUOUS", "ERROR", "INVALID"} <= kinds

    with monkeypatch.context() as patched:
        patched.setattr(work, "run_batch", Mock(side_effect=AssertionError("a run was executed")))
        stored_only = judge_campaign(made.plan(), db=before)
        assert stored_only.exit_code is not ExitCode.OK
        assert set(stored_only.ways) == {"invalid", "metric", "samples"}
        assert 0 < stored_only.to_replay <= stored_only.reused
        told = verdicts(before, stored_only.campaign)
        assert {row[7] for row in told if row[10] == "NOT_RUN"} == FROM_TRACES
        same = [row for row in direct if row[7] not in FROM_TRACES]
        found = [row for row in told if row[7] not in FROM_TRACES]
        assert list(differences(found, same)) == []

        traces = judge_campaign(made.plan(), db=kept)
        assert set(traces.ways) == {"invalid", "metric", "samples", "trace"}
        assert (traces.to_replay, traces.replayed, traces.executed) == (0, 0, 0)
        assert list(differences(verdicts(kept, traces.campaign), direct)) == []

    replayed = judge_campaign(made.plan(), db=before, replay=True)
    assert (replayed.to_replay, replayed.replayed) == (0, stored_only.to_replay)
    assert list(differences(verdicts(before, replayed.campaign), direct)) == []
    for db in (before, kept):
        with Repository.open(db, create=False) as repository:
            assert repository.verify() == ()


def both_above(made: Project, distance: str) -> None:
    """Give the FSR that only a trace can judge another threshold."""
    with made.edited(CONCEPT) as concept:
        item = next(item for item in concept["requirements"] if item["id"] == "OWN-BOTH")
        item["formula"] = f"always(any_actor.distance > {distance} or ego.speed < 11 m/s)"


@pytest.mark.slow
@pytest.mark.parametrize("what", ["ego", "meta", "bit"])
def test_trace_that_was_altered_is_not_judged(made: Project, tmp_path: Path, what: str) -> None:
    db = tmp_path / "a.db"
    run_campaign(made.plan(), db=db, traces="all")
    for path in folder_of(db).iterdir():
        if what == "bit":
            content = bytearray(path.read_bytes())
            content[len(content) // 2] ^= 1
            path.write_bytes(content)
            continue
        with np.load(path) as kept:
            arrays = {name: kept[name] for name in kept.files}
        if what == "ego":
            arrays["ego"][:, 0, 0] += 1.0
        else:
            meta = json.loads(arrays[what].tobytes())
            meta["monitors"] = [f"no_{name}" for name in meta["monitors"]]
            arrays[what] = np.frombuffer(json.dumps(meta).encode(), dtype=np.uint8)
        np.savez(path, **arrays)
    both_above(made, {"ego": "8 m", "meta": "7 m", "bit": "6 m"}[what])
    with pytest.raises(IntegrityError, match="is not the one that was recorded"):
        judge_campaign(made.plan(), db=db)
    # Without the files the runs are replayed instead.
    for path in folder_of(db).iterdir():
        path.unlink()
    summary = judge_campaign(made.plan(), db=db)
    # Of a run that is invalid nothing is read.
    assert summary.to_replay + summary.ways["invalid"] == summary.planned


@pytest.mark.slow
@pytest.mark.parametrize("is_same", [True, False])
def test_metric_that_is_defined_otherwise_by_now_tells_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, is_same: bool
) -> None:
    project = Project(tmp_path / "project", MINI)
    with project.edited(CONCEPT) as concept:
        (item,) = [item for item in concept["requirements"] if "bound" in item][:1]
        concept["requirements"] = [item]
    run_campaign(project.plan(), db=project.db)
    name = item["bound"]["metric"]
    uid = METRICS[name].uid if is_same else "adeye:test@99"
    monkeypatch.setitem(METRICS, name, replace(METRICS[name], uid=uid))
    with project.edited(CONCEPT) as concept:
        concept["requirements"][0]["bound"]["at_most"] = 5.25
    judged = judge_campaign(project.plan(), db=project.db)
    assert judged.ways == ({"metric": judged.planned} if is_same else {})
    assert judged.to_replay == (0 if is_same else judged.planned)
    with Repository.open(project.db, create=False) as repository:
        campaign = known(repository.latest_campaign())
        assert campaign.state == ("complete" if is_same else "to be judged")
        gate = decide.judge_campaign(repository, campaign, None, Tolerances())
    said = "the campaign is to be judged. The others have results without verdicts; 'adeye judge'"
    assert any(said in str(item) for item in gate.findings) is not is_same


@pytest.mark.slow
def test_place_that_a_file_does_not_have_is_not_read(made: Project, tmp_path: Path) -> None:
    db = tmp_path / "a.db"
    run_campaign(made.plan(), db=db, traces="all")
    alter(db, "UPDATE kept_trace SET place = place + 1000")
    both_above(made, "9 m")
    with pytest.raises(IntegrityError, match="has fewer runs than results refer to"):
        judge_campaign(made.plan(), db=db)


# --- the same result counts once, however many names, ids and replicates it has


ONE: dict[str, Any] = {
    **one_scenario("lead_braking", deceleration=["4 m/s^2", "6 m/s^2"]),
    "architectures": ["architectures/quiet.yaml"],
    "gate": {"architectures": ["quiet"]},
}
"""Two test cases of an architecture without noise."""


@pytest.fixture
def project(tmp_path: Path) -> Project:
    project = Project(tmp_path, ONE)
    write_quiet(project, "quiet")
    with project.edited(CONCEPT) as concept:
        concept["requirements"] = [
            {**concept["requirements"][0], "min_exercised": 2, "allocation": ["switch"]}
        ]
        concept["waivers"] = []
    return project


def write_quiet(project: Project, name: str, **changes: Any) -> None:
    """Write an architecture that draws no random number."""
    quiet = project.read(CANDIDATE)
    quiet |= {
        "architecture": name,
        "sensors": {"truth": {"kind": "ground_truth", "rate": "20 Hz", "latency": "0.05 s"}},
        "channels": {"nominal": {"kind": "nominal", "links": ["truth"], "rate": "20 Hz"}},
        "switch": {"policy": "fixed_priority", "priority": ["nominal"], "default": "nominal"},
        **changes,
    }
    project.write(f"odd/architectures/{name}.yaml", quiet)


def asked(project: Project, results: int) -> None:
    with project.edited(CONCEPT) as concept:
        concept["requirements"][0]["min_exercised"] = results


def total(project: Project) -> Total:
    with Repository.open(project.db, create=False) as repository:
        newest = known(repository.latest_campaign())
        assert repository.verify() == ()
        return totals(repository, newest)[0]


def copied(project: Project, name: str, **changes: Any) -> None:
    content = project.read("scenarios_db/motorway/lead_braking.yaml")
    content |= {"scenario": name, "title": "Another title", **changes}
    project.write(f"scenarios_db/motorway/{name}.yaml", content)


def as_uses(key: str) -> Callable[[Project], None]:
    """Use the scenario four times more, under other names or as copies of its file."""

    def again(project: Project) -> None:
        with project.edited_odd() as odd:
            odd["scenarios"] += [{**odd["scenarios"][0], key: f"copy_{at}"} for at in range(4)]
        for at in range(4 if key == "use" else 0):
            copied(project, f"copy_{at}")

    return again


def as_replicates(project: Project) -> None:
    with project.edited_odd() as odd:
        odd["replicates"] = 5


def as_shorter_drives(project: Project) -> None:
    as_uses("use")(project)
    for at in range(4):
        copied(project, f"copy_{at}", horizon=f"{11.8 - at / 20} s")


def swept(axis: str, first: float, step: float, **fault: Any) -> Callable[[Project], None]:
    """Sweep five times in seconds, of a fault if there is one."""

    def again(project: Project) -> None:
        with project.edited_odd() as odd:
            use = odd["scenarios"][0]
            use["sweep"]["parameters"][axis] = [f"{first + at * step:g} s" for at in range(5)]
            if fault:
                odd["faults"] = [{**fault, "onset": {"at": "2 s"}}]
                use["faults"] = [fault["id"]]

    return again


FAR = {"id": "far", "target": "sensors.truth", "model": "miss", "probability": 1.0}
as_a_fault_that_changes_nothing = swept("faults.far.onset.at", 2, 0.5, **FAR, beyond="900 m")
# With a fault there are the two runs without it, too.
WAYS = {
    "other names": (as_uses("as"), 10),
    "replicates": (as_replicates, 10),
    "copies of the file": (as_uses("use"), 10),
    "shorter drives": (as_shorter_drives, 10),
    "an axis without effect": (swept("architecture.switch.staleness", 0.3, 0.1), 10),
    "a fault that changes nothing": (as_a_fault_that_changes_nothing, 12),
    "a stuck switch that has nowhere to go": (
        swept("faults.jam.onset.at", 1, 0.5, id="jam", target="switch", model="stuck"), 12,
    ),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("again", "runs"), WAYS.values(), ids=WAYS)
def test_two_results_do_not_become_more(project: Project, again: Any, runs: int) -> None:
    again(project)
    summary = project.run()
    assert (summary.planned, summary.exit_code) == (runs, ExitCode.OK)
    assert f"{runs - 2} runs of quiet repeat a result, which counts once" in summary.message
    found = total(project)
    assert (found.runs, found.exercised, found.repeated) == (runs, 2, runs - 2)
    asked(project, 3)
    summary = project.run()
    assert summary.exit_code is ExitCode.INCOMPLETE
    assert "FSR-01 VACUOUS" in summary.message


@pytest.mark.slow
def test_other_values_are_other_results(project: Project) -> None:
    with project.edited_odd() as odd:
        use = odd["scenarios"][0]
        other = {"parameters": {"deceleration": ["5 m/s^2", "6 m/s^2"]}}
        odd["scenarios"].append({**use, "as": "again", "sweep": other})
    asked(project, 3)
    assert project.run().exit_code is ExitCode.OK
    assert total(project).exercised == 3
    (notice,) = project.plan().notices
    assert notice.startswith("1 of 2 test cases of again are those of lead_braking under another")


@pytest.mark.parametrize("again", [as_uses("as"), as_uses("use")])
def test_plan_names_scenarios_that_are_there_twice(project: Project, again: Any) -> None:
    assert project.plan().notices == ()
    again(project)
    notices = project.plan().notices
    assert len(notices) == 4
    assert "2 of 2 test cases of" in notices[0]
    assert "are those of lead_braking under another name" in notices[0]


@pytest.mark.slow
def test_architecture_under_two_ids_is_executed_once_and_shares_its_results(
    project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    executed: list[int] = []
    record = vars(writing)["record_runs"]

    def recording(connection: Any, block: Any) -> Any:
        executed.append(len(block))
        return record(connection, block)

    monkeypatch.setattr(writing, "record_runs", recording)
    write_quiet(project, "renamed", title="Another title", text="Another text")
    with project.edited_odd() as odd:
        odd["architectures"].append("architectures/renamed.yaml")
        odd["gate"]["architectures"] = ["quiet", "renamed", "quiet"]
    notices = project.plan().notices
    assert "the gate names quiet 2 times; it counts once" in notices
    assert any(
        item.startswith("architecture renamed is quiet under another id") for item in notices
    )
    summary = project.run(threads=2)
    assert (summary.planned, summary.exit_code) == (4, ExitCode.OK)
    assert count_rows(project.db, "run") == 2
    assert sum(executed) == 2
    results = {row["run"] for row in project.rows()}
    assert len(results) == 2
    assert [line.exercised for line in summary.verdicts] == [2, 2]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("nested", "verdict"),
    [
        ("always[0 s, 1 s](ego.speed >= {} implies authority.nominal)", Verdict.VACUOUS),
        ("(ego.speed < -1 m/s or (ego.speed >= {} implies authority.nominal))", Verdict.VACUOUS),
        ("authority.nominal or (ego.speed >= {} implies authority.nominal)", Verdict.PASS),
    ],
)
def test_nested_implication_is_not_silent(project: Project, nested: str, verdict: Verdict) -> None:
    def ask(speed: str) -> CampaignSummary:
        with project.edited(CONCEPT) as concept:
            formula = f"always(rise(time >= 1 s) implies {nested.format(speed)})"
            concept["requirements"][0] |= {"formula": formula}
        return project.run()

    for speed in ("80 m/s", "70 m/s"):
        # The second time results are judged again, from traces that are executed again.
        summary = ask(speed)
        found = total(project)
        assert (found.verdict, found.exercised) == (verdict, 2 if verdict is Verdict.PASS else 0)
        assert f"ego.speed >= {speed} never held" in summary.message
        green = verdict is Verdict.PASS
        assert summary.exit_code is (ExitCode.OK if green else ExitCode.INCOMPLETE)
    summary = ask("1 m/s")
    assert (total(project).verdict, total(project).exercised) == (Verdict.PASS, 2)
    assert "never held" not in summary.message


@pytest.mark.slow
def test_faults_that_change_nothing_do_not_count(project: Project) -> None:
    as_a_fault_that_changes_nothing(project)
    with project.edited_odd() as odd:
        odd["faults"].append({**odd["faults"][0], "id": "near", "beyond": "1 m"})
        odd["scenarios"][0]["faults"] = ["far", "near"]
        del odd["scenarios"][0]["sweep"]["parameters"]["faults.far.onset.at"]
    for formula in (
        "always((rise(fault.far.active) or rise(fault.near.active)) implies not standstill)",
        "always(rise(faulted) implies not standstill)",
    ):
        with project.edited(CONCEPT) as concept:
            concept["requirements"][0] |= {"formula": formula, "min_exercised": 1}
        project.run()
        found = total(project)
        assert (found.exercised, found.never_held) == (2, ())
    # Beside another of its entry, what changes nothing does not count either.
    with project.edited_odd() as odd:
        odd["scenarios"][0]["faults"] = ["near", ["far", "near"]]
    both = "always((fault.far.active and fault.near.active) implies ego.speed < 99 m/s)"
    with project.edited(CONCEPT) as concept:
        concept["requirements"][0]["formula"] = both
    project.run()
    (never,) = total(project).never_held
    assert never.antecedent == "(fault.far or fault.near changes the run)"
    with project.edited(CONCEPT) as concept:
        concept["requirements"][0]["formula"] = "always(rise(faulted) implies not standstill)"
    with project.edited_odd() as odd:
        odd["scenarios"][0]["faults"] = ["far"]
    summary = project.run()
    assert "(a fault changes the run) never held" in summary.message
    # A bound on what is counted from a fault on is about faults, too.
    for metric, most in (("fault_to_safe_state_s", 20), ("stop_regret", 7)):
        with project.edited(CONCEPT) as concept:
            concept["requirements"][0].pop("formula", None)
            concept["requirements"][0]["bound"] = {"metric": metric, "at_most": most}
        assert "(a fault changes the run) never held" in project.run().message


@pytest.mark.slow
def test_nothing_is_judged_by_rows_that_are_not_as_they_were_written(project: Project) -> None:
    assert project.run().exit_code is ExitCode.OK
    with project.edited(CONCEPT) as concept:
        del concept["requirements"][0]["formula"]
        concept["requirements"][0]["bound"] = {"metric": "min_distance_m", "at_least": 1000}
    alter(project.db, "UPDATE metric SET min_distance_m = 2000")
    with pytest.raises(IntegrityError, match="table metric: rows are not as they were written"):
        project.run()


@pytest.mark.slow
def test_requirement_about_a_fault_that_changes_nothing_is_not_tested(project: Project) -> None:
    as_a_fault_that_changes_nothing(project)
    with project.edited(CONCEPT) as concept:
        concept["requirements"][0] |= {
            "formula": "always(rise(fault.far.active) implies always[0 s, 1 s] not contact)",
            "min_exercised": 1,
        }
    summary = project.run()
    assert summary.exit_code is ExitCode.INCOMPLETE
    assert "FSR-01 VACUOUS" in summary.message
    assert "(fault.far changes the run) never held" in summary.message
    with project.edited_odd() as odd:
        odd["faults"][0] |= {"beyond": "1 m"}
    summary = project.run()
    assert (summary.exit_code, total(project).exercised) == (ExitCode.FAILED, 10)
