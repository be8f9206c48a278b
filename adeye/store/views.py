"""The SQL views: the documented, stable interface for people who know SQL.

They count what was planned as well as what was run: a planned run without a verdict is NOT_RUN in
every view that names verdicts.

They are made from what the plans in the database hold. Names come from users, so an identifier is
built from an allow-list of characters, and a key with any other is left to the JSON column.
"""

from __future__ import annotations

import json
import re
from string import Template
from typing import TYPE_CHECKING, Final

from adeye.identity import digest
from adeye.store import catalogue as catalog
from adeye.store.cases import JUDGED
from adeye.store.rules import check_view_ddl
from adeye.store.tables import METRIC_IDS, MOMENTS, TABLES

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sqlalchemy import Connection

# --- The SQL views: the documented, stable interface for people who know SQL ----------------------

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

# The number of a run, from where blocks that are done note it; a digest falls anywhere into an
# index, which takes longer than all the rest of a row.
_NUMBER = """COALESCE($own.run_number, (
    SELECT x.number FROM run x WHERE x.result_digest = $case.result_digest))"""

# While trusted_schema is off, SQLite 3.40 lets a view use json_each, but no json function.
_OWN_VERDICTS = """(
    SELECT '{' || COALESCE(group_concat('"' || fsr || '":"' || verdict || '"', ','), '') || '}'
    FROM (
        SELECT v.fsr, v.verdict FROM v_verdicts v
        WHERE v.campaign = $case.campaign_id AND v.ordinal = $case.ordinal ORDER BY v.fsr) judged
    )"""

# Metrics come before the rest of a run, and the test case last: a filter leaves few of them.
_RUNS = """CREATE VIEW v_runs AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    t.replicate, t.seed, c.inside_odd, t.parameters, c.point, c.result_digest AS run,
    c.test_case_digest AS test_case, t.situation_digest AS situation, r.outcome, r.outcome_channel,
    r.outcome_detail, r.realised, r.end_reason, r.duration_s, r.backend, r.trace_digest,
    r.machine_dependent, r.executed_at,
    $metrics,
    $verdicts AS verdicts
FROM campaign_case c
LEFT JOIN case_run o ON o.campaign_id = c.campaign_id AND o.ordinal = c.ordinal
JOIN metric m ON m.run_number = $number
JOIN run r ON r.number = m.run_number
LEFT JOIN timing n ON n.run_number = m.run_number
LEFT JOIN criticality k ON k.run_number = m.run_number
LEFT JOIN test_case t ON t.digest = c.test_case_digest"""

_FSR_STATUS = """CREATE VIEW v_fsr_status AS
WITH withdrawn AS (
    SELECT c.campaign_id, f.fsr_id, c.architecture, c.scenario, v.verdict, -1 AS runs,
        0 - v.exercised AS exercised
    FROM (SELECT DISTINCT result_digest FROM withdrawal) x
    CROSS JOIN campaign_case c ON c.result_digest = x.result_digest
    CROSS JOIN work b ON b.campaign_id = c.campaign_id AND b.from_ordinal <= c.ordinal
        AND b.to_ordinal > c.ordinal AND b.state = 'done'
    CROSS JOIN campaign_fsr f ON $judged
    CROSS JOIN run r ON r.result_digest = c.result_digest
    CROSS JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest),
counted AS (
    SELECT campaign_id, fsr_id, architecture, scenario, SUM(runs) AS judged,
        SUM(exercised) AS exercised,
        $counts
    FROM (
        SELECT campaign_id, fsr_id, architecture, scenario, verdict, runs, exercised FROM tally
        UNION ALL SELECT * FROM withdrawn) told
    GROUP BY campaign_id, fsr_id, architecture, scenario),
worst AS (
    SELECT campaign_id, fsr_id, architecture, scenario, worst_margin, worst_robustness,
        worst_unit, worst_result_digest, ROW_NUMBER() OVER (
            PARTITION BY campaign_id, fsr_id, architecture, scenario
            ORDER BY $worst_first) AS place
    FROM tally WHERE verdict IN $measured)
SELECT f.campaign_id AS campaign, f.fsr_id AS fsr, f.architecture, f.scenario, f.asil,
    f.mandatory, f.in_gate, f.applicable, f.reason, f.min_exercised, f.waived_until, f.planned,
    $filled,
    f.planned - COALESCE(n.judged, 0) AS n_not_run, $exercised AS exercised,
    w.worst_margin, w.worst_unit AS unit, w.worst_robustness, w.worst_result_digest AS worst_run,
    CASE WHEN f.applicable = 0 THEN NULL $fold END AS verdict,
    COALESCE(n.exercised, 0) AS runs_exercised, COALESCE(a.exercised, 0) AS repeated,
    COALESCE(a.passed, 0) AS repeated_pass
FROM campaign_fsr f
LEFT JOIN counted n ON n.campaign_id = f.campaign_id AND n.fsr_id = f.fsr_id
    AND n.architecture = f.architecture AND n.scenario = f.scenario
LEFT JOIN worst w ON w.campaign_id = f.campaign_id AND w.fsr_id = f.fsr_id
    AND w.architecture = f.architecture AND w.scenario = f.scenario AND w.place = 1
LEFT JOIN case_repeat o ON o.campaign_id = f.campaign_id AND o.fsr_id = f.fsr_id
    AND o.architecture = f.architecture AND o.scenario = f.scenario
LEFT JOIN case_repeat a ON a.campaign_id = f.campaign_id AND a.fsr_id = f.fsr_id
    AND a.architecture = f.architecture AND a.scenario = ''"""

_GATE = """CREATE VIEW v_gate AS
WITH summed AS (
    SELECT campaign, architecture, fsr, MAX(asil) AS asil, MAX(in_gate) AS in_gate,
        MAX(applicable) AS applicable, MAX(reason) AS reason,
        MAX(min_exercised) AS min_exercised, MAX(waived_until) AS waived_until,
        SUM(planned) AS planned,
        $sums,
        SUM(n_not_run) AS n_not_run, SUM(runs_exercised) AS runs_exercised,
        MAX(repeated) AS repeated, MAX(repeated_pass) AS repeated_pass
    FROM v_fsr_status WHERE mandatory = 1
    GROUP BY campaign, architecture, fsr),
worst AS (
    SELECT campaign, architecture, fsr, worst_margin, unit, worst_robustness, worst_run,
        ROW_NUMBER() OVER (
            PARTITION BY campaign, architecture, fsr
            ORDER BY n_fail > 0 DESC, (worst_margin IS NULL) = (n_fail = 0),
                worst_margin, worst_run) AS place
    FROM v_fsr_status WHERE worst_run IS NOT NULL)
SELECT s.*, $exercised AS exercised, w.worst_margin, w.unit, w.worst_robustness, w.worst_run,
    CASE WHEN s.applicable = 0 THEN CASE WHEN s.in_gate = 1 THEN 'ERROR' END $fold END AS verdict,
    CASE WHEN s.applicable = 0 THEN CASE WHEN s.in_gate = 1 THEN 'ERROR' END $waived_fold
        END AS verdict_waived
FROM summed s
LEFT JOIN worst w ON w.campaign = s.campaign AND w.architecture = s.architecture
    AND w.fsr = s.fsr AND w.place = 1"""

# CROSS JOIN keeps the order of the tables: along the pairs, which lie in the order of the plan.
# What few ask for is looked up in the list of columns, so that nobody else waits for it.
_PAIRS = """CREATE VIEW v_architecture_pairs AS
SELECT a.campaign_id AS campaign, ca.scenario, a.fault_entry,
    (SELECT t.situation_digest FROM test_case t WHERE t.digest = ca.test_case_digest) AS situation,
    (SELECT t.parameters FROM test_case t WHERE t.digest = ca.test_case_digest) AS parameters,
    (SELECT t.replicate FROM test_case t WHERE t.digest = ca.test_case_digest) AS replicate,
    ca.architecture AS architecture_a, cb.architecture AS architecture_b, ca.point AS point_a,
    cb.point AS point_b, ca.result_digest AS run_a, cb.result_digest AS run_b,
    (SELECT r.outcome FROM run r WHERE r.number = ma.run_number) AS outcome_a,
    (SELECT r.outcome FROM run r WHERE r.number = mb.run_number) AS outcome_b,
    $differences,
    $verdicts_a AS verdicts_a, $verdicts_b AS verdicts_b
FROM case_match a
CROSS JOIN case_match b ON b.campaign_id = a.campaign_id AND b.first_ordinal = a.first_ordinal
    AND b.ordinal <> a.ordinal
CROSS JOIN campaign_case ca ON ca.campaign_id = a.campaign_id AND ca.ordinal = a.ordinal
CROSS JOIN campaign_case cb ON cb.campaign_id = b.campaign_id AND cb.ordinal = b.ordinal
LEFT JOIN case_run oa ON oa.campaign_id = ca.campaign_id AND oa.ordinal = ca.ordinal
LEFT JOIN case_run ob ON ob.campaign_id = cb.campaign_id AND ob.ordinal = cb.ordinal
JOIN metric ma ON ma.run_number = $number_a
JOIN metric mb ON mb.run_number = $number_b
WHERE cb.architecture > ca.architecture
    AND (cb.point = ca.point OR NOT EXISTS (
        SELECT 1 FROM json_each(ca.point) x JOIN json_each(cb.point) y
            ON y.key = x.key AND (y.value <> x.value OR (y.value IS NULL) <> (x.value IS NULL))))"""

# Blocks that are not done may have runs, too: those that another campaign executed.
_COVERAGE = """CREATE VIEW v_coverage AS
SELECT campaign, scenario, architecture, fault_entry, SUM(planned) AS planned, SUM(done) AS done,
    SUM(exercised) AS exercised
FROM (
    SELECT campaign_id AS campaign, scenario, architecture, fault_entry, planned, 0 AS done,
        0 AS exercised
    FROM case_count
    UNION ALL
    SELECT campaign_id, scenario, architecture, fault_entry, 0, runs, exercised
    FROM case_tally
    UNION ALL
    SELECT c.campaign_id, c.scenario, c.architecture, t.fault_entry, 0, 1,
        CASE WHEN EXISTS (
            SELECT 1 FROM campaign_fsr f
            JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest
            WHERE $judged AND v.exercised = 1) THEN 1 ELSE 0 END
    FROM work w
    JOIN campaign_case c ON c.campaign_id = w.campaign_id
        AND c.ordinal >= w.from_ordinal AND c.ordinal < w.to_ordinal
    JOIN run r ON r.result_digest = c.result_digest
    JOIN test_case t ON t.digest = c.test_case_digest
    WHERE w.state <> 'done') counted
GROUP BY campaign, scenario, architecture, fault_entry"""

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

# A failed run first, then by what people read as margin; where there is none, nothing is worse than
# a FAIL and nothing better than what did not fail. Of equal ones it is the least digest.
WORST_FIRST: Final = (
    "verdict = 'FAIL' DESC, (worst_margin IS NULL) = (verdict <> 'FAIL'), worst_margin, "
    "worst_result_digest"
)
MEASURED: Final = ("FAIL", "PASS", "INCONCLUSIVE")
"""Verdicts of runs of which one may be the worst."""


def _distinct(runs: str, repeated: str, held: str = "") -> str:
    """Count results: runs without those that repeat one; of withdrawn runs one at least is left."""
    some = f"{runs} > 0 AND {held}" if held else f"{runs} > 0"
    return (
        f"CASE WHEN {some} THEN CASE WHEN {runs} > {repeated} THEN {runs} - {repeated} ELSE 1 END "
        "ELSE 0 END"
    )


_ALL_HELD: Final = (
    "NOT EXISTS (SELECT 1 FROM never_held h WHERE h.campaign_id = s.campaign "
    "AND h.fsr_id = s.fsr AND h.architecture = s.architecture AND h.decides = 1)"
)


def _fold(table: str, min_exercised: str, *, waived: bool = False) -> str:
    """Fold counted verdicts as ``judge.verdict.fold_runs`` does."""
    # In a single scenario one result is enough, and what never held may have held in another.
    passed, held = "n_pass", ""
    if table == "s":
        passed, held = _distinct("n_pass", "repeated_pass"), f" AND {_ALL_HELD}"
    waivable = (
        ""
        if waived
        else "WHEN n_invalid > 0 THEN 'INVALID' WHEN n_inconclusive > 0 THEN 'INCONCLUSIVE' "
        f"WHEN {table}.planned > COALESCE({_judged_count(table)}, 0) THEN 'NOT_RUN' "
    )
    return (
        f"WHEN {table}.planned = 0 THEN 'NOT_RUN' WHEN n_fail > 0 THEN 'FAIL' "
        f"WHEN n_error > 0 THEN 'ERROR' {waivable}"
        f"WHEN {passed} >= {min_exercised}{held} THEN 'PASS' ELSE 'VACUOUS'"
    )


def _judged_count(table: str) -> str:
    return "n.judged" if table == "f" else "s.planned - s.n_not_run"


def _own(sql: str, case: str, own: str = "") -> str:
    """Write an expression about a case."""
    return Template(sql).substitute(case=case, own=own)


def _lines(parts: list[str]) -> str:
    return ",\n    ".join(parts)


def view_ddl() -> dict[str, str]:
    """Write the statement that creates each view, in the order of their dependencies."""
    counted = [
        f"SUM(CASE verdict WHEN '{verdict}' THEN runs ELSE 0 END) AS {column}"
        for verdict, column in COUNTED.items()
    ]
    pairs = [
        f"ma.{name} AS {name}_a, mb.{name} AS {name}_b, mb.{name} - ma.{name} AS {name}_difference"
        for name in PAIR_METRICS
    ]
    metrics = [
        f"{table}.{name}, {table}.{name}_status, {table}.{name}_time_s, {table}.{name}_actor"
        for table, names in zip("mnk", TABLES.values(), strict=True)
        for name in names
    ]
    return {
        "v_verdicts": Template(_VERDICTS).substitute(judged=JUDGED),
        "v_runs": Template(_RUNS).substitute(
            metrics=_lines(metrics),
            verdicts=_own(_OWN_VERDICTS, "c"),
            number=_own(_NUMBER, "c", "o"),
        ),
        "v_fsr_status": Template(_FSR_STATUS).substitute(
            judged=JUDGED,
            counts=_lines(counted),
            worst_first=WORST_FIRST,
            measured=MEASURED,
            filled=_lines([f"COALESCE(n.{name}, 0) AS {name}" for name in COUNTED.values()]),
            fold=_fold("f", "1"),
            exercised=_distinct("COALESCE(n.exercised, 0)", "COALESCE(o.exercised, 0)"),
        ),
        "v_gate": Template(_GATE).substitute(
            sums=_lines([f"SUM({name}) AS {name}" for name in COUNTED.values()]),
            fold=_fold("s", "s.min_exercised"),
            exercised=_distinct("runs_exercised", "repeated", held=_ALL_HELD),
            waived_fold=_fold("s", "s.min_exercised", waived=True),
        ),
        "v_architecture_pairs": Template(_PAIRS).substitute(
            differences=_lines(pairs),
            **{f"verdicts_{one}": _own(_OWN_VERDICTS, f"c{one}") for one in "ab"},
            **{f"number_{one}": _own(_NUMBER, f"c{one}", f"o{one}") for one in "ab"},
        ),
        "v_coverage": Template(_COVERAGE).substitute(judged=JUDGED),
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


# --- The views ``v_runs_<scenario>``: one typed column for each parameter of a scenario -----------

PREFIX: Final = "v_runs_"

_BASE_COLUMNS: Final = (
    "campaign",
    "ordinal",
    "architecture",
    "fault_entry",
    "replicate",
    "inside_odd",
    "run",
    "test_case",
    "situation",
    "outcome",
    "realised",
    "end_reason",
    "duration_s",
)
_RESERVED: Final = frozenset(
    {*_BASE_COLUMNS, *(f"{name}{end}" for name in METRIC_IDS for end in ("", "_status"))}
    | {"verdicts"}
)
_KEY: Final = re.compile(r"[A-Za-z][A-Za-z0-9_.-]*")
_VIEW: Final = Template(
    """CREATE VIEW $view AS
SELECT $columns
FROM v_runs
WHERE scenario = '$scenario'"""
)


def identifier(text: str) -> str:
    """Turn any text into a name that SQL takes unquoted.

    >>> identifier("architecture.sensors.front_camera.mount.yaw")
    'architecture_sensors_front_camera_mount_yaw'
    """
    name = re.sub(r"[^a-z0-9_]+", "_", text.lower()).strip("_")
    return name if name and name[0].isalpha() else f"x_{name}"


def unique_name(text: str, taken: Iterable[str]) -> str:
    """Turn any text into an identifier that is not taken."""
    name = identifier(text)
    return f"{name}_{digest(text)[:6]}" if name in taken else name


def fitting(connection: Connection, name: str) -> str:
    """Shorten a name that a server would cut, so that no two of them become one."""
    if not catalog.is_server(connection) or len(name) <= catalog.LONGEST_NAME:
        return name
    return f"{name[: catalog.LONGEST_NAME - 7]}_{digest(name)[:6]}"


def ensure_scenario_views(connection: Connection) -> None:
    """Make or renew the view of every scenario whose parameters changed."""
    present = catalog.views(connection)
    for view, ddl in _wanted(connection).items():
        if present.get(view) == catalog.mark(connection, ddl):
            continue
        if view in present:
            connection.exec_driver_sql(f"DROP VIEW {view}")
        catalog.create_view(connection, view, ddl)


def _wanted(connection: Connection) -> dict[str, str]:
    scenarios = connection.exec_driver_sql(
        "SELECT DISTINCT scenario FROM campaign_case ORDER BY scenario"
    ).scalars()
    wanted: dict[str, str] = {}
    for scenario in scenarios.all():
        if _KEY.fullmatch(scenario) is None:
            continue
        view = PREFIX + identifier(scenario)
        if view in wanted:
            view = f"{view}_{digest(scenario)[:6]}"
        view = fitting(connection, view)
        wanted[view] = _ddl(connection, view, scenario)
    return wanted


def _ddl(connection: Connection, view: str, scenario: str) -> str:
    columns = list(_BASE_COLUMNS)
    taken = set(_RESERVED)
    suffixes = _suffixes(connection, scenario)
    for source, key, kinds in _keys(connection, scenario):
        if _KEY.fullmatch(key) is None:
            continue
        suffix = suffixes.get(key, "")
        name = unique_name(f"{key}_{suffix}" if suffix else key, taken)
        name = fitting(connection, name)
        taken.add(name)
        # While trusted_schema is off, SQLite 3.40 lets a view use json_each, but not json_extract.
        value = f"(SELECT value FROM json_each({source}) WHERE key = '{key}')"  # noqa: S608
        is_number = set(kinds.split(",")) <= {"integer", "real"}
        typed = f"CAST({value} AS DOUBLE PRECISION)" if is_number else value
        # A parameter may be called like a word of SQL.
        columns.append(f'{typed} AS "{name}"')
    columns += [f"{name}, {name}_status" for name in METRIC_IDS]
    columns.append("verdicts")
    return _VIEW.substitute(view=view, columns=",\n    ".join(columns), scenario=scenario)


def _keys(connection: Connection, scenario: str) -> list[tuple[str, str, str]]:
    """Find parameters, and swept names that are none, with the JSON types of their values.

    All cases of a block and a structure have the same, so that the first of each tells them.
    """
    found = connection.exec_driver_sql(
        """
        WITH first AS (
            SELECT c.test_case_digest, c.point
            FROM work w CROSS JOIN campaign_case c
            ON c.campaign_id = w.campaign_id AND c.ordinal = w.from_ordinal
            WHERE c.scenario = ?
            UNION
            SELECT * FROM (
                SELECT test_case_digest, point FROM campaign_case WHERE scenario = ? LIMIT 1) one)
        SELECT source, key, group_concat(kind, ',') FROM (
            SELECT DISTINCT 'parameters' AS source, j.key AS key, j.type AS kind
            FROM first CROSS JOIN test_case t ON t.digest = first.test_case_digest
            JOIN json_each(t.parameters) j ON TRUE
            UNION
            SELECT DISTINCT 'point', j.key, j.type
            FROM first JOIN json_each(first.point) j ON TRUE) found
        GROUP BY source, key ORDER BY source, key
        """,
        (scenario, scenario),
    ).all()
    parameters = {key for source, key, _ in found if source == "parameters"}
    return [
        (source, key, kinds)
        for source, key, kinds in found
        if source == "parameters" or key not in parameters
    ]


def _suffixes(connection: Connection, scenario: str) -> dict[str, str]:
    """Read the SI suffix of each parameter; the newest campaign has the last word."""
    suffixes: dict[str, str] = {}
    for text in connection.exec_driver_sql("SELECT units FROM campaign ORDER BY number").scalars():
        suffixes.update(json.loads(text).get(scenario, {}))
    return suffixes
