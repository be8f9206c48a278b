"""R22: models of others take part by a co-simulation standard."""

from pathlib import Path

import pytest

from adeye.judge.verdict import ExitCode, Verdict
from tests.project import Project, odd_of, use
from tests.simulate.bridges import fmus

pytestmark = [pytest.mark.requirements, pytest.mark.slow]


def test_an_fmu_drives_and_another_one_moves_the_vehicle(tmp_path: Path) -> None:
    names = ("fmu_controller", "fmu_vehicle")
    uses = [use("lead_braking"), use("free_driving_curve")]
    odd = odd_of(*uses, architectures=names, concept="concepts/fmu_vehicle.yaml")
    project = Project(tmp_path / "project", odd)
    assert fmus.SHIPPED.is_dir()
    summary = project.run(workers=1)
    assert summary.exit_code is ExitCode.OK
    rows = project.rows()
    assert {row["architecture"] for row in rows} == set(names)
    assert len({row["trace_digest"] for row in rows}) == len(rows) == 4
    assert {line.verdict for line in summary.verdicts if line.is_gate} == {Verdict.PASS}


def test_same_test_case_gives_the_same_bits(tmp_path: Path) -> None:
    odd = odd_of(use("cut_in", {"gap": ["30 m", "60 m"]}), architectures=("fmu_controller",))
    project = Project(tmp_path / "project", odd)
    project.run(db="one.db", workers=1)
    project.run(db="two.db", workers=2)
    digests = [{row["trace_digest"] for row in project.rows(db=db)} for db in ("one.db", "two.db")]
    assert digests[0] == digests[1]
    assert len(digests[0]) == 2
