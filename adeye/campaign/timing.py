"""Timelines of faults: execute runs beside their twins and read FDTI, FRTI, FHTI and FTTI."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from adeye.campaign.forks import campaign_of, require_as_recorded, sampled
from adeye.campaign.reproduce import recall
from adeye.errors import InputError
from adeye.evaluation.injections import Injection, InjectionCount, tabulate
from adeye.evaluation.timeline import classify_injection, timeline, violation_s
from adeye.store.repository import Repository
from adeye.sweep.case import AuthorityOverride
from adeye.sweep.groups import NO_FAULT
from adeye.sweep.structure import structure_key

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from adeye.campaign.reproduce import Recalled
    from adeye.sweep.case import TestCase

MOST_TOGETHER: Final = 128
"""Runs that are executed together."""
_RANDOM: Final = "random"


@dataclass(frozen=True)
class InjectionTable:
    """Injections of a campaign.

    Attributes:
        campaign: Id.
        looked_at: Runs with a fault entry, executed beside their twins now or before.
        rows: Counts by fault entry, scenario and architecture.
        injections: The runs.
    """

    campaign: str
    looked_at: int
    rows: tuple[InjectionCount, ...]
    injections: tuple[Injection, ...]


def run_timeline(db: str | Path | None, run: str) -> Injection:
    """Read the timeline of a stored run.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        run: Beginning of its result digest.

    Raises:
        InputError: It has no fault entry.
        IntegrityError: It does not come out as it was recorded.
    """
    with Repository.open(db, create=False) as repository:
        recalled = recall(repository, repository.find_run(run))
    if not recalled.case.faults:
        raise InputError(
            f"run {recalled.run.result_digest[:12]} has no fault",
            remedy="Name a run whose fault entry is not 'none'.",
        )
    return next(iter(injections([recalled])))


def campaign_injections(
    db: str | Path | None, campaign: str | None = None, *, most: int | None = None
) -> InjectionTable:
    """Read the timelines of the runs with faults of a campaign, and count their classes.

    What was found before is kept, and not executed again.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        campaign: Id, its beginning or its number; None for the newest.
        most: Most runs of the campaign to look at, those without faults among them; None for all.

    Raises:
        InputError: There is no such campaign.
        IntegrityError: A run does not come out as it was recorded.
    """
    with Repository.open(db, create=False) as repository:
        info = campaign_of(repository, campaign)
        designs = _designs(repository.content("odd", info.odd_digest))
        known = {item.run: item for item in repository.hindsight.injections(info.id)}
        chosen = sampled(repository, info.id, most)
        found = [known[run.result_digest] for run in chosen if run.result_digest in known]
        others = [recall(repository, run) for run in chosen if run.result_digest not in known]
        faulty = [item for item in others if item.case.fault_entry != NO_FAULT]
        for part in _batches(faulty):
            made = list(_injections(part))
            # Batch by batch: whoever interrupts and asks again goes on from there.
            repository.hindsight.save_injections(made)
            found += made
    found.sort(key=lambda item: item.run)
    rows = tabulate(found, lambda scenario: designs.get(scenario) == _RANDOM)
    return InjectionTable(info.id, len(found), rows, tuple(found))


def _designs(odd: Mapping[str, Any]) -> dict[str, str]:
    return {
        str(use.get("as") or use["use"]): str(use["sweep"]["design"])
        for use in odd["odd"]["scenarios"]
    }


def injections(recalled: Sequence[Recalled]) -> Iterator[Injection]:
    """Execute runs with faults beside their twins and read their timelines.

    Raises:
        IntegrityError: A run does not come out as it was recorded.
    """
    for part in _batches(recalled):
        yield from _injections(part)


def _injections(part: Sequence[Recalled]) -> Iterator[Injection]:
    """Execute runs of one structure together with their twins."""
    first, count = part[0], len(part)
    cases = [item.case for item in part]
    faulted = first.execute([*cases, *map(_without_mechanism, cases)])
    twins = first.execute([*map(_fault_free, cases), *map(_both, cases)])
    digests, of_twins = faulted.digests(), twins.digests()
    for run, item in enumerate(part):
        require_as_recorded(item, faulted, run)
        times = timeline(faulted, run, twins, run)
        without = timeline(faulted, count + run, twins, count + run)
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
        )


def _batches(recalled: Iterable[Recalled]) -> Iterator[list[Recalled]]:
    groups: dict[object, list[Recalled]] = defaultdict(list)
    for item in recalled:
        context = (item.folder, item.backend, item.variant)
        groups[structure_key(item.case), context].append(item)
    for group in groups.values():
        for first in range(0, len(group), MOST_TOGETHER):
            yield group[first : first + MOST_TOGETHER]


def _without_mechanism(case: TestCase) -> TestCase:
    """Let the default channel act throughout: who could take over is not heard."""
    default = case.architecture.switch.default
    return replace(case, override=AuthorityOverride(0, default))


def _fault_free(case: TestCase) -> TestCase:
    return replace(case, faults=(), fault_entry=NO_FAULT)


def _both(case: TestCase) -> TestCase:
    return _fault_free(_without_mechanism(case))
