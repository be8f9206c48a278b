"""The shipped worlds for faults: where a planned stop ends once the nominal channel dies."""

from pathlib import Path
from typing import Final

import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.judge.timeline import violation_s
from adeye.judge.trace_signals import TraceSignals
from adeye.signals import EGO_SPEED, PLACE_D, PLACE_S
from adeye.simulate import engine
from adeye.trace import Trace
from tests.judge.conftest import rate_run
from tests.motorway import fault
from tests.project import CANDIDATE, MINI, Project

PLACES: Final = {
    "motorway_shoulder": 1.0,
    "motorway_no_shoulder": 3.0,
    "motorway_bay": 0.0,
    "motorway_bay_curve": 0.0,
    "motorway_rest_area": 0.0,
    "free_driving": 1.0,
    "free_driving_curve": 1.0,
}
"""Rating of the place where it stands."""


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Project:
    folder: Path = tmp_path_factory.mktemp("refuges") / "project"
    odd = {
        **MINI,
        "scenarios": [{"use": name, "faults": ["killed"]} for name in PLACES],
        "faults": [fault("killed", "channels.nominal", "crash", "5 s")],
        "architectures": ["architectures/camera_radar.yaml"],
    }
    made = Project(folder, odd)
    with made.edited(CANDIDATE) as candidate:
        candidate["channels"]["safety"]["parameters"] = {"stop": "planned"}
    with made.edited("odd/concepts/motorway_chauffeur.yaml") as concept:
        concept["requirements"] = [
            item for item in concept["requirements"] if item["id"] in {"FSR-01", "FSR-06"}
        ]
    return made


@pytest.fixture(scope="module")
def traces(project: Project) -> dict[str, Trace]:
    plan = project.plan()
    return {
        name: engine.run(
            [case for case in plan.cases if case.scenario_id == name and case.faults],
            base_dirs=plan.folders,
        )
        for name in PLACES
    }


@pytest.mark.parametrize("name", PLACES)
def test_the_ego_stands_in_the_best_place_in_reach(traces: dict[str, Trace], name: str) -> None:
    trace = traces[name]
    last = int(trace.length[0]) - 1
    assert trace["ego"][0, last, EGO_SPEED] == 0.0
    assert trace["contact"][0, last] == -1
    assert not trace["foreign_contact"][0, last]
    assert violation_s(trace, 0) is None
    quality = rate_run(trace, 0)
    assert (quality.achieved, quality.regret) == (PLACES[name], 0.0)
    # The signals say the same.
    signals = TraceSignals(trace, np.ones(1, dtype=np.bool_))
    in_refuge = signals.series("ego.in_refuge").values[0]
    assert in_refuge[last] == (PLACES[name] == 0.0)
    assert not in_refuge[0]
    assert signals.series("ego.on_road").values[0, : last + 1].all()
    assert signals.series("safe_state").values[0, last]


def test_it_drives_on_to_the_bay_at_its_speed_and_no_faster(traces: dict[str, Trace]) -> None:
    trace = traces["motorway_bay"]
    speed, place = trace["ego"][0, :, EGO_SPEED], trace["ego_place"][0]
    row = int(np.argmax(place[:, PLACE_S] > 700.0))
    assert speed[row] == pytest.approx(100.0 / 3.6, abs=2.0)
    assert abs(place[row, PLACE_D] - 1.75) < 0.2
    assert speed[:-1].max() <= 100.0 / 3.6 + 0.5


def test_bays_that_overlap_are_an_error_with_their_place_in_the_file(project: Project) -> None:
    path = "scenarios_db/motorway/motorway_bay.yaml"
    before = project.read(path)
    with project.edited(path) as scenario:
        bays = scenario["world"]["road"]["bays"]
        bays["other"] = {**bays["bay"], "s": "bay_s + 90 m"}
    try:
        with pytest.raises(SpecError, match=r"bays\.other\.s: .* begins at 860 m") as error:
            project.plan()
    finally:
        project.write(path, before)
    assert error.value.where is not None
    assert str(error.value.where.path).endswith("motorway_bay.yaml")
