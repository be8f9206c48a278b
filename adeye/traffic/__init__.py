"""The simulated world around the ego, behind one protocol: make an implementation by its name."""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Final, cast

from adeye.errors import UsageError, suggest

if TYPE_CHECKING:
    from adeye.ports import TrafficBackend

__all__ = ["BACKENDS", "make_traffic", "variant_of"]

BACKENDS: Final = {"highway": ("adeye.traffic.highway", "HighwayTraffic", "highway-env")}
"""Module, class and distribution behind each name; imported when it is made, never before."""


def make_traffic(name: str) -> TrafficBackend:
    """Make a traffic implementation.

    Args:
        name: One of ``BACKENDS``.

    Raises:
        UsageError: There is none of that name.
    """
    module, kind, _ = _find(name)
    return cast("TrafficBackend", getattr(import_module(module), kind)())


def variant_of(name: str) -> str:
    """Name the arithmetic that an implementation would run with, without importing it.

    Args:
        name: One of ``BACKENDS``.

    Raises:
        UsageError: There is none of that name.
    """
    _, _, distribution = _find(name)
    return f"{distribution}-{version(distribution)}"


def _find(name: str) -> tuple[str, str, str]:
    if name not in BACKENDS:
        raise UsageError(f"there is no traffic {name!r}", remedy=suggest(name, BACKENDS))
    return BACKENDS[name]
