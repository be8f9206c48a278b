"""What a report says about safe stops: asked for, reached, how soon, and where the ego stands."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.kernel.stop_rating import CONTACT, SCALE
from adeye.report.assessment_parts import SafeStop, SafeStops, StopPlace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from adeye.signals import Bools, Floats
    from adeye.store.figures import Figures


def safe_stops_of(
    figures: Figures, run_of: Callable[[int], str], replay: Callable[[str], str]
) -> SafeStops:
    """Count the safe stops of a campaign from the metrics of its runs.

    A safe stop counts as asked for where another channel than the default took over: that channel
    knows no other way to go on. Contacts in such runs count, whoever acted then.

    Args:
        figures: Executed runs.
        run_of: Gives the result digest of an ordinal.
        replay: Reproduces a run.
    """
    rows = [row for row in _rows(figures, run_of, replay) if row.asked + row.unknown]
    order = ["FAIL", "INCONCLUSIVE", "PASS", "VACUOUS"]
    rows.sort(key=lambda row: order.index(row.verdict.value))
    return SafeStops(
        runs=len(figures),
        asked=sum(row.asked for row in rows),
        unknown=sum(row.unknown for row in rows),
        rows=tuple(rows),
    )


def _rows(
    figures: Figures, run_of: Callable[[int], str], replay: Callable[[str], str]
) -> Iterator[SafeStop]:
    columns = figures.scenario, figures.fault_entry, figures.architecture
    codes = np.stack([column.codes for column in columns])
    keys, of_row = np.unique(codes, axis=1, return_inverse=True)
    words: Any = [column.words for column in columns]
    named = [tuple(words[part][code] for part, code in enumerate(key)) for key in keys.T.tolist()]
    for number in sorted(range(len(named)), key=lambda at: named[at]):
        yield _row(named[number], figures.where(of_row.reshape(-1) == number), run_of, replay)


def _row(
    key: tuple[str, str, str],
    own: Figures,
    run_of: Callable[[int], str],
    replay: Callable[[str], str],
) -> SafeStop:
    """Count the safe stops of one scenario, fault entry and architecture."""
    takeovers, rating = own.metrics["takeovers"], own.metrics["stop_rating"]
    asked = takeovers >= 1.0
    touched = asked & ((own.metrics["contact"] != 0.0) | (rating >= CONTACT))
    stands = asked & ~touched & np.isfinite(rating)
    scenario, fault, architecture = key
    worst = _worst(own, asked)
    run = None if worst is None else run_of(int(own.ordinal[worst]))
    # Who touched something is not in a better place than that.
    rated = np.where(touched, CONTACT, rating)[touched | stands]
    places = Counter(np.rint(rated).astype(np.int64).tolist())
    return SafeStop(
        scenario=scenario,
        fault_entry=fault,
        architecture=architecture,
        runs=len(own),
        asked=int(asked.sum()),
        unknown=int((~np.isfinite(takeovers)).sum()),
        reached=int(stands.sum()),
        contact=int(touched.sum()),
        moving=int((asked & ~touched & ~stands).sum()),
        slowest_s=_most(own.metrics["emergency_operation_time_s"], stands),
        from_fault_s=_most(own.metrics["fault_to_safe_state_s"], stands),
        deceleration_mps2=_most(own.metrics["max_deceleration_mps2"], asked),
        places=tuple(
            StopPlace(rating=at, place=SCALE[at], runs=places[at])
            for at in sorted(places, reverse=True)
        ),
        regret=_most(own.metrics["stop_regret"], stands),
        run=run,
        command="" if run is None else replay(run),
    )


def _worst(own: Figures, asked: Bools) -> int | None:
    """Find the worst run in which a safe stop was asked: contact, still moving, worst place."""
    chosen = np.flatnonzero(asked)
    if not len(chosen):
        return None
    contact = own.metrics["contact"][chosen] != 0.0
    rating = own.metrics["stop_rating"][chosen]
    slow = np.nan_to_num(own.metrics["emergency_operation_time_s"][chosen], nan=-1.0)
    keys = (-slow, -np.nan_to_num(rating, nan=CONTACT), ~contact)
    return int(chosen[np.lexsort(keys)[0]])


def _most(values: Floats, chosen: Bools) -> float | None:
    known = values[chosen & np.isfinite(values)]
    return float(known.max()) if len(known) else None
