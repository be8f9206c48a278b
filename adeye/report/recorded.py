"""Verdicts and events of the database as a report has them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.report.parts import Binding, Margin, RunVerdict
from adeye.report.replay import Event

if TYPE_CHECKING:
    from collections.abc import Iterable

    from adeye.store.rows import EventRecord, VerdictRecord


def margin_of(record: VerdictRecord) -> Margin | None:
    """Margin of a verdict, None where there is no number."""
    if record.margin is None:
        return None
    return Margin(value=record.margin, unit=record.unit or "", robustness=record.robustness_low)


def binding_of(record: VerdictRecord) -> Binding | None:
    """Binding predicate of a verdict, None where there is none."""
    if record.predicate is None:
        return None
    return Binding(
        predicate=record.predicate,
        signal=record.signal or "",
        time_s=record.time_s,
        actor=record.actor,
        value=record.value,
        threshold=record.threshold,
        difference=record.margin,
        unit=record.unit or "",
        note=record.detail or "",
    )


def run_verdicts(records: Iterable[VerdictRecord]) -> tuple[RunVerdict, ...]:
    """Verdicts of one run for its replay."""
    return tuple(
        RunVerdict(
            fsr=record.fsr_id,
            verdict=record.verdict,
            margin=margin_of(record),
            binding=binding_of(record),
            note=record.detail or "",
        )
        for record in records
    )


def replay_events(records: Iterable[EventRecord]) -> tuple[Event, ...]:
    """Events of one run for its replay."""
    return tuple(
        Event.model_validate({"time_s": item.time_s, "kind": item.kind, "text": item.text})
        for item in records
    )
