"""Timelines of faults: execute runs beside their twins and read FDTI, FRTI, FHTI and FTTI."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from adeye.campaign.replay import (
    Counter,
    Recalled,
    Report,
    failed_beside,
    failures_beside,
    recall,
    recalled_parts,
    require_as_recorded,
    require_same_code,
    together,
)
from adeye.errors import InputError
from adeye.judge.timeline import Injection, classify_injection, tabulate, timeline, violation_s
from adeye.signals import NO_FAULT
from adeye.store.read.totals import refused_in_words
from adeye.store.repository import Repository
from adeye.sweep.case import AuthorityOverride, TestCase

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from adeye.judge.timeline import InjectionCount


_RANDOM: Final = "random"
_TWINS: Final = 3
"""Runs that are executed beside a run with a fault: without the fault, without the mechanism, both.
"""


@dataclass(frozen=True)
class InjectionTable:
    """Injections of a campaign.

    Attributes:
        campaign: Id.
        looked_at: Runs with a fault entry, executed beside their twins now or before.
        rows: Counts by fault entry, scenario and architecture.
        injections: The runs.
        failed: Which parts failed, so that what is said rests on that, or the gate refuses it.
    """

    campaign: str
    looked_at: int
    rows: tuple[InjectionCount, ...]
    injections: tuple[Injection, ...]
    failed: tuple[str, ...]


def run_timeline(db: str | Path | None, run: str, report: Report | None = None) -> Injection:
    """Read the timeline of a stored run.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        run: Beginning of its result digest.
        report: Called with how many of the run and its twins are executed.

    Raises:
        InputError: It has no fault entry.
        IntegrityError: What executed it is not here, or it does not come out as it was recorded.
    """
    with Repository.open(db, create=False) as repository:
        recalled = recall(repository, repository.find_run(run))
    if not recalled.case.faults:
        raise InputError(
            f"run {recalled.run.result_digest[:12]} has no fault",
            remedy="Name a run whose fault entry is not 'none'.",
        )
    counter = Counter("execute", 1 + _TWINS, report)
    found = next(_injections([recalled]))
    counter.add(1 + _TWINS)
    return found


def campaign_injections(
    db: str | Path | None,
    campaign: str | None = None,
    *,
    most: int | None = None,
    report: Report | None = None,
) -> InjectionTable:
    """Read the timelines of the runs with faults of a campaign, and count their classes.

    What was found before is kept, and not executed again.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        campaign: Id, its beginning or its number; None for the newest.
        most: Most runs of the campaign to look at, those without faults among them; None for all.
        report: Called with how many runs are looked at, those that were known not counted.

    Raises:
        InputError: There is no such campaign.
        IntegrityError: Results are not as they were written, what executed a run is not here, or
            it does not come out so.
    """
    with Repository.open(db, create=False) as repository:
        info = repository.find_campaign(campaign)
        repository.require_sound(info.id)
        designs = _designs(repository.content("odd", info.odd_digest))
        known = {item.run: item for item in repository.hindsight.injections(info.id)}
        chosen = repository.hindsight.executed(info.id, most, only_faulty=True)
        found = [known[run.result_digest] for run in chosen if run.result_digest in known]
        others = [run for run in chosen if run.result_digest not in known]
        counter = Counter("faults", len(others), report)
        for part in recalled_parts(repository, others):
            for batch in together(part, lambda item: item):
                made = list(_injections(batch))
                # Batch by batch: whoever interrupts and asks again goes on from there. Of what a
                # failed channel has a part in nothing is kept, so that it is told every time.
                repository.hindsight.save_injections([item for item in made if not item.failed])
                found += made
                counter.add(len(batch))
        refused = refused_in_words(repository, info)
    found.sort(key=lambda item: item.run)
    rows = tabulate(found, lambda scenario: designs.get(scenario) == _RANDOM)
    failed = *failures_beside((item.failed for item in found), "a twin"), *refused
    return InjectionTable(info.id, len(found), rows, tuple(found), failed)


def _designs(odd: Mapping[str, Any]) -> dict[str, str]:
    return {
        str(use.get("as") or use["use"]): str(use["sweep"]["design"])
        for use in odd["odd"]["scenarios"]
    }


def _injections(part: Sequence[Recalled]) -> Iterator[Injection]:
    """Execute runs of one structure together with their twins, by the code that executed them."""
    code = require_same_code(part)
    first, count = part[0], len(part)
    cases = [item.case for item in part]
    faulted = first.work.drive([*cases, *map(_without_mechanism, cases)])
    twins = first.work.drive([*map(_fault_free, cases), *map(_both, cases)])
    code.check()
    digests, of_twins = faulted.digests(), twins.digests()
    for run, item in enumerate(part):
        require_as_recorded(item, faulted, run)
        times = timeline(faulted, run, twins, run)
        without = timeline(faulted, count + run, twins, count + run)
        own, *beside = (
            of.channel_events[at] for at in (run, count + run) for of in (faulted, twins)
        )
        yield Injection(
            run=item.run.result_digest,
            scenario=item.run.scenario,
            architecture=item.run.architecture,
            fault_entry=item.case.fault_entry,
            times=times,
            without_mechanism=without,
            fault_free_violation_s=violation_s(twins, count + run),
            class_=classify_injection(times, without.fault_to_violation_s),
            twins=(of_twins[run], digests[count + run], of_twins[count + run]),
            failed=failed_beside(item.run, own, *beside),
        )


def _without_mechanism(case: TestCase) -> TestCase:
    """Let the default channel act throughout: who could take over is not heard."""
    default = case.architecture.switch.default
    return replace(case, override=AuthorityOverride(0, default))


def _fault_free(case: TestCase) -> TestCase:
    return replace(case, faults=(), fault_entry=NO_FAULT)


def _both(case: TestCase) -> TestCase:
    return _fault_free(_without_mechanism(case))
