"""Arguments and options that several verbs share; each option is also an environment variable."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, get_args, get_type_hints

import typer
from typer.core import TyperCommand

from adeye.cli.apart import results_apart
from adeye.cli.completion import complete_campaigns, complete_runs
from adeye.cli.writing import guarding, named, named_page
from adeye.errors import AdeyeError, InputError, IntegrityError, PlatformError, UsageError
from adeye.units import shown

_WHOLE: Final = r"[-+]?[0-9]{1,18}"
_NUMBER: Final = r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
MOST: Final = 10**12
"""Largest size that an option takes. Our choice."""

OddFile = Annotated[
    Path,
    typer.Argument(metavar="ODD", help="The ODD's file, such as odd/motorway_chauffeur.yaml."),
]
RunId = Annotated[
    str,
    typer.Argument(
        metavar="RUN",
        help="Beginning of the run's digest, at least 4 characters.",
        autocompletion=complete_runs,
    ),
]
CampaignId = Annotated[
    str | None,
    typer.Argument(
        metavar="[CAMPAIGN]",
        help="Number of the campaign or beginning of its digest; default: the latest.",
        autocompletion=complete_campaigns,
    ),
]
Db = Annotated[
    str | None,
    typer.Option(
        "--db",
        metavar="PATH",
        envvar="ADEYE_DB",
        help="Database file or sqlite:///PATH; default: .adeye/adeye.db.",
    ),
]
Json = Annotated[
    bool,
    typer.Option("--json", envvar="ADEYE_JSON", help="Print one JSON document, not tables."),
]
Backend = Annotated[
    str,
    typer.Option(
        "--backend",
        metavar="NAME",
        envvar="ADEYE_BACKEND",
        help="Simulated traffic: batch (compiled) or highway (the reference, slow).",
    ),
]
Variant = Annotated[
    str | None,
    typer.Option(
        "--variant",
        metavar="NAME",
        envvar="ADEYE_VARIANT",
        help="Arithmetic of batch: reference (default; as highway-env writes it) or fast.",
    ),
]
Threads = Annotated[
    int | None,
    typer.Option(
        "--threads",
        min=1,
        metavar="N",
        envvar="ADEYE_THREADS",
        help="Threads over blocks of runs; default: one per usable processor, unless a part is "
        "Python code or the traffic is highway. Results do not depend on it.",
    ),
]
Workers = Annotated[
    int | None,
    typer.Option(
        "--workers",
        "-n",
        min=1,
        metavar="N",
        envvar="ADEYE_WORKERS",
        help="Worker processes in place of threads: for parts in Python code, and for isolation "
        "from crashes. Results do not depend on it.",
    ),
]
ExecutorName = Annotated[
    str | None,
    typer.Option(
        "--executor",
        metavar="NAME|module:Class",
        envvar="ADEYE_EXECUTOR",
        help="Where blocks of runs are executed: threads, processes, dask, one of an installed "
        "package, or a class; default: threads or processes, as the parts need. Results do not "
        "depend on it.",
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        envvar="ADEYE_SCHEDULER",
        help="Where the scheduler of the executor is, such as tcp://HOST:8786; dask without it "
        "starts workers on this machine.",
    ),
]
ReportFile = Annotated[
    Path | None,
    typer.Option(
        "--report",
        metavar="FILE",
        envvar="ADEYE_REPORT",
        callback=named_page,
        help="Write the report: one HTML page that needs no network.",
    ),
]
OutputFile = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="FILE",
        envvar="ADEYE_REPORT",
        callback=named_page,
        help="The HTML page; default: report.html if no other file is asked for.",
    ),
]
JunitFile = Annotated[
    Path | None,
    typer.Option(
        "--junit",
        metavar="FILE",
        envvar="ADEYE_JUNIT",
        callback=named,
        help="Write JUnit XML for CI.",
    ),
]
ReportJsonFile = Annotated[
    Path | None,
    typer.Option(
        "--report-json",
        metavar="FILE",
        envvar="ADEYE_REPORT_JSON",
        callback=named,
        help="Write the report as JSON.",
    ),
]
SarifReport = Annotated[
    Path | None,
    typer.Option(
        "--sarif",
        metavar="FILE",
        envvar="ADEYE_REPORT_SARIF",
        callback=named,
        help="Write what does not pass as SARIF, which code hosts show beside the lines.",
    ),
]
Quiet = Annotated[
    bool,
    typer.Option(
        "--quiet", "-q", envvar="ADEYE_QUIET", help="No progress and no notices, only the result."
    ),
]
Catalogue = Annotated[
    Path | None,
    typer.Option(
        "--catalogue",
        metavar="DIR",
        envvar="ADEYE_CATALOGUE",
        help="Folder of scenarios; default: scenarios_db here, and the shipped ones.",
    ),
]


def examples(*commands: str) -> str:
    """Write the examples below a verb's help, one a line."""
    return "\n  ".join(["Examples:", *commands])


def help_of(verb: Callable[..., None]) -> str:
    """Make a verb's help of its docstring: a paragraph is one line, which the terminal wraps."""
    paragraphs = (inspect.getdoc(verb) or "").split("\n\n")
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in paragraphs)


class _Verb(TyperCommand):
    """A verb that takes numbers in plain decimal digits, as documents do.

    What reads them would take digits of any script, underscores and blanks, too.

    Attributes:
        numbers: Parameters that are numbers, with the form that each has.
    """

    numbers: ClassVar[Mapping[str, str]] = {}

    def __init__(self, *arguments: Any, **settings: Any) -> None:
        """Look at the text of each number before it is read."""
        super().__init__(*arguments, **settings)
        for param in self.params:
            form = self.numbers.get(param.name or "")
            if form is not None:
                setattr(param, "consume_value", _plain(param, form))  # noqa: B010 - of a library


def _plain(param: Any, form: str) -> Callable[..., Any]:
    """Make what takes the text of a parameter from the command line or the environment."""
    consume = param.consume_value

    def consume_plain(ctx: typer.Context, given: Any) -> Any:
        value, source = consume(ctx, given)
        for text in value if isinstance(value, list | tuple) else (value,):
            if isinstance(text, str) and re.fullmatch(form, text) is None:
                said = f"{shown(text)} is not a number in plain decimal digits."
                raise typer.BadParameter(said, ctx=ctx, param=param)
        return value, source

    return consume_plain


def _numbers(verb: Callable[..., None]) -> dict[str, str]:
    """Name the parameters of a verb that are numbers, with the form that each has."""
    forms = {int: _WHOLE, float: _NUMBER}
    return {
        name: forms[kind]
        for name, annotation in get_type_hints(verb).items()
        for kind in {annotation, *get_args(annotation)} & forms.keys()
    }


def sizes_of(texts: Sequence[str], option: str, example: str) -> dict[str, float]:
    """Read the sizes of an option that is given as often as there are names.

    Args:
        texts: ``NAME=SIZE`` each.
        option: For messages.
        example: Of its value.

    Raises:
        UsageError: One is not so, negative, more than ``MOST`` or given twice.
    """
    sizes: dict[str, float] = {}
    for text in texts:
        name, _, size = (part.strip() for part in text.partition("="))
        value = float(size) if re.fullmatch(_NUMBER, size) else -1.0
        if not 0.0 <= value <= MOST or not name:
            raise UsageError(
                f"--{option} {shown(text)} is not NAME=SIZE with a size from 0 to {MOST:,}",
                remedy=f"Write {example}.",
            )
        if name in sizes:
            raise UsageError(
                f"{option} of {name} is given twice: {sizes[name]:g} and {value:g}",
                remedy="Give it once.",
            )
        sizes[name] = value
    return sizes


def add(
    app: typer.Typer, verb: Callable[..., None], *commands: str, name: str = "", panel: str = ""
) -> None:
    """Add a verb to an app.

    Args:
        app: The app.
        verb: Function that parses, calls one function and prints.
        commands: Examples.
        name: Name of the verb, if it is not the function's.
        panel: Heading that the help lists it under.
    """
    register = app.command(
        name or None,
        help=help_of(verb),
        epilog=examples(*commands),
        rich_help_panel=panel or None,
        cls=type("Verb", (_Verb,), {"numbers": _numbers(verb)}),
    )
    register(_apart(verb))


def _apart(verb: Callable[..., None]) -> Callable[..., None]:
    """Let a verb run with standard output kept for its results.

    Verbs end with ``typer.Exit``. Whoever else asks Python to end, such as a plug-in, does not say
    what became of the verb, least of all with 0.
    """

    @functools.wraps(verb)
    def run(*arguments: Any, **options: Any) -> None:
        with results_apart():
            try:
                with guarding(verb, options):
                    verb(*arguments, **options)
            except SystemExit as error:
                msg = f"code from outside adeye asked to end the process with {error.code!r}"
                raise IntegrityError(msg) from error
            except Exception as error:
                if "db" in options:
                    _blame_database(options["db"], error)
                raise

    return run


def _blame_database(location: str | Path | None, error: Exception) -> None:
    """Raise that the database was altered, if what a verb made of its content is unforeseen.

    What is read whole may fail later, when the repository is closed already.
    """
    if isinstance(error, AdeyeError | typer.Exit | typer.Abort):
        return
    from adeye.store import damage
    from adeye.store.repository import Repository

    if damage.is_unexplained(error):
        with suppress(InputError, PlatformError):
            damage.close(Repository.open(location, create=False), error)
