"""Write ``docs/reference``, the list of files, the report's schema and the README's status table.

python docs/generate.py            write
python docs/generate.py --check    compare; fails when one is stale
"""

from __future__ import annotations

import ast
import json
import sqlite3
import sys
import tempfile
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

REFERENCE: Final = Path(__file__).resolve().parent / "reference"
ROOT: Final = REFERENCE.parent.parent
FILES: Final = ROOT / "docs" / "design" / "files.md"
BASELINE: Final = ROOT / "docs" / "schema" / "baseline.schema.json"
NOTE: Final = "<!-- Made by docs/generate.py; do not edit. -->"

sys.path.insert(0, str(ROOT))


def table(headers: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Write a Markdown table."""
    lines = [headers, ["---"] * len(headers), *rows]
    return "\n".join(f"| {' | '.join(_cell(item) for item in line)} |" for line in lines)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def _page(title: str, lead: str, *parts: str) -> str:
    return "\n\n".join([NOTE, f"# {title}", lead, *parts]) + "\n"


# --- files ----------------------------------------------------------------------------------------


def files_page() -> str:
    """Write what each module of the package holds, as the first line of its docstring says it."""
    package = ROOT / "adeye"
    folders: dict[str, list[list[str]]] = {}
    for path in sorted(package.rglob("*.py")):
        tree = ast.parse(path.read_text("utf-8"))
        text = (ast.get_docstring(tree) or "").split("\n\n")[0]
        has_code = any(isinstance(part, ast.FunctionDef | ast.ClassDef) for part in tree.body)
        if text and (has_code or path.name != "__init__.py"):
            folder = path.parent.relative_to(package).as_posix()
            folders.setdefault(folder, []).append([f"`{path.name}`", text])
    return _page(
        "Files",
        "What each module of `adeye/` holds, in the words of its first line. What the folders are "
        "for, and the way of a test case through them, is in "
        "[Where things are](0010-where-things-are.md).",
        *(
            f"## `{folder.strip('.')}/`\n\n{table(['File', 'In it'], rows)}"
            for folder, rows in sorted(folders.items())
        ),
    )


# --- command line ---------------------------------------------------------------------------------


def commands() -> dict[str, Any]:
    """List every command by the words that call it, such as ``db info``."""
    import typer

    from adeye.cli.app import app

    return dict(_commands(typer.main.get_command(app), ""))


def _commands(group: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    for name, command in group.commands.items():
        words = f"{prefix} {name}".strip()
        if hasattr(command, "commands"):
            yield from _commands(command, words)
        else:
            yield words, command


def cli_page() -> str:
    """Write the reference of the command line."""
    parts = [_command(words, command) for words, command in commands().items()]
    lead = (
        "Results go to standard output, everything else to standard error. Each option is also an "
        "environment variable; the command line wins. `--debug` (`ADEYE_DEBUG`) before the verb "
        "prints tracebacks. Exit codes are listed in the [README](../../README.md#exit-codes)."
    )
    return _page("Command line", lead, *parts)


def _command(words: str, command: Any) -> str:
    options = [item for item in command.params if item.param_type_name == "option"]
    arguments = [item for item in command.params if item.param_type_name == "argument"]
    names = [_argument(item) for item in arguments]
    parts = [f"## adeye {words}", f"`{' '.join(['adeye', words, *names, '[OPTIONS]'])}`"]
    parts.append("\n\n".join(" ".join(text.split()) for text in command.help.split("\n\n")))
    if arguments:
        rows = [[f"`{_argument(item)}`", item.help or ""] for item in arguments]
        parts.append(table(["Argument", "Meaning"], rows))
    shown = [item for item in options if item.name != "help"]
    if shown:
        rows = [[_option(item), _default(item), _variable(item), item.help] for item in shown]
        parts.append(table(["Option", "Default", "Variable", "Meaning"], rows))
    examples = [line.strip() for line in (command.epilog or "").splitlines()[1:]]
    if examples:
        parts.append("\n".join(["```sh", *examples, "```"]))
    return "\n\n".join(parts)


def _argument(item: Any) -> str:
    return str(item.metavar or item.name.upper())


def _option(item: Any) -> str:
    value = f" {item.metavar}" if item.metavar else ""
    if isinstance(item.default, Enum):
        value = " " + "\\|".join(str(word.value) for word in type(item.default))
    return f"`{', '.join(item.opts)}{value}`".replace("\\|", "/")


def _default(item: Any) -> str:
    default = item.default.value if isinstance(item.default, Enum) else item.default
    return "" if default in (None, False, ()) else f"`{default}`"


def _variable(item: Any) -> str:
    return f"`{item.envvar}`" if item.envvar else ""


# --- metrics --------------------------------------------------------------------------------------


def metrics_page() -> str:
    """Write the table of metrics and of metric series."""
    from adeye.judge.metrics import METRICS
    from adeye.judge.series import SERIES

    metrics = [
        [
            f"`{item.column}`",
            _unit(item.unit),
            item.worse,
            item.text,
            "" if item.cap is None else f"{item.cap:g}",
            item.source,
            f"`{item.uid}`",
        ]
        for item in METRICS.values()
        if item.uid.startswith("adeye:")
    ]
    series = [
        [
            f"`{item.name}`",
            _unit(item.type.unit),
            item.worse,
            item.type.text,
            "" if item.type.cap is None else f"{item.type.cap:g}",
            item.source,
            f"`{item.uid}`",
        ]
        for item in SERIES.values()
    ]
    return _page(
        "Metrics",
        "One number per run over the horizon and the tail, with its status, its time and its "
        'actor. *Worse* is the direction of danger. *Cap* is the margin that "no conflict" counts '
        "with. How they are used is in the [guide](../guide/metrics.md).",
        table(["Metric", "Unit", "Worse", "Meaning", "Cap", "Source", "Definition"], metrics),
        "## Metric series",
        "The same quantities at every row of a run; a formula names them like any other signal.",
        table(["Series", "Unit", "Worse", "Meaning", "Cap", "Source", "Definition"], series),
    )


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit


# --- signals --------------------------------------------------------------------------------------


def signals_page() -> str:
    """Write the dictionary of signals, with placeholders for the names that users choose."""
    from adeye.judge.series import series_signals
    from adeye.signals import architecture_signals, scene_signals

    scene = scene_signals(("ACTOR",), 1)
    scene["ego.lane"] = type(scene["ego.lane"])(
        "1", 1.0, "number", "lane, 0 at the right; -1 off the lanes"
    )
    parts = {
        "Scene": scene,
        "Sensors, channels, switch, monitors and faults": architecture_signals(
            ("SENSOR",), ("CHANNEL",), ("MONITOR",), ("FAULT",), ("ACTOR",)
        ),
        "Metric series": series_signals(),
    }
    return _page(
        "Signals",
        "What a formula may name. Words in capitals stand for ids of your files; "
        "`adeye signals ODD` lists the signals of an ODD by their real names. *Scale* is how much "
        "of the signal is one unit of robustness.",
        *(f"## {title}\n\n{_signals(found)}" for title, found in parts.items()),
    )


def _signals(found: Mapping[str, Any]) -> str:
    rows = [
        [
            f"`{name}`",
            _unit(kind.unit),
            kind.kind,
            f"{kind.scale:g}" if kind.kind == "number" else "",
            kind.text + (f": {', '.join(f'`{word}`' for word in kind.labels)}" * bool(kind.labels)),
        ]
        for name, kind in found.items()
    ]
    return table(["Signal", "Unit", "Kind", "Scale", "Meaning"], rows)


# --- database -------------------------------------------------------------------------------------


def database_page() -> str:
    """Write the columns of every view and table of a new database."""
    from adeye.store import schema

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "new.db"
        schema.upgrade(path)
        connection = sqlite3.connect(path)
        try:
            found = connection.execute(
                "SELECT type, name FROM sqlite_master WHERE type IN ('table', 'view') "
                "AND name NOT LIKE 'sqlite%' AND name <> 'alembic_version' ORDER BY name"
            ).fetchall()
            columns = {
                name: connection.execute(f"PRAGMA table_info({name})").fetchall()
                for _, name in found
            }
        finally:
            connection.close()
    parts = []
    for kind, title in (("view", "Views"), ("table", "Tables")):
        rows = [[f"`{name}`", _columns(columns[name])] for type_, name in found if type_ == kind]
        parts.append(f"## {title}\n\n{table([title[:-1], 'Columns'], rows)}")
    return _page(
        "Database",
        "Columns as SQLite lists them. Views are the stable interface; `v_runs_<scenario>` is made "
        "when a plan with the scenario is stored and has one column per parameter. "
        "`_status`, `_time_s` and `_actor` belong to the metric before them. What they mean is in "
        "the [guide](../guide/results-and-sql.md).",
        *parts,
    )


def _columns(found: Sequence[Sequence[Any]]) -> str:
    from adeye.store.tables import METRIC_IDS

    names = [str(item[1]) for item in found]
    parts = {f"{metric}{end}" for metric in METRIC_IDS for end in ("_status", "_time_s", "_actor")}
    shown = [name for name in names if name not in parts]
    return ", ".join(
        f"`{name}`" + (" (and 3)" if f"{name}_status" in names else "") for name in shown
    )


def report_schema() -> str:
    """Write the JSON Schema of a report."""
    from adeye.report.formats.json import json_schema

    return json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"


# --- other tools ----------------------------------------------------------------------------------


def other_tools_page() -> str:
    """Compare metrics with what other tools answered."""
    from docs.peers import compare

    found = table(compare.HEADERS, compare.rows())
    return _page("Other tools", compare.LEAD, found, compare.HOW)


PAGES: Final[Mapping[str, Callable[[], str]]] = {
    "cli.md": cli_page,
    "metrics.md": metrics_page,
    "signals.md": signals_page,
    "database.md": database_page,
    "other-tools.md": other_tools_page,
}
"""Generated pages by file name."""


# --- status of the capabilities -------------------------------------------------------------------

REPORT_SCHEMA: Final = ROOT / "docs" / "schema" / "report.schema.json"
NOTES: Final = {
    "R1": "worlds and scenarios from YAML, roads from OpenDRIVE; no OpenSCENARIO, CommonRoad",
    "R2": "one command runs every scenario of an ODD and resumes, also at every place of a map",
    "R3": "`adeye run` and `adeye.run` take the same file",
    "R4": "two nominal channels, one for policies, a safety channel; replaceable by name",
    "R5": "channels, sensors, metrics, executors of others by name; faults only by hooks of theirs",
    "R6": "bicycle with actuator lag and friction circle, occlusion, weather, grades; no slip",
    "R7": "by dotted path; height and pitch matter to physical cameras and lidars only",
    "R8": "all six, with closed-form tests; all but physical camera and lidar in plan view",
    "R9": "to linked channels, to the trace, and to others as OSI, MCAP, CommonRoad and tables",
    "R10": "closed loop at every tick of the master clock",
    "R11": "scripted actors of every kind, reactive vehicles; pedestrians are scripted only",
    "R12": "shadow commands of every channel, recorded with tracks and monitors",
    "R13": "fixed priority, hysteresis, voting; latency and limited rates of a handover; watchdog",
    "R14": "acceleration and steering angle, checked for every channel",
    "R15": "by channel id in trace and signals",
    "R16": "a second name",
    "R17": "parametric and imported roads, `extends:` and overrides; no map editor",
    "R18": "a scenario cannot name a sensor or a channel",
    "R19": "the `links` of a channel; whole lists of them are an axis of a sweep",
    "R20": "of sensors, channels and their insides, links, actuators, tyres and the switch",
    "R21": "the `faults` of an ODD, with their axes",
    "R22": "FMUs of FMI 2 and 3 as channel, vehicle, sensor, driver; our parts as FMUs of FMI 3",
    "R23": "pure Python, no GPU; equal bits across processors are intended, and not shown",
}
"""What is there of each capability and what is missing, beside its proof."""


def status_page() -> str:
    """Write the status of every capability as the program tells it."""
    from adeye.cli.doctor import capabilities

    rows = [
        [item.id, item.text, item.status.value, NOTES[item.id], _proof(item.proof)]
        for item in capabilities()
    ]
    made = table(["", "Capability", "Status", "What is there", "Proof"], rows)
    return (
        f"{NOTE}\n\n# Status\n\n"
        "The 23 capabilities of the platform. *Proven* means that an executable proof of the whole "
        "row is in `tests/requirements/`; *partly* that the proof covers a part; *not yet* that "
        "there is none. `adeye doctor --requirements` prints the same.\n\n"
        f"{made}\n"
    )


def _proof(path: str) -> str:
    return f"[{Path(path).name}](../../{path})" if path else ""


# --- all of them ----------------------------------------------------------------------------------


def baseline_schema() -> str:
    """Write the JSON Schema of a baseline, which a report makes and nobody writes."""
    from adeye.report.gate.baseline import json_schema

    return json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"


def pages() -> dict[Path, str]:
    """Make every generated page, by file."""
    own = {REFERENCE / name: page() for name, page in PAGES.items()}
    schemas = {BASELINE: baseline_schema(), REPORT_SCHEMA: report_schema()}
    return own | {REFERENCE / "status.md": status_page(), FILES: files_page()} | schemas


def stale() -> list[str]:
    """List the generated pages that are not what the code says now."""
    return [
        path.relative_to(ROOT).as_posix()
        for path, text in pages().items()
        if not path.is_file() or path.read_text("utf-8") != text
    ]


def main(arguments: Sequence[str]) -> int:
    """Write or check the pages; returns the exit code."""
    if "--check" in arguments:
        old = stale()
        for name in old:
            sys.stderr.write(f"{name} is stale; run python docs/generate.py\n")
        return 1 if old else 0
    REFERENCE.mkdir(parents=True, exist_ok=True)
    for path, text in pages().items():
        path.write_text(text, "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
