"""Places of bars and of the points of a trade."""

from __future__ import annotations

import pytest

from adeye.report.model.assessment import FaultEvidence, FaultGroup
from adeye.report.page.charts import HEIGHT, WIDTH, draw_bars, draw_trade
from tests.report.parts import curve, evidence, group, undetected


def drawn(*groups: FaultGroup) -> object:
    measured = sum(sum(item.counts.values()) for item in groups)
    content = {**evidence().model_dump(), "groups": groups, "measured": measured}
    return draw_bars(FaultEvidence.model_validate(content))


def test_bars_are_as_long_as_their_times() -> None:
    found = draw_bars(evidence())
    assert found is not None
    bar = found.bars[0]
    end = float(found.ticks[-1].text)
    assert bar.fdti is not None
    assert bar.frti is not None
    assert bar.fdti.width == pytest.approx(100.0 * 0.25 / end)
    assert bar.frti.x + bar.frti.width == pytest.approx(100.0 * 0.75 / end)
    assert bar.ftti == pytest.approx(100.0 * 2.0 / end)
    assert (bar.open_from, bar.is_late, bar.is_cut) == (None, False, False)
    assert bar.text == "FDTI 0.25 s, FRTI 0.50 s, FHTI 0.75 s, FTTI 2.00 s"


def test_undetected_fault_is_open_from_the_fault_on() -> None:
    found = draw_bars(evidence())
    assert found is not None
    bar = found.bars[1]
    assert (bar.fdti, bar.frti, bar.open_from, bar.is_late) == (None, None, 0.0, True)
    assert "not detected" in bar.text


def test_fault_that_is_detected_and_not_handled_is_open_from_its_detection_on() -> None:
    late = group(class_="detected_late", frti_s=None, fhti_s=None, margin_s=None)
    found = drawn(late)
    bar = found.bars[0]  # type: ignore[attr-defined]
    assert bar.open_from == bar.fdti.width
    assert (bar.frti, bar.is_late) == (None, True)


def test_masked_fault_needs_no_handling() -> None:
    found = drawn(undetected().model_copy(update={"worst": group(
        class_="masked", fdti_s=None, frti_s=None, fhti_s=None, ftti_s=None).worst}))  # fmt: skip
    assert found.bars[0].open_from is None  # type: ignore[attr-defined]


def test_ftti_far_beyond_the_rest_is_cut() -> None:
    found = drawn(group(), group(ftti_s=40.0))
    near, bar = found.bars  # type: ignore[attr-defined]
    assert not near.is_cut
    assert bar.is_cut
    assert bar.ftti == 100.0
    # What is handled is still seen.
    assert bar.frti.x + bar.frti.width > 10.0


def test_short_time_is_seen() -> None:
    found = drawn(group(fdti_s=0.0, frti_s=0.0, fhti_s=0.0))
    assert found.bars[0].fdti.width > 0.0  # type: ignore[attr-defined]


def test_groups_whose_fault_never_was_active_have_no_bar() -> None:
    inactive = group(counts={"not_activated": 2}, class_="not_activated")
    assert drawn(inactive) is None
    assert len(drawn(inactive, group()).bars) == 1  # type: ignore[attr-defined]


def test_trade_falls_to_the_right() -> None:
    found = draw_trade(curve())
    assert found is not None
    places = [(dot.median, dot.y) for dot in found.dots]
    assert places == sorted(places)
    assert all(0.0 < dot.median < dot.worst < WIDTH and 0.0 < dot.y < HEIGHT for dot in found.dots)
    assert [dot.label.text for dot in found.dots if dot.label] == ["0 s", "0.1 s", "0.2 s"]
    assert all(dot.low is None for dot in found.dots)


def test_interval_of_a_random_sample_encloses_its_point() -> None:
    found = draw_trade(curve(sampled=True))
    assert found is not None
    for dot in found.dots:
        assert dot.low is not None
        assert dot.high is not None
        assert dot.high <= dot.y <= dot.low


def test_value_without_a_detected_fault_has_no_place_and_is_named() -> None:
    whole = curve()
    blind = whole.points[0].model_copy(
        update={"detected": 0, "median_fdti_s": None, "worst_fdti_s": None}
    )
    found = draw_trade(whole.model_copy(update={"points": (blind, *whole.points[1:])}))
    assert found is not None
    assert (len(found.dots), found.placeless) == (2, ("0 s",))
    assert draw_trade(whole.model_copy(update={"points": (blind, whole.points[1])})) is None
