"""Metric series: status, cap and actor of their samples."""

from typing import Any

import numpy as np
import pytest

from adeye.judge.conflict import DRAC, GAP, REQUIRED, TTC
from adeye.judge.series import (
    SERIES,
    RssParameters,
    TraceSeries,
    fill_statuses,
    is_demand,
    mark_errors,
    mark_undecided,
    series_signals,
    status_of,
)
from adeye.judge.stl.formula import unit_exponents
from adeye.judge.stl.series import SampleStatus
from tests.judge.stl.batch import errors_of
from tests.refusals import refused
from tests.stored import known


@pytest.mark.parametrize("name", SERIES)
def test_series_declares_what_it_is(name: str) -> None:
    definition = SERIES[name]
    changed = name == "jerk" or name.startswith("rss_")
    assert definition.uid == f"adeye:series.{name}@{2 if changed else 1}"
    assert definition.worse in {"lower", "higher"}
    assert definition.source
    assert definition.type.text
    assert unit_exponents(definition.type.unit) is not None
    assert series_signals()[name] == definition.type


@pytest.mark.parametrize("name", ["gap", "ttc", "time_gap", "time_headway", "rss_margin"])
def test_empty_road_is_no_conflict_with_a_cap(hand_made: Any, name: str) -> None:
    series = TraceSeries(hand_made(objects=()).trace()).series(name)
    assert series.cap == SERIES[name].type.cap is not None
    assert np.all(series.status == SampleStatus.NO_CONFLICT)
    assert not errors_of(series).any()


def test_run_without_objects_keeps_a_free_distance(hand_made: Any) -> None:
    series = TraceSeries(hand_made(objects=()).trace()).series("distance")
    assert np.all(series.status == SampleStatus.NO_CONFLICT)


@pytest.mark.parametrize("name", ["drac", "required_deceleration", "rss_violation"])
def test_without_conflict_nothing_is_demanded(hand_made: Any, name: str) -> None:
    trace_series = TraceSeries(hand_made(objects=()).trace())
    assert np.all(trace_series.samples(name).status == SampleStatus.NO_CONFLICT)
    series = trace_series.series(name)
    assert not errors_of(series).any()
    assert np.all(series.status == SampleStatus.VALUE)
    assert np.all(series.values == 0.0)


def test_deceleration_is_not_applicable_in_contact(hand_made: Any) -> None:
    made = hand_made().object("lead", s=1.0, speed=0.0).ego(s=0.0).touch(2, "lead")
    samples = TraceSeries(made.trace()).samples("drac")
    assert samples.status[0, 2] == SampleStatus.NOT_APPLICABLE


def test_overlap_without_recorded_contact_is_an_error(hand_made: Any) -> None:
    made = hand_made().object("lead", s=1.0, speed=0.0).ego(s=0.0)
    samples = TraceSeries(made.trace()).samples("drac")
    assert np.all(samples.status == SampleStatus.ERROR)


@pytest.mark.parametrize("name", SERIES)
def test_nan_is_an_error_in_every_series(hand_made: Any, name: str) -> None:
    made = hand_made()
    made.columns["ego"][0, 4, 3 if name != "jerk" else 4] = np.nan
    series = TraceSeries(made.trace()).series(name)
    assert errors_of(series)[0, 4]


def test_rss_is_violated_where_the_margin_is_negative(hand_made: Any) -> None:
    s = 20.0 * np.arange(21) * 0.1
    made = hand_made().ego(s=s).object("lead", s=s + 4.0 + np.linspace(60.0, 70.0, 21))
    series = TraceSeries(made.trace())
    violated = series.series("rss_violation")
    np.testing.assert_array_equal(violated.values, series.samples("rss_margin").values < 0.0)
    assert violated.values[0, 0] == 1.0
    assert violated.values[0, -1] == 0.0
    assert violated.actor is not None
    assert (violated.actor[0, 0], violated.actor[0, -1]) == (0, -1)


def test_shorter_response_needs_less_distance(hand_made: Any) -> None:
    trace = hand_made().trace()
    slow = TraceSeries(trace).samples("rss_margin").values[0, 0]
    quick = TraceSeries(trace, RssParameters(response_time=0.5)).samples("rss_margin").values[0, 0]
    assert quick > slow


def test_jerk_is_the_slope_of_the_acceleration_and_unknown_at_the_start(hand_made: Any) -> None:
    made = hand_made(rows=41, step=0.05).ego(acceleration=np.linspace(0.0, -4.0, 41))
    series = TraceSeries(made.trace()).series("jerk")
    assert known(series.status)[0, 0] == SampleStatus.NOT_APPLICABLE
    np.testing.assert_allclose(series.values[0, 20:], -2.0)
    # Before the run nothing changed.
    np.testing.assert_allclose(series.values[0, :20], -2.0 * np.arange(20) * 0.05)


def test_unknown_series_is_refused(hand_made: Any) -> None:
    refused(KeyError, TraceSeries(hand_made().trace()).series, "gab")


VALUE, FREE, NOT_APPLICABLE, ERROR = SampleStatus


def test_decelerations_are_demands() -> None:
    assert [is_demand(column) for column in (GAP, TTC, DRAC, REQUIRED)] == [
        False,
        False,
        True,
        True,
    ]


def test_value_stands_for() -> None:
    for value, actor, touched, column, expected in (
        (1.0, 0, -1, GAP, VALUE),
        (1.0, -1, -1, GAP, VALUE),
        (np.inf, -1, -1, TTC, FREE),
        (-np.inf, 0, -1, TTC, ERROR),
        (np.nan, 0, -1, TTC, ERROR),
        (0.0, 0, -1, DRAC, VALUE),
        (0.0, -1, -1, DRAC, FREE),
        (np.inf, 0, 0, REQUIRED, NOT_APPLICABLE),
        (np.inf, 0, -1, REQUIRED, ERROR),
        (np.nan, 0, 0, REQUIRED, ERROR),
    ):
        demands = is_demand(column)
        assert status_of(value, actor, touched, demands) == expected
        status = np.full((1, 2), -1, dtype=np.int8)
        actors, contact = np.full((1, 2), actor, np.int16), np.full((1, 2), touched, np.int16)
        fill_statuses(np.array([1]), np.full((1, 2), value), actors, contact, demands, status)
        # Beyond the run there is nothing.
        assert status.tolist() == [[expected, FREE if demands else VALUE]], value


def test_what_is_not_finite_is_an_error() -> None:
    status = np.zeros((2, 3), dtype=np.int8)
    mark_errors(np.array([[0.0, np.nan, 1.0], [np.inf, 0.0, -np.inf]]), status)
    assert status.tolist() == [[0, ERROR, 0], [ERROR, 0, ERROR]]


def test_nothing_is_decided_from_the_last_row_on() -> None:
    status = np.zeros((2, 3), dtype=np.int8)
    mark_undecided(np.array([3, 2]), status)
    assert status.tolist() == [[0, 0, NOT_APPLICABLE], [0, NOT_APPLICABLE, NOT_APPLICABLE]]
