"""``where``: where among the swept values an FSR fails."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, Annotated, Final

import typer

from adeye.cli import options as opt
from adeye.cli import output as out
from adeye.report.words import counted, number, unit_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.report.where.records import AxisTold, Level, Separation, Site, Tally, Where

_FEW: Final = 3
"""Names that are written out."""
_TRENDS: Final = {
    "none": "fails nowhere more",
    "upwards": "fails at larger values",
    "downwards": "fails at smaller values",
    "not monotone": "NOT MONOTONE",
    "not known": "",
}


def where(
    fsr: Annotated[str, typer.Argument(metavar="FSR", show_default=False)],
    campaign: opt.OddOrCampaign = None,
    *,
    by: Annotated[str | None, opt.option("AXIS[,AXIS]", env="WHERE_BY")] = None,
    architecture: Annotated[list[str] | None, opt.option("NAME", env="WHERE_ARCHITECTURE")] = None,
    db: opt.Db = None,
    json: opt.Json = False,
) -> None:
    """Tell where among the swept values an FSR fails, and by how much.

    Nothing is executed. For each scenario and architecture: how many test cases fail, the smallest
    condition that holds them apart from those that pass, with what it misses, and what each axis
    has to do with it. The condition is one that `sweep: where:` of an ODD takes, and with it a
    second campaign is about these test cases alone; `-k` chooses them in this one. What is neither
    PASS nor FAIL is neither inside nor outside of it, and is counted apart.

    Parameters:
        fsr: Id of the FSR.
        campaign: An ODD's file or id, or a campaign by number or digest; default: the latest.
        by: Count by the values of one axis, or of two; `fault` is the fault list.
        architecture: Look at this one only; once for each. Default: all.

    Examples:
        adeye where FSR-02
        adeye where FSR-02 --by gap,ego_speed --architecture legacy_camera
        adeye where FSR-02 3 --json
    """
    from adeye.answers import where_in

    axes = [name for name in map(str.strip, (by or "").split(",")) if name]
    found = where_in(db, campaign, fsr, by=axes, architectures=architecture or ())
    out.emit_found("where", found, print_where, json=json, looked_at=len(found.sites))


def print_where(found: Where) -> None:
    """Print where an FSR fails: the sites, then what holds the failures of each apart."""
    out.emit_prose(out.clean(f"{found.fsr}: {found.text}"))
    whose = out.clean(f"Campaign {found.number} of {found.odd} ({out.short(found.campaign)})")
    out.emit_prose(
        f"{whose}: fails in {counted(found.failed)} of {counted(found.decided)} test cases that "
        "pass or fail."
    )
    headers = [
        "Scenario",
        "Architecture",
        "Faults",
        "FAIL",
        "PASS",
        "Vacuous",
        "Undecided",
        "Worst margin",
    ]
    rows = [
        [
            site.scenario,
            site.architecture,
            _faults(site),
            *_counts(site.tally),
            _margin(site.margin, site.unit),
        ]
        for site in found.sites
    ]
    out.emit_table([*headers, "Worst run"], [
        [*row, out.short(site.run)] for row, site in zip(rows, found.sites, strict=True)
    ], right=headers[3:])  # fmt: skip
    for site in found.sites:
        if found.by:
            _print_table(site, found.by)
        if site.tally.failed:
            _print_site(site, has_tables=not found.by)


def _print_site(site: Site, *, has_tables: bool) -> None:
    out.emit_prose(f"\n{out.clean(_title(site))}")
    if not site.separations:
        out.emit("  Nothing passes, so there is nothing to hold the failures apart from.")
    for place, found in enumerate(site.separations):
        if place:
            out.emit("  and of the rest:")
        _print_separation(found)
    for axis in site.axes:
        values = f"{axis.lowest} to {axis.highest}" if axis.is_ordered else f"{axis.values} values"
        out.emit_prose(out.clean(f"  {axis.name}, {values}: {axis_text(axis)}"))
    if has_tables:
        for axis in site.axes:
            if axis.changing or not axis.lines:
                _print_levels(axis.levels, (axis.name,), site.unit)


def _title(site: Site) -> str:
    return f"{site.architecture} in {site.scenario}, faults {_faults(site)}"


def _faults(site: Site) -> str:
    """Name the entries of the fault list while they are few."""
    count = len(site.faults)
    return ", ".join(site.faults) if count <= _FEW else f"{counted(count)} entries"


def _print_separation(found: Separation) -> None:
    if found.where or found.faults:
        said = [f"    - {text}" for text in found.where]
        if found.where:
            out.emit("  where:\n" + out.clean("\n".join(said), lines=True))
        if found.faults:
            out.emit_line(f"  faults: [{', '.join(found.faults)}]")
    else:
        out.emit("  No condition on at most three axes holds the failures apart.")
    inside, outside = found.inside, found.outside
    out.emit(
        f"  holds {counted(inside.failed)} of {counted(inside.failed + outside.failed)} failures "
        f"and {counted(inside.passed)} of {counted(inside.passed + outside.passed)} passes"
        f"{_neither(inside)}"
    )
    if not found.is_exact:
        out.emit("  Neighbouring values were taken together first, so a smaller one may exist.")
    if found.keyword:
        out.emit_line(f"  -k {shlex.quote(found.keyword)}")


def _neither(tally: Tally) -> str:
    parts = [
        f"{counted(count)} {word}"
        for count, word in ((tally.vacuous, "vacuous"), (tally.undecided, "undecided"))
        if count
    ]
    return f"; also {' and '.join(parts)}" if parts else ""


def axis_text(axis: AxisTold) -> str:
    """Say what an axis has to do with failing."""
    if not axis.lines:
        return "no two decided test cases differ in it alone"
    if not axis.changing:
        return f"alone it changes no verdict, in {counted(axis.lines)} comparisons"
    text = f"alone it changes the verdict in {counted(axis.changing)} of {counted(axis.lines)}"
    text += f" comparisons; {_TRENDS[axis.trend]}" if _TRENDS[axis.trend] else " comparisons"
    if axis.turning:
        text += f", in {counted(axis.turning)} it turns more than once"
    return text


def _print_table(site: Site, by: Sequence[str]) -> None:
    title = _title(site)
    if not site.table:
        out.emit_prose(f"\n{out.clean(title)}: {out.clean(', '.join(by))} does not vary here.")
    elif len(by) == 1:
        _print_levels(site.table, by, site.unit, title=title)
    else:
        _print_cross(site, by, title)


def _print_levels(
    levels: Sequence[Level], by: Sequence[str], unit: str, *, title: str = ""
) -> None:
    headers = [*by, "FAIL", "PASS", "Vacuous", "Undecided", "Worst margin"]
    rows = [
        [*level.at, *_counts(level.tally), _margin(level.margin, unit), out.short(level.run)]
        for level in levels
    ]
    out.emit_table([*headers, "Worst run"], rows, title=title, right=headers)


def _print_cross(site: Site, by: Sequence[str], title: str) -> None:
    """Print a row for each value of the one axis and a column for each of the other."""
    cells = {level.at: level for level in site.table}
    across = list(dict.fromkeys(at[1] for at in sorted(cells, key=list(cells).index)))
    order = {axis.name: [level.at[0] for level in axis.levels] for axis in site.axes}
    across.sort(key=order[by[1]].index)
    down = list(dict.fromkeys(at[0] for at in cells))
    rows = [[name, *(_cell(cells.get((name, other))) for other in across)] for name in down]
    headers = [f"{by[0]} / {by[1]}", *across]
    unit = unit_text(site.unit)
    said = (
        f"{title}: failing of those that pass or fail, worst margin{f' [{unit}]' if unit else ''}"
    )
    out.emit_table(headers, rows, title=said, right=headers)


def _cell(level: Level | None) -> str:
    if level is None:
        return ""
    tally = level.tally
    text = f"{tally.failed}/{tally.failed + tally.passed}"
    rest = tally.vacuous + tally.undecided
    text += f" +{rest}?" if rest else ""
    return text if level.margin is None else f"{text} {number(level.margin, signed=True)}"


def _counts(tally: Tally) -> list[str]:
    return [
        counted(count) for count in (tally.failed, tally.passed, tally.vacuous, tally.undecided)
    ]


def _margin(margin: float | None, unit: str) -> str:
    if margin is None:
        return out.NONE
    return f"{number(margin, signed=True)} {unit_text(unit)}".rstrip()
