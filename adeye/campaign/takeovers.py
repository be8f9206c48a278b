"""The takeovers of a campaign in hindsight: was each needed, done, late, or missed?"""

from __future__ import annotations

import collections
from dataclasses import dataclass
from typing import TYPE_CHECKING

from adeye.campaign.forks import make_forks
from adeye.campaign.recalling import Counter, recalled_parts
from adeye.evaluation.takeovers import (
    TAKEOVER_CLASSES,
    Takeover,
    TakeoverClass,
    classify_takeover,
    precision_of,
    recall_of,
)
from adeye.kernel.clock import tick_time
from adeye.store.hindsight import TakeoverLine
from adeye.store.repository import Repository
from adeye.sweep.case import AuthorityOverride

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from adeye.campaign.forks import Forked
    from adeye.campaign.recalling import Report
    from adeye.campaign.reproduce import Recalled


@dataclass(frozen=True)
class TakeoverMatrix:
    """Takeovers of a campaign by class.

    Attributes:
        campaign: Id.
        executed: Runs with a result.
        looked_at: Runs that were forked.
        without_choice: Runs whose architecture has one channel only.
        counts: Runs by class.
        avoidable: Missed ones that would not violate had the other channel acted since the fault,
            or since the start where there is none.
        harmful: Spurious ones that violate although their fork does not.
        lines: The runs.
    """

    campaign: str
    executed: int
    looked_at: int
    without_choice: int
    counts: Mapping[TakeoverClass, int]
    avoidable: int
    harmful: int
    lines: tuple[TakeoverLine, ...]

    @property
    def precision(self) -> tuple[int, int]:
        """See ``evaluation.takeovers.precision_of``."""
        return precision_of(self.counts)

    @property
    def recall(self) -> tuple[int, int]:
        """See ``evaluation.takeovers.recall_of``."""
        return recall_of(self.counts, self.avoidable)


def look_back(
    db: str | Path | None,
    campaign: str | None = None,
    *,
    most: int | None = None,
    report: Report | None = None,
) -> TakeoverMatrix:
    """Fork runs of a campaign with the other decision, and say what each decision was.

    A run with a takeover is forked without it, from its tick on. A run without is forked with a
    takeover by the first other channel in order of priority, from its fault on or from the start.
    What was found before is kept, and not executed again.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        campaign: Id, its beginning or its number; None for the newest.
        most: Most runs to look at; None for all.
        report: Called with how many runs are looked at, those that were known not counted.

    Raises:
        InputError: There is no such campaign.
        IntegrityError: A run does not come out as it was recorded.
    """
    with Repository.open(db, create=False) as repository:
        info = repository.find_campaign(campaign)
        executed = repository.progress(info.id).executed
        chosen = repository.hindsight.executed(info.id, most)
        known = {line.run: line for line in repository.hindsight.takeovers(info.id)}
        lines = [known[run.result_digest] for run in chosen if run.result_digest in known]
        others = [run for run in chosen if run.result_digest not in known]
        counter = Counter("forks", len(others), report)
        without_choice = 0
        for part in recalled_parts(repository, others):
            wanted = [(run, override) for run in part if (override := _other(run)) is not None]
            without_choice += len(part) - len(wanted)
            counter.add(len(part) - len(wanted))
            origins = {run.run.result_digest: run for run, _ in wanted}
            for batch in make_forks(repository, wanted):
                made = [_line(origins[forked.origin.run], forked) for forked in batch]
                # Batch by batch: whoever interrupts and asks again goes on from there.
                repository.hindsight.save_takeovers(made)
                lines += made
                counter.add(len(made))
    counted = collections.Counter(line.class_ for line in lines)
    return TakeoverMatrix(
        campaign=info.id,
        executed=executed,
        looked_at=len(lines),
        without_choice=without_choice,
        counts={name: counted[name] for name in TAKEOVER_CLASSES},
        avoidable=sum(line.class_ == "missed" and line.fork_violation_s is None for line in lines),
        harmful=sum(line.class_ == "spurious" and line.violation_s is not None for line in lines),
        lines=tuple(sorted(lines, key=lambda line: line.run)),
    )


def takeover_tick(recalled: Recalled) -> int | None:
    """Find the tick at which another channel than the default first acts in a stored run."""
    switch = recalled.case.architecture.switch
    others = set(recalled.case.architecture.channels) - {switch.default}
    return _tick_of(recalled, "switch", others)


def _tick_of(recalled: Recalled, kind: str, subjects: set[str]) -> int | None:
    for event in recalled.stored.events:
        if event.kind == kind and event.subject in subjects:
            return round(event.time_s / recalled.case.step)
    return None


def _other(recalled: Recalled) -> AuthorityOverride | None:
    """Give the other decision; None where there is none to take."""
    switch = recalled.case.architecture.switch
    tick = takeover_tick(recalled)
    if tick is not None:
        return AuthorityOverride(tick, switch.default)
    others = [name for name in switch.priority if name != switch.default]
    if not others:
        return None
    faults = {fault.id for fault in recalled.case.faults}
    onset = _tick_of(recalled, "fault", faults)
    return AuthorityOverride(onset or 0, others[0])


def _line(recalled: Recalled, forked: Forked) -> TakeoverLine:
    tick = takeover_tick(recalled)
    violation, fork_violation = forked.origin.violation_s, forked.fork.violation_s
    found = Takeover(tick is not None, violation is not None, fork_violation is not None)
    return TakeoverLine(
        run=forked.origin.run,
        fork=forked.fork.run,
        scenario=recalled.run.scenario,
        architecture=recalled.run.architecture,
        fault_entry=recalled.case.fault_entry,
        class_=classify_takeover(found),
        takeover_s=None if tick is None else tick_time(tick, recalled.case.step),
        violation_s=violation,
        fork_violation_s=fork_violation,
    )
