"""The simulated world around the ego, behind one protocol: make an implementation by its name."""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Final, Protocol, cast

from adeye.errors import UsageError, suggest
from adeye.ports import TrafficBackend

if TYPE_CHECKING:
    from adeye.signals import Bools, Ints

__all__ = ["BACKENDS", "Traffic", "make_traffic", "variant_of"]

BACKENDS: Final = {"highway": ("adeye.traffic.highway", "HighwayTraffic", "highway-env")}
"""Module, class and distribution behind each name; imported when it is made, never before."""


class Traffic(TrafficBackend, Protocol):
    """A traffic implementation, and how far its runs have come."""

    @property
    def running(self) -> Bools:
        """Runs that have not ended (B,)."""

    @property
    def ended(self) -> Bools:
        """Runs that have ended (B,)."""

    @property
    def arrived(self) -> Bools:
        """Runs whose ego has reached its goal within the horizon (B,)."""

    @property
    def horizon_row(self) -> Ints:
        """Last row at which an obligation may start (B,); final once a run has ended."""

    @property
    def complete(self) -> Bools:
        """Runs that ended by goal or horizon, not by contact (B,)."""


def make_traffic(name: str) -> Traffic:
    """Make a traffic implementation.

    Args:
        name: One of ``BACKENDS``.

    Raises:
        UsageError: There is none of that name.
    """
    module, kind, _ = _find(name)
    return cast("Traffic", getattr(import_module(module), kind)())


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
