"""``plan|signals|coverage|dependencies``: what an ODD asks for, names, covers and shares."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from adeye.cli import output as out
from adeye.cli.options import Backend, Db, Json, OddFile, Variant, option, plan_of
from adeye.errors import UsageError, amount, require_known

if TYPE_CHECKING:
    from adeye.analysis.dependence import ChannelPair, Dependencies, Kind, Shared
    from adeye.campaign.integrity import CoverageTable
    from adeye.campaign.plan import CampaignPlan
    from adeye.spec.load import OddFiles
    from adeye.sweep.coverage import Combination
    from adeye.sweep.design import Points
    from adeye.sweep.expand import Factor

# --- ``plan`` and ``signals``: what an ODD asks for and what its requirements may name ------------

_SHARED_BY_ALL: Final = "all"
_MOST_LEVELS: Final = 10
_TIMES: Final = " \N{MULTIPLICATION SIGN} "


def plan(
    odd: OddFile,
    *,
    list_cases: Annotated[bool, option("--list -l", env="PLAN_LIST")] = False,
    select: Annotated[str | None, option("-k EXPR")] = None,
    backend: Backend = "batch",
    variant: Variant = None,
    json: Json = False,
) -> None:
    """Check an ODD and everything it names, and count its test cases. Nothing is executed.

    Test cases are points times fault entries times architectures times replicates. The fault-free
    entry 'none' is always among the fault entries.

    Parameters:
        list_cases: List every test case with its swept values and its id instead.
        select: List those only that 'adeye run -k' would choose.

    Examples:
        adeye plan odd/first.yaml
        adeye plan odd/first.yaml --json
        adeye plan odd/first.yaml --list -k 'cut_in and gap=45'
    """
    planned = plan_of(odd, backend, variant)
    if list_cases or select is not None:
        _list(planned, select, json=json)
        return
    out.emit_found("plan", planned, _print, json=json, document=_document)


def _list(planned: CampaignPlan, select: str | None, *, json: bool) -> None:
    from adeye.campaign.selection import Keyword

    chosen = None if select is None else Keyword.parse(select)
    found = [
        item for item in planned.listed() if chosen is None or chosen.matches(item, planned.tags)
    ]
    if json:
        out.emit_json("plan-list", {"odd": planned.files.odd.spec.odd, "test_cases": found})
        return
    if not found:
        raise UsageError(f"no test case is {select}", remedy="See 'adeye plan ODD --list'.")
    out.emit_records(
        found,
        {
            "#": "ordinal",
            "Test case": lambda item: out.short(item.test_case),
            "Scenario": "scenario",
            "Architecture": "architecture",
            "Fault entry": "fault_entry",
            "Swept": lambda item: ", ".join(
                f"{name} {value}" for name, value in item.values.items()
            ),
        },
        right=("#",),
    )
    out.emit(f"\nTest cases: {len(found):,} of {planned.expansion.count:,}")


def _print(planned: CampaignPlan) -> None:
    for notice in planned.notices:
        out.talk(out.clean(f"note: {notice}", lines=True))
    _print_factors(planned)
    out.emit("")
    rows = [[name, out.listed(axes)] for name, axes in planned.expansion.axes.items()]
    out.emit_table(("Scenario", "Swept"), rows)
    _print_designs(planned)
    out.emit_prose(f"\n{_total(planned)}")
    if planned.samples:
        twins = sum(len(sample.results) for sample in planned.samples)
        out.emit(f"{twins:,} of them are executed with half the step too.")
    out.emit_prose(_engine(planned))
    counts = _shared(planned)
    if any(counts.values()):
        told = out.listed(f"{name} {count}" for name, count in counts.items() if count)
        out.emit_prose(out.clean(f"Shared by channels (adeye dependencies): {told}"))


def _print_factors(planned: CampaignPlan) -> None:
    factors = planned.expansion.factors
    ends = {
        number
        for number, (factor, after) in enumerate(pairwise(factors))
        if factor.scenario != after.scenario
    }
    out.emit_records(
        factors,
        {
            "Scenario": "scenario",
            "Architecture": "architecture",
            "Points": _points,
            "Fault entries": lambda factor: len(factor.fault_entries),
            "Replicates": "replicates",
            "Test cases": "test_cases",
        },
        right=("Points", "Fault entries", "Replicates", "Test cases"),
        sections=ends,
    )
    out.emit("")
    for line in _fault_entries(factors):
        out.emit_prose(out.clean(line))


def _points(factor: Factor) -> str:
    return f"{factor.points}" + (f" of {factor.raw}" if factor.points != factor.raw else "")


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
            out.listed(names) + (f" with {out.listed(architectures)}" if architectures else "")
            for architectures, names in alike.items()
        )
        of = f" of {where}" if len(having) > 1 else ""
        count = amount(len(entries), "fault entry", "fault entries")
        lines.append(f"{count}{of}: {out.listed(entries)}")
    return lines


def _print_designs(planned: CampaignPlan) -> None:
    """Say what each scenario's points are, where the number of points does not say it."""
    from adeye.spec.odd import Distribution

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
        out.emit("")
    for line in lines:
        out.emit_line(line)


def _levels(levels: Sequence[object]) -> str:
    more = f" and {len(levels) - _MOST_LEVELS} more" if len(levels) > _MOST_LEVELS else ""
    return out.listed(map(str, levels[:_MOST_LEVELS])) + more


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
    return f"Test cases: {' + '.join(parts)} = {planned.expansion.count:,}"


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
    return out.clean(
        f"Traffic {engine.backend} ({engine.variant}), driver {planned.driver}, "
        f"numerics version {engine.numerics_version}; gate: {out.listed(planned.files.gate)}"
    )


def _shared(planned: CampaignPlan) -> dict[str, int]:
    """Count what the channels of each architecture share, which may fail them together."""
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

    Examples:
        adeye signals odd/first.yaml
    """
    from adeye.campaign.plan import signal_table

    planned = plan_of(odd, "batch", None)
    found = signal_table(planned)
    if json:
        out.emit_json("signals", {"odd": planned.files.odd.spec.odd, "signals": found})
        return
    scenarios, architectures = set(planned.files.scenarios), set(planned.files.architectures)
    out.emit_records(
        found,
        {
            "Signal": "name",
            "Unit": lambda row: "" if row.unit == "1" else row.unit,
            "Kind": "kind",
            "Scale": lambda row: f"{row.scale:g}",
            "Meaning": lambda row: (
                row.text + (f" ({out.listed(row.labels)})" if row.labels else "")
            ),
            "Scenarios": lambda row: _who(row.scenarios, scenarios),
            "Architectures": lambda row: _who(row.architectures, architectures),
        },
        right=("Scale",),
    )


def _who(names: Sequence[str], everybody: set[str]) -> str:
    return _SHARED_BY_ALL if set(names) == everybody else out.listed(names)


# --- ``coverage``: which attributes of an ODD, and which together, its test cases have ------------


_LISTED: Final = 20
"""Uncovered combinations that are listed; all of them are in the JSON document."""
_WORDS: Final = {1: "bins", 2: "pairs", 3: "triples"}


def coverage(
    of: Annotated[str | None, typer.Argument(metavar="[ODD|CAMPAIGN]")] = None,
    strength: Annotated[int, option("N", min=1, max=3)] = 2,
    db: Db = None,
    json: Json = False,
) -> None:
    """Count which attributes of an ODD its test cases have, one by one and together.

    Of an ODD's file the planned test cases count, of a campaign those that were executed. What no
    scenario of the ODD can have is not asked for, but counted. Coverage says what was looked at,
    not how it went and not how often it happens on the road.

    Parameters:
        of: An ODD's file, or number of a campaign or beginning of its digest; default: the latest
            campaign.
        strength: Most attributes that are looked at together.

    Examples:
        adeye coverage odd/first.yaml
        adeye coverage 3 --strength 3 --json
    """
    from adeye.campaign.integrity import executed_coverage, planned_coverage

    if of is not None and (of.endswith((".yaml", ".yml")) or Path(of).is_file()):
        found = planned_coverage(Path(of), strength)
    else:
        found = executed_coverage(db, of, strength)
    out.emit_found(
        "coverage", found, _print_coverage, json=json, document=lambda found: {"table": found}
    )


def _print_coverage(found: CoverageTable) -> None:
    if found.campaign is None:
        out.emit_line(
            f"ODD {found.odd}: {found.counted} of {found.planned} planned test cases count"
        )
    else:
        out.emit_line(
            f"Campaign {out.short(found.campaign)} of {found.odd}: {found.counted} of "
            f"{found.planned} test cases count"
        )
    for count, why in (
        (found.without_result, "without a result"),
        (found.not_judged, "in which the scenario did not come about"),
        (found.outside_odd, "outside the ODD"),
        (found.coverage.outside, "with an attribute in no bin, counted for the others only"),
    ):
        if count:
            out.emit(f"  {count} {why}")
    parts = found.coverage.combinations
    out.emit("")
    out.emit_records(
        [item for item in parts if len(item.attributes) == 1],
        {
            "Attribute": lambda item: item.attributes[0],
            "Covered": lambda item: _labels([labels for labels, _ in item.counts]),
            "Uncovered": lambda item: _labels(item.uncovered),
            "No scenario can have": lambda item: _labels(item.impossible),
        },
    )
    for size in range(2, found.coverage.strength + 1):
        _print_together([item for item in parts if len(item.attributes) == size], size)


def _labels(bins: Sequence[tuple[str, ...]]) -> str:
    return ", ".join(out.clean(" × ".join(labels)) for labels in bins) or out.NONE


def _print_together(parts: Sequence[Combination], size: int) -> None:
    word = _WORDS[size]
    feasible = sum(item.feasible for item in parts)
    covered = sum(item.covered for item in parts)
    total = sum(item.total for item in parts)
    share = f" ({covered / feasible:.1%})" if feasible else ""
    out.emit(
        f"\n{covered} of {feasible} feasible {word} are covered{share}; {total - feasible} of "
        f"{total} {word} no scenario can have"
    )
    uncovered = [
        [", ".join(item.attributes), " × ".join(labels)]
        for item in parts
        for labels in item.uncovered
    ]
    if uncovered:
        out.emit("")
        out.emit_table(("Attributes", "Uncovered"), uncovered[:_LISTED])
    if len(uncovered) > _LISTED:
        out.emit(f"and {len(uncovered) - _LISTED} more; --json lists all")


# --- ``dependencies``: what the channels of an architecture share, and could fail by together -----


_ABSENT: Final[tuple[Kind, ...]] = (
    "sensor",
    "ego_estimate",
    "resource",
    "element",
    "code",
    "influence",
)
"""Kinds of which it is worth saying that there are none."""


def dependencies(
    odd: OddFile, architecture: Annotated[str | None, option("ID")] = None, json: Json = False
) -> None:
    """List what could make two channels of the switch fail together. Nothing is executed.

    Common sensors and ego estimate, the map, resources such as power of the elements that they
    realise, code, links from one to the other, switch and vehicle; and what a fault entry has to
    hit, all of it at once, to see what becomes of its failure.

    Parameters:
        architecture: Only this architecture; default: all of the ODD.

    Examples:
        adeye dependencies odd/motorway_chauffeur.yaml
        adeye dependencies odd/motorway_chauffeur.yaml --architecture camera_radar --json
    """
    from adeye.spec.load import load_odd

    files = load_odd(odd)
    found = dependencies_of(files)
    if architecture is not None:
        said = f"the ODD has no architecture {out.clean(architecture)!r}"
        require_known([architecture], files.architectures, lambda _: said)
        found = [item for item in found if item.architecture == architecture]
    if json:
        out.emit_json("dependencies", {"odd": files.odd.spec.odd, "architectures": found})
        return
    for item in found:
        _print_dependencies(item)


def dependencies_of(files: OddFiles) -> list[Dependencies]:
    """List what channels share in each architecture of an ODD, as it is written."""
    from adeye.analysis.dependence import dependencies as analyse

    elements = files.concept.spec.elements
    return [analyse(item.spec, elements) for item in files.architectures.values()]


def _print_dependencies(found: Dependencies) -> None:
    from adeye.analysis.dependence import WORDS

    if not found.pairs:
        out.emit(f"{found.architecture}: one channel, with nobody to share anything")
    for pair in found.pairs:
        title = f"{found.architecture}: {pair.first} and {pair.second} share {_in_words(pair)}"
        out.emit_records(
            pair.shared,
            {
                "Kind": lambda item: WORDS[item.kind],
                "What": "what",
                "How": "how",
                "Fault targets": _targets,
            },
            title=title,
        )
        if pair.unstated:
            out.emit(
                f"No resources are stated for {out.listed(pair.unstated)}: they may share more."
            )
        if pair.unread:
            out.emit(
                f"What the own code of {out.listed(pair.unread)} imports and reads "
                "is not compared: they may share more."
            )


def _in_words(pair: ChannelPair) -> str:
    from adeye.analysis.dependence import WORDS

    kinds = [kind for kind in _ABSENT if kind != "code" or not pair.unread]
    absent = [WORDS[kind] for kind in kinds if not pair.count(kind)]
    return f"{len(pair.shared)} things" + (f"; no {', no '.join(absent)}" if absent else "")


def _targets(item: Shared) -> str:
    return out.listed(item.targets) + (f" ({item.model})" if item.model else "")
