"""``gate``: what is printed, the document, JUnit, options that do not go together."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from lxml import etree

from adeye.report.gate.baseline import baseline_text, read_baseline

if TYPE_CHECKING:
    from tests.project import Executed


@pytest.fixture
def db(folder: Path, mini: Executed) -> tuple[str, str]:
    assert folder.is_dir()
    return "--db", str(mini.db)


@pytest.fixture
def baseline(adeye: Any, db: tuple[str, str]) -> Path:
    assert adeye("gate", *db, "--baseline", "b.json", "--update").code == 0
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
    parts = (part.model_copy(update={"rows": rows}),)
    others = tuple(item for item in found.cases if item is not part)
    path.write_text(baseline_text(found.model_copy(update={"cases": parts + others})), "utf-8")


@pytest.mark.slow
def test_campaign_alone_and_against_its_own_baseline(
    adeye: Any, db: tuple[str, str], baseline: Path
) -> None:
    alone = adeye("gate", *db)
    assert (alone.code, alone.err) == (0, "")
    assert "Every mandatory requirement passes for camera_radar." in alone.out
    against = adeye("gate", *db, "--baseline", str(baseline))
    assert against.code == 0
    assert "Nothing differs from the baseline." in against.out


@pytest.mark.slow
def test_loss_of_margin_is_printed_and_decides(
    adeye: Any, db: tuple[str, str], baseline: Path
) -> None:
    stricter(baseline)
    ended = adeye("gate", *db, "--baseline", str(baseline))
    assert ended.code == 1
    lines = ended.out.splitlines()
    at = lines.index("Decides:")
    assert lines[at + 1].startswith("  margin: FSR-02, camera_radar, ")
    assert lines[at + 2].startswith("    adeye show ")
    assert lines[-1] == "Exit code 1 (an FSR failed or regressed)."
    tolerated = adeye("gate", *db, "--baseline", str(baseline), "--tolerance", "FSR-02=100")
    assert tolerated.code == 0


@pytest.mark.slow
def test_document_and_junit_say_the_same(adeye: Any, db: tuple[str, str], baseline: Path) -> None:
    stricter(baseline)
    ended = adeye("gate", *db, "--baseline", str(baseline), "--json", "--junit", "j.xml")
    document = ended.document
    assert document["schema"] == "adeye/gate@1"
    assert document["exit_code"] == ended.code == 1
    (finding,) = document["findings"]
    assert (finding["kind"], finding["decides"], finding["fsr"]) == ("margin", True, "FSR-02")
    suites = etree.parse("j.xml").xpath("testsuite[@name='gate']")
    red = {case.get("name"): case[0].tag for case in suites[0].iter("testcase") if len(case)}
    assert set(red.values()) == {"failure"}
    assert len(red) == 2


@pytest.mark.slow
def test_green_gate_has_no_red_case(adeye: Any, db: tuple[str, str], baseline: Path) -> None:
    assert adeye("gate", *db, "--baseline", str(baseline), "--junit", "j.xml").code == 0
    assert etree.parse("j.xml").xpath("//failure | //error") == []


@pytest.mark.slow
def test_update_says_what_changed_and_is_green_afterwards(
    adeye: Any, db: tuple[str, str], baseline: Path
) -> None:
    honest = baseline.read_bytes()
    stricter(baseline)
    ended = adeye("gate", *db, "--baseline", str(baseline), "--update")
    assert ended.code == 0
    assert "margin: FSR-02" in ended.out
    assert "wrote b.json" in ended.err
    assert baseline.read_bytes() == honest


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--update"], "Name its file with --baseline"),
        (["--tolerance", "m=1"], "Name its file with --baseline"),
        (["--baseline", "b.json", "--accept-incomplete"], "Add --update"),
        (["--baseline", "b.json", "--tolerance", "m"], "'m' is not NAME=SIZE"),
        (["--baseline", "b.json", "--tolerance", "m=-1"], "is not NAME=SIZE"),
        (["--baseline", "b.json", "--tolerance", "m=nan"], "is not NAME=SIZE"),
        (["--baseline", "b.json", "--tolerance", "m=1", "--tolerance", "m=2"], "given twice"),
        (["nobody"], "nobody"),
    ],
)
def test_wrong_options_are_refused(
    adeye: Any, db: tuple[str, str], baseline: Path, options: list[str], said: str
) -> None:
    assert baseline.exists()
    ended = adeye("gate", *db, *options)
    assert ended.code == 2
    assert said in ended.err


def test_baseline_is_small_and_its_lines_are_short(baseline: Path) -> None:
    text = baseline.read_text("utf-8")
    assert len(text) < 200_000
    assert max(map(len, text.splitlines())) < 1_000
    assert json.loads(text)["schema"] == "adeye/baseline@1"
