"""``check``: findings by rule with their place and remedy, JSON, SARIF, exit codes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from adeye.store.repository import Repository
from tests.project import CONCEPT, Project

ODD = "odd/tested.yaml"


@pytest.fixture
def project(folder: Path) -> Project:
    return Project(folder)


def expire(project: Project) -> None:
    with project.edited(CONCEPT) as content:
        content["assumptions"][0]["valid_until"] = "2001-01-31"


@pytest.mark.slow
def test_sound_files_have_no_findings(adeye: Any, project: Project) -> None:
    assert project.odd.is_file()
    ended = adeye("check", ODD)
    assert ended.code == 0, ended.err
    assert ended.out == (
        "mini (no campaign of it is stored, so its evidence is not checked): "
        "no findings by 25 rules.\n"
    )


@pytest.mark.slow
def test_finding_is_printed_with_place_and_remedy(adeye: Any, project: Project) -> None:
    expire(project)
    ended = adeye("check", ODD)
    assert ended.code == 1
    heading, finding, remedy, _, last = ended.out.strip().splitlines()
    assert heading == "expired_assumption: An assumption is out of date."
    place, _, text = finding.strip().partition(": ")
    path, line, _ = place.rsplit(":", 2)
    lines = (project.folder / path).read_text("utf-8").splitlines()
    assert lines[int(line) - 1].strip() == "valid_until: '2001-01-31'"
    assert text == "AS-01: was valid until 2001-01-31, of system architect"
    assert remedy.strip().startswith("Ask its owner")
    assert last.endswith("1 finding by 1 of 25 rules.")


@pytest.mark.slow
def test_json_has_rules_and_findings(adeye: Any, project: Project) -> None:
    expire(project)
    ended = adeye("check", ODD, "--json")
    assert ended.code == 1
    document = ended.document
    assert (document["schema"], document["odd"], document["campaign"]) == (
        "adeye/check@1",
        "mini",
        None,
    )
    assert {"id", "view", "text", "remedy"} == set(document["rules"][0])
    (finding,) = document["findings"]
    assert finding["rule"] == "expired_assumption"
    assert finding["where"]["path"].endswith("motorway_chauffeur.yaml")


@pytest.mark.slow
def test_sarif_is_written_beside_the_text(adeye: Any, project: Project) -> None:
    expire(project)
    ended = adeye("check", ODD, "--sarif", "check.sarif")
    assert ended.code == 1
    assert "wrote check.sarif" in ended.err
    log = json.loads(Path("check.sarif").read_text("utf-8"))
    assert [item["ruleId"] for item in log["runs"][0]["results"]] == ["expired_assumption"]


@pytest.mark.slow
def test_stored_campaign_is_named_by_its_number(adeye: Any, project: Project) -> None:
    plan = project.plan()
    with Repository.open(project.db) as repository:
        repository.plan_campaign(plan.record(), plan.planned())
    for arguments in ((), ("1",)):
        ended = adeye("check", *arguments, "--db", str(project.db))
        assert ended.code == 1
        assert "not_run: Planned test cases have no result." in ended.out
        assert "cut_in: 12 of 12 test cases of camera_radar have no result" in ended.out
        assert ended.out.strip().endswith("by 1 of 31 rules.")


def test_nothing_to_check_is_no_success(adeye: Any) -> None:
    ended = adeye("check")
    assert (ended.code, ended.out) == (3, "")
    assert "Nothing to check" in ended.err


def test_campaign_that_there_is_not_is_an_input_error(adeye: Any, project: Project) -> None:
    Repository.open(project.db).close()
    ended = adeye("check", "7", "--db", str(project.db))
    assert ended.code == 2
    assert "run an ODD first" in ended.err


def test_odd_that_there_is_not_is_an_input_error(adeye: Any) -> None:
    ended = adeye("check", "odd/none.yaml")
    assert ended.code == 2
    assert "odd/none.yaml:1:1: there is no such file" in ended.err


def test_illegal_decomposition_is_refused_with_its_line(adeye: Any, project: Project) -> None:
    with project.edited(CONCEPT) as content:
        content["decompositions"] = [
            {"requirement": "FSR-01", "into": ["FSR-07", "FSR-08"], "independence": "text"}
        ]
        for item in content["requirements"]:
            if item["id"] in {"FSR-07", "FSR-08"}:
                item["asil"] = "A(D)"
    ended = adeye("check", ODD)
    assert ended.code == 2
    assert "A(D) + A(D) is no decomposition of FSR-01 (D). Allowed: B(D) + B(D)" in ended.err
    assert "motorway_chauffeur.yaml:" in ended.err
