"""Write the reports of a campaign: the database's numbers and the runs that a page embeds."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Final

from adeye.campaign.naming import find_called, planned_as
from adeye.campaign.replay import Execution, recorded, rerun, rerun_together
from adeye.campaign.run import Progress
from adeye.campaign.stale import find_stale
from adeye.errors import InputError, needing
from adeye.exchange import require_place
from adeye.exchange.view import Account, Remark, RunView
from adeye.judge.verdict import Verdict
from adeye.outputs import replacing, replacing_folder, write_atomically
from adeye.report.build import MAX_REPLAYS, ReplayRequest, ReportBuilder, drawn_in
from adeye.report.files import guarding
from adeye.report.formats import check_exports, render_export
from adeye.report.formats.json import render_json
from adeye.report.formats.junit import render_junit
from adeye.report.formats.signals import Drawing
from adeye.report.formats.traces import TraceTable, chosen_signals, trace_table
from adeye.report.gate.baseline import deciding, read_baseline
from adeye.report.gate.changes import Tolerances
from adeye.report.gate.decide import GateResult, judge_campaign
from adeye.report.model.evidence import Change, Impact, StaleEvidence, StaleFiles
from adeye.report.model.part import Label
from adeye.report.page.drive import plots_of, replay_of
from adeye.report.page.html import write_html
from adeye.report.page.replay import Replay, Undrawn
from adeye.report.verification import replay_events, run_verdicts
from adeye.spec.load import odd_of
from adeye.store.location import option
from adeye.store.repository import Repository
from adeye.sweep.values import named_values

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from contextlib import AbstractContextManager

    from adeye.exchange.view import Level
    from adeye.report.model.report import Report
    from adeye.store.records import CampaignInfo, VerdictRecord
    from adeye.trace import Album

    Write = Callable[[Execution, Path], object]
    """Writes an executed run to a file, or into a folder."""
    Opening = Callable[[Path], AbstractContextManager[Path]]
    """Gives the place beside a file or a folder that takes its place at the end."""

# --- What changed since a baseline: the gate's comparison, and the evidence that became stale -----

_SHOWN = 12
"""Characters of a digest that a command names."""


def change_since(
    repository: Repository, campaign: CampaignInfo, baseline: Path, db: str | Path | None
) -> Impact:
    """Tell what changed since a baseline, without executing anything.

    Which evidence became stale depends on the files as they are now, which a campaign alone does
    not; the gate's part depends on the database and the baseline only.

    Args:
        repository: The database.
        campaign: The campaign.
        baseline: File that it is compared with.
        db: How commands name the database; None for the default.

    Raises:
        InputError: There is no such baseline, or it is of another ODD.
        IntegrityError: The baseline was edited.
    """
    # First, so that a wrong file is said before every row is verified.
    former = read_baseline(baseline).campaign
    result = judge_campaign(repository, campaign, baseline, Tolerances())
    end = option(db)
    file = shlex.quote(str(baseline))
    return impact_of(
        result,
        former,
        stale_now(repository, campaign),
        (
            f"adeye gate {campaign.id[:_SHOWN]} --baseline {file}{end}",
            lambda run: f"adeye show {run[:_SHOWN]}{end}",
        ),
    )


def impact_of(
    result: GateResult,
    former: str,
    stale: StaleFiles | str,
    commands: tuple[str, Callable[[str], str]],
) -> Impact:
    """Return what changed since a baseline.

    Args:
        result: Of the campaign, compared with the baseline.
        former: Id of the campaign that the baseline was written from.
        stale: What of the evidence counts under the files as they are, or why that is not known.
        commands: Asks the gate, and shows a run.
    """
    gate, show = commands
    decides = deciding(result.changes)
    return Impact.of(
        result,
        campaign=former,
        changes=tuple(
            Change.of(
                item,
                decides=item in decides,
                command=show(item.runs[0]) if item.runs else "",
            )
            for item in result.changes
        ),
        stale=None if isinstance(stale, str) else stale,
        not_asked=stale if isinstance(stale, str) else "",
        command=gate,
    )


def stale_now(repository: Repository, campaign: CampaignInfo) -> StaleFiles | str:
    """Tell which evidence still counts under the files as they are, or why that is not known.

    Args:
        repository: The database.
        campaign: The campaign; its ODD is looked for where it was when it ran.
    """
    later = [item.provenance for item in repository.evidence.sessions(campaign.id)]
    path = odd_of(campaign.provenance, repository.location.beside.parent, later)
    if not path.is_file():
        return f"The ODD of the campaign is no longer at {path}."
    try:
        plan = planned_as(campaign, path)
    except InputError as error:
        return f"The files cannot be planned as they are now: {error}"
    found = find_stale(repository, plan, campaign)
    return StaleFiles.of(found, odd=str(path), causes=tuple(map(StaleEvidence.of, found.stale)))


# --- Write the reports of a campaign: the database's numbers and the runs that a page embeds ------

SECOND = len("YYYY-MM-DDTHH:MM:SS")


def write_reports(  # noqa: PLR0913 - one parameter a file
    db: str | Path | None,
    campaign: str | None,
    *,
    html: Path | None = None,
    junit: Path | None = None,
    json: Path | None = None,
    exports: Mapping[str, Path] | None = None,
    baseline: Path | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Report:
    """Build the report of a campaign and write it in the forms asked for.

    The page embeds runs, which are executed again; JUnit and JSON need none.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        campaign: Id, its beginning or its number; None for the newest.
        html: Page to write.
        junit: JUnit XML to write.
        json: Machine-readable report to write.
        exports: Files for other tools by form: ``sarif``, ``gsn`` and ``reqif``.
        baseline: File to tell the changes since; what became stale is told, too, by the files as
            they are now.
        progress: Called for each run that is drawn.

    Raises:
        InputError: There is no such campaign or baseline, or a file's name tells no form.
        IntegrityError: The baseline was edited.
        PlatformError: A file cannot be written.
    """
    check_exports(exports or {})
    files = {"html": html, "junit": junit, "json": json, **(exports or {})}
    with guarding(db, files):
        with Repository.open(db, create=False) as repository:
            found = repository.find_campaign(campaign)
            builder = _builder(repository, found, db)
            # A baseline that cannot be read is said before a minute of drawing.
            impact = None if baseline is None else change_since(repository, found, baseline, db)
            pen = _Pen(repository, builder, progress)
            report = builder.build(pen.draw, replays=MAX_REPLAYS if html else 0)
            report = report.model_copy(update={"impact": impact})
        if html is not None:
            write_html(report, html)
        if junit is not None:
            write_atomically(render_junit(report), junit)
        if json is not None:
            write_atomically(render_json(report).encode(), json)
        for form, path in (exports or {}).items():
            write_atomically(render_export(report, form, path), path)
    return report


def _builder(
    repository: Repository,
    campaign: CampaignInfo,
    db: str | Path | None,
    *,
    is_verified: bool = False,
) -> ReportBuilder:
    """Prepare the report of a campaign, which says when that was begun."""
    database = str(db) if db is not None else ""
    created = campaign.created_at[:SECOND]
    return ReportBuilder(
        repository, campaign, database=database, created=created, is_verified=is_verified
    )


def junit_of(
    repository: Repository, campaign: CampaignInfo, db: str | Path | None, result: GateResult
) -> bytes:
    """Return the JUnit XML of what a gate decided about a campaign, whose rows were verified."""
    builder = _builder(repository, campaign, db, is_verified=True)
    return render_junit(builder.build(lambda _: (), replays=0), result)


def read_report(db: str | Path | None, campaign: str | None) -> Report:
    """Build the report of a campaign without a run to draw.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        campaign: Id, its beginning, its number, the ODD's id or file; None for the newest.

    Raises:
        InputError: There is no such campaign.
        IntegrityError: Results are not as they were written.
    """
    with Repository.open(db, create=False) as repository:
        found = find_called(repository, campaign)
        repository.require_sound(found.id)
        database = str(db) if db is not None else ""
        builder = ReportBuilder(repository, found, database=database, is_verified=True)
        return builder.build(lambda _: (), replays=0)


def write_replay(db: str | Path | None, run: str, path: Path) -> Report:
    """Write a page with the replay of one run, and return its report.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        run: Beginning of its result digest.
        path: Where to.
    """
    with guarding(db, {"path": path}):
        with Repository.open(db, create=False) as repository:
            ref = repository.find_run(run)
            campaign = repository.find_campaign(ref.campaign)
            builder = _builder(repository, campaign, db)
            pen = _Pen(repository, builder)
            report = builder.build(pen.draw, replays=0)
            drawn = pen.draw([ReplayRequest(ref, "asked for")])
        told = drawn_in(drawn, (report.exit_code, report.message))
        report = report.model_copy(update=told)
        write_html(report, path, is_of_run=True)
    return report


@dataclass(frozen=True)
class _Pen:
    """Draws runs for a page."""

    repository: Repository
    builder: ReportBuilder
    progress: Callable[[Progress], None] | None = None

    def draw(self, requests: Sequence[ReplayRequest]) -> tuple[Replay | Undrawn, ...]:
        """Execute runs again and draw those that come out as they are stored."""
        drawn: list[Replay | Undrawn] = []
        told = self.progress or (lambda _: None)
        for number, request in enumerate(requests):
            told(Progress("report", number, len(requests), 0))
            drawn.append(self._drawn(request, rerun(self.repository, request.run)))
        told(Progress("report", len(requests), len(requests), 0))
        return tuple(drawn)

    def _drawn(self, request: ReplayRequest, done: Execution) -> Replay | Undrawn:
        builder = self.builder
        command = builder.replay_command(done.run.result_digest)
        if done.trace.digests()[0] != done.stored.trace_digest:
            return Undrawn(run=done.run.result_digest, why=request.why, command=command)
        records = verdicts_of(done)
        stored = {item.fsr_id: item for item in records}
        parameters = named_values(dict(done.case.parameters), builder.odd, done.run.scenario)
        return replay_of(
            done.trace,
            0,
            run=done.run.result_digest,
            architecture=done.run.architecture,
            fault=done.case.fault_entry,
            parameters=list(map(Label.of, parameters)),
            outcome=done.evaluation.outcomes[0].outcome,
            verdicts=run_verdicts(records),
            events=replay_events(done.stored.events),
            signals=plots_of(done.signals, 0, builder.concept.requirements, stored),
            why=request.why,
            command=command,
        )


# --- The signals of one run: as a table, and drawn ------------------------------------------------


def trace_run(db: str | Path | None, run: str, patterns: Sequence[str] = ()) -> TraceTable:
    """Give the signals of a stored run over time, executed again where its trace is not kept.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        run: Beginning of its result digest.
        patterns: Which signals, see ``chosen_signals``; none means every one.

    Raises:
        InputError: There is no such run, no such signal, or it was not executed yet.
        IntegrityError: The trace is not the one that was recorded.
    """
    with Repository.open(db, create=False) as repository:
        done = recorded(repository, repository.find_run(run))
    about = {
        "run": done.run.result_digest,
        "scenario": done.run.scenario,
        "architecture": done.run.architecture,
        "fault": done.case.fault_entry,
        "outcome": done.stored.row["outcome"],
        "trace": done.stored.trace_digest,
    }
    return trace_table(done.signals, 0, about, patterns)


def draw_run(db: str | Path | None, run: str, patterns: Sequence[str]) -> Drawing:
    """Give what is drawn of signals of a stored run, with the limits that FSRs set on them.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        run: Beginning of its result digest.
        patterns: Which signals, see ``chosen_signals``.

    Raises:
        InputError: There is no such run, no such signal, or it was not executed yet.
        IntegrityError: The trace is not the one that was recorded.
    """
    with Repository.open(db, create=False) as repository:
        done = recorded(repository, repository.find_run(run))
    names = chosen_signals(list(done.signals.dictionary), patterns)
    records = {item.fsr_id: item for item in done.stored.verdicts}
    trace = done.signals.trace
    return Drawing(
        title=f"{done.run.scenario}, {done.run.architecture}, "
        f"fault {done.case.fault_entry}, run {done.run.result_digest[:_SHOWN]}",
        time_s=tuple(trace.time[: int(trace.length[0])].tolist()),
        plots=plots_of(done.signals, 0, done.requirements, records, names),
        events=tuple((item.time_s, item.text) for item in done.stored.events),
    )


def verdicts_of(done: Execution) -> list[VerdictRecord]:
    """Return the stored verdicts of a run that are about the FSRs as they are judged now."""
    judged = {item.fsr_digest for item in done.evaluation.judgements[0]}
    return [item for item in done.stored.verdicts if item.fsr_digest in judged]


# --- Hand runs to other people's viewers and tools ------------------------------------------------

_LEVELS: Final[Mapping[Verdict, Level]] = {
    Verdict.FAIL: "error",
    Verdict.ERROR: "error",
    Verdict.INVALID: "warning",
}
"""How bad a verdict is; the others are only told."""


def handing_out(
    *,
    mcap: Path | None = None,
    osi: Path | None = None,
    commonroad: Path | None = None,
    rosbag: Path | None = None,
    shown: BinaryIO | None = None,
    album: Album | None = None,
) -> Callable[[Execution], None]:
    """Give what writes an executed run for others; what is missing for it is told before.

    Args:
        mcap: File for Foxglove and Lichtblick.
        osi: Folder for traces of ASAM OSI.
        commonroad: Folder for a scenario of CommonRoad and its solution.
        rosbag: Folder for a bag of ROS 2, or file in .bag for one of ROS 1.
        shown: What a bag is made of: what a channel is shown, see ``replay_run``.
        album: Images for MCAP, see ``replay_run``.

    Raises:
        InputError: An extra is not installed that one of them needs.
        UsageError: A folder holds something else.
    """
    writers: list[Callable[[Execution], None]] = []

    def add(write: Write, path: Path, open_place: Opening) -> None:
        def act(done: Execution) -> None:
            with open_place(path) as place:
                write(done, place)

        writers.append(act)

    if mcap is not None:
        add(_mcap_writer({} if album is None else album), mcap, replacing)
    if osi is not None:
        add(_osi_writer(osi), osi, replacing_folder)
    if commonroad is not None:
        add(_commonroad_writer(commonroad), commonroad, replacing_folder)
    if rosbag is not None:
        is_file = rosbag.suffix == ".bag"
        add(_rosbag_writer(rosbag, shown), rosbag, replacing if is_file else replacing_folder)

    def hand_out(done: Execution) -> None:
        for item in writers:
            item(done)

    return hand_out


def export_osi(
    db: str | Path | None,
    campaign: str | None,
    folder: Path,
    runs: Sequence[str] = (),
    *,
    report: Callable[[Progress], None] | None = None,
) -> int:
    """Write the runs of a campaign as traces of ASAM OSI; they are executed again, many at once.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        campaign: Id, its beginning or its number; None for the newest.
        folder: For the files, which takes the place of a former one.
        runs: Beginnings of result digests; none means every run that has a result.
        report: Called with how many are written.

    Returns:
        How many runs there are.

    Raises:
        InputError: The extra is not installed, or there is no such campaign or run.
        IntegrityError: Results are not as they were written, or a run does not come out so.
        UsageError: The folder holds something else.
        PlatformError: A file cannot be written.
    """
    write = _osi_writer(folder)
    with guarding(db, {"--osi": folder}), Repository.open(db, create=False) as repository:
        if runs:
            named = [repository.find_run(run) for run in runs]
            refs = list({ref.result_digest: ref for ref in named}.values())
        else:
            found = repository.find_campaign(campaign)
            refs = repository.hindsight.executed(found.id)
        if not refs:
            raise InputError(
                "no run of the campaign has a result",
                remedy="Execute some: adeye run ODD.",
            )
        for name in {ref.campaign for ref in refs}:
            repository.require_sound(name)
        with replacing_folder(folder) as place:
            for done in rerun_together(repository, refs, report):
                write(done, place)
    return len(refs)


def _mcap_writer(album: Album) -> Write:
    with needing("MCAP", "viz"):
        from adeye.exchange.mcap import write_mcap

    return lambda done, file: write_mcap(RunView(done.trace), _account(done), file, album)


def _osi_writer(folder: Path) -> Write:
    with needing("OSI", "osi"):
        from adeye.exchange.osi import NAMES, is_own, write_osi
    require_place(folder, NAMES, "traces of OSI", is_own)
    return lambda done, place: write_osi(RunView(done.trace), _account(done), place)


def _commonroad_writer(folder: Path) -> Write:
    from adeye.exchange.commonroad import NAMES, is_own, write_commonroad

    require_place(folder, NAMES, "a scenario of CommonRoad", is_own)
    return lambda done, place: write_commonroad(RunView(done.trace), _account(done), place)


def _rosbag_writer(path: Path, shown: BinaryIO | None) -> Write:
    with needing("a bag of ROS", "viz"):
        from adeye.exchange.rosbag import FILE, NAMES, is_own, write_rosbag
    if path.suffix != FILE:
        require_place(path, NAMES, "a bag of ROS 2", is_own)

    def write(_: Execution, place: Path) -> None:
        assert shown is not None
        shown.seek(0)
        write_rosbag(shown, place, path.name)

    return write


def _about(done: Execution) -> dict[str, str]:
    return {
        "scenario": done.run.scenario,
        "architecture": done.run.architecture,
        "fault": done.case.fault_entry,
        "outcome": done.evaluation.outcomes[0].outcome.value,
        "trace": done.trace.digests()[0],
    }


def _account(done: Execution) -> Account:
    """Say what is known of a run beside its trace; what has no time is told at its end."""
    events = [
        Remark(item.time_s, "info", item.subject or item.kind, item.text)
        for item in done.stored.events
    ]
    end = float(done.trace.time[int(done.trace.length[0]) - 1])
    verdicts = [
        Remark(
            end if item.time_s is None else item.time_s,
            _LEVELS.get(item.verdict, "info"),
            item.fsr_id,
            f"{item.verdict.value}: {item.predicate or item.detail or 'no predicate decides it'}",
        )
        for item in verdicts_of(done)
    ]
    metrics = {name: item.value for name, item in sorted(done.stored.metrics.items())}
    remarks = tuple(sorted([*events, *verdicts], key=lambda item: item.time))
    return Account(done.run.result_digest, _about(done), remarks, metrics)
