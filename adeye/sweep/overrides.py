"""Apply swept values to scenarios, architectures and faults by dotted path, once per variant."""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

from adeye.errors import InputError, InputErrors, SourceLocation, SweepError
from adeye.spec.problems import validate
from adeye.spec.quantity import Record
from adeye.sweep.axes import quantity_or_text

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.spec.fault import Fault
    from adeye.spec.load import Loaded
    from adeye.spec.odd import Level

Spec = TypeVar("Spec", bound=Record)
Path = tuple[str, ...]
MOST_VARIANTS = 4_096
"""Records of changed files that are kept, so that a sweep over files stays small too."""


@dataclass(frozen=True, slots=True)
class Change:
    """A value that the sweep writes into a file.

    Attributes:
        path: Dotted path below the file.
        value: As written.
        where: Place of the axis, for messages.
    """

    path: Path
    value: Level
    where: SourceLocation = field(compare=False)

    def __str__(self) -> str:
        """Write it as ``path = value``."""
        shown = self.value
        if isinstance(shown, bool | tuple):
            shown, _ = quantity_or_text(shown)
        return f"{'.'.join(self.path)} = {shown}"


@dataclass(frozen=True)
class Variants:
    """The variants of one file, made once for each distinct set of changes.

    A shared record per variant keeps a plan of many test cases small and lets a batch tell by
    identity which runs have one content. Only the newest are kept.
    """

    _made: dict[tuple[int, tuple[Change, ...]], Any] = field(default_factory=dict)

    def _keep(self, key: tuple[int, tuple[Change, ...]], record: Any) -> None:
        if len(self._made) >= MOST_VARIANTS:
            self._made.clear()
        self._made[key] = record

    def of(self, loaded: Loaded[Spec], changes: tuple[Change, ...]) -> Spec:
        """Return the record of a file with changes applied.

        Raises:
            SweepError: The changed content is not valid.
        """
        if not changes:
            return loaded.spec
        key = (id(loaded), changes)
        if key not in self._made:
            self._keep(key, _changed(type(loaded.spec), loaded.content, changes))
        made: Spec = self._made[key]
        return made

    def fault(self, fault: Fault, content: Mapping[str, Any], changes: tuple[Change, ...]) -> Fault:
        """Return a fault with changes applied.

        Raises:
            SweepError: The changed content is not valid.
        """
        if not changes:
            return fault
        key = (id(fault), changes)
        if key not in self._made:
            self._keep(key, _changed(type(fault), content, changes))
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


@dataclass(frozen=True)
class _Changed:
    """Changed content; what is wrong with it is wrong at the axis that changed it."""

    value: Any
    changes: tuple[Change, ...]

    def locate(self, loc: tuple[str | int, ...]) -> SourceLocation:
        """Find the axis that wrote a part, or the last one."""
        return _guilty(self.changes, loc).where

    def locate_key(self, loc: tuple[str | int, ...]) -> SourceLocation:
        """Find the axis that wrote the key of a part, or the last one."""
        return self.locate(loc)

    def heir(self, loc: tuple[str | int, ...]) -> str:  # noqa: ARG002 - nothing is inherited
        """Return no file: the axis writes into the file as a whole."""
        return ""


def _guilty(changes: tuple[Change, ...], loc: tuple[str | int, ...]) -> Change:
    wrote = [change for change in changes if loc[: len(change.path)] == change.path]
    return (wrote or list(changes))[-1]


def _changed(model: type[Spec], content: Mapping[str, Any], changes: tuple[Change, ...]) -> Spec:
    changed = copy.deepcopy(dict(content))
    for change in changes:
        value = list(change.value) if isinstance(change.value, tuple) else change.value
        set_path(changed, change.path, value)
    try:
        return validate(_Changed(changed, changes), model)
    except InputError as error:
        first = error.errors[0] if isinstance(error, InputErrors) else error
        what = ", ".join(map(str, changes))
        raise SweepError(
            f"with {what}: {first.message}", where=first.where, remedy=first.remedy
        ) from error
