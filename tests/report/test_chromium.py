"""The page in a real browser: it plays, it obeys, it stays quiet."""

import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.report import page as pages
from adeye.report.model.report import Report
from adeye.report.page.html import write_html
from adeye.report.page.replay import Packed, pack_replay
from tests.report.browser import Browser
from tests.report.fake import build_report
from tests.stored import known

pytestmark = pytest.mark.chromium

TICK = "Number(document.getElementById('scrub').value)"
SELECTED = "document.querySelector('#runs [aria-selected=true]').dataset.run"


@pytest.fixture
def tab(browser: Browser, page: Path) -> Browser:
    browser.problems.clear()
    browser.requests.clear()
    browser.open(page)
    browser.wait(lambda: browser.run("document.getElementById('clock').textContent !== '0.00 s'"))
    return browser


def assert_quiet(tab: Browser, page: Path) -> None:
    assert tab.problems == []
    # The icon is an empty data address, which asks nobody.
    assert {url for url in tab.requests if not url.startswith("data:")} == {page.as_uri()}


def picture(tab: Browser, canvas: str) -> str:
    return str(tab.run(f"document.getElementById('{canvas}').toDataURL()"))


@pytest.mark.slow
def test_page_plays_a_run_without_an_error_or_a_request(tab: Browser, page: Path) -> None:
    before = picture(tab, "world"), picture(tab, "belief")
    assert tab.run(TICK) == 0
    tab.click("#play")
    tab.wait(lambda: tab.run(TICK) >= 10)
    first = tab.run(TICK)
    tab.wait(lambda: tab.run(TICK) > first + 5)
    tab.click("#play")
    stopped = tab.run(TICK)
    shown = f"{stopped * 0.05:.2f} / "
    assert str(tab.run("document.getElementById('clock').textContent")).startswith(shown)
    assert picture(tab, "world") != before[0]
    assert picture(tab, "belief") != before[1]
    assert_quiet(tab, page)


def test_playing_stops_at_the_end_and_starts_again_from_the_beginning(tab: Browser) -> None:
    tab.run("document.getElementById('speed').value = '4'")
    last = tab.run("Number(document.getElementById('scrub').max)")
    tab.run(f"scrub.value = {last - 3}; scrub.dispatchEvent(new Event('input'))")
    tab.click("#play")
    label = "document.getElementById('play').getAttribute('aria-label')"
    tab.wait(lambda: tab.run(label) == "Play")
    assert tab.run(TICK) == last
    tab.click("#play")
    tab.wait(lambda: 0 < tab.run(TICK) < last)


@pytest.mark.slow
def test_scrubbing_moves_views_plots_and_readouts_together(tab: Browser, page: Path) -> None:
    names = ["world", "belief", "strip"]
    before = [picture(tab, name) for name in names]
    plot = "document.querySelector('.plot canvas').toDataURL()"
    plotted, speed = tab.run(plot), tab.run("document.getElementById('now').textContent")
    tab.click(".strip input")
    middle = tab.run("Number(document.getElementById('scrub').max)") / 2
    assert tab.run(TICK) == pytest.approx(middle, abs=2)
    assert all(picture(tab, name) != old for name, old in zip(names, before, strict=True))
    assert tab.run(plot) != plotted
    assert tab.run("document.getElementById('now').textContent") != speed
    assert_quiet(tab, page)


@pytest.mark.slow
def test_keys_play_step_and_change_the_run(tab: Browser) -> None:
    tab.run("document.getElementById('replays').scrollIntoView()")
    tab.run("document.getElementById('player').focus()")
    tab.press("ArrowRight", "ArrowRight", 39)
    tab.press("ArrowRight", "ArrowRight", 39)
    tab.press("ArrowLeft", "ArrowLeft", 37)
    assert tab.run(TICK) == 1
    tab.press(" ", "Space", 32)
    tab.wait(lambda: tab.run(TICK) > 5)
    tab.press(" ", "Space", 32)
    assert tab.run("document.getElementById('play').getAttribute('aria-label')") == "Play"
    before = tab.run(SELECTED)
    tab.press("n", "KeyN", 78)
    assert tab.run(SELECTED) != before


def test_cell_opens_the_replay_of_its_worst_run(tab: Browser, report: Report) -> None:
    cell = known(report.cell("FSR-02", "camera_radar", "cut_in"))
    place = "[data-architecture=camera_radar][data-scenario=cut_in]"
    tab.click(f"#matrix tr:has([href='#fsr-2']) td{place} .cell")
    assert tab.run(SELECTED) == cell.worst_run
    # The binding predicate is at 4.35 s; the replay begins a second before it.
    assert tab.run(TICK) == 67
    detail = str(tab.run("document.getElementById('detail').textContent"))
    assert cell.command in detail
    assert "+0.48 m/s²" in detail


def test_event_seeks_to_its_time(tab: Browser) -> None:
    tab.click("#events li:nth-child(2) button")
    assert tab.run(TICK) == 36


def test_filter_leaves_what_it_asks_for(tab: Browser) -> None:
    tab.run(
        "filters.architecture.value = 'legacy_camera'; filters.verdict.value = 'FAIL';"
        "filters.dispatchEvent(new Event('change'))"
    )
    shown = (
        "[...document.querySelectorAll('#worst-table tbody tr')].filter(r => !r.hidden)"
        ".every(r => r.dataset.architecture === 'legacy_camera' && r.dataset.verdict === 'FAIL')"
    )
    assert tab.run(shown) is True
    runs = "[...document.querySelectorAll('#runs [data-replay]')].filter(b => !b.hidden).length"
    assert tab.run(runs) == 1
    tab.click("#reset")
    tab.wait(lambda: tab.run(runs) == 3)


@pytest.mark.slow
@pytest.mark.parametrize("width", [390, 800, 1400])
@pytest.mark.parametrize("dark", [False, True])
def test_page_fits_the_window_in_both_schemes(
    browser: Browser, page: Path, tmp_path: Path, width: int, *, dark: bool
) -> None:
    browser.open(page, width=width, dark=dark)
    assert browser.run("document.documentElement.scrollWidth <= window.innerWidth") is True
    # The player cuts off what is wider than it is.
    ends = "[...document.querySelectorAll('.run-head *')].map(e => e.getBoundingClientRect().right)"
    assert browser.run(f"Math.max(...{ends}) <= window.innerWidth") is True
    colour = browser.run("getComputedStyle(document.body).backgroundColor")
    assert (colour == "rgb(17, 20, 23)") is dark
    browser.run("document.getElementById('replays').scrollIntoView()")
    shot = tmp_path / "page.png"
    browser.screenshot(shot)
    assert struct.unpack(">II", shot.read_bytes()[16:24]) == (width, 1000)


@pytest.mark.slow
def test_names_are_text_and_never_run(browser: Browser, tmp_path: Path) -> None:
    text = "</script><img src=x onerror=alert(1)><script>window.owned=1</script>'\"{{7*7}}"
    path = tmp_path / "hostile.html"
    write_html(build_report(text), path)
    browser.problems.clear()
    browser.requests.clear()
    browser.open(path)
    for index in range(3):
        browser.click(f"[data-replay='{index}']")
        browser.click("#events li button")
    browser.click("#matrix .cell")
    browser.click("[data-command]")
    assert browser.run("typeof window.owned") == "undefined"
    assert browser.run("document.images.length") == 0
    assert text in str(browser.run("document.querySelector('h1').textContent"))
    key = json.dumps(f"nominal{text}")
    assert browser.run(f"document.getElementById('keys').textContent.includes({key})") is True
    assert_quiet(browser, path)


def test_grid_map_is_drawn_with_its_keys_and_can_be_hidden(tab: Browser, page: Path) -> None:
    keys = str(tab.run("document.getElementById('keys').textContent"))
    assert "cell rated 1, 3, 7 to stand on" in keys
    assert "occupied now, within 1, 4 s (as safety predicts)" in keys
    world, shown = picture(tab, "world"), picture(tab, "belief")
    tab.click("#show-grid")
    assert picture(tab, "belief") != shown
    assert picture(tab, "world") == world
    tab.click("#show-grid")
    assert picture(tab, "belief") == shown
    assert_quiet(tab, page)


def test_fan_is_drawn_with_its_key_and_can_be_hidden(tab: Browser, page: Path) -> None:
    tab.run("scrub.value = 30; scrub.dispatchEvent(new Event('input'))")
    shown = picture(tab, "belief")
    assert "candidate" in str(tab.run("document.getElementById('keys').textContent"))
    tab.click("#show-fan")
    hidden = picture(tab, "belief")
    assert hidden != shown
    tab.click("#show-fan")
    assert picture(tab, "belief") == shown
    assert_quiet(tab, page)


@pytest.mark.parametrize("dark", [False, True])
def test_argument_unfolds_and_scrolls_inside_of_its_box(
    browser: Browser, page: Path, *, dark: bool
) -> None:
    browser.problems.clear()
    browser.open(page, width=800, dark=dark)
    box = "document.querySelector('#argument .gsn')"
    browser.run(
        "document.querySelectorAll('details.fold').forEach((fold) => { fold.open = true; })"
    )
    assert browser.run(f"{box}.scrollWidth > {box}.clientWidth")
    assert browser.run(f"{box}.scrollHeight > {box}.clientHeight")
    # The page itself does not become wider than its window.
    root = "document.documentElement"
    assert browser.run(f"{root}.scrollWidth === {root}.clientWidth")
    assert browser.problems == []


def test_filter_leaves_the_timing_of_one_architecture(browser: Browser, page: Path) -> None:
    browser.open(page)
    shown = (
        "[...document.querySelectorAll('#timing-faults tbody tr')].filter((row) => !row.hidden)"
        ".map((row) => row.dataset.architecture).join()"
    )
    assert browser.run(shown) == "camera_radar,legacy_camera"
    browser.run(
        "filters.architecture.value = 'legacy_camera';"
        "filters.dispatchEvent(new Event('change', {bubbles: true}))"
    )
    assert browser.run(shown) == "legacy_camera"


def decoded(browser: Browser, raw: Packed) -> Any:
    """Return a replay as the page's script reads it."""
    source = (Path(pages.__file__).parents[1] / "web" / "decode.js").read_text("utf-8")
    plain = "(key, value) => ArrayBuffer.isView(value) ? Array.from(value) : value"
    script = (
        f"(() => {{ {source}; return JSON.stringify(decodeReplay({json.dumps(raw)}), {plain}) }})()"
    )
    return json.loads(str(browser.run(script)))


def lateral(replay: Any) -> Iterator[tuple[str, str]]:
    """Give what of a replay is positive to the left, but for tracks and grid: path and name."""
    yield from (("ego", name) for name in ("y", "heading", "steering"))
    lists = {"actors": ("y", "heading"), "boxes": ("y", "heading"), "boundaries": ("y",)}
    lists |= {"sensors": ("y", "yaw", "dy"), "channels": ("steering",)}
    for part, names in lists.items():
        yield from ((f"{part}.{at}", name) for at in range(len(replay[part])) for name in names)
    for part, inner in (("sensors", "points"), ("channels", "fan")):
        for at, item in enumerate(replay[part]):
            yield from [(f"{part}.{at}.{inner}", "y")] if item[inner] else []
    yield from [("shoulder", "y")] if replay["shoulder"] else []


def test_left_hand_traffic_is_drawn_as_it_is_in_the_world(browser: Browser, report: Report) -> None:
    raw = pack_replay(report.replays[0])
    mirror, world = (decoded(browser, {**raw, "left_hand": left}) for left in (False, True))
    for path, name in list(lateral(mirror)):
        before, after = (part_of(replay, path).pop(name) for replay in (mirror, world))
        np.testing.assert_array_equal(-np.array(before), np.array(after), f"{path}.{name}")
    for before, after in zip(mirror["channels"], world["channels"], strict=True):
        if before["tracks"]:
            tracks = [np.array(item["tracks"].pop("columns")) for item in (before, after)]
            np.testing.assert_array_equal(np.array([[1, -1, 1, -1, 1, 1]]).T * tracks[0], tracks[1])
    grid = raw["grid"]
    for name in ("number", "occupied"):
        cells = [
            np.array(replay["grid"].pop(name)).reshape(-1, grid["rows"], grid["columns"])
            for replay in (mirror, world)
        ]
        np.testing.assert_array_equal(cells[0][:, ::-1], cells[1])
    edges = [replay["grid"].pop("y_m") for replay in (mirror, world)]
    assert edges[1] == pytest.approx(-edges[0] - grid["rows"] * grid["cell_m"])
    np.testing.assert_allclose(-np.array(mirror.pop("camera")), world.pop("camera"), atol=1e-12)
    # All else stays.
    assert {**world, "left_hand": False} == mirror


def part_of(replay: Any, path: str) -> Any:
    for name in path.split("."):
        replay = replay[int(name) if name.isdigit() else name]
    return replay
