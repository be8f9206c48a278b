"""How the test cases of a scenario were counted, as it is stored with a campaign."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.spec.distribution import Distribution
from adeye.sweep.statement import axis_words

if TYPE_CHECKING:
    from adeye.spec.odd import Odd
    from adeye.sweep.design import Points


def axes_text(odd: Odd, scenario: str) -> dict[str, str]:
    """Write the axes of a scenario with their levels or distributions.

    Args:
        odd: The ODD.
        scenario: Id of the scenario in it.
    """
    use = next(item for item in odd.scenarios if item.name == scenario)
    axes: dict[str, str] = {}
    for name, axis in use.sweep.parameters.items():
        if isinstance(axis, tuple):
            axes[name] = ", ".join(map(str, axis))
        elif isinstance(axis, Distribution):
            axes[name] = axis_words(axis.model_dump(mode="json"))
        else:
            axes[name] = f"{axis.start} to {axis.to}, step {axis.step}"
    for point in use.sweep.points:
        for name, value in point.items():
            axes[name] = f"{axes[name]}, {value}" if name in axes else str(value)
    return axes


def design_counts(points: Points) -> dict[str, int]:
    """Count what a design looked at for its points, for what may be said about them."""
    if points.drawn is not None:
        return {"drawn": points.drawn, "kept": points.count}
    tuples = points.tuples
    if tuples is None:
        return {}
    return {
        "strength": tuples.strength,
        "tuples": tuples.total,
        "feasible_tuples": tuples.feasible,
    }
