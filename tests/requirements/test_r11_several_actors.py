"""R11: vehicles, a pedestrian and a cyclist, scripted and reactive, in one scenario."""

from typing import Any

import numpy as np
import pytest

from adeye.signals import OBJECT_CLASSES, OBJECT_SPEED, OBJECT_Y
from tests.conftest import MakeProject
from tests.project import odd_of, run_cases
from tests.stored import stored

pytestmark = pytest.mark.requirements

STREET: dict[str, Any] = stored("street")


def test_every_kind_of_participant_moves_in_its_own_way(make_project: MakeProject) -> None:
    project = make_project(odd_of("street"))
    project.write("scenarios_db/urban/street.yaml", STREET)
    plan = project.plan()
    trace = run_cases(plan, [plan.cases[0]])
    context = trace.layout.context
    kinds = {
        name: OBJECT_CLASSES[kind]
        for name, kind in zip(context.object_ids, context.object_classes, strict=True)
    }
    assert kinds == {
        "leader": "truck",
        "follower": "car",
        "cyclist": "cyclist",
        "walker": "pedestrian",
        "van_at_the_kerb": "parked_car",
    }
    rows = int(trace.length[0])
    at = {name: trace["objects"][0, :rows, context.object_ids.index(name)] for name in kinds}
    # Scripted: the truck stops, the pedestrian crosses, the cyclist rides on.
    assert at["leader"][-1, OBJECT_SPEED] == 0.0
    assert at["walker"][0, OBJECT_Y] - at["walker"][-1, OBJECT_Y] > 5.0
    assert at["cyclist"][-1, OBJECT_SPEED] == pytest.approx(15.0 / 3.6)
    # Reactive: nobody told the car to brake, but there is a truck ahead of it.
    assert at["follower"][:, OBJECT_SPEED].min() < 1.0
    assert np.all(at["leader"][:, 0] - at["follower"][:, 0] > 5.0)
    assert np.ptp(at["van_at_the_kerb"][:, 0]) == 0.0
