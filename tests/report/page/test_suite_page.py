"""The page of suites: closed against the network and scripts, texts escaped, readable as drawn."""

import base64
import hashlib
from pathlib import Path
from typing import Any

import pytest
from lxml import html as lxml_html

from adeye.analysis.suite.analyse import analyse
from adeye.report.page.html import render_suites, write_suites
from tests.analysis.suite.rigs import all_around, architecture, radar
from tests.report.browser import Browser


def page(odd: str = "Some ODD", **changes: Any) -> str:
    first = architecture({"eye": radar()}, **changes)
    second = architecture({"roof": all_around(range=60.0)}, architecture="second")
    return render_suites([analyse(first), analyse(second)], title=odd)


@pytest.fixture(scope="module")
def tree() -> Any:
    return lxml_html.document_fromstring(page())


def test_page_runs_no_script_and_loads_nothing(tree: Any) -> None:
    assert tree.xpath("//script | //img | //iframe | //object | //@onclick | //@style") == []
    (policy,) = tree.xpath("//meta[@http-equiv='Content-Security-Policy']/@content")
    assert "default-src 'none'" in policy
    assert "script-src" not in policy
    (style,) = tree.xpath("//style/text()")
    digest = base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()
    assert f"style-src 'sha256-{digest}'" in policy


def test_each_suite_has_drawings_and_tables(tree: Any) -> None:
    sections = tree.xpath("//section[contains(@class, 'suite')]")
    assert len(sections) == 2
    for section in sections:
        assert len(section.xpath(".//svg[contains(@class, 'suite-drawing')]")) >= 2
        assert len(section.xpath(".//table")) >= 5


def test_drawing_tells_in_words_what_it_shows(tree: Any) -> None:
    labels = tree.xpath("//svg[@role='img']/@aria-label")
    assert labels
    assert all("fields of view" in label for label in labels)


def test_what_is_left_out_is_told(tree: Any) -> None:
    assert "Each target stands alone" in tree.text_content()


@pytest.mark.slow
def test_text_of_a_file_changes_no_element() -> None:
    payload = "</style><script>alert(1)</script><svg onload='x'>"

    def shape(text: str) -> list[str]:
        return [str(node.tag) for node in lxml_html.document_fromstring(text).iter()]

    assert shape(page(payload, title=payload)) == shape(page("x", title="x"))


def test_same_suites_give_the_same_bytes() -> None:
    assert page() == page()


def test_page_is_written_whole(tmp_path: Path) -> None:
    path = tmp_path / "new" / "suites.html"
    write_suites([analyse(architecture({"eye": radar()}))], path)
    assert path.read_text("utf-8").endswith("</html>")


@pytest.mark.slow
@pytest.mark.chromium
@pytest.mark.parametrize("width", [1400, 380])
@pytest.mark.parametrize("dark", [False, True])
def test_page_fits_its_window(browser: Browser, tmp_path: Path, width: int, *, dark: bool) -> None:
    path = tmp_path / "suites.html"
    path.write_text(page(), encoding="utf-8")
    browser.problems.clear()
    browser.open(path, width=width, dark=dark)
    assert browser.problems == []
    assert browser.run("document.documentElement.scrollWidth <= window.innerWidth")
    fills = browser.run(
        "(() => { const c = (s) => getComputedStyle(document.querySelector(s));"
        " return [c('path.seen').fill, c('path.k-radar').strokeDasharray,"
        " c('path.ego').fill, c('.suite-scroll').backgroundColor]; })()"
    )
    assert fills[1] != "none"
    assert fills[2] != fills[3]
