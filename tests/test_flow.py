"""What flows between the stages: columns are numbered as named, commands copy, records pack."""

from __future__ import annotations

import numpy as np
import pytest

from adeye import signals as flow
from adeye.signals import ControlCommand, SceneContext, Surroundings
from adeye.testing.scenes import straight_road


@pytest.mark.parametrize(
    ("prefix", "columns"),
    [
        ("EGO", flow.EGO_COLUMNS),
        ("OBJECT", flow.OBJECT_COLUMNS),
        ("PLACE", flow.PLACE_COLUMNS),
        ("DETECTION", flow.DETECTION_COLUMNS),
        ("REFUGE", flow.REFUGE_COLUMNS),
    ],
)
def test_column_numbers_follow_the_names(prefix: str, columns: tuple[str, ...]) -> None:
    short = {"steering_angle": "STEERING", "road_heading": "HEADING"}
    for number, name in enumerate(columns):
        constant = f"{prefix}_{short.get(name, name.upper())}"
        assert getattr(flow, constant) == number, constant


def test_codes_follow_the_labels() -> None:
    codes = [getattr(flow, label.upper()) for label in flow.STATUS_LABELS]
    assert codes == list(range(len(flow.STATUS_LABELS)))


def test_an_estimate_is_the_ego_state_and_its_place() -> None:
    assert flow.ESTIMATE_COLUMNS[: flow.ESTIMATE_PLACE] == flow.EGO_COLUMNS
    assert flow.ESTIMATE_COLUMNS[flow.ESTIMATE_PLACE :] == flow.PLACE_COLUMNS


def test_copy_of_a_command_is_not_changed_with_it() -> None:
    command = ControlCommand(
        "nominal",
        np.ones(2),
        np.zeros(2),
        np.zeros(2),
        np.zeros(2, dtype=np.int64),
        plan=np.ones((2, 3, 4)),
        monitors=np.zeros((2, 1, 2), dtype=np.bool_),
        tracks=np.ones((2, 1, 6)),
        candidates=np.ones((2, 4, 3, 2)),
        candidate_costs=np.ones((2, 4)),
        chosen=np.ones(2, dtype=np.int64),
    )
    copy = command.copy()
    for array in (command.acceleration, command.steering_angle, command.stamp, command.plan):
        assert array is not None
        array[...] = -5.0
    command.status[...] = flow.SILENT
    assert command.monitors is not None
    command.monitors[...] = True
    assert copy.channel == "nominal"
    assert copy.acceleration.tolist() == [1.0, 1.0]
    assert copy.status.tolist() == [flow.OK, flow.OK]
    assert copy.plan is not None
    assert (copy.plan == 1.0).all()
    assert copy.monitors is not None
    assert not copy.monitors.any()
    for name in ("candidates", "candidate_costs", "chosen"):
        getattr(command, name)[...] = -5
        assert (getattr(copy, name) == 1).all()


def test_copy_of_a_bare_command_stays_bare() -> None:
    zeros = np.zeros(1)
    copy = ControlCommand("safety", zeros, zeros, zeros, np.zeros(1, dtype=np.int64)).copy()
    assert copy.plan is None
    assert copy.monitors is None
    assert copy.tracks is None
    assert copy.candidates is None
    assert copy.chosen is None


def test_runs_of_a_context_are_counted_by_the_ego() -> None:
    road = straight_road(3)
    weather = Surroundings.clear(3)
    context = SceneContext(
        0.05,
        ("lead",),
        np.zeros(1, dtype=np.int64),
        1,
        np.ones((3, 1, 3)),
        np.ones((3, 1)),
        np.ones((3, 3)),
        road,
        weather,
        np.zeros(3, dtype=np.uint64),
        (),
    )
    assert context.runs == 3
