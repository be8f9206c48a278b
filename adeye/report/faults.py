"""What a report says about faults: their classes and times, takeovers, and runs without a fault.

Only what was measured is told. What was not is counted, with the command that measures it.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from adeye.errors import InputError, suggest
from adeye.judge.preventability import TAKEOVER_CLASSES, TakeoverClass
from adeye.judge.statistics import median_low, poisson_rate
from adeye.judge.timeline import Injection, count_injections, grouped, worst_of
from adeye.report.claims import designs_of, is_sample, uses_of
from adeye.report.model import assessment as model
from adeye.report.model.part import Command
from adeye.signals import NO_FAULT, Bools
from adeye.store.read.bulk import Figures
from adeye.store.repository import Repository
from adeye.store.write.studies import TakeoverLine
from adeye.sweep.values import axis_text, quantity_or_text, quantity_text

# --- What a parameter of a channel trades: false trips without a fault against detection with one -

CONFIDENCE: Final = 0.95
_OF_A_CHANNEL: Final = re.compile(r"architecture\.channels\.[^.]+\.parameters\..+")
_HOUR_S: Final = 3600.0


def rate_of(figures: Figures, chosen: Bools, *, sampled: bool) -> model.Rate:
    """Count the trips of some runs.

    Args:
        figures: Executed runs.
        chosen: (R,) which; those that were never measured are left out.
        sampled: Whether their points are a random sample.
    """
    trips = figures.metrics["trips"]
    counted = chosen & np.isfinite(trips)
    events = int(trips[counted].sum())
    hours = math.fsum(figures.duration_s[counted].tolist()) / _HOUR_S
    runs = int(counted.sum())
    is_driven = hours > 0.0
    found = poisson_rate(events, hours, CONFIDENCE) if is_driven and sampled else None
    return model.Rate(
        runs=runs,
        hours=max(0.0, hours),
        trips=events,
        per_hour=events / hours if is_driven else None,
        low=None if found is None else found.low,
        high=None if found is None else found.high,
    )


def debounce_axes(figures: Figures) -> list[str]:
    """List the swept parameters of channels that have several values."""
    return sorted(
        name
        for name, column in figures.points.items()
        if _OF_A_CHANNEL.fullmatch(name) and len(np.unique(column.codes[column.codes >= 0])) > 1
    )


def trade_curves(
    figures: Figures, odd: Mapping[str, Any], axis: str
) -> tuple[model.TradeCurve, ...]:
    """Hold trips against detection for each value of an axis, by architecture.

    Args:
        figures: Executed runs.
        odd: Stored content of the ODD.
        axis: Name of a swept axis.
    """
    column = figures.points[axis]
    designs = designs_of(odd)
    curves = []
    for code, architecture in sorted(enumerate(figures.architecture.words), key=lambda it: it[1]):
        own = figures.where((figures.architecture.codes == code) & (column.codes >= 0))
        if not len(own):
            continue
        scenarios = sorted(
            str(own.scenario.words[at]) for at in np.unique(own.scenario.codes).tolist()
        )
        sampled = all(is_sample(designs[name]) for name in scenarios)
        values = own.points[axis]
        levels = sorted((values.words[at], at) for at in np.unique(values.codes).tolist())
        curves.append(
            model.TradeCurve(
                axis=axis,
                architecture=architecture,
                scenarios=tuple(scenarios),
                points=tuple(
                    _point(
                        own.where(values.codes == at),
                        _shown(axis, value, odd, scenarios[0]),
                        sampled=sampled,
                    )
                    for value, at in sorted(levels, key=lambda level: _order(level[0]))
                ),
            )
        )
    return tuple(curves)


def _shown(axis: str, value: float | str, odd: Mapping[str, Any], scenario: str) -> str:
    """Write a value with the unit that the sweep has it in."""
    written = uses_of(odd)[scenario]["sweep"].get("parameters", {}).get(axis)
    if isinstance(value, str) or not written:
        return axis_text(axis, value, odd, scenario)
    if isinstance(written, list):
        same = (str(text) for text in written if quantity_or_text(text)[0] == value)
        return next(same, axis_text(axis, value, odd, scenario))
    return quantity_text(value, next(iter(written.values())))


def _order(value: float | str) -> tuple[bool, float, str]:
    """Sort numbers and quantities by size, and other texts behind them."""
    size = quantity_or_text(value)[0]
    return isinstance(size, str), 0.0 if isinstance(size, str) else size, str(value)


def _point(own: Figures, value: str, *, sampled: bool) -> model.TradePoint:
    is_calm = np.array([own.fault_entry[at] == NO_FAULT for at in range(len(own))], dtype=bool)
    is_faulty = ~is_calm & own.has_fault
    fdti = own.metrics["fault_detection_time_s"][is_faulty]
    known = fdti[np.isfinite(fdti)]
    return model.TradePoint(
        value=value,
        calm=rate_of(own, is_calm, sampled=sampled),
        faulty=int(is_faulty.sum()),
        detected=len(known),
        median_fdti_s=median_low(known) if len(known) else None,
        worst_fdti_s=float(known.max()) if len(known) else None,
    )


def trades_by(
    db: str | Path | None, campaign: str | None, axis: str
) -> tuple[str, tuple[model.TradeCurve, ...]]:
    """Read the trade of an axis from a database.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        campaign: Id, its beginning or its number; None for the newest.
        axis: Name of a swept axis, or its end behind a dot.

    Returns:
        The campaign's id and the curves.

    Raises:
        InputError: There is no such campaign or axis.
    """
    with Repository.open(db, create=False) as repository:
        info = repository.find_campaign(campaign)
        repository.require_sound(info.id)
        figures = repository.figures(info.id)
        odd = repository.content("odd", info.odd_digest)
    return info.id, trade_curves(figures, odd, _axis(axis, list(figures.points)))


def _axis(name: str, known: Sequence[str]) -> str:
    if name in known:
        return name
    ending = [item for item in known if item.endswith(f".{name}")]
    if len(ending) == 1:
        return ending[0]
    if ending:
        raise InputError(
            f"--by {name}: several axes end so", remedy=f"Name one: {', '.join(sorted(ending))}."
        )
    raise InputError(f"--by {name}: the campaign does not sweep it", remedy=suggest(name, known))


# --- What a report says about faults: their classes and times, takeovers, and runs without a
# fault.

MOST_LISTED = 12
"""Takeovers that are listed with their commands."""
_WRONG: tuple[TakeoverClass, ...] = ("missed", "late", "spurious")


def fault_evidence(
    figures: Figures,
    odd: Mapping[str, Any],
    found: tuple[Sequence[Injection], Sequence[TakeoverLine]],
    commands: tuple[Callable[[str], str], Callable[[str], str]],
) -> model.FaultEvidence:
    """Put together what is known of the faults of a campaign.

    Args:
        figures: Executed runs.
        odd: Stored content of the ODD.
        found: What twins and forks told before.
        commands: Complete a verb, and reproduce a run.
    """
    injections, lines = found
    complete, replay = commands
    designs = designs_of(odd)
    fault = figures.fault_entry
    is_faulty = np.array([word != NO_FAULT for word in fault.words], dtype=np.bool_)[fault.codes]
    return model.FaultEvidence(
        with_fault=int(is_faulty.sum()),
        measured=len(injections),
        executed=len(figures),
        forked=len(lines),
        commands=(
            Command(text="classes and times of faults", command=complete("faults")),
            Command(text="whether takeovers were needed", command=complete("forks")),
        ),
        groups=tuple(
            _group(group, replay, sampled=is_sample(designs[group[0].scenario]))
            for group in grouped(injections)
        ),
        takeovers=_takeovers(lines, replay) if lines else None,
        calm=tuple(
            _calm(figures, ~is_faulty & (figures.architecture.codes == code), name, designs, lines)
            for code, name in sorted(enumerate(figures.architecture.words), key=lambda it: it[1])
        ),
        curves=tuple(
            curve for axis in debounce_axes(figures) for curve in trade_curves(figures, odd, axis)
        ),
    )


def _group(
    group: Sequence[Injection], replay: Callable[[str], str], *, sampled: bool
) -> model.FaultGroup:
    count, worst = count_injections(group, is_sample=sampled), worst_of(group)
    return model.FaultGroup.of(
        count,
        counts=dict(count.counts),
        low=None if count.coverage is None else count.coverage.low,
        high=None if count.coverage is None else count.coverage.high,
        worst=model.WorstInjection.of(
            worst,
            fdti_s=worst.times.fdti_s,
            frti_s=worst.times.frti_s,
            fhti_s=worst.times.fhti_s,
            command=replay(worst.run),
        ),
    )


def _takeovers(lines: Sequence[TakeoverLine], replay: Callable[[str], str]) -> model.Takeovers:
    counted = Counter(line.class_ for line in lines)
    wrong = sorted(
        (line for line in lines if line.class_ in _WRONG),
        key=lambda line: (_WRONG.index(line.class_), line.run),
    )
    return model.Takeovers(
        counts={name: counted[name] for name in TAKEOVER_CLASSES},
        avoidable=sum(line.class_ == "missed" and line.fork_violation_s is None for line in lines),
        harmful=sum(line.class_ == "spurious" and line.violation_s is not None for line in lines),
        listed=tuple(
            model.TakeoverRun.of(line, command=replay(line.run)) for line in wrong[:MOST_LISTED]
        ),
    )


def _calm(
    figures: Figures,
    chosen: Any,
    architecture: str,
    designs: Mapping[str, str],
    lines: Sequence[TakeoverLine],
) -> model.Calm:
    own = figures.where(chosen)
    scenarios = {own.scenario[at] for at in range(len(own))} if len(own) else set()
    share, hours = own.metrics["nominal_availability"], own.duration_s
    known = np.isfinite(share)
    told = [
        line
        for line in lines
        if line.architecture == architecture
        and line.fault_entry == NO_FAULT
        and line.takeover_s is not None
    ]
    return model.Calm(
        architecture=architecture,
        rate=rate_of(
            own,
            np.ones(len(own), dtype=np.bool_),
            sampled=bool(scenarios) and all(is_sample(designs[name]) for name in scenarios),
        ),
        takeovers=int(np.nansum(own.metrics["takeovers"])),
        availability=float(np.average(share[known], weights=hours[known])) if known.any() else None,
        not_measured=int((~np.isfinite(own.metrics["trips"])).sum()),
        forked=len(told),
        not_needed=sum(line.class_ == "spurious" for line in told),
    )
