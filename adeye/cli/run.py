"""``run`` and ``report``: execute a campaign, judge it, write its reports."""

from __future__ import annotations

import os
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

import typer

from adeye.cli.interruption import asking
from adeye.cli.options import (
    Backend,
    CampaignId,
    Db,
    ExecutorName,
    Json,
    JunitFile,
    OddFile,
    OutputFile,
    Quiet,
    ReportFile,
    ReportJsonFile,
    SarifReport,
    Scheduler,
    Threads,
    Variant,
    Workers,
)
from adeye.cli.outcome import document, print_summary
from adeye.cli.output import clean, emit_json, talk, wrote
from adeye.cli.progress import reporting
from adeye.cli.session import (
    Budget,
    Deadline,
    KeywordOption,
    LastFailed,
    Maxfail,
    ShardOption,
    make_session,
)
from adeye.cli.writing import named
from adeye.errors import ASKED_TO_END

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.campaign.executor_names import NamedExecutor
    from adeye.campaign.keeping import Wanted
    from adeye.campaign.plan import CampaignPlan
    from adeye.campaign.session import Session
    from adeye.campaign.summary import CampaignSummary

Files = dict[str, Path | None]
"""Where the HTML page, the JUnit XML, the JSON and what is for other tools go, by form."""
_OWN: Final = ("html", "junit", "json")

GsnFile = Annotated[
    Path | None,
    typer.Option(
        "--gsn",
        metavar="FILE",
        envvar="ADEYE_REPORT_GSN",
        callback=named,
        help="Write the argument from goals to evidence: .svg a drawing, .mmd Mermaid, .json.",
    ),
]
SinceFile = Annotated[
    Path | None,
    typer.Option(
        "--baseline",
        metavar="FILE",
        envvar="ADEYE_REPORT_BASELINE",
        help="Tell what changed since this baseline, and what became stale by the files as they "
        "are now.",
    ),
]
ReqifFile = Annotated[
    Path | None,
    typer.Option(
        "--reqif",
        metavar="FILE",
        envvar="ADEYE_REPORT_REQIF",
        callback=named,
        help="Write goals and FSRs with their verdicts as ReqIF, for requirement tools.",
    ),
]

ReportJson = Annotated[
    Path | None,
    typer.Option(
        "--json",
        "--report-json",
        metavar="FILE",
        envvar="ADEYE_REPORT_JSON",
        callback=named,
        help="Write the report as JSON.",
    ),
]


Traces = Annotated[
    str,
    typer.Option(
        "--traces",
        metavar="none|failures|all",
        envvar="ADEYE_TRACES",
        help="Keep the traces of the runs that are executed, beside the database, so that any "
        "threshold can be changed without executing them again.",
    ),
]


def run(
    odd: OddFile,
    *,
    threads: Threads = None,
    workers: Workers = None,
    executor: ExecutorName = None,
    scheduler: Scheduler = None,
    db: Db = None,
    backend: Backend = "batch",
    variant: Variant = None,
    report: ReportFile = None,
    junit: JunitFile = None,
    report_json: ReportJsonFile = None,
    traces: Traces = "none",
    sarif: SarifReport = None,
    shard: ShardOption = None,
    keyword: KeywordOption = None,
    last_failed: LastFailed = False,
    maxfail: Maxfail = None,
    budget: Budget = None,
    deadline: Deadline = None,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Execute the test cases of an ODD, judge every FSR, and exit with the verdict of the gate.

    Only what has no result yet is executed: run it again after an interruption and it goes on; run
    it again after an edit and only what the edit touches is executed. Results that a new threshold
    concerns are judged from what is kept of them, and executed only where that cannot tell.

    Several runs of one ODD on one database share the campaign, and each ends when nothing is left
    to any of them. Whatever is left out by --shard, -k, --last-failed, --maxfail or --budget stays
    NOT_RUN, so that the verdict is never green by what was left out.

    Exit codes: 0 all good, 1 an FSR failed, 2 input error, 3 evidence incomplete, 4 integrity
    violated, 5 database or disk, 130 and 143 interrupted.
    """
    from adeye.campaign.executor_names import asked_executor
    from adeye.campaign.plan import make_plan
    from adeye.kernel.jit import is_cache_warm

    asked = asked_executor(executor, threads, workers, scheduler)
    was_told = not quiet and not is_cache_warm()
    if was_told:
        talk("Compiling for this machine; only the first run does, it takes half a minute.")
    hint = _resume_hint(
        odd,
        db,
        {
            "--backend": None if backend == "batch" else backend,
            "--variant": variant,
            "--threads": threads,
            "--workers": workers,
            "--executor": executor,
            "--scheduler": scheduler,
            "--report": report,
            "--junit": junit,
            "--report-json": report_json,
            "--traces": None if traces == "none" else traces,
            "--sarif": sarif,
            "--shard": shard,
            "-k": keyword,
            "--last-failed": "" if last_failed else None,
            "--maxfail": maxfail,
            "--budget": budget,
            "--deadline": deadline,
        },
    )
    session = make_session(
        shard=shard,
        keyword=keyword,
        last_failed=last_failed,
        maxfail=maxfail,
        budget=budget,
        deadline=deadline,
    )
    wanted = _wanted(traces)
    plan = make_plan(odd, backend=backend, variant=variant)
    if not (quiet or was_told or is_cache_warm(*plan.compiled_parts)):
        talk("Compiling sensors or channels that were not used before, for up to a minute.")
    lanes = parallel(plan, threads, workers, executor)
    if not quiet:
        for notice in plan.notices:
            talk(clean(f"note: {notice}", lines=True))
    try:
        with asking(session.stop, hint):
            summary = _execute(plan, db, asked or lanes, wanted, session, quiet=quiet)
    except ASKED_TO_END:
        talk(hint)
        raise
    if json:
        emit_json("run", document(summary))
    else:
        print_summary(summary)
    if summary.never_began and not quiet:
        talk(clean(f"note: began in no run: {', '.join(summary.never_began)}", lines=True))
    code = int(summary.exit_code)
    if code in {130, 143}:
        talk(hint)
    else:
        files = {"html": report, "junit": junit, "json": report_json, "sarif": sarif}
        code = _write_after_run(files, db, summary, quiet=quiet)
    raise typer.Exit(code)


def report(
    campaign: CampaignId = None,
    *,
    output: OutputFile = None,
    junit: JunitFile = None,
    report_json: ReportJson = None,
    sarif: SarifReport = None,
    gsn: GsnFile = None,
    reqif: ReqifFile = None,
    baseline: SinceFile = None,
    db: Db = None,
    quiet: Quiet = False,
) -> None:
    """Write the report of a campaign that has been run: HTML, JUnit XML, JSON, SARIF, GSN, ReqIF.

    The runs that the page replays are executed again for it, to the same bits; nothing is stored.
    """
    files: Files = {"html": output, "junit": junit, "json": report_json}
    files |= {"sarif": sarif, "gsn": gsn, "reqif": reqif}
    if not any(files.values()):
        files["html"] = Path("report.html")
    _write(files, db, campaign, baseline=baseline, quiet=quiet)


def usable_processors() -> int:
    """Count the processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@dataclass(frozen=True, slots=True)
class Parallel:
    """How many blocks are executed at once.

    Attributes:
        kind: ``thread`` or ``worker``.
        count: How many.
    """

    kind: Literal["thread", "worker"]
    count: int

    @property
    def text(self) -> str:
        """For people."""
        return f"{self.count} {self.kind}{'s' if self.count > 1 else ''}"


def parallel(
    plan: CampaignPlan, threads: int | None, workers: int | None, executor: str | None = None
) -> Parallel:
    """Choose threads or processes: compiled parts run in threads, Python code does not.

    Args:
        plan: What is executed.
        threads: As asked for.
        workers: As asked for.
        executor: ``threads`` or ``processes``, if one of them was asked for.

    Raises:
        UsageError: Both are asked for.
    """
    from adeye.campaign.executor_names import PROCESSES, THREADS, asked_executor

    asked_executor(executor, threads, workers, None)
    if workers is not None or executor == PROCESSES:
        return Parallel("worker", workers or usable_processors())
    if threads is not None or executor == THREADS or plan.is_compiled:
        return Parallel("thread", threads or usable_processors())
    return Parallel("worker", usable_processors())


def _wanted(traces: str) -> Wanted:
    from adeye.errors import UsageError, suggest

    for name in ("none", "failures", "all"):
        if traces == name:
            return name
    raise UsageError(f"--traces is {traces!r}", remedy=suggest(traces, ("none", "failures", "all")))


def _execute(
    plan: CampaignPlan,
    db: str | None,
    lanes: Parallel | NamedExecutor,
    traces: Wanted,
    session: Session,
    *,
    quiet: bool,
) -> CampaignSummary:
    from adeye.campaign.runner import run_campaign
    from adeye.campaign.warmup import compile_aside
    from adeye.kernel.jit import is_cache_warm

    here = lanes if isinstance(lanes, Parallel) else None
    executor = lanes if not isinstance(lanes, Parallel) else None
    is_near = executor is None or not executor.address
    if is_near and not is_cache_warm(*plan.compiled_parts) and usable_processors() > 1:
        compile_aside(plan)
    where = lanes.text if isinstance(lanes, Parallel) else clean(lanes.text)
    with reporting(f"{plan.expansion.count:,} test cases, {where}", quiet=quiet) as progress:
        return run_campaign(
            plan,
            db=db,
            workers=here.count if here is not None and here.kind == "worker" else 1,
            threads=here.count if here is not None and here.kind == "thread" else 1,
            executor=executor,
            progress=progress,
            traces=traces,
            session=session,
        )


def _write_after_run(files: Files, db: str | None, summary: CampaignSummary, *, quiet: bool) -> int:
    """Write the reports; a failure to do so takes its place among the reasons of the exit code."""
    from adeye.errors import AdeyeError
    from adeye.evaluation.verdict import ExitCode, exit_code

    if not any(files.values()):
        return int(summary.exit_code)
    try:
        _write(files, db, summary.campaign, quiet=quiet)
    except AdeyeError as error:
        talk(clean(f"The report was not written: {error}", lines=True))
        return int(exit_code([ExitCode(summary.exit_code), ExitCode(error.exit_code)]))
    return int(summary.exit_code)


def _write(
    files: Files,
    db: str | None,
    campaign: str | None,
    *,
    baseline: Path | None = None,
    quiet: bool,
) -> None:
    from adeye.reporting import write_reports

    asked = {form: path for form, path in files.items() if path is not None}
    own = {form: path for form, path in asked.items() if form in _OWN}
    exports = {form: path for form, path in asked.items() if form not in _OWN} or None
    with reporting("report", quiet=quiet) as progress:
        write_reports(db, campaign, **own, exports=exports, baseline=baseline, progress=progress)
    for path in asked.values():
        wrote(path)


def _resume_hint(odd: Path, db: str | None, options: Mapping[str, object]) -> str:
    """Write the command that goes on: with another backend it would begin another campaign."""
    from adeye.store.location import option

    given = [
        word
        for name, value in options.items()
        if value is not None
        # A switch has no value.
        for word in (name, *([str(value)] if value != "" else []))
    ]
    command = f"adeye run {shlex.quote(str(odd))}{option(db)} {shlex.join(given)}".strip()
    return clean(f"Interrupted. Results so far are kept; go on with: {command}")
