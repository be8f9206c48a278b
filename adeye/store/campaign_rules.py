"""The integrity rules of what is planned and of the evidence that there is."""

from __future__ import annotations

from typing import Final

from adeye.store.rules import Rule

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
