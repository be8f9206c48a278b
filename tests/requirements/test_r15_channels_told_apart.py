"""R15: commands of different channels carry their ids, in the trace and in the database."""

from __future__ import annotations

import pytest

from adeye.sweep.case import TestCase
from adeye.trace import Trace
from tests.project import Executed

pytestmark = pytest.mark.requirements


def test_columns_of_the_trace_are_named_by_channel(
    cut_ins: tuple[list[TestCase], Trace],
) -> None:
    _, trace = cut_ins
    nominal, safety = (trace.layout.channels.index(name) for name in ("nominal", "safety"))
    rows = int(trace.length[0]) - 1
    commands = trace["acceleration"][0, :rows]
    assert (commands[:, nominal] != commands[:, safety]).any()


def test_events_in_the_database_name_the_channel(mini: Executed) -> None:
    from adeye.store.query import run_query

    found = run_query(
        mini.db, "SELECT DISTINCT subject FROM v_timeline WHERE kind IN ('channel', 'switch')"
    )
    assert {row[0] for row in found.rows} >= {"nominal", "safety"}
