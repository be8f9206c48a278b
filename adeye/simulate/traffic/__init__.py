"""The simulated world around the ego, behind one protocol: make an implementation by its name.

No sensor and no channel is known here. Begin with ``stage``, which all implementations share.
"""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Final, Protocol, cast

from adeye.errors import UsageError, require_known, suggest
from adeye.ports import TrafficBackend

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.simulate.traffic.stage import Ending

__all__ = ["BACKENDS", "VARIANTS", "Traffic", "make_traffic", "variant_of"]

BACKENDS: Final = {
    "highway": ("adeye.simulate.traffic.highway", "HighwayTraffic"),
    "batch": ("adeye.simulate.traffic.batch", "BatchTraffic"),
}
"""Module and class behind each name; imported when it is made, never before."""

VARIANTS: Final = {
    "highway": {"highway-env": f"highway-env-{version('highway-env')}"},
    "batch": {"reference": "reference-1", "fast": "fast-2"},
}
"""Kinds of arithmetic of each implementation, the first one unless another is asked for; with the
number of their version, which is raised whenever their bits change on purpose."""


class Traffic(TrafficBackend, Protocol):
    """A traffic implementation, and how far its runs have come."""

    base_dir: Path
    scenario_dir: Path

    def close(self) -> None:
        """End what moves vehicles outside of this process."""

    @property
    def ending(self) -> Ending:
        """Which runs have ended, and up to which row their obligations may start."""


def make_traffic(name: str, variant: str | None = None) -> Traffic:
    """Make a traffic implementation.

    Args:
        name: One of ``BACKENDS``.
        variant: One of its ``VARIANTS``, with or without its version; None for the first.

    Raises:
        UsageError: There is none of that name, or it has no such variant.
    """
    chosen = _find(name, variant)
    module, kind = BACKENDS[name]
    make = getattr(import_module(module), kind)
    return cast("Traffic", make(chosen) if len(VARIANTS[name]) > 1 else make())


def variant_of(name: str, variant: str | None = None) -> str:
    """Name the arithmetic that an implementation would run with, without importing it.

    Args:
        name: One of ``BACKENDS``.
        variant: One of its ``VARIANTS``, with or without its version; None for the first.

    Raises:
        UsageError: There is none of that name, or it has no such variant.
    """
    chosen = _find(name, variant)
    return VARIANTS[name][chosen]


def _find(name: str, variant: str | None) -> str:
    """Return the variant without its version."""
    require_known([name], BACKENDS, lambda name: f"there is no traffic {name!r}")
    known = VARIANTS[name]
    if variant is None:
        return next(iter(known))
    for short, full in known.items():
        if variant in (short, full):
            return short
    raise UsageError(f"traffic {name!r} has no variant {variant!r}", remedy=suggest(variant, known))
