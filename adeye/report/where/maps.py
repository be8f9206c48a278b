"""Maps of where FSRs fail, each over the axes that matter most, as few as a page takes."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final

from adeye.report.where import records
from adeye.report.where.boxes import LISTED
from adeye.report.where.tell import Cases, cases_of
from adeye.store.read.bulk import Compared

MOST_MAPS: Final = 12
"""Maps of one page. Each failing FSR has one before any has a second."""

Failing = tuple[str, str]
"""An FSR that fails, and for which architecture."""


def map_failures(
    failing: Sequence[Failing],
    compared: Compared,
    odd: Mapping[str, Any],
    command: Callable[[str], str],
) -> records.FailureMaps | None:
    """Draw up where FSRs fail.

    Args:
        failing: The most urgent first.
        compared: Of the campaign, named.
        odd: Stored content of the ODD.
        command: Adds to a command what names campaign and database.

    Returns:
        None if nothing fails.
    """
    sites: list[tuple[int, int, str, Cases]] = []
    for fsr in dict.fromkeys(name for name, _ in failing):
        own = list(cases_of(compared, fsr, odd))
        for place, pair in enumerate(failing):
            if pair[0] != fsr:
                continue
            found = [item for item in own if item.architecture == pair[1] and item.failed.any()]
            found.sort(key=lambda item: -int(item.failed.sum()))
            sites += [(turn, place, fsr, item) for turn, item in enumerate(found)]
    if not sites:
        return None
    shown = sorted(sites, key=lambda site: site[:2])[:MOST_MAPS]
    shown.sort(key=lambda site: (site[1], site[0]))
    return records.FailureMaps(
        maps=tuple(_mapped(fsr, item, command) for _, _, fsr, item in shown),
        left_out=len(sites) - len(shown),
        command=command("adeye query failing-fsrs"),
    )


def _mapped(fsr: str, cases: Cases, command: Callable[[str], str]) -> records.FailureMap:
    # Across there is more room, so there is the axis that matters most.
    by = cases.mattering[::-1]
    site = cases.told(by)
    order = {axis.name: [level.at[0] for level in axis.levels] for axis in site.axes}
    values = [_shown(order[name], place, site.table) for place, name in enumerate(by)]
    asked = f" --by {shlex.quote(','.join(by))}" if by else ""
    whose = f"--architecture {shlex.quote(site.architecture)}"
    return records.FailureMap(
        fsr=fsr,
        scenario=site.scenario,
        architecture=site.architecture,
        faults=site.faults,
        tally=site.tally,
        margin=site.margin,
        unit=site.unit,
        separation=site.separations[0] if site.separations else None,
        by=by,
        down=values[0] if len(by) > 1 else (),
        across=values[-1] if by else (),
        left_out=tuple(
            len(order[name]) - len(shown) for name, shown in zip(by, values, strict=True)
        ),
        levels=tuple(_placed(site.table, values)),
        command=command(f"adeye where {shlex.quote(fsr)}{asked} {whose}"),
    )


def _shown(values: Sequence[str], place: int, table: Sequence[records.Level]) -> tuple[str, ...]:
    """Keep the values at which most fails, in their order."""
    fails = Counter[str]()
    for level in table:
        fails[level.at[place]] += level.tally.failed
    kept = sorted(range(len(values)), key=lambda at: -fails[values[at]])[:LISTED]
    return tuple(values[at] for at in sorted(kept))


def _placed(
    table: Sequence[records.Level], values: Sequence[Sequence[str]]
) -> Iterator[records.Level]:
    """Give what is at values that are shown."""
    for level in table:
        if all(at in shown for at, shown in zip(level.at, values, strict=True)):
            yield level
