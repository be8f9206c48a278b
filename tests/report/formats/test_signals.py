"""Signals drawn over time: gaps stay gaps, words are steps, limits of FSRs are in the picture."""

import xml.etree.ElementTree as ET
from itertools import pairwise

from adeye.report.formats.signals import HEAD, STRIP, Drawing, draw_signals
from adeye.report.page.replay import SignalPlot, ThresholdLine

SVG = "{http://www.w3.org/2000/svg}"


def drawn(*plots: SignalPlot, events: tuple[tuple[float, str], ...] = ()) -> ET.Element:
    count = len(plots[0].values)
    time_s = tuple(float(at) for at in range(count))
    return ET.fromstring(draw_signals(Drawing("run <1>", time_s, plots, events)))  # noqa: S314


def points(root: ET.Element) -> list[list[tuple[float, float]]]:
    return [
        [(float(x), float(y)) for x, y in (pair.split(",") for pair in line.split())]
        for line in (item.attrib["points"] for item in root.iter(f"{SVG}polyline"))
    ]


def texts(root: ET.Element) -> list[str]:
    return [(item.text or "").strip() for item in root.iter(f"{SVG}text")]


def test_gap_in_the_values_is_a_gap_in_the_curve() -> None:
    values = (1.0, 2.0, None, 4.0, None, 5.0, 6.0)
    root = drawn(SignalPlot(name="ttc", unit="s", values=values))
    first, second = points(root)
    assert (len(first), len(second)) == (2, 2)
    assert len(list(root.iter(f"{SVG}circle"))) == 1
    assert first[0][1] > first[1][1] > second[0][1] > second[1][1]
    assert "ttc [s]: 1.00 to 6.00" in texts(root)
    assert "run <1>" in texts(root)


def test_words_are_held_until_the_next_one() -> None:
    plot = SignalPlot(name="mode", values=(0.0, 0.0, 1.0), labels=("ok", "lost"))
    root = drawn(plot)
    (line,) = points(root)
    assert all(a[0] == b[0] or a[1] == b[1] for a, b in pairwise(line))
    assert {"ok", "lost"} <= set(texts(root))


def test_limit_is_drawn_where_it_is_near_and_told_where_it_is_not() -> None:
    near = ThresholdLine(fsr="FSR-1", value=1.5, side="at_least")
    far = ThresholdLine(fsr="FSR-2", value=90.0, side="at_most")
    plot = SignalPlot(name="gap", unit="m", values=(1.0, 2.0), thresholds=(near, far))
    root = drawn(plot, events=((0.5, "handover"),))
    said = texts(root)
    assert "FSR-1 ≥ 1.50 m" in said
    assert any(text.startswith("FSR-2 ≤ 90.0 m, not shown") for text in said)
    red = [item for item in root.iter(f"{SVG}line") if item.get("stroke") == "#b3261e"]
    assert len(red) == 1
    assert "handover" in [item.text for item in root.iter(f"{SVG}title")]


def test_signal_without_any_value_is_told() -> None:
    root = drawn(SignalPlot(name="ttc", unit="s", values=(None, None)))
    assert points(root) == []
    assert "ttc [s]: no value" in texts(root)


def test_what_is_beyond_the_cap_stays_in_its_strip() -> None:
    values = (1.0, 240.0, 2.0)
    first, second = drawn(
        SignalPlot(name="ttc", unit="s", values=values, cap=10.0),
        SignalPlot(name="gap", unit="m", values=values),
    ).iter(f"{SVG}polyline")
    heights = [float(pair.split(",")[1]) for pair in first.attrib["points"].split()]
    assert HEAD < min(heights) < HEAD + STRIP
    assert heights[1] == min(heights) < heights[2]
    assert float(second.attrib["points"].split()[1].split(",")[1]) > HEAD + STRIP


def test_words_that_do_not_occur_take_no_room() -> None:
    words = ("none", "default", "request", "latched", "stuck")
    root = drawn(SignalPlot(name="reason", values=(1.0, 4.0, None), labels=words))
    assert {"default", "stuck"} <= set(texts(root))
    assert not {"none", "request", "latched"} & set(texts(root))
    assert len(points(root)[0]) == 3
    alone = drawn(SignalPlot(name="reason", values=(4.0, 4.0), labels=words))
    assert "stuck" in texts(alone)
