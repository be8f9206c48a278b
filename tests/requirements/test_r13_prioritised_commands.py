"""R13: a declarative switch decides whose command acts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from adeye.signals import EGO_SPEED, REASON_LABELS
from tests.project import CANDIDATE, run_cases
from tests.requirements.loop import driven, scripted

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.trace import Trace
    from tests.conftest import MakeProject

pytestmark = pytest.mark.requirements

FIRST = round(1.0 / 0.05)


def authority(trace: Trace) -> list[str]:
    """Name of the acting channel by row, from the second tick on."""
    rows = trace["authority"][0, 1 : trace.length[0] - 1]
    return [trace.layout.channels[int(index)] for index in rows]


def test_request_of_the_channel_with_priority_takes_over(tmp_path: Path) -> None:
    channels = {
        "careful": {"acceleration": -4.0, "requests_from": 1.0},
        "quick": {"acceleration": 0.5},
    }
    switch = {"priority": ["careful", "quick"], "default": "quick", "latch": True}
    trace = driven(scripted(tmp_path, channels, **switch))
    acting = authority(trace)
    assert set(acting[: FIRST - 2]) == {"quick"}
    assert set(acting[FIRST + 2 :]) == {"careful"}
    assert "request" in {REASON_LABELS[int(code)] for code in np.unique(trace["reason"][0])}
    assert trace["ego"][0, -1, EGO_SPEED] == 0.0


def test_the_other_order_of_priority_gives_the_other_answer(tmp_path: Path) -> None:
    channels = {
        "careful": {"acceleration": -4.0, "requests_from": 1.0},
        "quick": {"acceleration": 0.5, "requests_from": 0.0},
    }
    for order, winner in ((["careful", "quick"], "careful"), (["quick", "careful"], "quick")):
        switch = {"priority": order, "default": "quick", "latch": False}
        trace = driven(scripted(tmp_path / winner, channels, **switch))
        assert set(authority(trace)[FIRST + 2 :]) == {winner}


def test_channel_that_falls_silent_loses_authority(tmp_path: Path) -> None:
    channels = {"quick": {"acceleration": 0.5, "fails_from": 1.0}, "spare": {"acceleration": -2.0}}
    switch = {"priority": ["quick", "spare"], "default": "quick", "staleness": "0.2 s"}
    acting = authority(driven(scripted(tmp_path, channels, **switch)))
    lost = acting.index("spare")
    assert set(acting[:lost]) == {"quick"}
    assert set(acting[lost:]) == {"spare"}
    assert FIRST - 2 <= lost <= FIRST + round(0.2 / 0.05) + 1


def test_request_must_stand_as_long_as_the_debounce(tmp_path: Path) -> None:
    channels = {
        "careful": {"acceleration": -4.0, "requests_from": 1.0},
        "quick": {"acceleration": 0.5},
    }
    switch = {"priority": ["careful", "quick"], "default": "quick"}
    taken = [
        authority(driven(scripted(tmp_path / name, channels, **switch, debounce=debounce))).index(
            "careful"
        )
        for name, debounce in (("at_once", "0 s"), ("later", "0.3 s"))
    ]
    assert taken[1] - taken[0] == pytest.approx(0.3 / 0.05, abs=1)


def test_stuck_switch_keeps_the_default(make_project: MakeProject) -> None:
    project = make_project()
    with project.edited(CANDIDATE) as candidate:
        candidate["switch"]["policy"] = "stuck"
    plan = project.plan()
    case = next(
        case
        for case in plan.cases
        if case.fault_entry == "nominal_silent" and case.architecture.architecture == "camera_radar"
    )
    trace = run_cases(plan, [case])
    nominal = trace.layout.channels.index("nominal")
    rows = int(trace.length[0]) - 1
    assert set(trace["authority"][0, 1:rows].tolist()) <= {nominal, -1}
