"""``db metadata``: what datasette needs to show a database: titles, units, saved queries."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from adeye.cli.options import Db
from adeye.cli.output import emit_document, wrote
from adeye.cli.writing import named

Output = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="FILE",
        envvar="ADEYE_OUTPUT",
        callback=named,
        help="File to write, such as metadata.json; default: standard output.",
    ),
]

_VIEWS: Final = {
    "v_architecture_pairs": "two architectures in the same situation with the same fault",
    "v_campaigns": "one row a campaign; recency is 1 for the one that was planned last",
    "v_case_counts": "planned test cases and results by scenario, architecture, side of the ODD",
    "v_check": "one row a finding of 'adeye check'",
    "v_coverage": "test cases planned, done and exercising an FSR, by fault entry",
    "v_element_causes": "what an element can fail by",
    "v_faults": "one row a run with a fault that 'adeye faults' looked at: class and times",
    "v_forks": "one row a fork of a run: who acts from when on, what that told",
    "v_fsr_causes": "what the elements that an FSR is allocated to can fail by",
    "v_fsr_goals": "goals of an FSR, with its time budgets",
    "v_fsr_status": "one row an FSR, architecture and scenario: runs by verdict, folded verdict",
    "v_gate": "one row a mandatory FSR and architecture: the folded verdict behind the exit code",
    "v_goal_asil": "the highest ASIL that a safety goal calls for, 0 for QM to 4 for D",
    "v_goal_events": "hazardous events of a safety goal",
    "v_hazard_asil": "the ASIL that follows from the classes of a hazardous event",
    "v_preventability": "one row a run and the drive of a reference driver in its situation",
    "v_runs": "one row a run: parameters and verdicts in JSON, outcome, metrics",
    "v_timeline": "one row an event of a run",
    "v_uncertainty": "what half the step changes, and the numeric uncertainty that follows",
    "v_verdicts": "one row a run and FSR; NOT_RUN where there is no result",
}


def metadata(db: Db = None, *, output: Output = None) -> None:
    """Write the metadata for datasette: what views are, units of columns, saved queries.

    Then 'datasette adeye.db --metadata metadata.json' shows the database in a browser.
    """
    from adeye.outputs import write_atomically

    text = json.dumps(document(db), indent=1, ensure_ascii=False)
    if output is None:
        emit_document(text)
        return
    write_atomically(f"{text}\n".encode(), output)
    wrote(output)


def document(db: str | None) -> dict[str, Any]:
    """Describe a database in the form of datasette's ``metadata.json``.

    Raises:
        InputError: There is no such database, or it is on a server.
        PlatformError: It cannot be read.
    """
    from adeye.cli.queries import SAVED
    from adeye.errors import UsageError
    from adeye.store.location import locate
    from adeye.store.query import run_query
    from adeye.store.scenario_view import PREFIX

    path = locate(db).path
    if path is None:
        raise UsageError(
            "datasette shows files of SQLite, and this database is on a server",
            remedy="Name a file with --db.",
        )
    views = run_query(db, "SELECT name FROM sqlite_master WHERE type = 'view' ORDER BY name").rows
    tables: dict[str, Any] = {}
    for (view,) in views:
        # The name is that of a view of ours, or one that somebody made: it is quoted either way.
        quoted = '"' + view.replace('"', '""') + '"'
        columns = run_query(db, f"SELECT * FROM {quoted} LIMIT 0").columns  # noqa: S608
        text = _VIEWS.get(view, "")
        if not text and view.startswith(PREFIX):
            text = "v_runs of one scenario, with one typed column for each parameter"
        if not text and view.startswith("v_check_"):
            text = "findings of one rule of 'adeye check'"
        tables[view] = {"description": text, "columns": _columns(columns)}
    queries = {
        name: {"title": name, "description": item.text, "sql": item.sql}
        for name, item in SAVED.items()
    }
    return {
        "title": "adeye",
        "description": "Results of adeye. Columns are in SI; the views are the stable interface. "
        "The canned queries are about the latest campaign.",
        "databases": {path.stem: {"tables": tables, "queries": queries}},
    }


def _columns(names: tuple[str, ...]) -> dict[str, str]:
    """Say what columns mean and which unit they have, where there is something to say."""
    from adeye.store.export_columns import TABLES, metric_columns, unit_of

    known = {item.name: item for table in TABLES.values() for item in table.columns}
    known |= {item.name: item for item in metric_columns()}
    described: dict[str, str] = {}
    for name in names:
        item = known.get(name)
        unit = unit_of(name) if item is None else item.unit
        text = "" if item is None else item.text
        said = " ".join(part for part in (text, f"[{unit}]" if unit else "") if part)
        if said:
            described[name] = said
    return described
