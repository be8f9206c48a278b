"""Was a collision preventable? What a run and the drive of a reference driver say together.

Both are results of one situation: the same scenario, parameters, seed and clock, and a car of the
same size. The driver sees the scene as it is and has no parts that fail, so nothing is injected
into its drive. Where either is not known there is no cell, and a gate takes that as preventable.

Source:
    UN Regulation 157, 01 series of amendments, annex 4 appendix 3; ISO 34502:2022, reasonably
    foreseeable and preventable collisions.
"""

from __future__ import annotations

import collections
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Literal, get_args

from adeye.judge.verdict import WAIVABLE, Verdict, fold_runs

# --- Was a collision preventable? What a run and the drive of a reference driver say together -----

BENCHMARK_VERSION: Final = 2
"""Of the architecture that a reference driver is; raised when its drives change on purpose."""

SAME_HAZARD_S: Final = 5.0
"""How far apart two contacts with one road user may be [s]: as long as full braking of a careful
driver takes from 130 km/h. What comes later is another hazard."""

Cell = Literal["both_avoid", "only_ours", "only_model", "neither", "unknown"]
CELLS: Final[tuple[Cell, ...]] = get_args(Cell)
"""Who avoids a contact. ``only_model`` is a finding; ``neither`` is unpreventable by the model."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """A run beside the drive of a reference driver in the same situation.

    Attributes:
        run: Result digest.
        scenario: Id in the ODD.
        architecture: Id.
        fault_entry: ``none``, a fault's id, or ids joined by ``+``.
        model: Reference driver.
        edition: Of its rules.
        drive: Result digest of the drive.
        cell: Who avoids a contact.
        impact_speed_mps: Of the run [m/s]; None without a contact.
        drive_impact_speed_mps: Of the drive [m/s].
    """

    run: str
    scenario: str
    architecture: str
    fault_entry: str
    model: str
    edition: str
    drive: str
    cell: Cell
    impact_speed_mps: float | None
    drive_impact_speed_mps: float | None


@dataclass(frozen=True, slots=True)
class CellCount:
    """Comparisons of a scenario, an architecture and a model by cell.

    Attributes:
        scenario: Id in the ODD.
        architecture: Id.
        model: Reference driver.
        counts: By cell, all of them.
    """

    scenario: str
    architecture: str
    model: str
    counts: Mapping[Cell, int] = field(default_factory=dict)


def cell_of(
    ours: bool | None,  # noqa: FBT001 - a pair of facts
    theirs: bool | None,  # noqa: FBT001
    *,
    is_same: bool = True,
) -> Cell:
    """Return the cell of two contacts.

    Args:
        ours: Whether the run has a contact; None if it is not known, or the scenario did not come
            about.
        theirs: Whether the drive has one.
        is_same: Whether both are with the same road user or object, in one hazard: a driver who is
            run into by another one, or later, may well have avoided what the ego has not.
    """
    if ours is None or theirs is None or (ours and theirs and not is_same):
        return "unknown"
    if ours:
        return "neither" if theirs else "only_model"
    return "only_ours" if theirs else "both_avoid"


def is_conflict(
    contact: bool | None,  # noqa: FBT001 - a metric
    required_mps2: float | None,
    threshold_mps2: float,
) -> bool:
    """Tell whether a run is held against a reference driver: after a contact, or a near one.

    Args:
        contact: Whether the run has one; None if it is not known.
        required_mps2: Its largest required deceleration [m/s²]; None if it has none.
        threshold_mps2: From which on it counts, exclusive [m/s²].
    """
    return contact is not False or (required_mps2 is not None and required_mps2 > threshold_mps2)


def tabulate_cells(found: Iterable[Comparison]) -> tuple[CellCount, ...]:
    """Count comparisons by scenario, architecture and model."""
    counted: dict[tuple[str, str, str], collections.Counter[Cell]] = {}
    for item in found:
        key = (item.scenario, item.architecture, item.model)
        counted.setdefault(key, collections.Counter())[item.cell] += 1
    return tuple(
        CellCount(*key, {name: counter[name] for name in CELLS})
        for key, counter in sorted(counted.items())
    )


def gate_verdict(
    counts: Mapping[Verdict, int],
    failures: Sequence[Mapping[str, Cell]],
    models: Sequence[str],
    *,
    min_exercised: int = 1,
    is_waived: bool = False,
    repeated: int = 0,
) -> tuple[Verdict, int, int]:
    """Fold the verdicts of an FSR for the gate, without the collisions that no model prevents.

    The verdict of the FSR stays FAIL. Fails closed: a failure that is no collision, whose drive is
    missing, or that any of the models prevents, counts as it is; so do all of them if they are not
    those that were counted.

    Args:
        counts: Runs by verdict.
        failures: For each run that FAILs: the cell by model, empty where the failure is none of a
            contact.
        models: Every one of them must be in a contact too.
        min_exercised: Results that must PASS.
        is_waived: Whether a waiver of open runs is in force.
        repeated: Runs that PASS and repeat the result of another one.

    Returns:
        What the gate takes for the verdict, how many failures are set aside, and how many are not
        because the cell is not known.
    """
    aside = sum(
        bool(models) and all(cells.get(model) == "neither" for model in models)
        for cells in failures
    )
    unknown = sum(
        bool(cells) and any(cells.get(model, "unknown") == "unknown" for model in models)
        for cells in failures
    )
    if len(failures) != counts.get(Verdict.FAIL, 0):
        aside = 0
    left = {**counts, Verdict.FAIL: counts.get(Verdict.FAIL, 0) - aside}
    # What is set aside is neutral, and nothing but that is no PASS.
    left[Verdict.VACUOUS] = counts.get(Verdict.VACUOUS, 0) + aside
    waived = {name: left[name] for name in WAIVABLE if is_waived and left.get(name, 0)}
    verdict = fold_runs(left, min_exercised=min_exercised, waived=waived, repeated=repeated)
    return verdict, aside, unknown


# --- Takeovers as decisions of a classifier: the fork with the other decision tells the truth -----

TakeoverClass = Literal["needed_and_done", "late", "spurious", "missed", "not_needed"]
TAKEOVER_CLASSES: Final[tuple[TakeoverClass, ...]] = get_args(TakeoverClass)
"""What a takeover, or doing without, was in hindsight."""

TAKEOVERS_VERSION: Final = 1
"""Raised whenever a class can change although the traces do not."""


@dataclass(frozen=True, slots=True)
class Takeover:
    """A run and its fork with the other decision.

    Attributes:
        took_over: Whether another channel than the default acted in the run.
        violates: Whether the run violates: contact, or off the road.
        fork_violates: Whether its fork does; None where there is no other decision to take.
    """

    took_over: bool
    violates: bool
    fork_violates: bool | None


def classify_takeover(takeover: Takeover) -> TakeoverClass:
    """Say what a decision was in hindsight.

    With a takeover the fork goes on without: it was needed if the fork violates, and came late if
    the run violates nevertheless. Without a takeover the run itself is what happens without.

    Raises:
        ValueError: A run with a takeover has no fork: its truth is not known.

    >>> classify_takeover(Takeover(True, False, True))
    'needed_and_done'
    >>> classify_takeover(Takeover(False, True, False))
    'missed'
    """
    if not takeover.took_over:
        return "missed" if takeover.violates else "not_needed"
    if takeover.fork_violates is None:
        msg = "a takeover without its fork cannot be classified"
        raise ValueError(msg)
    if not takeover.fork_violates:
        return "spurious"
    return "late" if takeover.violates else "needed_and_done"


def precision_of(counts: Mapping[TakeoverClass, int]) -> tuple[int, int]:
    """Give the takeovers that were needed, in time or late, and all of them.

    >>> counts = {"needed_and_done": 6, "late": 1, "spurious": 3, "missed": 2, "not_needed": 9}
    >>> precision_of(counts), recall_of(counts, avoidable=1)
    ((7, 10), (6, 8))
    """
    needed = counts["needed_and_done"] + counts["late"]
    return needed, needed + counts["spurious"]


def recall_of(counts: Mapping[TakeoverClass, int], avoidable: int) -> tuple[int, int]:
    """Give the takeovers that were needed and in time, and the runs that needed one.

    Args:
        counts: Runs by class.
        avoidable: Missed ones that a takeover would have helped; the others needed none.
    """
    done = counts["needed_and_done"]
    return done, done + counts["late"] + avoidable
