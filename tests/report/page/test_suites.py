"""The page of sensor suites: its tables, charts and figures."""

import base64
import hashlib
from pathlib import Path
from typing import Any

import pytest
from lxml import html as lxml_html

from adeye.analysis.suite.analyse import analyse
from adeye.analysis.suite.records import Suite
from adeye.report.page import suites
from adeye.report.page.html import render_suites, write_suites
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


def view(**options: Any) -> suites.SuiteView:
    return suites.suite_views([suite(**options)])[0]


def test_rows_are_as_long_as_their_heads() -> None:
    found = view()
    tables = [
        (suites.SPEED_HEADS, found.speeds),
        (suites.LOSS_HEADS, found.losses),
        (suites.SENSOR_HEADS, found.sensors),
        (found.slack_heads, found.slacks),
        *((suites.ZONE_HEADS, rows) for _, rows in found.zones),
    ]
    for heads, rows in tables:
        assert rows
        assert {len(row) for row in rows} == {len(heads)}


def test_every_condition_has_its_row_and_the_reference_its_drawing() -> None:
    found = view()
    assert [row[0] for row in found.speeds] == ["dry_day", "rain", "night"]
    assert [picture.condition for picture in found.pictures] == ["dry_day"]
    # The worst condition is drawn beside it on request.
    found = suites.suite_views([analyse(architecture({"camera": CAMERA}))], every=True)[0]
    assert [picture.condition for picture in found.pictures] == ["dry_day", "night"]
    assert [name for name, _ in found.zones] == ["dry_day", "night"]
    assert suites.suite_views([]) == ()


def test_sensors_that_were_left_out_stand_below_the_others() -> None:
    rows = view().sensors
    assert [row[0] for row in rows] == ["camera", "eye", "truth"]
    assert rows[-1][2] == "not analysed: no devices"


def test_critical_sensor_is_named_in_every_condition_or_that_there_is_none() -> None:
    assert {row[-1].partition("(")[2] for row in view().speeds} == {"eye)"}
    assert any(row[0] == "eye, critical" for row in view().losses)
    twins = analyse(architecture({"one": all_around(), "other": all_around()}))
    assert {row[-1] for row in suites.suite_views([twins])[0].speeds} == {"\N{EN DASH}"}


def test_element_of_several_sensors_is_a_row_of_its_own() -> None:
    pair = {"one": radar(realises="radars"), "other": radar(range=50.0, realises="radars")}
    rows = suites.suite_views([analyse(architecture(pair))])[0].losses
    assert ("element radars", "one, other") in {row[:2] for row in rows}


def test_range_of_a_sensor_with_a_blind_zone_has_two_ends() -> None:
    near = {
        "kind": "ultrasonic", "mount": BUMPER, "field_of_view": 1.0, "range": 5.0, "rate": 20.0,
        "blind_zone": 0.25,
    }  # fmt: skip
    blind = {**CAMERA, "kind": "lidar", "fidelity": "physical", "range": 80.0, "drop_out": 1.0}
    blind.pop("night_range")
    rows = suites.suite_views([analyse(architecture({"near": near, "poor": blind}))])[0].sensors
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


@pytest.mark.slow
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
