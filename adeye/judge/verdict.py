"""Verdicts: what a run and a set of runs mean for an FSR, and the exit code that follows.

Nothing here says yes by accident: an empty selection, a run that never exercised its precondition
and a planned run without a result all fold to something other than PASS.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from types import MappingProxyType
from typing import Final


class Outcome(StrEnum):
    """What happened to a run; says nothing about an FSR."""

    COMPLETED = "completed"
    CHANNEL_ERROR = "channel_error"
    CHANNEL_TIMEOUT = "channel_timeout"
    CHANNEL_INVALID_OUTPUT = "channel_invalid_output"
    CHANNEL_KILLED = "channel_killed"
    NOT_REALISED = "not_realised"
    INFRASTRUCTURE_ERROR = "infrastructure_error"

    @property
    def is_judged(self) -> bool:
        """Whether FSRs are evaluated on the run; a failing channel does not prevent it."""
        return self not in {Outcome.NOT_REALISED, Outcome.INFRASTRUCTURE_ERROR}


class Verdict(StrEnum):
    """What a run, or a fold of runs, means for an FSR."""

    PASS = "PASS"  # noqa: S105 - a verdict, not a password
    FAIL = "FAIL"
    INCONCLUSIVE = "INCONCLUSIVE"
    VACUOUS = "VACUOUS"
    INVALID = "INVALID"
    ERROR = "ERROR"
    NOT_RUN = "NOT_RUN"


VERDICTS: Final = tuple(verdict for verdict in Verdict if verdict is not Verdict.NOT_RUN)
"""Verdicts that a run can have, by code."""
PASS, FAIL, INCONCLUSIVE, VACUOUS, INVALID, ERROR = range(6)

STATUSES: Final = ("value", "no_conflict", "not_applicable", "undefined", "incomplete", "error")
"""What a metric says of a run, by code."""


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


WAIVABLE = frozenset({Verdict.INVALID, Verdict.INCONCLUSIVE, Verdict.NOT_RUN})
"""Verdicts of a run that a waiver (an id with an expiry date) may set aside in a fold."""

_RUN_ORDER = (
    Verdict.FAIL,
    Verdict.ERROR,
    Verdict.INVALID,
    Verdict.INCONCLUSIVE,
    Verdict.NOT_RUN,
)
_FSR_ORDER = (*_RUN_ORDER, Verdict.VACUOUS, Verdict.PASS)
WORST_FIRST: Final = (*_RUN_ORDER, None, Verdict.VACUOUS, Verdict.PASS)
"""Verdicts as they are listed; None is "not applicable", which is an error in the gate."""


def urgency(verdict: Verdict | None, *, mandatory: bool) -> tuple[bool, int]:
    """Return the key that every list of FSRs is sorted by, in the terminal and in each report.

    What is mandatory comes before what is not, as only that blocks; then the worst verdict. What is
    alike keeps the order of ODD and concept, which the sort has to be given: margins are in
    different units, so that none of two FSRs is further from its threshold than the other.

    Args:
        verdict: Folded; None where the FSR is not applicable.
        mandatory: Whether the gate needs it.

    >>> urgency(Verdict.PASS, mandatory=True) < urgency(Verdict.FAIL, mandatory=False)
    True
    """
    return not mandatory, WORST_FIRST.index(verdict)


def _count(verdicts: Mapping[Verdict, int] | Iterable[Verdict]) -> dict[Verdict, int]:
    """Count verdicts; refuse what is not a verdict and counts below zero."""
    pairs = verdicts.items() if isinstance(verdicts, Mapping) else Counter(verdicts).items()
    counts: dict[Verdict, int] = {}
    for verdict, count in pairs:
        if count < 0:
            msg = f"{verdict}: a count of runs cannot be {count}"
            raise ValueError(msg)
        if count > 0:
            counts[Verdict(verdict)] = count
    return counts


def _open_after_waivers(
    counts: Mapping[Verdict, int], waived: Mapping[Verdict, int]
) -> dict[Verdict, int]:
    for verdict, count in waived.items():
        if verdict not in WAIVABLE:
            msg = f"a run with verdict {verdict} cannot be waived; only {sorted(WAIVABLE)} can"
            raise ValueError(msg)
        if not 0 <= count <= counts.get(verdict, 0):
            msg = (
                f"{count} runs waived as {verdict}, but {counts.get(verdict, 0)} have that verdict"
            )
            raise ValueError(msg)
    return {verdict: count - waived.get(verdict, 0) for verdict, count in counts.items()}


def fold_runs(
    verdicts: Mapping[Verdict, int] | Iterable[Verdict],
    *,
    min_exercised: int = 1,
    waived: Mapping[Verdict, int] = MappingProxyType({}),
    repeated: int = 0,
) -> Verdict:
    """Fold the verdicts of one FSR over its runs.

    FAIL if any run failed; else ERROR; else INVALID, INCONCLUSIVE, NOT_RUN, the first that is
    present and not waived; else PASS if at least ``min_exercised`` different results pass; else
    VACUOUS. A VACUOUS run is neutral. No runs at all are NOT_RUN.

    Args:
        verdicts: Verdict of every planned run, or the number of runs per verdict.
        min_exercised: Results that must PASS, at least 1.
        waived: Number of runs set aside by a waiver in force, per verdict.
        repeated: Runs that PASS and repeat the result of another one, which counts once.

    Raises:
        ValueError: Negative counts, ``min_exercised`` below 1, a waiver of a verdict that cannot
            be waived, or more waivers than runs.
    """
    if min_exercised < 1:
        msg = f"min_exercised is {min_exercised}; an FSR that no run exercised cannot pass"
        raise ValueError(msg)
    counts = _count(verdicts)
    remaining = _open_after_waivers(counts, waived)
    if not counts:
        return Verdict.NOT_RUN
    for verdict in _RUN_ORDER:
        if remaining.get(verdict, 0) > 0:
            return verdict
    passed = remaining.get(Verdict.PASS, 0)
    # Whatever repeats what: of runs that PASS, one result is left.
    is_enough = max(passed - repeated, min(passed, 1)) >= min_exercised
    return Verdict.PASS if is_enough else Verdict.VACUOUS


def exercised_of(verdict: Verdict | None, exercised: int, runs: int, needed: int | None) -> str:
    """Say of how many runs an FSR was exercised in so many: of all, or of those that it lacks.

    Args:
        verdict: Folded over the runs.
        exercised: Runs that exercised it.
        runs: Runs planned.
        needed: ``min_exercised``; None where it is not asked for.

    >>> exercised_of(Verdict.PASS, 2, 3, 2), exercised_of(Verdict.VACUOUS, 2, 2, 30)
    ('2 of 3', '2 of 30 needed')
    """
    if verdict is Verdict.VACUOUS and (needed or 1) > 1:
        return f"{exercised:,} of {needed:,} needed"
    return f"{exercised:,} of {runs:,}"


def fold_fsrs(verdicts: Iterable[Verdict]) -> Verdict:
    """Fold the verdicts of several FSRs: the first that is present.

    The order is FAIL, ERROR, INVALID, INCONCLUSIVE, NOT_RUN, VACUOUS, PASS. No FSR at all is
    NOT_RUN.
    """
    present = {Verdict(verdict) for verdict in verdicts}
    return next((verdict for verdict in _FSR_ORDER if verdict in present), Verdict.NOT_RUN)


class ExitCode(IntEnum):
    """Exit status of the verbs that judge."""

    OK = 0
    FAILED = 1
    USAGE = 2
    INCOMPLETE = 3
    INTEGRITY = 4
    ENVIRONMENT = 5
    INTERRUPTED = 130
    TERMINATED = 143

    @property
    def meaning(self) -> str:
        """One line for people; a message names every code that applies."""
        return _MEANINGS[self]


_MEANINGS = {
    ExitCode.OK: "all good",
    ExitCode.FAILED: "an FSR failed or regressed",
    ExitCode.USAGE: "usage or input error",
    ExitCode.INCOMPLETE: "evidence incomplete",
    ExitCode.INTEGRITY: "integrity or determinism violated",
    ExitCode.ENVIRONMENT: "environment (database, disk)",
    ExitCode.INTERRUPTED: "interrupted",
    ExitCode.TERMINATED: "terminated",
}

_EXIT_ORDER = (
    ExitCode.INTERRUPTED,
    ExitCode.TERMINATED,
    ExitCode.ENVIRONMENT,
    ExitCode.INTEGRITY,
    ExitCode.USAGE,
    ExitCode.FAILED,
    ExitCode.INCOMPLETE,
    ExitCode.OK,
)


def exit_code(codes: Iterable[ExitCode]) -> ExitCode:
    """Combine the exit codes that apply; none at all is INCOMPLETE, never OK."""
    present = {ExitCode(code) for code in codes}
    return next((code for code in _EXIT_ORDER if code in present), ExitCode.INCOMPLETE)


def exit_of_verdict(verdict: Verdict) -> ExitCode:
    """Give the exit code that one folded verdict calls for."""
    if verdict is Verdict.PASS:
        return ExitCode.OK
    return ExitCode.FAILED if verdict is Verdict.FAIL else ExitCode.INCOMPLETE


def gate_exit(
    verdicts: Mapping[str, Iterable[Verdict]], *, planned: int, accounted: int
) -> ExitCode:
    """Decide the gate: OK only if every mandatory FSR passes for every architecture in it.

    Args:
        verdicts: For each architecture in the gate, the folded verdict of every mandatory FSR.
        planned: Number of test cases planned.
        accounted: Number of them with a result or a waiver.

    Returns:
        OK; FAILED if an FSR failed; INTEGRITY if more is accounted for than was planned;
        INCOMPLETE for everything else, also for an empty plan, gate or concept.
    """
    codes = [ExitCode.OK if 0 < planned <= accounted else ExitCode.INCOMPLETE]
    if accounted > planned:
        codes.append(ExitCode.INTEGRITY)
    if not verdicts:
        codes.append(ExitCode.INCOMPLETE)
    codes.extend(exit_of_verdict(fold_fsrs(of_fsrs)) for of_fsrs in verdicts.values())
    return exit_code(codes)
