"""Former places of modules: who imports one gets an error that names the present place."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Final

_PACKAGE: Final = "adeye."
# Scripts that replay a run or drive it step by step were handed out with these.
_STILL_LEADING: Final = {"engine", "traffic", "traffic.env", "campaign.reproduce"}


@cache
def former() -> dict[str, str]:
    """Read the table: the present name of each former module."""
    lines = Path(__file__).with_suffix(".txt").read_text("utf-8").splitlines()
    pairs = (line.split() for line in lines if not line.startswith("#"))
    return {_PACKAGE + old: _PACKAGE + new for old, new in pairs}


class FormerPlaces:
    """Finds modules by the names that they had; asked first: a package's own path finds copies."""

    def __init__(self) -> None:
        """Begin without one."""
        self._own: dict[str, ModuleSpec | None] = {}

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return how a former module is loaded, None if there was none of the name.

        Raises:
            ModuleNotFoundError: There was one, and it leads nowhere any more.
        """
        del path, target
        if not name.startswith(_PACKAGE) or name not in former():
            return None
        if name.removeprefix(_PACKAGE) not in _STILL_LEADING:
            message = f"{name} is {former()[name]} now; what plug-ins need is in adeye.ports"
            raise ModuleNotFoundError(message, name=name)
        return ModuleSpec(name, self)  # type: ignore[arg-type]  # has what a loader needs

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return the module that holds what the former one held, with a warning."""
        present = former()[spec.name]
        warnings.warn(
            f"{spec.name} is {present} now; what plug-ins need is in adeye.ports",
            FutureWarning,
            stacklevel=2,
        )
        module = import_module(present)
        self._own[spec.name] = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Give the module back the name that it has: it has been executed under it."""
        if module.__spec__ is not None:
            module.__spec__ = self._own.pop(module.__spec__.name)


def find_former_places() -> None:
    """Have former places found from now on, once."""
    if not any(isinstance(finder, FormerPlaces) for finder in sys.meta_path):
        sys.meta_path.insert(0, FormerPlaces())
