"""What an integrity rule is."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Rule:
    """An integrity rule, written as a query for what breaks it.

    Attributes:
        name: What it is called by; its view is ``v_check_<name>``.
        text: What is wrong where it finds something.
        remedy: What to do about it.
        sql: One SELECT of campaign, part, id and detail; ``RANK(x)`` counts an ASIL from 0 for QM
            to 4 for D, ``BRACKET(x)`` what stands in its brackets. Empty for a rule about records
            that SQL does not read: it has no view.
        needs_evidence: Whether it is about runs and verdicts, not about what is planned.
    """

    name: str
    text: str
    remedy: str
    sql: str
    needs_evidence: bool = False

    @property
    def view(self) -> str:
        """Name of its view, empty for a rule that has none."""
        return f"v_check_{self.name}" if self.sql else ""
