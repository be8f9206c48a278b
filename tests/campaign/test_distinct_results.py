"""The same result counts once, however many names, ids and replicates it has."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
import yaml

from adeye.judge.verdict import ExitCode, Verdict
from adeye.store.read.totals import totals
from adeye.store.repository import Repository
from adeye.store.write import queue as leasing
from tests.project import CANDIDATE, CONCEPT, MINI, Project, count_rows

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.campaign.summary import CampaignSummary
    from adeye.store.read.totals import Total

ONE: dict[str, Any] = {
    **MINI,
    "scenarios": [
        {
            "use": "lead_braking",
            "faults": ["none"],
            "sweep": {"parameters": {"deceleration": ["4 m/s^2", "6 m/s^2"]}},
        }
    ],
    "faults": [],
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
        newest = repository.latest_campaign()
        assert newest is not None
        assert repository.verify() == ()
        return totals(repository, newest)[0]


def copied(project: Project, name: str) -> None:
    path = project.folder / "scenarios_db"
    (file,) = path.rglob("lead_braking.yaml")
    content = yaml.safe_load(file.read_text("utf-8"))
    content |= {"scenario": name, "title": "Another title"}
    file.with_name(f"{name}.yaml").write_text(yaml.safe_dump(content), "utf-8")


def as_other_names(project: Project) -> None:
    with project.edited_odd() as odd:
        odd["scenarios"] += [{**odd["scenarios"][0], "as": f"again_{at}"} for at in range(4)]


def as_replicates(project: Project) -> None:
    with project.edited_odd() as odd:
        odd["replicates"] = 5


def as_copies_of_the_file(project: Project) -> None:
    names = [f"copy_{at}" for at in range(4)]
    for name in names:
        copied(project, name)
    with project.edited_odd() as odd:
        odd["scenarios"] += [{**odd["scenarios"][0], "use": name} for name in names]


def as_an_axis_without_effect(project: Project) -> None:
    with project.edited_odd() as odd:
        sweep = odd["scenarios"][0]["sweep"]["parameters"]
        sweep["architecture.switch.staleness"] = [f"{time} s" for time in (0.3, 0.4, 0.5, 0.6, 0.7)]


def as_a_fault_that_changes_nothing(project: Project) -> None:
    with project.edited_odd() as odd:
        fault = {"id": "far", "target": "sensors.truth", "model": "miss", "onset": {"at": "2 s"}}
        odd["faults"] = [{**fault, "probability": 1.0, "beyond": "900 m"}]
        odd["scenarios"][0]["faults"] = ["far"]
        sweep = odd["scenarios"][0]["sweep"]["parameters"]
        sweep["faults.far.onset.at"] = [f"{time} s" for time in (2, 2.5, 3, 3.5, 4)]


# With the fault there are the two runs without it, too.
WAYS = [
    (as_other_names, 10),
    (as_replicates, 10),
    (as_copies_of_the_file, 10),
    (as_an_axis_without_effect, 10),
    (as_a_fault_that_changes_nothing, 12),
]


@pytest.mark.slow
@pytest.mark.parametrize(("again", "runs"), WAYS)
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


@pytest.mark.parametrize("again", [as_other_names, as_copies_of_the_file])
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
    record = vars(leasing)["record_runs"]

    def recording(connection: Any, block: Any) -> Any:
        executed.append(len(block))
        return record(connection, block)

    monkeypatch.setattr(leasing, "record_runs", recording)
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
        ("always[0 s, 1 s](time >= {} implies authority.nominal)", Verdict.VACUOUS),
        ("(ego.speed < -1 m/s or (time >= {} implies authority.nominal))", Verdict.VACUOUS),
        ("authority.nominal or (time >= {} implies authority.nominal)", Verdict.PASS),
    ],
)
def test_nested_implication_that_no_run_asks_for_is_never_silent(
    project: Project, nested: str, verdict: Verdict
) -> None:
    def ask(time: str) -> CampaignSummary:
        with project.edited(CONCEPT) as concept:
            formula = f"always(rise(time >= 1 s) implies {nested.format(time)})"
            concept["requirements"][0] |= {"formula": formula}
        return project.run()

    for time in ("500 s", "400 s"):
        # The second time results are judged again, from traces that are executed again.
        summary = ask(time)
        found = total(project)
        assert (found.verdict, found.exercised) == (verdict, 2 if verdict is Verdict.PASS else 0)
        assert f"time >= {time} never held" in summary.message
        green = verdict is Verdict.PASS
        assert summary.exit_code is (ExitCode.OK if green else ExitCode.INCOMPLETE)
    summary = ask("1 s")
    assert (total(project).verdict, total(project).exercised) == (Verdict.PASS, 2)
    assert "never held" not in summary.message
