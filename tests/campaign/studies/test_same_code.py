"""Nothing is executed beside a stored run with other code than executed the run."""

import zipfile
from pathlib import Path

import pytest

from adeye.campaign.studies.forks import fork_run
from adeye.campaign.studies.preventability import prevent
from adeye.errors import IntegrityError
from tests.project import Project, odd_of
from tests.refusals import refused

FMU = "odd/architectures/fmus/single_track.fmu"


@pytest.mark.slow
def test_drives_and_forks_are_of_the_fmu_that_moves_the_vehicle(tmp_path: Path) -> None:
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
    # What the other FMU did excuses nothing.
    drives.append(prevent(project.db, models=("cc",), everything=True).comparisons[0].drive)
    assert len(set(drives)) == 2
    fmu.write_bytes(kept)
    assert fork_run(project.db, run, start="1 s", authority="safety").origin.run == run
