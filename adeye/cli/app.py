"""The verbs of ``adeye`` put together, with what is common to all."""

from __future__ import annotations

import gc
import os
import sys
import traceback
from collections.abc import Sequence
from typing import Annotated, Final

import typer

from adeye.cli.certify import certify, selftest
from adeye.cli.compare import compare, matrix
from adeye.cli.confidence import confidence, uncertainty
from adeye.cli.database import database_app, manifest_app
from adeye.cli.doctor import doctor, plugins
from adeye.cli.faults import faults, fork, forks, timeline
from adeye.cli.gate import check, gate, stale
from adeye.cli.new import init, new_app
from adeye.cli.options import add, examples
from adeye.cli.output import clean, emit, talk
from adeye.cli.plan import coverage, dependencies, plan, signals
from adeye.cli.preventability import preventability, reference
from adeye.cli.progress import leave_if_abandoned, raising_on_sigterm
from adeye.cli.query import export, query
from adeye.cli.run import judge, report, run, warmup
from adeye.cli.scenario import scenario_app
from adeye.cli.sensors import sensors
from adeye.cli.show import replay, show
from adeye.cli.stl import stl
from adeye.errors import Terminated
from adeye.notices import told_to
from adeye.supervision import Ended, has_guests, note_end, supervise

# --- The verbs of ``adeye`` put together, with what is common to all ------------------------------

CAMPAIGN: Final = "Plan and run"
RESULTS: Final = "Read results"
WRITE: Final = "Write your own"
KEEP: Final = "Keep it healthy"

app = typer.Typer(
    help="Test an autonomous driving architecture in closed loop against its operational design "
    "domain: every scenario, fault and sensor of an ODD file, judged against the functional "
    "safety requirements.",
    epilog=examples(
        "adeye init && adeye run odd/first.yaml --report report.html",
        "adeye plan odd/motorway_chauffeur.yaml",
        "adeye query failing-fsrs",
    ),
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(value: bool) -> None:
    if value:
        from adeye.version import __version__

        emit(f"adeye {__version__}")
        raise typer.Exit


def _ask_for_tracebacks(value: bool) -> None:
    if value:
        os.environ["ADEYE_DEBUG"] = "1"


@app.callback()
def common(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
    debug: Annotated[
        bool,
        typer.Option(
            "--debug",
            envvar="ADEYE_DEBUG",
            callback=_ask_for_tracebacks,
            is_eager=True,
            help="Print tracebacks of errors.",
        ),
    ] = False,
) -> None:
    """Take what is common to all verbs."""


add(app, plan, "adeye plan odd/first.yaml", "adeye plan odd/first.yaml --json", panel=CAMPAIGN)
add(
    app,
    run,
    "adeye run odd/first.yaml",
    "adeye run odd/first.yaml --workers 2 --report report.html --junit junit.xml",
    panel=CAMPAIGN,
)
add(
    app,
    coverage,
    "adeye coverage odd/first.yaml",
    "adeye coverage 3 --strength 3 --json",
    panel=CAMPAIGN,
)
add(
    app,
    judge,
    "adeye judge odd/first.yaml",
    "adeye judge odd/first.yaml --replay",
    panel=CAMPAIGN,
)
add(
    app,
    gate,
    "adeye gate",
    "adeye gate --baseline reports/baselines/motorway_chauffeur.json --tolerance m=0.05",
    "adeye gate --baseline reports/baselines/motorway_chauffeur.json --update",
    panel=CAMPAIGN,
)
add(
    app,
    stale,
    "adeye stale",
    "adeye stale odd/first.yaml --json",
    panel=CAMPAIGN,
)
add(app, signals, "adeye signals odd/first.yaml", panel=CAMPAIGN)
add(
    app,
    sensors,
    "adeye sensors odd/architectures/camera_radar.yaml",
    "adeye sensors --odd odd/motorway_chauffeur.yaml --html suites.html",
    panel=CAMPAIGN,
)
add(
    app,
    dependencies,
    "adeye dependencies odd/motorway_chauffeur.yaml",
    "adeye dependencies odd/motorway_chauffeur.yaml --architecture camera_radar --json",
    panel=CAMPAIGN,
)
add(
    app,
    reference,
    "adeye reference cases.csv",
    "adeye reference cases.csv --models cc,fsm --edition r157-01 --variant jrc -o result.csv",
    "adeye reference leads.csv --scene deceleration --step 0.1 --integrator semi-implicit",
    panel=CAMPAIGN,
)
add(
    app,
    check,
    "adeye check odd/motorway_chauffeur.yaml",
    "adeye check",
    "adeye check 3 --json",
    panel=CAMPAIGN,
)
add(app, show, "adeye show 3f2a91c04b", "adeye show 3f2a --json", panel=RESULTS)
add(
    app,
    replay,
    "adeye replay 3f2a91c04b",
    "adeye replay 3f2a91c04b --html replay.html",
    "adeye replay 3f2a91c04b --grid '4.2 s' --dump grid.npz",
    panel=RESULTS,
)
add(
    app,
    timeline,
    "adeye timeline 3f2a91c04b",
    "adeye timeline 3f2a --json",
    panel=RESULTS,
)
add(
    app,
    faults,
    "adeye faults",
    "adeye faults 3 --sample 0 --json",
    "adeye faults --by safety.parameters.confirm",
    panel=RESULTS,
)
add(
    app,
    fork,
    "adeye fork 3f2a91c04b --from '2 s' --authority safety",
    "adeye fork 3f2a --from 0 --authority nominal --json",
    panel=RESULTS,
)
add(app, forks, "adeye forks", "adeye forks 3 --sample 50 --json", panel=RESULTS)
add(
    app,
    uncertainty,
    "adeye uncertainty",
    "adeye uncertainty odd/motorway_chauffeur.yaml --json",
    panel=CAMPAIGN,
)
add(
    app,
    preventability,
    "adeye preventability",
    "adeye preventability 3 --model cc,fsm --json",
    "adeye preventability 3f2a91c04b --model rss --threshold '4 m/s^2'",
    panel=RESULTS,
)
add(
    app,
    query,
    "adeye query failing-fsrs",
    "adeye query 'SELECT scenario, min_ttc_s FROM v_runs ORDER BY 2' --format csv",
    panel=RESULTS,
)
add(
    app,
    stl,
    "adeye stl 'always(gap > 2 m)' drive.csv --unit gap=m",
    "adeye stl 'always(brake implies once[0 s, tau](ttc < 2 s))' drive.csv --unit ttc=s "
    "--set tau=0.5s --json",
    panel=RESULTS,
)
add(
    app,
    compare,
    "adeye compare",
    "adeye compare odd/motorway_chauffeur.yaml --baseline legacy_camera",
    "adeye compare 3 camera_radar legacy_camera --objectives failures,cost --epsilon cost=20",
    panel=RESULTS,
)
add(
    app,
    confidence,
    "adeye confidence odd/motorway_chauffeur.yaml",
    "adeye confidence 3 --level 0.99 --target 1e-3",
    panel=RESULTS,
)
add(
    app,
    report,
    "adeye report",
    "adeye report 3 -o report.html --junit junit.xml",
    "adeye report --gsn argument.svg --reqif requirements.reqif --sarif verdicts.sarif",
    panel=RESULTS,
)
add(
    app,
    matrix,
    "adeye matrix",
    "adeye matrix --by scenario",
    "adeye matrix 3 --csv > matrix.csv",
    panel=RESULTS,
)
add(
    app,
    export,
    "adeye export -o results",
    "adeye export 3 -o runs.parquet",
    "adeye export --table verdicts -o verdicts.csv",
    panel=RESULTS,
)
add(app, init, "adeye init", "adeye init my_project", panel=WRITE)
app.add_typer(new_app, name="new", rich_help_panel=WRITE)
app.add_typer(scenario_app, name="scenario", rich_help_panel=WRITE)
app.add_typer(database_app, name="db", rich_help_panel=KEEP)
app.add_typer(manifest_app, name="manifest", rich_help_panel=KEEP)
add(
    app,
    plugins,
    "adeye plugins",
    "adeye plugins odd/first.yaml --json",
    panel=KEEP,
)
add(app, warmup, "adeye warmup", "adeye warmup odd/first.yaml", panel=KEEP)
add(
    app,
    selftest,
    "adeye selftest",
    "adeye selftest --only never_brakes --only verdict_edited",
    panel=KEEP,
)
add(
    app,
    certify,
    "adeye certify odd/motorway_chauffeur.yaml",
    "adeye certify 3 --sample 200 --masks --json",
    panel=KEEP,
)
add(app, doctor, "adeye doctor", "adeye doctor --requirements", panel=KEEP)


# --- The console script: run a verb, and turn whatever ends it into one message and an exit code --

DEBUG: Final = "ADEYE_DEBUG"
"""Environment variable that asks for tracebacks; ``--debug`` sets it, workers inherit it."""

_COLLECT_AFTER: Final = 50_000
"""Objects made between two collections of the youngest."""

_USAGE: Final = 2
_DEFECT: Final = 3
_ENVIRONMENT: Final = 5
_UNWRITTEN: Final = 120
"""Python's own exit code where the last output could not be written."""
_INTERRUPTED: Final = 130
_READER_GONE: Final = 141
_TERMINATED: Final = 143


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    As a program of its own it works in a child process, which no plug-in can end as good; called
    with arguments, it works in this one.

    Args:
        arguments: What follows the name of the program; default: what it was called with.

    Returns:
        The exit code, see ``judge.verdict.ExitCode``; never 0 if anything went wrong.
    """
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            # A name that the terminal cannot show must not end the program.
            reconfigure(errors="backslashreplace")
    ended = _supervised() if arguments is None else None
    if ended is not None:
        if ended.text:
            talk(clean(ended.text))
        return ended.code
    # Imports and plans make many objects that stay: looking for rubbish among them at Python's pace
    # takes a tenth of a short command.
    gc.set_threshold(_COLLECT_AFTER)
    before = os.environ.get(DEBUG)
    try:
        code = _ended(arguments)
    finally:
        if before is None:
            os.environ.pop(DEBUG, None)
    note_end(_flushed(code))
    if code in {_INTERRUPTED, _TERMINATED}:
        leave_if_abandoned(code)
    return code


def _supervised() -> Ended | None:
    try:
        return supervise()
    except OSError as error:
        text = f"PlatformError: no process can be started: {error.strerror or error}."
        return Ended(_ENVIRONMENT, f"{text} Allow more of them (ulimit -u), or end others.")


def _flushed(code: int) -> int:
    """Write what is still to be written: a plug-in may end the process before Python does."""
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except (OSError, ValueError):
        return code or _UNWRITTEN
    return code


def _ended(arguments: Sequence[str] | None) -> int:
    try:
        with raising_on_sigterm():
            return _run(arguments)
    except Terminated:
        return _TERMINATED
    except (KeyboardInterrupt, typer.Abort):
        return _INTERRUPTED
    except SystemExit as error:
        return _code_of(error)
    except BaseException as error:  # noqa: BLE001 - the boundary where errors become messages
        return _report(error)


def _run(arguments: Sequence[str] | None) -> int:
    command = typer.main.get_command(app)
    given = None if arguments is None else list(arguments)
    with told_to(_tell):
        result = command.main(given, prog_name="adeye", standalone_mode=False)
    return result if isinstance(result, int) else 0


def _tell(text: str) -> None:
    from adeye.store.location import masked

    talk(clean(f"note: {masked(text)}"))


def _code_of(error: SystemExit) -> int:
    if isinstance(error.__context__, BrokenPipeError):
        return _READER_GONE
    if error.code is None or isinstance(error.code, int):
        if error.code or not has_guests():
            return error.code or 0
        # No verb ends so that calls a plug-in: whoever raised it has not seen the end.
        talk("Something ended the program before its end: what it was asked for is incomplete.")
        return _DEFECT
    talk(clean(error.code, lines=True))
    return _USAGE


def _report(error: BaseException) -> int:
    """Tell what ended the verb and return the exit code."""
    from adeye.errors import AdeyeError, InputError
    from adeye.store.location import masked

    if os.environ.get(DEBUG, "0") not in {"", "0"}:
        talk(clean(masked("".join(traceback.format_exception(error))), lines=True))
    if isinstance(error, AdeyeError):
        text = str(error)
        if not isinstance(error, InputError):
            text = f"{type(error).__name__}: {text}"
        talk(clean(masked(text), lines=True))
        return error.exit_code or _DEFECT
    if hasattr(error, "format_message"):
        # The parser's own errors; its class differs between releases of typer.
        text = _usage(error, masked(error.format_message()))
        if text.strip():
            talk(text)
        return _USAGE
    if isinstance(error, OSError):
        place = f"{error.filename}: " if error.filename else ""
        talk(clean(masked(f"PlatformError: {place}{error.strerror or error}.")))
        return _ENVIRONMENT
    if isinstance(error, MemoryError):
        talk("PlatformError: out of memory. Use fewer workers.")
        return _ENVIRONMENT
    talk(
        clean(masked(f"{type(error).__name__}: {error}"), lines=True)
        + "\nThis is a defect of adeye, not of your files. "
        f"Set {DEBUG}=1 and run again for the traceback, and report both."
    )
    return _DEFECT


def _usage(error: BaseException, message: str) -> str:
    context = getattr(error, "ctx", None)
    command = context.command_path if context is not None else "adeye"
    if type(error).__name__ == "NoArgsIsHelpError":
        # The help itself; with rich it is printed already.
        return clean(message, lines=True)
    text = clean(message.strip())
    stop = "" if text.endswith((".", "?", "!")) else "."
    return f"UsageError: {text}{stop} Try '{command} --help'."
