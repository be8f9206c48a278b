"""Arguments and options that several verbs share; each option is also an environment variable."""

from __future__ import annotations

import functools
import inspect
import math
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from copy import copy
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Final,
    get_args,
    get_origin,
    get_type_hints,
)

import typer
from typer.core import TyperCommand
from typer.models import OptionInfo

from adeye.cli.output import clean, csv_text, results_apart
from adeye.cli.progress import waiting
from adeye.errors import AdeyeError, InputError, IntegrityError, PlatformError, UsageError
from adeye.notices import notice
from adeye.units import shown

if TYPE_CHECKING:
    from adeye.campaign.plan import CampaignPlan
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

    files = {flag_of(name): path for name, path in outputs.items()}
    anew = next((flag_of(name) for name in outputs if callbacks[name] is named_anew), "")
    with guarding_files(options.get("db"), files, renewed=anew):
        for name in options.keys() - outputs.keys() - {"db"}:
            value = options[name]
            for item in value if isinstance(value, list) else [value]:
                # Whatever text an option has, it may name a file; a path does, there or not.
                if isinstance(item, str | Path):
                    reads(item, flag_of(name) if isinstance(item, Path) else "")
        yield


def require_baseline_named(baseline: Path | None, variable: str) -> None:
    """Refuse a variable that is there and names no file: who set it asked for a comparison.

    Who set the one that other verbs read is told which it is here.
    """
    if baseline is not None:
        return
    if os.environ.get(variable) == "":
        raise UsageError(
            f"{variable} is empty",
            remedy="Name the baseline's file in it, or unset it to do without one.",
        )
    if "ADEYE_BASELINE" in os.environ:
        notice(
            "ADEYE_BASELINE sets the option of other verbs, so nothing is compared with a "
            f"baseline here. Set {variable} for that."
        )


def flag_of(name: str) -> str:
    """Write the flag of an option that is called like a parameter."""
    return f"--{name.replace('_', '-')}"


def write_rows(header: Sequence[str], rows: Iterable[Sequence[Any]], path: Path) -> None:
    """Write a CSV file as a whole or not at all; missing folders are made.

    Raises:
        PlatformError: The file system refused; what was there before still is.
    """
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
    from adeye.store.read.saved import SAVED

    return [(query.name, query.text) for query in SAVED.values()]


def _rows(ctx: typer.Context, sql: str) -> list[Offer]:
    from adeye.store.read.query import run_query

    result = run_query(ctx.params.get("db"), sql, timeout_s=1.0)
    return [(clean(value), clean(text)) for value, text in result.rows]


# --- Arguments and options that several verbs share; each option is also an environment variable --

_WHOLE: Final = r"[-+]?[0-9]{1,18}"
_NUMBER: Final = r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
MOST: Final = 10**12
"""Largest size that an option takes. Our choice."""


def option(written: str = "", *, env: str = "", **settings: Any) -> Any:
    """Declare of an option what the parameter of the verb does not say.

    ``add`` calls it like the parameter, unless its flags are written here, sets it by the
    environment variable of that name too, and takes its help from the docstring of the verb.

    Args:
        written: Flags, and what stands for the value, such as ``--output -o FILE``.
        env: Environment variable without ``ADEYE_``, where it is not named after the long flag.
        settings: What else ``typer.Option`` takes; ``help`` where several verbs share it.
    """
    flags = [word for word in written.split() if word.startswith("-")]
    info = typer.Option(
        metavar=" ".join(written.split()[len(flags) :]) or None,
        envvar=f"ADEYE_{env}" if env else None,
        **settings,
    )
    info.param_decls = tuple(flags)
    return info


OddFile = Annotated[
    Path, typer.Argument(metavar="ODD", help="The ODD's file, such as odd/motorway_chauffeur.yaml.")
]
RunId = Annotated[
    str,
    typer.Argument(
        metavar="RUN",
        autocompletion=complete_runs,
        help="Beginning of the run's digest, at least 4 characters.",
    ),
]
CampaignId = Annotated[
    str | None,
    typer.Argument(
        metavar="[CAMPAIGN]",
        autocompletion=complete_campaigns,
        help="Number of the campaign, beginning of its digest, id of its ODD, or @{-1} for the one "
        "before the latest; default: the latest.",
    ),
]
OddOrCampaign = Annotated[
    str | None, typer.Argument(metavar="[ODD|CAMPAIGN]", autocompletion=complete_campaigns)
]
Db = Annotated[
    str | None, option("PATH", help="Database file or sqlite:///PATH; default: .adeye/adeye.db.")
]
Json = Annotated[bool, option(help="Print one JSON document, not tables.")]
Backend = Annotated[
    str,
    option("NAME", help="Simulated traffic: batch (compiled) or highway (the reference, slow)."),
]
Variant = Annotated[
    str | None,
    option(
        "NAME", help="Arithmetic of batch: reference (default; as highway-env writes it) or fast."
    ),
]
Threads = Annotated[
    int | None,
    option(
        "N",
        help="Threads over blocks of runs; default: one per usable processor, unless a part is "
        "Python code or the traffic is highway. Results do not depend on it.",
        min=1,
    ),
]
Workers = Annotated[
    int | None,
    option(
        "--workers -n N",
        help="Worker processes in place of threads: for parts in Python code, and for isolation "
        "from crashes. Results do not depend on it.",
        min=1,
    ),
]
JunitFile = Annotated[Path | None, option("FILE", help="Write JUnit XML for CI.", callback=named)]
SarifReport = Annotated[
    Path | None,
    option(
        "FILE",
        help="Write what does not pass as SARIF, which code hosts show beside the lines.",
        env="REPORT_SARIF",
        callback=named,
    ),
]
Quiet = Annotated[bool, option("--quiet -q", help="No progress and no notices, only the result.")]
Catalogue = Annotated[
    Path | None,
    option("DIR", help="Folder of scenarios; default: scenarios_db here, and the shipped ones."),
]


def examples(*commands: str) -> str:
    """Write the examples below a verb's help, one a line."""
    return "\n  ".join(["Examples:", *commands])


@dataclass(frozen=True, slots=True)
class Texts:
    """What the docstring of a verb says to users.

    Attributes:
        help: Its paragraphs, each one line, which the terminal wraps.
        parameters: Section of this name: the help of each argument and option that only it has.
        examples: Section of this name: commands.
    """

    help: str
    parameters: Mapping[str, str]
    examples: Sequence[str]


def texts_of(verb: Callable[..., None]) -> Texts:
    """Read the docstring of a verb."""
    paragraphs = []
    sections: dict[str, list[str]] = {"Parameters:": [], "Examples:": []}
    for paragraph in (inspect.getdoc(verb) or "").split("\n\n"):
        title, _, rest = paragraph.partition("\n")
        if title in sections:
            # What is indented more goes on with the line before.
            entries = re.split(r"\n {4}(?! )", f"\n{rest}")[1:]
            sections[title] = [" ".join(entry.split()) for entry in entries]
        else:
            paragraphs.append(" ".join(paragraph.split()))
    parameters = dict(entry.split(": ", 1) for entry in sections["Parameters:"])
    return Texts("\n\n".join(paragraphs), parameters, sections["Examples:"])


def _described(verb: Callable[..., None], texts: Mapping[str, str]) -> dict[str, Any]:
    """Return the annotations of a verb, with all that they do not say of arguments and options."""
    hints = get_type_hints(verb, include_extras=True)
    for name, hint in hints.items():
        kind, *declared = get_args(hint) if get_origin(hint) is Annotated else (hint,)
        if not declared and name not in texts:
            continue
        info = copy(declared[0]) if declared else option()
        info.help = info.help or texts[name]
        if isinstance(info, OptionInfo):
            info.param_decls = info.param_decls or (flag_of(name),)
            long = next((flag for flag in info.param_decls if flag[:2] == "--"), "")
            variable = (long or info.param_decls[0]).lstrip("-").replace("-", "_").upper()
            info.envvar = info.envvar or f"ADEYE_{variable}"
        hints[name] = Annotated[kind, info]
    return hints


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

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help as it stands: brackets are no markup, and a flag takes no value."""
        super(_Verb, as_it_stands(self, ctx)).format_help(ctx, formatter)


def as_it_stands(command: Any, ctx: Any) -> Any:
    """Return a copy of a command whose help is no markup, and whose flags take no value."""
    from rich.markup import escape

    told = copy(command)
    told.help, told.epilog = escape(command.help or ""), escape(command.epilog or "")
    # What is escaped has to be read as markup, whatever a release of typer takes by default.
    told.rich_markup_mode = "rich"
    params = [copy(param) for param in command.get_params(ctx)]
    for param in params:
        text = getattr(param, "help", None)
        setattr(param, "help", escape(text) if text else text)  # noqa: B010 - of a library
        if getattr(param, "is_flag", False):
            param.metavar = ""
    setattr(told, "get_params", lambda _: params)  # noqa: B010 - of a library
    return told


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


def pairs_of(option: str, texts: Sequence[str] | None) -> dict[str, str]:
    """Read an option that is given as NAME=VALUE, once for each name.

    Raises:
        UsageError: One is not so, or given twice.
    """
    pairs: dict[str, str] = {}
    for text in texts or ():
        name, sign, value = (part.strip() for part in text.partition("="))
        if not (name and sign and value):
            raise UsageError(f"{option} {text!r} is no pair", remedy="Write NAME=VALUE.")
        if name in pairs:
            raise UsageError(f"{option} names {name!r} twice", remedy="Give it once.")
        pairs[name] = value
    return pairs


def add(app: typer.Typer, verb: Callable[..., None], *, name: str = "", panel: str = "") -> None:
    """Add a verb to an app.

    Args:
        app: The app.
        verb: Function that parses, calls one function and prints; its docstring is the help.
        name: Name of the verb, if it is not the function's.
        panel: Heading that the help lists it under.
    """
    texts = texts_of(verb)
    register = app.command(
        name or None,
        help=texts.help,
        epilog=examples(*texts.examples),
        rich_help_panel=panel or None,
        cls=type("Verb", (_Verb,), {"numbers": _numbers(verb)}),
    )
    register(_apart(verb, _described(verb, texts.parameters)))


def _apart(verb: Callable[..., None], hints: dict[str, Any]) -> Callable[..., None]:
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

    taken = inspect.signature(verb)
    parameters = [item.replace(annotation=hints[name]) for name, item in taken.parameters.items()]
    setattr(run, "__signature__", taken.replace(parameters=parameters))  # noqa: B010 - for typer
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


def plan_of(
    odd: Path,
    backend: str,
    variant: str | None,
    *,
    quiet: bool = False,
    meanwhile: Callable[[CampaignPlan], None] | None = None,
) -> CampaignPlan:
    """Make the plan of an ODD, and show on a terminal what is waited for.

    Args:
        odd: The file.
        backend: As asked for.
        variant: As asked for.
        quiet: Show nothing.
        meanwhile: Called before formulas are searched.
    """
    from adeye.campaign.plan import make_plan

    with waiting(f"Checking {odd.name}; formulas are compiled the first time", quiet=quiet):
        return make_plan(odd, backend=backend, variant=variant, meanwhile=meanwhile)


def make_session(
    *,
    shard: str | None,
    keyword: str | None,
    last_failed: bool,
    maxfail: int | None,
    budget: str | None,
    deadline: str | None,
    pace: float | None = None,
) -> Session:
    """Read the options; the time of the budget begins now.

    Raises:
        UsageError: One of them cannot be read.
    """
    from adeye.campaign.run import DEADLINE_S, Limits, Session
    from adeye.campaign.selection import Choice, Keyword, Shard
    from adeye.simulate.channels.pace import Pace

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
        pace=None if pace is None else Pace(pace),
    )
