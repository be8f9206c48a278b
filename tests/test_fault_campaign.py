"""The shipped fault campaign: as large as it says, and what its four levels end in."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import pytest

from adeye.campaign.plan import make_plan
from adeye.campaign.studies.fault_timing import campaign_injections
from adeye.judge.timeline import Injection
from tests.project import ROOT, Executed, Project

CAMPAIGN: Final = ROOT / "odd" / "fault_campaign.yaml"
LEVELS: Final = {1: "corner_radar_out", 2: "rear_camera_out", 3: "front_camera_out"}
COMMAND: Final = (
    *("nominal_crash", "localisation_out", "planner_frozen"),
    *("degrees_for_radians", "not_a_number"),
)
"""Faults of level 4: the channel is killed, blinded, frozen, and its commands are corrupted."""
QUICK, SLOW = "supervised", "supervised_adeye"
POINTS: Final[Mapping[str, Mapping[str, list[str]]]] = {
    "motorway_shoulder": {},
    "motorway_no_shoulder": {},
    "free_driving_curve": {"radius": ["700 m"]},
    "motorway_bay": {"bay_s": ["900 m"]},
    "motorway_bay_curve": {"bay_s": ["1000 m"]},
    "motorway_rest_area": {"rest_area_s": ["900 m"]},
}
"""One point of each scenario, at the default speed of 100 km/h."""


@pytest.mark.slow
def test_campaign_has_five_thousand_test_cases_over_every_level_and_world() -> None:
    plan = make_plan(CAMPAIGN)
    assert plan.expansion.count >= 5000
    odd = plan.files.odd.spec
    assert {use.name for use in odd.scenarios} == {*POINTS, "cut_in_debounce"}
    assert {*LEVELS.values(), *COMMAND} <= {fault.id for fault in odd.faults}
    kinds = {fault.port for fault in odd.faults}
    assert kinds == {"sensors", "channels", "hooks", "links", "actuators", "tyres", "switch"}
    for architecture in plan.files.architectures.values():
        parameters: Any = architecture.spec.channels["safety"].parameters
        levels = {monitor.level for monitor in parameters.supervisor.monitors.values()}
        assert levels == {1, 2, 3, 4}


@pytest.fixture(scope="module")
def executed(tmp_path_factory: pytest.TempPathFactory) -> Executed:
    project = Project(tmp_path_factory.mktemp("campaign") / "project")
    content = project.read("odd/fault_campaign.yaml")
    faults = [*LEVELS.values(), *COMMAND]
    content["faults"] = [fault for fault in content["faults"] if fault["id"] in faults]
    content["scenarios"] = [use for use in content["scenarios"] if use["use"] in POINTS]
    for use in content["scenarios"]:
        use["sweep"] = {"parameters": dict(POINTS[use["use"]])}
    with project.edited("odd/concepts/fault_campaign.yaml") as concept:
        concept["requirements"] = [{**item, "min_exercised": 1} for item in concept["requirements"]]
    project.write("odd/tested.yaml", content)
    plan = project.plan()
    return Executed(project, plan, project.run(threads=2), project.db)


@pytest.fixture(scope="module")
def found(executed: Executed) -> Sequence[Injection]:
    return campaign_injections(executed.db).injections


def of(found: Sequence[Injection], fault: str, architecture: str) -> list[Injection]:
    chosen = [
        item for item in found if (item.fault_entry, item.architecture) == (fault, architecture)
    ]
    assert len(chosen) == len(POINTS)
    return chosen


def verdicts(executed: Executed, architecture: str, fsr: str) -> set[str]:
    rows = [row for row in executed.project.rows() if row["architecture"] == architecture]
    told: set[str] = {row["verdicts"][fsr] for row in rows if fsr in row["verdicts"]}
    return told - {"VACUOUS"}


@pytest.mark.slow
@pytest.mark.parametrize("architecture", [QUICK, SLOW])
@pytest.mark.parametrize("fault", list(LEVELS.values()))
def test_loss_of_a_watched_sensor_is_found_in_time(
    found: Sequence[Injection], fault: str, architecture: str
) -> None:
    for item in of(found, fault, architecture):
        assert item.class_ == "detected_in_time", item
        # 0.15 s without a sample and one evaluation more, or 0.1 s and eight of them at 10 Hz.
        least, most = (0.15, 0.35) if architecture == QUICK else (0.7, 1.0)
        assert item.times.fdti_s is not None
        assert least <= item.times.fdti_s <= most


@pytest.mark.slow
@pytest.mark.parametrize("architecture", [QUICK, SLOW])
def test_each_level_ends_where_it_asks_for(executed: Executed, architecture: str) -> None:
    for fsr in ("FSR-06", "FSR-08", "FSR-09", "FSR-10"):
        assert verdicts(executed, architecture, fsr) == {"PASS"}, fsr
    if architecture == QUICK:
        for fsr in ("FSR-01", "FSR-02", "FSR-03", "FSR-04", "FSR-05"):
            assert verdicts(executed, architecture, fsr) == {"PASS"}, fsr


@pytest.mark.slow
def test_level_one_drives_on_and_is_no_takeover(found: Sequence[Injection]) -> None:
    for architecture in (QUICK, SLOW):
        for item in of(found, LEVELS[1], architecture):
            assert item.times.switch_s is None
            assert item.times.safe_s is None
            assert item.times.frti_s == pytest.approx(0.0)


@pytest.mark.slow
def test_lost_and_wrong_commands_end_in_a_safe_stop_where_a_supervisor_watches_for_them(
    executed: Executed, found: Sequence[Injection]
) -> None:
    for fault in COMMAND:
        for item in of(found, fault, QUICK):
            assert item.class_ == "detected_in_time"
            assert item.times.safe_s is not None
            assert item.times.violation_s is None
    # Three evaluations at 20 Hz after 0.5 s of one command, and two ticks on the way.
    for item in of(found, "planner_frozen", QUICK):
        assert item.times.fdti_s == pytest.approx(0.65)
    # The figures of AD-EYE have no monitor for what is no number: nobody stops.
    for item in of(found, "not_a_number", SLOW):
        assert item.class_ == "detected_late"
        assert item.times.safe_s is None
    assert verdicts(executed, QUICK, "FSR-03") == {"PASS"}
    assert "FAIL" in verdicts(executed, SLOW, "FSR-03")
