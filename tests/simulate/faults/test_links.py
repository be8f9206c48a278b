"""Faults of what one channel is shown, by hand."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from adeye.signals import Authority, Measurement
from adeye.testing.sensors import injector, moment
from tests.simulate.faults import flows

STEP = 0.05
ACTIVE = np.array([True])
NONE = np.array([False])


def sample(tick: int, *, fresh: bool = True, alive: bool = True) -> Measurement:
    item = flows.sample(tick, runs=1, stamp=tick * STEP)
    item.fresh[:], item.alive[:] = fresh, alive
    return item


def made(model: str, link: str = "front", **parameters: Any) -> Any:
    return injector(model, f"links.nominal.{link}", runs=1, step=STEP, parameters=[parameters])


def seen(fault: Any, ticks: int, onset: int = 3, end: int = 10**6) -> list[tuple[int, int, bool]]:
    """Return which sample is shown, which one its stamp tells, and whether it is fresh."""
    found = []
    for tick in range(ticks):
        there = ACTIVE if onset <= tick < end else NONE
        item = fault.apply(sample(tick), moment(there))
        found.append(
            (int(item.detections[0, 0, 0]), round(item.stamp[0] / STEP), bool(item.fresh[0]))
        )
    return found


def test_what_came_last_stands_while_everything_is_lost() -> None:
    lost = [(2, 2, False)] * 3
    assert seen(made("drop"), 7, end=6)[2:] == [(2, 2, True), *lost, (6, 6, True)]


def test_lost_sample_does_not_come_before_the_next_one_and_no_link_tells_of_a_dead_sensor() -> None:
    fault = made("drop")
    fault.apply(sample(0), moment(NONE))
    fault.apply(sample(1), moment(ACTIVE))
    held = fault.apply(sample(1, fresh=False), moment(ACTIVE))
    assert held.stamp[0] == 0.0
    assert not held.fresh[0]
    assert fault.apply(sample(1, fresh=False, alive=False), moment(ACTIVE)).alive[0]
    after = fault.apply(sample(1, fresh=False, alive=False), moment(NONE))
    assert not after.alive[0]


def test_share_of_lost_messages_is_the_probability() -> None:
    fault = made("drop", probability=0.3)
    shown = [fresh for _, _, fresh in seen(fault, 2000, onset=0)]
    lost = 1.0 - np.mean(shown)
    assert lost == pytest.approx(0.3, abs=4.0 * np.sqrt(0.3 * 0.7 / 2000))


def test_burst_takes_its_number_of_messages() -> None:
    fault = made("drop", probability=0.05, burst=5)
    fresh = [one for _, _, one in seen(fault, 1000, onset=0)]
    gaps = "".join("x" if one else "." for one in fresh).strip("x").split("x")
    lengths = {len(gap) for gap in gaps if gap}
    assert lengths
    # One that begins as another ends is as long as both.
    assert all(length % 5 == 0 for length in lengths)


def test_delayed_link_shows_each_sample_later_and_once_fresh() -> None:
    held = [(2, 2, False)] * 2
    late = [(number, number, True) for number in (3, 4, 5, 8)]
    assert seen(made("delay", by="0.1 s"), 9, end=8)[2:] == [(2, 2, True), *held, *late]


def test_held_up_sample_is_shown_after_newer_ones() -> None:
    fault = made("reorder", by="0.1 s", probability=0.4)
    shown = [number for number, _, _ in seen(fault, 60)]
    back = [later < earlier for earlier, later in pairwise(shown)]
    assert any(back)
    for tick in range(3, 60):
        assert shown[tick] in {tick, tick - 2, shown[tick - 1]}
    late = {tick - number for tick, number in enumerate(shown)}
    assert {0, 2} <= late


def test_everything_held_up_is_a_delay() -> None:
    delayed = [number for number, _, _ in seen(made("delay", by="0.1 s"), 12)]
    assert [number for number, _, _ in seen(made("reorder", by="0.1 s"), 12)] == delayed


def test_duplicate_is_the_message_before_with_the_stamp_of_the_new_one() -> None:
    again = [(2, stamp, True) for stamp in (2, 3, 4)]
    assert seen(made("duplicate"), 6, end=5)[2:] == [*again, (5, 5, True)]


def test_message_after_a_duplicate_comes_as_it_is() -> None:
    shown = seen(made("duplicate", probability=0.5), 200, onset=0)
    for tick in range(1, 200):
        assert shown[tick][0] in {tick, shown[tick - 1][0]}
    assert all(stamp == tick for tick, (_, stamp, _) in enumerate(shown))
    again = np.mean([number != tick for tick, (number, _, _) in enumerate(shown)])
    assert again == pytest.approx(0.5, abs=0.15)


def test_delayed_switch_has_shown_no_authority_before() -> None:
    fault = made("delay", "switch", by="0.1 s")
    shown = [
        int(fault.apply(Authority(np.array([tick]), np.array([1])), moment(ACTIVE)).channel[0])
        for tick in range(4)
    ]
    assert shown == [-1, -1, 0, 1]
