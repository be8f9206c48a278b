"""The integrity rules of concepts, campaigns and budgets: views with a row for each breach.

Rules without a view are about records that only their own models read, see ``checking``.

``v_check_<rule>`` names, by campaign, what breaks the rule; ``v_check`` has all of them. A rule
holds for what the database says, also where the reader of files refuses the same: databases are
edited. JSON is read with ``json_each``, the one way to it that every SQLite allows in a view.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from adeye.store.sql import heading, statement

# --- What an integrity rule is --------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Rule:
    """An integrity rule; its view names campaign, part, id and detail of what breaks it.

    Attributes:
        name: What it is called by; its view is ``v_check_<name>``.
        text: What is wrong where it finds something.
        remedy: What to do about it.
        has_view: Whether SQL reads the records that it is about.
        needs_evidence: Whether it is about runs and verdicts, not about what is planned.
    """

    name: str
    text: str
    remedy: str
    has_view: bool = True
    needs_evidence: bool = False

    @property
    def view(self) -> str:
        """Name of its view, empty for a rule that has none."""
        return f"v_check_{self.name}" if self.has_view else ""


def _viewed(*names: str, needs_evidence: bool = False) -> tuple[Rule, ...]:
    """Read rules: what is wrong, and what to do about it, stand above the SQL of their views."""
    return tuple(
        Rule(name, *heading(f"v_check_{name}"), needs_evidence=needs_evidence) for name in names
    )


# --- The integrity rules of what is planned and of the evidence that there is ---------------------

BEGINS: Final = " begins"
"""What follows the name of a storyboard event in the timeline, where it begins."""
IDLE: Final = f"{BEGINS}, and changes nothing"
"""The same of one that leaves its actor as it was."""

IDLE_FAULT: Final = Rule(
    "idle_fault",
    "A fault is planned that changes nothing, or is planned nowhere.",
    "Give it a size, an entry or a target that matters; what it stands for is not tested.",
    has_view=False,
)
UNBEGUN_EVENT: Final = Rule(
    "unbegun_event",
    "An event that need not begin, and does not say so, began in no run.",
    "Name it under realised, or write optional: true; or let its condition come about.",
    has_view=False,
    needs_evidence=True,
)
IDLE_EVENT: Final = Rule(
    "idle_event",
    "An event left its actor as it was in each run in which it began.",
    "Let it ask for another speed or place than the actor has, or take it out.",
    has_view=False,
    needs_evidence=True,
)

NOT_CERTIFIED: Final = Rule(
    "not_certified",
    "Results came out otherwise when their runs were executed again for a certificate.",
    "Mend what they depend on, and run again: code that changed has results of its own.",
    has_view=False,
    needs_evidence=True,
)

PLACEHOLDER: Final = Rule(
    "placeholder",
    "A text of the concept is a placeholder.",
    "Write what stands in its place, or leave out a key that need not be there.",
    has_view=False,
)

ALIKE: Final = Rule(
    "children_alike",
    "Children of a decomposition are judged by one and the same formula or bound.",
    "Ask of each child what its own elements do: as it is, a run shows nothing of one alone.",
    has_view=False,
)

CAMPAIGN_RULES: Final = (
    *_viewed(
        "fsr_without_scenario",
        "hazard_without_scenario",
        "orphan_scenario",
        "not_applicable_in_gate",
    ),
    IDLE_FAULT,
    *_viewed(
        "not_run",
        "stale_evidence",
        "outside_odd",
        "older_version",
        "vacuous_fsr",
        needs_evidence=True,
    ),
    UNBEGUN_EVENT,
    IDLE_EVENT,
    NOT_CERTIFIED,
)
"""Rules about what is planned and what the runs gave."""


# --- The integrity rule that holds the formula of a requirement against its own time budget -------

BUDGET_RULES: Final = _viewed("response_beyond_budget")
"""Rules about time that a formula gives; ``response_s`` is written beside the requirement."""


# --- The integrity rules of a concept and its evidence: SQL views that are empty when all is well -

CONCEPT_RULES: Final = _viewed(
    "hazard_asil",
    "hazard_without_goal",
    "goal_asil",
    "goal_without_fsr",
    "asil_lost",
    "fsr_without_allocation",
    "fsr_without_measure",
    "threshold_without_source",
    "element_capability",
    "illegal_decomposition",
    "decomposition_elements",
    "independence_argument",
    "independence_unknown",
    "common_cause",
    "expired_dfa",
    "expired_assumption",
    "expired_waiver",
    "fhti_budget",
    "emergency_operation",
)
"""Rules about what the concept says."""

RULES: Final = (*CONCEPT_RULES, ALIKE, PLACEHOLDER, *BUDGET_RULES, *CAMPAIGN_RULES)
"""Every rule, in the order in which findings are listed."""

_BASIS: Final = (
    "v_hazard_asil",
    "v_goal_events",
    "v_goal_asil",
    "v_fsr_goals",
    "v_element_causes",
    "v_fsr_causes",
    "v_case_counts",
)
"""Views that those of the rules read."""

_FRAGMENTS: Final = ("DECOMPOSED", "ITS_SIDE", "JUDGED")
"""Words in the views that stand for what is in the file of their name."""

_RANKED: Final = "WHEN 'Q' THEN 0 WHEN 'A' THEN 1 WHEN 'B' THEN 2 WHEN 'C' THEN 3 WHEN 'D' THEN 4"
_LETTERED: Final = (
    "WHEN 0 THEN 'QM' WHEN 1 THEN 'A' WHEN 2 THEN 'B' WHEN 3 THEN 'C' WHEN 4 THEN 'D'"
)
_RANK: Final = re.compile(r"(RANK|BRACKET|LETTER|NUMBER)\(([a-z_.]+)\)")


def _ranked(match: re.Match[str]) -> str:
    if match[1] == "NUMBER":
        return f"CAST({match[2]} AS DOUBLE PRECISION)"
    if match[1] == "LETTER":
        return f"CASE {match[2]} {_LETTERED} ELSE 'none' END"
    # The letter before the closing bracket, or the first one; what is no ASIL is below every one.
    start = f"length({match[2]}) - 1" if match[1] == "BRACKET" else "1"
    return f"CASE substr({match[2]}, {start}, 1) {_RANKED} ELSE -9 END"


def _written_out(view: str) -> str:
    """Write the statement that creates a view, with what its words in capital letters stand for.

    ``RANK(x)`` counts an ASIL from 0 for QM to 4 for D, ``BRACKET(x)`` what stands in its brackets,
    ``LETTER(x)`` is the ASIL of a rank, and ``NUMBER(x)`` a value as a number.
    """
    sql = statement(view)
    for word in _FRAGMENTS:
        sql = sql.replace(word, statement(word.lower()))
    return _RANK.sub(_ranked, sql)


def check_view_ddl() -> dict[str, str]:
    """Write the statement that creates each view, in the order of their dependencies."""
    viewed = [rule for rule in RULES if rule.has_view]
    union = "\nUNION ALL\n".join(
        f"SELECT '{rule.name}' AS rule, campaign, part, id, detail FROM {rule.view}"  # noqa: S608 - own names
        for rule in viewed
    )
    return {
        **{view: _written_out(view) for view in (*_BASIS, *(rule.view for rule in viewed))},
        "v_check": f"CREATE VIEW v_check AS\n{union}",
    }
