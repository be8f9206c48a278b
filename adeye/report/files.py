"""Guard the files that belong to a database, and those that its campaigns were planned from."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

from adeye.errors import AdeyeError, InputError
from adeye.identity import file_digest
from adeye.outputs import BESIDE_DATABASE, are_guarded, guarded, reads, require_unread
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
            from adeye.spec.load import INPUTS, load_odd, odd_of

            planned = _planned(place)
            inputs = [item[INPUTS] for item in planned if INPUTS in item]
            for path in asked:
                if path.is_file() and any(_is_input(path, known) for known in inputs):
                    reads(path)
            near = locate(place).beside.parent
            for odd in {odd_of(item, near) for item in planned if item.get("odd_path")}:
                # What cannot be planned any more was read as far as it goes.
                with contextlib.suppress(OSError, InputError):
                    for path in load_odd(odd).named_files():
                        reads(path)
            require_unread()
        yield


def _belonging(place: Place) -> Iterator[Path]:
    from adeye.report.credibility import RESULT

    beside = locate(place).beside
    yield beside
    yield from (beside.with_name(f"{beside.name}{end}") for end in BESIDE_DATABASE)
    yield beside.with_name(RESULT)


def _planned(place: Place) -> Sequence[Mapping[str, Any]]:
    """Return where campaigns were planned and executed; none of a database that cannot be read."""
    try:
        with Repository.open(place, create=False) as repository:
            campaigns = repository.campaigns()
            sessions = [repository.evidence.sessions(item.id) for item in campaigns]
            found = [item.provenance for item in campaigns]
            return [*found, *(item.provenance for item in chain.from_iterable(sessions))]
    except AdeyeError:
        return ()


def _is_input(path: Path, inputs: Mapping[str, str]) -> bool:
    """Tell whether a file is what a campaign was planned from, or stands in its place by now.

    Whoever calls may stand in another folder than who ran the campaign, and the ODD may have been
    changed since; so it is known by its content, or by its place in a project.
    """
    real = path.resolve()
    places = [Path(place).parts for place in inputs]
    if any(len(parts) > 1 and real.parts[-len(parts) :] == parts for parts in places):
        return True
    return path.stat().st_size > 0 and file_digest(path) in inputs.values()
