"""The views ``v_runs_<scenario>``: one typed column for each parameter of a scenario.

They are made from what the plans in the database hold. Names come from users, so an identifier is
built from an allow-list of characters, and a key with any other is left to the JSON column.
"""

from __future__ import annotations

import json
import re
from string import Template
from typing import TYPE_CHECKING, Final

from adeye.identity import digest
from adeye.store import catalog
from adeye.store.metric_ids import METRIC_IDS

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sqlalchemy import Connection

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
