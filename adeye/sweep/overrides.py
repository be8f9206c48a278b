"""Apply swept values to scenarios, architectures and faults by dotted path, once per variant."""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

from pydantic import ValidationError

from adeye.errors import SourceLocation, SweepError
from adeye.spec.fault import Fault
from adeye.spec.quantity import Record

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.spec.load import Loaded

Spec = TypeVar("Spec", bound=Record)
Path = tuple[str, ...]
Change = tuple[Path, str | int | float]


@dataclass(frozen=True)
class Variants:
    """The variants of one file, made once for each distinct set of changes.

    A shared record per variant keeps a plan of many test cases small and lets a batch tell by
    identity which runs have one content.
    """

    _made: dict[tuple[int, tuple[Change, ...]], Any] = field(default_factory=dict)

    def of(
        self, loaded: Loaded[Spec], changes: tuple[Change, ...], where: SourceLocation | None
    ) -> Spec:
        """Return the record with changes applied.

        Args:
            loaded: The file.
            changes: Paths and the values written there.
            where: Place of the sweep, for messages.

        Raises:
            SweepError: The changed content is not valid.
        """
        if not changes:
            return loaded.spec
        key = (id(loaded), changes)
        if key not in self._made:
            content = copy.deepcopy(loaded.content)
            for path, value in changes:
                set_path(content, path, value)
            self._made[key] = _validated(type(loaded.spec), content, changes, where)
        made: Spec = self._made[key]
        return made

    def fault(
        self,
        fault: Fault,
        content: Mapping[str, Any],
        changes: tuple[Change, ...],
        where: SourceLocation | None,
    ) -> Fault:
        """Return a fault with changes applied."""
        if not changes:
            return fault
        key = (id(fault), changes)
        if key not in self._made:
            changed = copy.deepcopy(dict(content))
            for path, value in changes:
                set_path(changed, path, value)
            self._made[key] = _validated(Fault, changed, changes, where)
        made: Fault = self._made[key]
        return made


def set_path(content: dict[str, Any], path: Path, value: Any) -> None:
    """Write a value at a dotted path, making mappings where the file left defaults out."""
    for part in path[:-1]:
        child = content.get(part)
        if not isinstance(child, dict):
            child = {}
            content[part] = child
        content = child
    content[path[-1]] = value


def _validated(
    model: type[Spec], content: Any, changes: tuple[Change, ...], where: SourceLocation | None
) -> Spec:
    try:
        return model.model_validate(content)
    except ValidationError as error:
        what = ", ".join(f"{'.'.join(path)} = {value}" for path, value in changes)
        first = error.errors()[0]
        raise SweepError(
            f"{what}: {'.'.join(map(str, first['loc']))}: {first['msg']}", where=where
        ) from error
