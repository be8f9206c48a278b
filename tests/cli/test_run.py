"""``run``, ``report`` and ``judge``: what they are asked, and what they print."""

from __future__ import annotations

import shlex
import shutil
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

import adeye.campaign.plan
import adeye.campaign.run
import adeye.cli.run as cli_run
import adeye.reporting
from adeye.campaign import warmup
from adeye.campaign.run import Progress
from adeye.campaign.summary import CampaignSummary, VerdictLine
from adeye.cli.run import (
    document,
    executed_text,
    margin_text,
    ordered,
    print_verdicts,
    rejudged_text,
    usable_processors,
)
from adeye.errors import PlatformError, Terminated
from adeye.judge.verdict import WORST_FIRST, ExitCode, Verdict, fold_fsrs
from adeye.kernel import jit as adeye_jit
from adeye.store import schema

if TYPE_CHECKING:
    from pathlib import Path

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
        self.plans: list[tuple[Any, dict[str, Any]]] = []
        self.runs: list[dict[str, Any]] = []
        self.reports: list[tuple[Any, ...]] = []

    def make_plan(self, path: Path, **options: Any) -> Any:
        self.plans.append((path, options))
        return SimpleNamespace(
            notices=("an\x1b axis is dead",),
            expansion=SimpleNamespace(count=12),
            is_compiled=self.is_compiled,
            compiled_parts=frozenset({"channel-nominal"}),
        )

    def run_campaign(self, _plan: Any, **options: Any) -> CampaignSummary:
        self.runs.append(options)
        options["progress"](Progress("run", 6, 12, 1))
        if isinstance(self.summary, BaseException):
            raise self.summary
        return self.summary

    def write_reports(self, db: str | None, campaign: str | None, **options: Any) -> None:
        if self.report_error is not None:
            raise self.report_error
        options.pop("progress")(Progress("report", 1, 2, 0))
        asked = {kind: str(path) for kind, path in options.items() if path is not None}
        self.reports.append((db, campaign, asked))


@pytest.fixture
def campaign(monkeypatch: pytest.MonkeyPatch) -> Campaign:
    """Put the stand-in behind the verb."""
    fake = Campaign()
    monkeypatch.setattr(adeye.campaign.plan, "make_plan", fake.make_plan)
    monkeypatch.setattr(adeye.campaign.run, "run_campaign", fake.run_campaign)
    monkeypatch.setattr(adeye.reporting, "write_reports", fake.write_reports)
    monkeypatch.setattr(adeye_jit, "is_cache_warm", lambda *_: True)
    return fake


@pytest.mark.parametrize("code", list(ExitCode))
def test_exit_code_is_the_summarys(adeye: Any, campaign: Campaign, code: ExitCode) -> None:
    campaign.summary = replace(SUMMARY, exit_code=code)
    assert adeye("run", "odd.yaml").code == int(code)


def test_options_reach_the_campaign(adeye: Any, campaign: Campaign) -> None:
    adeye("run", "odd.yaml", "--workers", "3", "--db", "x.db", "--backend", "other")
    assert campaign.plans == [(Path("odd.yaml"), {"backend": "other", "variant": None})]
    assert (campaign.runs[0]["workers"], campaign.runs[0]["db"]) == (3, "x.db")
    adeye("run", "odd.yaml", "--threads", "2", "--variant", "fast")
    assert campaign.plans[1][1] == {"backend": "batch", "variant": "fast"}
    assert (campaign.runs[1]["workers"], campaign.runs[1]["threads"]) == (1, 2)


def test_compiled_parts_use_every_processor_in_threads(adeye: Any, campaign: Campaign) -> None:
    adeye("run", "odd.yaml")
    assert campaign.runs[0]["threads"] == usable_processors() >= 1
    assert campaign.runs[0]["workers"] == 1


def test_python_parts_use_every_processor_in_processes(adeye: Any, campaign: Campaign) -> None:
    campaign.is_compiled = False
    adeye("run", "odd.yaml")
    assert campaign.runs[0]["workers"] == usable_processors() >= 1
    assert campaign.runs[0]["threads"] == 1


@pytest.mark.parametrize(("warm", "options"), [(False, []), (True, []), (False, ["--quiet"])])
def test_first_compilation_is_announced(
    adeye: Any,
    campaign: Campaign,
    monkeypatch: pytest.MonkeyPatch,
    warm: bool,  # noqa: FBT001 - a case of the table
    options: list[str],
) -> None:
    compiled: list[Any] = []
    monkeypatch.setattr(adeye_jit, "is_cache_warm", lambda *_: warm)
    monkeypatch.setattr(warmup, "compile_aside", compiled.append)
    monkeypatch.setattr(cli_run, "usable_processors", lambda: 2)
    ended = adeye("run", "odd.yaml", *options)
    assert len(compiled) == (0 if warm else 1)
    assert campaign.runs
    is_expected = not warm and not options
    assert ("Compiling for this machine" in ended.err) is is_expected


def test_compilation_of_what_was_not_used_before_is_announced(
    adeye: Any, campaign: Campaign, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(adeye_jit, "is_cache_warm", lambda *parts: not parts)
    monkeypatch.setattr(warmup, "compile_aside", lambda _plan: True)
    ended = adeye("run", "odd.yaml")
    assert campaign.runs
    assert "Compiling sensors or channels" in ended.err
    assert "Compiling for this machine" not in ended.err


def test_threads_and_workers_exclude_each_other(adeye: Any, campaign: Campaign) -> None:
    assert (
        "exclude each other" in adeye("run", "odd.yaml", "--threads", "2", "--workers", "2").refused
    )
    assert not campaign.runs


def test_result_on_stdout_and_talk_on_stderr(adeye: Any, campaign: Campaign) -> None:
    assert campaign.summary is SUMMARY
    ended = adeye("run", "odd.yaml")
    assert "FSR-01" in ended.out
    assert "Executed 12 of 12 test cases; 0 reused." in ended.out
    assert "Every mandatory requirement passes." in ended.out
    assert "note: an axis is dead" in ended.err
    assert "12 test cases" in ended.err
    assert "note" not in ended.out


def test_quiet_leaves_only_the_result(adeye: Any, campaign: Campaign) -> None:
    assert campaign.summary is SUMMARY
    ended = adeye("run", "odd.yaml", "--quiet")
    assert ended.err == ""
    assert "FSR-01" in ended.out


def test_json_is_one_document(adeye: Any, campaign: Campaign) -> None:
    assert campaign.summary is SUMMARY
    document = adeye("run", "odd.yaml", "--json").document
    assert document["schema"] == "adeye/run@1"
    assert document["exit_code"] == 0
    assert document["verdicts"][0]["verdict"] == "PASS"
    assert document["verdicts"][0]["worst_run"] == "ab" * 32


def test_reports_are_written_and_named(adeye: Any, campaign: Campaign) -> None:
    ended = adeye(
        "run", "o.yaml", "--report", "r.html", "--junit", "j.xml", "--report-json", "r.json"
    )
    files = {"html": "r.html", "junit": "j.xml", "json": "r.json"}
    assert campaign.reports == [(None, "c" * 32, files)]
    for name in ("r.html", "j.xml", "r.json"):
        assert f"wrote {name}" in ended.err


def test_run_writes_sarif(adeye: Any, campaign: Campaign) -> None:
    ended = adeye("run", "o.yaml", "--sarif", "v.sarif")
    assert campaign.reports == [(None, "c" * 32, {"exports": str({"sarif": Path("v.sarif")})})]
    assert "wrote v.sarif" in ended.err


def test_without_report_options_nothing_is_written(adeye: Any, campaign: Campaign) -> None:
    adeye("run", "odd.yaml")
    assert campaign.reports == []


@pytest.mark.parametrize(
    ("verdict", "code"), [(ExitCode.OK, 5), (ExitCode.FAILED, 5), (ExitCode.INTEGRITY, 5)]
)
def test_report_that_cannot_be_written_still_shows_the_verdicts(
    adeye: Any, campaign: Campaign, verdict: ExitCode, code: int
) -> None:
    campaign.summary = replace(SUMMARY, exit_code=verdict)
    campaign.report_error = PlatformError("cannot write r.html")
    ended = adeye("run", "odd.yaml", "--report", "r.html")
    assert ended.code == code
    assert "FSR-01" in ended.out
    assert "cannot write r.html" in ended.err


@pytest.mark.parametrize(("error", "code"), [(KeyboardInterrupt(), 130), (Terminated(), 143)])
def test_interruption_says_how_to_go_on(
    adeye: Any, campaign: Campaign, error: BaseException, code: int
) -> None:
    campaign.summary = error
    ended = adeye("run", "my odd.yaml", "--db", "x.db", "--report", "r.html")
    assert ended.code == code
    assert "go on with: adeye run 'my odd.yaml' --db x.db" in ended.err
    assert campaign.reports == []


def test_summary_that_was_interrupted_says_how_to_go_on(adeye: Any, campaign: Campaign) -> None:
    campaign.summary = replace(SUMMARY, exit_code=ExitCode.INTERRUPTED)
    ended = adeye("run", "odd.yaml", "--report", "r.html")
    assert ended.code == 130
    assert "go on with: adeye run odd.yaml --report r.html\n" in ended.err
    assert campaign.reports == []


def test_session_reaches_the_campaign_and_the_command_that_goes_on(
    adeye: Any, campaign: Campaign
) -> None:
    campaign.summary = KeyboardInterrupt()
    options = ["--shard", "1/2", "-k", "cut_in and gap=30", "--last-failed", "--maxfail", "3"]
    options += ["--budget", "8h", "--deadline", "10m"]
    ended = adeye("run", "odd.yaml", *options)
    session = campaign.runs[0]["session"]
    assert session.choice.text == "--shard 1/2 -k 'cut_in and gap=30' --last-failed"
    assert (session.limits.budget_s, session.limits.most_failures) == (28_800.0, 3)
    assert session.deadline_s == 600.0
    assert f"go on with: adeye run odd.yaml {shlex.join(options)}\n" in ended.err


def test_what_decides_the_campaign_is_in_the_command_that_goes_on(
    adeye: Any, campaign: Campaign
) -> None:
    campaign.summary = KeyboardInterrupt()
    given = ["--backend", "other", "--variant", "fast", "--workers", "3", "--junit", "j.xml"]
    hint = adeye("run", "odd.yaml", *given).err.split("go on with: adeye ")[1]
    campaign.summary = SUMMARY
    adeye(*hint.split())
    assert campaign.plans[0] == campaign.plans[1]
    assert campaign.runs[0]["workers"] == campaign.runs[1]["workers"] == 3
    assert len(campaign.reports) == 1


def test_defect_in_the_campaign_is_not_success(adeye: Any, campaign: Campaign) -> None:
    campaign.summary = ZeroDivisionError("x")
    ended = adeye("run", "odd.yaml")
    assert ended.code == 3
    assert "defect" in ended.err


def test_report_of_an_empty_database_is_an_input_error(adeye: Any) -> None:
    schema.upgrade(".adeye/adeye.db")
    assert "has no campaign" in adeye("report").refused
    assert not Path("report.html").exists()


def test_report_without_a_database_is_an_input_error(adeye: Any) -> None:
    ended = adeye("report", "-o", "r.html")
    assert ended.code == 2
    assert not Path("r.html").exists()


@pytest.mark.parametrize(
    ("arguments", "asked", "outputs"),
    [
        ((), None, {"html": "report.html"}),
        (("--baseline", "b.json"), None, {"html": "report.html", "baseline": "b.json"}),
        (("3", "-o", "r.html"), "3", {"html": "r.html"}),
        (("--junit", "j.xml"), None, {"junit": "j.xml"}),
        (("--json", "r.json"), None, {"json": "r.json"}),
        (("--sarif", "v.sarif"), None, {"exports": str({"sarif": Path("v.sarif")})}),
        (
            ("--gsn", "a.svg", "--reqif", "r.reqif"),
            None,
            {"exports": str({"gsn": Path("a.svg"), "reqif": Path("r.reqif")})},
        ),
    ],
)
def test_report_writes_what_is_asked_for(
    adeye: Any,
    campaign: Campaign,
    arguments: tuple[str, ...],
    asked: str | None,
    outputs: dict[str, str],
) -> None:
    ended = adeye("report", *arguments)
    assert ended.code == 0, ended.err
    assert campaign.reports == [(None, asked, outputs)]


# --- what came out of a campaign in words and as JSON


def test_nothing_executed_is_said() -> None:
    summary = replace(SUMMARY, executed=0, reused=12)
    assert executed_text(summary) == "Executed nothing, all 12 results were there."
    assert executed_text(replace(summary, judged=12)).endswith(
        "Re-judged 12 of 12 results; 0 executed again for it."
    )


def test_large_counts_can_be_read() -> None:
    text = executed_text(replace(SUMMARY, planned=1_000_000, executed=998_976, reused=1024))
    assert text == "Executed 998,976 of 1,000,000 test cases; 1,024 reused."


def test_nothing_planned_is_not_everything_there() -> None:
    empty = replace(SUMMARY, planned=0, executed=0)
    assert executed_text(empty) == "Executed 0 of 0 test cases; 0 reused."


def test_ways_of_judging_again_are_named() -> None:
    summary = replace(SUMMARY, judged=5, ways={"metric": 3, "trace": 2}, to_replay=1)
    assert rejudged_text(summary) == (
        "Re-judged 5 of 6 results (3 from metric rows, 2 from kept traces); "
        "0 executed again for it."
    )


def test_document_tells_what_was_chosen_and_what_remains() -> None:
    assert document(SUMMARY)["selected"] == 12
    assert document(SUMMARY)["remaining"] == 0
    part = replace(SUMMARY, selected=4, executed=4, to_execute=8)
    assert (document(part)["selected"], document(part)["remaining"]) == (4, 8)
    assert document(replace(SUMMARY, selected=0))["selected"] == 0


# --- the verdict table: order, margins, the hint to the worst run


PASSED = VerdictLine(
    architecture="a",
    is_gate=False,
    fsr="FSR-01",
    asil="D",
    mandatory=True,
    verdict=Verdict.PASS,
    exercised=3,
    runs=4,
    margin=None,
    unit="",
    worst_run="",
    text="text",
)


def summary(*lines: VerdictLine) -> CampaignSummary:
    return CampaignSummary("c", 4, 4, 0, 0, ExitCode.FAILED, "m", lines)


def test_order_of_verdicts_is_that_of_folding() -> None:
    for worse, better in pairwise(word for word in WORST_FIRST if word is not None):
        assert fold_fsrs([better, worse]) is worse
    assert set(WORST_FIRST) == {*Verdict, None}


def test_gate_then_mandatory_then_worst_first() -> None:
    lines = [
        replace(PASSED, fsr="1", architecture="a"),
        replace(PASSED, fsr="2", architecture="z", is_gate=True),
        replace(PASSED, fsr="3", architecture="z", is_gate=True, verdict=Verdict.FAIL),
        replace(
            PASSED, fsr="4", architecture="z", is_gate=True, verdict=Verdict.FAIL, mandatory=False
        ),
        replace(PASSED, fsr="5", architecture="a", verdict=None),
        replace(PASSED, fsr="6", architecture="a", verdict=Verdict.ERROR),
    ]
    assert [line.fsr for line in ordered(lines)] == ["3", "2", "4", "6", "5", "1"]


@pytest.mark.parametrize(
    ("margin", "unit", "text"),
    [
        (-0.8, "m", "\N{MINUS SIGN}0.80 m"),
        (1.35, "m/s^2", "+1.35 m/s²"),
        (2.0, "", "+2.00"),
        (None, "m", "\N{EN DASH}"),
        (float("inf"), "m", "\N{EN DASH}"),
        (float("nan"), "m", "\N{EN DASH}"),
    ],
)
def test_margin_has_sign_and_unit(margin: float | None, unit: str, text: str) -> None:
    assert margin_text(replace(PASSED, margin=margin, unit=unit)) == text


def test_failure_leads_to_its_worst_run(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "300")
    failed = replace(PASSED, verdict=Verdict.FAIL, worst_run="ab" * 32, margin=-1.0, unit="m")
    print_verdicts(summary(PASSED, failed))
    text = capsys.readouterr().out
    assert "3 of 4" in text
    assert "adeye show ababababab" in text
    assert "adeye replay ababababab" in text


def test_all_green_has_no_hint(capsys: pytest.CaptureFixture[str]) -> None:
    print_verdicts(summary(replace(PASSED, worst_run="ab" * 32)))
    assert "replay" not in capsys.readouterr().out


def test_narrow_screen_keeps_every_row_on_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    line = replace(
        PASSED,
        fsr="FSR-07",
        mandatory=False,
        verdict=Verdict.INCONCLUSIVE,
        margin=-12.3,
        unit="m/s^2",
        worst_run="ab" * 32,
        exercised=168,
        runs=168,
    )
    print_verdicts(summary(line))
    row = capsys.readouterr().out.splitlines()[-1]
    for part in ("FSR-07 opt.", "INCONCLUSIVE", "168 of 168", "m/s\N{SUPERSCRIPT TWO}", "ab" * 5):
        assert part in row


def test_architectures_are_headed_and_the_gate_is_marked(
    capsys: pytest.CaptureFixture[str],
) -> None:
    print_verdicts(summary(PASSED, replace(PASSED, architecture="b", is_gate=True)))
    lines = capsys.readouterr().out.splitlines()
    assert lines.index("b (gate)") < lines.index("a")


def test_texts_are_harmless_and_short(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "400")
    print_verdicts(summary(replace(PASSED, architecture="[red]a\x1b[2J", text="long\n" * 100)))
    text = capsys.readouterr().out
    assert "[red]a[2J" in text
    assert "\x1b" not in text
    assert "…" in text


def test_vacuous_line_says_how_many_runs_are_needed(capsys: pytest.CaptureFixture[str]) -> None:
    few = replace(PASSED, verdict=Verdict.VACUOUS, exercised=2, runs=2, min_exercised=30)
    print_verdicts(summary(few))
    assert "2 of 30 needed" in capsys.readouterr().out


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
