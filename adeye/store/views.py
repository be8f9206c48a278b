"""The SQL views: the documented, stable interface for people who know SQL.

They count what was planned as well as what was run: a planned run without a verdict is NOT_RUN in
every view that names verdicts.
"""

from __future__ import annotations

from string import Template
from typing import Final

from adeye.store.check_views import check_view_ddl
from adeye.store.metric_ids import TABLES
from adeye.store.pending import JUDGED
from adeye.store.tables import MOMENTS

PAIR_METRICS: Final = (
    "contact",
    "impact_speed_mps",
    "min_distance_m",
    "min_ttc_s",
    "min_time_headway_s",
    "max_required_deceleration_mps2",
    "max_deceleration_mps2",
    "rss_violation_s",
    "fault_to_safe_state_s",
)
"""Metrics that ``v_architecture_pairs`` compares."""

COUNTED: Final = {
    "FAIL": "n_fail",
    "ERROR": "n_error",
    "INVALID": "n_invalid",
    "INCONCLUSIVE": "n_inconclusive",
    "VACUOUS": "n_vacuous",
    "PASS": "n_pass",
}
"""Column that counts a verdict."""

_VERDICTS = """CREATE VIEW v_verdicts AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    c.result_digest AS run, c.test_case_digest AS test_case, f.fsr_id AS fsr, f.asil, f.mandatory,
    COALESCE(v.verdict, 'NOT_RUN') AS verdict, v.exercised, v.margin, v.unit, v.robustness_low,
    v.robustness_high, v.signal, v.predicate, v.time_s, v.actor, v.value, v.threshold, v.detail
FROM campaign_case c
JOIN test_case t ON t.digest = c.test_case_digest
JOIN campaign_fsr f ON $judged
LEFT JOIN run r ON r.result_digest = c.result_digest
LEFT JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest"""

# While trusted_schema is off, SQLite 3.40 lets a view use json_each, but no json function.
_RUNS = """CREATE VIEW v_runs AS
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

_FSR_STATUS = """CREATE VIEW v_fsr_status AS
WITH counted AS (
    SELECT campaign_id, fsr_id, architecture, scenario, SUM(runs) AS judged,
        SUM(exercised) AS exercised,
        $counts
    FROM tally GROUP BY campaign_id, fsr_id, architecture, scenario),
worst AS (
    SELECT campaign_id, fsr_id, architecture, scenario, worst_margin, worst_robustness,
        worst_unit, worst_result_digest, ROW_NUMBER() OVER (
            PARTITION BY campaign_id, fsr_id, architecture, scenario
            ORDER BY $worst_first) AS place
    FROM tally WHERE verdict IN ('FAIL', 'PASS', 'INCONCLUSIVE'))
SELECT f.campaign_id AS campaign, f.fsr_id AS fsr, f.architecture, f.scenario, f.asil,
    f.mandatory, f.in_gate, f.applicable, f.reason, f.min_exercised, f.waived_until, f.planned,
    $filled,
    f.planned - COALESCE(n.judged, 0) AS n_not_run, COALESCE(n.exercised, 0) AS exercised,
    w.worst_margin, w.worst_unit AS unit, w.worst_robustness, w.worst_result_digest AS worst_run,
    CASE WHEN f.applicable = 0 THEN NULL $fold END AS verdict
FROM campaign_fsr f
LEFT JOIN counted n ON n.campaign_id = f.campaign_id AND n.fsr_id = f.fsr_id
    AND n.architecture = f.architecture AND n.scenario = f.scenario
LEFT JOIN worst w ON w.campaign_id = f.campaign_id AND w.fsr_id = f.fsr_id
    AND w.architecture = f.architecture AND w.scenario = f.scenario AND w.place = 1"""

_GATE = """CREATE VIEW v_gate AS
WITH summed AS (
    SELECT campaign, architecture, fsr, MAX(asil) AS asil, MAX(in_gate) AS in_gate,
        MAX(applicable) AS applicable, MAX(reason) AS reason,
        MAX(min_exercised) AS min_exercised, MAX(waived_until) AS waived_until,
        SUM(planned) AS planned,
        $sums,
        SUM(n_not_run) AS n_not_run, SUM(exercised) AS exercised
    FROM v_fsr_status WHERE mandatory = 1
    GROUP BY campaign, architecture, fsr),
worst AS (
    SELECT campaign, architecture, fsr, worst_margin, unit, worst_robustness, worst_run,
        ROW_NUMBER() OVER (
            PARTITION BY campaign, architecture, fsr
            ORDER BY n_fail > 0 DESC, (worst_robustness IS NULL) = (n_fail = 0),
                worst_robustness, worst_run) AS place
    FROM v_fsr_status WHERE worst_run IS NOT NULL)
SELECT s.*, w.worst_margin, w.unit, w.worst_robustness, w.worst_run,
    CASE WHEN s.applicable = 0 THEN CASE WHEN s.in_gate = 1 THEN 'ERROR' END $fold END AS verdict,
    CASE WHEN s.applicable = 0 THEN CASE WHEN s.in_gate = 1 THEN 'ERROR' END $waived_fold
        END AS verdict_waived
FROM summed s
LEFT JOIN worst w ON w.campaign = s.campaign AND w.architecture = s.architecture
    AND w.fsr = s.fsr AND w.place = 1"""

# CROSS JOIN keeps the order of the tables: from a case by its situation to its partners.
_PAIRS = """CREATE VIEW v_architecture_pairs AS
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
CROSS JOIN v_runs a ON a.campaign = p.campaign AND a.ordinal = p.ordinal_a
CROSS JOIN v_runs b ON b.campaign = p.campaign AND b.ordinal = p.ordinal_b"""

_COVERAGE = """CREATE VIEW v_coverage AS
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

_TIMELINE = """CREATE VIEW v_timeline AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    c.result_digest AS run, e.seq, e.time_s, e.kind, e.subject, e.text
FROM campaign_case c
JOIN test_case t ON t.digest = c.test_case_digest
JOIN run r ON r.result_digest = c.result_digest
JOIN event e ON e.run_number = r.number"""

_FAULTS = """CREATE VIEW v_faults AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    c.result_digest AS run, i.class, i.fdti_s, i.frti_s, i.fhti_s, i.eoti_s, i.ftti_s,
    i.ftti_s - i.fhti_s AS margin_s,
    $moments,
    i.fault_free_violation_s, i.without_mechanism, i.twins
FROM campaign_case c
JOIN test_case t ON t.digest = c.test_case_digest
JOIN injection i ON i.result_digest = c.result_digest
WHERE i.version = (SELECT MAX(x.version) FROM injection x
    WHERE x.result_digest = i.result_digest)"""

_PREVENTABILITY = """CREATE VIEW v_preventability AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    b.result_digest AS run, b.model, b.edition, b.drive_digest AS drive, m.contact,
    r.realised, m.impact_speed_mps, n.contact AS drive_contact, d.realised AS drive_realised,
    n.impact_speed_mps AS drive_impact_speed_mps
FROM benchmark b
JOIN run r ON r.result_digest = b.result_digest
JOIN metric m ON m.run_number = r.number
JOIN run d ON d.result_digest = b.drive_digest
JOIN metric n ON n.run_number = d.number
JOIN campaign_case c ON c.result_digest = b.result_digest
JOIN test_case t ON t.digest = c.test_case_digest
WHERE b.version = (SELECT MAX(x.version) FROM benchmark x
    WHERE x.result_digest = b.result_digest AND x.model = b.model AND x.edition = b.edition)"""

_FORKS = """CREATE VIEW v_forks AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    f.origin_digest AS run, f.result_digest AS fork, f.authority, f.from_tick,
    f.from_tick * t.step_s AS from_time_s, o.class, o.takeover_s, o.violation_s,
    o.fork_violation_s, r.outcome, r.end_reason, r.duration_s
FROM fork f
JOIN run r ON r.result_digest = f.result_digest
JOIN campaign_case c ON c.result_digest = f.origin_digest
JOIN test_case t ON t.digest = c.test_case_digest
LEFT JOIN takeover o ON o.fork_digest = f.result_digest AND o.version = (
    SELECT MAX(x.version) FROM takeover x WHERE x.fork_digest = f.result_digest)"""

_CAMPAIGNS = """CREATE VIEW v_campaigns AS
SELECT number, id AS campaign, odd_id AS odd, title, planned, created_at,
    ROW_NUMBER() OVER (ORDER BY COALESCE((
        SELECT MAX(u.number) FROM campaign_use u WHERE u.campaign_id = campaign.id), 0) DESC,
        number DESC) AS recency
FROM campaign"""

_UNCERTAINTY = """CREATE VIEW v_uncertainty AS
SELECT campaign_id AS campaign, scenario, architecture, kind, name, unit, sampled, pairs, p95,
    largest, uncertainty, differing, changes
FROM uncertainty"""

# A failed run first; there an infinite robustness, NULL, is the worst, elsewhere the best.
WORST_FIRST: Final = (
    "verdict = 'FAIL' DESC, (worst_robustness IS NULL) = (verdict <> 'FAIL'), "
    "worst_robustness, worst_result_digest"
)


def _fold(table: str, min_exercised: str, *, waived: bool = False) -> str:
    """Fold counted verdicts as ``evaluation.verdict.fold_runs`` does."""
    waivable = (
        ""
        if waived
        else "WHEN n_invalid > 0 THEN 'INVALID' WHEN n_inconclusive > 0 THEN 'INCONCLUSIVE' "
        f"WHEN {table}.planned > COALESCE({_judged_count(table)}, 0) THEN 'NOT_RUN' "
    )
    return (
        f"WHEN {table}.planned = 0 THEN 'NOT_RUN' WHEN n_fail > 0 THEN 'FAIL' "
        f"WHEN n_error > 0 THEN 'ERROR' {waivable}"
        f"WHEN n_pass >= {min_exercised} THEN 'PASS' ELSE 'VACUOUS'"
    )


def _judged_count(table: str) -> str:
    return "n.judged" if table == "f" else "s.planned - s.n_not_run"


def _lines(parts: list[str]) -> str:
    return ",\n    ".join(parts)


def view_ddl() -> dict[str, str]:
    """Write the statement that creates each view, in the order of their dependencies."""
    counted = [
        f"SUM(CASE verdict WHEN '{verdict}' THEN runs ELSE 0 END) AS {column}"
        for verdict, column in COUNTED.items()
    ]
    pairs = [
        f"a.{name} AS {name}_a, b.{name} AS {name}_b, b.{name} - a.{name} AS {name}_difference"
        for name in PAIR_METRICS
    ]
    metrics = [
        f"{table}.{name}, {table}.{name}_status, {table}.{name}_time_s, {table}.{name}_actor"
        for table, names in zip("mnk", TABLES.values(), strict=True)
        for name in names
    ]
    return {
        "v_verdicts": Template(_VERDICTS).substitute(judged=JUDGED),
        "v_runs": Template(_RUNS).substitute(metrics=_lines(metrics)),
        "v_fsr_status": Template(_FSR_STATUS).substitute(
            counts=_lines(counted),
            worst_first=WORST_FIRST,
            filled=_lines([f"COALESCE(n.{name}, 0) AS {name}" for name in COUNTED.values()]),
            fold=_fold("f", "1"),
        ),
        "v_gate": Template(_GATE).substitute(
            sums=_lines([f"SUM({name}) AS {name}" for name in COUNTED.values()]),
            fold=_fold("s", "s.min_exercised"),
            waived_fold=_fold("s", "s.min_exercised", waived=True),
        ),
        "v_architecture_pairs": Template(_PAIRS).substitute(differences=_lines(pairs)),
        "v_coverage": _COVERAGE,
        "v_timeline": _TIMELINE,
        "v_faults": Template(_FAULTS).substitute(
            moments=", ".join(f"i.{name}_s" for name in MOMENTS)
        ),
        "v_forks": _FORKS,
        **check_view_ddl(),
        "v_campaigns": _CAMPAIGNS,
        "v_uncertainty": _UNCERTAINTY,
        "v_preventability": _PREVENTABILITY,
    }
