"""``where`` and ``diff``: what is printed, as text, Markdown and JSON, and what is refused."""

from __future__ import annotations

import re
from typing import Any

import pytest

from adeye.cli.results.diff import _print_markdown
from adeye.report.gate.difference import Difference, Flip, FsrChange, Move, Rejudged, Side

SIDE = {"campaign": "a" * 32, "odd": "mini", "created_at": "2026-01-01", "planned": 4}
CASE: Any = {"scenario": "cut_in", "architecture": "a|b", "fault": "none",
             "values": "gap 30 m", "replicate": 0}  # fmt: skip


def changed() -> Difference:
    margin: Any = {"value": -0.5, "unit": "m"}
    return Difference(
        old=Side.model_validate({**SIDE, "number": 1}),
        new=Side.model_validate({**SIDE, "number": 2}),
        edits=(),
        fsrs=(
            FsrChange.model_validate({
                "kind": "changed", "fsr": "FSR-1", "is_measured_otherwise": True,
                "edits": [{"path": "text", "old": "Keep *2 m*", "new": "Keep\n3 m"}],
                "rejudged": [Rejudged(architecture="b", before={"PASS": 3},
                                      under_new={"PASS": 1, "FAIL": 1, "NOT_RUN": 1},
                                      not_judged=1)],
            }),
        ),
        cases=(),
        flips=(
            Flip.model_validate({
                "fsr": "FSR-1", "case": CASE, "old": "PASS", "new": None, "old_margin": margin,
                "old_run": "1" * 64, "new_run": "2" * 64,
            }),
        ) * 60,
        moves=(
            Move.model_validate({
                "fsr": "FSR-2", "architecture": "b", "scenario": "cut_in", "pairs": 3, "lost": 2,
                "gained": 1, "unit": "m", "tolerance": 0.01, "case": CASE, "old_margin": 1.0,
                "new_margin": 0.5, "new_run": "3" * 64,
            }),
        ),
    )  # fmt: skip


def test_markdown_is_whole_tables_whatever_is_in_them(capsys: pytest.CaptureFixture[str]) -> None:
    _print_markdown(changed())
    text = capsys.readouterr().out
    assert r"| FSR-1 | text | Keep \*2 m\* | Keep 3 m |" in text
    assert "1 result is not judged by it" in text
    assert "PASS → not applicable" in text
    assert "and 10 more" in text
    for table in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
        columns = {len(re.findall(r"(?<!\\)\|", row)) for row in table.splitlines()}
        assert len(columns) == 1


def test_campaign_and_itself_differ_in_nothing(adeye: Any, of_mini: Any) -> None:
    for form in ((), ("--markdown",)):
        assert adeye("diff", "1", "latest", *of_mini, *form).ok.out.endswith("Nothing differs.\n")
    document = adeye("diff", "mini", "1", *of_mini, "--json").document
    assert [document[name] for name in ("edits", "fsrs", "cases", "flips", "moves")] == [[]] * 5


def test_where_it_fails_is_one_answer_as_text_and_document(adeye: Any, of_mini: Any) -> None:
    document = adeye("where", "FSR-02", *of_mini, "--by", "gap", "--json").document
    text = adeye("where", "FSR-02", *of_mini, "--by", "gap,ego_speed").ok.out
    failing = [site for site in document["sites"] if site["tally"]["failed"]]
    assert failing
    for site in failing:
        assert f"{site['architecture']} in {site['scenario']}" in text
        for found in site["separations"]:
            for condition in found["where"]:
                assert f"    - {condition}\n" in text
    assert "gap / ego_speed" in text
    assert "gap does not vary" not in text
    only = adeye("where", "FSR-02", *of_mini, "--architecture", "camera_radar", "--json").document
    assert {site["architecture"] for site in only["sites"]} == {"camera_radar"}


def test_what_cannot_be_asked_exits_2(adeye: Any, of_mini: Any) -> None:
    for arguments, said in (
        (("where", "FSR-2"), "no FSR 'FSR-2'"),
        (("where", "FSR-02", "99"), "There are: 1"),
        (("where", "FSR-02", "--by", "gup"), "Did you mean 'gap'"),
        (("where", "FSR-02", "--architecture", "radar"), "no architecture 'radar'"),
        (("diff",), "no campaign 1 before number 1"),
        (("diff", "1", "1", "--json", "--markdown"), "exclude each other"),
    ):
        assert said in adeye(*arguments, *of_mini).refused, arguments
