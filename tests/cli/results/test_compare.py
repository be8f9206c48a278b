"""``compare`` and ``matrix``."""

from __future__ import annotations

import csv
import re
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

import adeye.reporting
from adeye.cli.results.compare import p_text, percent, place_text
from adeye.report.formats.matrix import matrix_of
from adeye.report.model.report import Report
from tests.project import Executed
from tests.report.fake import build_report
from tests.report.parts import candidate
from tests.suites import build_half

# --- ``compare``: what is printed, which campaign is meant, what is refused


DASH = "\N{EN DASH}"


@pytest.mark.slow
def test_overview_comes_first_and_names_everything(adeye: Any, of_suites: Any) -> None:
    ended = adeye("compare", *of_suites)
    assert (ended.code, ended.err) == (0, "")
    lines = ended.out.splitlines()
    assert lines[0].split()[:2] == ["Architecture", "Sensors"]
    for part in ("camera_radar (gate)", "1 camera + 1 radar",
                 "dominated by no_radar", "chosen points", "p (Holm)", "2 of A",
                 "What one sensor adds", "spare_camera", "detects the object"):  # fmt: skip
        assert part in ended.out


def test_json_is_one_document(adeye: Any, of_suites: Any, suites: Executed) -> None:
    document = adeye("compare", *of_suites, "--json", "--baseline", "legacy_camera").document
    assert document["campaign"] == suites.summary.campaign
    assert {item["a"] for item in document["pairs"]} == {"legacy_camera"}
    assert document["confidence"] == 0.95


@pytest.mark.parametrize("name", ["1", "suites", "odd"])
def test_campaign_by_any_name(adeye: Any, of_suites: Any, suites: Executed, name: str) -> None:
    given = str(suites.project.odd) if name == "odd" else name
    document = adeye("compare", given, "twin", "camera_radar", *of_suites, "--json").document
    assert [item["id"] for item in document["candidates"]] == ["camera_radar", "twin"]


def test_architectures_alone_are_of_the_latest_campaign(adeye: Any, of_suites: Any) -> None:
    document = adeye("compare", "no_radar", "twin", *of_suites, "--json").document
    assert [item["id"] for item in document["candidates"]] == ["no_radar", "twin"]


@pytest.mark.slow
def test_objectives_and_epsilon(adeye: Any, of_suites: Any) -> None:
    given = ("--objectives", "cost, failures", "--epsilon", "cost=50")
    document = adeye("compare", *of_suites, "--json", *given).document
    found = [(item["name"], item["epsilon"]) for item in document["objectives"]]
    assert found == [("cost", 50.0), ("failures", 0.0)]


@pytest.mark.slow
def test_page_is_written(adeye: Any, of_suites: Any, folder: Path) -> None:
    assert "wrote compared.html" in adeye("compare", *of_suites, "--html", "compared.html").ok.err
    text = (folder / "compared.html").read_text("utf-8")
    assert "<svg" in text
    assert "spare_camera" in text


def test_what_cannot_be_compared_exits_2(adeye: Any, of_suites: Any) -> None:
    for arguments, part in (
        (("camera_radr", "twin"), "Did you mean 'camera_radar'"),
        (("9f9f9f9f",), "there is none"),
        (("99",), "There are: 1 (suites, "),
        (("--objectives", "cost,failures,cost"), "'cost' is given twice"),
        (("--objectives", "prize"), "Allowed: failures, margin, availability, cost"),
        (("--epsilon", "cost=1", "--epsilon", "cost=2"), "epsilon of cost is given twice: 1 and 2"),
        (("--epsilon", "cost=nan"), "'cost=nan' is not NAME=SIZE with a size from 0"),
        (("--epsilon", "cost=-inf"), "'cost=-inf' is not NAME=SIZE"),
        (("--epsilon", "cost=-1"), "'cost=-1' is not NAME=SIZE"),
        (("--epsilon", "margin=1"), "has no effect: the objectives are failures, availability"),
        (("missing.yaml",), "missing.yaml"),
        (("twin",), "nothing to compare"),
        (("--epsilon", "cost"), "NAME=SIZE"),
        (("--epsilon", "prize=3"), "no objective 'prize'"),
        (("--confidence", "2"), "confidence is 2"),
        (("--objectives", ","), "no objective is given"),
    ):
        ended = adeye("compare", *arguments, *of_suites)
        assert part in ended.refused, arguments


def test_odd_that_was_never_run_exits_2(adeye: Any, of_suites: Any, suites: Executed) -> None:
    shipped = suites.project.folder / "odd" / "motorway_chauffeur.yaml"
    assert "has no campaign" in adeye("compare", str(shipped), *of_suites).refused


@pytest.mark.slow
def test_forms_of_an_interrupted_campaign_agree(adeye: Any, suites: Executed, folder: Path) -> None:
    db = ("--db", str(build_half(suites, folder / "half.db").db))
    text = adeye("compare", *db).out
    candidates = adeye("compare", *db, "--json", "--html", "half.html").document["candidates"]
    page = (folder / "half.html").read_text("utf-8")
    for item in candidates:
        named = ", ".join(
            f"{one['scenario']} {one['missing']} of {one['planned']}" for one in item["unexecuted"]
        )
        assert named
        assert 0 < item["cases"] == 26 - item["left_out"] < 26
        for said in (text, page):
            flat = " ".join(said.split())
            assert f"Not executed of {item['id']}: {named}." in flat
            assert f"Left out of {item['id']} above: {item['left_out']} of 26 shared" in flat
            assert f"{item['failing']} of {item['cases']}" in flat


@pytest.mark.slow
def test_largest_loss_is_a_loss_or_none(adeye: Any, of_suites: Any) -> None:
    found: Counter[str] = Counter()
    column = -1
    for line in adeye("compare", *of_suites).out.splitlines():
        cells = re.split(r"\s{2,}", line.strip())
        if "Largest loss" in cells:
            column = cells.index("Largest loss")
            width = len(cells)
        elif column >= 0 and len(cells) == width:
            loss, run = cells[column : column + 2]
            found[loss[0]] += 1
            assert (run == DASH) == (loss in {"none", DASH})
        else:
            column = column if set(line.strip()) == {"\N{BOX DRAWINGS LIGHT HORIZONTAL}"} else -1
    assert set(found) == {"n", DASH, "\N{MINUS SIGN}"}


def test_numbers_for_people() -> None:
    assert percent(-0.5) == "\N{MINUS SIGN}50.0 %"
    assert p_text(0.0009) == "< 0.001"
    assert place_text(candidate("a", is_on_front=False)) == "\N{EN DASH}"


# --- ``matrix``: both ways, as table, CSV and JSON


@pytest.fixture
def report(monkeypatch: pytest.MonkeyPatch) -> Report:
    """Put a report behind the verb."""
    made = build_report(rows=10, replays=0)
    monkeypatch.setattr(adeye.reporting, "read_report", lambda *_: made)
    return made


def test_table_has_a_line_for_each_hazard_with_its_gaps(adeye: Any, report: Report) -> None:
    ended = adeye("matrix").ok
    assert all(item.id in ended.out for item in report.hazards)
    assert "no FSR is allocated to it" in ended.out
    assert ended.out.rstrip().endswith("gaps; every row: --csv or --json.")


def test_way_back_begins_with_the_scenario(adeye: Any, report: Report) -> None:
    ended = adeye("matrix", "--by", "scenario", "--csv").ok
    rows = list(csv.DictReader(ended.out.splitlines()))
    assert next(iter(rows[0])) == "scenario"
    assert [row["fsr"] for row in rows] == [row.fsr for row in matrix_of(report, "scenario")]


def test_json_has_every_row_and_counts_the_gaps(adeye: Any, report: Report) -> None:
    document = adeye("matrix", "--json").document
    assert (document["schema"], document["campaign"]) == ("adeye/matrix@1", report.campaign)
    assert len(document["rows"]) == len(matrix_of(report))
    assert document["gaps"] == sum(bool(row["gap"]) for row in document["rows"]) > 0


def test_column_that_is_none_and_two_forms_at_once_are_refused(adeye: Any, report: Report) -> None:
    assert report.campaign
    assert "scenario" in adeye("matrix", "--by", "scenarios").refused
    assert adeye("matrix", "--csv", "--json").code == 2
