"""What the design of a sweep is: a random sample of a declared population, or chosen points.

Whoever states a probability asks here first, on the stored content of an ODD. Only independent
draws from a declared distribution give intervals; other designs give coverage and worst cases.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from adeye.spec.expression import parse

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from adeye.spec.odd import DesignKind

RANDOM: Final = "random"
"""The one design whose points are independent draws from the declared distributions."""


@dataclass(frozen=True, slots=True)
class DesignStatement:
    """What may be said about the points of one scenario.

    Attributes:
        kind: The design.
        is_random_sample: Whether its points are independent draws from the declared population, so
            that intervals and p-values exist.
        distributions: How each axis is distributed, in words, by its name; of chosen points: empty.
        is_declared: Whether any distribution was written down; else each axis is uniform between
            its ends.
        is_conditional: Whether relations cut the distributions off, so that the population is the
            one given that they hold.
        relations: Those, as written.
        drawn: Draws that were looked at for the sample; None if it was not recorded.
        excluded_share: Share of these that the relations excluded; None if it was not recorded,
            and of chosen points.
        population: The population in one sentence, or what the points are if there is none.
    """

    kind: DesignKind
    is_random_sample: bool
    distributions: Mapping[str, str]
    is_declared: bool
    is_conditional: bool
    relations: tuple[str, ...]
    drawn: int | None
    excluded_share: float | None
    population: str


def design_statement(
    odd: Mapping[str, Any], scenario: str, factors: Iterable[Mapping[str, Any]] = ()
) -> DesignStatement:
    """State what the points of a scenario are, from what a campaign stores.

    Args:
        odd: Stored content of the ODD and everything that it names.
        scenario: Id of the scenario in the ODD.
        factors: How the campaign's test cases were counted, ``CampaignInfo.factors``; without it
            the number of excluded draws is not known.

    Raises:
        KeyError: The ODD does not use the scenario.
    """
    sweep = _use(odd, scenario)["sweep"]
    kind: DesignKind = sweep["design"]
    axes: Mapping[str, Any] = sweep["parameters"]
    is_sampled = sweep.get("samples") is not None
    distributions = {name: axis_words(axis) for name, axis in axes.items()} if is_sampled else {}
    relations = _relations(odd, scenario, sweep, axes) if is_sampled else ()
    drawn = next((item.get("drawn") for item in factors if item["scenario"] == scenario), None)
    kept = next((item.get("kept") for item in factors if item["scenario"] == scenario), None)
    share = None if not drawn or kept is None else 1.0 - kept / drawn
    if is_sampled and not relations:
        share = 0.0
    return DesignStatement(
        kind=kind,
        is_random_sample=kind == RANDOM,
        distributions=distributions,
        is_declared=any(isinstance(axis, dict) and "from" not in axis for axis in axes.values()),
        is_conditional=bool(relations),
        relations=relations,
        drawn=drawn,
        excluded_share=share,
        population=_population(kind, distributions, relations, share),
    )


def axis_words(axis: Any) -> str:
    """Say how a stored axis of a sample is distributed.

    >>> axis_words(["80 km/h", "120 km/h"])
    'uniform from 80 km/h to 120 km/h'
    >>> axis_words({"normal": {"mean": "30 m", "sd": "5 m", "min": "10 m"}})
    'normal with mean 30 m and standard deviation 5 m, not below 10 m'
    >>> axis_words({"choice": {"day": 0.8, "night": 0.2}})
    'day 0.8, night 0.2'
    """
    if not isinstance(axis, dict):
        return _between(axis)
    if "from" in axis:
        return _between((axis["from"], axis["to"]))
    if "uniform" in axis:
        return _between(axis["uniform"])
    if "choice" in axis:
        return ", ".join(f"{value} {weight:g}" for value, weight in axis["choice"].items())
    if "empirical" in axis:
        return f"each value in column {axis['column']} of {axis['empirical']} as likely"
    if "normal" in axis:
        law = axis["normal"]
        words = f"normal with mean {law['mean']} and standard deviation {law['sd']}"
    else:
        law = axis["lognormal"]
        words = f"lognormal with median {law['median']} and sigma {law['sigma']:g}"
    return words + "".join(
        f", not {side} {law[end]}"
        for end, side in (("min", "below"), ("max", "above"))
        if end in law
    )


def _between(levels: Sequence[Any]) -> str:
    """Levels of a sample are not its points: it is uniform between the least and the largest."""
    from adeye.sweep.axes import quantity_or_text

    ordered = sorted(levels, key=lambda level: float(quantity_or_text(level)[0]))
    return f"uniform from {ordered[0]} to {ordered[-1]}"


def _use(odd: Mapping[str, Any], scenario: str) -> Mapping[str, Any]:
    for use in odd["odd"]["scenarios"]:
        if (use.get("as") or use["use"]) == scenario:
            found: Mapping[str, Any] = use
            return found
    raise KeyError(scenario)


def _relations(
    odd: Mapping[str, Any], scenario: str, sweep: Mapping[str, Any], axes: Mapping[str, Any]
) -> tuple[str, ...]:
    """List the relations that name an axis; the others hold everywhere or nowhere."""
    constraints = odd["scenarios"][scenario].get("constraints", ())
    return tuple(
        text for text in (*sweep["where"], *constraints) if not parse(text).names.isdisjoint(axes)
    )


def _population(
    kind: str, distributions: Mapping[str, str], relations: Sequence[str], share: float | None
) -> str:
    if not distributions:
        return "chosen points, not a random sample: no population, no probability"
    axes = "; ".join(f"{name} {words}" for name, words in distributions.items())
    given = ""
    if relations:
        excluded = "" if share is None else f", which excluded {share:.1%} of the draws"
        given = f", given {' and '.join(relations)}{excluded}"
    if kind == RANDOM:
        return f"independent draws: {axes}{given}"
    return (
        f"a space-filling design ({kind}) over: {axes}{given}; its points depend on each other, so "
        "no interval and no probability"
    )
