"""Which signals of a run are plotted, and how."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.campaign.replay import Execution, rerun
from adeye.judge.series import SERIES
from adeye.report.page.drive import ALWAYS, MAX_PLOTS, plots_of
from adeye.spec.concept import MetricBound, Requirement
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from adeye.report.page.replay import SignalPlot
    from adeye.store.records import VerdictRecord
    from tests.project import Executed


@pytest.fixture(scope="module")
def done(mini: Executed) -> Execution:
    """A cut-in of the candidate whose nominal channel falls silent."""
    row = next(
        row
        for row in mini.project.rows()
        if (row["fault_entry"], row["architecture"]) == ("nominal_silent", "camera_radar")
    )
    with Repository.open(mini.db, create=False) as repository:
        return rerun(repository, repository.find_run(row["run"]))


@pytest.fixture
def fsrs(mini: Executed) -> dict[str, Requirement]:
    return {item.id: item for item in mini.plan.files.concept.spec.requirements}


def plots(
    done: Execution, requirements: list[Requirement], **changed: VerdictRecord
) -> dict[str, SignalPlot]:
    """Plot with the stored verdicts, or others."""
    stored = {item.fsr_id: item for item in done.stored.verdicts} | {
        name.replace("_", "-"): record for name, record in changed.items()
    }
    made = plots_of(done.signals, 0, requirements, stored)
    assert len({item.name for item in made}) == len(made)
    return {item.name: item for item in made}


def test_what_every_run_has_is_plotted_first(done: Execution) -> None:
    assert list(plots(done, [])) == list(ALWAYS)


def test_every_plot_has_one_value_per_row(done: Execution, fsrs: dict[str, Requirement]) -> None:
    for item in plots(done, list(fsrs.values())).values():
        assert len(item.values) == int(done.trace.length[0])


def test_signals_of_the_judged_requirements_are_added(
    done: Execution, fsrs: dict[str, Requirement]
) -> None:
    found = plots(done, [fsrs["FSR-03"]])
    assert {"channel.nominal.status", "authority.safety"} <= set(found)
    assert found["channel.nominal.status"].labels[-1] == "silent"
    assert found["authority.safety"].labels == ("false", "true")
    assert set(found["authority.safety"].values) == {0.0, 1.0, None}


def test_requirement_without_a_verdict_adds_nothing(
    done: Execution, fsrs: dict[str, Requirement]
) -> None:
    unjudged = fsrs["FSR-03"].model_copy(update={"id": "FSR-99"})
    assert list(plots(done, [unjudged])) == list(ALWAYS)


def test_plots_are_few_enough_to_be_seen(done: Execution, fsrs: dict[str, Requirement]) -> None:
    assert len(plots(done, list(fsrs.values()))) <= MAX_PLOTS


def test_numbers_are_in_si_and_rounded(done: Execution) -> None:
    speed = plots(done, [])["ego.speed"]
    assert speed.unit == "m/s"
    assert speed.values == tuple(np.round(done.trace["ego"][0, : len(speed.values), 3], 3) + 0.0)


def test_axis_ends_where_a_larger_value_says_no_more(done: Execution) -> None:
    made = plots(done, [])
    assert made["ttc"].cap == SERIES["ttc"].type.cap
    assert made["required_deceleration"].cap is None


def test_no_conflict_is_a_gap_and_never_a_number(done: Execution) -> None:
    ttc = plots(done, [])["ttc"]
    known = [value for value in ttc.values if value is not None]
    assert known
    assert None in ttc.values
    assert all(np.isfinite(known))


def test_bound_of_a_metric_is_drawn_on_the_series_that_it_is_the_extreme_of(
    done: Execution, fsrs: dict[str, Requirement]
) -> None:
    line = plots(done, [fsrs["FSR-02"]])["required_deceleration"].thresholds
    assert [(item.fsr, item.value, item.side) for item in line] == [("FSR-02", 6.0, "at_most")]


def test_threshold_of_the_binding_predicate_is_drawn_with_its_side(
    done: Execution, fsrs: dict[str, Requirement]
) -> None:
    lane = plots(done, [fsrs["FSR-06"]])["ego.lane_offset"].thresholds
    assert [(item.value, item.side) for item in lane] in ([(0.6, "at_most")], [])
    record = next(item for item in done.stored.verdicts if item.fsr_id == "FSR-06")
    stop = replace(
        record,
        fsr_id="FSR-05",
        signal="ego.acceleration",
        predicate="ego.acceleration >= -4.5 m/s^2",
        threshold=-4.5,
    )
    drawn = plots(done, [fsrs["FSR-05"]], FSR_05=stop)["ego.acceleration"].thresholds
    assert [(item.fsr, item.value, item.side) for item in drawn] == [("FSR-05", -4.5, "at_least")]


@pytest.mark.parametrize(
    "changes",
    [{"threshold": None}, {"signal": None}, {"predicate": "not contact", "threshold": 1.0}],
)
def test_verdict_without_a_threshold_in_numbers_has_no_line(
    done: Execution, fsrs: dict[str, Requirement], changes: dict[str, Any]
) -> None:
    record = next(item for item in done.stored.verdicts if item.fsr_id == "FSR-06")
    record = replace(record, **{"signal": "ego.lane_offset", "threshold": 0.6, **changes})
    found = plots(done, [fsrs["FSR-06"]], FSR_06=record)
    assert all(not item.thresholds for item in found.values())


def test_metric_that_is_no_extreme_of_a_series_adds_no_signal(
    done: Execution, fsrs: dict[str, Requirement]
) -> None:
    bound = fsrs["FSR-02"].model_copy(update={"bound": MetricBound(metric="contact", at_most=0.0)})
    assert list(plots(done, [bound])) == list(ALWAYS)
