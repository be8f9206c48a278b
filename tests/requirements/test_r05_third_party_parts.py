"""R5: channel, sensor, metric, fault and executor of another package plug in, no change here."""

import sys
from pathlib import Path

import pytest

from adeye.cli.app import main
from tests.conftest import MakeProject
from tests.motorway import fault
from tests.project import CANDIDATE, CONCEPT, Project, odd_of, table_hash, use
from tests.stored import stored

pytestmark = pytest.mark.requirements

PARTS = stored("third_party")


@pytest.fixture
def third_party(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Install a package of somebody else."""
    name = "third_party_of_r05"
    (tmp_path / "site" / name).mkdir(parents=True)
    for file, text in PARTS["package"].items():
        (tmp_path / "site" / name / file).write_text(text, "utf-8")
    # What an installer leaves beside a package.
    told = tmp_path / "site" / f"{name}-2.5.dist-info"
    told.mkdir()
    (told / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 2.5\n")
    (told / "entry_points.txt").write_text(
        f"[adeye.executors]\nbackwards = {name}.pool:Backwards\n", "utf-8"
    )
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    return name


ALONE = {"policy": "fixed_priority", "priority": ["nominal"], "default": "nominal"}


def plugged(project: Project, name: str, *, near: float, reach: float) -> None:
    kinds = {
        "sensors": {"kind": f"{name}.eye:Eye", "parameters": {"range": reach}},
        "channels": {
            "kind": f"{name}.follow:Follow", "links": ["eye"], "parameters": {"near": near}
        },
    }  # fmt: skip
    with project.edited(CANDIDATE) as candidate:
        candidate["sensors"]["eye"] = {"rate": "20 Hz", **kinds["sensors"]}
        candidate["channels"] = {"nominal": {"rate": "20 Hz", **kinds["channels"]}}
        candidate["switch"] = ALONE


@pytest.mark.slow
def test_channel_and_sensor_of_a_third_party_drive_the_ego(
    make_project: MakeProject, third_party: str
) -> None:
    project = make_project(odd_of("cut_in"))
    # Requirements that every architecture can be judged on.
    project.require("FSR-01", "FSR-02")
    distances = {}
    for near, reach in ((60.0, 100.0), (60.0, 20.0), (1.0, 100.0)):
        plugged(project, third_party, near=near, reach=reach)
        summary = project.run()
        assert summary.executed == 1
        row = project.rows()[0]
        assert row["outcome"] == "completed"
        distances[near, reach] = row["min_distance_m"]
    # Both parts matter: a channel that heeds what the sensor sees in time keeps its distance.
    assert distances[60.0, 100.0] > max(distances[60.0, 20.0], distances[1.0, 100.0])
    assert f"{third_party}.eye" in sys.modules


@pytest.mark.slow
def test_parts_from_a_file_of_the_user_run_in_the_loop(make_project: MakeProject) -> None:
    project = make_project()
    folder = project.folder / "odd" / "architectures"
    (folder / "parts.py").write_text(PARTS["beside"], "utf-8")
    with project.edited(CANDIDATE) as candidate:
        candidate["sensors"]["compass"] = {"kind": "./parts.py:Compass", "rate": "10 Hz"}
        candidate["channels"]["nominal"] = {
            "kind": "./parts.py:Cautious",
            "links": ["compass"],
            "parameters": {"deceleration": 2.0},
        }
    project.run()
    rows = [row for row in project.rows() if row["architecture"] == "camera_radar"]
    plain = [row for row in rows if row["fault_entry"] == "none"]
    assert {row["outcome"] for row in plain} == {"completed"}
    assert {round(row["max_deceleration_mps2"], 6) for row in plain} == {2.0}


def braking(project: Project, name: str) -> None:
    """Test a channel with a hook, a fault in it, and a metric of the package."""
    with project.edited(CANDIDATE) as candidate:
        nominal = {"kind": f"{name}.braking:Braking", "links": ["localisation"]}
        candidate["channels"] = {"nominal": nominal}
        candidate["switch"] = ALONE
    project.require("FSR-01")
    with project.edited(CONCEPT) as concept:
        bound = {"formula": None, "bound": {"metric": "pace_mps", "at_least": 1.0}}
        own = {**bound, "id": "FSR-90", "on_contact": "inconclusive"}
        concept["requirements"].append({**concept["requirements"][0], **own})


@pytest.mark.slow
def test_fault_and_metric_of_a_third_party_decide_a_verdict(
    make_project: MakeProject, third_party: str
) -> None:
    frozen = fault("frozen", "hooks.nominal", "planner_frozen")
    uses = use("cut_in", faults=("none", "frozen"))
    project = make_project(odd_of(uses, faults=[frozen], plugins=[f"{third_party}.pace:Pace"]))
    braking(project, third_party)
    project.run()
    rows = {row["fault_entry"]: row for row in project.rows()}
    assert set(rows) == {"none", "frozen"}
    # The channel brakes by itself and not with the fault; the metric sees it and the verdict says.
    assert rows["none"]["max_deceleration_mps2"] == pytest.approx(2.0)
    assert rows["frozen"]["max_deceleration_mps2"] == 0.0
    verdicts = {name: row["verdicts"]["FSR-90"] for name, row in rows.items()}
    assert verdicts == {"none": "PASS", "frozen": "FAIL"}


@pytest.mark.slow
def test_executor_of_a_third_party_is_found_by_its_name_and_changes_no_result(
    make_project: MakeProject,
    third_party: str,  # noqa: ARG001 - it is installed
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    project = make_project()
    notes = tmp_path / "notes"
    options = ["--executor", "backwards", "--scheduler", str(notes), "--quiet"]
    code = main(["run", str(project.odd), "--db", str(project.db), *options])
    assert code == 0, capsys.readouterr().err
    blocks = notes.read_text().splitlines()
    assert blocks.count("block") >= 4
    assert blocks[-1] == "closed"
    project.run(db="here.db")
    assert table_hash(project.db) == table_hash(project.folder / "here.db")
    assert main(["run", str(project.odd), "--executor", "backward"]) == 2
    assert "Did you mean 'backwards'?" in capsys.readouterr().err
