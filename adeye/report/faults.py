"""What a report says about faults: their classes and times, takeovers, and runs without a fault.

Only what was measured is told. What was not is counted, with the command that measures it.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.evaluation.injections import count_injections, grouped, worst_of
from adeye.evaluation.takeovers import TAKEOVER_CLASSES, TakeoverClass
from adeye.report.designs import designs_of, is_sample
from adeye.report.fault_parts import (
    Calm,
    FaultEvidence,
    FaultGroup,
    TakeoverRun,
    Takeovers,
    WorstInjection,
)
from adeye.report.parts import Command
from adeye.report.trade import NO_FAULT, debounce_axes, rate_of, trade_curves

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from adeye.evaluation.injections import Injection
    from adeye.store.figures import Figures
    from adeye.store.hindsight import TakeoverLine

MOST_LISTED = 12
"""Takeovers that are listed with their commands."""
_WRONG: tuple[TakeoverClass, ...] = ("missed", "late", "spurious")


def fault_evidence(
    figures: Figures,
    odd: Mapping[str, Any],
    found: tuple[Sequence[Injection], Sequence[TakeoverLine]],
    commands: tuple[Callable[[str], str], Callable[[str], str]],
) -> FaultEvidence:
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
    return FaultEvidence(
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
) -> FaultGroup:
    count, worst = count_injections(group, is_sample=sampled), worst_of(group)
    return FaultGroup(
        scenario=count.scenario,
        fault_entry=count.fault_entry,
        architecture=count.architecture,
        counts=dict(count.counts),
        detected=count.detected,
        activated=count.activated,
        low=None if count.coverage is None else count.coverage.low,
        high=None if count.coverage is None else count.coverage.high,
        least_ftti_s=count.least_ftti_s,
        most_fhti_s=count.most_fhti_s,
        worst=WorstInjection(
            run=worst.run,
            class_=worst.class_,
            fdti_s=worst.times.fdti_s,
            frti_s=worst.times.frti_s,
            fhti_s=worst.times.fhti_s,
            ftti_s=worst.ftti_s,
            margin_s=worst.margin_s,
            command=replay(worst.run),
        ),
    )


def _takeovers(lines: Sequence[TakeoverLine], replay: Callable[[str], str]) -> Takeovers:
    counted = Counter(line.class_ for line in lines)
    wrong = sorted(
        (line for line in lines if line.class_ in _WRONG),
        key=lambda line: (_WRONG.index(line.class_), line.run),
    )
    return Takeovers(
        counts={name: counted[name] for name in TAKEOVER_CLASSES},
        avoidable=sum(line.class_ == "missed" and line.fork_violation_s is None for line in lines),
        harmful=sum(line.class_ == "spurious" and line.violation_s is not None for line in lines),
        listed=tuple(
            TakeoverRun(
                run=line.run,
                fork=line.fork,
                class_=line.class_,
                scenario=line.scenario,
                architecture=line.architecture,
                fault_entry=line.fault_entry,
                takeover_s=line.takeover_s,
                command=replay(line.run),
            )
            for line in wrong[:MOST_LISTED]
        ),
    )


def _calm(
    figures: Figures,
    chosen: Any,
    architecture: str,
    designs: Mapping[str, str],
    lines: Sequence[TakeoverLine],
) -> Calm:
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
    return Calm(
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
