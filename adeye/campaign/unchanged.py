"""Notice that code or a file of a plug-in is changed on disk while a campaign runs.

A result names the code that it was executed with by the hash that the plan took. What is executed
is read when a block begins, and a channel may read its files at any tick, so a result counts only
if everything is still as planned after its block.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from adeye.errors import IntegrityError, SpecError
from adeye.registry import source_digest, source_files

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from adeye.campaign.plan import CampaignPlan

_Signature = tuple[tuple[str, int, int, int, int], ...]
"""Of each file: path, inode, size, and when content and entry were last written [ns]."""

_GONE: Final = -1


@dataclass(frozen=True, slots=True)
class Source:
    """A plug-in or a file that one reads, as the plan found it.

    Attributes:
        name: As the user wrote it.
        user: Who names it: an architecture, or the ODD.
        folder: Folder of the file that names it.
        digest: Hash when the campaign was planned.
        path: Of a file that a plug-in reads; None for code.
    """

    name: str
    user: str
    folder: Path
    digest: str
    path: Path | None = None

    def paths(self) -> list[Path]:
        """List the files behind it."""
        if self.path is not None:
            return [self.path]
        try:
            return [path for _, path in source_files(self.name, self.folder)]
        except SpecError:  # the module's file has gone
            return []

    def is_as_planned(self) -> bool:
        """Hash it again and compare."""
        try:
            if self.path is None:
                return source_digest(self.name, self.folder) == self.digest
            with self.path.open("rb") as stream:
                return hashlib.file_digest(stream, "sha256").hexdigest() == self.digest
        except (OSError, SpecError):
            return False


class Unchanged:
    """Compares plug-ins and the files that they read with what the plan found.

    A file is hashed again only if the system says that it was written, so that asking after each
    block costs next to nothing.
    """

    def __init__(self, plan: CampaignPlan | Iterable[Source]) -> None:
        """Take down what a plan found, or was told to have found; nothing is compared yet."""
        found = plan if isinstance(plan, Iterable) else sources(plan)
        self._seen: dict[Source, _Signature | None] = dict.fromkeys(found)

    def check(self) -> None:
        """Compare.

        Raises:
            IntegrityError: A file is not as planned.
        """
        for source, before in self._seen.items():
            # Taken before the hash: what is written between is noticed by the next comparison.
            now = _signature(source)
            if now == before:
                continue
            if not source.is_as_planned():
                raise IntegrityError(
                    f"{source.name}, which {source.user} names, was changed after the campaign was "
                    f"planned{_written(before, now)}. Results since the last block that was saved "
                    "are thrown away; run again to go on with what is there now."
                )
            self._seen[source] = now


def sources(plan: CampaignPlan) -> Iterator[Source]:
    """List the plug-ins of a plan and the files that they read."""
    for name, parts in plan.parts.items():
        user = f"architecture {name}"
        for part in parts.plugins:
            yield Source(part.name, user, plan.folders[name], part.source_digest)
        for file in parts.files:
            yield Source(file.name, user, plan.folders[name], file.digest, file.path)
        for part in parts.metrics:
            yield Source(part.name, "the ODD", plan.path.parent, part.source_digest)


def _signature(source: Source) -> _Signature:
    found = []
    for path in source.paths():
        try:
            told = path.stat()
        except OSError:
            found.append((str(path), _GONE, _GONE, _GONE, _GONE))
        else:
            found.append((str(path), told.st_ino, told.st_size, told.st_mtime_ns, told.st_ctime_ns))
    return tuple(found)


def _written(before: _Signature | None, now: _Signature) -> str:
    """Name the files that were written: of a package only those of which that is known."""
    known = before or (now if len(now) > 1 else ())
    changed = sorted({item[0] for item in set(now) ^ set(known)})
    return f": {', '.join(changed)}" if changed else ""
