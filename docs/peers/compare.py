"""Compare what other tools answered with what adeye says, and write the page about it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from docs.peers.reasons import AD_RSS, CRIME, SUMO, Comparison, Reason
from docs.peers.states import read

if TYPE_CHECKING:
    from collections.abc import Iterator

SAME: Final = 1e-6
"""Difference up to which two numbers agree, relative to the larger one and 1."""

PEERS: Final = {
    "ad-rss": ("ad-rss", AD_RSS),
    "sumo": ("SUMO, SSM device", SUMO),
    "commonroad-crime": ("CommonRoad-CriMe", CRIME),
}


@dataclass
class Result:
    """What came of one comparison.

    Attributes:
        peer: Tool and version.
        comparison: What was compared.
        states: How many.
        agreeing: How many of them agree.
        greatest: Greatest difference of two finite numbers.
        reasons: Reasons with how many states each explains.
        open: States that no reason explains, with both answers.
    """

    peer: str
    comparison: Comparison
    states: int = 0
    agreeing: int = 0
    greatest: float = 0.0
    reasons: dict[Reason, int] = field(default_factory=dict)
    open: list[tuple[list[float], float, float | None]] = field(default_factory=list)


def agree(ours: float, theirs: float, within: float) -> bool:
    """Whether two answers are the same; infinities only as such."""
    if math.isinf(ours) or math.isinf(theirs):
        return ours == theirs
    return abs(ours - theirs) <= within * max(1.0, abs(ours), abs(theirs))


def compared(peer: str, comparison: Comparison, rows: list[list[Any]]) -> Result:
    """Compare one metric on all its states."""
    result = Result(peer, comparison, len(rows))
    for *state, theirs in rows:
        ours = comparison.ours(*state)
        if theirs is not None and math.isfinite(ours) and math.isfinite(theirs):
            result.greatest = max(result.greatest, abs(ours - theirs))
        if agree(ours, comparison.free if theirs is None else theirs, SAME):
            result.agreeing += 1
            continue
        for reason in comparison.reasons:
            answer = reason.answer(*state)
            if answer is None or theirs is None:
                is_so = answer is theirs
            else:
                is_so = agree(answer, theirs, reason.within)
            if is_so:
                result.reasons[reason] = result.reasons.get(reason, 0) + 1
                break
        else:
            result.open.append((state, ours, theirs))
    return result


def results() -> Iterator[Result]:
    """Compare everything that is stored."""
    for peer, (title, comparisons) in PEERS.items():
        found = read(peer)
        for name, metric in found["metrics"].items():
            yield compared(f"{title} {found['version']}", comparisons[name], metric["rows"])


def number(value: float) -> str:
    """Write a difference."""
    return "0" if value == 0.0 else f"{value:.2g}"


def rows() -> list[list[str]]:
    """Give the lines of the table."""
    lines = []
    for found in results():
        of = found.comparison
        why = [f"{count}: {reason.text}" for reason, count in found.reasons.items()]
        if found.open:
            why.append(f"{len(found.open)}: not understood.")
        lines.append(
            [
                found.peer,
                f"{of.name}: `{of.theirs}`",
                str(found.states),
                str(found.agreeing),
                f"{number(found.greatest)} {of.unit}".strip(),
                "<br>".join(why),
            ]
        )
    return lines


HEADERS: Final = (
    "Tool",
    "Metric",
    "States",
    "Agree",
    "Greatest difference",
    "Why the others differ",
)

LEAD: Final = """\
What other tools answer in the same states. Two numbers agree where they differ by no more than
a millionth of the larger one, or of 1; infinities agree with infinities only, and no answer
with no conflict. The greatest difference is that of all pairs of finite numbers. Behind each
count of differences stands its reason: a formula that gives the other tool's answer in each of
those states."""

HOW: Final = """\
The other tools are no part of adeye. What they answered is stored in `docs/peers/answers`; the
table is made from that and from what adeye says now. With one of them installed in an
environment of its own, `python -m docs.peers.ask_rss`, `ask_sumo` or `ask_crime` in a checkout
asks it again.

CommonRoad-CriMe rounds to two digits, and to one where it steps through time; its rounding was
switched off, so that formulas are compared. Not asked: its PET and PSD, which need an
intersection; its TTS and TTR, whose simulated steering takes up to ten seconds a state and
found no way past in the state that was tried; and what adeye does not have. ad-rss and SUMO
were asked as they are.

Where adeye differs it does so on purpose: it keeps signs, lets who brakes to a stop stay there,
looks between the steps of time, and says infinity, not a number that looks harmless, where it
is too late."""


if __name__ == "__main__":
    for item in results():
        for case in item.open[:5]:
            print(item.peer, item.comparison.name, len(item.open), case)  # noqa: T201
