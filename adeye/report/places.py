"""Where the FSRs and scenarios of a campaign stand in the user's files.

The database holds what the files said, not their lines. A line is told only where the file still
says what the campaign was judged by; otherwise it would point at something else.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from adeye.errors import InputError
from adeye.report.parts import Place
from adeye.spec.load import load_odd

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.errors import SourceLocation
    from adeye.spec.concept import Concept
    from adeye.spec.load import OddFiles


@dataclass(frozen=True)
class Places:
    """Lines of the files.

    Attributes:
        fsrs: In the concept, by id.
        scenarios: In the ODD, by the id under which it uses them.
        odd: Beginning of the ODD's file; None if nobody knows which.
    """

    odd: Place | None = None
    fsrs: Mapping[str, Place] = field(default_factory=dict)
    scenarios: Mapping[str, Place] = field(default_factory=dict)


def places_of(
    path: str, odd: Mapping[str, Any], concept: Concept, near: Path | None = None
) -> Places:
    """Find the lines of what a campaign was planned from.

    Args:
        path: The ODD's file as the campaign was given it; empty if nobody knows.
        odd: Stored content of the ODD and everything that it names.
        concept: The concept that judged the campaign.
        near: Folder of the database.

    Returns:
        No lines where the file is not there or cannot be read any more.
    """
    if not path:
        return Places()
    found = find_odd(path, near)
    place = Place(path=str(found), line=1, column=1)
    try:
        files = load_odd(found)
    except (InputError, OSError):
        return Places(place)
    return Places(place, _fsrs(files, concept), _scenarios(files, odd))


def find_odd(path: str, near: Path | None = None) -> Path:
    """Find the file of an ODD that was named from a folder that nobody remembers.

    Args:
        path: As it was named.
        near: Folder of the database, which often lies beside it.

    Returns:
        The path as it is, if it leads to a file from here; else where it does from the folder of
        the database or one above; else where it would from the root of the repository.
    """
    asked, here = Path(path), (near or Path()).resolve()
    tried = (asked, *(folder / asked for folder in (here, *here.parents)))
    known = next((item for item in tried if item.is_file()), None)
    if known is None:
        root = _repository(here)
        known = asked if root is None else root / asked
    return asked if known is asked else Path(os.path.relpath(known))


def uri_of(path: str) -> str:
    """Write a path as a code host looks it up: from the root of its repository, percent-encoded.

    Outside of a repository it is from the innermost folder that holds both the file and the folder
    where adeye was called, so that it never leads upwards.

    Args:
        path: From the folder where adeye was called, or absolute; nothing has to be there.
    """
    asked = Path(path)
    whole = asked.parent.resolve() / asked.name
    root = _repository(whole.parent) or os.path.commonpath([whole.parent, Path.cwd()])
    return quote(os.fsencode(whole.relative_to(root).as_posix()))


def _repository(folder: Path) -> Path | None:
    return next((item for item in (folder, *folder.parents) if (item / ".git").exists()), None)


def _fsrs(files: OddFiles, concept: Concept) -> dict[str, Place]:
    judged = {item.id: item.model_dump(mode="json") for item in concept.requirements}
    return {
        item.id: _place(files.concept.locate(("requirements", at, "id")))
        for at, item in enumerate(files.concept.spec.requirements)
        if judged.get(item.id) == item.model_dump(mode="json")
    }


def _scenarios(files: OddFiles, odd: Mapping[str, Any]) -> dict[str, Place]:
    ran = {use.get("as") or use["use"]: use for use in odd["odd"]["scenarios"]}
    return {
        use.name: _place(files.odd.locate(("scenarios", at)))
        for at, use in enumerate(files.odd.spec.scenarios)
        if ran.get(use.name) == use.model_dump(mode="json", by_alias=True)
    }


def _place(where: SourceLocation) -> Place:
    return Place(path=where.path, line=where.line, column=where.column)
