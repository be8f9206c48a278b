"""The registry of metrics, what happens to a metric that misbehaves, and columns of statuses."""

import logging
import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.errors import UsageError
from adeye.judge.metrics import METRICS, compute_metrics, register_metric
from adeye.judge.metrics.registry import CODES, StatusColumn, status_codes
from adeye.judge.stl.formula import unit_exponents
from adeye.judge.verdict import STATUSES
from adeye.ports import MetricColumn
from adeye.store.table_parts import METRIC_IDS, METRIC_STATUSES
from tests.judge.conftest import measure
from tests.refusals import refused


@pytest.fixture(autouse=True)
def registry() -> Iterator[None]:
    """Forget the metrics that a test registers."""
    before = dict(METRICS)
    yield
    METRICS.clear()
    METRICS.update(before)


class Mean:
    """Mean speed."""

    uid = "mine:mean_speed@1"
    column = "mean_speed_mps"
    unit = "m/s"
    worse = "higher"
    source = "made for a test"

    def compute(self, trace: Any) -> MetricColumn:
        runs = trace.runs
        speed = np.array([trace["ego"][run, : trace.length[run], 3].mean() for run in range(runs)])
        return MetricColumn(speed, ("value",) * runs, np.zeros(runs), (-1,) * runs)


def test_columns_are_those_of_the_store() -> None:
    assert set(METRICS) == set(METRIC_IDS)
    assert set(STATUSES) == set(METRIC_STATUSES)


@pytest.mark.parametrize("column", METRIC_IDS)
def test_metric_declares_what_it_is(column: str) -> None:
    metric = METRICS[column]
    assert metric.column == column
    assert metric.uid.startswith("adeye:")
    assert re.search(r"@[12]$", metric.uid)
    assert metric.worse in {"lower", "higher"}
    assert metric.source
    assert metric.text
    assert unit_exponents(metric.unit) is not None
    assert metric.worse == "higher" or metric.cap is not None or metric.settles


def test_every_metric_of_an_uneventful_run_is_well_formed(hand_made: Any) -> None:
    for name, column in compute_metrics(hand_made(runs=3).trace()).items():
        assert column.value.shape == column.time.shape == (3,)
        assert len(column.status) == len(column.actor) == 3
        for run, status in enumerate(column.status):
            assert status in STATUSES, name
            if status != "incomplete":  # which may tell the least that it is
                assert np.isfinite(column.value[run]) == (status == "value"), name


IN_THE_PATH = [
    "min_distance_m",
    "min_ttc_s",
    "min_time_headway_s",
    "max_drac_mps2",
    "min_mttc_s",
    "min_ettc_s",
    "max_mdrac_mps2",
    "max_dst_mps2",
    "min_mtc",
    "max_btn",
    "max_stn",
    "min_ttb_s",
    "min_tts_s",
    "min_ttk_s",
    "min_ttr_s",
    "min_rear_ttc_s",
    "max_follower_deceleration_mps2",
    "min_psd",
]
"""What is measured between the ego and those in its path."""
IN_THE_PLANE = ("min_ttc_2d_s", "min_wttc_s", "min_dce_m", "min_ttce_s")
SUMMED = [
    "max_required_deceleration_mps2",
    "rss_violation_s",
    "standstill_gap_m",
    "tet_s",
    "tit_s2",
    "crash_potential",
    "time_to_accident_s",
    "min_rss_ratio",
    "rss_response_violation_s",
    "min_time_gap_s",
]


def test_empty_road_is_no_conflict(hand_made: Any) -> None:
    for column in (*IN_THE_PATH, *IN_THE_PLANE):
        value, status, time, actor = measure(hand_made(objects=()), column)
        assert (status, actor) == ("no_conflict", -1), column
        assert np.isnan([value, time]).all(), column


def test_one_unknown_number_makes_an_error_of_the_metric(hand_made: Any) -> None:
    unknown_speed, unknown_place = hand_made(), hand_made()
    unknown_speed.columns["ego"][0, 10, 3] = np.nan
    unknown_place.columns["objects"][0, 10, 0, 0] = np.nan
    for made, columns in (
        (unknown_speed, (*IN_THE_PATH, *SUMMED)),
        (unknown_place, IN_THE_PLANE),
    ):
        for column in columns:
            value, status, _, _ = measure(made, column)
            assert status == "error", column
            assert not np.isfinite(value), column


def test_run_alone_has_the_metrics_that_it_has_in_a_batch(hand_made: Any) -> None:
    made = (
        hand_made(runs=3).object("lead", run=1, speed=3.0, size=(5.0, 2.5)).touch(7, "lead", run=2)
    )
    trace = made.trace()
    together = compute_metrics(trace)
    for run in range(3):
        for name, column in compute_metrics(trace.select([run])).items():
            np.testing.assert_array_equal(column.value[0], together[name].value[run])
            assert column.status[0] == together[name].status[run]
            assert column.actor[0] == together[name].actor[run]


def test_definition_computes_from_a_trace(hand_made: Any) -> None:
    column = METRICS["min_distance_m"].compute(hand_made().trace())
    assert column.value[0] == pytest.approx(40.0)


def test_class_becomes_a_metric(hand_made: Any) -> None:
    assert register_metric(Mean) is Mean
    metric = METRICS["mean_speed_mps"]
    assert (metric.text, metric.scale, metric.cap, metric.settles) == (
        "Mean speed.",
        1.0,
        None,
        False,
    )
    assert (metric.least, metric.most) == (None, None)
    assert compute_metrics(hand_made().trace())["mean_speed_mps"].value[0] == pytest.approx(20.0)


def test_metric_lacks_a_part() -> None:
    class Nothing:
        uid = "mine:nothing@1"

    refused(UsageError, register_metric, Nothing, says="no column, unit, worse, source, compute")


def test_attribute_is_the_one_that_was_looked_at() -> None:
    class Changing(Mean):
        asked = 0

        @property
        def column(self) -> str:  # type: ignore[override]
            self.asked += 1
            return "mean_speed_mps" if self.asked == 1 else "x; DROP TABLE run"

    register_metric(Changing)
    assert METRICS["mean_speed_mps"].column == "mean_speed_mps"


def test_unit_is_a_known_one_and_direction_of_danger_one_of_two() -> None:
    for name, value in (("unit", "pint"), ("unit", ""), ("worse", "up")):
        refused(UsageError, register_metric, type("Odd", (Mean,), {name: value}), says=repr(value))


def test_column_belongs_to_one_metric() -> None:
    with pytest.raises(UsageError, match=r"adeye:criticality\.min_ttc@1"):
        register_metric(type("Other", (Mean,), {"column": "min_ttc_s"}))


def test_scale_and_cap_are_finite_and_positive() -> None:
    for size in (0.0, -1.0, float("inf"), float("nan")):
        for name in ("scale", "cap"):
            refused(UsageError, register_metric, type("Odd", (Mean,), {name: size}), says=name)


def test_least_and_most_are_numbers_in_their_order() -> None:
    wrong: tuple[dict[str, Any], ...]
    wrong = {"least": "low"}, {"most": float("nan")}, {"least": 2, "most": 1}, {"most": []}
    for ends in wrong:
        refused(UsageError, register_metric, type("Odd", (Mean,), ends), says=r"least|most")
    refused(UsageError, register_metric, type("Odd", (Mean,), {"most_per": "h"}), says="per 'h'")
    more = {"least": 0, "most": 130, "most_per": "s", "of_objects": True}
    register_metric(type("Fine", (Mean,), more))
    metric = METRICS["mean_speed_mps"]
    assert (metric.most, metric.most_per, metric.of_objects) == (130.0, "s", True)
    metric = METRICS["mean_speed_mps"]
    assert (metric.least, metric.most) == (0.0, 130.0)


def computed(metric: type, made: Any) -> MetricColumn:
    register_metric(metric)
    return compute_metrics(made.trace())["mean_speed_mps"]


def test_one_run_that_a_metric_fails_on_leaves_the_others(
    hand_made: Any, caplog: pytest.LogCaptureFixture
) -> None:
    class Picky(Mean):
        def compute(self, trace: Any) -> MetricColumn:
            if (trace["ego"][:, 0, 3] < 0.0).any():
                msg = "backwards"
                raise ValueError(msg)
            return super().compute(trace)

    made = hand_made(runs=3).ego(run=1, speed=-1.0)
    with caplog.at_level(logging.ERROR):
        column = computed(Picky, made)
    assert column.status == ("value", "error", "value")
    np.testing.assert_allclose(column.value, [20.0, np.nan, 20.0])
    assert "backwards" in caplog.text


def test_metric_that_leaves_the_process_is_an_error(hand_made: Any) -> None:
    class Leaving(Mean):
        def compute(self, trace: Any) -> MetricColumn:
            raise SystemExit(0 * trace.runs)

    assert computed(Leaving, hand_made(runs=2)).status == ("error", "error")


def test_interruption_in_a_metric_is_no_error_of_it(hand_made: Any) -> None:
    class Interrupted(Mean):
        def compute(self, trace: Any) -> MetricColumn:
            raise KeyboardInterrupt(trace.runs)

    refused(KeyboardInterrupt, computed, Interrupted, hand_made(runs=2))


def test_value_below_a_mask_is_an_error_of_its_run(hand_made: Any) -> None:
    class Masked(Mean):
        def compute(self, trace: Any) -> MetricColumn:
            hidden = [run == 1 for run in range(trace.runs)]
            made = super().compute(trace)
            actor = np.ma.masked_array(made.actor, mask=False)
            return MetricColumn(
                np.ma.masked_array(made.value, mask=hidden), made.status, made.time, actor
            )

    register_metric(Masked)
    column = compute_metrics(hand_made(runs=3).trace())["mean_speed_mps"]
    assert list(column.status) == ["value", "error", "value"]
    assert np.isnan(column.value[1])


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_value_that_is_not_finite_is_an_error(hand_made: Any, bad: float) -> None:
    class Bad(Mean):
        def compute(self, trace: Any) -> MetricColumn:
            column = super().compute(trace)
            column.value[0] = bad
            return column

    assert computed(Bad, hand_made(runs=2)).status == ("error", "value")


@pytest.mark.parametrize(
    ("least", "most", "per", "told"),
    [
        (0.0, None, "", ("value", "error")),
        (-2.0, None, "", ("value", "value")),
        (-1.0, 4.0, "", ("error", "value")),
        (None, 1e-3, "s", ("error", "value")),
        (None, 100.0, "row", ("value", "value")),
    ],
)
def test_value_beyond_the_ends_that_a_metric_declares_is_an_error(
    hand_made: Any, least: float | None, most: float | None, per: str, told: tuple[str, ...]
) -> None:
    class Other(Mean):
        def compute(self, trace: Any) -> MetricColumn:
            column = super().compute(trace)
            return replace(column, value=np.array([5.0, -1.0]))

    ends = {"least": least, "most": most, "most_per": per}
    assert computed(type("Ended", (Other,), ends), hand_made(runs=2)).status == told


def test_status_that_does_not_exist_is_an_error(hand_made: Any) -> None:
    class Fine(Mean):
        def compute(self, trace: Any) -> MetricColumn:
            column = super().compute(trace)
            return MetricColumn(column.value, ("fine",) * trace.runs, column.time, column.actor)

    column = computed(Fine, hand_made())
    assert column.status == ("error",)
    assert np.isnan(column.value[0])


@pytest.mark.parametrize("number", [1000, -2])
def test_object_that_is_not_there_is_an_error_at_its_metric(
    hand_made: Any, caplog: pytest.LogCaptureFixture, number: int
) -> None:
    class Lost(Mean):
        def compute(self, trace: Any) -> MetricColumn:
            column = super().compute(trace)
            actor = np.full(trace.runs, number)
            return MetricColumn(column.value, column.status, column.time, actor)

    assert computed(Lost, hand_made(runs=2)).status == ("error", "error")
    told = rf"names object {number}, which is not there \({re.escape(__file__)}:\d+\)"
    assert re.search(told, caplog.text)


@pytest.mark.parametrize("time", [-5.0, 1e9])
def test_time_outside_of_a_run_is_an_error_at_its_metric(
    hand_made: Any, caplog: pytest.LogCaptureFixture, time: float
) -> None:
    class Late(Mean):
        def compute(self, trace: Any) -> MetricColumn:
            column = super().compute(trace)
            column.time[:] = time
            return column

    assert computed(Late, hand_made(runs=2)).status == ("error", "error")
    assert f"time is {time:g} s, which is not in the run ({__file__}:" in caplog.text


def test_wrong_number_of_values_is_an_error(hand_made: Any) -> None:
    class Short(Mean):
        def compute(self, trace: Any) -> MetricColumn:
            del trace
            return MetricColumn(np.zeros(0), (), np.zeros(0), ())

    assert computed(Short, hand_made(runs=2)).status == ("error", "error")


def test_column_reads_as_its_words() -> None:
    column = StatusColumn(np.array([0, 5, 2]))
    assert tuple(column) == ("value", "error", "not_applicable")
    assert (column[1], tuple(column[1:]), len(column)) == ("error", tuple(column)[1:], 3)
    assert column == ("value", "error", "not_applicable")
    assert column != ("value", "error", "error")
    assert hash(column) == hash(tuple(column))
    assert repr(column) == repr(tuple(column))


@pytest.mark.parametrize("words", [STATUSES, StatusColumn(np.arange(6))])
def test_codes_are_those_of_the_words(words: tuple[str, ...]) -> None:
    assert status_codes(words).tolist() == [CODES[word] for word in STATUSES] == list(range(6))


def test_other_words_have_no_code() -> None:
    assert status_codes(("fine", "value")).tolist() == [-1, 0]
