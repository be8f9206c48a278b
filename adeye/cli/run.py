"""``run|judge|report|warmup``: execute a campaign, judge it, write its reports."""

from __future__ import annotations

import math
import os
import shlex
import time
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from inspect import signature
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import typer

from adeye.cli import options as opt
from adeye.cli import output as out
from adeye.cli.progress import asking, duration, reporting
from adeye.errors import ASKED_TO_END, AdeyeError, IntegrityError, UsageError, amount, suggest
from adeye.judge.verdict import ExitCode, Verdict, exit_code, urgency
from adeye.report.words import quantity

if TYPE_CHECKING:
    from adeye.campaign.executor_names import NamedExecutor
    from adeye.campaign.executors import Processes
    from adeye.campaign.plan import CampaignPlan
    from adeye.campaign.run import Session
    from adeye.campaign.summary import CampaignSummary, VerdictLine
    from adeye.campaign.traces import Wanted
    from adeye.campaign.warmup import Part
    from adeye.report.model.report import Report
    from adeye.simulate.channels.pace import Pace

# --- The table of verdicts that a campaign ends with, the worst first -----------------------------

_SHOWN_TEXT: Final = 60
_WIDE: Final = 145
_SHOWN_CAUSES: Final = 3


def ordered(lines: Sequence[VerdictLine]) -> list[VerdictLine]:
    """Sort verdicts: by architecture, those of the gate first, then the most urgent."""
    names = list(dict.fromkeys(line.architecture for line in lines))

    def place(line: VerdictLine) -> tuple[Any, ...]:
        urgent = urgency(line.verdict, mandatory=line.mandatory)
        return not line.is_gate, names.index(line.architecture), *urgent

    return sorted(lines, key=place)


def margin_text(line: VerdictLine) -> str:
    """Write the margin of the worst run with its unit."""
    if line.margin is None or not math.isfinite(line.margin):
        return out.NONE
    return quantity(line.margin, line.unit or "1", signed=True)


def print_verdicts(summary: CampaignSummary, db: str | None = None) -> None:
    """Print the verdict of every FSR for every architecture, and how to see the worst runs."""
    lines = ordered(summary.verdicts)
    for (name, is_gate), group in groupby(lines, lambda line: (line.architecture, line.is_gate)):
        out.emit(f"\n{out.clean(name)}{' (gate)' if is_gate else ''}")
        _print_architecture(list(group))
    _print_causes([line for line in lines if line.worst_run and line.verdict is Verdict.FAIL], db)


def _print_causes(failing: Sequence[VerdictLine], db: str | None) -> None:
    """Name for each FSR that fails the command that shows its worst run, while they are few."""
    from adeye.store.location import option

    if not failing:
        return
    where = out.clean(option(db))
    shown = [
        (f"{line.architecture} fails {line.fsr}:", f"show {out.short(line.worst_run)}{where}")
        for line in failing[:_SHOWN_CAUSES]
    ]
    if len(failing) > _SHOWN_CAUSES:
        more = len(failing) - _SHOWN_CAUSES
        shown.append((f"and {more} more:", f"query failing-fsrs{where}"))
    worst = out.short(failing[0].worst_run)
    shown.append(("the first as a page:", f"replay {worst}{where} --html replay.html"))
    wide = max(len(said) for said, _ in shown)
    lines = [f"  {said:{wide}}  adeye {command}" for said, command in shown]
    out.emit("\nSee why\n" + out.clean("\n".join(lines), lines=True))


def _print_architecture(lines: Sequence[VerdictLine]) -> None:
    # On a narrow screen the text would push everything else out of shape.
    has_texts = out.width() >= _WIDE
    headers = ["FSR", "ASIL", "Verdict", "Exercised", "Worst margin", "Worst run"]
    rows = [
        [
            line.fsr + ("" if line.mandatory else " opt."),
            line.asil,
            out.verdict_cell(line.verdict),
            line.exercised_text,
            margin_text(line),
            out.short(line.worst_run),
            *([_cut(line.text)] if has_texts else []),
        ]
        for line in lines
    ]
    headers += ["Requirement"] if has_texts else []
    out.emit_table(headers, rows, right=("Exercised", "Worst margin"))


def _cut(text: str) -> str:
    line = out.clean(" ".join(text.split()))
    return line if len(line) <= _SHOWN_TEXT else f"{line[: _SHOWN_TEXT - 1]}…"


# --- What came out of a campaign, for people and as JSON ------------------------------------------

_WAYS: Final = {
    "metric": "metric rows",
    "samples": "kept extremes",
    "trace": "kept traces",
    "invalid": "being invalid",
    "verdict": "verdicts without numeric uncertainty",
}
"""What told a verdict, in words, by the word of ``campaign.rejudge``."""


def print_summary(summary: CampaignSummary, done: str, db: str | None = None) -> None:
    """Print the verdicts, what was done for them, and what the exit code means."""
    print_verdicts(summary, db)
    out.emit(f"\n{done}")
    out.emit_prose(summary.message)


def executed_text(summary: CampaignSummary) -> str:
    """Say how much was executed and how much was there already."""
    again = f" {rejudged_text(summary)}" if summary.judged or summary.to_replay else ""
    if summary.planned > 0 and summary.executed == 0 and summary.reused == summary.planned:
        twins = f" but {summary.twins:,} twins with half the step" if summary.twins else ""
        nothing = "nothing new" if summary.replayed else "nothing"
        return f"Executed {nothing}{twins}, all {summary.planned:,} results were there.{again}"
    executed = f"Executed {summary.executed:,} of {summary.planned:,} test cases"
    twins = f" and {summary.twins:,} twins with half the step" if summary.twins else ""
    others = f"; {summary.elsewhere:,} by other runners" if summary.elsewhere else ""
    return f"{executed}{twins}{others}; {summary.reused:,} reused.{again}"


def rejudged_text(summary: CampaignSummary) -> str:
    """Say what results were judged again from."""
    wanted = summary.judged + summary.to_replay
    ways = ", ".join(
        f"{summary.ways[way]:,} from {text}" for way, text in _WAYS.items() if way in summary.ways
    )
    judged = f"Re-judged {summary.judged:,} of {amount(wanted, 'result')}"
    return f"{judged}{f' ({ways})' if ways else ''}; {summary.replayed:,} executed again for it."


def document(summary: CampaignSummary) -> dict[str, object]:
    """Describe a campaign as JSON."""
    return {
        **out.fields_of(summary, "campaign", "planned", "executed", "judged", "reused"),
        **({"executed_by_others": summary.elsewhere} if summary.elsewhere else {}),
        **({"twins": summary.twins} if summary.twins else {}),
        "selected": summary.planned if summary.selected is None else summary.selected,
        "remaining": summary.to_execute,
        **out.fields_of(summary, "replayed", "to_replay"),
        "rejudged_from": dict(summary.ways),
        "exit_code": int(summary.exit_code),
        "message": summary.message,
        **out.fields_of(summary, "contacts", "channel_failures", "never_began", "idle_events"),
        "verdicts": ordered(summary.verdicts),
    }


# --- ``run`` and ``report``: execute a campaign, judge it, write its reports ----------------------

Files = dict[str, Path | None]
"""Where the HTML page, the JUnit XML, the JSON and what is for other tools go, by form."""
_OWN: Final = ("html", "junit", "json")


def run(
    odd: opt.OddFile,
    *,
    threads: opt.Threads = None,
    workers: opt.Workers = None,
    executor: Annotated[str | None, opt.option("NAME|module:Class")] = None,
    scheduler: Annotated[str | None, opt.option("ADDRESS")] = None,
    db: opt.Db = None,
    backend: opt.Backend = "batch",
    variant: opt.Variant = None,
    report: Annotated[Path | None, opt.option("FILE", callback=opt.named_page)] = None,
    junit: opt.JunitFile = None,
    report_json: Annotated[Path | None, opt.option("FILE", callback=opt.named)] = None,
    traces: Annotated[str, opt.option("none|failures|all")] = "none",
    sarif: opt.SarifReport = None,
    shard: Annotated[str | None, opt.option("I/N")] = None,
    keyword: Annotated[str | None, opt.option("-k EXPR")] = None,
    last_failed: Annotated[bool, opt.option("--last-failed --lf")] = False,
    maxfail: Annotated[int | None, opt.option("N", min=1)] = None,
    budget: Annotated[str | None, opt.option("TIME")] = None,
    deadline: Annotated[str | None, opt.option("TIME")] = None,
    pace: Annotated[float | None, opt.option("F")] = None,
    pdb: Annotated[bool, opt.option("--pdb")] = False,
    quiet: opt.Quiet = False,
    json: opt.Json = False,
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

    Parameters:
        executor: Where blocks of runs are executed: threads, processes, dask, one of an installed
            package, or a class; default: threads or processes, as the parts need. Results do not
            depend on it.
        scheduler: Where the scheduler of the executor is, such as tcp://HOST:8786; dask without it
            starts workers on this machine.
        report: Write the report: one HTML page that needs no network.
        report_json: Write the report as JSON.
        traces: Keep the traces of the runs that are executed, beside the database, so that any
            threshold can be changed without executing them again.
        shard: Execute the I-th of N parts of the blocks, such as 2/3, the same on every machine;
            'adeye db merge' brings the databases of the shards together.
        keyword: Execute only test cases whose scenario, architecture, fault or parameters have
            these words, such as 'cut_in and not (legacy or gap=30)'; name=value is exact.
        last_failed: Execute only test cases that failed a mandatory FSR the last time, in this
            campaign or the ones before it, and those that never had a result.
        maxfail: Begin no further block after N runs with a FAIL or an ERROR.
        budget: Begin no block that would not end in this time, such as 8h or 1h30m, judged by the
            blocks before it; the same command goes on later.
        deadline: Kill a worker process that takes longer than this for one block, and try the block
            again; default: 1h. Threads cannot be killed.
        pace: Simulate no more than F seconds in one second, one run after the other, and tell how
            long channels take to answer: 1 for the wall clock, in soft real time. Results of
            channels from outside are marked machine-dependent then.
        pdb: Begin a debugger where a channel, a sensor or a metric of your own raises first, and
            at 'breakpoint()' in one. Everything is executed in one process, and ends with it:
            nothing is kept of the block that somebody looked into.

    Examples:
        adeye run odd/first.yaml
        adeye run odd/first.yaml --workers 2 --report report.html --junit junit.xml
    """
    from adeye.campaign.debugger import post_mortem
    from adeye.campaign.executor_names import asked_executor
    from adeye.campaign.warmup import compile_aside
    from adeye.kernel.jit import is_cache_warm

    asked = asked_executor(executor, threads, workers, scheduler)
    if pdb:
        _require_debuggable((workers, executor, scheduler), threads, json=json)
    else:
        _leave_input()
    was_told = not quiet and not is_cache_warm()
    hint = _resume_hint(odd, db, locals())
    session = opt.make_session(
        shard=shard,
        keyword=keyword,
        last_failed=last_failed,
        maxfail=maxfail,
        budget=budget,
        deadline=deadline,
        pace=pace,
    )
    _require_one_lane(session, (workers, threads, executor, scheduler))
    wanted = _wanted(traces)
    # Under a debugger nothing else is started, either.
    is_near = not pdb and (asked is None or not asked.address)
    told = _COMPILING if was_told else ""
    plan, aside = _plan(odd, backend, variant, is_near=is_near, quiet=quiet, told=told)
    if not (quiet or was_told or is_cache_warm(*plan.compiled_parts)):
        out.talk("Compiling sensors or channels that were not used before, for up to a minute.")
    lanes = parallel(plan, 1 if session.pace or pdb else threads, workers, executor)
    if not quiet:
        for notice in plan.notices:
            out.talk(out.clean(f"note: {notice}", lines=True))
    try:
        with asking(session.stop, hint):
            if aside is not None:
                compile_aside(plan, aside)
            with post_mortem() if pdb else nullcontext():
                summary = _execute(plan, db, asked or lanes, wanted, session, quiet=quiet or pdb)
    except ASKED_TO_END:
        out.talk(hint)
        raise
    _print_outcome(summary, session.pace, db, json=json)
    _tell_after(summary, wanted, quiet=quiet)
    code = int(summary.exit_code)
    if code in {130, 143}:
        out.talk(hint)
    else:
        files = {"html": report, "junit": junit, "json": report_json, "sarif": sarif}
        code = _write_after_run(files, db, summary, quiet=quiet)
    raise typer.Exit(_of_files_as_they_are(plan, code))


def _of_files_as_they_are(plan: CampaignPlan, code: int) -> int:
    """Let nothing be green that the files no longer ask for: they were edited meanwhile."""
    edited = plan.files.edited()
    if edited:
        said = f"edited while it ran: {', '.join(edited)}"
        out.talk(out.clean(f"{said}; the verdicts are of what was read at first. Run again"))
    return int(ExitCode.INCOMPLETE) if edited and code == ExitCode.OK else code


def _leave_input() -> None:
    """Let nobody read the standard input: what a part reads there is in no identity."""
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    os.close(null)


def _require_debuggable(elsewhere: Sequence[object], threads: int | None, *, json: bool) -> None:
    """Refuse a debugger where nobody could answer it."""
    from adeye.campaign.debugger import is_terminal

    if any(elsewhere) or threads not in {None, 1}:
        raise UsageError(
            "--pdb is given with --workers, --executor, --scheduler or several --threads",
            remedy="Leave these out: a debugger needs everything in one process.",
        )
    if json:
        raise UsageError(
            "--pdb is given with --json", remedy="Leave one out: a debugger prints between."
        )
    if not is_terminal():
        raise UsageError("--pdb needs a terminal", remedy="Leave it out, or run it in one.")


def _require_one_lane(session: Session, asked: Sequence[object]) -> None:
    if session.pace and any(asked):
        raise UsageError(
            "--pace is given with --threads, --workers, --executor or --scheduler",
            remedy="Leave these out: runs at a pace are executed one after the other.",
        )


def _print_outcome(
    summary: CampaignSummary, pace: Pace | None, db: str | None, *, json: bool
) -> None:
    """Print what came out; of a pace how far it was kept, and how long channels took."""
    answers = {} if pace is None else pace.answers
    if json:
        measured = ("factor", "ticks", "overruns", "latest_s")
        told = {**out.fields_of(pace, *measured), "answers": answers} if pace else None
        out.emit_json("run", {**document(summary), **({"pace": told} if told else {})})
        return
    print_summary(summary, executed_text(summary), db)
    if pace is None or not pace.ticks:
        return
    late = f", by up to {1e3 * pace.latest_s:.3g} ms" if pace.overruns else ""
    ended = f"{pace.overruns:,} of {pace.ticks:,} ticks ended late{late}"
    out.emit(f"\nAt a pace of {pace.factor:g}: {ended}.")
    headers = ("Channel", "Answers", "Median", "99 %", "Worst")
    rows = [
        [name, f"{times.asked:,}"]
        + [f"{1e3 * value:.3g} ms" for value in (times.median_s, times.p99_s, times.worst_s)]
        for name, times in answers.items()
    ]
    if rows:
        out.emit_table(headers, rows, right=headers[1:])


def _tell_after(summary: CampaignSummary, wanted: Wanted, *, quiet: bool) -> None:
    """Tell what else there is to know of a campaign that was run."""
    if wanted == "all" and summary.reused:
        untold = f"no trace is kept now of {summary.reused:,} results that were there already"
        out.talk(f"note: {untold}; for their traces run into a new database: --db NEW")
    if summary.exit_code is ExitCode.OK or quiet:
        return
    for what, events in (
        ("began in no run", summary.never_began),
        ("changed nothing in any run", summary.idle_events),
    ):
        if events:
            out.talk(out.clean(f"note: {what}: {', '.join(events)}", lines=True))


def report(
    campaign: opt.CampaignId = None,
    *,
    output: Annotated[
        Path | None, opt.option("--output -o FILE", env="REPORT", callback=opt.named_page)
    ] = None,
    junit: opt.JunitFile = None,
    report_json: Annotated[Path | None, opt.option("FILE", callback=opt.named)] = None,
    sarif: opt.SarifReport = None,
    gsn: Annotated[Path | None, opt.option("FILE", env="REPORT_GSN", callback=opt.named)] = None,
    reqif: Annotated[
        Path | None, opt.option("FILE", env="REPORT_REQIF", callback=opt.named)
    ] = None,
    baseline: Annotated[Path | None, opt.option("FILE", env="REPORT_BASELINE")] = None,
    db: opt.Db = None,
    quiet: opt.Quiet = False,
    json: opt.Json = False,
) -> None:
    """Write the report of a campaign that has been run: HTML, JUnit XML, JSON, SARIF, GSN, ReqIF.

    The runs that the page replays are executed again for it, to the same bits; nothing is stored.
    One that does not come out as it is stored is not drawn.

    Exit codes: 0 written, whatever the verdict; 2 input error, 4 written, but the evidence is not
    as it was written, or a run did not come out as it is stored; 5 database or disk.

    Parameters:
        output: The HTML page; default: report.html if nothing else is asked for.
        report_json: Write the report as JSON.
        gsn: Write the argument from goals to evidence: .svg a drawing, .mmd Mermaid, .json.
        reqif: Write goals and FSRs with their verdicts as ReqIF, for requirement tools.
        baseline: Tell what changed since this baseline, and what became stale by the files as they
            are now.

    Examples:
        adeye report
        adeye report 3 -o report.html --junit junit.xml
        adeye report --json > report.json
        adeye report --gsn argument.svg --reqif requirements.reqif --sarif verdicts.sarif
    """
    opt.require_baseline_named(baseline, "ADEYE_REPORT_BASELINE")
    files: Files = {"html": output, "junit": junit, "json": report_json}
    files |= {"sarif": sarif, "gsn": gsn, "reqif": reqif}
    if not any(files.values()) and not json:
        files["html"] = Path("report.html")
    written = _write(files, db, campaign, baseline=baseline, quiet=quiet)
    if json:
        from adeye.report.formats.json import render_json

        out.emit_document(render_json(written))
    if written.exit_code is ExitCode.INTEGRITY:
        raise IntegrityError(written.message)


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

    for name in ("none", "failures", "all"):
        if traces == name:
            return name
    raise UsageError(f"--traces is {traces!r}", remedy=suggest(traces, ("none", "failures", "all")))


_COMPILING: Final = "Compiling for this machine; only the first run does, it takes half a minute."


def _plan(
    odd: Path,
    backend: str,
    variant: str | None,
    *,
    is_near: bool = True,
    quiet: bool,
    told: str = "",
) -> tuple[CampaignPlan, Processes[Part, bool] | None]:
    """Make the plan; tell which processes compile for it, unless this is done or one processor's.

    On a first start they begin before the plan is read. What is told of it is told when the files
    are found to be right: whoever has to mend them is not to wait, nor to look for what is wrong
    with the machine.
    """
    from adeye.campaign.warmup import begin_aside, compile_meanwhile
    from adeye.kernel.jit import is_cache_warm

    processors = usable_processors() if is_near else 1
    aside = begin_aside(processors) if processors > 1 and not is_cache_warm() else None

    def begin(checked: CampaignPlan) -> None:
        if told:
            out.talk(told)
        if aside is not None:
            compile_meanwhile(checked, aside)

    try:
        begun = None if aside is None and not told else begin
        plan = opt.plan_of(odd, backend, variant, quiet=quiet, meanwhile=begun)
    except BaseException:
        if aside is not None:
            aside.abandon()
        raise
    if processors > 1 and aside is None and not is_cache_warm(*plan.compiled_parts):
        aside = begin_aside(processors)
        compile_meanwhile(plan, aside)
    return plan, aside


def _execute(
    plan: CampaignPlan,
    db: str | None,
    lanes: Parallel | NamedExecutor,
    traces: Wanted,
    session: Session,
    *,
    quiet: bool,
) -> CampaignSummary:
    from adeye.campaign.run import run_campaign

    here = lanes if isinstance(lanes, Parallel) else None
    executor = lanes if not isinstance(lanes, Parallel) else None
    where = lanes.text if isinstance(lanes, Parallel) else out.clean(lanes.text)
    with reporting(
        f"{amount(plan.expansion.count, 'test case')}, {where}", quiet=quiet
    ) as progress:
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
    if not any(files.values()):
        return int(summary.exit_code)
    codes = [ExitCode(summary.exit_code)]
    try:
        written = _write(files, db, summary.campaign, quiet=quiet)
    except AdeyeError as error:
        out.talk(out.clean(f"The report was not written: {error}", lines=True))
        codes.append(ExitCode(error.exit_code))
    else:
        # Who only executes what is missing has not looked at all rows, as the report has.
        if written.exit_code is ExitCode.INTEGRITY and written.exit_code not in codes:
            out.talk(out.clean(written.message, lines=True))
            codes.append(written.exit_code)
    return int(exit_code(codes))


def _write(
    files: Files,
    db: str | None,
    campaign: str | None,
    *,
    baseline: Path | None = None,
    quiet: bool,
) -> Report:
    from adeye.reporting import write_reports

    asked = {form: path for form, path in files.items() if path is not None}
    own = {form: path for form, path in asked.items() if form in _OWN}
    exports = {form: path for form, path in asked.items() if form not in _OWN} or None
    with reporting("report", quiet=quiet) as progress:
        report = write_reports(
            db, campaign, **own, exports=exports, baseline=baseline, progress=progress
        )
    for path in asked.values():
        out.wrote(path)
    return report


_GOES_ON: Final = (
    *("backend", "variant", "threads", "workers", "executor", "scheduler", "report", "junit"),
    *("report_json", "traces", "sarif", "shard", "keyword", "last_failed", "maxfail", "budget"),
    *("deadline", "pace"),
)
"""Options that the command which goes on has as this one had them."""


def _resume_hint(odd: Path, db: str | None, options: Mapping[str, object]) -> str:
    """Write the command that goes on: with another backend it would begin another campaign."""
    from adeye.store.location import option

    usual = signature(run).parameters
    given: list[str] = []
    for name in _GOES_ON:
        value = options[name]
        if value != usual[name].default:
            # A switch has no value.
            given.append("-k" if name == "keyword" else opt.flag_of(name))
            given += [] if value is True else [str(value)]
    command = f"adeye run {shlex.quote(str(odd))}{option(db)} {shlex.join(given)}".strip()
    return out.clean(f"Interrupted. Results so far are kept; go on with: {command}")


# --- ``judge``: judge results again after a threshold, a formula or an FSR has changed ------------


def judge(
    odd: opt.OddFile,
    *,
    replay: bool = False,
    threads: opt.Threads = None,
    workers: opt.Workers = None,
    db: opt.Db = None,
    backend: opt.Backend = "batch",
    variant: opt.Variant = None,
    quiet: opt.Quiet = False,
    json: opt.Json = False,
) -> None:
    """Judge the results that are there as the ODD and its concept ask for now; execute nothing new.

    Verdicts come from the rows of metrics, from kept extremes and from kept traces. Where these
    cannot tell, the run is counted and stays NOT_RUN until --replay executes it again.

    Exit codes: 0 all good, 1 an FSR failed, 2 input error, 3 evidence incomplete, 4 a run did not
    come out as it was recorded, 5 database or disk.

    Parameters:
        replay: Execute those runs again of which too little is kept; each must come out with the
            trace that it had.

    Examples:
        adeye judge odd/first.yaml
        adeye judge odd/first.yaml --replay
    """
    from adeye.campaign.run import judge_campaign

    plan = opt.plan_of(odd, backend, variant, quiet=quiet)
    lanes = parallel(plan, threads, workers)
    if not quiet:
        for notice in plan.notices:
            out.talk(out.clean(f"note: {notice}", lines=True))
    with reporting(amount(plan.expansion.count, "test case"), quiet=quiet) as progress:
        summary = judge_campaign(
            plan,
            db=db,
            replay=replay,
            workers=lanes.count if lanes.kind == "worker" else 1,
            threads=lanes.count if lanes.kind == "thread" else 1,
            progress=progress,
        )
    if json:
        out.emit_json("judge", {**document(summary), "to_execute": summary.to_execute})
    else:
        print_summary(summary, _text(summary, odd, db), db)
    raise typer.Exit(int(summary.exit_code))


def _text(summary: CampaignSummary, odd: Path, db: str | None) -> str:
    """Say what was judged, and what it takes to judge the rest."""
    from adeye.store.location import option

    lines = []
    if summary.judged or summary.replayed:
        lines.append(rejudged_text(summary))
    elif not summary.to_replay and not summary.to_execute:
        lines.append(f"All {summary.reused:,} results were judged already; 0 executed.")
    name = f"{shlex.quote(str(odd))}{option(db)}"
    if summary.to_replay:
        lines.append(
            f"{amount(summary.to_replay, 'run needs', 'runs need')} a replay: "
            f"adeye judge {name} --replay"
        )
    if summary.to_execute:
        lines.append(
            f"{amount(summary.to_execute, 'test case has', 'test cases have')} no result: "
            f"adeye run {name}"
        )
    return out.clean("\n".join(lines), lines=True)


# --- ``warmup``: compile now what the first run would otherwise compile ---------------------------

SHIPPED: Final = ("motorway_chauffeur.yaml", "urban_pedestrian_rain.yaml")
"""ODDs of the package whose kernels are compiled where none is named."""


def warmup(
    odds: Annotated[list[Path] | None, typer.Argument(metavar="[ODD]...")] = None,
    backend: opt.Backend = "batch",
    variant: opt.Variant = None,
    quiet: opt.Quiet = False,
    json: opt.Json = False,
) -> None:
    """Compile the kernels that ODDs need, and keep the machine code for every later run.

    One test case of each structure is executed and judged; its results are thrown away. Useful in
    the build of a container image and before a demonstration.

    Parameters:
        odds: ODD files; by default those that come with adeye.

    Examples:
        adeye warmup
        adeye warmup odd/first.yaml
    """
    from adeye.campaign.run import Progress
    from adeye.campaign.warmup import compile_aside, warm_up
    from adeye.kernel.jit import cache_directory
    from adeye.spec.load import shipped

    files = odds or [shipped("odd") / name for name in SHIPPED]
    began = time.perf_counter()
    for odd in files:
        with reporting(f"compile for {odd.name}", quiet=quiet) as progress:
            progress(Progress("compile", 0, 1, 0))
            # What is compiled first is what the plan itself needs.
            plan, aside = _plan(odd, backend, variant, quiet=True)
            if aside is not None:
                compile_aside(plan, aside)
            warm_up(plan, progress)
    taken = time.perf_counter() - began
    if json:
        out.emit_json("warmup", {"odds": files, "seconds": taken, "folder": cache_directory()})
    else:
        out.emit_line(f"Compiled in {duration(taken)}, kept in {cache_directory()}")
