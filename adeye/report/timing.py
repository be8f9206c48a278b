"""What a report says about timing: FTTI assumed and measured, budgets and what was achieved.

A budget of an FSR is held against the runs with a fault that exercised the FSR: where its
precondition never held, nothing was asked of it. What was not measured never passes.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

import numpy as np

from adeye.judge.timeline import Injection, grouped, worst_of
from adeye.judge.verdict import Verdict
from adeye.report.model.assessment import BudgetTiming, FaultTiming, GoalTiming, Timing
from adeye.report.words import counted
from adeye.signals import Bools
from adeye.spec.concept import Concept, Requirement, SafetyGoal, budgets_of
from adeye.store.read.bulk import Figures
from adeye.sweep.groups import NO_FAULT

Groups = Mapping[tuple[str, str, str], Sequence[Injection]]
Replay = Callable[[str], str]


_ROUNDING_S = 1e-9
"""Times are multiples of a step; their differences are not to the last bit."""
_NOT_MEASURED = "not measured"


def timing_of(
    concept: Concept,
    figures: Figures,
    found: tuple[Sequence[Injection], Collection[tuple[str, str]]],
    commands: tuple[str, Replay],
) -> Timing:
    """Hold the times of a concept against what was measured.

    Args:
        concept: With its safety goals and FSRs.
        figures: Executed runs.
        found: Measured runs with faults, and pairs of run and FSR that was exercised in it.
        commands: Measures what is not, and reproduces a run.
    """
    injections, exercised = found
    complete, replay = commands
    groups = {
        (part[0].scenario, part[0].fault_entry, part[0].architecture): part
        for part in grouped(injections)
    }
    counts = {key: int(chosen.sum()) for key, chosen in by_fault(figures) if key[1] != NO_FAULT}
    assumed = min((goal.ftti for goal in concept.safety_goals), default=None)
    is_whole = all(count == len(groups.get(key, ())) for key, count in counts.items())
    return Timing(
        assumed_s=assumed,
        goals=tuple(_goal(concept, goal) for goal in concept.safety_goals),
        budgets=tuple(
            row
            for item in concept.requirements
            if item.fdti or item.frti
            for row in _budget_rows(item, groups, exercised, replay, is_whole=is_whole)
        ),
        faults=tuple(
            _fault_row(key, count, groups.get(key, ()), assumed, replay)
            for key, count in counts.items()
        ),
        command=complete,
    )


def by_fault(figures: Figures) -> Iterator[tuple[tuple[str, str, str], Bools]]:
    """List scenario, fault entry and architecture in their order, each with its runs."""
    columns = figures.scenario, figures.fault_entry, figures.architecture
    codes = np.stack([column.codes for column in columns])
    keys, of_row = np.unique(codes, axis=1, return_inverse=True)
    named = [
        (columns[0].words[at[0]], columns[1].words[at[1]], columns[2].words[at[2]])
        for at in keys.T.tolist()
    ]
    for number in sorted(range(len(named)), key=lambda at: named[at]):
        yield named[number], of_row.reshape(-1) == number


def _goal(concept: Concept, goal: SafetyGoal) -> GoalTiming:
    """Hold the largest budget of a goal against its FTTI."""
    budget = max(
        budgets_of(concept.requirements, goal.id), key=lambda item: item.total, default=None
    )
    shared = {"goal": goal.id, "ftti_s": goal.ftti, "rationale": goal.ftti_rationale}
    if budget is None:
        return GoalTiming(**shared, verdict=Verdict.NOT_RUN, note="no FSR states a budget")
    verdict, note = Verdict.PASS, ""
    if budget.exceeds(goal.ftti):
        verdict, note = Verdict.FAIL, "more is allowed than the goal tolerates"
    elif not budget.is_complete:
        part = "detection" if budget.fdti is None else "reaction"
        verdict, note = Verdict.INCONCLUSIVE, f"no FSR states a budget of the {part}"
    return GoalTiming(
        **shared,
        fsrs=budget.fsrs,
        fdti_s=budget.fdti,
        frti_s=budget.frti,
        fhti_s=budget.total if budget.is_complete else None,
        margin_s=goal.ftti - budget.total,
        verdict=verdict,
        note=note,
    )


def _budget_rows(
    item: Requirement,
    groups: Groups,
    exercised: Collection[tuple[str, str]],
    replay: Replay,
    *,
    is_whole: bool,
) -> Iterator[BudgetTiming]:
    """Hold the budget of an FSR against every fault that exercised it."""
    is_told = False
    for (scenario, fault, architecture), group in groups.items():
        own = [run for run in group if (run.run, item.id) in exercised]
        if not own:
            continue
        is_told = True
        judged = [_held(item, run) for run in own]
        verdict, note, margin, worst = min(judged, key=_rank)
        yield BudgetTiming(
            fsr=item.id,
            scenario=scenario,
            fault_entry=fault,
            architecture=architecture,
            runs=len(own),
            fdti_budget_s=item.fdti,
            frti_budget_s=item.frti,
            fdti_s=_most(run.times.fdti_s for run in own),
            frti_s=_most(run.times.frti_s for run in own),
            margin_s=margin,
            verdict=verdict,
            note=note,
            run=worst.run,
            command=replay(worst.run),
        )
    if not is_told:
        reason = "no fault exercised it" if is_whole and groups else _NOT_MEASURED
        yield BudgetTiming(
            fsr=item.id,
            fdti_budget_s=item.fdti,
            frti_budget_s=item.frti,
            verdict=Verdict.VACUOUS if is_whole and groups else Verdict.NOT_RUN,
            note=reason,
        )


_Judged = tuple[Verdict, str, "float | None", "Injection"]
_ORDER = (Verdict.FAIL, Verdict.INCONCLUSIVE, Verdict.PASS, Verdict.VACUOUS)


def _rank(judged: _Judged) -> tuple[int, float, str]:
    verdict, _, margin, run = judged
    return _ORDER.index(verdict), float("-inf") if margin is None else margin, run.run


def _held(item: Requirement, run: Injection) -> _Judged:
    """Judge one run by the budget of an FSR."""
    if run.class_ == "not_activated":
        return Verdict.VACUOUS, "the fault was not activated", None, run
    parts = [
        (budget, time, word)
        for budget, time, word in (
            (item.fdti, run.times.fdti_s, "detected"),
            (item.frti, run.times.frti_s, "handled"),
        )
        if budget is not None
    ]
    missing = next((word for _, time, word in parts if time is None), None)
    if missing is not None:
        if run.class_ == "masked":
            return Verdict.INCONCLUSIVE, "masked, and not detected", None, run
        return Verdict.FAIL, f"not {missing} before the run ended", None, run
    margin = min(budget - time for budget, time, _ in parts if time is not None)
    if margin < -_ROUNDING_S:
        return Verdict.FAIL, "the budget is exceeded", margin, run
    return Verdict.PASS, "", margin, run


def _fault_row(
    key: tuple[str, str, str],
    count: int,
    group: Sequence[Injection],
    assumed: float | None,
    replay: Replay,
) -> FaultTiming:
    """Hold FHTI against FTTI of one fault entry."""
    scenario, fault, architecture = key
    row = FaultTiming(
        scenario=scenario,
        fault_entry=fault,
        architecture=architecture,
        runs=count,
        measured=len(group),
        verdict=Verdict.NOT_RUN,
        note=_NOT_MEASURED,
    )
    if not group:
        return row
    least = {run.run: _ftti(run) for run in group}
    fttis = [time for time in least.values() if time is not None]
    margins = {
        run.run: min(limits) - run.times.fhti_s
        for run in group
        if run.times.fhti_s is not None
        and (limits := [time for time in (least[run.run], assumed) if time is not None])
    }
    verdict, note = _fault_verdict(count, group, margins, (min(fttis, default=None), assumed))
    # The run with the least margin where all are handled, else the worst by its class.
    worst = worst_of(group).run
    if verdict in {Verdict.PASS, Verdict.FAIL} and _is_handled(group) and margins:
        worst = min(margins, key=lambda run: (margins[run], run))
    told = {
        "handled": sum(run.times.fhti_s is not None for run in group),
        "fdti_s": _most(run.times.fdti_s for run in group),
        "frti_s": _most(run.times.frti_s for run in group),
        "fhti_s": _most(run.times.fhti_s for run in group),
        "ftti_s": min(fttis, default=None),
        "margin_s": min(margins.values(), default=None),
        "verdict": verdict,
        "note": note,
        "run": worst,
        "command": replay(worst),
    }
    # Validated, unlike a copy with changes.
    return FaultTiming.model_validate(row.model_dump() | told)


def _fault_verdict(
    count: int,
    group: Sequence[Injection],
    margins: Mapping[str, float],
    fttis: tuple[float | None, float | None],
) -> tuple[Verdict, str]:
    """Judge a group, the worst reason first."""
    classes = [run.class_ for run in group]
    measured, assumed = fttis
    latent = sum(name in {"undetected_no_violation", "masked"} for name in classes)
    reasons = (
        (Verdict.FAIL, classes.count("undetected_violation"), "violate undetected"),
        (Verdict.FAIL, classes.count("detected_late"), "detected, not handled in time"),
        (
            Verdict.FAIL,
            sum(margin <= _ROUNDING_S for margin in margins.values()),
            "handled later than the shortest FTTI",
        ),
        (Verdict.NOT_RUN, count - len(group), _NOT_MEASURED),
        (Verdict.INCONCLUSIVE, latent, "not detected, nothing violated"),
    )
    if measured is not None and assumed is not None and measured < assumed - _ROUNDING_S:
        return Verdict.FAIL, "violates sooner than the FTTI assumed"
    for verdict, runs, text in reasons:
        if runs:
            return verdict, f"{counted(runs)} {text}"
    if not margins:
        return Verdict.VACUOUS, "no fault was activated"
    return Verdict.PASS, ""


def _is_handled(group: Sequence[Injection]) -> bool:
    return all(run.class_ in {"detected_in_time", "not_activated"} for run in group)


def _ftti(run: Injection) -> float | None:
    """Return the measured FTTI; None where it is not the fault's doing."""
    return None if run.fault_free_violation_s is not None else run.ftti_s


def _most(times: Iterator[float | None]) -> float | None:
    return max((time for time in times if time is not None), default=None)
