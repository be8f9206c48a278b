"""The verbs of ``adeye`` put together, with what is common to all."""

from __future__ import annotations

import os
from typing import Annotated, Final

import typer

from adeye.cli.certify import certify
from adeye.cli.check import check
from adeye.cli.compare import compare
from adeye.cli.confidence import confidence
from adeye.cli.coverage import coverage
from adeye.cli.database import database_app
from adeye.cli.dependencies import dependencies
from adeye.cli.doctor import doctor
from adeye.cli.export import export
from adeye.cli.forks import fork, forks
from adeye.cli.gate import gate
from adeye.cli.judge import judge
from adeye.cli.manifest import manifest_app
from adeye.cli.matrix import matrix
from adeye.cli.new import new_app
from adeye.cli.options import add, examples
from adeye.cli.output import emit
from adeye.cli.planning import plan, signals
from adeye.cli.plugins import plugins
from adeye.cli.preventability import preventability
from adeye.cli.query import query
from adeye.cli.read import replay, show
from adeye.cli.reference import reference
from adeye.cli.run import report, run
from adeye.cli.scenario import scenario_app
from adeye.cli.selftest import selftest
from adeye.cli.sensors import sensors
from adeye.cli.stale import stale
from adeye.cli.starter import init
from adeye.cli.stl import stl
from adeye.cli.timing import faults, timeline
from adeye.cli.uncertainty import uncertainty
from adeye.cli.warmup import warmup

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
