"""R18: a scenario's identity and its randomness are the same whatever drives through it."""

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from adeye.identity import digest
from adeye.spec.load import scenario_files
from adeye.sweep.case import TestCase
from adeye.trace import Trace
from tests.conftest import MakeProject
from tests.project import CANDIDATE, ROOT, odd_of, run_cases

pytestmark = pytest.mark.requirements

Edit = Callable[[Any], None]


def another_radar(candidate: Any) -> None:
    second = copy.deepcopy(candidate["sensors"]["front_radar"])
    candidate["sensors"]["a_second_radar"] = second


def no_camera(candidate: Any) -> None:
    del candidate["sensors"]["front_camera"]
    candidate["channels"]["nominal"]["links"].remove("front_camera")


def another_channel(candidate: Any) -> None:
    twin = copy.deepcopy(candidate["channels"]["nominal"])
    candidate["channels"]["a_second_nominal"] = twin


def no_safety_channel(candidate: Any) -> None:
    del candidate["channels"]["safety"]
    candidate["switch"].update(priority=["nominal"], default="nominal")


EDITS: list[Edit] = [another_radar, no_camera, another_channel, no_safety_channel]


def executed(make_project: MakeProject, name: str, edit: Edit | None) -> tuple[TestCase, Trace]:
    """A cut-in without the requirements that name what an edit takes away."""
    project = make_project(odd_of("cut_in"), name=name)
    project.require("FSR-01")
    if edit is not None:
        with project.edited(CANDIDATE) as candidate:
            edit(candidate)
    plan = project.plan()
    return plan.cases[0], run_cases(plan, [plan.cases[0]])


@pytest.mark.slow
@pytest.mark.parametrize("edit", EDITS, ids=lambda edit: edit.__name__)
def test_architecture_leaves_situation_and_noise_as_they_were(
    make_project: MakeProject, edit: Edit
) -> None:
    case, before = executed(make_project, "before", None)
    changed, after = executed(make_project, "after", edit)
    assert changed.digest != case.digest
    assert changed.situation_digest == case.situation_digest
    assert changed.stream_seed == case.stream_seed
    assert digest(changed.scenario.executable()) == digest(case.scenario.executable())
    # As long as the ego drives alike, every sensor that both have measures alike to the last bit.
    rows = min(before.length[0], after.length[0]) - 1
    same = np.all(before["ego"][0, :rows] == after["ego"][0, :rows], axis=1)
    shared = int(np.argmin(same)) if not same.all() else int(rows)
    assert shared > 20
    for name in set(before.layout.sensors) & set(after.layout.sensors):
        one, other = (
            trace["detections"][0, :shared, trace.layout.sensors.index(name)]
            for trace in (before, after)
        )
        assert np.array_equal(one, other), name


def test_no_scenario_of_the_catalogue_names_perception_or_control() -> None:
    words = ("sensor", "camera", "radar", "channel", "switch", "architecture")
    for path in scenario_files(ROOT / "scenarios_db").values():
        lines = path.read_text("utf-8").splitlines()
        keys = [line.strip().partition(":")[0] for line in lines if ":" in line]
        assert not [key for key in keys if key in words or key.rstrip("s") in words], path
