"""Timelines of faults: execute runs beside their twins and read FDTI, FRTI, FHTI and FTTI."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from adeye.campaign.forks import campaign_of, require_as_recorded, sampled
from adeye.campaign.reproduce import recall
from adeye.errors import InputError
from adeye.evaluation.statistics import wilson
from adeye.evaluation.timeline import (
    CLASSES,
    InjectionClass,
    Timeline,
    classify_injection,
    timeline,
    violation_s,
)
from adeye.store.repository import Repository
from adeye.sweep.case import AuthorityOverride
from adeye.sweep.groups import NO_FAULT
from adeye.sweep.structure import structure_key

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from adeye.campaign.reproduce import Recalled
    from adeye.evaluation.statistics import Interval
    from adeye.sweep.case import TestCase

MOST_TOGETHER: Final = 128
"""Runs that are executed together."""
CONFIDENCE: Final = 0.95
_DETECTED: Final = ("detected_in_time", "detected_late")
_RANDOM: Final = "random"


@dataclass(frozen=True)
class Injection:
    """What became of the faults of one run.

    Attributes:
        run: Result digest.
        scenario: Id in the ODD.
        architecture: Id.
        fault_entry: A fault's id, or ids joined by ``+``.
        times: Of the run.
        without_mechanism: Of its twin in which the default channel acts throughout.
        fault_free_violation_s: When that twin violates without faults too [s]: then the FTTI is not
            the fault's doing; None if it does not.
        class_: What became of the faults.
    """

    run: str
    scenario: str
    architecture: str
    fault_entry: str
    times: Timeline
    without_mechanism: Timeline
    fault_free_violation_s: float | None
    class_: InjectionClass

    @property
    def ftti_s(self) -> float | None:
        """Measured fault-tolerant time interval [s]; None where nothing is violated without."""
        return self.without_mechanism.fault_to_violation_s

    @property
    def margin_s(self) -> float | None:
        """FTTI minus FHTI [s]; None where one of them is not there."""
        if self.ftti_s is None or self.times.fhti_s is None:
            return None
        return self.ftti_s - self.times.fhti_s


@dataclass(frozen=True)
class InjectionCount:
    """Injections of one fault entry in one scenario and architecture.

    Attributes:
        scenario: Id in the ODD.
        architecture: Id.
        fault_entry: A fault's id, or ids joined by ``+``.
        counts: Runs by class.
        detected: Detected ones of the activated.
        activated: All but those that were not activated.
        coverage: Interval of the share that is detected; None unless the points of the scenario
            are a random sample.
        least_ftti_s: The least FTTI that was measured [s]; None where none was.
        most_fhti_s: The largest FHTI [s]; None where none was.
    """

    scenario: str
    architecture: str
    fault_entry: str
    counts: Mapping[InjectionClass, int]
    detected: int
    activated: int
    coverage: Interval | None
    least_ftti_s: float | None
    most_fhti_s: float | None


@dataclass(frozen=True)
class InjectionTable:
    """Injections of a campaign.

    Attributes:
        campaign: Id.
        looked_at: Runs with a fault entry that were executed again.
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
        odd = repository.content("odd", info.odd_digest)
        recalled = [recall(repository, run) for run in sampled(repository, info.id, most)]
    designs = {
        str(use.get("as") or use["use"]): str(use["sweep"]["design"])
        for use in odd["odd"]["scenarios"]
    }
    found = sorted(
        injections([item for item in recalled if item.case.fault_entry != NO_FAULT]),
        key=lambda item: item.run,
    )
    groups: dict[tuple[str, str, str], list[Injection]] = defaultdict(list)
    for item in found:
        groups[item.scenario, item.fault_entry, item.architecture].append(item)
    rows = [
        _count(group, is_sample=designs.get(key[0]) == _RANDOM)
        for key, group in sorted(groups.items())
    ]
    return InjectionTable(info.id, len(found), tuple(rows), tuple(found))


def _count(group: Sequence[Injection], *, is_sample: bool) -> InjectionCount:
    counted = Counter(item.class_ for item in group)
    activated = len(group) - counted["not_activated"]
    detected = sum(counted[name] for name in _DETECTED)
    interval = wilson(detected, activated, CONFIDENCE) if is_sample and activated else None
    measured = [item.ftti_s for item in group if item.ftti_s is not None]
    handled = [item.times.fhti_s for item in group if item.times.fhti_s is not None]
    return InjectionCount(
        scenario=group[0].scenario,
        architecture=group[0].architecture,
        fault_entry=group[0].fault_entry,
        counts={name: counted[name] for name in CLASSES},
        detected=detected,
        activated=activated,
        coverage=interval,
        least_ftti_s=min(measured, default=None),
        most_fhti_s=max(handled, default=None),
    )


def injections(recalled: Sequence[Recalled]) -> Iterator[Injection]:
    """Execute runs with faults beside their twins and read their timelines.

    Raises:
        IntegrityError: A run does not come out as it was recorded.
    """
    for part in _batches(recalled):
        first, count = part[0], len(part)
        cases = [item.case for item in part]
        faulted = first.execute([*cases, *map(_without_mechanism, cases)])
        twins = first.execute([*map(_fault_free, cases), *map(_both, cases)])
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
