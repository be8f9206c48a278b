"""The verbs of ``adeye`` put together, with what is common to all."""

from __future__ import annotations

import gc
import os
import sys
import traceback
from collections.abc import Sequence
from functools import cache, partial
from typing import Annotated, Final

import typer

from adeye.cli.options import examples
from adeye.cli.output import clean, emit, talk
from adeye.cli.progress import leave_if_abandoned, ongoing, raising_on_sigterm
from adeye.cli.verbs import Program
from adeye.errors import AdeyeError, InputError, Terminated, code_of
from adeye.judge.verdict import ExitCode
from adeye.notices import told_to
from adeye.supervision import Ended, has_guests, hide, note_end, supervise

# --- The verbs of ``adeye`` put together, with what is common to all ------------------------------

app = typer.Typer(
    cls=Program,
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


# --- The console script: run a verb, and turn whatever ends it into one message and an exit code --

DEBUG: Final = "ADEYE_DEBUG"
"""Environment variable that asks for tracebacks; ``--debug`` sets it, workers inherit it."""

_COLLECT_AFTER: Final = 50_000
"""Objects made between two collections of the youngest."""

_DEFECT: Final = 3
_UNWRITTEN: Final = 120
"""Python's own exit code where the last output could not be written."""
_READER_GONE: Final = 141


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    As a program of its own it works in a child process, which no plug-in can end as good; called
    with arguments, it works in this one.

    Args:
        arguments: What follows the name of the program; default: what it was called with.

    Returns:
        The exit code, see ``judge.verdict.ExitCode``; never 0 if anything went wrong.
    """
    _open_closed()
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            # A name that the terminal cannot show must not end the program.
            reconfigure(errors="backslashreplace")
    if arguments is None:
        # Nobody else's plug-in of pydantic has a say in what is valid, nor is any searched for.
        os.environ["PYDANTIC_DISABLE_PLUGINS"] = "__all__"
        # Matrices of plug-ins are multiplied by one thread, as those of programs: with more, last
        # bits hang on the number of cores, and every start waits for the threads.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if "ADEYE_DB" in os.environ:
        from adeye.store.location import without_secrets

        hide(without_secrets)
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
    if arguments is None:
        # What is there goes with the process: Python need not look for rubbish among it again.
        gc.freeze()
    if code in {ExitCode.INTERRUPTED, ExitCode.TERMINATED}:
        leave_if_abandoned(code)
    return code


def _open_closed() -> None:
    """Lead a stream that the caller closed nowhere: no file opened later gets its number."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            stream = open(os.devnull, mode)  # noqa: PTH123, SIM115 - it stays open
            os.set_inheritable(stream.fileno(), True)
            setattr(sys, name, stream)
            if name == "stdout":
                talk("note: standard output is closed, so no result is shown.")


def _supervised() -> Ended | None:
    try:
        return supervise()
    except OSError as error:
        text = f"PlatformError: no process can be started: {error.strerror or error}."
        return Ended(ExitCode.ENVIRONMENT, f"{text} Allow more of them (ulimit -u), or end others.")


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
        return ExitCode.TERMINATED
    except (KeyboardInterrupt, typer.Abort):
        return ExitCode.INTERRUPTED
    except SystemExit as error:
        return _code_of(error)
    except BaseException as error:  # noqa: BLE001 - the boundary where errors become messages
        return _report(error)


# Who calls verbs in one process need not wait for all of their options to be read again.
_command = cache(partial(typer.main.get_command, app))


def _run(arguments: Sequence[str] | None) -> int:
    given = None if arguments is None else list(arguments)
    with told_to(_tell), ongoing():
        result = _command().main(given, prog_name="adeye", standalone_mode=False)
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
    return ExitCode.USAGE


def _report(error: BaseException) -> int:
    """Tell what ended the verb and return the exit code."""
    from adeye.store.location import masked

    if os.environ.get(DEBUG, "0") not in {"", "0"}:
        talk(clean(masked("".join(traceback.format_exception(error))), lines=True))
    if isinstance(error, AdeyeError):
        text = str(error)
        if not isinstance(error, InputError):
            text = f"{type(error).__name__}: {text}"
        talk(clean(masked(text), lines=True))
        return code_of(error) or _DEFECT
    if hasattr(error, "format_message"):
        # The parser's own errors; its class differs between releases of typer.
        text = _usage(error, masked(error.format_message()))
        if text.strip():
            talk(text)
        return ExitCode.USAGE
    if isinstance(error, OSError):
        place = f"{error.filename}: " if error.filename else ""
        talk(clean(masked(f"PlatformError: {place}{error.strerror or error}.")))
        return ExitCode.ENVIRONMENT
    if isinstance(error, MemoryError):
        talk("PlatformError: out of memory. Use fewer workers.")
        return ExitCode.ENVIRONMENT
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
