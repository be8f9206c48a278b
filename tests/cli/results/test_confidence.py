"""``confidence`` and ``uncertainty``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.campaign.studies.test_half_step import ASKED, RUNS, TWINS
from tests.project import Executed, Project, one_scenario

# --- ``confidence``: what is printed and said to a machine, and when nothing may be said


def test_bounds_and_refusals_are_printed(adeye: Any, of_suites: Any) -> None:
    ended = adeye("confidence", *of_suites, "--target", "0.01")
    assert ended.err == ""
    assert "camera_radar (gate)" in ended.out
    assert "Needed for 0.010" in ended.out
    assert "No statement about lead_braking" in ended.out
    assert "not a random sample" in ended.out
    assert "Every bound is conditional" in ended.out
    # Of what is said nothing about, there is no population to tell.
    told = [line for line in ended.out.splitlines() if line.startswith(("cut_in: ", "lead_"))]
    assert len(told) == 1


def test_json_is_one_document(adeye: Any, of_suites: Any) -> None:
    assert adeye("confidence", *of_suites, "--json", "--level", "0.5").document["level"] == 0.5
    ended = adeye("confidence", *of_suites, "--json", "--level", "0.9")
    found = json.loads(ended.out)
    assert found["level"] == 0.9
    assert {item["scenario"] for item in found["claims"]} == {"cut_in", "lead_braking"}


def test_what_is_wrong_is_refused(adeye: Any, of_suites: Any) -> None:
    for options, said in (
        (("--level", "95"), "level is 95"),
        (("--level", "0.499"), "level is 0.499"),
        (("--level", "1"), "level is 1"),
        (("--method", "wald"), "there is no method 'wald'"),
        (("nowhere",), "nowhere"),
    ):
        ended = adeye("confidence", *options, *of_suites)
        assert said in ended.refused


# --- ``adeye uncertainty``: the table, JSON, and what it refuses


@pytest.fixture(scope="module")
def asked(tmp_path_factory: pytest.TempPathFactory) -> Project:
    project = Project(tmp_path_factory.mktemp("asked"), ASKED)
    project.run()
    return project


def test_table_shows_margins_and_metrics(adeye: Any, asked: Project) -> None:
    done = adeye("uncertainty", "--db", str(asked.db)).ok
    assert "step 0.05 s against half" in done.out
    (line,) = [row for row in done.out.splitlines() if "camera_radar" in row and "FSR-02" in row]
    assert "12 of 12" in line
    (line,) = [row for row in done.out.splitlines() if "camera_radar" in row and "FSR-09" in row]
    assert "too few" in line
    assert "min_ttc_s" in done.out


def test_json_has_every_line_however_the_campaign_is_named(adeye: Any, asked: Project) -> None:
    for what in ([str(asked.odd)], ["mini"], ["1"], []):
        found = adeye("uncertainty", *what, "--json", "--db", str(asked.db)).document["lines"]
        lines = {(line["architecture"], line["name"], line["unit"]): line for line in found}
        least = lines["camera_radar", "FSR-02", "m/s²"]
        assert least["uncertainty"] == least["p95"] == least["largest"] > 0.0
        assert (least["sampled"], least["pairs"], least["kind"]) == (12, 12, "fsr")
        few = lines["camera_radar", "FSR-09", "s"]
        assert few["p95"] is not None
        assert few["uncertainty"] is None


def test_campaign_that_did_not_ask_is_told_how_to(adeye: Any, mini: Executed) -> None:
    done = adeye("uncertainty", "--db", str(mini.db))
    assert done.code == 2
    assert "without numeric uncertainty" in done.err
    assert "uncertainty: {situations: 20}" in done.err


def test_odd_without_a_campaign_is_told_to_run(adeye: Any, asked: Project, mini: Executed) -> None:
    other = asked.write("odd/other.yaml", {**ASKED, "odd": "other"})
    assert f"adeye run {other}" in adeye("uncertainty", str(other), "--db", str(mini.db)).refused


def test_unknown_campaign_is_an_input_error(adeye: Any, asked: Project) -> None:
    assert "ffffffff" in adeye("uncertainty", "ffffffff", "--db", str(asked.db)).refused


@pytest.mark.slow
def test_run_and_plan_say_how_many_twins(adeye: Any, asked: Project, tmp_path: Path) -> None:
    done = adeye("run", str(asked.odd), "--db", str(tmp_path / "new.db"), "--quiet")
    assert f"Executed {RUNS} of {RUNS} test cases and {TWINS} twins with half the step" in done.out
    again = adeye("run", str(asked.odd), "--db", str(tmp_path / "new.db"), "--quiet", "--json")
    assert "twins" not in again.document
    planned = adeye("plan", str(asked.odd))
    assert f"{TWINS} of them are executed with half the step too" in planned.out


def test_samples_that_would_tell_nothing_are_refused(adeye: Any, asked: Project) -> None:
    for situations in (0, 9, -3, "many"):
        odd = {**ASKED, "uncertainty": {"situations": situations}}
        said = adeye("plan", str(asked.write("odd/few.yaml", odd))).refused
        assert "few.yaml:" in said
        assert "situations" in said


def test_scenario_with_too_few_situations_for_it_is_refused(adeye: Any, asked: Project) -> None:
    odd = {**ASKED, **one_scenario(gap=[f"{gap} m" for gap in range(20, 29)])}
    said = adeye("plan", str(asked.write("odd/few.yaml", odd))).refused
    assert "few.yaml:" in said
    assert "scenario cut_in has too few situations (9)" in said
    assert "at least 10" in said
    odd = {**odd, "replicates": 2}
    assert adeye("plan", str(asked.write("odd/few.yaml", odd))).code == 0


def test_comparison_is_by_verdicts_with_uncertainty(adeye: Any, asked: Project) -> None:
    found = adeye("compare", "--json", "--db", str(asked.db)).document
    text = adeye("compare", "--db", str(asked.db)).out
    assert "15 pairs executed, 0 not" in text
    assert found
    assert "Not executed" not in text
