"""Which injector a fault has: by the kind of its target and its model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from adeye.faults.injectors import DropOut, Silence
from adeye.faults.switching import LateSwitch, StuckSwitch

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from adeye.faults.ports import InjectorContext

INJECTORS: Final[Mapping[tuple[str, str], Callable[[InjectorContext], Any]]] = {
    ("sensors", "drop_out"): DropOut,
    ("channels", "silent"): Silence,
    ("switch", "stuck"): StuckSwitch,
    ("switch", "late"): LateSwitch,
}
"""How to make an injector, by kind of target and model."""


def make_injector(context: InjectorContext) -> Any:
    """Make the injector of a fault of a batch."""
    fault = context.specs[0]
    return INJECTORS[fault.port, fault.model](context)
