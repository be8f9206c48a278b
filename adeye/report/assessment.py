"""What a report tells of a campaign beyond its verdicts, read from the database."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np

from adeye.judge.preventability import Comparison, tabulate_cells
from adeye.kernel.stops import CONTACT, SCALE
from adeye.report.model import assessment as model
from adeye.report.timing import by_fault, timing_of
from adeye.signals import Bools, Floats
from adeye.spec.concept import Concept
from adeye.store.read.bulk import Figures
from adeye.store.records import CampaignInfo
from adeye.store.repository import Repository

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
