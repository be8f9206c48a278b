"""``judge``: judge results again after a threshold, a formula or an FSR has changed."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, Annotated

import typer

from adeye.cli.options import Backend, Db, Json, OddFile, Quiet, Threads, Variant, Workers
from adeye.cli.outcome import document, rejudged_text
from adeye.cli.output import clean, emit, emit_json, talk
from adeye.cli.progress import reporting
from adeye.cli.run import parallel
from adeye.cli.verdicts import print_verdicts

if TYPE_CHECKING:
    from pathlib import Path

    from adeye.campaign.summary import CampaignSummary

Replay = Annotated[
    bool,
    typer.Option(
        "--replay",
        envvar="ADEYE_REPLAY",
        help="Execute those runs again of which too little is kept; each must come out with the "
        "trace that it had.",
    ),
]


def judge(
    odd: OddFile,
    *,
    replay: Replay = False,
    threads: Threads = None,
    workers: Workers = None,
    db: Db = None,
    backend: Backend = "batch",
    variant: Variant = None,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Judge the results that are there as the ODD and its concept ask for now; execute nothing new.

    Verdicts come from the rows of metrics, from kept extremes and from kept traces. Where these
    cannot tell, the run is counted and stays NOT_RUN until --replay executes it again.

    Exit codes: 0 all good, 1 an FSR failed, 2 input error, 3 evidence incomplete, 4 a run did not
    come out as it was recorded, 5 database or disk.
    """
    from adeye.campaign.plan import make_plan
    from adeye.campaign.runner import judge_campaign

    plan = make_plan(odd, backend=backend, variant=variant)
    lanes = parallel(plan, threads, workers)
    if not quiet:
        for notice in plan.notices:
            talk(clean(f"note: {notice}", lines=True))
    with reporting(f"{plan.expansion.count:,} test cases", quiet=quiet) as progress:
        summary = judge_campaign(
            plan,
            db=db,
            replay=replay,
            workers=lanes.count if lanes.kind == "worker" else 1,
            threads=lanes.count if lanes.kind == "thread" else 1,
            progress=progress,
        )
    if json:
        emit_json("judge", {**document(summary), "to_execute": summary.to_execute})
    else:
        print_verdicts(summary)
        emit(f"\n{_text(summary, odd, db)}")
        emit(clean(summary.message, lines=True))
    raise typer.Exit(int(summary.exit_code))


def _text(summary: CampaignSummary, odd: Path, db: str | None) -> str:
    """Say what was judged, and what it takes to judge the rest."""
    from adeye.store.location import option

    lines = []
    if summary.judged or summary.to_replay:
        lines.append(rejudged_text(summary))
    else:
        lines.append(f"All {summary.reused:,} results were judged already; 0 executed.")
    name = f"{shlex.quote(str(odd))}{option(db)}"
    if summary.to_replay:
        lines.append(
            f"{_count(summary.to_replay, 'run needs', 'runs need')} a replay: "
            f"adeye judge {name} --replay"
        )
    if summary.to_execute:
        lines.append(
            f"{_count(summary.to_execute, 'test case has', 'test cases have')} no result: "
            f"adeye run {name}"
        )
    return clean("\n".join(lines), lines=True)


def _count(number: int, one: str, many: str) -> str:
    return f"{number:,} {one if number == 1 else many}"
