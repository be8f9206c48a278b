"""Test an automated driving architecture, in closed loop, against its operating conditions.

The import loads nothing heavy: functions are fetched when they are first used. Begin with ``api``.

>>> import adeye
>>> sorted(adeye.__all__)
['CompareOptions', '__version__', 'compare', 'plan', 'replay', 'results', 'run', 'stl']
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from adeye.api import CompareOptions, compare, plan, replay, results, run, stl

from adeye.former import find_former_places
from adeye.version import __version__

__all__ = ["CompareOptions", "__version__", "compare", "plan", "replay", "results", "run", "stl"]


find_former_places()


def __getattr__(name: str) -> Any:
    """Import the public functions when they are first used, so that `adeye --help` is quick."""
    if name in __all__:
        from adeye import api

        return getattr(api, name)
    raise AttributeError(f"module 'adeye' has no attribute {name!r}")
