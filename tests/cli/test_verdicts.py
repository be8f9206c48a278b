"""The verdict table: order, margins, the hint to the worst run."""

from dataclasses import replace
from itertools import pairwise

import pytest

from adeye.campaign.summary import CampaignSummary, VerdictLine
from adeye.cli.run import margin_text, ordered, print_verdicts
from adeye.judge.verdict import WORST_FIRST, ExitCode, Verdict, fold_fsrs

LINE = VerdictLine(
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
        replace(LINE, fsr="1", architecture="a"),
        replace(LINE, fsr="2", architecture="z", is_gate=True),
        replace(LINE, fsr="3", architecture="z", is_gate=True, verdict=Verdict.FAIL),
        replace(
            LINE, fsr="4", architecture="z", is_gate=True, verdict=Verdict.FAIL, mandatory=False
        ),
        replace(LINE, fsr="5", architecture="a", verdict=None),
        replace(LINE, fsr="6", architecture="a", verdict=Verdict.ERROR),
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
    assert margin_text(replace(LINE, margin=margin, unit=unit)) == text


def test_failure_leads_to_its_worst_run(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "300")
    failed = replace(LINE, verdict=Verdict.FAIL, worst_run="ab" * 32, margin=-1.0, unit="m")
    print_verdicts(summary(LINE, failed))
    text = capsys.readouterr().out
    assert "3 of 4" in text
    assert "adeye show ababababab" in text
    assert "adeye replay ababababab" in text


def test_all_green_has_no_hint(capsys: pytest.CaptureFixture[str]) -> None:
    print_verdicts(summary(replace(LINE, worst_run="ab" * 32)))
    assert "replay" not in capsys.readouterr().out


def test_narrow_screen_keeps_every_row_on_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    line = replace(
        LINE,
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
    print_verdicts(summary(LINE, replace(LINE, architecture="b", is_gate=True)))
    lines = capsys.readouterr().out.splitlines()
    assert lines.index("b (gate)") < lines.index("a")


def test_texts_are_harmless_and_short(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "400")
    print_verdicts(summary(replace(LINE, architecture="[red]a\x1b[2J", text="long\n" * 100)))
    text = capsys.readouterr().out
    assert "[red]a[2J" in text
    assert "\x1b" not in text
    assert "…" in text


def test_vacuous_line_says_how_many_runs_are_needed(capsys: pytest.CaptureFixture[str]) -> None:
    few = replace(LINE, verdict=Verdict.VACUOUS, exercised=2, runs=2, min_exercised=30)
    print_verdicts(summary(few))
    assert "2 of 30 needed" in capsys.readouterr().out
