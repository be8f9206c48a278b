"""What one report is in each of its forms: the page, its parts, and the files for other programs.

Each is pinned whole, so that nothing in it changes unseen.
"""

import csv
import io
import json
import re
from typing import Any

import pytest

from adeye.analysis.suite.analyse import analyse
from adeye.report.comparison.records import Cost
from adeye.report.formats import gsn
from adeye.report.formats.json import render_json
from adeye.report.formats.junit import render_junit
from adeye.report.formats.matrix import BY, matrix_of, render_csv
from adeye.report.formats.reqif import render_reqif
from adeye.report.formats.sarif import render_sarif
from adeye.report.formats.signals import Drawing, draw_signals
from adeye.report.model.report import Report
from adeye.report.page.html import render, render_comparison, render_suites
from adeye.report.page.replay import SignalPlot, ThresholdLine
from adeye.version import __version__
from tests.analysis.suite.rigs import BUMPER, all_around, architecture, radar
from tests.frozen import as_json, assert_frozen, described, thinned
from tests.project import Executed
from tests.report.fake import build_report
from tests.report.parts import candidate, comparison


def laid_out(page: str) -> str:
    """Give a page without its styles and scripts, a tag a line, and a row of a table whole."""
    page = re.sub(r"<(style|script)\b([^>]*)>.*?</\1>", r"<\1\2></\1>", page, flags=re.DOTALL)
    page = re.sub(r"sha256-[\w+/=]*", "sha256-", page.replace(__version__, "VERSION"))
    page = re.sub(r">\s+<", "><", page)
    page = re.sub(r"><(?!/?(?:t[dhr]|span|b|i|a|code|small|abbr)\b)|><(?=tr\b)", ">\n<", page)
    lines = (line.strip() for line in page.splitlines())
    return "\n".join([line for line in lines if line])


@pytest.fixture(scope="module")
def small() -> Report:
    return build_report(rows=40, replays=1)


@pytest.fixture(scope="module")
def page(small: Report) -> str:
    return render(small)


def test_page_is_frozen(page: str) -> None:
    assert_frozen("report.html", laid_out(page))


@pytest.mark.parametrize("name", ["details", "replay-0"])
def test_what_the_page_hands_to_its_script_is_frozen(page: str, name: str) -> None:
    pattern = rf'<script type="application/json" id="{name}">(.*?)</script>'
    [found] = re.findall(pattern, page, flags=re.DOTALL)
    assert_frozen(f"page_{name}.json", as_json(thinned(json.loads(found), 12)))


def test_comparison_is_frozen() -> None:
    three = comparison(
        candidates=(
            candidate("camera_radar", failing=1),
            candidate("a_candidate_with_a_long_name", failing=9, cases=40),
            candidate("twin", failing=2, cost=Cost(total=410.5, declared=400.0, parts={"x": 10.5})),
        ),
        pairs=(),
        cheapest=(),
    )
    for name, shown in (("three", three), ("stored", comparison())):
        assert_frozen(f"comparison_{name}.html", laid_out(render_comparison(shown)))


SENSORS: dict[str, Any] = {
    "camera": {
        "kind": "camera", "mount": {**BUMPER, "x": 1.9, "z": 1.3}, "field_of_view": 0.9,
        "range": 90.0, "rate": 20.0, "latency": 0.05, "night_range": 0.45, "realises": "camera",
    },
    "radar": radar(realises="radars"),
    "corner": radar(
        mount={"x": 2.2, "y": 0.8, "z": 0.6, "yaw": 0.9}, field_of_view=2.4, range=70.0, rate=12.5,
        realises="radars",
    ),
    "lidar": {**all_around(range=110.0), "kind": "lidar", "latency": 0.08},
    "park": {
        "kind": "ultrasonic", "mount": {**BUMPER, "y": 0.4}, "field_of_view": 1.1, "range": 5.0,
        "rate": 20.0, "blind_zone": 0.25,
    },
    "truth": {"kind": "ground_truth", "rate": 20.0},
}  # fmt: skip


def test_sensor_suites_are_frozen() -> None:
    """One of five kinds of sensors, and one of a single radar, which looks aside."""
    aside = {"eye": radar(mount={"x": -2.4, "y": -0.9, "z": 0.7, "yaw": -2.6}, range=80.0)}
    found = [
        analyse(architecture(SENSORS)),
        analyse(architecture(aside, architecture="aside", title="A <b> & c")),
    ]
    assert_frozen("suites.html", laid_out(render_suites(found, title="Some ODD")))


PHYSICAL: dict[str, Any] = {
    "pixels": {
        "kind": "camera", "fidelity": "physical", "mount": {**BUMPER, "z": 1.2}, "rate": 20.0,
        "field_of_view": 1.2, "columns": 640, "rows": 240,
    },
    "cells": {
        "kind": "radar", "fidelity": "physical", "mount": BUMPER, "rate": 20.0, "range": 120.0,
        "field_of_view": 1.0,
    },
    "layers": {
        "kind": "lidar", "fidelity": "physical", "mount": {**BUMPER, "z": 1.7}, "rate": 10.0,
        "field_of_view": 2.0, "range": 90.0, "beams": 400, "layers": 16,
        "vertical_field_of_view": 0.35, "drop_out": 0.1,
    },
    "line": {
        "kind": "lidar", "fidelity": "physical", "mount": BUMPER, "rate": 10.0,
        "field_of_view": 3.5, "range": 60.0, "beams": 300,
    },
}  # fmt: skip


def test_suite_of_physical_sensors_is_frozen() -> None:
    """Pixels, cells, beams in layers and in one, of which some drop out."""
    found = analyse(architecture(PHYSICAL))
    assert_frozen("suite_physical.html", laid_out(render_suites([found])))
    assert_frozen("suite_physical.txt", "\n".join([*described(found), ""]))


def test_json_is_frozen(report: Report) -> None:
    content = json.loads(render_json(report))
    content["cells"] = content["cells"][::5]
    content.pop("suites")
    assert_frozen("report.json", as_json(thinned(content)))


def test_argument_is_frozen(report: Report) -> None:
    argument = gsn.argument_of(report)
    assert_frozen("argument.svg", gsn.render_svg(argument))
    assert_frozen("argument.mmd", gsn.render_mermaid(argument))
    assert_frozen("argument.json", gsn.render_gsn_json(argument).replace(__version__, "VERSION"))


def test_files_for_other_programs_are_frozen(report: Report) -> None:
    alone = report.model_copy(update={"impact": None})
    for name, content in (
        ("junit.xml", render_junit(alone)),
        ("requirements.reqif", render_reqif(alone)),
        ("report.sarif", render_sarif(alone)),
    ):
        assert_frozen(name, content.decode().replace(__version__, "VERSION"))


def test_matrix_is_frozen_and_each_order_has_its_first_row(report: Report) -> None:
    text = render_csv(matrix_of(report), "hazard").replace("\r\n", "\n")
    assert_frozen("matrix.csv", text)
    firsts = [
        [by, *list(csv.reader(io.StringIO(render_csv(matrix_of(report, by), by))))[at]]
        for by in BY
        for at in (0, 1, 2, -1)
    ]
    assert_frozen("matrix_orders.txt", "\n".join(" | ".join(row) for row in firsts) + "\n")


def test_drawn_signals_are_frozen() -> None:
    """Gaps, a cap, limits near and far, words, truths, events that lie close to each other."""
    near = ThresholdLine(fsr="FSR-1", value=1.5, side="at_least")
    far = ThresholdLine(fsr="FSR-2", value=90.0, side="at_most")
    plots = (
        SignalPlot(
            name="gap", unit="m", values=(3.0, 2.5, None, 1.25, 1.0), thresholds=(near, far)
        ),
        SignalPlot(name="ttc", unit="s", values=(1.0, 240.0, 2.0, 0.5, None), cap=10.0),
        SignalPlot(name="a", unit="m/s²", values=(-7.25, -3.0, 0.5, 0.0, 2.0)),
        SignalPlot(name="same", unit="1", values=(4.0,) * 5, thresholds=(near,)),
        SignalPlot(name="none", unit="s", values=(None,) * 5),
        SignalPlot(name="mode", values=(0.0, 0.0, 2.0, 1.0, None), labels=("ok", "lost", "stuck")),
    )
    events = ((0.5, "handover"), (0.55, "contact <a>"), (1.9, "stop"))
    times = (0.0, 0.5, 1.0, 1.5, 2.0)
    for name, drawing in (
        ("signals", Drawing("run <1>", times, plots, events)),
        (
            "one_signal",
            Drawing("", (0.0, 31.7), (SignalPlot(name="v", unit="m/s", values=(1, 9)),)),
        ),
    ):
        assert_frozen(f"{name}.svg", draw_signals(drawing).decode())


def test_report_of_a_campaign_is_frozen(plain: Report, mini: Executed) -> None:
    """What is read out of a database, told of it, and left open."""
    content = json.loads(render_json(plain))
    content.pop("suites")
    assert_frozen("mini_report.json", as_json(thinned(content, 12), mini.project.folder))
