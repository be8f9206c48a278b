"""The page of sensor suites: its tables, charts and figures."""

import base64
import hashlib
from pathlib import Path
from typing import Any

import pytest
from lxml import html as lxml_html

from adeye.analysis.suite.analyse import analyse
from adeye.analysis.suite.records import Suite
from adeye.report.page.html import render_suites, write_suites
from adeye.report.page.suites import suite_views
from tests.analysis.suite.rigs import BUMPER, all_around, architecture, radar
from tests.report.browser import Browser

CAMERA: dict[str, Any] = {
    "kind": "camera",
    "mount": BUMPER,
    "field_of_view": 0.7,
    "range": 80.0,
    "rate": 20.0,
    "night_range": 0.4,
    "realises": "camera",
}


def suite(**options: Any) -> Suite:
    sensors = {
        "camera": CAMERA,
        "eye": radar(),
        "truth": {"kind": "ground_truth", "rate": 20.0},
    }
    return analyse(architecture(sensors), **options)


def tables(found: Suite) -> dict[str, list[list[str]]]:
    """Read the tables of the page of a suite, head first, by their label."""
    tree = lxml_html.document_fromstring(render_suites([found]))
    return {
        table.get("aria-label"): [
            [cell.text_content() for cell in row.xpath("th | td")] for row in table.iter("tr")
        ]
        for table in tree.iter("table")
    }


def test_rows_are_as_long_as_their_heads() -> None:
    found = tables(suite())
    assert len(found) == 5
    for heads, *rows in found.values():
        assert rows
        assert {len(row) for row in rows} == {len(heads)}


def test_every_condition_has_its_row_and_the_reference_its_drawing() -> None:
    found = suite()
    assert [row[0] for row in tables(found)["Highest speed"][1:]] == ["dry_day", "rain", "night"]
    (view,) = suite_views([found])
    assert [item.id for item in view.ends[: len(view.pictures)]] == ["dry_day"]


def test_worst_condition_is_drawn_beside_the_reference_on_request() -> None:
    alone = analyse(architecture({"camera": CAMERA}))
    (view,) = suite_views([alone], every=True)
    assert [item.id for item in view.ends] == ["dry_day", "night"]
    assert len(view.pictures) == 2
    assert {"Zones in dry_day", "Zones in night"} <= tables(alone).keys()


def test_sensors_that_were_left_out_stand_below_the_others() -> None:
    rows = tables(suite())["Sensors"][1:]
    assert [row[0] for row in rows] == ["camera", "eye", "truth"]
    assert rows[-1][2] == "not analysed: no devices"


def test_critical_sensor_is_named_in_every_condition() -> None:
    found = tables(suite())
    assert {row[-1].partition("(")[2] for row in found["Highest speed"][1:]} == {"eye)"}
    assert any(row[0] == "eye, critical" for row in found["Loss of parts"])


def test_suite_without_a_critical_sensor_says_so() -> None:
    twins = analyse(architecture({"one": all_around(), "other": all_around()}))
    assert {row[-1] for row in tables(twins)["Highest speed"][1:]} == {"\N{EN DASH}"}


def test_no_suites_are_no_views() -> None:
    assert suite_views([]) == ()


def test_element_of_several_sensors_is_a_row_of_its_own() -> None:
    pair = {"one": radar(realises="radars"), "other": radar(range=50.0, realises="radars")}
    rows = tables(analyse(architecture(pair)))["Loss of parts"]
    assert ["element radars", "one, other"] in [row[:2] for row in rows]


def test_range_of_a_sensor_with_a_blind_zone_has_two_ends() -> None:
    near = {
        "kind": "ultrasonic", "mount": BUMPER, "field_of_view": 1.0, "range": 5.0, "rate": 20.0,
        "blind_zone": 0.25,
    }  # fmt: skip
    blind = {**CAMERA, "kind": "lidar", "fidelity": "physical", "range": 80.0, "drop_out": 1.0}
    blind.pop("night_range")
    rows = tables(analyse(architecture({"near": near, "poor": blind})))["Sensors"][1:]
    assert [row[3] for row in rows] == ["0.2 to 5.0 m", "none"]


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


def test_each_suite_has_drawings_and_tables_and_tells_what_it_shows(tree: Any) -> None:
    sections = tree.xpath("//section[contains(@class, 'suite')]")
    assert len(sections) == 2
    for section in sections:
        assert len(section.xpath(".//svg[contains(@class, 'suite-drawing')]")) >= 2
        assert len(section.xpath(".//table")) >= 5
    labels = tree.xpath("//svg[@role='img']/@aria-label")
    assert labels
    assert all("fields of view" in label for label in labels)
    assert "Each target stands alone" in tree.text_content()


def test_text_of_a_file_changes_no_element() -> None:
    payload = "</style><script>alert(1)</script><svg onload='x'>"

    def shape(text: str) -> list[str]:
        return [str(node.tag) for node in lxml_html.document_fromstring(text).iter()]

    assert shape(page(payload, title=payload)) == shape(page("x", title="x"))


def test_same_suites_give_the_same_bytes_in_a_file_that_is_written_whole(tmp_path: Path) -> None:
    assert page() == page()
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
