"""What an architecture consists of: its cost, its sensors, what it has beyond another."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

from adeye.report.comparison import Cost

if TYPE_CHECKING:
    from collections.abc import Mapping


def cost_of(content: Mapping[str, Any]) -> Cost | None:
    """Add up what an architecture costs.

    Its own ``cost`` is the total where it covers that of the parts, and the rest is what has no
    part. Where the parts cost more, as after a part was added, their sum is the total.

    Args:
        content: The architecture.

    Returns:
        None if neither is declared: what costs nothing is not known to be cheap.

    >>> cost_of({"cost": 300.0, "sensors": {"camera": {"cost": 120.0}}, "channels": {}}).total
    300.0
    """
    parts = {
        f"{kind}.{name}": float(part["cost"])
        for kind in ("sensors", "channels")
        for name, part in content[kind].items()
        if part["cost"] > 0.0
    }
    declared = float(content["cost"])
    total = max(declared, sum(parts.values()))
    return Cost(total=total, declared=declared, parts=parts) if total > 0.0 else None


def measuring(content: Mapping[str, Any]) -> list[str]:
    """List the sensors that measure and feed a channel."""
    linked = {link for channel in content["channels"].values() for link in channel["links"]}
    return [
        name
        for name, sensor in content["sensors"].items()
        if name in linked and sensor["kind"] not in {"ground_truth", "localisation"}
    ]


def suite_of(content: Mapping[str, Any]) -> dict[str, int]:
    """Count the sensors that measure and feed a channel, by kind."""
    return dict(Counter(content["sensors"][name]["kind"] for name in measuring(content)))


def extra_sensor(more: Mapping[str, Any], less: Mapping[str, Any]) -> str | None:
    """Name the one sensor that an architecture has beyond another that is equal in all else.

    Args:
        more: Executable part of the one.
        less: Executable part of the other.
    """
    extra = [name for name in more["sensors"] if name not in less["sensors"]]
    if len(extra) != 1 or len(more["sensors"]) != len(less["sensors"]) + 1:
        return None
    gone = {extra[0], f"health.{extra[0]}"}
    without = {
        **more,
        "sensors": {key: item for key, item in more["sensors"].items() if key != extra[0]},
        "channels": {
            key: {**item, "links": [link for link in item["links"] if link not in gone]}
            for key, item in more["channels"].items()
        },
    }
    return extra[0] if without == dict(less) else None
