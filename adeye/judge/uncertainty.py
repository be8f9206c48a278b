"""Numeric uncertainty: what halving the step changes, and what that means for a verdict.

The uncertainty of a number is the 95th percentile of |value(step) - value(step/2)| over a sample
of situations: the smallest difference that at least 95 % of the pairs do not exceed (the nearest
rank), so that of fewer than 20 pairs the largest counts. Fewer than ``LEAST_PAIRS`` pairs give
none. A pair counts where both runs have a finite value; where the status changes between the two,
that is counted apart.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from adeye.identity import digest
from adeye.judge.verdict import Verdict
from adeye.signals import Bools, Floats

LEAST_PAIRS: Final = 10
"""Fewest pairs with two values that give an uncertainty."""
RULE: Final = 1
"""Raised when sample, percentile or what counts as a pair changes."""
CONTACT: Final = "contact"
"""Metric and signal that is a truth value: it changes or it does not, there is no amount."""

Kind = Literal["metric", "fsr"]


@dataclass(frozen=True, slots=True)
class Sampled:
    """One number of one run, or why there is none.

    Attributes:
        value: Value of a metric, or margin of an FSR; None where there is none.
        status: Status of the metric, or verdict of the FSR.
        unit: Of the value.
    """

    value: float | None
    status: str
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Difference:
    """What halving the step changed in one number, over the pairs of a sample.

    Attributes:
        kind: Of a metric, or of the margin of an FSR.
        name: Column of the metric, or id of the FSR.
        unit: Of the differences.
        sampled: Pairs.
        pairs: Those with a value in both runs.
        p95: 95th percentile of the differences; None without any.
        largest: Largest difference.
        differing: Pairs whose status is another one.
        changes: How many, by the two statuses.
    """

    kind: Kind
    name: str
    unit: str
    sampled: int
    pairs: int
    p95: float | None
    largest: float | None
    differing: int
    changes: Mapping[str, int]

    @property
    def uncertainty(self) -> float | None:
        """The numeric uncertainty; None of too few pairs, which is not zero."""
        return self.p95 if self.pairs >= LEAST_PAIRS else None


@dataclass(frozen=True, slots=True)
class NumericUncertainty:
    """What the margins of an FSR are held against in one scenario and architecture.

    Attributes:
        digest: Identity of judging the FSR with it, see ``judged_digest``.
        least: Uncertainty by unit of the margin; a unit that is not there has none.
    """

    digest: str
    least: Mapping[str, float]

    def __post_init__(self) -> None:
        for unit, value in self.least.items():
            if not (math.isfinite(value) and value >= 0.0):
                msg = f"a numeric uncertainty of {value} {unit}".rstrip()
                raise ValueError(msg)

    def of(self, units: Sequence[str | None]) -> Floats:
        """Give the uncertainty for each unit, 0 where there is none."""
        return np.array([self.least.get(unit or "", 0.0) for unit in units], dtype=np.float64)


def judged_digest(fsr_digest: str, results: Iterable[str]) -> str:
    """Identify judging an FSR with the uncertainty that a sample of runs has.

    Args:
        fsr_digest: Identity of what is judged without it.
        results: Result digests of the sampled runs; those of their twins follow from them.
    """
    sample = {"rule": RULE, "runs": sorted(results)}
    return digest({"fsr": fsr_digest, "half_step": sample})


def is_uncertain(is_pass: Bools, margin: Floats, least: Floats) -> Bools:
    """Tell which verdicts are INCONCLUSIVE because their margin is below the uncertainty.

    Args:
        is_pass: (R,) whether the FSR holds.
        margin: (R,) NaN where nothing is measured, which stays as it is.
        least: (R,) uncertainty in the unit of the margin.
    """
    return is_pass & (margin < least)


def verdict_with(
    verdict: Verdict, margin: float | None, unit: str | None, uncertainty: NumericUncertainty
) -> Verdict:
    """Give what one verdict is with a numeric uncertainty.

    Args:
        verdict: Without it.
        margin: Its margin; None where nothing is measured.
        unit: Unit of the margin.
        uncertainty: Of the FSR in the scenario and architecture of the run.

    >>> uncertainty = NumericUncertainty("", {"m": 0.1})
    >>> verdict_with(Verdict.PASS, 0.05, "m", uncertainty).value
    'INCONCLUSIVE'
    """
    least = uncertainty.of([unit])
    of_margin = np.array([np.nan if margin is None else margin])
    is_pass = np.array([verdict is Verdict.PASS])
    return Verdict.INCONCLUSIVE if is_uncertain(is_pass, of_margin, least)[0] else verdict


def uncertain_detail(least: float, unit: str | None) -> str:
    """Say why a verdict is INCONCLUSIVE."""
    return f"margin below the numeric uncertainty of {least:g} {unit or ''}".rstrip()


def percentile_95(differences: Sequence[float]) -> float:
    """Give the smallest of some numbers that at least 95 % of them do not exceed.

    Raises:
        ValueError: There is none, or one of them is not finite.

    >>> percentile_95([float(number) for number in range(1, 20)])
    19.0
    >>> percentile_95([float(number) for number in range(1, 21)])
    19.0
    """
    if not differences or not all(math.isfinite(item) for item in differences):
        msg = f"no percentile of {list(differences)}"
        raise ValueError(msg)
    # The rank is a quotient of whole numbers, rounded up.
    return sorted(differences)[-(-95 * len(differences) // 100) - 1]


def sampled_metric(
    name: str, value: float | None, status: str, unit: str, cap: float | None = None
) -> Sampled:
    """Read the value of a metric; beyond its cap there is no conflict."""
    if cap is not None and value is not None and value > cap:
        status = "no_conflict"
    if name == CONTACT and status == "value":
        return Sampled(None, "contact" if value else "no contact", unit)
    return Sampled(value if status == "value" else None, status, unit)


def sampled_margin(
    verdict: Verdict, margin: float | None, unit: str | None, signal: str | None, detail: str | None
) -> Sampled:
    """Read the margin of a verdict; that of "no conflict" is a cap and says nothing of the step."""
    is_free = "no conflict" in (detail or "")
    is_settled = verdict in {Verdict.PASS, Verdict.FAIL}
    has_value = is_settled and not is_free and signal != CONTACT
    status = f"{verdict.value}, no conflict" if is_free else verdict.value
    return Sampled(margin if has_value else None, status, unit or "")


def differences(
    kind: Kind, name: str, pairs: Sequence[tuple[Sampled | None, Sampled | None]]
) -> list[Difference]:
    """Compare runs with their twins.

    Args:
        kind: Of a metric, or of the margin of an FSR.
        name: Column of the metric, or id of the FSR.
        pairs: Run and twin; None for one of which nothing is known.

    Returns:
        One entry for each unit: a formula has the margin of whichever predicate decides. Pairs
        without a value stand with those that have one, if these have one unit.
    """
    groups: dict[str, list[tuple[Sampled, Sampled]]] = defaultdict(list)
    valued = {item.unit for pair in pairs for item in pair if item and item.value is not None}
    only = next(iter(valued)) if len(valued) == 1 else None
    for first, second in pairs:
        missing = Sampled(None, "missing", "" if first is None else first.unit)
        unit = (first or second or missing).unit if only is None else only
        groups[unit].append((first or missing, second or missing))
    return [_difference(kind, name, unit, found) for unit, found in sorted(groups.items())]


def _difference(
    kind: Kind, name: str, unit: str, pairs: Sequence[tuple[Sampled, Sampled]]
) -> Difference:
    changes: Counter[str] = Counter()
    found: list[float] = []
    for first, second in pairs:
        before, after = first.status, second.status
        is_alike = first.unit == second.unit == unit
        if first.unit != second.unit and first.value is not None and second.value is not None:
            before, after = f"{before} in {first.unit}", f"{after} in {second.unit}"
        if before != after:
            changes[f"{before} → {after}"] += 1
        if is_alike and _is_finite(first) and _is_finite(second):
            assert first.value is not None
            assert second.value is not None
            found.append(abs(first.value - second.value))
    return Difference(
        kind=kind,
        name=name,
        unit=unit,
        sampled=len(pairs),
        pairs=len(found),
        p95=percentile_95(found) if found else None,
        largest=max(found, default=None),
        differing=sum(changes.values()),
        changes=dict(sorted(changes.items())),
    )


def _is_finite(item: Sampled) -> bool:
    return item.value is not None and math.isfinite(item.value)
