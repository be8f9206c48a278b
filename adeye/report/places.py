"""Where the FSRs and scenarios of a campaign stand in the user's files.

The database holds what the files said, not their lines. A line is told only where the file still
says what the campaign was judged by; otherwise it would point at something else.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

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
    """

    fsrs: Mapping[str, Place] = field(default_factory=dict)
    scenarios: Mapping[str, Place] = field(default_factory=dict)


def places_of(path: str, odd: Mapping[str, Any], concept: Concept) -> Places:
    """Find the lines of what a campaign was planned from.

    Args:
        path: The ODD's file as the campaign was given it; empty if nobody knows.
        odd: Stored content of the ODD and everything that it names.
        concept: The concept that judged the campaign.

    Returns:
        No lines where the file is not there or cannot be read any more.
    """
    if not path:
        return Places()
    try:
        files = load_odd(path)
    except (InputError, OSError):
        return Places()
    return Places(_fsrs(files, concept), _scenarios(files, odd))


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
