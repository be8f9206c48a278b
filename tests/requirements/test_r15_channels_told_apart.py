"""R15: every command carries its channel's id, in the trace and in the database."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.judge.trace_signals import TraceSignals
from adeye.store.read.query import run_query
from adeye.sweep.case import AuthorityOverride
from tests.events import events_of
from tests.project import Executed, run_cases
from tests.requirements.loop import driven, scripted
from tests.stored import known

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
    text = (
        "SELECT t.run, t.kind, t.subject, t.text FROM v_timeline t JOIN v_runs r USING (run) "
        "WHERE r.fault_entry = 'nominal_silent'"
    )
    told = {tuple(row) for row in run_query(mini.db, text).rows}
    for row in mini.project.rows():
        if row["fault_entry"] == "nominal_silent":
            assert (row["run"], "channel", "nominal", "channel nominal: silent") in told
            handovers = {item[2] for item in told if item[:2] == (row["run"], "switch")}
            assert "safety" in handovers or row["architecture"] != "camera_radar"


def test_failing_channel_is_named(tmp_path: Path) -> None:
    channels = {"alpha": {"fails_from": 0.5}, "beta": {"acceleration": -1.0}}
    trace = driven(scripted(tmp_path, channels))
    event = known(trace.channel_events[0])
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
    case = mini.case("camera_radar", "none")
    fork = run_cases(mini.plan, [replace(case, override=AuthorityOverride(40, "safety"))])
    told = [(row.subject, row.text) for row in events_of(fork, 0) if row.kind == "switch"]
    assert told[-1] == ("safety", "authority to safety from nominal (override)")
