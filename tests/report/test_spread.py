"""Least, median and greatest value of each metric, each with its run."""

from typing import Any

from adeye.report.metrics import metric_title, summarise
from adeye.report.model.report import MetricSummary
from adeye.store.tables import METRIC_IDS
from tests.figures import figures_of
from tests.stored import known

UNITLESS = {
    *("contact", "contact_at_fault", "nominal_availability", "takeovers", "trips"),
    *("stop_rating", "stop_regret"),
    *("min_mtc", "min_psd", "max_btn", "max_stn", "min_rss_ratio"),
    *("tet_share", "crash_potential", "fatality_probability"),
}


def row(run: str, distance: float | None, **changes: Any) -> dict[str, Any]:
    return {
        "scenario": "cut_in",
        "architecture": "candidate",
        "run": run,
        **dict.fromkeys(METRIC_IDS),
        "min_distance_m": distance,
        **changes,
    }


def summaries(rows: list[dict[str, Any]]) -> dict[tuple[str, str, str], MetricSummary]:
    made = summarise(
        figures_of(rows), lambda place: str(rows[place]["run"]), lambda run: f"adeye replay {run}"
    )
    return {(item.scenario, item.architecture, item.metric): item for item in made}


def test_extremes_and_median_come_with_the_runs_that_they_come_from() -> None:
    rows = [row(name, value) for name, value in (("a", 3.0), ("b", 1.0), ("c", 2.0), ("d", None))]
    found = summaries(rows)["cut_in", "candidate", "min_distance_m"]
    values = [
        (item.value, item.run) for item in (found.minimum, found.median, found.maximum) if item
    ]
    assert values == [(1.0, "b"), (2.0, "c"), (3.0, "a")]
    assert (found.runs, found.undefined) == (4, 1)
    assert known(found.minimum).command == "adeye replay b"


def test_median_of_an_even_number_is_a_run_that_exists() -> None:
    found = summaries([row("a", 1.0), row("b", 2.0)])["cut_in", "candidate", "min_distance_m"]
    assert found.median is not None
    assert (found.median.value, found.median.run) == (1.0, "a")


def test_among_equal_values_the_run_planned_first_is_the_least_and_the_last_the_greatest() -> None:
    rows = [row("d", 1.0), row("c", 1.0), row("b", 1.0), row("a", 1.0)]
    found = summaries(rows)["cut_in", "candidate", "min_distance_m"]
    extremes = (found.minimum, found.median, found.maximum)
    assert [item.run for item in extremes if item] == ["d", "c", "a"]


def test_metric_without_a_value_has_no_extremes() -> None:
    found = summaries([row("a", None)])["cut_in", "candidate", "min_distance_m"]
    assert (found.minimum, found.median, found.maximum, found.undefined) == (None, None, None, 1)


def test_scenarios_and_architectures_are_apart_and_every_metric_is_there() -> None:
    rows = [row("a", 1.0), row("b", 2.0, architecture="legacy"), row("c", 3.0, scenario="braking")]
    found = summaries(rows)
    assert len(found) == 3 * len(METRIC_IDS)
    assert {key[:2] for key in found} == {
        ("cut_in", "candidate"),
        ("cut_in", "legacy"),
        ("braking", "candidate"),
    }


def test_title_is_words_and_a_unit() -> None:
    for name, title in (
        ("min_ttc_s", ("min ttc", "s")),
        ("max_required_deceleration_mps2", ("max required deceleration", "m/s²")),
        ("max_jerk_mps3", ("max jerk", "m/s³")),
        ("impact_speed_mps", ("impact speed", "m/s")),
        ("min_distance_m", ("min distance", "m")),
        ("contact", ("contact", "")),
        ("lateral_x", ("lateral x", "")),
    ):
        assert metric_title(name) == title


def test_every_metric_of_the_database_has_a_title_without_its_suffix() -> None:
    for name in METRIC_IDS:
        words, unit = metric_title(name)
        assert "_" not in words
        assert bool(unit) is (name not in UNITLESS)
