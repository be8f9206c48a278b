"""R15: every command carries its channel's id, in the trace and in the database."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.campaign.events import events_of
from adeye.judge.trace_signals import TraceSignals
from adeye.store.read.query import run_query
from adeye.store.repository import Repository
from adeye.sweep.case import AuthorityOverride
from tests.project import run_cases
from tests.requirements.loop import driven, scripted

if TYPE_CHECKING:
    from pathlib import Path

    from tests.project import Executed

pytestmark = pytest.mark.requirements


def test_trace_keeps_each_channels_command_under_its_id(tmp_path: Path) -> None:
    channels = {"alpha": {"acceleration": -1.0}, "beta": {"acceleration": 0.25}}
    trace = driven(scripted(tmp_path, channels))
    assert trace.layout.channels == ("alpha", "beta")
    signals = TraceSignals(trace, np.ones(1, dtype=np.bool_))
    rows = int(trace.length[0]) - 1
    for name, parameters in channels.items():
        given = signals.series(f"channel.{name}.acceleration").values[0, :rows]
        assert np.all(given == parameters["acceleration"])


def test_database_names_the_channel_of_every_handover_and_failure(mini: Executed) -> None:
    silenced = [row for row in mini.project.rows() if row["fault_entry"] == "nominal_silent"]
    with Repository.open(mini.db, create=False) as repository:
        for row in silenced:
            stored = repository.run_row(row["run"])
            assert stored is not None
            states = [item for item in stored.events if item.kind == "channel"]
            assert ("nominal", "channel nominal: silent") in {(e.subject, e.text) for e in states}
            if row["architecture"] == "camera_radar":
                handovers = [item.subject for item in stored.events if item.kind == "switch"]
                assert "safety" in handovers


def test_failing_channel_is_named(tmp_path: Path) -> None:
    channels = {"alpha": {"fails_from": 0.5}, "beta": {"acceleration": -1.0}}
    trace = driven(scripted(tmp_path, channels))
    event = trace.channel_events[0]
    assert event is not None
    assert (event.channel, event.outcome) == ("alpha", "channel_error")
    failure = [item for item in events_of(trace, 0) if "told to fail" in item.text]
    assert [item.subject for item in failure] == ["alpha"]


@pytest.mark.slow
def test_handover_is_told_from_whom_and_to_whom_by_every_policy(tmp_path: Path) -> None:
    channels = {"alpha": {"acceleration": -1.0, "fails_from": 0.5}, "beta": {"acceleration": -1.1}}
    switches: dict[str, dict[str, Any]] = {
        "fixed_priority": {},
        "hysteresis": {"return_after": "1 s"},
    }
    for policy, keys in switches.items():
        trace = driven(scripted(tmp_path / policy, channels, policy=policy, **keys))
        told = [(row.subject, row.text) for row in events_of(trace, 0) if row.kind == "switch"]
        assert told[-1] == ("beta", "authority to beta from alpha (staleness)")


@pytest.mark.slow
def test_fork_names_the_channel_that_was_given_authority(mini: Executed) -> None:
    case = next(
        case
        for case in mini.plan.cases
        if (case.architecture.architecture, case.fault_entry) == ("camera_radar", "none")
    )
    fork = run_cases(mini.plan, [replace(case, override=AuthorityOverride(40, "safety"))])
    told = [(row.subject, row.text) for row in events_of(fork, 0) if row.kind == "switch"]
    assert told[-1] == ("safety", "authority to safety from nominal (override)")


def test_events_in_the_database_name_the_channel(mini: Executed) -> None:
    found = run_query(
        mini.db, "SELECT DISTINCT subject FROM v_timeline WHERE kind IN ('channel', 'switch')"
    )
    assert {row[0] for row in found.rows} >= {"nominal", "safety"}
