"""What a report says of the step: how far its halving moves margins, and what that means."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.evaluation.uncertainty import Difference


def step_statements(found: Sequence[Difference]) -> tuple[str, ...]:
    """Say what halving the step changes in the margins; nothing where nobody asked.

    Args:
        found: Of every scenario and architecture; those of metrics are left out.
    """
    margins = [item for item in found if item.kind == "fsr"]
    if not margins:
        return ()
    least = [item for item in margins if item.uncertainty is not None]
    worst: dict[tuple[str, str], float] = {}
    for item in least:
        key = item.name, item.unit
        worst[key] = max(worst.get(key, 0.0), item.uncertainty or 0.0)
    largest = ", ".join(
        f"{name} {value:.3g} {unit if unit != '1' else ''}".rstrip()
        for (name, unit), value in sorted(worst.items())
    )
    differing = sum(item.differing for item in margins)
    return (
        "Numeric uncertainty: the 95th percentile of what half the step changes in a margin; a "
        "margin that holds by less is INCONCLUSIVE. Known for "
        f"{len(least)} of {len(margins)} margins of an FSR in a scenario and architecture"
        + (f", at most {largest}" if largest else "")
        + f". The others have too few pairs with two values and are judged without. {differing} "
        "verdicts of the sample change with the step; `adeye uncertainty` lists all.",
    )
