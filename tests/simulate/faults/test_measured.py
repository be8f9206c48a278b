import numpy as np
import pytest

from adeye.simulate.faults.injector import InjectorContext
from adeye.simulate.faults.rows import Seat, place_of, without_points
from adeye.spec.fault import FAULT
from adeye.spec.sensor_faults import SIGNALS, has_signal
from tests.simulate.faults.streams import CONTEXT, ONSET, RUNS, SENSORS, SUITE, same, streams


def seat(sensor: str) -> Seat:
    fault = FAULT.validate_python(
        {"id": "a", "target": f"sensors.{sensor}", "model": "drop_out", "onset": {"at": "0 s"}}
    )
    one = np.uint64(1)
    return Seat(InjectorContext([fault] * RUNS, CONTEXT, 0.05, one, [SUITE] * RUNS))


PAIRS = [
    (sensor, signal)
    for sensor in SENSORS
    for signal in SIGNALS
    if has_signal(signal, SUITE.sensors[sensor])
]


@pytest.mark.slow
@pytest.mark.parametrize(("sensor", "signal"), PAIRS)
def test_what_is_written_is_read_again(sensor: str, signal: str) -> None:
    item = streams()[sensor][ONSET]
    place = place_of(item, signal, seat(sensor), len(CONTEXT.object_ids))
    # So little that no detection changes its place in the list.
    new = place.values + 1e-4
    changed = place.there & np.array([[True], [False], [True]])
    written = place.write(item, new, changed, CONTEXT.road)
    again = place_of(written, signal, seat(sensor), len(CONTEXT.object_ids))
    assert changed.any()
    assert again.values[changed] == pytest.approx(new[changed], abs=1e-9)
    assert same(written, item, 1)
    assert np.array_equal(again.there, place.there)


def test_lost_return_has_no_range_and_no_object() -> None:
    item = streams()["beam_lidar"][ONSET]
    assert item.points is not None
    lost = np.zeros(item.points.shape[:2], dtype=np.bool_)
    assert without_points(item, lost) is item
    lost[0] = True
    made = without_points(item, lost)
    assert made.points is not None
    assert made.hits is not None
    assert not made.points[0, :, 0].any()
    assert (made.hits[0] == -1).all()
    assert same(made, item, 1)
