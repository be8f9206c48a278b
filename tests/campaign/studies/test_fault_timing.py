"""Timelines of stored runs against their twins, over the mini campaign."""

from __future__ import annotations

import shutil
from pathlib import Path
from unittest.mock import Mock

import pytest

from adeye.campaign.studies import fault_timing as timing
from adeye.campaign.studies.fault_timing import InjectionTable, campaign_injections, run_timeline
from adeye.errors import InputError
from adeye.judge.timeline import CLASSES
from adeye.store.repository import Repository
from tests.project import Executed


@pytest.fixture(scope="module")
def db(mini: Executed, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy: what is found is kept, and other tests share the campaign."""
    copy = tmp_path_factory.mktemp("timing") / "adeye.db"
    shutil.copyfile(mini.db, copy)
    return copy


@pytest.fixture(scope="module")
def table(db: Path) -> InjectionTable:
    return campaign_injections(db)


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


@pytest.mark.slow
def test_one_run_is_as_in_the_table(mini: Executed, table: InjectionTable) -> None:
    one = table.injections[0]
    assert run_timeline(mini.db, one.run) == one


def test_run_without_a_fault_has_no_timeline(mini: Executed) -> None:
    run = next(str(row["run"]) for row in mini.project.rows() if row["fault_entry"] == "none")
    with pytest.raises(InputError, match="no fault"):
        run_timeline(mini.db, run)


def test_grid_has_no_interval(table: InjectionTable) -> None:
    assert all(row.coverage is None for row in table.rows)


def test_found_is_kept(db: Path, table: InjectionTable, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(timing, "_injections", Mock(side_effect=AssertionError))
    assert campaign_injections(db) == table
    with Repository.open(db, create=False) as repository:
        assert repository.hindsight.injections(table.campaign) == table.injections
        assert repository.verify() == ()


def test_twins_are_named_by_their_traces(table: InjectionTable) -> None:
    for item in table.injections:
        assert len(item.twins) == 3
        assert all(len(digest) == 32 for digest in item.twins)
