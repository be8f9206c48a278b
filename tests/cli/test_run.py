"""``run``, ``report`` and ``judge``: what they are asked, and what they print."""

from __future__ import annotations

import shlex
import shutil
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

import adeye.campaign.plan
import adeye.campaign.run
import adeye.reporting
from adeye.campaign import warmup
from adeye.campaign.run import Progress
from adeye.campaign.summary import CampaignSummary, VerdictLine
from adeye.cli import run as cli_run
from adeye.errors import PlatformError, Terminated, UsageError
from adeye.judge.verdict import WORST_FIRST, ExitCode, Verdict, fold_fsrs
from adeye.kernel import jit as adeye_jit
from adeye.signals import Observation
from adeye.store import schema
from adeye.testing import ScriptedChannel, channel_context
from tests.project import Executed

# --- ``run`` and ``report``: exit codes, what is printed where, reports, interruption


LINE = VerdictLine(
    architecture="camera_radar",
    is_gate=True,
    fsr="FSR-01",
    asil="D",
    mandatory=True,
    verdict=Verdict.PASS,
    exercised=12,
    runs=12,
    margin=1.5,
    unit="m",
    worst_run="ab" * 32,
    text="No contact.",
)
SUMMARY = CampaignSummary(
    campaign="c" * 32,
    planned=12,
    executed=12,
    judged=0,
    reused=0,
    exit_code=ExitCode.OK,
    message="Every mandatory requirement passes.",
    verdicts=(LINE,),
)


class Campaign:
    """Stands for everything behind ``run``; remembers how it was called."""

    def __init__(self) -> None:
        self.summary: CampaignSummary | BaseException = SUMMARY
        self.report_error: Exception | None = None
        self.is_compiled = True
        self.edited: tuple[str, ...] = ()
        self.plans: list[tuple[Any, dict[str, Any]]] = []
        self.runs: list[dict[str, Any]] = []
        self.reports: list[tuple[Any, ...]] = []

    def make_plan(self, path: Path, **options: Any) -> Any:
        self.plans.append((path, options))
        if options["meanwhile"] is not None:
            options["meanwhile"](SimpleNamespace())
        return SimpleNamespace(
            notices=("an\x1b axis is dead",),
            expansion=SimpleNamespace(count=12),
            is_compiled=self.is_compiled,
            compiled_parts=frozenset({"channel-nominal"}),
            files=SimpleNamespace(edited=lambda: self.edited),
        )

    def run_campaign(self, _plan: Any, **options: Any) -> CampaignSummary:
        self.runs.append(options)
        options["progress"](Progress("run", 6, 12, 1))
        if isinstance(self.summary, BaseException):
            raise self.summary
        return self.summary

    def write_reports(self, db: str | None, campaign: str | None, **options: Any) -> Any:
        if self.report_error is not None:
            raise self.report_error
        options.pop("progress")(Progress("report", 1, 2, 0))
        asked = {kind: str(path) for kind, path in options.items() if path is not None}
        self.reports.append((db, campaign, asked))
        return SimpleNamespace(exit_code=ExitCode.FAILED)


@pytest.fixture
def campaign(monkeypatch: pytest.MonkeyPatch) -> Campaign:
    """Put the stand-in behind the verb."""
    fake = Campaign()
    monkeypatch.setattr(adeye.campaign.plan, "make_plan", fake.make_plan)
    monkeypatch.setattr(adeye.campaign.run, "run_campaign", fake.run_campaign)
    monkeypatch.setattr(adeye.reporting, "write_reports", fake.write_reports)
    monkeypatch.setattr(adeye_jit, "is_cache_warm", lambda *_: True)
    return fake


def test_exit_code_is_the_summarys(adeye: Any, campaign: Campaign) -> None:
    for code in ExitCode:
        campaign.summary = replace(SUMMARY, exit_code=code)
        assert adeye("run", "odd.yaml").code == int(code)


def test_what_was_edited_meanwhile_is_said_and_never_green(adeye: Any, campaign: Campaign) -> None:
    campaign.edited = ("odd.yaml", "concept.yaml")
    for code, expected in ((ExitCode.OK, 3), (ExitCode.FAILED, 1), (ExitCode.INTEGRITY, 4)):
        campaign.summary = replace(SUMMARY, exit_code=code)
        done = adeye("run", "odd.yaml", "--quiet")
        assert done.code == expected
        assert "edited while it ran: odd.yaml, concept.yaml;" in done.err


def test_options_reach_the_campaign(adeye: Any, campaign: Campaign) -> None:
    adeye("run", "odd.yaml", "--workers", "3", "--db", "x.db", "--backend", "other")
    assert campaign.plans == [
        (Path("odd.yaml"), {"backend": "other", "variant": None, "meanwhile": None})
    ]
    assert (campaign.runs[0]["workers"], campaign.runs[0]["db"]) == (3, "x.db")
    adeye("run", "odd.yaml", "--threads", "2", "--variant", "fast")
    assert campaign.plans[1][1] == {"backend": "batch", "variant": "fast", "meanwhile": None}
    assert (campaign.runs[1]["workers"], campaign.runs[1]["threads"]) == (1, 2)


def test_compiled_parts_use_threads_and_others_processes(adeye: Any, campaign: Campaign) -> None:
    adeye("run", "odd.yaml")
    campaign.is_compiled = False
    adeye("run", "odd.yaml")
    used = [(item["threads"], item["workers"]) for item in campaign.runs]
    assert used == [(cli_run.usable_processors(), 1), (1, cli_run.usable_processors())]
    assert cli_run.usable_processors() >= 1


@pytest.mark.parametrize(
    ("warm", "options", "said"),
    [
        (lambda *_: False, [], "Compiling for this machine"),
        (lambda *_: True, [], ""),
        (lambda *_: False, ["--quiet"], ""),
        (lambda *parts: not parts, [], "Compiling sensors or channels"),
    ],
    ids=["cold", "warm", "quiet", "parts"],
)
def test_compilation_is_announced(
    adeye: Any, campaign: Campaign, monkeypatch: pytest.MonkeyPatch,
    warm: Any, options: list[str], said: str,
) -> None:  # fmt: skip
    compiled: list[Any] = []
    monkeypatch.setattr(warmup, "begin_aside", lambda count: count)
    monkeypatch.setattr(warmup, "compile_meanwhile", Mock())
    monkeypatch.setattr(warmup, "compile_aside", lambda *given: compiled.append(given))
    monkeypatch.setattr(cli_run, "usable_processors", lambda: 2)
    monkeypatch.setattr(adeye_jit, "is_cache_warm", warm)
    ended = adeye("run", "odd.yaml", *options)
    assert [count for _, count in compiled] == [2] * bool(said or options)
    assert said in ended.err
    assert ended.err.count("Compiling") == bool(said)
    assert len(campaign.runs) == 1


@pytest.mark.usefixtures("campaign")
def test_nothing_is_compiled_for_a_plan_that_is_refused(
    adeye: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    aside = Mock()
    monkeypatch.setattr(warmup, "begin_aside", lambda _: aside)
    monkeypatch.setattr(cli_run, "usable_processors", lambda: 2)
    monkeypatch.setattr(adeye_jit, "is_cache_warm", lambda *_: False)
    refuse = Mock(side_effect=UsageError("no", remedy=""))
    monkeypatch.setattr("adeye.campaign.plan.make_plan", refuse)
    ended = adeye("run", "odd.yaml")
    assert (ended.code, "Compiling" in ended.err) == (2, False)
    aside.abandon.assert_called_once_with()


def test_result_on_stdout_and_talk_on_stderr_unless_quiet(adeye: Any, campaign: Campaign) -> None:
    assert campaign.summary is SUMMARY
    ended = adeye("run", "odd.yaml")
    for part in ("FSR-01", "Executed 12 of 12 test cases; 0 reused.", SUMMARY.message):
        assert part in ended.out
    assert "note: an axis is dead" in ended.err
    assert "12 test cases" in ended.err
    assert "note" not in ended.out
    assert campaign.reports == []
    quiet = adeye("run", "odd.yaml", "--quiet")
    assert (quiet.err, "FSR-01" in quiet.out) == ("", True)


def test_json_is_one_document(adeye: Any, campaign: Campaign) -> None:
    assert campaign.summary is SUMMARY
    document = adeye("run", "odd.yaml", "--json").document
    assert document["exit_code"] == 0
    assert document["verdicts"][0]["verdict"] == "PASS"
    assert document["verdicts"][0]["worst_run"] == "ab" * 32


def test_reports_are_written_and_named(adeye: Any, campaign: Campaign) -> None:
    given = ("--report", "r.html", "--junit", "j.xml", "--report-json", "r.json")
    ended = adeye("run", "o.yaml", *given, "--sarif", "v.sarif")
    files = {"html": "r.html", "junit": "j.xml", "json": "r.json"}
    exports = str({"sarif": Path("v.sarif")})
    assert campaign.reports == [(None, "c" * 32, {**files, "exports": exports})]
    for name in (*files.values(), "v.sarif"):
        assert f"wrote {name}" in ended.err


def test_failed_report_still_shows_the_verdicts(adeye: Any, campaign: Campaign) -> None:
    campaign.report_error = PlatformError("cannot write r.html")
    for verdict in (ExitCode.OK, ExitCode.FAILED, ExitCode.INTEGRITY):
        campaign.summary = replace(SUMMARY, exit_code=verdict)
        ended = adeye("run", "odd.yaml", "--report", "r.html")
        assert ended.code == ExitCode.ENVIRONMENT
        assert "FSR-01" in ended.out
        assert "cannot write r.html" in ended.err


INTERRUPTED = replace(SUMMARY, exit_code=ExitCode.INTERRUPTED)


@pytest.mark.parametrize(
    ("summary", "code"), [(KeyboardInterrupt(), 130), (Terminated(), 143), (INTERRUPTED, 130)]
)
def test_how_to_go_on(adeye: Any, campaign: Campaign, summary: Any, code: int) -> None:
    campaign.summary = summary
    ended = adeye("run", "my odd.yaml", "--db", "x.db", "--report", "r.html")
    assert ended.code == code
    assert "go on with: adeye run 'my odd.yaml' --db x.db --report r.html\n" in ended.err
    assert campaign.reports == []


def test_session_reaches_the_campaign_and_the_hint(adeye: Any, campaign: Campaign) -> None:
    campaign.summary = KeyboardInterrupt()
    options = ["--shard", "1/2", "-k", "cut_in and gap=30", "--last-failed", "--maxfail", "3"]
    options += ["--budget", "8h", "--deadline", "10m", "--pace", "1.5"]
    ended = adeye("run", "odd.yaml", *options)
    session = campaign.runs[0]["session"]
    assert session.choice.text == "--shard 1/2 -k 'cut_in and gap=30' --last-failed"
    assert (session.limits.budget_s, session.limits.most_failures) == (28_800.0, 3)
    assert (session.deadline_s, session.pace.factor) == (600.0, 1.5)
    assert f"go on with: adeye run odd.yaml {shlex.join(options)}\n" in ended.err


def test_hint_has_what_decides_the_campaign(adeye: Any, campaign: Campaign) -> None:
    campaign.summary = KeyboardInterrupt()
    given = ["--backend", "other", "--variant", "fast", "--workers", "3", "--junit", "j.xml"]
    hint = adeye("run", "odd.yaml", *given).err.split("go on with: adeye ")[1]
    campaign.summary = SUMMARY
    adeye(*hint.split())
    assert campaign.plans[0] == campaign.plans[1]
    assert campaign.runs[0]["workers"] == campaign.runs[1]["workers"] == 3
    assert len(campaign.reports) == 1


def test_pace_is_told_behind_the_verdicts(
    adeye: Any, campaign: Campaign, monkeypatch: pytest.MonkeyPatch
) -> None:
    def execute(_plan: Any, **options: Any) -> CampaignSummary:
        assert (options["threads"], options["workers"]) == (1, 1)
        pace = options["session"].pace
        channel = pace.timed("nominal", ScriptedChannel([0.0]))
        channel.reset(channel_context(None, links=(), sensors={}))
        for tick in range(3):
            pace.hold(1e-9 * tick)
            channel.act(Observation(0.0, {}, {}, None, np.ones(1, dtype=np.bool_)))
        return SUMMARY

    campaign.is_compiled = False
    monkeypatch.setattr("adeye.campaign.run.run_campaign", execute)
    ended = adeye("run", "odd.yaml", "--pace", "2")
    told = ended.out[ended.out.index("At a pace of 2: 2 of 2 ticks ended late, by up to ") :]
    assert [line.split()[0] for line in told.splitlines()[-1:]] == ["nominal"]
    found = adeye("run", "odd.yaml", "--pace", "2", "--json").document["pace"]
    assert (found["factor"], found["ticks"], found["overruns"]) == (2.0, 2, 2)
    times = found["answers"]["nominal"]
    assert times["asked"] == 3
    assert 0.0 <= times["median_s"] <= times["p99_s"] <= times["worst_s"]


def test_pace_of_nothing_is_not_told(adeye: Any, campaign: Campaign) -> None:
    assert campaign.summary is SUMMARY
    assert "pace" not in adeye("run", "odd.yaml", "--pace", "1").out
    assert "pace" not in adeye("run", "odd.yaml", "--json").document


@pytest.mark.usefixtures("campaign")
def test_pace_takes_one_lane_and_a_number_above_zero(adeye: Any) -> None:
    for lane in ("--threads", "--workers"):
        assert "one after the other" in adeye("run", "o.yaml", "--pace", "1", lane, "2").refused
    for wrong in ("0", "-1"):
        assert "the pace is" in adeye("run", "o.yaml", "--pace", wrong).refused


def test_report_of_no_campaign_is_an_input_error(adeye: Any, folder: Path) -> None:
    assert adeye("report", "-o", "r.html").code == 2
    assert list(folder.iterdir()) == []
    schema.upgrade(".adeye/adeye.db")
    assert "has no campaign" in adeye("report").refused
    assert [path.name for path in folder.iterdir()] == [".adeye"]


def test_report_writes_what_is_asked_for(adeye: Any, campaign: Campaign) -> None:
    sarif = {"sarif": Path("v.sarif")}
    exports = {"gsn": Path("a.svg"), "reqif": Path("r.reqif")}
    for arguments, asked, outputs in (
        ((), None, {"html": "report.html"}),
        (("--baseline", "b.json"), None, {"html": "report.html", "baseline": "b.json"}),
        (("3", "-o", "r.html"), "3", {"html": "r.html"}),
        (("--junit", "j.xml"), None, {"junit": "j.xml"}),
        (("--report-json", "r.json"), None, {"json": "r.json"}),
        (("--sarif", "v.sarif"), None, {"exports": str(sarif)}),
        (("--gsn", "a.svg", "--reqif", "r.reqif"), None, {"exports": str(exports)}),
    ):
        assert adeye("report", *arguments).ok
        assert campaign.reports.pop() == (None, asked, outputs)


def test_report_prints_its_document(adeye: Any, of_mini: tuple[str, str], folder: Path) -> None:
    printed = adeye("report", "--json", "--quiet", *of_mini).ok
    assert printed.document["odd"] == "mini"
    assert list(folder.iterdir()) == []


# --- what came out of a campaign in words and as JSON


def test_what_was_executed_reused_and_judged_again_is_said() -> None:
    def said(**changes: Any) -> str:
        return cli_run.executed_text(replace(SUMMARY, **changes))

    assert said(executed=0, reused=12) == "Executed nothing, all 12 results were there."
    again = said(executed=0, reused=12, judged=12)
    assert again.endswith("Re-judged 12 of 12 results; 0 executed again for it.")
    large = said(planned=1_000_000, executed=998_976, reused=1024)
    assert large == "Executed 998,976 of 1,000,000 test cases; 1,024 reused."
    # Nothing planned is not everything there.
    assert said(planned=0, executed=0) == "Executed 0 of 0 test cases; 0 reused."


def test_ways_of_judging_again_are_named() -> None:
    summary = replace(SUMMARY, judged=5, ways={"metric": 3, "trace": 2}, to_replay=1)
    assert cli_run.rejudged_text(summary) == (
        "Re-judged 5 of 6 results (3 from metric rows, 2 from kept traces); "
        "0 executed again for it."
    )


def test_judging_that_waits_for_a_replay_says_nothing_but_that() -> None:
    waiting = replace(SUMMARY, judged=0, to_replay=12)
    assert cli_run._text(waiting, Path("a.yaml"), None) == (
        "12 runs need a replay: adeye judge a.yaml --replay"
    )
    one = replace(SUMMARY, judged=11, to_replay=1)
    assert cli_run._text(one, Path("a.yaml"), None).splitlines() == [
        "Re-judged 11 of 12 results; 0 executed again for it.",
        "1 run needs a replay: adeye judge a.yaml --replay",
    ]
    lacking = replace(SUMMARY, judged=0, to_execute=3)
    assert cli_run._text(lacking, Path("a.yaml"), None) == (
        "3 test cases have no result: adeye run a.yaml"
    )


def test_document_tells_what_was_chosen_and_what_remains() -> None:
    assert cli_run.document(SUMMARY)["selected"] == 12
    assert cli_run.document(SUMMARY)["remaining"] == 0
    part = replace(SUMMARY, selected=4, executed=4, to_execute=8)
    assert (cli_run.document(part)["selected"], cli_run.document(part)["remaining"]) == (4, 8)
    assert cli_run.document(replace(SUMMARY, selected=0))["selected"] == 0


# --- the verdict table: order, margins, the hint to the worst run


PASSED = replace(
    LINE, architecture="a", is_gate=False, exercised=3, runs=4, margin=None, unit="", worst_run=""
)


@pytest.fixture
def printed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Callable[..., str]:
    """Print verdicts on a screen of some width."""

    def show(*lines: VerdictLine, width: int = 400) -> str:
        monkeypatch.setenv("COLUMNS", str(width))
        cli_run.print_verdicts(CampaignSummary("c", 4, 4, 0, 0, ExitCode.FAILED, "m", lines))
        return capsys.readouterr().out

    return show


def test_order_of_verdicts_is_that_of_folding() -> None:
    for worse, better in pairwise(word for word in WORST_FIRST if word is not None):
        assert fold_fsrs([better, worse]) is worse
    assert set(WORST_FIRST) == {*Verdict, None}


def test_gate_then_mandatory_then_worst_first() -> None:
    first = replace(PASSED, architecture="z", is_gate=True)
    failed = replace(first, verdict=Verdict.FAIL)
    lines = [
        replace(PASSED, fsr="1"),
        replace(first, fsr="2"),
        replace(failed, fsr="3"),
        replace(failed, fsr="4", mandatory=False),
        replace(PASSED, fsr="5", verdict=None),
        replace(PASSED, fsr="6", verdict=Verdict.ERROR),
    ]
    assert [line.fsr for line in cli_run.ordered(lines)] == ["3", "2", "4", "6", "5", "1"]


def test_verdicts_that_are_as_urgent_keep_the_order_of_odd_and_concept() -> None:
    failed = replace(PASSED, verdict=Verdict.FAIL)
    lines = [
        replace(failed, architecture=name, fsr=fsr) for name in ("z", "a") for fsr in ("9", "10")
    ]
    assert cli_run.ordered(lines) == lines


def test_margin_has_sign_and_unit() -> None:
    for margin, unit, text in (
        (-0.8, "m", "\N{MINUS SIGN}0.80 m"),
        (1.35, "m/s^2", "+1.35 m/s²"),
        (2.0, "", "+2.00"),
        (None, "m", "\N{EN DASH}"),
        (float("inf"), "m", "\N{EN DASH}"),
        (float("nan"), "m", "\N{EN DASH}"),
    ):
        assert cli_run.margin_text(replace(PASSED, margin=margin, unit=unit)) == text


def test_failure_leads_to_its_worst_run(printed: Callable[..., str]) -> None:
    worst = replace(PASSED, worst_run="ab" * 32)
    failed = replace(worst, verdict=Verdict.FAIL, margin=-1.0, unit="m")
    text = printed(PASSED, failed)
    for part in ("3 of 4", "adeye show ababababab", "adeye replay ababababab"):
        assert part in text
    assert "replay" not in printed(worst)


def test_each_fsr_that_fails_has_its_command_while_they_are_few(
    printed: Callable[..., str],
) -> None:
    failed = replace(PASSED, verdict=Verdict.FAIL)
    lines = [
        replace(failed, fsr=f"FSR-{number}", worst_run=str(number) * 64) for number in range(1, 6)
    ]
    assert printed(*lines[:3]).split("See why\n")[1].splitlines() == [
        "  a fails FSR-1:        adeye show 1111111111",
        "  a fails FSR-2:        adeye show 2222222222",
        "  a fails FSR-3:        adeye show 3333333333",
        "  the first as a page:  adeye replay 1111111111 --html replay.html",
    ]
    assert printed(*lines).splitlines()[-2] == "  and 2 more:           adeye query failing-fsrs"


def test_commands_of_the_hint_name_the_database_that_was_named(
    capsys: pytest.CaptureFixture[str],
) -> None:
    failed = replace(PASSED, verdict=Verdict.FAIL, worst_run="ab" * 32)
    summary = CampaignSummary("c", 4, 4, 0, 0, ExitCode.FAILED, "m", (failed,))
    cli_run.print_verdicts(summary, "my maps.db")
    assert capsys.readouterr().out.count("--db 'my maps.db'") == 2


def test_narrow_screen_keeps_every_row_on_one_line(printed: Callable[..., str]) -> None:
    line = replace(LINE, fsr="FSR-07", mandatory=False, verdict=Verdict.INCONCLUSIVE)
    line = replace(line, margin=-12.3, unit="m/s^2", exercised=168, runs=168)
    row = printed(line, width=80).splitlines()[-1]
    for part in ("FSR-07 opt.", "INCONCLUSIVE", "168 of 168", "m/s\N{SUPERSCRIPT TWO}", "ab" * 5):
        assert part in row


def test_architectures_are_headed_and_the_gate_is_marked(printed: Callable[..., str]) -> None:
    lines = printed(PASSED, replace(PASSED, architecture="b", is_gate=True)).splitlines()
    assert lines.index("b (gate)") < lines.index("a")


def test_texts_are_harmless_and_short(printed: Callable[..., str]) -> None:
    text = printed(replace(PASSED, architecture="[red]a\x1b[2J", text="long\n" * 100))
    assert "[red]a[2J" in text
    assert "\x1b" not in text
    assert "…" in text


def test_vacuous_line_says_how_many_runs_are_needed(printed: Callable[..., str]) -> None:
    few = replace(PASSED, verdict=Verdict.VACUOUS, exercised=2, runs=2, min_exercised=30)
    assert "2 of 30 needed" in printed(few)


# --- ``judge``: what it prints, and what it executes: nothing unless asked to


@pytest.mark.slow
def test_judged_results_are_left_alone(adeye: Any, mini: Executed, tmp_path: Path) -> None:
    db = tmp_path / "copy.db"
    shutil.copyfile(mini.db, db)
    done = adeye("judge", str(mini.project.odd), "--db", str(db), "--quiet")
    assert done.code == int(mini.summary.exit_code), done.err
    assert "All 28 results were judged already; 0 executed." in done.out
    found = adeye("judge", str(mini.project.odd), "--db", str(db), "--json", "--quiet").document
    assert (found["executed"], found["replayed"], found["to_replay"]) == (0, 0, 0)


def test_database_has_to_be_there(adeye: Any, mini: Executed, tmp_path: Path) -> None:
    done = adeye("judge", str(mini.project.odd), "--db", str(tmp_path / "no.db"))
    assert done.code == 2
    assert not (tmp_path / "no.db").exists()


def test_debugger_is_refused_where_nobody_could_answer_it(adeye: Any, campaign: Campaign) -> None:
    for options, said in (
        (("--workers", "2"), "everything in one process"),
        (("--threads", "2"), "everything in one process"),
        (("--executor", "processes"), "everything in one process"),
        (("--json",), "prints between"),
        ((), "needs a terminal"),
    ):
        assert said in adeye("run", "odd.yaml", "--pdb", *options).refused
    assert not campaign.plans
