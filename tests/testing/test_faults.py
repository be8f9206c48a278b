import numpy as np

from adeye.testing.sensors import injector, moment


def test_injector_stands_alone() -> None:
    fault = injector("silent", "channels.nominal")
    assert callable(fault.apply)


def test_each_run_may_have_its_own_numbers() -> None:
    assert injector("drop_out", "sensors.front", parameters=[{"duration": "1 s"}, {}])


def test_moment_holds_one_age_for_each_run() -> None:
    active = np.array([True, False])
    now = moment(active, time=2.0, age=0.5)
    assert (now.time, now.age.tolist()) == (2.0, [0.5, 0.5])
