"""Execute forks: a stored run again with another authority from a tick on, held against it."""

from __future__ import annotations

import collections
from dataclasses import astuple, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from adeye.campaign import replay
from adeye.campaign.parts import Unchanged
from adeye.campaign.replay import Recalled, Report
from adeye.campaign.work import describe
from adeye.errors import InputError, IntegrityError, UsageError
from adeye.judge import preventability
from adeye.judge.timeline import violation_s
from adeye.judge.uncertainty import verdict_with
from adeye.kernel.relation import tick_time
from adeye.simulate.world.clock import ticks
from adeye.store.read.totals import refused_in_words
from adeye.store.records import ForkRecord
from adeye.store.repository import Repository
from adeye.store.write.studies import TakeoverLine
from adeye.sweep.case import AuthorityOverride
from adeye.trace import COLUMNS, DRAWN, LINK_TICKS, Trace
from adeye.units import Dimension, parse_quantity

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from adeye.judge.evaluate import Evaluation

# --- Execute forks: a stored run again with another authority from a tick on, held against it -----


@dataclass(frozen=True)
class Side:
    """What came of a run or of its fork.

    Attributes:
        run: Result digest.
        trace_digest: Digest of its trace.
        outcome: What happened.
        end_reason: ``contact``, ``goal``, ``horizon`` or ``road_end``.
        duration_s: Simulated time [s].
        violation_s: Time of its first contact or of leaving the road [s]; None without.
        verdicts: By FSR.
    """

    run: str
    trace_digest: str
    outcome: str
    end_reason: str
    duration_s: float
    violation_s: float | None
    verdicts: Mapping[str, str]


@dataclass(frozen=True)
class Forked:
    """A fork and the run that it is a fork of.

    Attributes:
        origin: The run, executed again.
        fork: The fork.
        from_tick: First tick with the other authority.
        from_time_s: Its time [s].
        authority: Channel that acts from there on.
        links: Links of the recorded digest chain that cover ticks before it; None where no chain
            was recorded.
        is_same: Whether the fork is the run itself, bit for bit.
        failed: Which channels failed in the fork and not in the run; empty for none.
    """

    origin: Side
    fork: Side
    from_tick: int
    from_time_s: float
    authority: str
    links: int | None
    is_same: bool
    failed: str


def fork_run(
    db: str | Path | None,
    run: str,
    *,
    start: str,
    authority: str,
    report: Report | None = None,
) -> Forked:
    """Execute a stored run again with another authority from a tick on, and keep the fork.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        run: Beginning of its result digest.
        start: Tick, or a time with its unit.
        authority: Channel that acts from there on.
        report: Called with how many of the two runs are executed.

    Raises:
        InputError: The run has no such channel or tick, or is a fork itself.
        IntegrityError: The run does not come out as it was recorded, or the fork differs from it
            before the tick.
    """
    with Repository.open(db, create=False) as repository:
        recalled = replay.recall(repository, repository.find_run(run))
        override = AuthorityOverride(_tick(start, recalled.case.step), authority)
        counter = replay.Counter("execute", 2, report)
        (forked,) = next(iter(make_forks(repository, [(recalled, override)])))
        counter.add(2)
        return forked


def _tick(text: str, step: float) -> int:
    if text.isascii() and text.isdigit() and len(text) < 10:
        return int(text)
    time = parse_quantity(text, Dimension.TIME)
    if time < 0.0:
        raise UsageError(f"--from: {text} is negative", remedy="A run begins at 0 s.")
    return ticks(time, step, "--from")


def make_forks(
    repository: Repository, wanted: Sequence[tuple[Recalled, AuthorityOverride]]
) -> Iterator[list[Forked]]:
    """Execute forks beside the runs that they are forks of, compare them, and save the forks.

    Args:
        repository: The database.
        wanted: Runs, and what is to be overridden in each.

    Returns:
        The forks, batch by batch; those of a batch are of one structure.

    Raises:
        InputError: A run has no such channel or tick, or is a fork itself.
        IntegrityError: What executed a run is not here, it does not come out as it was recorded, or
            a fork differs from it before its tick.
    """
    for recalled, override in wanted:
        _check(recalled, override)
    code = replay.require_same_code(recalled for recalled, _ in wanted)
    for part in replay.together(wanted, lambda item: item[0]):
        yield list(_fork_together(repository, part, code))


def _check(recalled: Recalled, override: AuthorityOverride) -> None:
    run, case = recalled.run, recalled.case
    name = run.result_digest[:12]
    if case.override is not None:
        raise InputError(
            f"run {name} is a fork itself", remedy="Name the run that it is a fork of."
        )
    if override.channel not in case.architecture.channels:
        raise InputError(
            f"authority {override.channel!r}: architecture {run.architecture} has no such channel",
            remedy=f"It has: {', '.join(case.architecture.channels)}.",
        )
    last = int(recalled.stored.row["trace_rows"]) - 2
    if override.from_tick > last:
        raise InputError(
            f"tick {override.from_tick} is behind the end of run {name}",
            remedy=f"Its last decision is that of tick {last}, at "
            f"{tick_time(last, case.step):g} s.",
        )


def _fork_together(
    repository: Repository,
    wanted: Sequence[tuple[Recalled, AuthorityOverride]],
    code: Unchanged,
) -> Iterator[Forked]:
    first, count = wanted[0][0], len(wanted)
    cases = [recalled.case for recalled, _ in wanted]
    forks = [replace(recalled.case, override=override) for recalled, override in wanted]
    trace = first.work.drive([*cases, *forks])
    for run, (recalled, override) in enumerate(wanted):
        replay.require_as_recorded(recalled, trace, run)
        _require_same_prefix(recalled, trace, (run, count + run), override.from_tick)
    evaluation = first.evaluate(trace, [*cases, *forks])
    engines = [engine for recalled, _ in wanted for engine in recalled.work.engines.values()]
    block = describe(trace, evaluation, [*engines, *engines]).take(np.arange(count, 2 * count))
    records = [
        ForkRecord(digest, case.digest, recalled.run.result_digest, *astuple(override))
        for digest, case, (recalled, override) in zip(
            block.result_digests, forks, wanted, strict=True
        )
    ]
    code.check()
    repository.hindsight.save_forks(records, block)
    for run, (recalled, override) in enumerate(wanted):
        origin = _side(recalled.run.result_digest, recalled, trace, evaluation, run)
        fork = _side(records[run].result_digest, recalled, trace, evaluation, count + run)
        links = recalled.stored.links
        yield Forked(
            origin=origin,
            fork=fork,
            from_tick=override.from_tick,
            from_time_s=tick_time(override.from_tick, recalled.case.step),
            authority=override.channel,
            links=None if links is None else min(len(links), override.from_tick // LINK_TICKS),
            is_same=origin.trace_digest == fork.trace_digest,
            failed=replay.failed_beside(
                recalled.run, trace.channel_events[run], trace.channel_events[count + run]
            ),
        )


def _require_same_prefix(recalled: Recalled, trace: Trace, runs: tuple[int, int], end: int) -> None:
    """Refuse a fork that differs from its run before the tick at which it may."""
    origin, fork = runs
    name = recalled.run.result_digest[:12]
    for column in COLUMNS:
        values = trace[column]
        if column not in DRAWN and values[origin, :end].tobytes() != values[fork, :end].tobytes():
            raise IntegrityError(
                f"the fork of run {name} differs from it before tick {end}, in {column!r}. "
                "Something in it is not deterministic, or depends on the runs beside it."
            )
    recorded = (recalled.stored.links or ())[: end // LINK_TICKS]
    if tuple(recorded) != trace.chains()[fork][: len(recorded)]:
        raise IntegrityError(
            f"the fork of run {name} does not begin with the recorded digest chain"
        )


def _side(digest: str, recalled: Recalled, trace: Trace, evaluation: Evaluation, run: int) -> Side:
    outcome = evaluation.outcomes[run]
    verdicts = {item.fsr_id: item.verdict for item in evaluation.judgements[run]}
    for item in evaluation.judgements[run]:
        # A fork is of the scenario and architecture of its run: the step is worth as much in it.
        if item.fsr_id in recalled.uncertainty:
            uncertainty = recalled.uncertainty[item.fsr_id]
            verdicts[item.fsr_id] = verdict_with(item.verdict, item.margin, item.unit, uncertainty)
    return Side(
        run=digest,
        trace_digest=trace.digests()[run],
        outcome=outcome.outcome.value,
        end_reason=outcome.end_reason,
        duration_s=float(trace.time[int(trace.length[run]) - 1]),
        violation_s=violation_s(trace, run),
        verdicts={name: verdict.value for name, verdict in verdicts.items()},
    )


# --- The takeovers of a campaign in hindsight: was each needed, done, late, or missed? ------------


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
        failed: Which parts failed, so that what is said rests on that, or the gate refuses it.
    """

    campaign: str
    executed: int
    looked_at: int
    without_choice: int
    counts: Mapping[preventability.TakeoverClass, int]
    avoidable: int
    harmful: int
    lines: tuple[TakeoverLine, ...]
    failed: tuple[str, ...]

    @property
    def precision(self) -> tuple[int, int]:
        """See ``judge.preventability.precision_of``."""
        return preventability.precision_of(self.counts)

    @property
    def recall(self) -> tuple[int, int]:
        """See ``judge.preventability.recall_of``."""
        return preventability.recall_of(self.counts, self.avoidable)


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
        repository.require_sound(info.id)
        executed = repository.progress(info.id).executed
        chosen = repository.hindsight.executed(info.id, most)
        known = {line.run: line for line in repository.hindsight.takeovers(info.id)}
        lines = [known[run.result_digest] for run in chosen if run.result_digest in known]
        others = [run for run in chosen if run.result_digest not in known]
        counter = replay.Counter("forks", len(others), report)
        without_choice, failing = 0, list[str]()
        for part in replay.recalled_parts(repository, others):
            wanted = [(run, override) for run in part if (override := _other(run)) is not None]
            without_choice += len(part) - len(wanted)
            counter.add(len(part) - len(wanted))
            origins = {run.run.result_digest: run for run, _ in wanted}
            for batch in make_forks(repository, wanted):
                made = [(_line(origins[item.origin.run], item), item) for item in batch]
                # Batch by batch: whoever interrupts and asks again goes on from there. Of a fork
                # in which a channel failed nothing is kept: a report would not say so.
                repository.hindsight.save_takeovers(
                    [line for line, item in made if not item.failed]
                )
                lines += (line for line, _ in made)
                failing += (item.failed for _, item in made)
                counter.add(len(made))
        failed = *replay.failures_beside(failing, "the fork"), *refused_in_words(repository, info)
    counted = collections.Counter(line.class_ for line in lines)
    return TakeoverMatrix(
        campaign=info.id,
        executed=executed,
        looked_at=len(lines),
        without_choice=without_choice,
        counts={name: counted[name] for name in preventability.TAKEOVER_CLASSES},
        avoidable=sum(line.class_ == "missed" and line.fork_violation_s is None for line in lines),
        harmful=sum(line.class_ == "spurious" and line.violation_s is not None for line in lines),
        lines=tuple(sorted(lines, key=lambda line: line.run)),
        failed=failed,
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
    found = preventability.Takeover(
        tick is not None, violation is not None, fork_violation is not None
    )
    return TakeoverLine(
        run=forked.origin.run,
        fork=forked.fork.run,
        scenario=recalled.run.scenario,
        architecture=recalled.run.architecture,
        fault_entry=recalled.case.fault_entry,
        class_=preventability.classify_takeover(found),
        takeover_s=None if tick is None else tick_time(tick, recalled.case.step),
        violation_s=violation,
        fork_violation_s=fork_violation,
    )
