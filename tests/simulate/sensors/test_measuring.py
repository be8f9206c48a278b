"""Noise of object-level sensors: the same draws, whoever stands beside a run in its block."""

import numpy as np
import pytest

from adeye.kernel.random import normal_pair
from adeye.signals import parameter_record
from adeye.simulate.sensors.ranging import (
    BLOCK,
    CAMERA,
    DRAWS,
    LIDAR,
    RADAR,
    SEEN_RATE,
    Seen,
    measure,
    memory_for,
    note,
    write,
)

OWNER = np.uint64(7)
NUMBER = 3


NAMES = ("distance_noise", "range_noise", "range_rate_noise", "bearing_noise", "range")
RECORD = parameter_record(
    {key: np.array([value]) for key, value in zip(NAMES, (0.5, 0.5, 0.2, 0.0, 100.0), strict=True)}
)[0]
AHEAD, LEFT = (1.0, 0.0), (0.0, 1.0)


def noted(kind: int, wanted: list[tuple[int, int]]) -> Seen:
    """Note pairs of a seed and an object; object 0 is 10 m to the left, the others 20 m ahead."""
    seen = memory_for(4)
    for item, (seed, thing) in enumerate(wanted):
        direction, distance = (AHEAD, 20.0) if thing else (LEFT, 10.0)
        note(kind, RECORD, seen, item, np.uint64(seed), thing, *direction, distance, 0.0)
    return seen


def measured(kind: int, wanted: list[tuple[int, int]]) -> Seen:
    seen = noted(kind, wanted)
    measure(kind, seen, len(wanted), OWNER, NUMBER)
    return seen


def test_each_item_has_the_draws_of_its_run_and_its_object() -> None:
    wanted = [(seed, thing) for seed in (5, 9, 2**60) for thing in (0, 2, 3)]
    seen = measured(RADAR, wanted)
    for item, (seed, thing) in enumerate(wanted):
        for draw in range(DRAWS):
            pair = normal_pair(np.uint64(seed), OWNER, NUMBER, DRAWS * thing + draw)
            assert tuple(seen.noise[2 * draw : 2 * draw + 2, item]) == pair


def test_only_a_radar_draws_for_the_range_rate() -> None:
    assert not measured(CAMERA, [(5, 1)]).noise[2:].any()
    seen = measured(RADAR, [(5, 1)])
    assert seen.items[SEEN_RATE, 0] == 0.2 * seen.noise[2, 0] != 0.0


def test_there_is_room_for_every_object_of_a_block() -> None:
    assert memory_for(4).items.shape[1] == 4 * BLOCK


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "sigma"), [(LIDAR, 0.5), (CAMERA, 0.5 * 20.0 * 20.0 / 100.0)])
def test_place_is_off_along_the_line_of_sight_by_its_draw(kind: int, sigma: float) -> None:
    seen = measured(kind, [(5, 1), (5, 0)])
    seen.poses[0] = 1.0, 0.0, 100.0, 50.0
    seen.ends[0] = 2
    ego = np.array([98.0, 50.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    mask, detections = np.zeros(4, dtype=np.bool_), np.zeros((4, 7))
    source, order = np.full(4, -1), np.zeros(4, dtype=np.int64)
    sizes, classes = np.ones((4, 3)), np.zeros(4, dtype=np.int64)
    write(kind, ego, sizes, classes, seen, 0, 0, order, mask, detections, source)
    # The nearer one comes first.
    assert source.tolist() == [0, 1, -1, -1]
    assert mask.tolist() == [True, True, False, False]
    assert detections[1, 0] == pytest.approx(22.0 + sigma * seen.noise[0, 0])
    assert detections[1, 1] == pytest.approx(0.0)
    assert detections[0, 0] == pytest.approx(2.0)
