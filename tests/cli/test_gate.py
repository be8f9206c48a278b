"""``gate``, ``check`` and ``stale``."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from lxml import etree

from adeye.report.gate.baseline import baseline_text, read_baseline
from adeye.store.repository import Repository
from tests.project import CONCEPT, Executed, Project, count_rows
from tests.sql import alter
from tests.stored import known

# --- ``gate``: what is printed, the document, JUnit, options that do not go together


@pytest.fixture
def baseline(adeye: Any, of_mini: Any) -> Path:
    ended = adeye("gate", *of_mini, "--baseline", "b.json", "--update").ok
    assert ended.err == "wrote b.json\n"
    return Path("b.json")


def stricter(path: Path) -> None:
    """Let the baseline be of a campaign that was better."""
    found = read_baseline(path)
    assert found.cases is not None
    part = next(item for item in found.cases if item.architecture == "camera_radar")
    place = part.fsrs.index("FSR-02")
    row = part.rows[0]
    margins = tuple(99.0 if at == place else value for at, value in enumerate(row.margins))
    rows = (row.model_copy(update={"margins": margins}), *part.rows[1:])
    cases = [item for item in found.cases if item is not part]
    cases.append(part.model_copy(update={"rows": rows}))
    path.write_text(baseline_text(found.model_copy(update={"cases": tuple(cases)})), "utf-8")


@pytest.mark.slow
def test_campaign_against_its_own_baseline(adeye: Any, of_mini: Any, baseline: Path) -> None:
    alone = adeye("gate", *of_mini)
    assert (alone.code, alone.err) == (0, "")
    assert "Every mandatory requirement passes for camera_radar." in alone.out
    against = adeye("gate", *of_mini, "--baseline", str(baseline)).ok
    assert "Nothing differs from the baseline." in against.out


@pytest.mark.slow
def test_loss_of_margin_decides(adeye: Any, of_mini: Any, baseline: Path) -> None:
    stricter(baseline)
    ended = adeye("gate", *of_mini, "--baseline", str(baseline))
    assert ended.code == 1
    lines = ended.out.splitlines()
    at = lines.index("Decides:")
    assert lines[at + 1].startswith("  margin: FSR-02, camera_radar, ")
    assert lines[at + 2].startswith("    adeye show ")
    assert lines[-1] == "Exit code 1 (an FSR failed or regressed)."
    assert adeye("gate", *of_mini, "--baseline", "b.json", "--tolerance", "FSR-02=100").code == 0


@pytest.mark.slow
def test_document_and_junit_say_the_same(adeye: Any, of_mini: Any, baseline: Path) -> None:
    stricter(baseline)
    ended = adeye("gate", *of_mini, "--baseline", str(baseline), "--json", "--junit", "j.xml")
    document = ended.document
    assert document["exit_code"] == ended.code == 1
    (finding,) = document["findings"]
    assert (finding["kind"], finding["decides"], finding["fsr"]) == ("margin", True, "FSR-02")
    suites = etree.parse("j.xml").xpath("testsuite[@name='gate']")
    red = {case.get("name"): case[0].tag for case in suites[0].iter("testcase") if len(case)}
    assert set(red.values()) == {"failure"}
    assert len(red) == 2


@pytest.mark.slow
def test_green_gate_has_no_red_case(adeye: Any, of_mini: Any, baseline: Path) -> None:
    assert adeye("gate", *of_mini, "--baseline", str(baseline), "--junit", "j.xml").code == 0
    assert etree.parse("j.xml").xpath("//failure | //error") == []


@pytest.mark.slow
def test_update_says_what_changed(adeye: Any, of_mini: Any, baseline: Path) -> None:
    honest = baseline.read_bytes()
    stricter(baseline)
    ended = adeye("gate", *of_mini, "--baseline", str(baseline), "--update").ok
    assert "margin: FSR-02" in ended.out
    assert "wrote b.json" in ended.err
    assert baseline.read_bytes() == honest


def test_wrong_options_are_refused(adeye: Any, of_mini: Any, baseline: Path) -> None:
    against = ["--baseline", str(baseline)]
    for options, said in (
        (["--update"], "Name its file with --baseline"),
        (["--tolerance", "m=1"], "Name its file with --baseline"),
        ([*against, "--accept-incomplete"], "Add --update"),
        ([*against, "--tolerance", "m"], "'m' is not NAME=SIZE"),
        ([*against, "--tolerance", "m=-1"], "is not NAME=SIZE"),
        ([*against, "--tolerance", "m=nan"], "is not NAME=SIZE"),
        ([*against, "--tolerance", "m=1", "--tolerance", "m=2"], "given twice"),
        (["nobody"], "nobody"),
    ):
        assert said in adeye("gate", *of_mini, *options).refused


def test_baseline_that_a_variable_leaves_empty_is_refused(
    adeye: Any, of_mini: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    for verb in ("gate", "report"):
        name = f"ADEYE_{verb.upper()}_BASELINE"
        monkeypatch.setenv(name, "")
        assert f"{name} is empty" in adeye(verb, *of_mini).refused


def test_baseline_of_other_verbs_is_said_to_be_none_of_the_gate(
    adeye: Any, of_mini: Any, baseline: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ADEYE_BASELINE", str(baseline))
    assert "Set ADEYE_GATE_BASELINE for that." in adeye("gate", *of_mini).err
    monkeypatch.setenv("ADEYE_GATE_BASELINE", str(baseline))
    assert "ADEYE_BASELINE" not in adeye("gate", *of_mini).err


def test_baseline_is_small_and_its_lines_are_short(baseline: Path) -> None:
    text = baseline.read_text("utf-8")
    assert len(text) < 200_000
    assert max(map(len, text.splitlines())) < 1_000
    assert json.loads(text)["schema"] == "adeye/baseline@1"


# --- ``check``: findings by rule with their place and remedy, JSON, SARIF, exit codes


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
    ended = adeye("check", ODD).ok
    about = "mini (no campaign of it is stored, so its evidence is not checked)"
    assert ended.out == f"{about}: no findings by 27 rules.\n"


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
    assert last.endswith("1 finding by 1 of 27 rules.")


@pytest.mark.slow
def test_json_and_sarif_have_the_findings(adeye: Any, project: Project) -> None:
    expire(project)
    ended = adeye("check", ODD, "--json", "--sarif", "check.sarif")
    assert ended.code == 1
    assert "wrote check.sarif" in ended.err
    log = json.loads(Path("check.sarif").read_text("utf-8"))
    assert [item["ruleId"] for item in log["runs"][0]["results"]] == ["expired_assumption"]
    document = ended.document
    assert (document["odd"], document["campaign"]) == ("mini", None)
    assert {"id", "view", "text", "remedy"} == set(document["rules"][0])
    (finding,) = document["findings"]
    assert finding["rule"] == "expired_assumption"
    assert finding["where"]["path"].endswith("motorway_chauffeur.yaml")


@pytest.mark.slow
def test_stored_campaign_is_named_by_its_number(adeye: Any, project: Project) -> None:
    plan = project.plan()
    with Repository.open(project.db) as repository:
        repository.plan_campaign(plan.record(), plan.planned())
    for arguments in ((), ("1",)):
        ended = adeye("check", *arguments, "--db", str(project.db))
        assert ended.code == 1
        assert (
            "not_run: Planned test cases, or twins with half the step, have no result" in ended.out
        )
        assert "cut_in: 12 of 12 test cases of camera_radar have no result" in ended.out
        assert ended.out.strip().endswith("by 1 of 35 rules.")


def test_nothing_to_check_is_no_success(adeye: Any) -> None:
    ended = adeye("check")
    assert (ended.code, ended.out) == (3, "")
    assert "Nothing to check" in ended.err


def test_campaign_that_there_is_not_is_an_input_error(adeye: Any, project: Project) -> None:
    Repository.open(project.db).close()
    assert "run an ODD first" in adeye("check", "7", "--db", str(project.db)).refused


def test_odd_that_there_is_not_is_an_input_error(adeye: Any) -> None:
    assert "odd/none.yaml: there is no such file" in adeye("check", "odd/none.yaml").refused


def test_illegal_decomposition_is_refused_with_its_line(adeye: Any, project: Project) -> None:
    with project.edited(CONCEPT) as content:
        step = {"requirement": "FSR-01", "into": ["FSR-07", "FSR-08"], "independence": "text"}
        content["decompositions"] = [step]
        for item in content["requirements"]:
            if item["id"] in {"FSR-07", "FSR-08"}:
                item["asil"] = "A(D)"
    said = adeye("check", ODD).refused
    assert "A(D) + A(D) is no decomposition of FSR-01 (D). Allowed: B(D) + B(D)" in said
    assert "motorway_chauffeur.yaml:" in said


# --- ``stale``: what it prints of a campaign


@pytest.mark.slow
def test_withdrawn_results_do_not_count(adeye: Any, mini: Executed, tmp_path: Path) -> None:
    db = tmp_path / "x.db"
    shutil.copy(mini.db, db)
    asked = ("stale", str(mini.project.odd), "--db", str(db), "--exit-code")
    assert adeye(*asked).code == 0
    with Repository.open(db) as repository:
        run = repository.find_run("0", campaign=repository.find_campaign().id)
        repository.evidence.withdraw(run.result_digest, author="J. Doe", reason="wrong map")
    found = adeye("stale", str(mini.project.odd), "--db", str(db), "--json").document
    assert found["counts"] < found["evidence"]
    assert found["now"]["there"] == found["counts"]
    assert [item["cause"] for item in found["stale"]] == ["withdrawn"]
    ended = adeye(*asked)
    assert (ended.code, "J. Doe: wrong map" in ended.out) == (3, True)
    assert adeye(*asked[:-1]).code == 0


@pytest.mark.parametrize(
    "change",
    ["UPDATE verdict SET verdict = 'PASS' WHERE verdict = 'VACUOUS'", "DELETE FROM verdict"],
)
@pytest.mark.parametrize(
    "verb",
    [
        *(("check",), ("stale",), ("export", "-o", "out"), ("confidence",), ("manifest", "write")),
        *(("matrix",), ("compare",), ("coverage",), ("faults",)),
    ],
)
def test_no_verb_hands_on_verdicts_that_are_not_as_they_were_written(
    verb: tuple[str, ...], change: str, adeye: Any, mini: Executed, folder: Path
) -> None:
    shutil.copy(mini.db, folder / "x.db")
    alter(folder / "x.db", change)
    asked = [*verb, str(mini.project.odd)] if verb == ("stale",) else verb
    done = adeye(*asked, "--db", "x.db")
    assert done.code == 4
    assert "the database is not as it was written: verdict " in done.err


@pytest.mark.parametrize("verb", ["run", "judge"])
@pytest.mark.parametrize(
    "change",
    [
        "UPDATE metric SET contact = 0.0 WHERE contact = 1.0",
        "UPDATE run SET end_reason = 'goal' WHERE number = 3",
    ],
)
def test_nothing_that_was_altered_is_taken_for_a_result(
    verb: str, change: str, adeye: Any, mini: Executed, folder: Path
) -> None:
    shutil.copy(mini.db, folder / "x.db")
    alter(folder / "x.db", change)
    done = adeye(verb, str(mini.project.odd), "--db", "x.db")
    assert done.code == 4
    assert "the database is not as it was written" in done.out + done.err


@pytest.mark.parametrize("verb", ["run", "judge"])
def test_verdict_that_is_gone_is_not_given_anew(
    verb: str, adeye: Any, mini: Executed, folder: Path
) -> None:
    shutil.copy(mini.db, folder / "x.db")
    alter(folder / "x.db", "DELETE FROM verdict WHERE run_number = 3")
    left = count_rows(folder / "x.db", "verdict")
    done = adeye(verb, str(mini.project.odd), "--db", "x.db")
    assert done.code == 4
    assert "is missing, though its block is done" in done.err
    assert count_rows(folder / "x.db", "verdict") == left


def test_report_of_evidence_that_is_gone_is_written_and_tells(
    adeye: Any, mini: Executed, folder: Path
) -> None:
    shutil.copy(mini.db, folder / "x.db")
    alter(folder / "x.db", "DELETE FROM verdict WHERE run_number = 3")
    done = adeye("report", "--db", "x.db", "--report-json", "r.json")
    assert (done.code, "is missing, though its block is done" in done.err) == (4, True)
    assert "is not as it was written" in json.loads((folder / "r.json").read_text())["message"]


ALTERED = {
    "margin": "UPDATE verdict SET margin = margin + 3, value = 1.25 WHERE margin IS NOT NULL",
    "threshold": "UPDATE concept SET content = replace(content, '\"at_most\":', '\"at_most\":9')",
    "severity": "UPDATE concept SET content = replace(content, '\"S3\"', '\"S1\"')",
    "metric": "UPDATE metric SET min_distance_m = 77.7 WHERE run_number = 3",
    "event": "UPDATE event SET time_s = time_s + 1.0 WHERE run_number = 3",
    "parameters": "UPDATE test_case SET parameters = replace(parameters, '0', '1')",
}
"""What the page of a report shows, in the words of SQL."""


@pytest.mark.parametrize(
    "change",
    [pytest.param(name, marks=pytest.mark.slow if name != "margin" else ()) for name in ALTERED],
)
def test_report_of_evidence_that_was_altered_is_written_and_tells(
    adeye: Any, mini: Executed, folder: Path, change: str
) -> None:
    shutil.copy(mini.db, folder / "x.db")
    with Repository.open(folder / "x.db", create=False) as repository:
        root = known(repository.evidence.root(repository.find_campaign().id)).root
    alter(folder / "x.db", ALTERED[change])
    files = (
        "--report-json",
        "r.json",
        "--junit",
        "r.xml",
        "--gsn",
        "r.json.mmd",
        "--sarif",
        "r.sarif",
    )
    done = adeye("report", "--db", "x.db", *files)
    assert (done.code, "is not as it was written" in done.err) == (4, True)
    told = json.loads((folder / "r.json").read_text())
    assert (told["exit_code"], told["evidence_digest"]) == (4, root)
    assert "is not as it was written" in told["message"]
    assert "is not as it was written" in (folder / "r.xml").read_text("utf-8")
    assert 'name="exit_code"' in (folder / "r.xml").read_text("utf-8")


@pytest.mark.parametrize(
    ("verb", "table"),
    [
        pytest.param(verb, table, marks=pytest.mark.slow if verb[0] == "r" and at else ())
        for verb in ("report --report-json r.json", "show RUN")
        for at, table in enumerate(
            ("concept", "fsr", "odd", "scenario", "architecture", "test_case")
        )
    ],
)
def test_content_that_is_gone_is_no_wrong_request(
    adeye: Any, mini: Executed, folder: Path, table: str, verb: str
) -> None:
    shutil.copy(mini.db, folder / "x.db")
    alter(folder / "x.db", f"DELETE FROM {table}")  # noqa: S608 - names of the test
    run = mini.project.rows()[0]["run"]
    done = adeye(*(run if word == "RUN" else word for word in verb.split()), "--db", "x.db")
    assert done.code == 4, done.err


def test_results_that_stay_without_a_trace_are_told(
    adeye: Any, mini: Executed, folder: Path
) -> None:
    shutil.copy(mini.db, folder / "x.db")
    done = adeye("run", str(mini.project.odd), "--db", "x.db", "--traces", "all", "--quiet")
    assert "no trace is kept now of 28 results that were there already" in done.err


def test_ordinal_proves_no_run(adeye: Any, mini: Executed) -> None:
    assert "run '0': not the beginning" in adeye("db", "prove", "0", "--db", str(mini.db)).refused


def test_stale_says_what_came_out_otherwise_for_a_certificate(
    adeye: Any, mini: Executed, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = "1 result came out otherwise"
    monkeypatch.setattr(Repository, "uncertified", lambda *_: said)
    ended = adeye("stale", str(mini.project.odd), "--db", str(mini.db))
    assert ended.code == 4
    assert ended.err == f"The gate answers 4: {said}\n"
    assert "still count" in ended.out


def test_nothing_is_stale_after_a_run(adeye: Any, mini: Executed) -> None:
    done = adeye("stale", str(mini.project.odd), "--db", str(mini.db)).ok
    found = adeye("stale", str(mini.project.odd), "--db", str(mini.db), "--json").document
    assert found["counts"] == found["evidence"] == found["now"]["there"] > 0
    assert found["stale"] == []
    assert f"{found['counts']:,} of {found['evidence']:,} verdicts still count" in done.out


def test_odd_without_campaign_is_an_input_error(adeye: Any, mini: Executed, tmp_path: Path) -> None:
    assert adeye("stale", str(mini.project.odd), "--db", str(tmp_path / "no.db")).refused


@pytest.mark.parametrize(
    "named",
    [
        "odd/tested.yaml",
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("tested.yaml", "")),
    ],
)
def test_copy_that_asked_for_what_was_there_is_not_taken_for_the_first(
    adeye: Any, mini: Executed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, named: str
) -> None:
    """Named from the project, from its folder ``odd``, or by an absolute path."""
    db, copy = str(tmp_path / "two.db"), tmp_path / "copy"
    shutil.copy(mini.db, db)
    shutil.copytree(mini.project.folder / "odd", copy / "odd")
    shutil.copytree(mini.project.folder / "scenarios_db", copy / "scenarios_db")
    monkeypatch.chdir(copy if named.startswith("odd") else copy / "odd")
    ended = adeye("run", named or str(copy / "odd/tested.yaml"), "--db", db, "--quiet")
    assert ended.code in {0, 1}
    with Repository.open(Path(db), create=False) as repository:
        campaign = repository.latest_campaign("mini")
        assert campaign is not None
        assert len(repository.evidence.sessions(campaign.id)) == 2
    for folder in (copy, copy / "odd", tmp_path):
        monkeypatch.chdir(folder)
        said = adeye("stale", "--exit-code", "--db", db).refused
        assert "Name the file of the ODD that you mean" in said
    assert adeye("stale", str(copy / "odd/tested.yaml"), "--exit-code", "--db", db).ok
    done = adeye("run", str(copy / "odd/tested.yaml"), "--db", db, "--quiet")
    assert "Executed nothing, all 28 results were there." in done.out
    with Repository.open(Path(db), create=False) as repository:
        assert len(repository.evidence.sessions(campaign.id)) == 2
