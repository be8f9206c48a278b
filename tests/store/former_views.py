"""The views as they were when they looked at every case: slow, and what the fast ones equal."""

from __future__ import annotations

import sqlite3
from string import Template
from typing import Final

from adeye.store.tables import TABLES
from adeye.store.views import PAIR_METRICS

FORMER: Final = {
    "v_runs": "former_runs",
    "v_architecture_pairs": "former_pairs",
    "v_coverage": "former_coverage",
}

_RUNS = """CREATE TEMP VIEW former_runs AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    t.replicate, t.seed, c.inside_odd, t.parameters, c.point, r.result_digest AS run,
    t.digest AS test_case, t.situation_digest AS situation, r.outcome, r.outcome_channel,
    r.outcome_detail, r.realised, r.end_reason, r.duration_s, r.backend, r.trace_digest,
    r.machine_dependent, r.executed_at,
    $metrics,
    (SELECT '{' || COALESCE(group_concat('"' || fsr || '":"' || verdict || '"', ','), '') || '}'
        FROM (
            SELECT v.fsr, v.verdict FROM v_verdicts v
            WHERE v.campaign = c.campaign_id AND v.ordinal = c.ordinal ORDER BY v.fsr) judged
        ) AS verdicts
FROM campaign_case c
JOIN test_case t ON t.digest = c.test_case_digest
JOIN run r ON r.result_digest = c.result_digest
JOIN metric m ON m.run_number = r.number
LEFT JOIN timing n ON n.run_number = r.number
LEFT JOIN criticality k ON k.run_number = r.number"""

_PAIRS = """CREATE TEMP VIEW former_pairs AS
WITH pair AS (
    SELECT ca.campaign_id AS campaign, ca.ordinal AS ordinal_a, cb.ordinal AS ordinal_b
    FROM campaign_case ca
    CROSS JOIN test_case ta ON ta.digest = ca.test_case_digest
    CROSS JOIN test_case tb ON tb.situation_digest = ta.situation_digest
        AND tb.fault_entry = ta.fault_entry
    CROSS JOIN campaign_case cb ON cb.test_case_digest = tb.digest
        AND cb.campaign_id = ca.campaign_id AND cb.scenario = ca.scenario
        AND cb.architecture > ca.architecture
    WHERE NOT EXISTS (
        SELECT 1 FROM json_each(ca.point) x JOIN json_each(cb.point) y
            ON y.key = x.key AND (y.value <> x.value OR (y.value IS NULL) <> (x.value IS NULL))))
SELECT a.campaign, a.scenario, a.fault_entry, a.situation, a.parameters, a.replicate,
    a.architecture AS architecture_a, b.architecture AS architecture_b, a.point AS point_a,
    b.point AS point_b, a.run AS run_a, b.run AS run_b, a.outcome AS outcome_a,
    b.outcome AS outcome_b,
    $differences,
    a.verdicts AS verdicts_a, b.verdicts AS verdicts_b
FROM pair p
CROSS JOIN former_runs a ON a.campaign = p.campaign AND a.ordinal = p.ordinal_a
CROSS JOIN former_runs b ON b.campaign = p.campaign AND b.ordinal = p.ordinal_b"""

_COVERAGE = """CREATE TEMP VIEW former_coverage AS
SELECT c.campaign_id AS campaign, c.scenario, c.architecture, t.fault_entry,
    COUNT(*) AS planned, COUNT(r.number) AS done,
    SUM(CASE WHEN EXISTS (
        SELECT 1 FROM v_verdicts v
        WHERE v.campaign = c.campaign_id AND v.ordinal = c.ordinal AND v.exercised = 1)
        THEN 1 ELSE 0 END) AS exercised
FROM campaign_case c
JOIN test_case t ON t.digest = c.test_case_digest
LEFT JOIN run r ON r.result_digest = c.result_digest
GROUP BY c.campaign_id, c.scenario, c.architecture, t.fault_entry"""


def make_former(raw: sqlite3.Connection) -> None:
    """Make the former views for this connection."""
    metrics = [
        f"{table}.{name}, {table}.{name}_status, {table}.{name}_time_s, {table}.{name}_actor"
        for table, names in zip("mnk", TABLES.values(), strict=True)
        for name in names
    ]
    differences = [
        f"a.{name} AS {name}_a, b.{name} AS {name}_b, b.{name} - a.{name} AS {name}_difference"
        for name in PAIR_METRICS
    ]
    raw.execute(Template(_RUNS).substitute(metrics=", ".join(metrics)))
    raw.execute(Template(_PAIRS).substitute(differences=", ".join(differences)))
    raw.execute(_COVERAGE)
