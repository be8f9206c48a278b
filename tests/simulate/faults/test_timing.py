"""When samples come, and what they say about it."""

from typing import Any

import numpy as np
import pytest

from adeye.kernel.relation import tick_time
from adeye.testing.sensors import moment
from tests.simulate.faults.streams import END, ONSET, STEP, made, played, streams


def stamps(pairs: list[Any], run: int = 0) -> list[float]:
    return [float(faulty.stamp[run]) for _, faulty in pairs]


def test_frozen_sample_has_new_stamps_and_old_content() -> None:
    pairs = played(made("freeze", "truth"), "truth")
    before = pairs[ONSET - 1][0]
    for given, faulty in pairs[ONSET:END]:
        assert faulty.stamp.tolist() == given.stamp.tolist()
        assert faulty.fresh.all()
        assert faulty.detections[0].tobytes() == before.detections[0].tobytes()
        assert faulty.estimate is not None
        assert faulty.estimate[0].tobytes() == before.estimate[0].tobytes()


def test_nothing_is_frozen_before_the_first_sample() -> None:
    pairs = played(made("freeze", "camera"), "camera", lambda _: np.ones(3, dtype=np.bool_))
    first = next(given for given, _ in pairs if given.stamp[0] >= 0.0)
    assert pairs[-1][1].detections.tobytes() == first.detections.tobytes()
    assert pairs[-1][1].stamp[0] == pairs[-1][0].stamp[0] > first.stamp[0]


def test_stale_sample_keeps_its_stamp_and_is_alive() -> None:
    pairs = played(made("stale", "truth"), "truth")
    for _, faulty in pairs[ONSET:END]:
        assert faulty.stamp[0] == pairs[ONSET - 1][0].stamp[0]
        assert faulty.fresh.tolist() == [False, True, False]
        assert faulty.alive.all()


def test_stale_stamp_is_that_of_the_sample_before_the_onset() -> None:
    pairs = played(made("stale_stamp", "truth"), "truth")
    for given, faulty in pairs[ONSET:END]:
        assert faulty.stamp[0] == pairs[ONSET - 1][0].stamp[0]
        assert faulty.detections.tobytes() == given.detections.tobytes()


def test_clock_drifts_by_its_rate_and_never_below_zero() -> None:
    fault = made("clock_drift", "truth", {"offset": "-0.1 s", "rate": 0.1})
    for tick, (given, faulty) in enumerate(played(fault, "truth")):
        if ONSET <= tick < END:
            gone = -0.1 + 0.1 * (tick - ONSET) * STEP
            assert faulty.stamp[0] == pytest.approx(given.stamp[0] + gone)
    early = made("clock_drift", "truth", {"offset": "-1 s"})
    pairs = played(early, "truth", lambda _: np.ones(3, dtype=np.bool_), onset=0)
    assert stamps(pairs)[:3] == [0.0, 0.0, 0.0]


def test_delayed_samples_come_so_many_ticks_later() -> None:
    pairs = played(made("delay", "truth", {"by": "0.15 s"}), "truth")
    found = stamps(pairs)
    held = [(ONSET - 1) * STEP] * 3
    late = [(tick - 3) * STEP for tick in range(ONSET + 3, END)]
    assert found[ONSET:END] == pytest.approx([*held, *late])
    fresh = [bool(faulty.fresh[0]) for _, faulty in pairs]
    assert fresh[ONSET:END] == [False] * 3 + [True] * (END - ONSET - 3)
    assert found[END] == tick_time(END, STEP)


def test_jitter_never_lets_a_sample_overtake_and_stays_in_its_span() -> None:
    fault = made("delay", "truth", {"by": "0.1 s", "jitter": "0.2 s"})
    found = stamps(played(fault, "truth", lambda tick: np.full(3, tick >= 2), onset=2))
    assert (np.diff(found[2:]) >= 0.0).all()
    late = [tick * STEP - stamp for tick, stamp in enumerate(found) if tick >= 12]
    assert min(late) >= 0.1 - 1e-9
    # What is held up by the one before comes with it, one tick after another at the latest.
    assert max(late) <= 0.3 + STEP + 1e-9
    assert len({round(item / STEP) for item in late}) > 1


def test_lost_sample_leaves_the_one_before() -> None:
    pairs = played(made("sample_loss", "truth", {"probability": 0.5}), "truth")
    shown = stamps(pairs)
    lost = 0
    for tick in range(ONSET, END):
        given, faulty = pairs[tick]
        if faulty.stamp[0] != given.stamp[0]:
            lost += 1
            assert faulty.stamp[0] == shown[tick - 1]
            assert not faulty.fresh[0]
            assert faulty.alive[0]
    assert 0 < lost < END - ONSET


def long_play(parameters: dict[str, Any], samples: int) -> list[bool]:
    """Which of many samples are lost."""

    fault = made("sample_loss", "truth", parameters)
    item, active = streams()["truth"][0], np.ones(3, dtype=np.bool_)
    found = []
    for number in range(samples):
        now = item.copy()
        now.stamp[:] = number
        found.append(bool(fault.apply(now, moment(active, time=number)).stamp[0] != number))
    return found


@pytest.mark.slow
def test_bursts_have_their_mean_length_and_share() -> None:
    lost = np.array(long_play({"enter": 0.05, "leave": 0.25}, 8_000))
    # Stationary share of the bad state of a chain of two: enter / (enter + leave).
    assert np.mean(lost) == pytest.approx(0.05 / 0.30, abs=0.03)
    begins = np.count_nonzero(lost[1:] & ~lost[:-1])
    assert np.count_nonzero(lost) / begins == pytest.approx(4.0, rel=0.15)


def test_power_comes_back_after_the_restart() -> None:
    pairs = played(made("power_loss", "truth", {"restart": "0.2 s"}), "truth")
    alive = [bool(faulty.alive[0]) for _, faulty in pairs]
    down = [tick for tick, is_alive in enumerate(alive) if not is_alive]
    assert down == list(range(ONSET, END + 4))
    assert all(faulty.alive[1] for _, faulty in pairs)
