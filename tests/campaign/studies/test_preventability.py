"""Drives of reference drivers beside a campaign of cut-ins, and the gate that asks for them."""

from __future__ import annotations

import json
import shutil
from collections import Counter
from pathlib import Path
from unittest.mock import Mock

import pytest

from adeye.answers import describe_run
from adeye.campaign.replay import replay_run
from adeye.campaign.studies import preventability
from adeye.campaign.studies.preventability import Preventability, prevent, reference_architecture
from adeye.errors import InputError, IntegrityError, UsageError
from adeye.judge.preventability import CELLS
from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.formats.junit import render_junit
from adeye.report.formats.sarif import render_sarif
from adeye.spec.load import load_architecture, shipped
from adeye.store.repository import Repository
from tests.preventing import project_of_cut_ins
from tests.project import Project
from tests.report.pages import built
from tests.sql import alter
from tests.store.rows import result_table_hash
from tests.stored import known, read_yaml

SHIPPED = shipped("odd") / "architectures" / "reference_cc.yaml"


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Project:
    made = project_of_cut_ins(tmp_path_factory.mktemp("prevent") / "project", by=["cc"])
    made.run()
    return made


@pytest.fixture(scope="module")
def driven(project: Project) -> Path:
    copy = project.folder / "driven.db"
    shutil.copyfile(project.db, copy)
    return copy


@pytest.fixture(scope="module")
def found(driven: Path) -> Preventability:
    return prevent(driven, models=("cc", "rss"), everything=True)


def test_every_cell_occurs_and_what_has_one_vehicle_shares_a_drive(found: Preventability) -> None:
    counted = Counter(item.cell for item in found.comparisons)
    assert set(counted) == set(CELLS) - {"unknown"}
    assert sum(sum(row.counts.values()) for row in found.rows) == 2 * found.executed == 96
    # Two architectures and two fault entries have one vehicle in twelve situations.
    assert len({(item.drive, item.model) for item in found.comparisons}) == 24


@pytest.mark.slow
def test_cells_are_those_of_the_contacts(found: Preventability, driven: Path) -> None:
    touched = {
        "both_avoid": (False, False),
        "only_ours": (False, True),
        "only_model": (True, False),
        "neither": (True, True),
    }
    with Repository.open(driven, create=False) as repository:
        for item in found.comparisons:
            stored = [known(repository.run_row(run)) for run in (item.run, item.drive)]
            pair = tuple(run.metrics["contact"].value == 1.0 for run in stored)
            speeds = (item.impact_speed_mps, item.drive_impact_speed_mps)
            assert pair == tuple(speed is not None for speed in speeds) == touched[item.cell]


@pytest.mark.slow
def test_conflict_is_a_contact_or_beyond_the_brakes(found: Preventability, driven: Path) -> None:
    asked = {item.run for item in prevent(driven, models=("cc",)).comparisons}
    with Repository.open(driven, create=False) as repository:
        for item in found.comparisons:
            stored = known(repository.run_row(item.run))
            required = stored.metrics["max_required_deceleration_mps2"].value or 0.0
            is_conflict = stored.metrics["contact"].value == 1.0 or required > 0.774 * 9.81
            assert (item.run in asked) == is_conflict
    assert asked


def test_a_threshold_of_nothing_asks_for_more(found: Preventability, driven: Path) -> None:
    some = prevent(driven, models=("cc",), threshold=1.0)
    assert prevent(driven, models=("cc",)).looked_at["cc"] < some.looked_at["cc"]
    assert some.looked_at["cc"] <= found.looked_at["cc"]


def test_drives_are_kept(
    found: Preventability, driven: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(preventability, "_execute", Mock(side_effect=AssertionError))
    assert prevent(driven, models=("cc", "rss"), everything=True) == found


def test_comparison_with_an_altered_drive_is_refused(
    found: Preventability, driven: Path, tmp_path: Path
) -> None:
    assert found.comparisons
    shutil.copyfile(driven, tmp_path / "altered.db")
    number = "SELECT number FROM run JOIN benchmark b ON b.drive_digest = run.result_digest LIMIT 1"
    alter(
        tmp_path / "altered.db",
        f"UPDATE metric SET impact_speed_mps_time_s = 77 WHERE run_number = ({number})",  # noqa: S608
    )
    with pytest.raises(IntegrityError, match=r"metric .*: altered"):
        prevent(tmp_path / "altered.db", models=("cc", "rss"), everything=True)


def test_no_campaign_sees_a_drive(project: Project, found: Preventability, driven: Path) -> None:
    with Repository.open(project.db, create=False) as before:
        expected = result_table_hash(before, found.campaign)
    with Repository.open(driven, create=False) as after:
        assert result_table_hash(after, found.campaign) == expected
        assert after.verify() == ()


def test_a_drive_sees_the_truth_and_has_no_fault(found: Preventability, driven: Path) -> None:
    item = next(one for one in found.comparisons if one.fault_entry == "front_camera_out")
    with Repository.open(driven, create=False) as repository:
        ref = repository.find_run(item.drive)
        case = repository.test_case_row(ref.test_case)
    assert ref.is_drive
    assert (case.faults, case.fault_entry) == ((), "none")
    assert [sensor["kind"] for sensor in case.architecture["sensors"].values()] == ["ground_truth"]
    assert [part["kind"] for part in case.architecture["channels"].values()] == ["reference"]
    shown = describe_run(driven, item.drive)
    assert shown["architecture"] == f"reference_{item.model}"
    assert shown["situation"] == describe_run(driven, item.run)["situation"]


@pytest.mark.slow
def test_workers_do_not_matter(project: Project, found: Preventability, tmp_path: Path) -> None:
    shutil.copyfile(project.db, tmp_path / "adeye.db")
    again = prevent(tmp_path / "adeye.db", models=("cc", "rss"), everything=True, workers=2)
    assert again.comparisons == found.comparisons


def test_one_run_is_driven_and_a_drive_only_replayed(found: Preventability, driven: Path) -> None:
    chosen = found.comparisons[0]
    alone = prevent(driven, chosen.run[:12], models=(chosen.model,))
    assert alone.comparisons == (chosen,)
    with pytest.raises(InputError, match="is a drive of a reference driver itself"):
        prevent(driven, chosen.drive[:12])
    replayed = replay_run(driven, chosen.drive)
    assert (replayed.identical, replayed.verdicts) == (True, {})


@pytest.mark.parametrize(
    ("models", "edition", "text"),
    [
        ((), "r157-01", "names no model"),
        (("ccc",), "r157-01", "no reference driver 'ccc'"),
        (("cc",), "r158", "no edition 'r158'"),
    ],
)
def test_unknown_is_refused(driven: Path, models: tuple[str, ...], edition: str, text: str) -> None:
    with pytest.raises(UsageError, match=text):
        prevent(driven, models=models, edition=edition)


def test_the_brakes_of_the_driver_answer_at_once(project: Project) -> None:
    vehicle = project.plan().cases[0].architecture.vehicle
    assert vehicle.acceleration_lag > 0.0
    made = reference_architecture(vehicle.model_dump(mode="json"), "cc", "r157-01", 0.05)
    assert made.vehicle == vehicle.model_copy(update={"acceleration_lag": 0.0})


def test_what_the_vehicle_cannot_do_is_none_of_the_driver(project: Project) -> None:
    vehicle = project.plan().cases[0].architecture.vehicle
    weak = vehicle.model_dump(mode="json") | {
        "max_acceleration": 0.1,
        "max_deceleration": 0.2,
        "max_steering_angle": 0.01,
        "max_steering_rate": 0.001,
        "steering_lag": 5.0,
        "plant": read_yaml(SHIPPED.with_name("fmu_vehicle.yaml"))["vehicle"]["plant"],
    }
    for model in ("cc", "fsm", "rss", "reg157"):
        made = reference_architecture(weak, model, "r157-01", 0.05).vehicle
        assert made == load_architecture(SHIPPED).spec.vehicle


def test_without_evidence_the_gate_blocks(project: Project) -> None:
    summary = project.run()
    assert summary.exit_code is ExitCode.FAILED
    assert "not known to be unpreventable by cc: run `adeye preventability 1" in summary.message


def test_what_no_model_avoids_does_not_block(project: Project, found: Preventability) -> None:
    unpreventable = sum(
        item.cell == "neither" and item.model == "cc" and item.architecture == "camera_radar"
        for item in found.comparisons
    )
    summary = project.run(db="driven.db")
    assert summary.executed == 0
    assert summary.exit_code is ExitCode.OK
    assert f"not blocking: unpreventable by cc ({unpreventable} runs)" in summary.message
    (line,) = (item for item in summary.verdicts if item.architecture == "camera_radar")
    assert line.verdict is Verdict.FAIL
    report = built(project.folder / "driven.db")
    cell = known(report.cell("FSR-01", "camera_radar"))
    assert (cell.verdict, cell.is_set_aside) == (Verdict.FAIL, True)
    assert report.exit_code is ExitCode.OK
    assert "not blocking: unpreventable by cc" in cell.note
    assert not any(item.decides for item in report.open_points)
    junit = render_junit(report).decode()
    assert cell.note in junit
    assert "<failure" not in junit
    assert "<error" not in junit
    [log] = json.loads(render_sarif(report))["runs"]
    assert "error" not in {item["level"] for item in log["results"]}


def test_withdrawn_drive_excuses_nothing(
    project: Project, found: Preventability, driven: Path
) -> None:
    db = Path(shutil.copyfile(driven, project.folder / "withdrawn.db"))
    drive = next(
        item.drive for item in found.comparisons if item.cell == "neither" and item.model == "cc"
    )
    with Repository.open(db, create=False) as repository:
        assert repository.evidence.withdraw(drive, author="me", reason="wrong map")
    summary = project.run(db=db.name)
    assert summary.exit_code is ExitCode.FAILED
    assert "not known to be unpreventable by cc" in summary.message
    again = prevent(db, models=("cc",), everything=True)
    cells = {item.cell for item in again.comparisons if item.drive == drive}
    assert cells == {"unknown"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("gate", "by", "code"),
    [
        ("camera_radar", [], ExitCode.FAILED),
        ("camera_radar", ["cc", "rss"], ExitCode.OK),
        ("camera_radar", ["cc", "fsm"], ExitCode.FAILED),
        ("legacy_camera", ["cc"], ExitCode.OK),
        ("legacy_camera", ["cc", "rss"], ExitCode.FAILED),
    ],
)
def test_every_model_of_the_gate_must_be_in_contact(
    found: Preventability, driven: Path, tmp_path: Path, gate: str, by: list[str], code: ExitCode
) -> None:
    other = project_of_cut_ins(tmp_path / "project", gate, by)
    shutil.copyfile(driven, other.db)
    summary = other.run()
    assert found.executed == summary.reused
    assert summary.exit_code is code
    if "fsm" in by:
        assert "not known to be unpreventable by cc, fsm" in summary.message
