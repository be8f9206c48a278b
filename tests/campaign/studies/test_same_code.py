"""Nothing is executed beside a stored run with other code than executed the run."""

import os
import shutil
import zipfile
from hashlib import sha256
from pathlib import Path

import pytest

import adeye
from adeye.campaign.parts import Source, Unchanged
from adeye.campaign.studies.fault_timing import campaign_injections, run_timeline
from adeye.campaign.studies.forks import fork_run
from adeye.campaign.studies.preventability import prevent
from adeye.errors import IntegrityError
from tests.project import Project, odd_of
from tests.refusals import refused

OWN = "def drive(seen):\n    return 0.0, 0.0\n"
POLICY = {
    "extends": "camera_radar.yaml",
    "architecture": "own",
    "channels": {
        "nominal": {
            "kind": "policy",
            "parameters": {"policy": "./own.py:drive", "normalised": False},
        }
    },
}
FMU = "odd/architectures/fmus/single_track.fmu"


@pytest.mark.slow
def test_forks_are_of_the_fmu_that_moves_the_vehicle_and_drives_of_none(tmp_path: Path) -> None:
    pytest.importorskip("fmpy", reason="needs adeye[fmi]")
    project = Project(tmp_path / "project", odd_of("cut_in", architectures=("fmu_vehicle",)))
    project.run()
    (first,) = project.rows()
    drives = [prevent(project.db, models=("cc",), everything=True).comparisons[0].drive]
    fmu = project.folder / FMU
    kept = fmu.read_bytes()
    with zipfile.ZipFile(fmu, "a") as archive:  # another FMU, whatever it does
        archive.writestr("documentation/note.txt", "edited")
    run = str(first["run"])
    said = r"is no longer what it was\. Run the campaign again"
    refused(IntegrityError, fork_run, project.db, run, start="1 s", authority="safety", says=said)
    refused(IntegrityError, prevent, project.db, models=("rss",), everything=True, says=said)
    project.run()
    (again,) = project.rows()
    assert again["run"] != run
    # What either FMU did excuses nothing: none moves the car of a reference driver.
    drives.append(prevent(project.db, models=("cc",), everything=True).comparisons[0].drive)
    assert len(set(drives)) == 1
    fmu.write_bytes(kept)
    assert fork_run(project.db, run, start="1 s", authority="safety").origin.run == run


def test_what_is_written_while_something_is_executed_is_noticed(tmp_path: Path) -> None:
    code = tmp_path / "own.py"
    code.write_text(OWN)
    digest = sha256(OWN.encode()).hexdigest()
    unchanged = Unchanged([Source("own.py", "architecture own", tmp_path, digest, code)])
    unchanged.check()
    code.write_text(OWN)  # what was there, for it may have been another one between
    refused(IntegrityError, unchanged.check, says=r"was changed after .*own\.py")


def test_plugin_is_looked_for_where_it_was_and_not_in_the_project_that_one_stands_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    project = Project(tmp_path / "project", odd_of("lead_braking", architectures=("own",)))
    project.write("odd/architectures/own.yaml", POLICY)
    (project.folder / "odd" / "architectures" / "own.py").write_text(OWN)
    monkeypatch.chdir(project.folder)
    adeye.run("odd/tested.yaml", db="adeye.db")
    run = str(project.rows()[0]["run"])
    other = tmp_path / "other"
    shutil.copytree(project.folder, other)
    (other / "odd" / "architectures" / "own.py").write_text(OWN.replace("0.0, 0.0", "-3.0, 0.0"))
    for folder in (project.folder, project.folder / "odd", tmp_path, other):
        monkeypatch.chdir(folder)
        assert adeye.replay(run, db=os.path.relpath(project.db)).identical


@pytest.mark.slow
def test_twins_of_a_fault_are_of_the_program_that_drove(tmp_path: Path) -> None:
    fault = {
        "id": "blind",
        "target": "sensors.front_camera",
        "model": "drop_out",
        "onset": {"at": "1 s"},
    }
    asked = {"use": "lead_braking", "faults": ["blind"], "parameters": {}}
    project = Project(tmp_path / "project", odd_of(asked, faults=[fault], architectures=("own",)))
    code = project.folder / "odd" / "architectures" / "own.py"
    code.write_text(OWN)
    project.write("odd/architectures/own.yaml", POLICY)
    project.run()
    (first,) = (row for row in project.rows() if row["fault_entry"] == "blind")
    kept = code.read_text()
    code.write_text(f"{kept}# another one, whatever it does\n")
    said = r"is no longer what it was\. Run the campaign again"
    refused(IntegrityError, run_timeline, project.db, str(first["run"]), says=said)
    refused(IntegrityError, campaign_injections, project.db, says=said)
    code.write_text(kept)
    assert run_timeline(project.db, str(first["run"])).fault_entry == "blind"
