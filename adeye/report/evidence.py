"""What a report says beyond its verdicts: bounds, coverage of the ODD, uncertainty of the step.

Each comes from where its command has it (``confidence``, ``coverage``, ``uncertainty``), so that
page and command cannot differ.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final, cast

from adeye.judge.uncertainty import Difference
from adeye.report.claims import claims_of
from adeye.report.model import evidence as model
from adeye.store.read.bulk import coverage_of_runs, declared_attributes, executed_runs
from adeye.store.records import CampaignInfo
from adeye.store.repository import Repository
from adeye.store.write.half_steps import UncertaintyRecord
from adeye.sweep.coverage import Bin, Combination, bins_of

# --- What a report says beyond its verdicts: bounds, coverage of the ODD, uncertainty of the step -

MAX_COUNTED: Final = 100_000
"""Test cases up to which a report counts what they cover (1 s, and memory for each)."""
MAX_PAIRS: Final = 200
"""Uncovered pairs that a report lists."""


def evidence_of(
    repository: Repository,
    campaign: CampaignInfo,
    odd: Mapping[str, Any],
    command: Callable[[str], str],
) -> dict[str, Any]:
    """Return the parts of a report by their names in it.

    Args:
        repository: The database.
        campaign: The campaign.
        odd: Stored content of the ODD and everything that it names.
        command: Makes a command line be about this database.
    """
    short = campaign.id[:10]
    records = repository.hindsight.half_steps.uncertainty(campaign.id)
    return {
        "confidence": claims_of(repository, campaign),
        "confidence_command": command(f"adeye confidence {short}"),
        "odd_coverage": odd_coverage_of(
            repository, campaign, odd, command(f"adeye coverage {short} --json")
        ),
        "step_uncertainty": step_uncertainty_of(
            odd["odd"], records, command(f"adeye uncertainty {short} --json")
        ),
    }


def odd_coverage_of(
    repository: Repository, campaign: CampaignInfo, stored: Mapping[str, Any], command: str
) -> model.OddCoverage:
    """Count what a campaign covers of its ODD, attribute by attribute and in pairs.

    Args:
        repository: The database.
        campaign: The campaign.
        stored: Content of the ODD and everything that it names.
        command: Lists everything.
    """
    exclusions = tuple(exclusions_of(stored["odd"]))
    if campaign.planned > MAX_COUNTED:
        return model.OddCoverage(
            planned=campaign.planned,
            counted=0,
            exclusions=exclusions,
            refusal=f"Not counted here: more than {MAX_COUNTED:,} test cases.",
            command=command,
        )
    runs = executed_runs(repository.location, campaign.id)
    found = coverage_of_runs(runs, stored, 2)
    bins = bins_of(*declared_attributes(stored["odd"]))
    pairs = [item for item in found.combinations if len(item.attributes) == 2]
    uncovered = [
        model.UncoveredPair(
            attributes=cast("tuple[str, str]", item.attributes),
            bins=cast("tuple[str, str]", labels),
        )
        for item in pairs
        for labels in item.uncovered
    ]
    return model.OddCoverage(
        planned=runs.planned,
        counted=found.situations,
        without_result=runs.without_result,
        not_judged=runs.not_judged,
        outside_odd=runs.outside_odd,
        in_no_bin=found.outside,
        attributes=tuple(
            model.AttributeCoverage(
                attribute=item.attributes[0], bins=tuple(_bins(item, bins[item.attributes[0]]))
            )
            for item in found.combinations
            if len(item.attributes) == 1
        ),
        pairs=sum(item.total for item in pairs),
        feasible_pairs=sum(item.feasible for item in pairs),
        covered_pairs=sum(item.covered for item in pairs),
        uncovered_pairs=tuple(uncovered[:MAX_PAIRS]),
        exclusions=exclusions,
        command=command,
    )


def _bins(found: Combination, bins: Sequence[Bin]) -> Iterator[model.BinCoverage]:
    """Put the bins of one attribute back into their order."""
    counts = {labels[0]: count for labels, count in found.counts}
    impossible = {labels[0] for labels in found.impossible}
    for item in bins:
        if item.label in counts:
            yield model.BinCoverage(
                label=item.label, state="covered", test_cases=counts[item.label]
            )
        elif item.label in impossible:
            yield model.BinCoverage(label=item.label, state="impossible", test_cases=0)
        else:
            yield model.BinCoverage(label=item.label, state="uncovered", test_cases=0)


def exclusions_of(odd: Mapping[str, Any]) -> Iterator[model.Exclusion]:
    """List what relations of a sweep leave out, as they stand in the ODD's own file."""
    for use in odd["scenarios"]:
        relations = tuple(str(text) for text in use["sweep"]["where"])
        if relations:
            yield model.Exclusion(scenario=use.get("as") or use["use"], relations=relations)


def step_uncertainty_of(
    odd: Mapping[str, Any], records: Sequence[UncertaintyRecord], command: str
) -> model.StepUncertainty:
    """Return what halving the step changes, margins first.

    Args:
        odd: Stored content of the ODD's own file.
        records: What is stored of the campaign.
        command: Lists everything.
    """
    asked = odd.get("uncertainty")
    lines = [
        model.StepLine.of(
            item.difference,
            scenario=item.scenario,
            architecture=item.architecture,
            changes=dict(item.difference.changes),
        )
        for item in records
    ]
    return model.StepUncertainty(
        step_s=float(odd["step"]),
        situations=None if asked is None else int(asked["situations"]),
        lines=tuple(sorted(lines, key=lambda line: line.kind != "fsr")),
        command=command,
    )


# --- What a report says of the step: how far its halving moves margins, and what that means -------


def step_statements(found: Sequence[Difference]) -> tuple[str, ...]:
    """Return what halving the step changes in the margins; nothing where nobody asked.

    Args:
        found: Of every scenario and architecture; those of metrics are left out.
    """
    margins = [item for item in found if item.kind == "fsr"]
    if not margins:
        return ()
    least = [item for item in margins if item.uncertainty is not None]
    worst: dict[tuple[str, str], float] = {}
    for item in least:
        key = item.name, item.unit
        worst[key] = max(worst.get(key, 0.0), item.uncertainty or 0.0)
    largest = ", ".join(
        f"{name} {value:.3g} {unit if unit != '1' else ''}".rstrip()
        for (name, unit), value in sorted(worst.items())
    )
    differing = sum(item.differing for item in margins)
    return (
        "Numeric uncertainty: the 95th percentile of what half the step changes in a margin; a "
        "margin that holds by less is INCONCLUSIVE. Known for "
        f"{len(least)} of {len(margins)} margins of an FSR in a scenario and architecture"
        + (f", at most {largest}" if largest else "")
        + f". The others have too few pairs with two values and are judged without. {differing} "
        "verdicts of the sample change with the step; `adeye uncertainty` lists all.",
    )
