"""``plan`` and ``signals``: what an ODD asks for and what its requirements may name."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from adeye.cli.options import Backend, Json, OddFile, Variant
from adeye.cli.output import clean, emit, emit_json, emit_table, listed, talk

if TYPE_CHECKING:
    from adeye.campaign.plan import CampaignPlan
    from adeye.sweep.design import Points
    from adeye.sweep.expand import Factor

_SHARED_BY_ALL: Final = "all"
_MOST_LEVELS: Final = 10
_TIMES: Final = " \N{MULTIPLICATION SIGN} "


def plan(
    odd: OddFile, backend: Backend = "batch", variant: Variant = None, json: Json = False
) -> None:
    """Check an ODD and everything it names, and count its test cases. Nothing is executed.

    Test cases are points times fault entries times architectures times replicates. The fault-free
    entry 'none' is always among the fault entries.
    """
    from adeye.campaign.plan import make_plan

    planned = make_plan(odd, backend=backend, variant=variant)
    if json:
        emit_json("plan", _document(planned))
        return
    for notice in planned.notices:
        talk(clean(f"note: {notice}", lines=True))
    _print_factors(planned)
    _print_axes(planned)
    _print_designs(planned)
    emit(f"\n{_total(planned)}")
    if planned.samples:
        twins = sum(len(sample.results) for sample in planned.samples)
        emit(f"{twins:,} of them are executed with half the step too.")
    emit(_engine(planned))
    counts = _shared(planned)
    if any(counts.values()):
        told = listed(f"{name} {count}" for name, count in counts.items() if count)
        emit(clean(f"Shared by channels (adeye dependencies): {told}"))


def _print_factors(planned: CampaignPlan) -> None:
    factors = planned.expansion.factors
    rows = [
        [
            factor.scenario,
            factor.architecture,
            f"{factor.points} of {factor.raw}" if factor.points != factor.raw else factor.points,
            len(factor.fault_entries),
            factor.replicates,
            factor.test_cases,
        ]
        for factor in factors
    ]
    headers = (
        "Scenario",
        "Architecture",
        "Points",
        "Fault entries",
        "Replicates",
        "Test cases",
    )
    ends = {
        number
        for number, (factor, after) in enumerate(pairwise(factors))
        if factor.scenario != after.scenario
    }
    emit_table(headers, rows, right=headers[2:], sections=ends)
    emit("")
    for line in _fault_entries(factors):
        emit(clean(line))


def _fault_entries(factors: Sequence[Factor]) -> list[str]:
    """List each different set of fault entries once, with who has it where not everybody has."""
    having: dict[tuple[str, ...], dict[str, list[str]]] = {}
    everybody: dict[str, list[str]] = {}
    for factor in factors:
        who = having.setdefault(tuple(factor.fault_entries), {})
        who.setdefault(factor.scenario, []).append(factor.architecture)
        everybody.setdefault(factor.scenario, []).append(factor.architecture)
    lines = []
    for entries, scenarios in having.items():
        alike: dict[tuple[str, ...], list[str]] = {}
        for scenario, architectures in scenarios.items():
            is_all = architectures == everybody[scenario]
            alike.setdefault(() if is_all else tuple(architectures), []).append(scenario)
        where = "; ".join(
            listed(names) + (f" with {listed(architectures)}" if architectures else "")
            for architectures, names in alike.items()
        )
        of = f" of {where}" if len(having) > 1 else ""
        count = "1 fault entry" if len(entries) == 1 else f"{len(entries)} fault entries"
        lines.append(f"{count}{of}: {listed(entries)}")
    return lines


def _print_axes(planned: CampaignPlan) -> None:
    rows = [[name, listed(axes)] for name, axes in planned.expansion.axes.items()]
    emit("")
    emit_table(("Scenario", "Swept"), rows)


def _print_designs(planned: CampaignPlan) -> None:
    """Say what each scenario's points are, where the number of points does not say it."""
    from adeye.spec.distribution import Distribution

    lines: list[str] = []
    for use in planned.files.odd.spec.scenarios:
        points, sweep = planned.expansion.points[use.name], use.sweep
        if points.tuples is not None:
            lines.append(_covering(use.name, points))
        elif sweep.design in {"lhs", "sobol"}:
            left = f"; {points.raw - points.count} left out by relations, not replaced"
            lines.append(
                f"{use.name}: {sweep.design}, {points.count} of {points.raw} points"
                f"{left if points.raw > points.count else ''}; no random sample"
            )
        elif any(isinstance(axis, Distribution) for axis in sweep.parameters.values()):
            assert points.drawn is not None
            excluded = points.drawn - points.count
            lines.append(
                f"{use.name}: random, {points.count} independent draws from declared "
                f"distributions; relations excluded {excluded} of {points.drawn}"
            )
        lines += [
            f"{use.name}: relations leave no point with {axis} = {_levels(levels)}"
            for axis, levels in points.absent.items()
        ]
    if lines:
        emit("")
    for line in lines:
        emit(clean(line))


def _levels(levels: Sequence[object]) -> str:
    more = f" and {len(levels) - _MOST_LEVELS} more" if len(levels) > _MOST_LEVELS else ""
    return listed(map(str, levels[:_MOST_LEVELS])) + more


def _covering(scenario: str, points: Points) -> str:
    tuples = points.tuples
    assert tuples is not None
    return (
        f"{scenario}: strength {tuples.strength}, {tuples.feasible} of {tuples.total} tuples "
        f"feasible, all of these covered, {points.count} rows"
    )


def _designs(planned: CampaignPlan) -> dict[str, object]:
    return {
        use.name: {
            "kind": use.sweep.design,
            "rows": points.count,
            "drawn": points.drawn,
            "tuples": points.tuples,
            "absent": points.absent,
        }
        for use in planned.files.odd.spec.scenarios
        for points in (planned.expansion.points[use.name],)
    }


def _total(planned: CampaignPlan) -> str:
    scenarios = sorted({factor.scenario for factor in planned.expansion.factors})
    parts = [_product(planned.expansion.factors, name) for name in scenarios]
    return f"Test cases: {' + '.join(parts)} = {planned.expansion.count:,}".replace(",", " ")


def _product(factors: Sequence[Factor], scenario: str) -> str:
    """Write the product of one scenario, or its sum where architectures differ.

    Points times fault entries times architectures times replicates holds only where every
    architecture has every axis and every fault target.
    """
    mine = [factor for factor in factors if factor.scenario == scenario]
    first = mine[0]
    each = (first.points, len(first.fault_entries), first.replicates)
    product = first.points * len(first.fault_entries) * first.replicates
    alike = all(
        (factor.points, len(factor.fault_entries), factor.replicates) == each
        and factor.test_cases == product
        for factor in mine
    )
    if not alike:
        return str(sum(factor.test_cases for factor in mine))
    sizes = (first.points, len(first.fault_entries), len(mine), first.replicates)
    return _TIMES.join(map(str, sizes))


def _engine(planned: CampaignPlan) -> str:
    engine = planned.engine
    return clean(
        f"Traffic {engine.backend} ({engine.variant}), driver {planned.driver}, "
        f"numerics version {engine.numerics_version}; gate: {listed(planned.files.gate)}"
    )


def _shared(planned: CampaignPlan) -> dict[str, int]:
    """Count what the channels of each architecture share, which may fail them together."""
    from adeye.cli.dependencies import dependencies_of

    return {item.architecture: item.count for item in dependencies_of(planned.files)}


def _document(planned: CampaignPlan) -> dict[str, object]:
    odd = planned.files.odd
    return {
        "odd": odd.spec.odd,
        "path": odd.path,
        "test_cases": planned.expansion.count,
        "factors": planned.expansion.factors,
        "axes": planned.expansion.axes,
        "designs": _designs(planned),
        "gate": planned.files.gate,
        "engine": planned.engine,
        "driver": planned.driver,
        "notices": planned.notices,
        "shared": _shared(planned),
    }


def signals(odd: OddFile, json: Json = False) -> None:
    """List the signals that the FSRs of an ODD may name.

    Scale is how much of the signal counts as one unit of robustness. A signal that only some
    architectures have makes an FSR that names it not applicable to the others.
    """
    from adeye.campaign.plan import make_plan, signal_table

    planned = make_plan(odd)
    found = signal_table(planned)
    if json:
        emit_json("signals", {"odd": planned.files.odd.spec.odd, "signals": found})
        return
    scenarios, architectures = set(planned.files.scenarios), set(planned.files.architectures)
    rows = [
        [
            row.name,
            "" if row.unit == "1" else row.unit,
            row.kind,
            f"{row.scale:g}",
            f"{row.text} ({listed(row.labels)})" if row.labels else row.text,
            _who(row.scenarios, scenarios),
            _who(row.architectures, architectures),
        ]
        for row in found
    ]
    headers = ("Signal", "Unit", "Kind", "Scale", "Meaning", "Scenarios", "Architectures")
    emit_table(headers, rows, right=("Scale",))


def _who(names: Sequence[str], everybody: set[str]) -> str:
    return _SHARED_BY_ALL if set(names) == everybody else listed(names)
