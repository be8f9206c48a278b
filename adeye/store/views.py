"""The SQL views: the documented, stable interface for people who know SQL.

They count what was planned as well as what was run: a planned run without a verdict is NOT_RUN in
every view that names verdicts.

They are made from what the plans in the database hold. Names come from users, so an identifier is
built from an allow-list of characters, and a key with any other is left to the JSON column.
"""

from __future__ import annotations

import json
import re
from collections.abc import Container
from itertools import chain, count
from typing import Final

from sqlalchemy import Connection

from adeye.identity import digest
from adeye.store import catalogue as catalog
from adeye.store.cases import JUDGED
from adeye.store.sql import filled, statement
from adeye.store.table_parts import METRIC_IDS, MOMENTS, TABLES

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


def _lines(parts: list[str]) -> str:
    return ",\n    ".join(parts)


def view_ddl() -> dict[str, str]:
    """Write the statement that creates each view, in the order of their dependencies."""
    from adeye.store.rules import check_view_ddl

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
        "v_verdicts": filled("v_verdicts", judged=JUDGED),
        "v_runs": filled(
            "v_runs",
            metrics=_lines(metrics),
            verdicts=filled("own_verdicts", case="c"),
            number=filled("run_number", case="c", own="o"),
        ),
        "v_fsr_status": filled(
            "v_fsr_status",
            judged=JUDGED,
            counts=_lines(counted),
            worst_first=WORST_FIRST,
            measured=MEASURED,
            filled=_lines([f"COALESCE(n.{name}, 0) AS {name}" for name in COUNTED.values()]),
            fold=_fold("f", "1"),
            exercised=_distinct("COALESCE(n.exercised, 0)", "COALESCE(o.exercised, 0)"),
        ),
        "v_gate": filled(
            "v_gate",
            sums=_lines([f"SUM({name}) AS {name}" for name in COUNTED.values()]),
            fold=_fold("s", "s.min_exercised"),
            exercised=_distinct("runs_exercised", "repeated", held=_ALL_HELD),
            waived_fold=_fold("s", "s.min_exercised", waived=True),
        ),
        "v_architecture_pairs": filled(
            "v_architecture_pairs",
            differences=_lines(pairs),
            **{f"verdicts_{x}": filled("own_verdicts", case=f"c{x}") for x in "ab"},
            **{f"number_{x}": filled("run_number", case=f"c{x}", own=f"o{x}") for x in "ab"},
        ),
        "v_coverage": filled("v_coverage", judged=JUDGED),
        "v_timeline": filled("v_timeline"),
        "v_faults": filled("v_faults", moments=", ".join(f"i.{name}_s" for name in MOMENTS)),
        "v_forks": filled("v_forks"),
        **check_view_ddl(),
        "v_campaigns": filled("v_campaigns"),
        "v_uncertainty": filled("v_uncertainty"),
        "v_preventability": filled("v_preventability"),
        "v_tags": statement("v_tags"),
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


def identifier(text: str) -> str:
    """Turn any text into a name that SQL takes unquoted.

    >>> identifier("architecture.sensors.front_camera.mount.yaw")
    'architecture_sensors_front_camera_mount_yaw'
    """
    name = re.sub(r"[^a-z0-9_]+", "_", text.lower()).strip("_")
    return name if name and name[0].isalpha() else f"x_{name}"


def unique_name(text: str, taken: Container[str]) -> str:
    """Turn any text into an identifier that is not taken.

    >>> unique_name("FSR-01", {"fsr_01"}), unique_name("FSR-01", {"fsr_01", "fsr_01_145008"})
    ('fsr_01_145008', 'fsr_01_145008_2')
    """
    name = identifier(text)
    other = f"{name}_{digest(text)[:6]}"
    names = chain((name, other), (f"{other}_{number}" for number in count(2)))
    return next(item for item in names if item not in taken)


def fitting(connection: Connection, name: str) -> str:
    """Shorten a name that a server would cut, so that no two of them become one."""
    if not catalog.is_server(connection) or len(name) <= catalog.LONGEST_NAME:
        return name
    return f"{name[: catalog.LONGEST_NAME - 7]}_{digest(name)[:6]}"


def ensure_scenario_views(connection: Connection) -> None:
    """Make or renew the view of every scenario whose parameters changed."""
    present = catalog.views(connection)
    for view, ddl in scenario_views(connection).items():
        if present.get(view) == catalog.mark(connection, ddl):
            continue
        if view in present:
            connection.exec_driver_sql(f"DROP VIEW {view}")
        catalog.create_view(connection, view, ddl)


def scenario_views(connection: Connection) -> dict[str, str]:
    """Return the statement of each view that the scenarios in a database ask for, by its name."""
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
    suffixes: dict[str, str] = {}
    for text in connection.exec_driver_sql("SELECT units FROM campaign ORDER BY number").scalars():
        suffixes.update(json.loads(text).get(scenario, {}))
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
    return filled("v_runs_scenario", view=view, columns=_lines(columns), scenario=scenario)


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
