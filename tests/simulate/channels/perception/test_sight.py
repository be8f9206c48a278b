from dataclasses import replace

import numpy as np

from adeye.ports import ChannelContext
from adeye.signals import Measurement
from adeye.simulate.channels.perception.step import Sight
from adeye.simulate.channels.perception.tracking import assumed_accuracy
from adeye.simulate.sensors.rig import DATA_SHEETS
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


def linked(*links: str) -> ChannelContext:
    kinds = {
        "front": "radar",
        "own": "./mine.py:Mine",
        "pose": "localisation",
        "gnss": "gnss",
        "imu": "imu",
    }
    context = channel_context(
        None,
        links=links,
        sensors={name: kinds[name] for name in links if name in kinds},
        runs=2,
    )
    sheets = {
        name: dict.fromkeys(DATA_SHEETS[kinds[name]], np.full(2, 0.1))
        for name in links
        if kinds.get(name) in DATA_SHEETS
    }
    if "gnss" in sheets:
        sheets["gnss"]["bias"] = np.zeros(2)
    return replace(context, data_sheets=sheets)


def sight(*links: str) -> Sight:
    return Sight(linked(*links))


def values(*numbers: float) -> Measurement:
    made = measurement(0)
    made.values = np.tile(numbers, (2, 1))
    return made


def test_sensors_are_as_accurate_as_is_assumed_in_the_order_of_the_links() -> None:
    context = linked("front", "own", "switch")
    rows = Sight(context).accuracy
    assert rows.shape[:2] == (2, 2)
    assert np.array_equal(rows, assumed_accuracy(context, ["front", "own"]))
    assert not np.array_equal(rows[:, 0], rows[:, 1])


def test_lists_of_different_length_stand_side_by_side() -> None:
    both = sight("front", "own")
    both.take({"front": measurement(1), "own": measurement(3)})
    assert [rows.shape for rows in both.masks[:2]] == [(2, 1), (2, 3)]
    assert both.detections[1][0, 2, 0] == 3.0
    assert both.places.shape == (3, 2)
    assert both.owner.shape == (3,)


def test_samples_are_shown_where_they_lie() -> None:
    one, seen = sight("front"), measurement(2)
    one.take({"front": seen})
    assert one.detections[0] is seen.detections
    assert one.masks[0] is seen.mask
    assert one.stamps[0] is seen.stamp


def test_arrays_of_another_type_are_made_the_one_that_steps_are_compiled_for() -> None:
    one, seen = sight("front"), measurement(2)
    seen.detections = np.asfortranarray(seen.detections, dtype=np.float32)
    seen.stamp.flags.writeable = False
    one.take({"front": seen})
    assert one.detections[0].dtype == np.float64
    assert one.detections[0].flags.c_contiguous
    assert one.detections[0].tolist() == np.full((2, 2, 7), 2.0).tolist()
    assert one.stamps[0].flags.writeable


def test_number_of_slots_is_the_same_for_few_sensors_and_doubles_for_many() -> None:
    counts = {}
    for sensors in (0, 1, 4, 5):
        names = [f"own_{index}" for index in range(sensors)]
        many = Sight(
            channel_context(None, links=names, sensors=dict.fromkeys(names, "camera"), runs=2)
        )
        many.take({name: measurement(1) for name in names})
        counts[sensors] = {len(many.stamps), len(many.alive), len(many.masks)}
    assert counts == {0: {4}, 1: {4}, 4: {4}, 5: {8}}


def test_first_linked_estimate_is_taken() -> None:
    two = sight("own", "pose")
    two.take({"own": measurement(0, estimate=1.0), "pose": measurement(0, estimate=2.0)})
    assert two.estimate[0, 0] == 1.0
    assert two.estimate_stamp.tolist() == [0.5, 0.5]


def test_without_estimate_there_is_no_stamp() -> None:
    blind = sight("front")
    blind.take({"front": measurement(1)})
    assert blind.estimate_stamp.tolist() == [-1.0, -1.0]


def test_dead_sensor_is_shown_as_such() -> None:
    two = sight("pose", "front")
    two.take({"front": measurement(1, alive=False), "pose": measurement(0)})
    # The slots beyond the sensors are never a fault.
    assert [rows.all() for rows in two.alive] == [True, False, True, True]


def test_localisation_is_not_looked_through_for_objects() -> None:
    two = sight("pose", "front")
    seen = measurement(1)
    two.take({"front": seen, "pose": measurement(1, alive=False, estimate=1.0)})
    assert two.accuracy.shape[:2] == two.mounts.shape[:2] == (2, 1)
    assert two.masks[0] is seen.mask
    assert two.estimate[0, 0] == 1.0
    assert not two.alive[0].any()


FIX = (100.0, 5.0, 20.0, 0.0)


def test_receiver_and_unit_stand_in_for_a_sensor_that_gives_an_estimate() -> None:
    two = sight("gnss", "imu")
    two.take({"gnss": values(*FIX), "imu": values(-1.0, 0.0, 0.0)}, 0.6)
    # The box centre is where the antenna is; the time is that of the unit's sample.
    assert np.abs(two.estimate[:, :4] - [100.0, 5.0, 0.0, 20.0]).max() < 1e-9
    assert two.estimate_stamp.tolist() == [0.5, 0.5]
    assert two.accuracy.size == 0


def test_receiver_alone_estimates_the_time_of_the_tick() -> None:
    one = sight("gnss")
    one.take({"gnss": values(*FIX)}, 0.6)
    assert one.estimate_stamp.tolist() == [0.6, 0.6]
    assert np.abs(one.estimate[:, 0] - 102.0).max() < 1e-9


def test_receiver_alone_without_the_time_of_the_tick_gives_nothing() -> None:
    one = sight("gnss")
    one.take({"gnss": values(*FIX)})
    assert one.estimate_stamp.tolist() == [-1.0, -1.0]


def test_estimate_of_a_sensor_is_taken_before_that_of_the_channel() -> None:
    three = sight("gnss", "imu", "own")
    three.take(
        {"gnss": values(*FIX), "imu": values(0.0, 0.0, 0.0), "own": measurement(0, estimate=7.0)},
        0.6,
    )
    assert three.estimate[0, 0] == 7.0


def test_without_receiver_nothing_is_estimated() -> None:
    assert sight("pose", "gnss", "imu").localiser is None
    one = sight("imu")
    assert one.localiser is None
    one.take({"imu": values(0.0, 0.0, 0.0)}, 0.6)
    assert one.estimate_stamp.tolist() == [-1.0, -1.0]
