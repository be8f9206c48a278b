"""The events of one run, as tests read them."""

from adeye.campaign.events import happenings
from adeye.store.records import EventRecord
from adeye.trace import Trace


def events_of(trace: Trace, run: int) -> tuple[EventRecord, ...]:
    """List the events of one run of a batch."""
    events = happenings(trace.select([run]))
    columns = (events.kind.values(), events.subject.values(), events.text.values())
    return tuple(
        EventRecord(time, kind or "", subject, text or "")
        for time, kind, subject, text in zip(events.time_s.tolist(), *columns, strict=True)
    )
