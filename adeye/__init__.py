"""Test an automated driving architecture, in closed loop, against its operating conditions.

The import loads nothing heavy: functions are fetched when they are first used. Begin with ``api``.

>>> import adeye
>>> [name for name in adeye.__all__ if name.islower() and "_" not in name]
['compare', 'gate', 'plan', 'query', 'replay', 'report', 'results', 'run', 'stl', 'trace']
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from adeye.api import (
        CompareOptions,
        compare,
        gate,
        plan,
        query,
        replay,
        report,
        results,
        run,
        stl,
        trace,
    )

from adeye.former import find_former_places
from adeye.version import __version__

__all__ = [
    "CompareOptions",
    "__version__",
    "compare",
    "gate",
    "plan",
    "query",
    "replay",
    "report",
    "results",
    "run",
    "stl",
    "trace",
]


find_former_places()


def __getattr__(name: str) -> Any:
    """Import the public functions when they are first used, so that `adeye --help` is quick."""
    if name in __all__:
        from adeye import api

        # A module of the same name is called instead, so that it is the same before and after.
        return globals().get(name) or getattr(api, name)
    raise AttributeError(f"module 'adeye' has no attribute {name!r}")
