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

from adeye.store.sql import statement

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


# --- The integrity rules of what is planned and of the evidence that there is ---------------------

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

CAMPAIGN_RULES: Final = (
    Rule(
        "fsr_without_scenario",
        "A requirement is judged in no planned scenario.",
        "Add a scenario to the ODD that exercises it, or correct its scenarios.",
    ),
    Rule(
        "hazard_without_scenario",
        "No planned scenario stands for a hazardous event.",
        "Add one to the ODD, and requirements of the event's goals that are judged in it.",
    ),
    Rule(
        "orphan_scenario",
        "No requirement is judged in a planned scenario.",
        "Remove the scenario from the ODD, or write what it is there for.",
    ),
    Rule(
        "not_applicable_in_gate",
        "A mandatory requirement cannot be judged for an architecture of the gate.",
        "Write it over signals that the architecture has, or take that out of the gate.",
    ),
    IDLE_FAULT,
    Rule(
        "not_run",
        "Planned test cases have no result.",
        "Run the ODD again; it goes on where it stopped.",
        needs_evidence=True,
    ),
    Rule(
        "stale_evidence",
        "Results are there that were not judged by a requirement as it is now.",
        "Run the ODD again; what is there is judged, not executed.",
        needs_evidence=True,
    ),
    Rule(
        "outside_odd",
        "Runs on the wrong side of the ODD's border are counted as evidence.",
        "Run 'adeye db verify': counts of this database are not those that adeye writes.",
        needs_evidence=True,
    ),
    Rule(
        "older_version",
        "Evidence was made with another version than the newest in the database.",
        "Run the ODD again with this release and the code as it is.",
        needs_evidence=True,
    ),
    Rule(
        "vacuous_fsr",
        "A requirement was exercised in too few runs: what it asks about never came about.",
        "Add scenarios or faults that bring its condition about, or correct its formula.",
        needs_evidence=True,
    ),
    UNBEGUN_EVENT,
)
"""Rules about what is planned and what the runs gave."""


# --- The integrity rule that holds the formula of a requirement against its own time budget -------

BUDGET_RULES: Final = (
    Rule(
        "response_beyond_budget",
        "The formula of a requirement lets more time pass than its FDTI and FRTI.",
        "Shorten the window of the formula, or correct fdti and frti.",
    ),
)
"""Rules about time that a formula gives; ``response_s`` is written beside the requirement."""


# --- The integrity rules of a concept and its evidence: SQL views that are empty when all is well -

CONCEPT_RULES: Final = (
    Rule(
        "hazard_asil",
        "The ASIL of a hazardous event is not the one of its classes.",
        "Correct severity, exposure or controllability; the ASIL follows from them.",
    ),
    Rule(
        "hazard_without_goal",
        "A hazardous event with an ASIL has no safety goal.",
        "Name it under hazardous_events of a safety goal.",
    ),
    Rule(
        "goal_asil",
        "A safety goal has a lower ASIL than one of its hazardous events.",
        "Give it the highest ASIL of its events.",
    ),
    Rule(
        "goal_without_fsr",
        "A safety goal has no functional safety requirement.",
        "Write a requirement that names it under goals.",
    ),
    Rule(
        "asil_lost",
        "A requirement has a lower ASIL than its goal, and comes of no decomposition.",
        "Give it the ASIL of the goal, or decompose a requirement into it.",
    ),
    Rule(
        "fsr_without_allocation",
        "A requirement is allocated to no element.",
        "Name the elements that meet it under allocation.",
    ),
    Rule(
        "fsr_without_measure",
        "A requirement has neither a formula nor a bound on a metric.",
        "Write one: what nothing measures cannot pass.",
    ),
    Rule(
        "threshold_without_source",
        "The threshold of a requirement has no source.",
        "Say under threshold_source where the number comes from.",
    ),
    Rule(
        "element_capability",
        "A requirement is allocated to an element of a lower ASIL capability.",
        "Allocate it to an able element, raise what is asked of this one, or decompose it.",
    ),
    Rule(
        "illegal_decomposition",
        "A decomposition is none of the table.",
        "Two children whose ASIL make a scheme of the table, with the goal's ASIL in brackets.",
    ),
    Rule(
        "decomposition_elements",
        "A child of a decomposition has no element of its own.",
        "Allocate each child to an element that the other does not need.",
    ),
    Rule(
        "independence_argument",
        "A decomposition has no argument for independence.",
        "Say under independence why one child cannot fail with the other.",
    ),
    Rule(
        "independence_unknown",
        "An element under a decomposition states no resources.",
        "State its resources, such as power and computer: what is not stated cannot be compared.",
    ),
    Rule(
        "common_cause",
        "The elements of a decomposition share what no dependent-failure record covers.",
        "Take it apart, or write a record under dependent_failures and name it under dfa.",
    ),
    Rule(
        "expired_dfa",
        "A dependent-failure record is out of date.",
        "Review it and set another date, or remove it.",
    ),
    Rule(
        "expired_assumption",
        "An assumption is out of date.",
        "Ask its owner, and set another date or remove what rests on it.",
    ),
    Rule(
        "expired_waiver",
        "A waiver is out of date.",
        "Remove it, or have it renewed.",
    ),
    Rule(
        "fhti_budget",
        "Detection and reaction times of requirements exceed the FTTI of their goal.",
        "Shorten fdti or frti, or show that the goal has more time.",
    ),
    Rule(
        "emergency_operation",
        "Emergency operation lasts longer than its goal tolerates, or the goal tolerates none.",
        "Shorten emergency_operation_interval, or state the goal's emergency operation and eotti.",
    ),
)
"""Rules about what the concept says."""

RULES: Final = (*CONCEPT_RULES, *BUDGET_RULES, *CAMPAIGN_RULES)
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
