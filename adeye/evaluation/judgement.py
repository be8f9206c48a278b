"""The verdicts of one FSR on a batch of runs, as columns, and the record of one run."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.evaluation.verdict import Verdict

if TYPE_CHECKING:
    from adeye.signals import Bools, Floats, Ints

VERDICTS: Final = tuple(verdict for verdict in Verdict if verdict is not Verdict.NOT_RUN)
"""Verdicts that a run can have, by code."""
PASS, FAIL, INCONCLUSIVE, VACUOUS, INVALID, ERROR = range(6)

LOW, HIGH, MARGIN, TIME, VALUE, THRESHOLD = range(6)
"""Columns of ``JudgementColumns.numbers``."""

Binding = tuple[str | None, str | None, str | None]
"""Unit, signal and predicate."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """The verdict of one FSR on one run with its binding predicate.

    Attributes:
        fsr_id: Id of the requirement.
        fsr_digest: Identity of what was judged.
        verdict: What the run means for the FSR; never NOT_RUN.
        is_exercised: Whether the precondition held.
        robustness_low: Lower end of the robustness, None where there is none; may be infinite.
        robustness_high: Upper end.
        margin: Distance to the threshold in ``unit``, negative when violated: the least of what a
            formula asks for at the rows at which its precondition held. None where it never did
            and where nothing is measured: what is true or false, equal or not.
        unit: Unit of margin, value and threshold.
        signal: Signal or metric of the binding predicate.
        predicate: Its text.
        time_s: Its time [s].
        actor: Its object, by name.
        value: Its value; a truth value is 0 or 1.
        threshold: Its threshold.
        detail: Why, in words.
    """

    fsr_id: str
    fsr_digest: str
    verdict: Verdict
    is_exercised: bool
    robustness_low: float | None = None
    robustness_high: float | None = None
    margin: float | None = None
    unit: str | None = None
    signal: str | None = None
    predicate: str | None = None
    time_s: float | None = None
    actor: str | None = None
    value: float | None = None
    threshold: float | None = None
    detail: str | None = None


@dataclass(frozen=True, slots=True)
class JudgementColumns:
    """The verdicts of one FSR on the runs that it concerns.

    Attributes:
        fsr_id: Id of the requirement.
        fsr_digest: Identity of what was judged.
        runs: (R,) rows of the trace, ascending.
        verdict: (R,) index into ``VERDICTS``.
        exercised: (R,) whether the precondition held.
        numbers: (R, 6) see ``LOW`` and its neighbours; NaN for none.
        actor: (R,) index of the object, -1 for none.
        binding: (R,) index into ``bindings``.
        bindings: Unit, signal and predicate.
        detail: (R,) index into ``details``.
        details: Why, in words.
        objects: Names of the objects.
    """

    fsr_id: str
    fsr_digest: str
    runs: Ints
    verdict: Ints
    exercised: Bools
    numbers: Floats
    actor: Ints
    binding: Ints
    bindings: tuple[Binding, ...]
    detail: Ints
    details: tuple[str | None, ...]
    objects: tuple[str, ...]

    def of_run(self, run: int) -> Judgement | None:
        """Give the verdict on a run; None if the FSR does not concern it."""
        place = int(np.searchsorted(self.runs, run))
        if place == len(self.runs) or self.runs[place] != run:
            return None
        unit, signal, predicate = self.bindings[self.binding[place]]
        low, high, margin, time_s, value, threshold = (
            None if math.isnan(number) else number for number in self.numbers[place].tolist()
        )
        actor = int(self.actor[place])
        return Judgement(
            self.fsr_id,
            self.fsr_digest,
            VERDICTS[self.verdict[place]],
            bool(self.exercised[place]),
            robustness_low=low,
            robustness_high=high,
            margin=margin,
            unit=unit,
            signal=signal,
            predicate=predicate,
            time_s=time_s,
            actor=self.objects[actor] if actor >= 0 else None,
            value=value,
            threshold=threshold,
            detail=self.details[self.detail[place]],
        )
