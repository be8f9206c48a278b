"""The integrity rules of concepts, campaigns and budgets: views with a row for each breach.

Rules without SQL are about records that only their own models read, see ``checking``.

``v_check_<rule>`` names, by campaign, what breaks the rule; ``v_check`` has all of them. A rule
holds for what the database says, also where the reader of files refuses the same: databases are
edited. JSON is read with ``json_each``, the one way to it that every SQLite allows in a view.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

# --- What an integrity rule is --------------------------------------------------------------------


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


# --- The integrity rules of what is planned and of the evidence that there is ---------------------

# Cases, and results, of the side of the ODD on which an FSR is judged.
_SIDES: Final = """FROM campaign_fsr f
    JOIN v_case_counts n ON n.campaign = f.campaign_id AND n.scenario = f.scenario
        AND n.architecture = f.architecture
        AND f.applies IN ('everywhere', CASE n.inside_odd WHEN 1 THEN 'inside' ELSE 'outside' END)
    WHERE f.applicable = 1
    GROUP BY f.campaign_id, f.fsr_id, f.architecture, f.scenario"""
_JUDGED: Final = """SELECT campaign_id, fsr_id, architecture, scenario, SUM(runs) AS runs
    FROM tally GROUP BY campaign_id, fsr_id, architecture, scenario"""

FRAGMENTS: Final = {"ITS_SIDE": _SIDES, "JUDGED": _JUDGED}
"""What words in the rules stand for."""

IDLE_FAULT: Final = Rule(
    "idle_fault",
    "A fault is planned that changes nothing, or is planned nowhere.",
    "Give it a size, an entry or a target that matters; what it stands for is not tested.",
    "",
)
UNBEGUN_EVENT: Final = Rule(
    "unbegun_event",
    "An event that need not begin, and does not say so, began in no run.",
    "Name it under realised, or write optional: true; or let its condition come about.",
    "",
    needs_evidence=True,
)

CAMPAIGN_RULES: Final = (
    Rule(
        "fsr_without_scenario",
        "A requirement is judged in no planned scenario.",
        "Add a scenario to the ODD that exercises it, or correct its scenarios.",
        """SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'no planned test case judges it' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE NOT EXISTS (
    SELECT 1 FROM campaign_fsr p
    WHERE p.campaign_id = c.id AND p.fsr_id = f.id AND p.planned > 0)""",
    ),
    Rule(
        "hazard_without_scenario",
        "No planned scenario stands for a hazardous event.",
        "Add one to the ODD, and requirements of the event's goals that are judged in it.",
        """SELECT c.id AS campaign, 'hazardous_event' AS part, e.id,
    'no requirement of its goals is judged in ' || l.value AS detail
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
JOIN json_each(e.content, '$.scenarios') l ON TRUE
WHERE NOT EXISTS (
    SELECT 1 FROM v_goal_events g
    JOIN v_fsr_goals s ON s.concept = g.concept AND s.goal = g.goal
    JOIN campaign_fsr p ON p.campaign_id = c.id AND p.fsr_id = s.fsr AND p.scenario = l.value
    WHERE g.concept = e.concept_digest AND g.event = e.id AND p.planned > 0)
UNION ALL
SELECT c.id, 'hazardous_event', e.id, 'no requirement of its goals is judged anywhere'
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
WHERE e.asil <> 'QM' AND NOT EXISTS (SELECT 1 FROM json_each(e.content, '$.scenarios'))
    AND EXISTS (
        SELECT 1 FROM v_goal_events g JOIN v_fsr_goals s ON s.concept = g.concept
            AND s.goal = g.goal
        WHERE g.concept = e.concept_digest AND g.event = e.id)
    AND NOT EXISTS (
        SELECT 1 FROM v_goal_events g
        JOIN v_fsr_goals s ON s.concept = g.concept AND s.goal = g.goal
        JOIN campaign_fsr p ON p.campaign_id = c.id AND p.fsr_id = s.fsr
        WHERE g.concept = e.concept_digest AND g.event = e.id AND p.planned > 0)""",
    ),
    Rule(
        "orphan_scenario",
        "No requirement is judged in a planned scenario.",
        "Remove the scenario from the ODD, or write what it is there for.",
        """SELECT DISTINCT c.id AS campaign, 'scenario' AS part, n.value AS id,
    'no requirement is judged in it' AS detail
FROM campaign c
JOIN json_each(c.factors) x ON TRUE
JOIN json_each(x.value, '$.scenario') n ON TRUE
WHERE NOT EXISTS (
    SELECT 1 FROM campaign_fsr p
    WHERE p.campaign_id = c.id AND p.scenario = n.value AND p.planned > 0)""",
    ),
    Rule(
        "not_applicable_in_gate",
        "A mandatory requirement cannot be judged for an architecture of the gate.",
        "Write it over signals that the architecture has, or take that out of the gate.",
        """SELECT DISTINCT p.campaign_id AS campaign, 'fsr' AS part, p.fsr_id AS id,
    'not applicable to ' || p.architecture || ': ' || COALESCE(p.reason, 'no reason') AS detail
FROM campaign_fsr p
WHERE p.in_gate = 1 AND p.mandatory = 1 AND p.applicable = 0""",
    ),
    IDLE_FAULT,
    Rule(
        "not_run",
        "Planned test cases have no result.",
        "Run the ODD again; it goes on where it stopped.",
        """SELECT campaign, 'scenario' AS part, scenario AS id,
    SUM(planned - results) || ' of ' || SUM(planned) || ' test cases of ' || architecture
        || ' have no result' AS detail
FROM v_case_counts
GROUP BY campaign, scenario, architecture
HAVING SUM(results) < SUM(planned)""",
        needs_evidence=True,
    ),
    Rule(
        "stale_evidence",
        "Results are there that were not judged by a requirement as it is now.",
        "Run the ODD again; what is there is judged, not executed.",
        """SELECT s.campaign_id AS campaign, 'fsr' AS part, s.fsr_id AS id,
    (SUM(s.results) - SUM(COALESCE(j.runs, 0))) || ' of ' || SUM(s.results)
        || ' results are not judged by it' AS detail
FROM (SELECT f.campaign_id, f.fsr_id, f.architecture, f.scenario, SUM(n.results) AS results
    ITS_SIDE) s
LEFT JOIN (JUDGED) j ON j.campaign_id = s.campaign_id AND j.fsr_id = s.fsr_id
    AND j.architecture = s.architecture AND j.scenario = s.scenario
WHERE s.results > COALESCE(j.runs, 0)
GROUP BY s.campaign_id, s.fsr_id""",
        needs_evidence=True,
    ),
    Rule(
        "outside_odd",
        "Runs on the wrong side of the ODD's border are counted as evidence.",
        "Run 'adeye db verify': counts of this database are not those that adeye writes.",
        """SELECT j.campaign_id AS campaign, 'fsr' AS part, j.fsr_id AS id,
    SUM(j.runs - COALESCE(s.planned, 0)) || ' runs too many are counted in ' || j.scenario
        AS detail
FROM (JUDGED) j
LEFT JOIN (SELECT f.campaign_id, f.fsr_id, f.architecture, f.scenario, SUM(n.planned) AS planned
    ITS_SIDE) s ON s.campaign_id = j.campaign_id AND s.fsr_id = j.fsr_id
    AND s.architecture = j.architecture AND s.scenario = j.scenario
WHERE j.runs > COALESCE(s.planned, 0)
GROUP BY j.campaign_id, j.fsr_id, j.scenario""",
        needs_evidence=True,
    ),
    Rule(
        "older_version",
        "Evidence was made with another version than the newest in the database.",
        "Run the ODD again with this release and the code as it is.",
        """SELECT k.campaign_id AS campaign, 'architecture' AS part, k.architecture AS id,
    COUNT(*) || ' runs are of numerics version ' || r.numerics_version || ', the newest is of '
        || (SELECT MAX(numerics_version) FROM run) AS detail
FROM campaign_case k JOIN run r ON r.result_digest = k.result_digest
WHERE r.numerics_version < (SELECT MAX(numerics_version) FROM run)
GROUP BY k.campaign_id, k.architecture, r.numerics_version
UNION ALL
SELECT k.campaign_id, 'architecture', k.architecture,
    COUNT(*) || ' runs were made before the code of its plug-ins changed'
FROM campaign_case k
JOIN run r ON r.result_digest = k.result_digest
JOIN test_case t ON t.digest = r.test_case_digest
JOIN (
    SELECT y.architecture_digest, MAX(x.number) AS number
    FROM run x JOIN test_case y ON y.digest = x.test_case_digest
    GROUP BY y.architecture_digest) n ON n.architecture_digest = t.architecture_digest
JOIN run last ON last.number = n.number
WHERE r.plugins_digest <> last.plugins_digest
GROUP BY k.campaign_id, k.architecture""",
        needs_evidence=True,
    ),
    Rule(
        "vacuous_fsr",
        "A requirement was exercised in too few runs: what it asks about never came about.",
        "Add scenarios or faults that bring its condition about, or correct its formula.",
        """WITH asked AS (
    SELECT t.campaign_id, t.fsr_id, t.architecture, SUM(t.runs) AS runs, MIN(h.antecedent) AS lacks,
        CASE WHEN COUNT(h.antecedent) > 0 THEN 0 ELSE SUM(t.exercised) END AS exercised
    FROM tally t
    LEFT JOIN (
        SELECT campaign_id, fsr_id, architecture, MIN(antecedent) AS antecedent
        FROM never_held WHERE decides = 1
        GROUP BY campaign_id, fsr_id, architecture) h ON h.campaign_id = t.campaign_id
        AND h.fsr_id = t.fsr_id AND h.architecture = t.architecture
    GROUP BY t.campaign_id, t.fsr_id, t.architecture)
SELECT campaign_id AS campaign, 'fsr' AS part, fsr_id AS id,
    'exercised in none of ' || SUM(runs) || ' runs'
        || COALESCE(': ' || MIN(lacks) || ' never held', '') AS detail
FROM asked
GROUP BY campaign_id, fsr_id
HAVING SUM(exercised) = 0
UNION ALL
SELECT g.campaign, 'fsr', g.fsr, 'exercised for ' || g.architecture || ' in ' || g.exercised
    || ' different results, ' || g.min_exercised || ' are needed'
FROM v_gate g
WHERE g.in_gate = 1 AND g.verdict = 'VACUOUS' AND EXISTS (
    SELECT 1 FROM asked a
    WHERE a.campaign_id = g.campaign AND a.fsr_id = g.fsr AND a.exercised > 0)""",
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
        # A text, such as 'unbounded', stands for more than every number.
        """SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'the formula gives ' || CASE w.type WHEN 'text' THEN 'unbounded time'
        ELSE w.value || ' s' END || ' to respond, fdti and frti give '
        || b.budget_s || ' s' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
JOIN json_each(f.content, '$.response_s') w ON TRUE
JOIN (
    SELECT DISTINCT concept, fsr, COALESCE(fdti_s, 0.0) + COALESCE(frti_s, 0.0) AS budget_s
    FROM v_fsr_goals WHERE COALESCE(fdti_s, frti_s) IS NOT NULL) b
    ON b.concept = f.concept_digest AND b.fsr = f.id
WHERE CASE w.type WHEN 'text' THEN 1e9 ELSE NUMBER(w.value) END > b.budget_s + 1e-9""",
    ),
)
"""Rules about time that a formula gives; ``response_s`` is written beside the requirement."""


# --- The integrity rules of a concept and its evidence: SQL views that are empty when all is well -

_HAZARD_ASIL: Final = """CREATE VIEW v_hazard_asil AS
SELECT e.concept_digest AS concept, e.id AS event,
    CASE WHEN e.severity NOT IN ('S0', 'S1', 'S2', 'S3')
        OR e.exposure NOT IN ('E0', 'E1', 'E2', 'E3', 'E4')
        OR e.controllability NOT IN ('C0', 'C1', 'C2', 'C3') THEN 'unknown'
    WHEN e.severity = 'S0' OR e.exposure = 'E0' OR e.controllability = 'C0' THEN NULL
    ELSE CASE CAST(substr(e.severity, 2) AS INTEGER) + CAST(substr(e.exposure, 2) AS INTEGER)
            + CAST(substr(e.controllability, 2) AS INTEGER)
        WHEN 10 THEN 'D' WHEN 9 THEN 'C' WHEN 8 THEN 'B' WHEN 7 THEN 'A' ELSE 'QM' END
    END AS asil
FROM hazardous_event e"""

_GOAL_EVENTS: Final = """CREATE VIEW v_goal_events AS
SELECT g.concept_digest AS concept, g.id AS goal, j.value AS event
FROM safety_goal g JOIN json_each(g.content, '$.hazardous_events') j ON TRUE"""

# What the goal says and what its events call for, whichever is higher.
_GOAL_ASIL: Final = """CREATE VIEW v_goal_asil AS
SELECT concept, goal, MAX(rank) AS rank
FROM (
    SELECT g.concept_digest AS concept, g.id AS goal, RANK(g.asil) AS rank FROM safety_goal g
    UNION ALL
    SELECT v.concept, v.goal, RANK(e.asil) FROM v_goal_events v
    JOIN v_hazard_asil e ON e.concept = v.concept AND e.event = v.event) x
GROUP BY concept, goal"""

_FSR_GOALS: Final = """CREATE VIEW v_fsr_goals AS
SELECT f.concept_digest AS concept, f.id AS fsr, j.value AS goal,
    (SELECT NUMBER(value) FROM json_each(f.content, '$.fdti')) AS fdti_s,
    (SELECT NUMBER(value) FROM json_each(f.content, '$.frti')) AS frti_s,
    (SELECT NUMBER(value) FROM json_each(f.content, '$.emergency_operation_interval'))
        AS emergency_operation_s
FROM fsr f JOIN json_each(f.content, '$.goals') j ON TRUE"""

# A resource that is itself an element goes by the element. What follows 'element' is nothing, in
# the collation of the column: PostgreSQL wants the same one in both halves of a recursion.
_ELEMENT_CAUSES: Final = """CREATE VIEW v_element_causes AS
WITH RECURSIVE edge(concept, source, kind, name) AS (
    SELECT r.concept_digest, r.element_id,
        CASE WHEN r.kind = 'resource' AND e.id IS NOT NULL THEN 'element' ELSE r.kind END, r.name
    FROM element_relation r
    LEFT JOIN element e ON e.concept_digest = r.concept_digest AND e.id = r.name
    WHERE r.kind IN ('resource', 'software', 'supplier')
    UNION ALL
    SELECT r.concept_digest, r.element_id, 'element', p.element_id
    FROM element_relation r
    JOIN element_relation p ON p.concept_digest = r.concept_digest AND p.kind = 'provides'
        AND p.name = r.name
    WHERE r.kind = 'consumes'),
above(concept, element, kind, name) AS (
    SELECT concept_digest, id, 'element' || substr(id, 1, 0), id FROM element
    UNION
    SELECT a.concept, a.element, x.kind, x.name
    FROM above a JOIN edge x ON x.concept = a.concept AND x.source = a.name
    WHERE a.kind = 'element')
SELECT concept, element, kind, name FROM above"""

_FSR_CAUSES: Final = """CREATE VIEW v_fsr_causes AS
SELECT DISTINCT a.concept_digest AS concept, a.fsr_id AS fsr, x.kind, x.name
FROM allocation a
JOIN v_element_causes x ON x.concept = a.concept_digest AND x.element = a.element_id"""

_CASE_COUNTS: Final = """CREATE VIEW v_case_counts AS
SELECT k.campaign_id AS campaign, k.scenario, k.architecture, k.inside_odd, COUNT(*) AS planned,
    COUNT(r.number) AS results
FROM campaign_case k LEFT JOIN run r ON r.result_digest = k.result_digest
GROUP BY k.campaign_id, k.scenario, k.architecture, k.inside_odd"""

_DECOMPOSED: Final = """FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
JOIN decomposition_child x ON x.concept_digest = d.concept_digest AND x.fsr_id = d.id"""

CONCEPT_RULES: Final = (
    Rule(
        "hazard_asil",
        "The ASIL of a hazardous event is not the one of its classes.",
        "Correct severity, exposure or controllability; the ASIL follows from them.",
        """SELECT c.id AS campaign, 'hazardous_event' AS part, e.id,
    e.severity || ' ' || e.exposure || ' ' || e.controllability || ' give '
        || COALESCE(h.asil, 'no ASIL') || ', the event has ' || COALESCE(e.asil, 'none') AS detail
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
JOIN v_hazard_asil h ON h.concept = e.concept_digest AND h.event = e.id
WHERE COALESCE(h.asil, '') <> COALESCE(e.asil, '')""",
    ),
    Rule(
        "hazard_without_goal",
        "A hazardous event with an ASIL has no safety goal.",
        "Name it under hazardous_events of a safety goal.",
        """SELECT c.id AS campaign, 'hazardous_event' AS part, e.id,
    'ASIL ' || e.asil || ', and no safety goal is against it' AS detail
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
WHERE e.asil <> 'QM' AND NOT EXISTS (
    SELECT 1 FROM v_goal_events g WHERE g.concept = e.concept_digest AND g.event = e.id)""",
    ),
    Rule(
        "goal_asil",
        "A safety goal has a lower ASIL than one of its hazardous events.",
        "Give it the highest ASIL of its events.",
        """SELECT c.id AS campaign, 'safety_goal' AS part, g.id,
    'has ASIL ' || g.asil || ', its event ' || e.event || ' has ' || e.asil AS detail
FROM campaign c
JOIN safety_goal g ON g.concept_digest = c.concept_digest
JOIN v_goal_events v ON v.concept = g.concept_digest AND v.goal = g.id
JOIN (
    SELECT h.concept, h.event, CASE h.asil WHEN 'unknown' THEN x.asil ELSE h.asil END AS asil
    FROM v_hazard_asil h
    JOIN hazardous_event x ON x.concept_digest = h.concept AND x.id = h.event) e
    ON e.concept = v.concept AND e.event = v.event
WHERE RANK(g.asil) < RANK(e.asil)""",
    ),
    Rule(
        "goal_without_fsr",
        "A safety goal has no functional safety requirement.",
        "Write a requirement that names it under goals.",
        """SELECT c.id AS campaign, 'safety_goal' AS part, g.id,
    'ASIL ' || g.asil || ', and no requirement serves it' AS detail
FROM campaign c
JOIN safety_goal g ON g.concept_digest = c.concept_digest
WHERE NOT EXISTS (
    SELECT 1 FROM v_fsr_goals s WHERE s.concept = g.concept_digest AND s.goal = g.id)""",
    ),
    Rule(
        "asil_lost",
        "A requirement has a lower ASIL than its goal, and comes of no decomposition.",
        "Give it the ASIL of the goal, or decompose a requirement into it.",
        """SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'has ASIL ' || f.asil || ', its goal ' || g.goal || ' has ' || LETTER(g.rank) AS detail
FROM campaign c
JOIN v_fsr_goals s ON s.concept = c.concept_digest
JOIN fsr f ON f.concept_digest = s.concept AND f.id = s.fsr
JOIN v_goal_asil g ON g.concept = s.concept AND g.goal = s.goal
WHERE RANK(f.asil) < g.rank AND NOT EXISTS (
    SELECT 1 FROM decomposition_child x
    JOIN v_fsr_goals p ON p.concept = x.concept_digest AND p.fsr = x.fsr_id AND p.goal = s.goal
    WHERE x.concept_digest = f.concept_digest AND x.child_id = f.id)""",
    ),
    Rule(
        "fsr_without_allocation",
        "A requirement is allocated to no element.",
        "Name the elements that meet it under allocation.",
        """SELECT c.id AS campaign, 'fsr' AS part, f.id, 'no element has to meet it' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE NOT EXISTS (
    SELECT 1 FROM allocation a WHERE a.concept_digest = f.concept_digest AND a.fsr_id = f.id)""",
    ),
    Rule(
        "fsr_without_measure",
        "A requirement has neither a formula nor a bound on a metric.",
        "Write one: what nothing measures cannot pass.",
        """SELECT c.id AS campaign, 'fsr' AS part, f.id, 'nothing measures it' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE f.measure NOT GLOB '*[^ ]*'""",
    ),
    Rule(
        "threshold_without_source",
        "The threshold of a requirement has no source.",
        "Say under threshold_source where the number comes from.",
        """SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'nobody says where ' || f.measure || ' comes from' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE f.threshold_source NOT GLOB '*[^ ?.!-]*' OR lower(f.threshold_source) IN
    ('tbd', 'tbd.', 'tbc', 'tbc.', 'todo', 'todo.', 'n/a', 'na', 'none', 'none.', 'unknown',
    'unknown.')""",
    ),
    Rule(
        "element_capability",
        "A requirement is allocated to an element of a lower ASIL capability.",
        "Allocate it to an able element, raise what is asked of this one, or decompose it.",
        """SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'ASIL ' || f.asil || ' on ' || e.id || ', which is capable of ' || e.asil_capability AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
JOIN allocation a ON a.concept_digest = f.concept_digest AND a.fsr_id = f.id
JOIN element e ON e.concept_digest = a.concept_digest AND e.id = a.element_id
WHERE RANK(e.asil_capability) < RANK(f.asil)""",
    ),
    Rule(
        "illegal_decomposition",
        "A decomposition is none of the table.",
        "Two children whose ASIL make a scheme of the table, with the goal's ASIL in brackets.",
        """SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    p.asil || ' into ' || COALESCE(k.children, 'nothing') || ' for a goal of ASIL '
        || g.asil AS detail
FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
JOIN fsr p ON p.concept_digest = d.concept_digest AND p.id = d.id
LEFT JOIN (
    SELECT x.concept_digest, x.fsr_id, COUNT(*) AS n, SUM(RANK(f.asil)) AS total,
        MIN(BRACKET(f.asil)) AS least, MAX(BRACKET(f.asil)) AS most,
        group_concat(f.asil, ' and ') AS children
    FROM decomposition_child x
    JOIN fsr f ON f.concept_digest = x.concept_digest AND f.id = x.child_id
    GROUP BY x.concept_digest, x.fsr_id) k
    ON k.concept_digest = d.concept_digest AND k.fsr_id = d.id
LEFT JOIN (
    SELECT s.concept, s.fsr, MAX(RANK(g.asil)) AS rank, MAX(g.asil) AS asil
    FROM v_fsr_goals s JOIN safety_goal g ON g.concept_digest = s.concept AND g.id = s.goal
    WHERE g.asil <> 'QM'
    GROUP BY s.concept, s.fsr) g ON g.concept = d.concept_digest AND g.fsr = d.id
WHERE COALESCE(k.n, 0) <> 2 OR k.total <> RANK(p.asil) OR RANK(p.asil) < 1
    OR COALESCE(k.least, -8) <> COALESCE(g.rank, -8)
    OR COALESCE(k.most, -8) <> COALESCE(g.rank, -8)""",
    ),
    Rule(
        "decomposition_elements",
        "A child of a decomposition has no element of its own.",
        "Allocate each child to an element that the other does not need.",
        """SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    x.child_id || ' has no element that the other child does without' AS detail
DECOMPOSED
WHERE NOT EXISTS (
    SELECT 1 FROM allocation a
    WHERE a.concept_digest = x.concept_digest AND a.fsr_id = x.child_id AND NOT EXISTS (
        SELECT 1 FROM decomposition_child y
        JOIN allocation b ON b.concept_digest = y.concept_digest AND b.fsr_id = y.child_id
        WHERE y.concept_digest = x.concept_digest AND y.fsr_id = x.fsr_id
            AND y.child_id <> x.child_id AND b.element_id = a.element_id))""",
    ),
    Rule(
        "independence_argument",
        "A decomposition has no argument for independence.",
        "Say under independence why one child cannot fail with the other.",
        """SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    'nobody says why ' || d.scheme || ' are independent' AS detail
FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
WHERE d.independence NOT GLOB '*[^ ]*'""",
    ),
    Rule(
        "independence_unknown",
        "An element under a decomposition states no resources.",
        "State its resources, such as power and computer: what is not stated cannot be compared.",
        """SELECT DISTINCT c.id AS campaign, 'element' AS part, a.element_id AS id,
    'states no resources, and ' || x.child_id || ' of ' || d.id || ' rests on it' AS detail
DECOMPOSED
JOIN allocation a ON a.concept_digest = x.concept_digest AND a.fsr_id = x.child_id
WHERE NOT EXISTS (
    SELECT 1 FROM element_relation r
    WHERE r.concept_digest = a.concept_digest AND r.element_id = a.element_id
        AND r.kind = 'resource')""",
    ),
    Rule(
        "common_cause",
        "The elements of a decomposition share what no dependent-failure record covers.",
        "Take it apart, or write a record under dependent_failures and name it under dfa.",
        """SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    x.child_id || ' and ' || y.child_id || ' share ' || a.kind || ' ' || a.name AS detail
DECOMPOSED
JOIN decomposition_child y ON y.concept_digest = x.concept_digest AND y.fsr_id = x.fsr_id
    AND y.child_id > x.child_id
JOIN v_fsr_causes a ON a.concept = x.concept_digest AND a.fsr = x.child_id
JOIN v_fsr_causes b ON b.concept = a.concept AND b.fsr = y.child_id AND b.kind = a.kind
    AND b.name = a.name
WHERE NOT EXISTS (
    SELECT 1 FROM json_each(d.content, '$.dfa') n
    JOIN dependent_failure w ON w.concept_digest = d.concept_digest AND w.id = n.value
    JOIN json_each(w.content, '$.covers') v ON TRUE
    WHERE v.value = a.name)""",
    ),
    Rule(
        "expired_dfa",
        "A dependent-failure record is out of date.",
        "Review it and set another date, or remove it.",
        """SELECT c.id AS campaign, 'dependent_failure' AS part, w.id,
    'was valid until ' || w.valid_until AS detail
FROM campaign c
JOIN dependent_failure w ON w.concept_digest = c.concept_digest
WHERE w.valid_until < date('now')""",
    ),
    Rule(
        "expired_assumption",
        "An assumption is out of date.",
        "Ask its owner, and set another date or remove what rests on it.",
        """SELECT c.id AS campaign, 'assumption' AS part, a.id,
    'was valid until ' || a.valid_until || ', of ' || a.owner AS detail
FROM campaign c
JOIN assumption a ON a.concept_digest = c.concept_digest
WHERE a.valid_until < date('now')""",
    ),
    Rule(
        "expired_waiver",
        "A waiver is out of date.",
        "Remove it, or have it renewed.",
        """SELECT c.id AS campaign, 'waiver' AS part, r.value AS id,
    'expired on ' || u.value AS detail
FROM campaign c
JOIN concept k ON k.digest = c.concept_digest
JOIN json_each(k.content, '$.waivers') w ON TRUE
JOIN json_each(w.value, '$.requirement') r ON TRUE
JOIN json_each(w.value, '$.expires') u ON TRUE
WHERE u.value < date('now')""",
    ),
    Rule(
        "fhti_budget",
        "Detection and reaction times of requirements exceed the FTTI of their goal.",
        "Shorten fdti or frti, or show that the goal has more time.",
        """SELECT c.id AS campaign, 'fsr' AS part, s.fsr AS id,
    'FDTI ' || s.fdti_s || ' s and FRTI ' || s.frti_s || ' s exceed the ' || g.ftti_s
        || ' s of ' || g.id AS detail
FROM campaign c
JOIN v_fsr_goals s ON s.concept = c.concept_digest
JOIN safety_goal g ON g.concept_digest = s.concept AND g.id = s.goal
WHERE s.fdti_s + s.frti_s > g.ftti_s + 1e-9
UNION ALL
SELECT c.id, 'safety_goal', g.id, 'FDTI ' || b.fdti_s || ' s and FRTI ' || b.frti_s
    || ' s of its requirements exceed its ' || g.ftti_s || ' s'
FROM campaign c
JOIN safety_goal g ON g.concept_digest = c.concept_digest
JOIN (
    SELECT concept, goal, COALESCE(MAX(CASE WHEN frti_s IS NULL THEN fdti_s END), 0.0) AS fdti_s,
        COALESCE(MAX(CASE WHEN fdti_s IS NULL THEN frti_s END), 0.0) AS frti_s
    FROM v_fsr_goals GROUP BY concept, goal) b
    ON b.concept = g.concept_digest AND b.goal = g.id
WHERE b.fdti_s + b.frti_s > g.ftti_s + 1e-9""",
    ),
    Rule(
        "emergency_operation",
        "Emergency operation lasts longer than its goal tolerates, or the goal tolerates none.",
        "Shorten emergency_operation_interval, or state the goal's emergency operation and eotti.",
        """SELECT c.id AS campaign, 'fsr' AS part, s.fsr AS id,
    'emergency operation of ' || s.emergency_operation_s || ' s, and ' || g.id || ' tolerates '
        || COALESCE((SELECT NUMBER(value) FROM json_each(g.content, '$.eotti')) || ' s', 'none')
        AS detail
FROM campaign c
JOIN v_fsr_goals s ON s.concept = c.concept_digest
JOIN safety_goal g ON g.concept_digest = s.concept AND g.id = s.goal
WHERE s.emergency_operation_s
    > COALESCE((SELECT NUMBER(value) FROM json_each(g.content, '$.eotti')), 0.0) + 1e-9""",
    ),
)
"""Rules about what the concept says."""

RULES: Final = (*CONCEPT_RULES, *BUDGET_RULES, *CAMPAIGN_RULES)
"""Every rule, in the order in which findings are listed."""

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


def _written_out(sql: str) -> str:
    for word, fragment in {"DECOMPOSED": _DECOMPOSED, **FRAGMENTS}.items():
        sql = sql.replace(word, fragment)
    return _RANK.sub(_ranked, sql)


def check_view_ddl() -> dict[str, str]:
    """Write the statement that creates each view, in the order of their dependencies."""
    viewed = [rule for rule in RULES if rule.sql]
    rules = {rule.view: f"CREATE VIEW {rule.view} AS\n{_written_out(rule.sql)}" for rule in viewed}
    union = "\nUNION ALL\n".join(
        f"SELECT '{rule.name}' AS rule, campaign, part, id, detail FROM {rule.view}"  # noqa: S608 - own names
        for rule in viewed
    )
    return {
        "v_hazard_asil": _HAZARD_ASIL,
        "v_goal_events": _GOAL_EVENTS,
        "v_goal_asil": _written_out(_GOAL_ASIL),
        "v_fsr_goals": _written_out(_FSR_GOALS),
        "v_element_causes": _ELEMENT_CAUSES,
        "v_fsr_causes": _FSR_CAUSES,
        "v_case_counts": _CASE_COUNTS,
        **rules,
        "v_check": f"CREATE VIEW v_check AS\n{union}",
    }
