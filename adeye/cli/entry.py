"""The console script: run a verb, and turn whatever ends it into one message and an exit code."""

from __future__ import annotations

import gc
import os
import sys
import traceback
from collections.abc import Sequence
from typing import Final

import typer

from adeye.cli.app import app
from adeye.cli.interruption import leave_if_abandoned, raising_on_sigterm
from adeye.cli.output import clean, talk
from adeye.errors import Terminated
from adeye.notices import told_to
from adeye.supervision import Ended, has_guests, note_end, supervise

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
        The exit code, see ``evaluation.verdict.ExitCode``; never 0 if anything went wrong.
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
