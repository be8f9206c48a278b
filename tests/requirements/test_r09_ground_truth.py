"""R9: the truth is recorded at every tick, and given to the channels that are allowed it."""

from pathlib import Path

import numpy as np
import pytest

from adeye.campaign.replay import rerun
from adeye.reporting import handing_out
from adeye.store.repository import Repository
from adeye.sweep.case import TestCase
from adeye.trace import Trace
from tests.exchange.test_osi import read as read_osi
from tests.project import Executed

pytestmark = pytest.mark.requirements


def test_trace_holds_the_true_scene_at_every_tick(cut_ins: tuple[list[TestCase], Trace]) -> None:
    _, trace = cut_ins
    for run in range(trace.runs):
        rows = int(trace.length[run])
        assert rows == round(25.0 / 0.05) + 1
        ego, cutter = trace["ego"][run, :rows], trace["objects"][run, :rows, 0]
        assert np.isfinite(ego).all()
        assert np.isfinite(cutter).all()
        # True motion is continuous: places follow speeds.
        moved = np.hypot(np.diff(cutter[:, 0]), np.diff(cutter[:, 1]))
        assert moved == pytest.approx(0.05 * cutter[:-1, 3], abs=0.05)


def test_ground_truth_sensor_shows_what_other_sensors_cannot(
    cut_ins: tuple[list[TestCase], Trace],
) -> None:
    _, trace = cut_ins
    names = trace.layout.sensors
    seen = trace["detected"][:, : trace.length[0] - 1, :, 0]
    assert seen[:, 2:, names.index("truth")].all()
    assert not seen[:, 2:, names.index("front_camera")].all()


@pytest.mark.slow
def test_truth_of_a_stored_run_can_be_had_again(mini: Executed) -> None:
    row = mini.project.rows()[0]
    with Repository.open(mini.db, create=False) as repository:
        done = rerun(repository, repository.find_run(row["run"]))
    assert done.trace.digests() == [row["trace_digest"]]
    distance = done.signals.series("actor.cutter.distance").values[0, : done.trace.length[0]]
    assert distance.min() == pytest.approx(row["min_distance_m"])


@pytest.mark.slow
def test_truth_is_handed_to_others_with_the_numbers_of_the_trace(
    mini: Executed, tmp_path: Path
) -> None:
    row = mini.project.rows()[0]
    with Repository.open(mini.db, create=False) as repository:
        done = rerun(repository, repository.find_run(row["run"]))
    handing_out(osi=tmp_path / "osi")(done)
    messages = read_osi(tmp_path / "osi", "GroundTruth")
    rows, trace = int(done.trace.length[0]), done.trace
    assert len(messages) == rows
    for tick, message in enumerate(messages):
        host = next(it for it in message.moving_object if it.id == message.host_vehicle_id)
        places = {
            (round(it.base.position.x, 6), round(it.base.position.y, 6))
            for it in message.moving_object
            if it.id != host.id
        }
        cutter = trace["objects"][0, tick, 0]
        assert (round(cutter[0], 6), round(cutter[1], 6)) in places
        # Of the middle of its box, which turns about the point that the trace tells of.
        speed = np.hypot(host.base.velocity.x, host.base.velocity.y)
        assert speed == pytest.approx(trace["ego"][0, tick, 3], abs=1e-2)
