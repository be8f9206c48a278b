"""What a report tells of a campaign beyond its verdicts, read from the database."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from adeye.judge.preventability import Comparison, tabulate_cells
from adeye.judge.timeline import Injection, grouped, worst_of
from adeye.judge.verdict import Verdict
from adeye.kernel.stops import CONTACT, SCALE
from adeye.report.model import assessment as model
from adeye.report.model.assessment import BudgetTiming, FaultTiming, GoalTiming, Timing
from adeye.report.words import counted
from adeye.signals import NO_FAULT, Bools, Floats
from adeye.spec.concept import Concept, Requirement, SafetyGoal, budgets_of
from adeye.store.read.bulk import Figures
from adeye.store.records import CampaignInfo
from adeye.store.repository import Repository

# --- What a report says about timing: FTTI assumed and measured, budgets and what was achieved ----
# A budget of an FSR is held against the runs with a fault that exercised the FSR: where its
# precondition never held, nothing was asked of it. What was not measured never passes.


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
            fdti_s=_longest(run.times.fdti_s for run in own),
            frti_s=_longest(run.times.frti_s for run in own),
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
    # None where a violation is not the fault's doing.
    least = {run.run: run.attributed_ftti_s for run in group}
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
        "fdti_s": _longest(run.times.fdti_s for run in group),
        "frti_s": _longest(run.times.frti_s for run in group),
        "fhti_s": _longest(run.times.fhti_s for run in group),
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


def _longest(times: Iterator[float | None]) -> float | None:
    return max((time for time in times if time is not None), default=None)


# --- What a report says about preventability: the cells of runs beside reference drivers ----------

LISTED: Final = 12
"""Findings that are listed with their commands; ``adeye preventability --json`` has all."""


def preventability_of(
    found: Sequence[Comparison],
    counts: tuple[int, int],
    commands: tuple[str, Callable[[str], str]],
) -> model.Preventability:
    """Return what is known of the conflicts of a campaign.

    Args:
        found: Runs beside drives of reference drivers.
        counts: Executed runs, and contacts that no drive is held against.
        commands: Evaluates the conflicts, and reproduces a run.
    """
    complete, replay = commands
    findings = [item for item in found if item.cell == "only_model"]
    findings.sort(key=lambda item: (-(item.impact_speed_mps or 0.0), item.run, item.model))
    executed, open_contacts = counts
    return model.Preventability(
        executed=executed,
        compared=len({item.run for item in found}),
        open_contacts=open_contacts,
        tallies=tuple(_tallies(found)),
        findings=len(findings),
        listed=tuple(
            model.AvoidableRun.of(item, command=replay(item.run), drive_command=replay(item.drive))
            for item in findings[:LISTED]
        ),
        command=complete,
    )


def _tallies(found: Sequence[Comparison]) -> Iterator[model.CellTally]:
    for edition in sorted({item.edition for item in found}):
        for row in tabulate_cells(item for item in found if item.edition == edition):
            yield model.CellTally.of(row, edition=edition, counts=dict(row.counts))


# --- What a report says about safe stops: asked for, reached, how soon, and where the ego stands --


def safe_stops_of(
    figures: Figures, run_of: Callable[[int], str], replay: Callable[[str], str]
) -> model.SafeStops:
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
    return model.SafeStops(
        runs=len(figures),
        asked=sum(row.asked for row in rows),
        unknown=sum(row.unknown for row in rows),
        rows=tuple(rows),
    )


def _rows(
    figures: Figures, run_of: Callable[[int], str], replay: Callable[[str], str]
) -> Iterator[model.SafeStop]:
    for key, chosen in by_fault(figures):
        yield _row(key, figures.where(chosen), run_of, replay)


def _row(
    key: tuple[str, str, str],
    own: Figures,
    run_of: Callable[[int], str],
    replay: Callable[[str], str],
) -> model.SafeStop:
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
    return model.SafeStop(
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
            model.StopPlace(rating=at, place=SCALE[at], runs=places[at])
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


# --- What a report tells of a campaign beyond its verdicts, read from the database ----------------


def assessment_of(
    repository: Repository,
    campaign: CampaignInfo,
    concept: Concept,
    figures: Figures,
    commands: tuple[Callable[[str], str], Callable[[str], str]],
) -> model.Assessment:
    """Put together preventability, timing and safe stops.

    Args:
        repository: The database.
        campaign: The campaign.
        concept: That judged it.
        figures: Its executed runs.
        commands: Complete a command line, and reproduce a run.
    """
    complete, replay = commands
    known, short = repository.hindsight, campaign.id[:10]
    budgeted = [item.id for item in concept.requirements if item.fdti or item.frti]
    exercised = known.exercised(campaign.id, budgeted)
    return model.Assessment(
        preventability=preventability_of(
            known.benchmarks.comparisons(campaign.id),
            (len(figures), known.benchmarks.open_contacts(campaign.id)),
            (complete(f"adeye preventability {short}"), replay),
        ),
        timing=timing_of(
            concept,
            figures,
            (known.injections(campaign.id), exercised),
            (complete(f"adeye faults {short} --sample 0"), replay),
        ),
        safe_stops=safe_stops_of(
            figures,
            lambda ordinal: repository.find_run(str(ordinal), campaign=campaign.id).result_digest,
            replay,
        ),
    )
