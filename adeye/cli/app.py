"""The verbs of ``adeye`` put together, with what is common to all."""

from __future__ import annotations

import os
from typing import Annotated, Final

import typer

from adeye.cli.database import database_app
from adeye.cli.doctor import doctor
from adeye.cli.new import new_app
from adeye.cli.options import examples
from adeye.cli.output import emit
from adeye.cli.planning import plan, signals
from adeye.cli.query import query
from adeye.cli.read import replay, show
from adeye.cli.run import report, run
from adeye.cli.scenario import scenario_app
from adeye.cli.starter import init

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
        from adeye import __version__

        emit(f"adeye {__version__}")
        raise typer.Exit


def _ask_for_tracebacks(value: bool) -> None:
    if value:
        os.environ["ADEYE_DEBUG"] = "1"


@app.callback()
def common(
    version: Annotated[  # noqa: ARG001 - its callback does it
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
    debug: Annotated[  # noqa: ARG001 - its callback does it
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


app.command(
    rich_help_panel=CAMPAIGN,
    epilog=examples("adeye plan odd/first.yaml", "adeye plan odd/first.yaml --json"),
)(plan)
app.command(
    rich_help_panel=CAMPAIGN,
    epilog=examples(
        "adeye run odd/first.yaml",
        "adeye run odd/first.yaml --workers 2 --report report.html --junit junit.xml",
    ),
)(run)
app.command(rich_help_panel=CAMPAIGN, epilog=examples("adeye signals odd/first.yaml"))(signals)
app.command(
    rich_help_panel=RESULTS, epilog=examples("adeye show 3f2a91c04b", "adeye show 3f2a --json")
)(show)
app.command(rich_help_panel=RESULTS, epilog=examples("adeye replay 3f2a91c04b --html replay.html"))(
    replay
)
app.command(
    rich_help_panel=RESULTS,
    epilog=examples(
        "adeye query failing-fsrs",
        "adeye query 'SELECT scenario, min_ttc_s FROM v_runs ORDER BY 2' --format csv",
    ),
)(query)
app.command(
    rich_help_panel=RESULTS,
    epilog=examples("adeye report", "adeye report 3 -o report.html --junit junit.xml"),
)(report)
app.command(
    rich_help_panel=WRITE,
    epilog=examples("adeye init", "adeye init my_project"),
)(init)
app.add_typer(new_app, name="new", rich_help_panel=WRITE)
app.add_typer(scenario_app, name="scenario", rich_help_panel=WRITE)
app.add_typer(database_app, name="db", rich_help_panel=KEEP)
app.command(rich_help_panel=KEEP, epilog=examples("adeye doctor", "adeye doctor --requirements"))(
    doctor
)
