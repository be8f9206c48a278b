"""Places of bars and of the points of a trade."""

from typing import Any

import pytest

from adeye.report.model.assessment import FaultGroup
from adeye.report.page.charts import HEIGHT, WIDTH, draw_bars, draw_trade
from tests.report.parts import curve, evidence, group, undetected
from tests.stored import known


def drawn(*groups: FaultGroup) -> Any:
    measured = sum(sum(item.counts.values()) for item in groups)
    return draw_bars(evidence(groups=groups, measured=measured))


def test_bars_are_as_long_as_their_times() -> None:
    found = known(draw_bars(evidence()))
    bar, open_bar = found.bars
    end = float(found.ticks[-1].text)
    fdti, frti = known(bar.fdti), known(bar.frti)
    assert fdti.width == pytest.approx(100.0 * 0.25 / end)
    assert frti.x + frti.width == pytest.approx(100.0 * 0.75 / end)
    assert bar.ftti == pytest.approx(100.0 * 2.0 / end)
    assert (bar.open_from, bar.is_late, bar.is_cut) == (None, False, False)
    assert bar.text == "FDTI 0.25 s, FRTI 0.50 s, FHTI 0.75 s, FTTI 2.00 s"
    # What is not detected is open from the fault on.
    assert (open_bar.fdti, open_bar.frti) == (None, None)
    assert (open_bar.open_from, open_bar.is_late) == (0.0, True)
    assert "not detected" in open_bar.text


def test_fault_that_is_detected_and_not_handled_is_open_from_its_detection_on() -> None:
    [bar] = drawn(group(class_="detected_late", frti_s=None, fhti_s=None, margin_s=None)).bars
    assert bar.open_from == bar.fdti.width
    assert (bar.frti, bar.is_late) == (None, True)


def test_masked_fault_needs_no_handling() -> None:
    nothing: dict[str, Any] = dict.fromkeys(("fdti_s", "frti_s", "fhti_s", "ftti_s"))
    masked = group(class_="masked", **nothing).worst
    [bar] = drawn(undetected().model_copy(update={"worst": masked})).bars
    assert bar.open_from is None


def test_ftti_far_beyond_the_rest_is_cut_and_a_short_time_is_seen() -> None:
    near, bar = drawn(group(), group(ftti_s=40.0)).bars
    assert not near.is_cut
    assert bar.is_cut
    assert bar.ftti == 100.0
    # What is handled is still seen.
    assert bar.frti.x + bar.frti.width > 10.0
    assert drawn(group(fdti_s=0.0, frti_s=0.0, fhti_s=0.0)).bars[0].fdti.width > 0.0


def test_groups_whose_fault_never_was_active_have_no_bar() -> None:
    inactive = group(counts={"not_activated": 2}, class_="not_activated")
    assert drawn(inactive) is None
    assert len(drawn(inactive, group()).bars) == 1


def test_trade_falls_to_the_right() -> None:
    found = known(draw_trade(curve()))
    places = [(dot.median, dot.y) for dot in found.dots]
    assert places == sorted(places)
    assert all(0.0 < dot.median < dot.worst < WIDTH and 0.0 < dot.y < HEIGHT for dot in found.dots)
    assert [dot.label.text for dot in found.dots if dot.label] == ["0 s", "0.1 s", "0.2 s"]
    assert all(dot.low is None for dot in found.dots)


def test_interval_of_a_random_sample_encloses_its_point() -> None:
    found = known(draw_trade(curve(sampled=True)))
    for dot in found.dots:
        assert dot.low is not None
        assert dot.high is not None
        assert dot.high <= dot.y <= dot.low


def test_value_without_a_detected_fault_has_no_place_and_is_named() -> None:
    whole = curve()
    blind = whole.points[0].model_copy(
        update={"detected": 0, "median_fdti_s": None, "worst_fdti_s": None}
    )
    found = known(draw_trade(whole.model_copy(update={"points": (blind, *whole.points[1:])})))
    assert (len(found.dots), found.placeless) == (2, ("0 s",))
    assert draw_trade(whole.model_copy(update={"points": (blind, whole.points[1])})) is None
