"""Modules that are public functions, too: ``adeye.trace(run)`` beside ``adeye.trace.Trace``."""

from __future__ import annotations

import sys
from importlib import import_module
from inspect import Signature, signature
from types import ModuleType
from typing import Any, Final

_FUNCTIONS: Final = "adeye.api"


class CalledModule(ModuleType):
    """A module that is called as the public function of its name."""

    @property
    def __signature__(self) -> Signature:
        """How it is called, for those who ask for help."""
        return signature(self._function)

    @property
    def _function(self) -> Any:
        # By its name: functions stand above all modules, and are heavy to import.
        return getattr(import_module(_FUNCTIONS), self.__name__.rpartition(".")[2])

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call the public function of its name."""
        return self._function(*arguments, **named)


def call_as_function(name: str) -> None:
    """Let a module be called, which has the name of a public function; it calls this once."""
    sys.modules[name].__class__ = CalledModule
