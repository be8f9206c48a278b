"""Timelines of stored runs against their twins, over the mini campaign."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from adeye.campaign.timing import Injection, campaign_injections, run_timeline
from adeye.campaign.timing import _count as count
from adeye.errors import InputError
from adeye.evaluation.timeline import CLASSES, Timeline

if TYPE_CHECKING:
    from adeye.campaign.timing import InjectionTable
    from tests.project import Executed


@pytest.fixture(scope="module")
def table(mini: Executed) -> InjectionTable:
    return campaign_injections(mini.db)


def test_every_run_with_a_fault_has_a_class(table: InjectionTable) -> None:
    assert table.looked_at == len(table.injections) == 16
    assert sum(sum(row.counts.values()) for row in table.rows) == 16
    assert all(tuple(row.counts) == CLASSES for row in table.rows)


def test_silent_channel_is_detected_when_its_command_is_stale(table: InjectionTable) -> None:
    found = [
        item
        for item in table.injections
        if (item.architecture, item.fault_entry) == ("camera_radar", "nominal_silent")
    ]
    assert len(found) == 4
    for item in found:
        assert item.times.fault_s == pytest.approx(3.0)
        assert item.times.effect_s == pytest.approx(3.0)
        assert item.times.fdti_s is not None
        assert item.times.fdti_s <= 0.35
        assert item.class_ == "detected_in_time"


def test_stuck_switch_is_its_own_mechanism_off_twin(table: InjectionTable) -> None:
    stuck = [item for item in table.injections if item.architecture == "legacy_camera"]
    assert stuck
    assert all(item.times == item.without_mechanism for item in stuck)


def test_one_run_is_as_in_the_table(mini: Executed, table: InjectionTable) -> None:
    one = table.injections[0]
    assert run_timeline(mini.db, one.run) == one


def test_run_without_a_fault_has_no_timeline(mini: Executed) -> None:
    run = next(str(row["run"]) for row in mini.project.rows() if row["fault_entry"] == "none")
    with pytest.raises(InputError, match="no fault"):
        run_timeline(mini.db, run)


def test_grid_has_no_interval(table: InjectionTable) -> None:
    assert all(row.coverage is None for row in table.rows)


def injection(class_: str, violation: float | None = None) -> Injection:
    off = Timeline(1.0, violation_s=violation)
    return Injection("ab", "cut_in", "new", "out", off, off, None, class_)  # type: ignore[arg-type]


def test_random_sample_has_an_interval_without_what_was_not_activated() -> None:
    group = [injection("detected_in_time")] * 3 + [injection("masked"), injection("not_activated")]
    found = count(group, is_sample=True)
    assert (found.detected, found.activated) == (3, 4)
    assert found.coverage is not None
    assert found.coverage.low < 0.75 < found.coverage.high
    assert count([injection("not_activated")], is_sample=True).coverage is None


def test_least_ftti_is_that_of_the_worst_run() -> None:
    group = [injection("masked", 4.0), injection("masked", 2.5), injection("masked")]
    assert count(group, is_sample=False).least_ftti_s == pytest.approx(1.5)
