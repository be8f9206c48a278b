"""What a parameter of a channel trades: false trips without a fault against detection with one."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.errors import InputError, suggest
from adeye.evaluation.statistics import median_low, poisson_rate
from adeye.report.designs import designs_of, is_sample
from adeye.report.fault_parts import Rate, TradeCurve, TradePoint
from adeye.store.repository import Repository
from adeye.sweep.axes import quantity_or_text
from adeye.sweep.present import axis_text, quantity_text

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from adeye.signals import Bools
    from adeye.store.figures import Figures

CONFIDENCE: Final = 0.95
NO_FAULT: Final = "none"
_OF_A_CHANNEL: Final = re.compile(r"architecture\.channels\.[^.]+\.parameters\..+")
_HOUR_S: Final = 3600.0


def rate_of(figures: Figures, chosen: Bools, *, sampled: bool) -> Rate:
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
    if hours <= 0.0:
        return Rate(runs=runs, hours=0.0, trips=events, per_hour=None)
    found = poisson_rate(events, hours, CONFIDENCE) if sampled else None
    return Rate(
        runs=runs,
        hours=hours,
        trips=events,
        per_hour=events / hours,
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


def trade_curves(figures: Figures, odd: Mapping[str, Any], axis: str) -> tuple[TradeCurve, ...]:
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
            TradeCurve(
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
    uses = (use for use in odd["odd"]["scenarios"] if (use.get("as") or use["use"]) == scenario)
    written = next(uses)["sweep"].get("parameters", {}).get(axis)
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


def _point(own: Figures, value: str, *, sampled: bool) -> TradePoint:
    is_faulty = np.array([own.fault_entry[at] != NO_FAULT for at in range(len(own))], dtype=bool)
    fdti = own.metrics["fault_detection_time_s"][is_faulty]
    known = fdti[np.isfinite(fdti)]
    return TradePoint(
        value=value,
        calm=rate_of(own, ~is_faulty, sampled=sampled),
        faulty=int(is_faulty.sum()),
        detected=len(known),
        median_fdti_s=median_low(known) if len(known) else None,
        worst_fdti_s=float(known.max()) if len(known) else None,
    )


def trades_by(
    db: str | Path | None, campaign: str | None, axis: str
) -> tuple[str, tuple[TradeCurve, ...]]:
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
