"""R22: models of others take part by a co-simulation standard."""

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import adeye
from adeye.judge.verdict import ExitCode, Verdict
from tests.motorway import fault
from tests.project import Project, odd_of, use
from tests.simulate.bridges import fmus
from tests.simulate.sensors.test_fmu import NOISY

pytestmark = [pytest.mark.requirements, pytest.mark.slow]


def test_an_fmu_drives_and_another_one_moves_the_vehicle(tmp_path: Path) -> None:
    names = ("fmu_controller", "fmu_vehicle")
    uses = [use(name) for name in ("cut_in", "lead_braking", "free_driving_curve")]
    odd = odd_of(*uses, architectures=names, concept="concepts/fmu_vehicle.yaml")
    project = Project(tmp_path / "project", odd)
    assert fmus.SHIPPED.is_dir()
    summary = project.run(workers=1)
    assert summary.exit_code is ExitCode.OK
    rows = project.rows()
    assert {row["architecture"] for row in rows} == set(names)
    assert len({row["trace_digest"] for row in rows}) == len(rows) == 6
    assert {line.verdict for line in summary.verdicts if line.is_gate} == {Verdict.PASS}


def test_same_test_case_gives_the_same_bits(tmp_path: Path) -> None:
    odd = odd_of(use("cut_in", {"gap": ["30 m", "60 m"]}), architectures=("fmu_controller",))
    project = Project(tmp_path / "project", odd)
    project.run(db="one.db", workers=1)
    project.run(db="two.db", workers=2)
    digests = [{row["trace_digest"] for row in project.rows(db=db)} for db in ("one.db", "two.db")]
    assert digests[0] == digests[1]
    assert len(digests[0]) == 2


def driven(file: str) -> dict[str, Any]:
    """Return a scenario whose slower lead an FMU drives."""
    driver = {
        "file": file,
        "inputs": {"v": "own.speed", "v_set": "own.desired_speed", "offset": "own.lane_offset"},
        "outputs": {"acceleration": "a"},
        "desired_speed": "0.8 * ego_speed",
    }
    return {
        "extends": "free_driving.yaml",
        "scenario": "driven_lead",
        "title": "A lead that an FMU drives",
        "actors": {"lead": {"reactive": None, "driver": driver}},
    }


def test_an_fmu_drives_another_actor(tmp_path: Path) -> None:
    project = Project(tmp_path / "project", odd_of("driven_lead", "free_driving"))
    catalogue = project.folder / "scenarios_db" / "motorway"
    driver = catalogue / "follow_and_keep.fmu"
    shutil.copy(fmus.SHIPPED / driver.name, driver)
    project.write("scenarios_db/motorway/driven_lead.yaml", driven(f"./{driver.name}"))
    project.run(workers=2)
    rows = project.rows()
    assert {row["scenario"]: row["outcome"] for row in rows} == {
        "driven_lead": "completed",
        "free_driving": "completed",
    }
    assert project.run().reused == 2
    (run,) = (row["run"] for row in rows if row["scenario"] == "driven_lead")
    assert adeye.replay(run, db=project.db).identical
    # Another driver is another test case, but only where it drives.
    with driver.open("ab") as file:
        file.write(b" ")
    assert project.run().reused == 1


FAULTS = [
    fault("deaf", "sensors.short_radar", "drop_out", "1 s"),
    fault("blurred", "sensors.short_radar", "noise", "1 s", signal="x", size="2 m"),
    fault("stuck_channel", "channels.nominal", "stuck", "1 s"),
    fault("weak_brake", "actuators.brake", "loss", "1 s", share=0.5),
    fault("bent_steering", "actuators.steering", "offset", "1 s", steering_angle="0.3 deg"),
    fault("ice", "tyres", "friction", "1 s", value=0.15),
    fault("lost_messages", "links.nominal.short_radar", "drop", "1 s"),
]
"""On each side of each FMU: what the sensor delivers, what the channel is told and says, what the
vehicle is told and stands on."""


def all_of_fmus(project: Project) -> None:
    """Make the candidate one whose radar, nominal channel and vehicle are FMUs."""
    with project.edited("odd/architectures/fmu_controller.yaml") as architecture:
        architecture["sensors"] = {
            "front_radar": None,
            "short_radar": {**NOISY, "file": "./fmus/short_radar.fmu", "latency": "0.1 s"},
        }
        architecture["channels"]["nominal"]["links"] = ["localisation", "short_radar"]


def test_faults_act_on_fmus_as_on_any_part(tmp_path: Path) -> None:
    entries = ["none", *(item["id"] for item in FAULTS)]
    odd = odd_of(
        use("lead_braking", faults=entries),
        faults=FAULTS,
        architectures=("fmu_controller",),
    )
    project = Project(tmp_path / "project", odd)
    all_of_fmus(project)
    assert len(project.plan().examples()[0].architecture.fmus) == 2
    project.run(workers=2)
    rows = {row["fault_entry"]: row for row in project.rows()}
    assert set(rows) == set(entries)
    assert {row["outcome"] for row in rows.values()} <= {"ok", "contact", "completed"}
    assert len({row["trace_digest"] for row in rows.values()}) == len(entries)


def test_our_vehicle_takes_part_elsewhere_as_an_fmu(tmp_path: Path) -> None:
    odd = odd_of("cut_in", architectures=("camera_radar", "exported"))
    project = Project(tmp_path / "project", odd)
    exported = project.folder / "odd" / "architectures" / "vehicle.fmu"
    command = ["fmu", "export", "plant", "odd/architectures/camera_radar.yaml", "-o", str(exported)]
    subprocess.run([sys.executable, "-m", "adeye", *command], cwd=project.folder, check=True)
    names = ("x", "y", "heading", "speed", "acceleration", "steering_angle", "yaw_rate")
    plant = {
        "file": "./vehicle.fmu",
        "inputs": {
            "command.acceleration": "acceleration",
            "command.steering_angle": "steering_angle",
            "friction": "friction",
        },
        "initial": {name: f"start.{name}" for name in names[:4]},
        "outputs": {name: name for name in names},
    }
    content = {
        "extends": "camera_radar.yaml",
        "architecture": "exported",
        "vehicle": {"plant": plant},
    }
    project.write("odd/architectures/exported.yaml", content)
    project.run()
    inside, outside = project.rows()
    assert inside["architecture"] != outside["architecture"]
    assert inside["verdicts"] == outside["verdicts"]
    for name in ("min_distance_m", "min_ttc_s", "max_deceleration_mps2"):
        assert outside[name] == pytest.approx(inside[name], abs=1e-6)
