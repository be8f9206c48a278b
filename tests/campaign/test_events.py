"""Events of a run, read from its trace."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye.campaign.events import happenings
from adeye.signals import REASON_DEFAULT, REASON_HANDOVER, REASON_REQUEST, REASON_STALENESS
from adeye.store.records import EventRecord
from adeye.sweep.case import TestCase
from adeye.trace import ChannelEvent, Trace
from tests.events import events_of
from tests.project import Executed, run_cases


def changed(trace: Trace, **columns: Any) -> Trace:
    """Return the first run of a trace with other columns."""
    one = trace.select([0])
    return replace(one, columns={**one.columns, **columns})


def of_kind(trace: Trace, kind: str) -> list[EventRecord]:
    return [item for item in events_of(trace, 0) if item.kind == kind]


@pytest.fixture
def trace(cut_ins: tuple[list[TestCase], Trace]) -> Trace:
    return cut_ins[1]


def test_silent_nominal_channel_leads_to_a_takeover(trace: Trace) -> None:
    for run in range(trace.runs):
        found = [(item.kind, item.text) for item in events_of(trace, run)]
        order = [
            ("storyboard", "cut_in begins"),
            ("fault", "fault nominal_silent begins"),
            ("channel", "channel nominal: silent"),
            ("monitor", "monitor nominal_silent confirmed"),
        ]
        assert set(order) <= set(found)
        takeovers = [text for kind, text in found if kind == "switch" and "safety" in text]
        assert len(takeovers) == 1


def test_events_are_in_order_of_time_and_at_ticks(trace: Trace) -> None:
    times = [item.time_s for item in events_of(trace, 0)]
    assert times == sorted(times)
    assert np.isin(np.round(times, 9), np.round(trace.time, 9)).all()


@pytest.mark.slow
def test_fault_begins_and_ends_when_it_was_scripted_to(mini: Executed) -> None:
    wanted = ("front_camera_out", "camera_radar")
    cases = mini.plan.cases
    case = next(i for i in cases if (i.fault_entry, i.architecture.architecture) == wanted)
    found = of_kind(run_cases(mini.plan, [case]), "fault")
    assert [(round(item.time_s, 9), item.text) for item in found] == [
        (2.0, "fault front_camera_out begins"),
        (5.0, "fault front_camera_out ends"),
    ]


def test_contact_is_the_last_event_with_its_speed(mini: Executed) -> None:
    rows = [row for row in mini.project.rows() if row["contact"]]
    assert rows, "the legacy architecture touches somebody"
    case = next(case for case in mini.plan.cases if case.digest == rows[0]["test_case"])
    last = events_of(run_cases(mini.plan, [case]), 0)[-1]
    assert last.kind == "contact"
    assert last.subject == "cutter"
    assert f"{rows[0]['impact_speed_mps']:.2f} m/s" in last.text


def test_fault_from_the_start_and_one_beyond_the_end(trace: Trace) -> None:
    active = np.zeros_like(trace["fault_active"][:1])
    active[:, int(trace.length[0]) - 1 :] = True
    assert of_kind(changed(trace, fault_active=active), "fault") == []
    found = of_kind(changed(trace, fault_active=np.ones_like(active)), "fault")
    assert found == [EventRecord(0.0, "fault", "nominal_silent", "fault nominal_silent begins")]


LATER = ChannelEvent("channel_killed", "safety", 0.6, "by SIGKILL")


def test_failure_of_a_channel_is_an_event_with_its_reason(trace: Trace) -> None:
    one = trace.select([0])
    event = ChannelEvent("channel_error", "nominal", 0.4, "RuntimeError: lost", later=(LATER,))
    failed = replace(one, channel_events=(event,))
    added = set(events_of(failed, 0)) - set(events_of(one, 0))
    assert added == {
        EventRecord(0.4, "channel", "nominal", "channel_error: RuntimeError: lost"),
        EventRecord(0.6, "channel", "safety", "channel_killed: by SIGKILL"),
    }


def test_authority_of_nobody_is_named(trace: Trace) -> None:
    nobody = np.full_like(trace["authority"][:1], -1)
    nobody[:, 0] = 0
    found = of_kind(changed(trace, authority=nobody), "switch")
    assert [(round(item.time_s, 9), item.subject) for item in found] == [(0.05, "none")]


def test_handover_tells_who_after_whom_when_and_why(trace: Trace) -> None:
    authority = np.zeros_like(trace["authority"][:1])
    authority[:, 10:] = 1
    reason = np.full_like(trace["reason"][:1], REASON_DEFAULT)
    reason[:, 10:] = REASON_REQUEST

    def found() -> list[tuple[float, str | None, str]]:
        switched = of_kind(changed(trace, authority=authority, reason=reason), "switch")
        return [(item.time_s, item.subject, item.text) for item in switched]

    begins, takes = trace.time[7], trace.time[10]
    assert found() == [(takes, "safety", "authority to safety from nominal (request)")]
    # One with a latency is an event when it begins and when it takes effect.
    reason[:, 7:10] = REASON_HANDOVER
    reason[:, 10:] = REASON_STALENESS
    assert found() == [
        (begins, "nominal", "handover from nominal begins"),
        (takes, "safety", "authority to safety from nominal (staleness)"),
    ]
    # Where the ego coasts meanwhile, that nobody acts tells it.
    authority[:, 7:10] = -1
    assert [text for _, _, text in found()] == [
        "authority to none from nominal (handover)",
        "authority to safety from none (staleness)",
    ]


def test_first_detection_of_the_critical_object_is_an_event_of_each_sensor(trace: Trace) -> None:
    cutter = trace.layout.context.object_ids.index("cutter")
    names = trace.layout.sensors
    found = happenings(trace, np.full(trace.runs, cutter))
    rows = list(
        zip(found.run.tolist(), found.kind.values(), found.subject.values(),
            found.text.values(), found.time_s.tolist(), strict=True)
    )  # fmt: skip
    seen = [row for row in rows if row[1] == "sensor"]
    assert {row[2] for row in seen} == {"front_camera", "front_radar"}
    for run, _, sensor, text, time in seen:
        assert text == f"{sensor} first detects cutter"
        column = trace["detected"][run, :, names.index(sensor or ""), cutter]
        assert trace.time[np.flatnonzero(column)[0]] == time


def test_nothing_detected_is_no_event(trace: Trace) -> None:
    none = np.full(trace.runs, -1)
    blind = changed(trace, detected=np.zeros_like(trace["detected"][:1]))
    for events in (happenings(trace, none), happenings(blind, np.zeros(1, dtype=np.int64))):
        assert "sensor" not in events.kind.values()


def test_event_that_lost_against_another_did_not_begin(trace: Trace) -> None:
    begun = np.full_like(trace["begun"][:1], np.nan)
    begun[:, 5:, 0] = np.inf
    (event,) = of_kind(changed(trace, begun=begun), "storyboard")
    assert event.time_s == trace.time[5]
    assert event.text == "change_speed is lost: a later event takes its place at the same time"


@pytest.mark.parametrize("shift", [0.0, 0.5])
@pytest.mark.parametrize(
    ("moves", "says"),
    [
        ([], "cut_in begins, and changes nothing"),
        ([("object_places", 1, 19, -1e-3), ("object_places", 5, 19, -1e-3)], "cut_in begins"),
        # A later event about its speed does not end it.
        ([("object_places", 1, 25, -1e-3), ("object_places", 5, 25, -1e-3)], "cut_in begins"),
        # What moves before it, or by a later event of the same actor, is not its doing.
        ([("objects", 3, 2, 1.0)], "cut_in begins, and changes nothing"),
        ([("object_places", 1, 2, 1.0)], "cut_in begins, and changes nothing"),
        # Nor is what it is not about.
        ([("objects", 3, 6, 1e-3)], "cut_in begins, and changes nothing"),
        ([("objects", 3, 25, 1.0)], "cut_in begins, and changes nothing"),
    ],
)
def test_event_that_leaves_its_actor_as_it_was_says_so(
    trace: Trace, moves: list[tuple[str, int, int, float]], says: str, shift: float
) -> None:
    names = trace.layout.context.event_ids
    actor = trace.layout.moved[names.index("cut_in")].object
    begun = np.full_like(trace["begun"][:1], np.nan)
    begun[:, 5:, names.index("cut_in")] = trace.time[5]
    begun[:, 20:, names.index("change_speed")] = trace.time[20]
    columns = {name: trace[name][:1].copy() for name in ("objects", "object_places")}
    columns["objects"][..., actor, 3] = 20.0
    columns["object_places"][..., actor, 1] = 5.25
    columns["object_places"][..., actor, 5] = 0.0
    # The lane shifts with its actor in it, in the middle.
    columns["object_places"][:, 10:, actor, 1] += shift
    for name, quantity, row, by in moves:
        columns[name][:, row, actor, quantity] += by
    first, *_ = of_kind(changed(trace, begun=begun, **columns), "storyboard")
    assert first.text == says
