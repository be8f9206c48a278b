"""Injected faults counted: what became of each, by scenario, fault entry and architecture."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from adeye.evaluation.statistics import wilson
from adeye.evaluation.timeline import CLASSES, InjectionClass, Timeline

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from adeye.evaluation.statistics import Interval

CONFIDENCE: Final = 0.95
_DETECTED: Final = ("detected_in_time", "detected_late")
_FROM_WORST: Final = (
    "undetected_violation",
    "detected_late",
    "undetected_no_violation",
    "detected_in_time",
    "masked",
    "not_activated",
)


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
        twins: Trace digests of the fault-free twin, of the one in which the default channel acts
            throughout, and of the one that is both.
    """

    run: str
    scenario: str
    architecture: str
    fault_entry: str
    times: Timeline
    without_mechanism: Timeline
    fault_free_violation_s: float | None
    class_: InjectionClass
    twins: tuple[str, ...] = ()

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


def grouped(found: Iterable[Injection]) -> list[list[Injection]]:
    """Group injections by scenario, fault entry and architecture, in that order."""
    groups: dict[tuple[str, str, str], list[Injection]] = defaultdict(list)
    for item in found:
        groups[item.scenario, item.fault_entry, item.architecture].append(item)
    return [group for _, group in sorted(groups.items())]


def tabulate(
    found: Iterable[Injection], is_sample: Callable[[str], bool]
) -> tuple[InjectionCount, ...]:
    """Count injections by scenario, fault entry and architecture.

    Args:
        found: The injections.
        is_sample: Tells of a scenario whether its points are a random sample.
    """
    return tuple(
        count_injections(group, is_sample=is_sample(group[0].scenario)) for group in grouped(found)
    )


def count_injections(group: Sequence[Injection], *, is_sample: bool) -> InjectionCount:
    """Count the injections of one group.

    Args:
        group: All of one fault entry, scenario and architecture, at least one.
        is_sample: Whether their points are a random sample.
    """
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


def worst_of(group: Sequence[Injection]) -> Injection:
    """Choose the injection that is worst: by class, least margin, largest FHTI, then run."""

    def badness(item: Injection) -> tuple[float, float, float, str]:
        margin = math.inf if item.margin_s is None else item.margin_s
        fhti = item.times.fhti_s
        slowest = math.inf if fhti is None else -fhti
        return _FROM_WORST.index(item.class_), margin, slowest, item.run

    return min(group, key=badness)
