"""A campaign that was planned and never executed, with verdicts as a test plants them."""

import json
from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from adeye.campaign.plan import CampaignPlan
from adeye.judge.verdict import FAIL
from adeye.store.read.bulk import Labels
from tests.project import one_scenario

AXES: dict[str, list[Any]] = {
    "gap": ["20 m", "24 m", "28 m", "32 m", "40 m"],
    "ego_speed": ["80 km/h", "100 km/h", "120 km/h"],
    "architecture.sensors.front_radar.range": ["80 m", "120 m", "160 m"],
}
GRID = one_scenario("cut_in", "none", "front_camera_out", **AXES)
SAFE = {**GRID, "architectures": ["architectures/camera_radar.yaml"]}


def compared_of(plan: CampaignPlan, verdicts: Mapping[str, Sequence[int]]) -> Any:
    """Give what a database would of a plan, with a verdict of each FSR for each test case."""
    cases = plan.cases
    codes = np.array(list(verdicts.values())).T
    return SimpleNamespace(
        fsrs=tuple(verdicts),
        verdict=codes,
        scenario=Labels.of([case.scenario_id for case in cases]),
        architecture=Labels.of([case.architecture.architecture for case in cases]),
        fault_entry=Labels.of([case.fault_entry for case in cases]),
        place=Labels.of([json.dumps(dict(case.point)) for case in cases]),
        replicate=np.array([case.replicate for case in cases]),
        margin=np.where(codes == FAIL, -1.0, 1.0),
        robustness=np.where(codes == FAIL, -0.1, 0.1),
        measured=np.zeros_like(codes),
        units=("m",),
        result=tuple(case.digest for case in cases),
    )
