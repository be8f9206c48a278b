"""All verbs together, and how the program ends: the right code, never 0 by accident."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final
from unittest.mock import Mock

import pytest
import typer

import adeye.campaign.plan
from adeye import __version__, errors
from adeye.cli import verbs as listed
from adeye.cli.app import app
from adeye.errors import SourceLocation, Terminated
from tests.project import Executed

# --- all verbs together: help, environment variables, start-up, completion, the first project


ROOT = Path(__file__).parents[2]
HEAVY = (
    "numpy pandas sqlalchemy numba highway_env scipy pydantic rich.live yaml mcap foxglove osi3 "
    "markdown_it pygments"
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


def start(*arguments: str, cwd: Path, **options: Any) -> subprocess.Popen[str]:
    """Start the program with nothing of the caller's settings."""
    inherited = {name: value for name, value in os.environ.items() if name[:6] != "ADEYE_"}
    own = {"PYTHONPATH": str(ROOT), "COLUMNS": "300", **options.pop("env", {})}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    command = [sys.executable, "-m", "adeye", *arguments]
    return subprocess.Popen(command, cwd=cwd, env={**inherited, **own}, text=True, **pipes)


def program(*arguments: str, cwd: Path, **environment: str) -> tuple[int, str, str]:
    """Give the exit code of the program, what it printed and what it said."""
    process = start(*arguments, cwd=cwd, env=environment)
    out, err = process.communicate(timeout=600)
    return process.returncode, out, err


def test_every_verb_has_help_with_an_example(adeye: Any) -> None:
    for path, verb in VERBS.items():
        ended = adeye(*path, "--help")
        assert (ended.code, ended.err) == (0, ""), path
        assert verb.help.endswith("."), path
        assert f"adeye {' '.join(path)}" in ended.out.split("Examples:")[1]


def test_the_list_of_verbs_tells_what_their_own_help_begins_with() -> None:
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    own = {name: command.help.split("\n\n")[0] for name, command in commands.items()}
    assert {name: verb.summary for name, verb in listed.VERBS.items()} == own


def test_a_verb_imports_the_modules_of_no_other() -> None:
    script = (
        "import sys; from adeye.cli import main; main(['stl', '--help'])\n"
        "print(*sorted(name for name in sys.modules if name.startswith('adeye.cli.')))"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    printed = subprocess.check_output([sys.executable, "-c", script], env=environment, text=True)
    loaded = {name.removeprefix("adeye.cli.") for name in printed.splitlines()[-1].split()}
    assert loaded == {"app", "options", "output", "progress", "results", "results.query", "verbs"}


def test_verbs_are_put_together_once(adeye: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    assert adeye("--version").code == 0
    monkeypatch.setattr("typer.main.get_group", None)
    assert adeye("--version").code == 0


def test_one_environment_variable_means_one_thing() -> None:
    meant: dict[str, set[object]] = {}
    for _, option in OPTIONS:
        meant.setdefault(str(option.envvar), set()).add(option.type_descriptor.annotation)
    assert {name: kinds for name, kinds in meant.items() if len(kinds) > 1} == {}


READS = """plan; signals; report; show; replay; query; doctor; sensors; coverage; scenario list;
scenario show; scenario lint; db info; db verify; db upgrade"""


def test_reads_can_print_json() -> None:
    having = {path for path, option in OPTIONS if "--json" in option.opts}
    assert {" ".join(path.split()) for path in READS.split(";")} <= having


def test_environment_variable_sets_an_option(adeye: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ADEYE_JSON", "1")
    assert adeye("query", "--list").document["schema"] == "adeye/query-list@1"


def test_version(adeye: Any) -> None:
    assert adeye("--version").out == f"adeye {__version__}\n"


def test_help_loads_nothing_heavy(tmp_path: Path) -> None:
    script = (
        "import sys; from adeye.cli import main; code = main(['--help'])\n"
        f"print(code, sorted(set({HEAVY.split()!r}) & set(sys.modules)))"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", script]
    printed = subprocess.check_output(command, cwd=tmp_path, env=environment, text=True)
    assert printed.splitlines()[-1] == "0 []"


# --- What a verb that reads loads: nothing that drives a run or compiles --------------------------

COMPILED: Final = "numba llvmlite scipy pandas highway_env gymnasium"
UNASKED: Final = (
    "adeye.simulate adeye.spec.load adeye.spec.scenario adeye.campaign.plan adeye.reporting"
)
PLAIN: Final = "numpy yaml adeye.store.tables adeye.store.records"
WRITTEN: Final = (
    "adeye.store.write adeye.store.encoding adeye.spec.concept adeye.spec.document "
    "adeye.report.model adeye.store.evidence.verification"
)
QUICK: Final = {
    "query SELECT(1)": PLAIN,
    "query failing-fsrs": PLAIN.replace("yaml ", ""),
    "query --columns v_runs": PLAIN,
    "show --worst FSR-01": f"{WRITTEN} yaml adeye.store.tables",
    "where FSR-01": "adeye.spec.concept adeye.spec.document",
    "db info": f"{WRITTEN} numpy yaml adeye.kernel adeye.signals",
    "gate": "",
    "diff 1 1": "",
}
"""Verbs, and what else each of them does without."""


@pytest.mark.slow
@pytest.mark.parametrize("verb", QUICK)
def test_reads_load_no_compiler_and_nothing_that_plans_drives_or_draws(
    verb: str, mini: Executed, tmp_path: Path
) -> None:
    unasked = f"{COMPILED} {UNASKED} {QUICK[verb]}".split()
    script = (
        f"import sys; from adeye.cli import main; code = main({verb.split()!r})\n"
        f"print(code, sorted(set({unasked!r}) & set(sys.modules)))"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "ADEYE_DB": str(mini.db)}
    command = [sys.executable, "-c", script]
    printed = subprocess.check_output(command, cwd=tmp_path, env=environment, text=True)
    code, _, loaded = printed.splitlines()[-1].partition(" ")
    assert (code in "01", loaded) == (True, "[]")


def test_help_shows_brackets_and_no_value_of_flags() -> None:
    for words, shown in (
        ("--help", "--version"),
        ("db --help", "merge"),
        ("export --help", "adeye[columnar]"),
        ("fmu export --help", "adeye[fmi]"),
    ):
        code, out, _ = program(*words.split(), cwd=ROOT, COLUMNS="200")
        assert (code, shown in out, "<bool>" in out) == (0, True, False)


@pytest.mark.slow
def test_python_m_adeye_is_the_same_program_and_has_no_colour_in_a_pipe(tmp_path: Path) -> None:
    assert program("--version", cwd=tmp_path) == (0, f"adeye {__version__}\n", "")
    code, out, err = program("query", "--list", cwd=tmp_path)
    assert (code, err) == (0, "")
    assert "failing-fsrs" in out
    assert "\x1b" not in out


def test_no_plugin_of_pydantic_is_asked_what_is_valid(tmp_path: Path) -> None:
    (tmp_path / "lenient.py").write_text(
        "from pathlib import Path\nPath(__file__).with_name('asked').touch()\nplugin = None\n"
    )
    about = tmp_path / "lenient-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: lenient\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[pydantic]\nlenient = lenient:plugin\n")
    odd = ROOT / "odd" / "motorway_chauffeur.yaml"
    code, out, err = program("plan", str(odd), cwd=tmp_path, PYTHONPATH=f"{tmp_path}:{ROOT}")
    assert (code, "Test cases" in out) == (0, True), err
    assert not (tmp_path / "asked").exists()


def test_python_without_docstrings_is_an_environment_error(tmp_path: Path) -> None:
    with start("plan", "x.yaml", cwd=tmp_path, env={"PYTHONOPTIMIZE": "2"}) as process:
        said = process.communicate()
    assert (process.returncode, said[0]) == (5, "")
    assert (said[1].count("\n"), "Unset PYTHONOPTIMIZE" in said[1]) == (1, True)


def test_no_part_is_executed_without_its_asserts(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("class Mine:\n    pass\n")
    asked = (
        "from pathlib import Path\nfrom adeye.errors import PlatformError\n"
        "from adeye.plugins import load_part\n"
        "try:\n    load_part('./mine.py:Mine', Path())\n"
        "except PlatformError as error:\n    print(error)\n"
    )
    for options, said in (((), ""), (("-O",), "./mine.py:Mine would be executed without")):
        done = subprocess.run(
            [sys.executable, *options, "-c", asked],
            cwd=tmp_path, env={"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=True,
        )  # fmt: skip
        assert (done.stdout != "", said in done.stdout) == (bool(said), True)


@pytest.mark.slow
def test_shell_completion_offers(tmp_path: Path) -> None:
    for line, offered in (
        ("adeye ru", "run"),
        ("adeye scenario show cut_i", "cut_in"),
        ("adeye query fail", "failing-fsrs"),
        ("adeye query --format c", "csv"),
    ):
        words = {"COMP_WORDS": line, "COMP_CWORD": str(len(line.split()) - 1)}
        code, out, err = program(cwd=tmp_path, _ADEYE_COMPLETE="complete_bash", **words)
        assert (code, err) == (0, ""), line
        assert offered in out.split(), line


@pytest.mark.slow
def test_completion_script_can_be_printed(tmp_path: Path) -> None:
    setting = {"_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    code, out, _ = program("--show-completion", "bash", cwd=tmp_path, **setting)
    assert code == 0
    assert "_ADEYE_COMPLETE=complete_bash" in out


@pytest.mark.slow
def test_first_project_runs_green_twice_and_is_read(tmp_path: Path) -> None:
    def adeye(*arguments: str) -> str:
        code, out, err = program(*arguments, cwd=tmp_path)
        assert code == 0, err
        assert "Traceback" not in err
        return out

    def read(*arguments: str) -> Any:
        return json.loads(adeye(*arguments, "--json"))

    adeye("init")
    first = read("run", "odd/first.yaml", "--workers", "1")
    assert (first["executed"], first["reused"], first["exit_code"]) == (12, 0, 0)
    again = adeye("run", "odd/first.yaml", "--workers", "1")
    assert "Executed nothing, all 12 results were there." in again
    worst = read("query", "worst-runs")["rows"]
    assert {row["fsr"] for row in worst} >= {"FSR-01", "FSR-02"}
    assert read("query", "failing-fsrs")["rows"] == []
    for name in ("gate", "fault-coverage", "metrics-by-architecture", "outcomes", "campaigns"):
        assert read("query", name)["rows"], name
    assert str(read("show", worst[0]["run"])["run"]).startswith(worst[0]["run"])
    assert read("replay", worst[0]["run"])["identical"] is True
    adeye("report")
    assert "<html" in (tmp_path / "report.html").read_text("utf-8")
    assert "Intact" in adeye("db", "verify")


# --- how the program ends: one message, the right code, never 0 by accident


PLACE = SourceLocation("odd/first.yaml", 14, 9)
FLAW = errors.SweepError("gap: 0 s", where=PLACE, remedy="Write a length.")


@pytest.fixture
def plan_raises(monkeypatch: pytest.MonkeyPatch) -> Callable[[BaseException], None]:
    """Make ``adeye plan`` raise."""

    make_plan = Mock()
    monkeypatch.setattr(adeye.campaign.plan, "make_plan", make_plan)
    return lambda error: make_plan.configure_mock(side_effect=error)


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (FLAW, 2, "SweepError: odd/first.yaml:14:9: gap: 0 s. Write a length."),
        (errors.PlatformError("database x is locked"), 5, "PlatformError: database x is locked"),
        (errors.IntegrityError("row 7"), 4, "IntegrityError: row 7"),
        (OSError(28, "No space left on device"), 5, "PlatformError: No space left on device."),
        (MemoryError(), 5, "PlatformError: out of memory. Use fewer workers."),
    ],
)
def test_error_is_a_message(adeye: Any, plan_raises: Any, error: Any, code: int, said: str) -> None:
    plan_raises(error)
    ended = adeye("plan", "odd.yaml")
    assert (ended.code, ended.err, ended.out) == (code, said + "\n", "")


def test_several_input_errors_are_harmless_lines(adeye: Any, plan_raises: Any) -> None:
    strange = errors.SpecError("name 'a\x1b]0;title\x07b'")
    plan_raises(errors.InputErrors([strange, errors.UnitError("b")]))
    said = adeye("plan", "odd.yaml").refused
    assert said == "SpecError: name 'a]0;titleb'.\nUnitError: b.\n2 errors.\n"


def test_defect_says_so_without_traceback(adeye: Any, plan_raises: Any) -> None:
    plan_raises(KeyError("speed"))
    ended = adeye("plan", "odd.yaml")
    assert ended.code == 3
    assert "KeyError: 'speed'" in ended.err
    assert "defect of adeye" in ended.err
    assert "ADEYE_DEBUG=1" in ended.err
    assert "Traceback" not in ended.err


def test_debug_tracebacks(adeye: Any, plan_raises: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    plan_raises(errors.SpecError("a"))
    assert "Traceback" in adeye("--debug", "plan", "odd.yaml").refused
    assert "Traceback" not in adeye("plan", "odd.yaml").refused
    monkeypatch.setenv("ADEYE_DEBUG", "1")
    assert "Traceback" in adeye("plan", "odd.yaml").refused


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("ADEYE_GATE_BASELNE", "Did you mean ADEYE_GATE_BASELINE?"),
        ("ADEYE_TABEL", "Did you mean ADEYE_TABLE?"),
        ("ADEYE_QQ", "See the verb's --help."),
    ],
)
def test_variable_that_nothing_reads_is_named(
    adeye: Any, monkeypatch: pytest.MonkeyPatch, name: str, said: str
) -> None:
    monkeypatch.setenv(name, "1")
    ended = adeye("init", "--list")
    assert ended.code == 0
    assert ended.err == f"note: no option reads {name} of the environment. {said}\n"


@pytest.mark.parametrize(
    "name",
    ["ADEYE_DB", "ADEYE_DEBUG", "ADEYE_NUMBA_CACHE_DIR", "ADEYE_GATE_BASELINE", "ADEYE_TABLE"],
)
def test_variable_of_this_or_another_verb_is_not_named(
    adeye: Any, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setenv(name, "0")
    ended = adeye("init", "--list")
    assert (ended.code, ended.err) == (0, "")


def test_interruption_has_its_code_and_no_traceback(adeye: Any, plan_raises: Any) -> None:
    for error, code in ((KeyboardInterrupt(), 130), (Terminated(), 143)):
        plan_raises(error)
        ended = adeye("plan", "odd.yaml")
        assert (ended.code, ended.err) == (code, "")


def test_wrong_usage_is_one_line_and_code_2(adeye: Any) -> None:
    for arguments, part in (
        (("rnu",), "Did you mean 'run'?"),
        (("run",), "Missing argument 'ODD'"),
        (("run", "odd.yaml", "--wokers", "2"), "--workers"),
        (("run", "odd.yaml", "--workers", "0"), "'--workers'"),
        (("query", "--format", "xml"), "table"),
        (("plan", "no_such.yaml"), "no_such.yaml"),
    ):
        ended = adeye(*arguments)
        assert part in ended.refused
        assert ended.err.count("\n") == 1
    assert adeye("rnu").err.startswith("UsageError: ")
    ended = adeye()
    assert (ended.code, (ended.out + ended.err).count("Usage: adeye")) == (2, 1)


BOUNDS: dict[str, tuple[float | None, float | None]] = {
    "run --threads": (1, None),
    "run --workers": (1, None),
    "run --maxfail": (1, None),
    "coverage --strength": (1, 3),
    "judge --threads": (1, None),
    "judge --workers": (1, None),
    "faults --sample": (0, None),
    "forks --sample": (0, None),
    "preventability --workers": (1, 64),
    "query --max-rows": (1, None),
    "query --timeout-s": (0.1, None),
    "certify --sample": (1, None),
}
"""Least and most of each number that an option takes, where it has bounds of its own."""


def test_numbers_of_options_have_their_bounds() -> None:
    found = {
        f"{verb} {option.opts[0]}": (option.min, option.max)
        for verb, option in OPTIONS
        if (option.min, option.max) != (None, None)
    }
    assert found == BOUNDS


@pytest.mark.slow
def test_reader_that_goes_away_is_no_error(folder: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    process = start("scenario", "list", "--json", cwd=folder, stdout=writing)
    os.close(writing)
    _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, "")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("closed", "said"), [("<&- >&-", "note: standard output is closed, so"), ("2>&-", "")]
)
def test_closed_streams_are_no_error(folder: Path, closed: str, said: str) -> None:
    command = ["sh", "-c", f'"$0" -m adeye scenario list {closed}', sys.executable]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr[: len(said) or None]) == (0, said)


@pytest.mark.slow
def test_full_disk_is_an_environment_error(folder: Path) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("this system has no /dev/full")
    with Path("/dev/full").open("w") as full:
        process = start("scenario", "list", "--json", cwd=folder, stdout=full)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 5
    assert err.startswith("PlatformError: ")
    assert err.count("\n") == 1


def test_full_standard_error_leaves_the_exit_code(folder: Path) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("this system has no /dev/full")
    with Path("/dev/full").open("w") as full:
        process = start("scenario", "show", "nothing", cwd=folder, stderr=full)
        process.communicate(timeout=60)
    assert process.returncode == 2


@pytest.mark.slow
def test_sigterm_ends_with_143(folder: Path) -> None:
    with start("query", "-", cwd=folder, stdin=subprocess.PIPE) as process:
        # It waits for the statement; give it time to get there.
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(timeout=4)
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=60) == 143
