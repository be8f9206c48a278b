"""Guard the files that belong to a database, and those that its campaigns were planned from."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from adeye.errors import AdeyeError, InputError
from adeye.outputs import BESIDE_DATABASE, are_guarded, guarded, reads, require_unread
from adeye.report.credibility import RESULT
from adeye.spec.load import load_odd
from adeye.store.location import Place, locate
from adeye.store.repository import Repository


@contextlib.contextmanager
def guarding(
    place: Place, files: Mapping[str, Path | None], *, also_read: str = "", renewed: str = ""
) -> Iterator[None]:
    """Refuse files that would be written over a database, or over what it was made of.

    Args:
        place: The database.
        files: What is about to be written, by the name of its option.
        also_read: Option whose file is brought up to date: it is read before it is written.
        renewed: Option whose file may be evidence of an earlier time, which is written anew.

    Raises:
        UsageError: See ``outputs.guarded``.
    """
    asked = [path for path in files.values() if path is not None]
    if not asked or are_guarded(asked):
        yield
        return
    with guarded(files, taken=_belonging(place), also_read=also_read, renewed=renewed):
        if any(path.is_file() for path in asked):
            for odd in _planned_from(place):
                # What cannot be planned any more was read as far as it goes.
                with contextlib.suppress(OSError, InputError):
                    for path in load_odd(odd).named_files():
                        reads(path)
            require_unread()
        yield


def _belonging(place: Place) -> Iterator[Path]:
    beside = locate(place).beside
    yield beside
    yield from (beside.with_name(f"{beside.name}{end}") for end in BESIDE_DATABASE)
    yield beside.with_name(RESULT)


def _planned_from(place: Place) -> Iterable[str]:
    """Name the files of the ODDs of a database; whoever opens it next says why it cannot be."""
    try:
        with Repository.open(place, create=False) as repository:
            found = repository.campaigns()
    except AdeyeError:
        return ()
    return {str(item.provenance.get("odd_path", "")) for item in found} - {""}
