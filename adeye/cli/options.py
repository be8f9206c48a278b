"""Arguments and options that several verbs share; each option is also an environment variable."""

from __future__ import annotations

import functools
import inspect
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, get_args, get_type_hints

import typer
from typer.core import TyperCommand

from adeye.cli.output import results_apart
from adeye.errors import AdeyeError, InputError, IntegrityError, PlatformError, UsageError
from adeye.units import shown

if TYPE_CHECKING:
    from collections.abc import Iterator

    from adeye.campaign.run import Session

# --- Files that verbs write: how they may be called, and that none of them is what a verb reads ---

PAGES: Final = (".html", ".htm")


def given(path: Path | None) -> Path | None:
    """Refuse a name that is rather an option whose file was forgotten; a callback of options.

    Raises:
        UsageError: The name begins with a dash.
    """
    if path is not None and str(path).startswith("-"):
        raise UsageError(
            f"{str(path)!r} stands where the name of a file is expected",
            remedy=f"Name the file first; for a file of this name write ./{path}.",
        )
    return path


def named(path: Path | None) -> Path | None:
    """Do as ``given``, and refuse a folder; the callback of options that name a file to write.

    Raises:
        UsageError: The name begins with a dash, or is that of a folder.
    """
    if named_place(path) is not None and path is not None and path.is_dir():
        raise UsageError(f"{str(path)!r} is a folder", remedy="Name a file to write.")
    return path


def named_place(path: Path | None) -> Path | None:
    """Do as ``given``; the callback of options that name a file or a folder to write."""
    return given(path)


def named_page(path: Path | None) -> Path | None:
    """Refuse a name that promises another form than HTML; a callback of options.

    Raises:
        UsageError: The name begins with a dash, or ends neither in .html nor in .htm.
    """
    if named(path) is not None and path is not None and path.suffix.lower() not in PAGES:
        raise UsageError(
            f"{str(path)!r} does not end in {' or '.join(PAGES)}, and a page of HTML is written",
            remedy="Give it that ending; a browser prints the page as PDF.",
        )
    return path


def named_anew(path: Path | None) -> Path | None:
    """Do as ``named``; the callback of the option whose verb writes a kind of evidence anew."""
    return named(path)


_WRITTEN: Final = (named, named_anew, named_page, named_place)


@contextmanager
def guarding(verb: Callable[..., None], options: Mapping[str, Any]) -> Iterator[None]:
    """Let a verb run while none of the files that it writes is its database, or what it reads.

    Args:
        verb: A function whose options for what it writes have one of ``_WRITTEN``.
        options: What it is called with.

    Raises:
        UsageError: A file to write is one of the others; see ``outputs.guarded``.
    """
    callbacks = {
        name: getattr(item, "callback", None)
        for name, hint in get_type_hints(verb, include_extras=True).items()
        for item in getattr(hint, "__metadata__", ())
        if options.get(name) is not None
    }
    outputs = {name: options[name] for name, found in callbacks.items() if found in _WRITTEN}
    if not outputs:
        yield
        return
    from adeye.outputs import reads
    from adeye.report.files import guarding as guarding_files

    files = {_option(name): path for name, path in outputs.items()}
    anew = next((_option(name) for name in outputs if callbacks[name] is named_anew), "")
    with guarding_files(options.get("db"), files, renewed=anew):
        for name in options.keys() - outputs.keys() - {"db"}:
            value = options[name]
            for item in value if isinstance(value, list) else [value]:
                # Whatever text an option has, it may name a file.
                if isinstance(item, str | Path):
                    reads(item)
        yield


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def write_rows(header: Sequence[str], rows: Iterable[Sequence[Any]], path: Path) -> None:
    """Write a CSV file as a whole or not at all; missing folders are made.

    Raises:
        PlatformError: The file system refused; what was there before still is.
    """
    from adeye.cli.output import csv_text
    from adeye.outputs import write_atomically

    write_atomically(csv_text(header, rows).encode(), path)


# --- What the shell offers on TAB: scenarios, runs, campaigns, saved queries. Errors offer
# nothing.

_OFFERED: Final = 50

Offer = tuple[str, str]


def _quiet(complete: Callable[[typer.Context, str], Iterable[Offer]]) -> Callable[..., list[Offer]]:
    """Offer nothing instead of printing an error into the line that somebody types."""

    @wraps(complete)
    def offers(ctx: typer.Context, incomplete: str) -> list[Offer]:
        try:
            return [item for item in complete(ctx, incomplete) if item[0].startswith(incomplete)]
        except Exception:  # noqa: BLE001 - see above
            return []

    return offers


@_quiet
def complete_scenarios(ctx: typer.Context, incomplete: str) -> Iterable[Offer]:  # noqa: ARG001
    """Offer the scenarios of the catalogue."""
    from adeye.cli.output import clean
    from adeye.spec.load import catalogue_files

    chosen = ctx.params.get("catalogue")
    known = catalogue_files(None if chosen is None else Path(chosen))
    return [(clean(name), clean(path.parent.name)) for name, path in known.items()]


@_quiet
def complete_runs(ctx: typer.Context, incomplete: str) -> Iterable[Offer]:
    """Offer runs of the database that begin so."""
    prefix = "".join(letter for letter in incomplete if letter in "0123456789abcdef")
    return _rows(
        ctx,
        "SELECT DISTINCT substr(run, 1, 10), scenario || ' ' || architecture FROM v_runs "  # noqa: S608
        f"WHERE run LIKE '{prefix}%' ORDER BY 1 LIMIT {_OFFERED}",
    )


@_quiet
def complete_campaigns(ctx: typer.Context, incomplete: str) -> Iterable[Offer]:  # noqa: ARG001
    """Offer the campaigns of the database, the newest first."""
    return _rows(
        ctx,
        f"SELECT number, odd FROM v_campaigns ORDER BY recency LIMIT {_OFFERED}",  # noqa: S608
    )


@_quiet
def complete_queries(ctx: typer.Context, incomplete: str) -> Iterable[Offer]:  # noqa: ARG001
    """Offer the saved queries."""
    from adeye.cli.queries import SAVED

    return [(query.name, query.text) for query in SAVED.values()]


def _rows(ctx: typer.Context, sql: str) -> list[Offer]:
    from adeye.cli.output import clean
    from adeye.store.read.query import run_query

    result = run_query(ctx.params.get("db"), sql, timeout_s=1.0)
    return [(clean(value), clean(text)) for value, text in result.rows]


# --- Arguments and options that several verbs share; each option is also an environment variable --

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
    from adeye.store.evidence import verification as damage
    from adeye.store.repository import Repository

    if damage.is_unexplained(error):
        with suppress(InputError, PlatformError):
            damage.close(Repository.open(location, create=False), error)


# --- Options of ``run`` that tell how much of a campaign is executed now, and what ends it --------

ShardOption = Annotated[
    str | None,
    typer.Option(
        "--shard",
        metavar="I/N",
        envvar="ADEYE_SHARD",
        help="Execute the I-th of N parts of the blocks, such as 2/3, the same on every machine; "
        "'adeye db merge' brings the databases of the shards together.",
    ),
]
KeywordOption = Annotated[
    str | None,
    typer.Option(
        "-k",
        metavar="EXPR",
        envvar="ADEYE_K",
        help="Execute only test cases whose scenario, architecture, fault or parameters have these "
        "words, such as 'cut_in and not (legacy or gap=30)'; name=value is exact.",
    ),
]
LastFailed = Annotated[
    bool,
    typer.Option(
        "--last-failed",
        "--lf",
        envvar="ADEYE_LAST_FAILED",
        help="Execute only test cases that failed a mandatory FSR the last time, in this campaign "
        "or the ones before it, and those that never had a result.",
    ),
]
Maxfail = Annotated[
    int | None,
    typer.Option(
        "--maxfail",
        min=1,
        metavar="N",
        envvar="ADEYE_MAXFAIL",
        help="Begin no further block after N runs with a FAIL or an ERROR.",
    ),
]
Budget = Annotated[
    str | None,
    typer.Option(
        "--budget",
        metavar="TIME",
        envvar="ADEYE_BUDGET",
        help="Begin no block that would not end in this time, such as 8h or 1h30m, judged by the "
        "blocks before it; the same command goes on later.",
    ),
]
Deadline = Annotated[
    str | None,
    typer.Option(
        "--deadline",
        metavar="TIME",
        envvar="ADEYE_DEADLINE",
        help="Kill a worker process that takes longer than this for one block, and try the block "
        "again; default: 1h. Threads cannot be killed.",
    ),
]

_SECONDS: Final = {"d": 86_400.0, "h": 3_600.0, "m": 60.0, "min": 60.0, "s": 1.0}
_PART: Final = re.compile(r"\s*([0-9]{1,9}(?:\.[0-9]{1,9})?)\s*(d|h|min|m|s)(?![a-z])")


def seconds(text: str, option: str) -> float:
    """Read a time of day's length, such as ``8h``, ``1h30m``, ``90 min`` or ``30s``.

    Args:
        text: As written.
        option: Which option it is of, for the message.

    Returns:
        The time [s], more than 0.

    Raises:
        UsageError: It is no such time.

    >>> seconds("1h30m", "--budget"), seconds("0.5 min", "--budget")
    (5400.0, 30.0)
    """
    from adeye.errors import UsageError

    rest, found = text.strip(), 0.0
    while (part := _PART.match(rest)) is not None:
        found += float(part[1]) * _SECONDS[part[2]]
        rest = rest[part.end() :]
        if rest[:1].isdigit() or not rest:
            continue
        rest = rest.lstrip()
    if rest or found <= 0.0:
        raise UsageError(
            f"{option} is {text!r}",
            remedy="Write a time with its unit, such as 8h, 90m, 30s or 1h30m.",
        )
    return found


def make_session(
    *,
    shard: str | None,
    keyword: str | None,
    last_failed: bool,
    maxfail: int | None,
    budget: str | None,
    deadline: str | None,
) -> Session:
    """Read the options; the time of the budget begins now.

    Raises:
        UsageError: One of them cannot be read.
    """
    from adeye.campaign.run import DEADLINE_S, Limits, Session
    from adeye.campaign.selection import Choice, Keyword, Shard

    return Session(
        choice=Choice(
            shard=None if shard is None else Shard.parse(shard),
            keyword=None if keyword is None else Keyword.parse(keyword),
            last_failed=last_failed,
        ),
        limits=Limits(
            budget_s=math.inf if budget is None else seconds(budget, "--budget"),
            most_failures=maxfail,
        ),
        deadline_s=DEADLINE_S if deadline is None else seconds(deadline, "--deadline"),
    )
