"""All verbs together: help, environment variables, start-up, completion, the first project."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from adeye import __version__
from adeye.cli.app import app

ROOT = Path(__file__).parents[2]
HEAVY = (
    "numpy",
    "pandas",
    "sqlalchemy",
    "numba",
    "highway_env",
    "scipy",
    "pydantic",
    "rich.live",
    "yaml",
)


def verbs(command: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield every verb with its words, depth first."""
    for name, child in getattr(command, "commands", {}).items():
        if hasattr(child, "commands"):
            yield from verbs(child, (*path, name))
        else:
            yield (*path, name), child


VERBS = dict(verbs(typer.main.get_command(app)))
OPTIONS = [
    (" ".join(path), option)
    for path, verb in VERBS.items()
    for option in verb.params
    if option.param_type_name == "option" and "--help" not in option.opts
]


def program(*arguments: str, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    inherited = {name: value for name, value in os.environ.items() if name[:6] != "ADEYE_"}
    return subprocess.run(
        [sys.executable, "-m", "adeye", *arguments],
        cwd=cwd,
        env={**inherited, "PYTHONPATH": str(ROOT), "COLUMNS": "300", **environment},
        capture_output=True,
        text=True,
        check=False,
    )


def test_the_verbs_are_these() -> None:
    assert sorted(" ".join(path) for path in VERBS) == [
        "certify",
        "check",
        "compare",
        "confidence",
        "coverage",
        "db copy",
        "db grant",
        "db info",
        "db merge",
        "db metadata",
        "db prove",
        "db upgrade",
        "db verify",
        "db withdraw",
        "dependencies",
        "doctor",
        "export",
        "faults",
        "fork",
        "forks",
        "gate",
        "init",
        "judge",
        "manifest keygen",
        "manifest verify",
        "manifest write",
        "matrix",
        "new channel",
        "new metric",
        "new sensor",
        "plan",
        "plugins",
        "preventability",
        "query",
        "reference",
        "replay",
        "report",
        "run",
        "scenario lint",
        "scenario list",
        "scenario show",
        "selftest",
        "sensors",
        "show",
        "signals",
        "stale",
        "stl",
        "timeline",
        "uncertainty",
        "warmup",
    ]


def test_every_verb_has_help_with_an_example(adeye: Any) -> None:
    for path, verb in VERBS.items():
        ended = adeye(*path, "--help")
        assert (ended.code, ended.err) == (0, ""), path
        assert verb.help.endswith("."), path
        assert f"adeye {' '.join(path)}" in ended.out.split("Examples:")[1]


def test_every_option_has_help_and_an_environment_variable() -> None:
    lacking = [
        (verb, option.name)
        for verb, option in OPTIONS
        if not option.help or not str(option.envvar).startswith("ADEYE_")
    ]
    assert lacking == []


def test_one_environment_variable_means_one_thing() -> None:
    meant: dict[str, set[object]] = {}
    for _, option in OPTIONS:
        meant.setdefault(str(option.envvar), set()).add(option.type_descriptor.annotation)
    assert {name: kinds for name, kinds in meant.items() if len(kinds) > 1} == {}


READS = (
    *("plan", "signals", "show", "replay", "query", "scenario list", "scenario show", "doctor"),
    "sensors",
    "coverage",
)


def test_reads_can_print_json() -> None:
    having = {path for path, option in OPTIONS if "--json" in option.opts}
    assert {*READS, "scenario lint", "db info", "db verify", "db upgrade"} <= having


def test_environment_variable_sets_an_option(adeye: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ADEYE_JSON", "1")
    assert adeye("query", "--list").document["schema"] == "adeye/query-list@1"


def test_version(adeye: Any) -> None:
    assert adeye("--version").out == f"adeye {__version__}\n"


@pytest.mark.slow
def test_help_loads_nothing_heavy(tmp_path: Path) -> None:
    program_text = (
        "import sys; from adeye.cli import main; code = main(['--help'])\n"
        f"print(code, sorted(set({HEAVY!r}) & set(sys.modules)))"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program_text],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert ended.stdout.splitlines()[-1] == "0 []"


@pytest.mark.slow
def test_python_m_adeye_is_the_same_program(tmp_path: Path) -> None:
    assert program("--version", cwd=tmp_path).stdout == f"adeye {__version__}\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("adeye ru", "run"),
        ("adeye scenario show cut_i", "cut_in"),
        ("adeye query fail", "failing-fsrs"),
        ("adeye query --format c", "csv"),
    ],
)
def test_shell_completion_offers(tmp_path: Path, line: str, offered: str) -> None:
    ended = program(
        cwd=tmp_path,
        _ADEYE_COMPLETE="complete_bash",
        COMP_WORDS=line,
        COMP_CWORD=str(len(line.split()) - 1),
    )
    assert ended.returncode == 0
    assert offered in ended.stdout.split()
    assert ended.stderr == ""


@pytest.mark.slow
def test_completion_script_can_be_printed(tmp_path: Path) -> None:
    ended = program(
        "--show-completion", "bash", cwd=tmp_path, _TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION="1"
    )
    assert ended.returncode == 0
    assert "_ADEYE_COMPLETE=complete_bash" in ended.stdout


@pytest.mark.slow
def test_no_color_without_a_terminal(tmp_path: Path) -> None:
    assert "\x1b" not in program("query", "--list", cwd=tmp_path).stdout


@pytest.mark.slow
def test_first_project_runs_green_twice_and_is_read(tmp_path: Path) -> None:
    def adeye(*arguments: str, code: int = 0) -> str:
        ended = program(*arguments, cwd=tmp_path)
        assert ended.returncode == code, ended.stderr
        assert "Traceback" not in ended.stderr
        return ended.stdout

    adeye("init")
    first = json.loads(adeye("run", "odd/first.yaml", "--workers", "1", "--json"))
    assert (first["executed"], first["reused"], first["exit_code"]) == (12, 0, 0)
    again = adeye("run", "odd/first.yaml", "--workers", "1")
    assert "Executed nothing, all 12 results were there." in again
    worst = json.loads(adeye("query", "worst-runs", "--json"))["rows"]
    assert {row["fsr"] for row in worst} >= {"FSR-01", "FSR-02"}
    assert json.loads(adeye("query", "failing-fsrs", "--json"))["rows"] == []
    for name in ("gate", "fault-coverage", "metrics-by-architecture", "outcomes", "campaigns"):
        assert json.loads(adeye("query", name, "--json"))["rows"], name
    shown = json.loads(adeye("show", worst[0]["run"], "--json"))
    assert str(shown["run"]).startswith(worst[0]["run"])
    replayed = json.loads(adeye("replay", worst[0]["run"], "--json"))
    assert replayed["identical"] is True
    adeye("report")
    assert "<html" in (tmp_path / "report.html").read_text("utf-8")
    assert "Intact" in adeye("db", "verify")
