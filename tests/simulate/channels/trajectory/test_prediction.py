import numpy as np
import pytest

from adeye.kernel.profiles import (
    FREE_GROWTH,
    OBJECT_BEHIND,
    OBJECT_GROWTH,
    OBJECT_ROW,
    OBJECT_S,
    OBJECT_SINE,
    WAY_D,
    WAY_ROW,
    WAY_S,
    WAY_SPEED,
)
from adeye.signals import OBJECT_CLASSES, Floats
from adeye.simulate.channels.perception.tracks import (
    TRACK_BRAKING,
    TRACK_CLASS,
    TRACK_HITS,
    TRACK_LENGTH,
    TRACK_STATE,
    TRACK_VAR_VX,
    TRACK_VAR_VY,
    TRACK_VX,
    TRACK_VY,
    TRACK_WIDTH,
    TRACK_X,
    TRACK_Y,
)
from adeye.simulate.channels.trajectory.cost import SAMPLES, predict_objects
from tests.simulate.channels.trajectory.record import LANE, pose

INTERVAL = 0.25
TIMES = INTERVAL * np.arange(1, SAMPLES + 1)


def track(x: float, y: float, vx: float, vy: float = 0.0, **more: float) -> Floats:
    made = np.zeros(TRACK_STATE)
    made[TRACK_X], made[TRACK_Y], made[TRACK_VX], made[TRACK_VY] = x, y, vx, vy
    made[TRACK_LENGTH], made[TRACK_WIDTH] = 4.5, 1.8
    made[TRACK_HITS] = more.get("hits", 5.0)
    made[TRACK_VAR_VX] = more.get("var_vx", 0.1)
    made[TRACK_VAR_VY] = more.get("var_vy", 0.01)
    made[TRACK_BRAKING] = more.get("braking", 0.0)
    made[TRACK_CLASS] = more.get("kind", 0.0)
    return made


def predicted(*tracks: Floats) -> tuple[int, Floats, Floats]:
    objects, ways = np.zeros((8, OBJECT_ROW)), np.zeros((8, SAMPLES, WAY_ROW))
    segments = np.array([[0.0, 0.0, 0.0, 3000.0, 0.0]])
    rows = np.array(tracks)
    count = predict_objects(
        rows, len(rows), pose(), segments, 4.5, 3.5, 3, 3.0, INTERVAL, objects, ways
    )
    return count, objects, ways


def test_vehicle_goes_on_at_its_speed_in_its_lane() -> None:
    _, objects, ways = predicted(track(40.0, 3.5, 25.0))
    assert ways[0, :, WAY_S] == pytest.approx(40.0 + 25.0 * TIMES)
    assert ways[0, :, WAY_D] == pytest.approx(LANE + 3.5)
    assert objects[0, OBJECT_S] == 40.0


def test_swaying_vehicle_stays_where_it_is() -> None:
    _, _, ways = predicted(track(40.0, 3.5, 25.0, -0.25), track(40.0, 3.5, 25.0, -0.8, var_vy=0.49))
    assert ways[:2, :, WAY_D] == pytest.approx(LANE + 3.5)


@pytest.mark.slow
def test_vehicle_that_moves_sideways_completes_its_lane_change() -> None:
    _, objects, ways = predicted(track(40.0, 3.3, 25.0, -1.0))
    assert ways[0, :, WAY_D] == pytest.approx(np.maximum(LANE, LANE + 3.3 - TIMES))
    assert objects[0, OBJECT_SINE] < 0.0


def test_pedestrian_goes_on_across_all_lanes() -> None:
    kind = float(OBJECT_CLASSES.index("pedestrian"))
    _, objects, ways = predicted(track(40.0, -6.0, 0.0, 2.0, kind=kind))
    assert ways[0, :, WAY_D] == pytest.approx(LANE - 6.0 + 2.0 * TIMES)
    assert objects[0, OBJECT_GROWTH] == FREE_GROWTH


def test_braking_vehicle_stands_and_stays() -> None:
    _, _, ways = predicted(track(40.0, 0.0, 12.0, braking=-6.0))
    assert ways[0, -1, WAY_S] == pytest.approx(40.0 + 12.0**2 / 12.0)
    assert ways[0, -1, WAY_SPEED] == 0.0
    assert ways[0, 3, WAY_SPEED] == pytest.approx(12.0 - 6.0)


def test_track_that_is_not_sure_yet_is_left_out() -> None:
    count, _, _ = predicted(track(40.0, 0.0, 0.0, hits=2.0), track(40.0, 0.0, 0.0, var_vx=100.0))
    assert count == 0


@pytest.mark.slow
def test_only_what_is_all_behind_the_ego_is_behind() -> None:
    _, objects, _ = predicted(track(-4.0, 3.5, 30.0), track(-5.0, 3.5, 30.0))
    assert objects[:2, OBJECT_BEHIND].tolist() == [0.0, 1.0]
