"""The page: no text changes its markup, nothing of others is in it, and what it shows."""

import base64
import hashlib
import re
from pathlib import Path
from typing import Any

import pytest
from lxml import html as lxml_html

from adeye.analysis.dependence import Dependencies
from adeye.errors import PlatformError
from adeye.report.model.report import Report
from adeye.report.page.html import SCRIPTS, STYLES, assets, render, write_html
from tests.report.fake import build_report
from tests.report.pages import section

PAYLOADS = [
    f"{opening}{body}"
    for opening in (
        *("", '">', "'>", "</script>", "</style>", "</title>", "-->", "]]>", "&quot;>", "{{"),
    )
    for body in (
        "<script>alert(1)</script>",
        "<img src=x onerror=alert(1)>",
        "<svg/onload=alert(1)>",
        "' onmouseover='alert(1)",
        '" autofocus onfocus="alert(1)',
        "javascript:alert(1)",
        "<!--<script>",
        "{{ 7 * 7 }}{% raw %}",
        "\u2028\u2029<iframe srcdoc=x>",
        "&lt;b&gt;&#60;b&#62;<base href=//x>",
    )
]  # fmt: skip


def shape(page: str) -> list[tuple[str, tuple[str, ...]]]:
    """List every element with the names of its attributes: what markup can change.

    The goal structure breaks its texts into lines, so that a longer one has more of them: of it,
    only the kinds of elements are listed.
    """
    tree = lxml_html.document_fromstring(page)
    [drawing] = tree.xpath("//div[@class='gsn']")
    kinds = sorted({(str(node.tag), tuple(sorted(node.attrib))) for node in drawing.iter()})
    drawing.clear()
    return kinds + [(str(node.tag), tuple(sorted(node.attrib))) for node in tree.iter()]


@pytest.fixture(scope="module")
def tree(report: Report) -> Any:
    return lxml_html.document_fromstring(render(report))


@pytest.fixture(scope="module")
def small() -> list[tuple[str, tuple[str, ...]]]:
    return shape(render(build_report("x", rows=4, replays=1)))


@pytest.mark.slow
def test_no_payload_in_any_text_changes_an_element(
    small: list[tuple[str, tuple[str, ...]]],
) -> None:
    assert len(set(PAYLOADS)) == 100
    for payload in PAYLOADS:
        page = render(build_report(payload, rows=4, replays=1))
        assert shape(page) == small, payload
        assert payload in lxml_html.document_fromstring(page).findtext(".//h1")


def test_policy_allows_the_shipped_script_and_style_only(tree: Any) -> None:
    policy = tree.xpath("//meta[@http-equiv='Content-Security-Policy']/@content")[0]
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules["default-src"] == "'none'"
    for rule, place in (("script-src", "//script[not(@type)]"), ("style-src", "//style")):
        (node,) = tree.xpath(place)
        wanted = base64.b64encode(hashlib.sha256(node.text.encode()).digest()).decode()
        assert rules[rule] == f"'sha256-{wanted}'"
    assert "unsafe" not in policy


def test_page_has_no_inline_style_or_handler(tree: Any) -> None:
    names = {name for node in tree.iter() for name in node.attrib}
    assert "style" not in names
    assert not {name for name in names if name.startswith("on")}


def test_page_names_no_address(report: Report) -> None:
    page = render(report)
    assert (
        re.findall(r"https?:|(?<![\w/])//[a-z]|url\(|@import", page.replace("sqlite:///", "")) == []
    )
    tree = lxml_html.document_fromstring(page)
    targets = {str(value) for value in tree.xpath("//@href | //@src")}
    assert {target for target in targets if not target.startswith("#")} == {"data:,"}


def test_script_makes_elements_from_text_only() -> None:
    script, style = assets()
    for word in ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval("):
        assert word not in script
    assert "</script" not in script
    assert "<!--" not in script
    assert "</style" not in style


def test_every_asset_is_in_the_page() -> None:
    folder = Path(__file__).resolve().parents[3] / "adeye" / "report" / "web"
    files = {path.name for path in folder.iterdir() if path.suffix in {".js", ".css"}}
    assert files == {*SCRIPTS, *STYLES}
    for name in files:
        assert len((folder / name).read_text("utf-8").splitlines()) <= 400


def test_links_lead_to_something_on_the_page(tree: Any) -> None:
    identifiers = tree.xpath("//@id")
    assert len(identifiers) == len(set(identifiers))
    links = {href.removeprefix("#") for href in tree.xpath("//a/@href")}
    assert links <= set(identifiers)


def test_same_report_gives_the_same_page() -> None:
    assert render(build_report()) == render(build_report())


def test_every_cell_and_worst_case_carries_a_command(tree: Any, report: Report) -> None:
    cells = tree.xpath("//*[@id='matrix']//button")
    assert len(cells) == len(report.fsrs) * 3 * 4
    assert all("adeye replay r" in cell.get("title") for cell in cells)
    runs = tree.xpath("//*[@id='worst-table']//button/@data-command")
    assert runs == [case.command for case in report.worst_cases]
    numbers = tree.xpath("//*[@id='metrics-table']//button/@data-command")
    assert len(numbers) == 3 * len(report.metrics)


def test_headline_says_gate_exit_code_and_counts(tree: Any) -> None:
    text = " ".join(" ".join(tree.xpath("//*[@id='summary']")[0].itertext()).split())
    for words in ("Gate PASS", "Exit code 0 all good", "planned 540", "accounted for 540"):
        assert words in text


@pytest.mark.slow
def test_page_keeps_to_its_size_and_lists_what_it_left_out(report: Report) -> None:
    full = render(report)
    limit = len(full.encode()) - 1000
    page = render(report, max_bytes=limit)
    assert len(page.encode()) <= limit
    tree = lxml_html.document_fromstring(page)
    assert len(tree.xpath("//script[starts-with(@id, 'replay-')]")) == 2
    left_out = tree.xpath("//*[@id='replays']//ul[@class='commands']//button/@data-command")
    assert left_out == [report.replays[2].command]


@pytest.mark.slow
def test_twenty_long_replays_fit() -> None:
    one = build_report(rows=500).replays[1]
    replays = tuple(one.model_copy(update={"run": f"run{number}"}) for number in range(20))
    page = render(build_report(replays=0).model_copy(update={"replays": replays}))
    assert page.count('<script type="application/json" id="replay-') == 20
    assert len(page.encode()) < 3_000_000


def test_report_without_runs_still_has_its_tables() -> None:
    page = render(build_report(replays=0))
    assert "This report embeds no run." in page
    assert 'id="matrix"' in page


def test_missing_cell_is_shown_as_not_run(report: Report) -> None:
    cells = tuple(cell for cell in report.cells if cell.architecture != "lidar")
    tree = lxml_html.document_fromstring(render(report.model_copy(update={"cells": cells})))
    lidar = tree.xpath("//*[@id='matrix']//td[@data-architecture='lidar']/@data-verdict")
    assert set(lidar) == {"NOT_RUN"}


@pytest.mark.slow
def test_written_file_is_the_page_and_one_that_cannot_be_written_a_platform_error(
    report: Report, tmp_path: Path
) -> None:
    path = tmp_path / "new" / "report.html"
    write_html(report, path)
    assert path.read_text("utf-8") == render(report)
    assert list(path.parent.iterdir()) == [path]
    with pytest.raises(PlatformError, match=r"cannot write .*below\.html"):
        write_html(report, path / "below.html")


def test_suite_of_each_architecture_has_one_drawing_and_one_table(tree: Any) -> None:
    (suite,) = tree.xpath("//*[@id='sensors']//article[contains(@class, 'suite')]")
    assert suite.get("data-architecture") == "camera_radar"
    assert len(suite.xpath(".//figure")) == 1
    assert len(suite.xpath(".//table")) == 1
    assert "front_radar" in suite.text_content()


def test_report_has_no_section_for_suites_or_shared_things_that_there_are_not(
    report: Report,
) -> None:
    alone = Dependencies("camera_radar", "", ())
    page = render(report.model_copy(update={"suites": (), "dependencies": (alone,)}))
    for name in ("sensors", "dependencies"):
        assert f'id="{name}"' not in page
        assert f'href="#{name}"' not in page


def test_what_channels_share_is_a_table_for_each_pair(tree: Any) -> None:
    (table,) = tree.xpath("//*[@id='dependencies']//table")
    (row,) = table.xpath(".//tbody/tr")
    assert [cell.text_content().split() for cell in row.xpath("td")] == [
        ["code"],
        ["planner.py"],
        [],
        ["channels.a"],
    ]
    assert "no resources for sensors.truth" in table.getparent().getparent().text_content()


def test_where_an_fsr_fails_is_a_table_of_signs_and_counts(report: Report) -> None:
    text = section(report, "where")
    assert "gap <= 30 m holds 11 of 11 failures and 2 of 49 passes." in text
    for words in (
        "gap ↓ · ego_speed → · margins in m/s²",
        "✕ 1/15 +2? \N{MINUS SIGN}0.20 ✕ 10/10 \N{MINUS SIGN}1.61",
        "✓ 0/15 +0.80 –",
    ):
        assert words in text
    assert "ego_speed has 3 more values" in text
    assert "gap has" not in text
    assert "Nothing passes" in text
    assert "2 more pairs of architecture and scenario" in text
    page = lxml_html.document_fromstring(render(report.model_copy(update={"failing": None})))
    assert not page.xpath("//*[@id='where'] | //a[@href='#where']")
