"""What the design of a sweep allows to say: a random sample, or chosen points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

RANDOM: Final = "random"
"""The one design that is a sample: uniform between the ends, unless a distribution is declared."""

DECLARED: Final = "random, declared"
"""The same with a declared distribution of at least one axis."""

SHARED: Final = (
    "Every count is over test cases that the compared architectures share and that were executed "
    "for all of them: the same situation, fault entry and replicate, with the same random numbers. "
    "What was not executed is listed and counted nowhere. VACUOUS never counts as PASS. What is "
    "undecided is listed apart; the front counts it as if it had failed."
)
SAMPLE: Final = (
    "{scenarios}: points drawn uniformly between the ends of each axis. Intervals and p-values are "
    "about that distribution, this simulation and these architectures. The drawn point is the "
    "unit and fails if any of its runs does; one that is undecided or lacks a run counts against a "
    "difference. p-values are adjusted for their number (Holm), intervals are not."
)
GRID: Final = (
    "{scenarios}: chosen points, not a random sample. Counts, worst cases and differences are "
    "about these test cases only; there is no interval and no p-value."
)
REPORTED_SAMPLE: Final = (
    "{scenarios}: points drawn uniformly between the ends of each axis, a random sample of that "
    "distribution and of no other: how often such situations occur on the road is not in it, so a "
    "share of failing test cases is no probability of failure on the road."
)
UNIFORM: Final = "drawn uniformly between the ends of each axis"
STATED: Final = (
    "drawn from the declared distribution of each axis (uniform between its ends where there is "
    "none), given the relations of the sweep"
)
"""What is said in place of ``UNIFORM`` where a distribution is declared."""

REPORTED_GRID: Final = (
    "{scenarios}: a designed set of points, not a random sample: it gives coverage, worst cases "
    "and boundaries, and no probability of failure."
)


def designs_of(odd: Mapping[str, Any]) -> dict[str, str]:
    """Give the design of every scenario by its id in the ODD.

    Args:
        odd: Stored content of the ODD.
    """
    return {
        str(use.get("as") or use["use"]): _design(use["sweep"]) for use in odd["odd"]["scenarios"]
    }


def _design(sweep: Mapping[str, Any]) -> str:
    axes = sweep.get("parameters", {}).values()
    declared = any(isinstance(axis, dict) and "from" not in axis for axis in axes)
    is_declared = sweep["design"] == RANDOM and declared
    return DECLARED if is_declared else str(sweep["design"])


def is_sample(design: str) -> bool:
    """Tell whether the points of a design are a random sample of a declared distribution.

    >>> is_sample("random"), is_sample("full_factorial")
    (True, False)
    """
    return design in {RANDOM, DECLARED}


def spoken_of(
    designs: Mapping[str, str], scenarios: Iterable[str], *, drawn: str = SAMPLE, fixed: str = GRID
) -> tuple[str, ...]:
    """Say what may be concluded from the points of some scenarios.

    Args:
        designs: Design by scenario.
        scenarios: Those that are spoken of.
        drawn: What is said of a random sample; ``{scenarios}`` are their names.
        fixed: What is said of every other design.

    Returns:
        One statement for each kind of design that occurs.
    """
    stated = drawn.replace(UNIFORM, STATED)
    names: dict[str, list[str]] = {drawn: [], stated: [], fixed: []}
    for name in scenarios:
        text = {RANDOM: drawn, DECLARED: stated}.get(designs[name], fixed)
        names[text].append(name)
    return tuple(text.format(scenarios=", ".join(found)) for text, found in names.items() if found)
