import numpy as np
import pytest

from adeye.signals import OK, SILENT, ControlCommand
from adeye.simulate.channels.guard import ERROR, MAX_DETAIL, Failures, describe, silenced


def command(acceleration: float, stamp: float) -> ControlCommand:
    return ControlCommand(
        "a",
        np.full(2, acceleration),
        np.full(2, 0.1),
        np.full(2, stamp),
        np.full(2, OK, dtype=np.int64),
        monitors=np.ones((2, 1, 2), dtype=np.bool_),
        tracks=np.zeros((2, 8, 6)),
        candidates=np.zeros((2, 5, 3, 2)),
        candidate_costs=np.zeros((2, 5)),
        chosen=np.zeros(2, dtype=np.int64),
    )


def test_first_failure_of_a_run_is_kept() -> None:
    failures = Failures("a", 2)
    failures.add(np.array([True, False]), ERROR, 1.0, "one")
    failures.add(np.array([True, True]), ERROR, 2.0, "two")
    assert [event and event.detail for event in failures.events] == ["one", "two"]
    assert failures.silent.all()


def test_long_detail_is_cut() -> None:
    failures = Failures("a", 1)
    failures.add(np.array([True]), ERROR, 0.0, "x" * 10_000)
    event = failures.events[0]
    assert event is not None
    assert len(event.detail) == MAX_DETAIL


def test_nobody_silent_is_the_very_same_command() -> None:
    given = command(1.0, 1.0)
    assert silenced(given, command(0.0, 0.0), np.zeros(2, dtype=np.bool_)) is given


def test_silent_run_keeps_values_and_stamp_of_before_and_the_other_run_its_own() -> None:
    given = command(1.0, 1.0)
    quiet = silenced(given, command(-2.0, 0.5), np.array([True, False]))
    assert quiet.acceleration.tolist() == [-2.0, 1.0]
    assert quiet.stamp.tolist() == [0.5, 1.0]
    assert quiet.status.tolist() == [SILENT, OK]
    assert quiet.monitors is not None
    assert quiet.monitors[:, 0, 0].tolist() == [False, True]
    assert quiet.tracks is not None
    assert np.isnan(quiet.tracks[0]).all()
    assert quiet.candidates is not None
    assert np.isnan(quiet.candidates).any(axis=(1, 2, 3)).tolist() == [True, False]
    assert quiet.chosen is not None
    assert quiet.chosen.tolist() == [-1, 0]
    assert given.acceleration.tolist() == [1.0, 1.0]


def test_description_names_the_line_but_no_folder() -> None:
    with pytest.raises(ValueError, match="too fast") as caught:
        raise ValueError("too fast")
    text = describe(caught.value)
    assert text.startswith("ValueError: too fast (test_failures.py:")
    assert "/" not in text


def test_failure_says_whether_it_may_be_the_machines() -> None:
    failures = Failures("a", 2)
    failures.add(np.array([True, False]), ERROR, 1.0, "one", is_machine_dependent=True)
    failures.add(np.array([False, True]), ERROR, 1.0, "two")
    assert [event and event.is_machine_dependent for event in failures.events] == [True, False]


def test_however_much_an_exception_says_its_place_is_told() -> None:
    with pytest.raises(ValueError, match="x") as caught:
        raise ValueError("x" * 10_000)
    text = describe(caught.value)
    assert len(text) == MAX_DETAIL
    assert "(test_failures.py:" in text


def test_exception_in_a_library_is_told_at_the_line_that_called_it() -> None:
    with pytest.raises(np.linalg.LinAlgError) as caught:
        np.linalg.inv(np.zeros((2, 2)))
    assert "(test_failures.py:" in describe(caught.value)
