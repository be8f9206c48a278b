"""Which runs are executed with half the step, too, and which verdicts they are for."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from itertools import groupby, islice
from typing import TYPE_CHECKING

from adeye.errors import SpecError
from adeye.evaluation.uncertainty import judged_digest
from adeye.sweep.clock import check_rates, check_times
from adeye.sweep.groups import NO_FAULT

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.evaluation.requirements import CheckedRequirement
    from adeye.spec.load import OddFiles
    from adeye.store.rows import EngineKey
    from adeye.sweep.expand import Expansion


@dataclass(frozen=True)
class Sample:
    """The runs of one scenario and architecture that are executed with half the step too.

    Attributes:
        scenario: Id in the ODD.
        architecture: Id.
        ordinals: Of the test cases, in the order of their situations' digests.
        results: Result digests of the test cases.
    """

    scenario: str
    architecture: str
    ordinals: tuple[int, ...]
    results: tuple[str, ...]


def choose(
    expansion: Expansion, engines: Mapping[str, EngineKey], situations: int
) -> tuple[Sample, ...]:
    """Choose the sample of each scenario and architecture.

    A situation is in it without a fault and with one of its fault entries, as far as it has them.

    Args:
        expansion: The test cases.
        engines: Engine by architecture id.
        situations: How many are chosen, or all if there are fewer.
    """
    found: dict[tuple[str, str], list[tuple[str, bool, str, int]]] = defaultdict(list)
    for section in expansion.sections:
        has_fault = section.group.entry != NO_FAULT
        for columns in expansion.columns(section.first, section.end):
            key = columns.shared.scenario_id, columns.shared.architecture.architecture
            ordinals = range(columns.first, columns.first + len(columns))
            found[key] += [
                (situation, has_fault, case, ordinal)
                for situation, case, ordinal in zip(
                    columns.situation_digest, columns.digest, ordinals, strict=True
                )
            ]
    samples: list[Sample] = []
    for (scenario, architecture), cases in found.items():
        # Of one situation there are as many test cases as fault entries, times what the sweep
        # varies in an architecture.
        alike = groupby(sorted(cases), key=lambda item: item[0])
        several = (list(items) for _, items in islice(alike, situations))
        chosen = [next(kind) for items in several for _, kind in groupby(items, lambda at: at[1])]
        results = engines[architecture].result_digests([case for *_, case, _ in chosen])
        of_plan = tuple(ordinal for *_, ordinal in chosen)
        samples.append(Sample(scenario, architecture, of_plan, tuple(results)))
    return tuple(samples)


def check_half_step(files: OddFiles) -> None:
    """Refuse an ODD whose clock cannot tick twice as fast.

    Raises:
        SpecError: A time has too many ticks then.
    """
    half = files.odd.spec.step / 2.0
    try:
        for architecture in files.architectures.values():
            check_rates(architecture.spec, half)
        for scenario in files.scenarios.values():
            check_times(scenario.spec, half)
    except SpecError as error:
        raise SpecError(
            f"uncertainty asks for runs with half the step, {half:g} s; {error.message}",
            where=files.odd.locate(("uncertainty",)),
            remedy=error.remedy,
        ) from error


def judged_with(
    requirement: CheckedRequirement, samples: Sequence[Sample]
) -> dict[tuple[str, str], str]:
    """Give the digest that verdicts with the uncertainty have, by architecture and scenario."""
    return {
        (sample.architecture, sample.scenario): judged_digest(requirement.digest, sample.results)
        for sample in samples
        if concerns(requirement, sample)
    }


def concerns(requirement: CheckedRequirement, sample: Sample) -> bool:
    """Whether an FSR is judged on the scenario and architecture of a sample."""
    named = requirement.requirement.scenarios
    is_applicable = sample.architecture not in requirement.not_applicable
    return is_applicable and (not named or sample.scenario in named)
