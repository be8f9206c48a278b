"""What an injector is told: which runs, and how long ago the fault began in each."""

from typing import Any

import numpy as np
import pytest

from adeye.simulate.faults import FaultPlan, schedule
from adeye.simulate.faults.injector import InjectorContext, Moment
from adeye.testing.sensors import scene_of
from tests.simulate.faults.test_plan import CAMERA_OUT, CONTEXT, case, reading


def test_injector_is_told_when_its_fault_began_in_each_run(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[Moment] = []

    class Probe:
        def __init__(self, context: InjectorContext) -> None:
            assert len(context.specs) == 3

        def apply(self, thing: Any, moment: Moment) -> Any:
            told.append(moment)
            return thing

    monkeypatch.setattr(schedule, "INJECTORS", {("sensors", "drop_out"): Probe})
    late = {**CAMERA_OUT, "onset": {"at": "0.3 s"}, "duration": None}
    plan = FaultPlan([case(CAMERA_OUT), case(late), case(late)], CONTEXT)
    for tick in range(10):
        scene = scene_of(CONTEXT, tick)
        plan.on_readings({"front": reading(scene.time)}, plan.update(scene), scene)
    assert np.isnan(told[3].age).all()
    assert told[4].age.tolist() == pytest.approx([0.0, np.nan, np.nan], nan_ok=True)
    assert told[9].age.tolist() == pytest.approx([0.25, 0.15, 0.15])
    assert told[9].active.tolist() == [False, True, True]
    assert told[9].time == pytest.approx(0.45)
