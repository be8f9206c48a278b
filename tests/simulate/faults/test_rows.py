"""Rows of things of one tick in those of another, and the queue that hands them on late."""

import numpy as np

from adeye.signals import NO_CHANNEL, OK, SILENT, Authority, ControlCommand, Floats
from adeye.simulate.channels.links import no_command
from adeye.simulate.faults.rows import Past, Queue, copied, nothing_yet, take_rows

FIRST = np.array([True, False])


def command(number: float) -> ControlCommand:
    numbers = np.full(2, number)
    status = np.full(2, OK, dtype=np.int64)
    return ControlCommand("a", numbers, numbers.copy(), numbers.copy(), status, np.ones((2, 3, 4)))


def test_copy_does_not_follow() -> None:
    state = Authority(np.zeros(2, dtype=np.int64), np.zeros(2, dtype=np.int64))
    other = copied(state)
    state.channel[:] = 1
    assert other.channel.tolist() == [0, 0]


def test_only_the_rows_asked_for_are_taken() -> None:
    target = command(1.0)
    take_rows(target, command(2.0), FIRST)
    assert target.acceleration.tolist() == [2.0, 1.0]


def test_plan_that_the_source_lacks_is_empty() -> None:
    target = command(1.0)
    take_rows(target, no_command("a", 2), FIRST)
    assert target.plan is not None
    assert np.isnan(target.plan[0]).all()
    assert (target.plan[1] == 1.0).all()


def test_nothing_yet_is_silent_without_stamp_and_without_authority() -> None:
    nothing = nothing_yet(command(1.0))
    assert nothing.status.tolist() == [SILENT, SILENT]
    assert nothing.stamp.tolist() == [-1.0, -1.0]
    assert nothing.acceleration.tolist() == [0.0, 0.0]
    state = nothing_yet(Authority(np.ones(2, dtype=np.int64), np.ones(2, dtype=np.int64)))
    assert state.channel.tolist() == [NO_CHANNEL] * 2


def test_past_shows_each_run_its_own_age() -> None:
    past: Past[Floats] = Past(2)
    for tick in range(4):
        past.add(np.full(3, float(tick)))
    target = np.full(3, 9.0)
    past.write(target, np.array([0, 2, 1]), np.array([True, True, False]))
    assert target.tolist() == [3.0, 1.0, 9.0]


def test_queue_lets_what_was_last_stand_and_then_hands_on_in_order() -> None:
    queue: Queue[Floats] = Queue(np.array([3]))
    out = []
    for tick in range(12):
        active = np.array([4 <= tick < 10])
        out.append(float(queue.apply(np.array([float(tick)]), active)[0][0]))
    assert out == [0, 1, 2, 3, 3, 3, 3, 4, 5, 6, 10, 11]
