"""A bound on a metric: what an FSR without a formula asks for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from adeye.errors import SpecError, suggest
from adeye.evaluation.metrics import METRICS, MetricDefinition
from adeye.evaluation.stl.check import unit_exponents
from adeye.evaluation.stl.constancy import FAR
from adeye.kernel.relation import differences
from adeye.units import UNITS, Dimension, read_quantity, shown

if TYPE_CHECKING:
    from adeye.errors import SourceLocation
    from adeye.signals import Bools, Floats
    from adeye.spec.concept import Requirement


@dataclass(frozen=True, slots=True)
class Bound:
    """A bound on a metric.

    Attributes:
        column: Id of the metric.
        limit: In the metric's unit.
        is_lower: Whether the metric has to be at least, not at most, the limit.
    """

    column: str
    limit: float
    is_lower: bool

    @property
    def metric(self) -> MetricDefinition:
        """The metric, as registered in this process."""
        return METRICS[self.column]

    def margins(self, values: Floats, is_free: Bools) -> tuple[Floats, Bools]:
        """Give the distances (R,) to the limit in the metric's unit, negative when violated.

        What differs from the limit by rounding only lies on it, with the margin 0; a conflict that
        is farther from the limit than the cap is none.

        Args:
            values: (R,) of the metric.
            is_free: (R,) whether there was no conflict, so that the value is not read.

        Returns:
            The distances, and whether there was no conflict, or one beyond the cap.
        """
        measured = np.where(is_free, 0.0, values)
        ends = (measured, self.limit) if self.is_lower else (self.limit, measured)
        margin, cap = differences(*ends), self.metric.cap
        if cap is None:
            return margin, is_free
        is_free = is_free | (measured - self.limit > cap)
        return np.where(is_free, cap if self.is_lower else -cap, margin), is_free

    @property
    def text(self) -> str:
        """Write it as a predicate."""
        relation = ">=" if self.is_lower else "<="
        unit = "" if self.metric.unit == "1" else f" {self.metric.unit}"
        return f"{self.column} {relation} {self.limit:g}{unit}"


def bound_of(requirement: Requirement, where: SourceLocation | None = None) -> Bound:
    """Find the metric of an FSR with a bound.

    Args:
        requirement: What the concept says.
        where: Place of the bound in the concept's file.

    Raises:
        SpecError: There is no such metric, the bound is not finite, or it was written with a unit
            of something else than the metric's.
    """
    written = requirement.bound
    name = "" if written is None else written.metric
    if written is None or name not in METRICS:
        raise SpecError(
            f"requirement {requirement.id}: there is no metric {name!r}",
            where=where,
            remedy=suggest(name, METRICS),
        )
    limit, text = written.limit, written.written
    if isinstance(limit, str):
        # A parameter without a unit is in the metric's own, like a plain number.
        value = requirement.parameters[limit]
        limit, text = requirement.constants[limit][0], value if isinstance(value, str) else None
    if text is not None:
        _check_unit(requirement.id, name, text, where)
    is_lower = written.at_least is not None
    if limit is None or not math.isfinite(limit):
        raise SpecError(
            f"requirement {requirement.id}: the bound is {limit}",
            where=where,
            remedy="Give a finite number.",
        )
    return Bound(name, float(limit), is_lower)


def check_side(requirement: Requirement, bound: Bound, where: SourceLocation | None) -> None:
    """Refuse a bound that keeps a metric from being good, or that no value violates.

    Raises:
        SpecError: It does, and ``unusual_side`` does not say that it is meant.
    """
    metric, written = bound.metric, requirement.bound
    if written is None or written.unusual_side:
        return
    if bound.is_lower:
        is_wrong, end = metric.worse == "higher", metric.least
        end = -FAR if end is None else end
        cannot_fail = bound.limit <= end
    else:
        is_wrong, end = metric.worse == "lower", metric.most
        end = FAR if end is None else end
        cannot_fail = bound.limit >= end
    if cannot_fail:
        what = f"'{bound.text}' cannot fail: no value is {'below' if bound.is_lower else 'above'}"
        what += f" {end:g}"
    elif is_wrong:
        what = f"'{bound.text}' bounds the harmless side: the {metric.worse} it is, the worse"
    else:
        return
    other = "at_most" if bound.is_lower else "at_least"
    remedy = "Write a limit that can be missed" if cannot_fail else f"Write {other}"
    raise SpecError(
        f"requirement {requirement.id}: {what}",
        where=where,
        remedy=f"{remedy}, or unusual_side: true in the bound if it is meant.",
    )


def _check_unit(name: str, column: str, text: str, where: SourceLocation | None) -> None:
    """Refuse a bound that was written with a unit of something else than its metric."""
    unit = METRICS[column].unit
    wanted, (_, found) = unit_exponents(unit), read_quantity(text)
    known = UNITS.get(unit)
    is_si = known is not None and known.numerator == known.denominator
    if wanted == found and (is_si or found == Dimension.NONE.exponents):
        return
    remedy = "Write a plain number."
    measured = "is a plain number" if wanted == Dimension.NONE.exponents else f"is in {unit}"
    if is_si:
        names = ", ".join(item for item, other in UNITS.items() if other.exponents == wanted)
        remedy = f"Write a plain number in {unit}, or one with a unit ({names})."
    raise SpecError(
        f"requirement {name}: {shown(text)} does not fit metric {column}, which {measured}",
        where=where,
        remedy=remedy,
    )
