import numpy as np

from adeye.channels.sight import Sight
from adeye.channels.tracking import SENSOR_KINDS
from adeye.signals import Measurement
from adeye.testing import channel_context


def measurement(count: int, *, alive: bool = True, estimate: float | None = None) -> Measurement:
    return Measurement(
        np.full(2, 0.5),
        np.ones(2, dtype=np.bool_),
        np.full(2, alive),
        np.ones((2, count), dtype=np.bool_),
        np.full((2, count, 7), float(count)),
        np.zeros((2, count), dtype=np.int64),
        None if estimate is None else np.full((2, 13), estimate),
    )


def sight(*links: str) -> Sight:
    kinds = {"front": "radar", "own": "./mine.py:Mine", "pose": "localisation"}
    return Sight(
        channel_context(
            None,
            links=links,
            sensors={name: kinds[name] for name in links if name in kinds},
            runs=2,
        )
    )


def test_sensor_of_unknown_kind_is_taken_for_a_camera() -> None:
    names = [SENSOR_KINDS[kind] for kind in sight("front", "own", "switch").kinds]
    assert names == ["radar", "camera"]


def test_lists_of_different_length_are_laid_out_together() -> None:
    both = sight("front", "own")
    both.take({"front": measurement(1), "own": measurement(3)})
    assert both.masks.shape == (2, 2, 3)
    assert both.masks[0].tolist() == [[True, False, False], [True, True, True]]
    assert both.detections[0, 1, 2, 0] == 3.0


def test_shorter_list_leaves_nothing_of_a_longer_one_behind() -> None:
    both = sight("front", "own")
    both.take({"front": measurement(3), "own": measurement(3)})
    both.take({"front": measurement(1), "own": measurement(3)})
    assert both.masks[0, 0].tolist() == [True, False, False]


def test_first_linked_estimate_is_taken() -> None:
    two = sight("own", "pose")
    two.take({"own": measurement(0, estimate=1.0), "pose": measurement(0, estimate=2.0)})
    assert two.estimate[0, 0] == 1.0
    assert two.estimate_stamp.tolist() == [0.5, 0.5]


def test_without_estimate_there_is_no_stamp() -> None:
    blind = sight("front")
    blind.take({"front": measurement(1)})
    assert blind.estimate_stamp.tolist() == [-1.0, -1.0]


def test_dead_sensor_degrades() -> None:
    two = sight("front", "pose")
    two.take({"front": measurement(1, alive=False), "pose": measurement(0)})
    assert two.is_degraded.all()
    two.take({"front": measurement(1), "pose": measurement(0)})
    assert not two.is_degraded.any()
