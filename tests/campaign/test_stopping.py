"""What ends a campaign early, and how."""

from __future__ import annotations

import math

import pytest

from adeye.campaign.run import Limits, Stop
from adeye.errors import Terminated


class Clock:
    """A clock that goes when it is told."""

    def __init__(self) -> None:
        self.now = 100.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr("adeye.campaign.run.time.monotonic", made.monotonic)
    return made


def test_who_asks_outside_of_blocks_interrupts() -> None:
    with pytest.raises(Terminated):
        Stop().ask(Terminated)


def test_who_asks_while_blocks_are_executed_is_heard_at_their_end() -> None:
    stop, done = Stop(), []

    def execute() -> None:
        with stop.deferred():
            stop.ask(KeyboardInterrupt)
            done.append("the block")

    with pytest.raises(KeyboardInterrupt):
        execute()
    assert done == ["the block"]
    assert not stop.is_deferred


def test_nobody_asks() -> None:
    stop = Stop()
    with stop.deferred():
        assert stop.is_deferred
    assert stop.asked is None
    stop.check()


def test_error_inside_is_not_hidden_by_who_asked() -> None:
    stop = Stop()

    def execute() -> None:
        with stop.deferred():
            stop.ask(Terminated)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        execute()


def test_without_limits_every_block_may_begin() -> None:
    limits = Limits()
    limits.count(10**6)
    limits.measure(1, 1e6)
    assert limits.allow(10**9)
    assert limits.left_s == math.inf
    assert limits.reached == ""


def test_block_that_would_not_end_in_time_is_not_begun(clock: Clock) -> None:
    limits = Limits(budget_s=100.0)
    assert limits.allow(10**6)  # nothing is known yet
    clock.now += 40.0
    limits.measure(10, 20.0)
    assert limits.allow(29)
    assert not limits.allow(30)
    assert "no block would end" in limits.reached
    # It has ended: a smaller one does not begin either.
    assert not limits.allow(1)


def test_time_that_is_over_ends_it_though_nothing_is_known(clock: Clock) -> None:
    limits = Limits(budget_s=5.0)
    clock.now += 5.0
    assert not limits.allow(0)
    assert "is over" in limits.reached


def test_slowest_of_the_last_blocks_counts_and_old_ones_are_forgotten(clock: Clock) -> None:
    limits = Limits(budget_s=100.0)
    assert clock.now == 100.0
    limits.measure(1, 90.0)  # it compiled
    assert limits.allow(1)
    for _ in range(8):
        limits.measure(10, 10.0)
    limits.measure(0, 1e9)  # it had nothing to do
    assert limits.allow(99)


@pytest.mark.parametrize(("failures", "is_over"), [(0, False), (2, False), (3, True), (4, True)])
def test_enough_failures_end_it(failures: int, is_over: bool) -> None:  # noqa: FBT001 - a table
    limits = Limits(most_failures=3)
    limits.count(failures)
    assert limits.allow(1) is not is_over
    assert (f"{failures} runs with a FAIL" in limits.reached) is is_over
