"""What an FSR measures: no spelling counts, and every other part does."""

from __future__ import annotations

from typing import Any

import pytest

from adeye.judge.requirements import measured, reads_odd, requirement_digest
from adeye.spec.concept import Requirement

CONTENT: dict[str, Any] = {
    "id": "FSR-01",
    "goals": ["SG-01"],
    "text": "It shall be so.",
    "threshold_source": "test",
    "asil": "B",
    "allocation": ["camera"],
    "scenarios": ["cut_in", "lead_braking"],
}
GAP = {"formula": "always(gap >= 1 m)"}
TTC = {"bound": {"metric": "min_ttc_s", "at_least": 2.0}}


def fsr(*parts: dict[str, Any]) -> Requirement:
    content = dict(CONTENT)
    for part in parts:
        content |= part
    return Requirement.model_validate(content)


@pytest.mark.parametrize(
    ("before", "now"),
    [
        (GAP, {"formula": " always( gap>=100 cm )\n"}),
        (GAP, {"formula": "always(gap >= least)", "parameters": {"least": "1000 mm"}}),
        (GAP, {**GAP, "scenarios": ["lead_braking", "cut_in"]}),
        (GAP, {**GAP, "text": "Other words.", "asil": "D", "mandatory": False}),
        (TTC, {"bound": {"metric": "min_ttc_s", "at_least": 2}}),
        (TTC, {"bound": {"metric": "min_ttc_s", "at_least": "2000 ms"}}),
        (TTC, {"bound": {"metric": "min_ttc_s", "at_least": "t"}, "parameters": {"t": "2 s"}}),
    ],
)
def test_spelling_is_no_part_of_it(before: dict[str, Any], now: dict[str, Any]) -> None:
    assert measured(fsr(before)) == measured(fsr(now))
    assert requirement_digest(fsr(before)) == requirement_digest(fsr(now))


@pytest.mark.parametrize(
    ("before", "now"),
    [
        (GAP, {"formula": "always(gap > 1 m)"}),
        (GAP, {"formula": "always(gap >= 1.0000000000000002 m)"}),
        (GAP, {**GAP, "scenarios": ["cut_in"]}),
        (GAP, {**GAP, "on_contact": "fail"}),
        (GAP, {**GAP, "applies": "everywhere"}),
        (GAP, {**GAP, "id": "FSR-02"}),
        (TTC, {"bound": {"metric": "min_ttc_s", "at_most": 2.0}}),
        (TTC, {"bound": {"metric": "min_ttc_s", "at_least": 2.0000000000000004}}),
        (TTC, {"bound": {"metric": "min_thw_s", "at_least": 2.0}}),
    ],
)
def test_everything_else_is(before: dict[str, Any], now: dict[str, Any]) -> None:
    assert measured(fsr(before)) != measured(fsr(now))
    assert requirement_digest(fsr(before)) != requirement_digest(fsr(now))


def test_only_the_signal_reads_the_odd() -> None:
    assert reads_odd(fsr({"formula": "always(in_odd)"}))
    named = {"formula": "always(gap >= not_in_odd)", "parameters": {"not_in_odd": "1 m"}}
    assert not reads_odd(fsr(named))
    assert not reads_odd(fsr(TTC))
