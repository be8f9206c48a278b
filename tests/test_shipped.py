"""The shipped ODDs hold what they claim: green candidate, red legacy, live axes, monotone rain."""

from collections import defaultdict
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

import adeye
from adeye.campaign.plan import make_plan
from adeye.cli.app import main
from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.gate.baseline import read_baseline
from adeye.report.metrics import moves
from adeye.sweep.axes import with_path
from tests.figures import figures_of
from tests.project import CANDIDATE, ROOT, Executed, Project

pytestmark = pytest.mark.slow

MOTORWAY = ROOT / "odd" / "motorway_chauffeur.yaml"
URBAN = ROOT / "odd" / "urban_pedestrian_rain.yaml"
STUDY = ROOT / "odd" / "sensor_study.yaml"
ON_MAPS = {"ramp": 50, "ramp_routes": 18, "rural_two_way": 30}
"""ODDs on imported roads, and how many places of a map they have at least."""
MOST_TEST_CASES, FEWEST_TEST_CASES = 300, 150
MIN_EXERCISED = 30


def shipped(folder: Path, odd: Path) -> Project:
    project = Project(folder)
    content = project.read(f"odd/{odd.name}")
    project.write("odd/tested.yaml", content)
    # A project relaxes concept and legacy architecture for small ODDs; the shipped ones stand here.
    for kind in ("architectures", "concepts"):
        for path in (ROOT / "odd" / kind).glob("*.yaml"):
            (folder / "odd" / kind / path.name).write_text(path.read_text("utf-8"), "utf-8")
    return project


@pytest.fixture(scope="module")
def motorway(tmp_path_factory: pytest.TempPathFactory) -> Executed:
    project = shipped(tmp_path_factory.mktemp("motorway") / "project", MOTORWAY)
    plan = project.plan()
    return Executed(project, plan, project.run(workers=2), project.db)


def test_motorway_has_a_number_of_test_cases_for_a_coffee_break(motorway: Executed) -> None:
    assert FEWEST_TEST_CASES <= motorway.plan.expansion.count <= MOST_TEST_CASES


def test_candidate_passes_every_mandatory_requirement_in_thirty_runs(motorway: Executed) -> None:
    assert motorway.summary.exit_code is ExitCode.OK
    lines = [line for line in motorway.summary.verdicts if line.is_gate and line.mandatory]
    assert len(lines) >= 6
    for line in lines:
        assert line.verdict is Verdict.PASS
        assert line.exercised >= MIN_EXERCISED


def test_legacy_architecture_fails_some(motorway: Executed) -> None:
    lines = [line for line in motorway.summary.verdicts if not line.is_gate]
    assert Verdict.FAIL in {line.verdict for line in lines if line.mandatory}


def test_every_swept_axis_moves_a_metric(motorway: Executed) -> None:
    rows = motorway.project.rows()
    for use in motorway.plan.files.odd.spec.scenarios:
        own = figures_of([row for row in rows if row["scenario"] == use.name])
        for axis in use.sweep.parameters:
            assert moves(own, axis), f"{use.name}: {axis}"


EDITS: dict[str, tuple[str, Any]] = {
    "camera turned": ("sensors.front_camera.mount.yaw", "20 deg"),
    "camera late": ("sensors.front_camera.latency", "0.6 s"),
    "radar late": ("sensors.front_radar.latency", "0.6 s"),
    "safety unlinked": ("channels.safety.links", []),
    "switch stuck": ("switch.policy", "stuck"),
    "radar removed": ("channels.nominal.links", ["localisation", "front_camera"]),
}


@pytest.mark.parametrize("edit", EDITS)
def test_one_edit_of_the_candidate_fails_a_mandatory_requirement(edit: str, tmp_path: Path) -> None:
    project = shipped(tmp_path / "project", MOTORWAY)
    path, value = EDITS[edit]
    with project.edited(CANDIDATE) as candidate:
        candidate.update(with_path(candidate, tuple(path.split(".")), value))
        if edit == "radar removed":
            del candidate["sensors"]["front_radar"]
    with project.edited_odd() as odd:
        odd["architectures"] = ["architectures/camera_radar.yaml"]
    summary = project.run()
    assert summary.exit_code is ExitCode.FAILED
    assert Verdict.FAIL in {line.verdict for line in summary.verdicts if line.mandatory}


def urban(project: Project, **axes: list[str | float]) -> list[dict[str, Any]]:
    with project.edited_odd() as odd:
        odd["scenarios"][0]["sweep"]["parameters"].update(axes)
    project.run(workers=2)
    return project.rows()


def check_experiment(rows: list[dict[str, Any]]) -> None:
    """Impact speed never falls as ego speed or rain rises; every axis matters."""
    impact = {}
    for row in rows:
        point = {name: round(value, 9) for name, value in row["point"].items()}
        speed = row["impact_speed_mps"] if row["contact"] else 0.0
        impact[tuple(sorted(point.items()))] = speed
    for axis in ("ego_speed", "rain"):
        lines: dict[Any, list[tuple[float, float]]] = defaultdict(list)
        for key, speed in impact.items():
            others = tuple(item for item in key if item[0] != axis)
            lines[others].append((dict(key)[axis], speed))
        for line in lines.values():
            assert all(a[1] <= b[1] for a, b in pairwise(sorted(line))), line
    figures = figures_of(rows)
    for axis in ("trigger_distance", "ego_speed", "rain", "reflectivity"):
        assert moves(figures, axis), axis
    assert any(row["contact"] for row in rows)
    assert {row["end_reason"] for row in rows} >= {"contact", "goal"}


def test_experiment_a_has_its_grid_of_7524_points() -> None:
    assert adeye.plan(URBAN).expansion.count == 11 * 6 * 6 * 19 == 7524


def test_experiment_a_is_monotone_on_a_thinned_grid(tmp_path: Path) -> None:
    rows = urban(
        shipped(tmp_path / "project", URBAN),
        trigger_distance=["20 m", "24 m", "40 m"],
        reflectivity=[0.05, 0.3, 0.9],
    )
    assert len(rows) == 3 * 6 * 6 * 3
    check_experiment(rows)


def test_experiment_a_is_monotone_on_its_whole_grid(tmp_path: Path) -> None:
    rows = urban(shipped(tmp_path / "project", URBAN))
    assert len(rows) == 7524
    check_experiment(rows)


# --- imported roads -------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=ON_MAPS)
def on_map(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Executed:
    odd = ROOT / "odd" / f"{request.param}.yaml"
    project = shipped(tmp_path_factory.mktemp(request.param) / "project", odd)
    plan = project.plan()
    return Executed(project, plan, project.run(workers=2), project.db)


def test_imported_roads_come_from_many_places(on_map: Executed) -> None:
    assert on_map.plan.expansion.count <= MOST_TEST_CASES
    places = {row["point"]["place"] for row in on_map.project.rows()}
    assert len(places) >= ON_MAPS[on_map.plan.files.odd.spec.odd]


def test_candidate_passes_on_imported_roads_and_the_other_architecture_does_not(
    on_map: Executed,
) -> None:
    assert on_map.summary.exit_code is ExitCode.OK
    others = {line.verdict for line in on_map.summary.verdicts if not line.is_gate}
    assert Verdict.FAIL in others


# --- the sensor study -----------------------------------------------------------------------------

SUITES = (
    *("study_camera", "study_camera_radar", "study_ultrasonic"),
    *("study_corner_radars", "study_lidar_grille", "study_four_lidars"),
)
"""From poor to rich; each has the sensors of the one before."""
ELSEWHERE = "study_lidar_roof"
"""One lidar, too, in another place."""


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Executed:
    """The study on a thinned grid."""
    project = shipped(tmp_path_factory.mktemp("study") / "project", STUDY)
    thinned: dict[str, dict[str, list[str]]] = {
        "cut_in": {"ego_speed": ["90 km/h"], "gap": ["40 m"], "rain": ["7.5 mm/h"]},
        "cut_in_late": {"ego_speed": ["90 km/h"], "gap": ["20 m"]},
        "cut_out_to_stopped": {"ego_speed": ["100 km/h"], "front_distance": ["90 m", "150 m"]},
        "pedestrian_crossing_night": {
            "trigger_distance": ["40 m"], "ego_speed": ["30 km/h", "50 km/h"], "rain": ["7.5 mm/h"]
        },
        "overtaken_behind_slow_lead": {"ego_speed": ["100 km/h"], "rain": ["7.5 mm/h"]},
        "parking_pedestrian": {"ego_speed": ["3 m/s"], "trigger_distance": ["3 m", "6 m"]},
        "parking_post": {"ego_speed": ["2 m/s"]},
    }  # fmt: skip
    with project.edited_odd() as odd:
        for use in odd["scenarios"]:
            use["sweep"]["parameters"].update(thinned[use.get("as", use["use"])])
    plan = project.plan()
    return Executed(project, plan, project.run(workers=2), project.db)


def late(study: Executed, suite: str) -> set[tuple[str, str]]:
    """The situations in which a suite is too late to detect who is ahead, or who comes from behind.

    A sensor more can only add to what is detected; FSR-03 and FSR-07 ask for nothing else.
    """
    found = set()
    for row in study.project.rows():
        if row["architecture"] == suite and not row["scenario"].startswith("parking"):
            ahead, behind = row["detection_latency_s"], row["rear_detection_margin_m"]
            if ahead is not None and ahead > 0.3:
                found.add((row["situation"], "ahead"))
            if behind is not None and behind < 0.0:
                found.add((row["situation"], "behind"))
    return found


def failed(study: Executed, suite: str) -> set[str]:
    lines = [line for line in study.summary.verdicts if line.architecture == suite]
    assert len(lines) == 10
    return {line.fsr for line in lines if line.verdict is Verdict.FAIL and line.mandatory}


def test_study_stays_a_matter_of_minutes() -> None:
    assert 1_000 <= adeye.plan(STUDY).expansion.count <= 8_000


def test_suites_meet_the_same_situations(study: Executed) -> None:
    situations: dict[str, set[Any]] = defaultdict(set)
    for row in study.project.rows():
        situations[row["architecture"]].add((row["scenario"], row["situation"]))
    assert set(situations) == {*SUITES, ELSEWHERE}
    assert len({frozenset(found) for found in situations.values()}) == 1


def test_suite_with_more_sensors_detects_no_later(study: Executed) -> None:
    found = [late(study, suite) for suite in SUITES]
    for fewer, more in pairwise(found):
        assert more <= fewer
    assert {what for _, what in found[0]} == {"ahead", "behind"}
    assert {what for _, what in found[2]} == {"behind"}
    assert found[3] == late(study, ELSEWHERE) == set()


def test_requirements_part_the_suites(study: Executed) -> None:
    assert {"FSR-01", "FSR-02", "FSR-03", "FSR-04", "FSR-07", "FSR-08"} <= failed(study, SUITES[0])
    assert {"FSR-07", "FSR-08"} == failed(study, SUITES[1])
    for suite in (*SUITES[3:], ELSEWHERE):
        assert not {"FSR-01", "FSR-02", "FSR-03", "FSR-07"} & failed(study, suite)


def test_avoidable_contacts_are_the_cameras(study: Executed) -> None:
    for row in study.project.rows():
        if row["contact"] and row["architecture"] != SUITES[0]:
            assert row["scenario"] in {"cut_in_late", "parking_pedestrian"}, row["architecture"]


# --- The shipped baseline is of the shipped ODD, and the ODD still comes to it --------------------

ODD = ROOT / "odd" / "motorway_chauffeur.yaml"
BASELINE = ROOT / "reports" / "baselines" / "motorway_chauffeur.json"


def test_baseline_is_of_the_shipped_odd() -> None:
    baseline, plan = read_baseline(BASELINE), make_plan(ODD)
    assert BASELINE.stat().st_size < 200_000
    assert (baseline.odd, baseline.gate) == (plan.files.odd.spec.odd, plan.files.gate)
    assert baseline.planned == baseline.accounted == plan.expansion.count
    assert baseline.exit_code is ExitCode.OK
    assert set(baseline.architectures) == set(plan.files.architectures)
    digests = {name: item.digest for name, item in baseline.fsrs.items()}
    assert digests == {item.requirement.id: item.digest for item in plan.requirements}


@pytest.mark.slow
def test_shipped_odd_comes_to_its_baseline(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    db = str(tmp_path / "adeye.db")
    assert main(["run", str(ODD), "--db", db, "--quiet"]) == 0
    assert main(["gate", "--db", db, "--baseline", str(BASELINE)]) == 0
    assert "Nothing differs from the baseline." in capfd.readouterr().out
