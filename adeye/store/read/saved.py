"""Saved queries: what people ask the database most, by name, over its documented views."""

from __future__ import annotations

from dataclasses import dataclass, replace
from string import Template
from typing import Final

from adeye.packaged import of_yaml, packaged_text


@dataclass(frozen=True, slots=True)
class SavedQuery:
    """A query with a name.

    Attributes:
        name: What it is called by.
        text: What it answers.
        sql: One SELECT.
        basis: One SELECT of a number: of how much the query can tell anything.
        lacking: What no rows mean where that number is 0, and what brings it.
    """

    name: str
    text: str
    sql: str
    basis: str = "SELECT COUNT(*) FROM campaign"
    lacking: str = "the database has no campaign: 'adeye run ODD' makes one"

    def about_one(self) -> SavedQuery:
        """Ask about the campaign that the parameter ``:campaign`` names instead of the latest."""
        sql, basis = (text.replace(_LATEST, ":campaign") for text in (self.sql, self.basis))
        lacking = self.lacking.replace("the latest campaign", "this campaign")
        return replace(self, sql=sql, basis=basis, lacking=lacking)


_LATEST: Final = "(SELECT campaign FROM v_campaigns WHERE recency = 1)"


def _read(name: str) -> str:
    return packaged_text("adeye.store.read", name)


def _saved() -> dict[str, SavedQuery]:
    written = of_yaml(Template(_read("saved.yaml")).substitute(latest=_LATEST))
    return {name: SavedQuery(name, **fields) for name, fields in written.items()}


SAVED: Final = _saved()
"""Saved queries by name; each is about the latest campaign, but for ``campaigns``."""
VIEWS: Final[dict[str, str]] = of_yaml(_read("views.yaml"))
"""What each view is about, by its name."""
