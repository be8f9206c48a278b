"""The command line of a benchmark: rounds, a smoke run, the table, the JSON file."""

from __future__ import annotations

import argparse
import statistics
from typing import TYPE_CHECKING, Any

from support.results import machine, table, write_result

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

Found = list[dict[str, Any]]


def drive(
    name: str,
    doc: str | None,
    measure: Callable[[int, bool], Found],
    headers: Sequence[str],
    row: Callable[[dict[str, Any]], Sequence[str]],
) -> int:
    """Measure, print a table and write the result.

    Args:
        name: Of the benchmark.
        doc: Of its module; the first line is its question.
        measure: From the number of rounds and whether it only smokes to what was found.
        headers: Of the table.
        row: Cells of one thing that was found.
    """
    parser = argparse.ArgumentParser(description=(doc or "").partition("\n")[0])
    parser.add_argument("--smoke", action="store_true", help="one short round")
    parser.add_argument("--rounds", type=int, default=3, help="rounds, at least 3")
    given = parser.parse_args()
    if not given.smoke and given.rounds < 3:
        parser.error("the median of fewer than 3 rounds says nothing")
    found = measure(1 if given.smoke else given.rounds, given.smoke)
    print(table(headers, [row(item) for item in found]))
    if not given.smoke:
        print(f"wrote {write_result(name, {'machine': machine(), 'found': found})}")
    return 0


def ratios(pairs: Sequence[tuple[float, float]]) -> dict[str, float]:
    """Give the median ratio of some pairs, the first over the second, and its ends."""
    found = [one / other for one, other in pairs]
    return {
        "ratio": statistics.median(found),
        "ratio_least": min(found),
        "ratio_most": max(found),
    }


def spread(item: dict[str, Any], digits: int = 2) -> str:
    """Write a ratio with its ends."""
    least, most = item["ratio_least"], item["ratio_most"]
    return f"{item['ratio']:.{digits}f} ({least:.{digits}f} to {most:.{digits}f})"
