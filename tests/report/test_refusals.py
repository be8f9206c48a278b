"""Reasons why there is no bound, each once."""

from adeye.report.claims import Refusal, refusals_of
from tests.report.parts import claim, claims, refused


def test_reasons_are_told_once_with_all_that_they_hold_for() -> None:
    found = refusals_of(
        claims(
            claim("FSR-01"),
            refused("FSR-02", "cut_in", "never held"),
            refused("FSR-01", "lead_braking", "a grid"),
            refused("FSR-02", "lead_braking", "a grid"),
            refused("FSR-02", "cut_out", "a grid"),
        )
    )
    assert found == (
        Refusal("never held", ("cut_in",), ("FSR-02",), is_all=False, count=1),
        Refusal("a grid", ("lead_braking", "cut_out"), ("FSR-01", "FSR-02"), is_all=True, count=3),
    )


def test_refused_sum_over_scenarios_names_none() -> None:
    (found,) = refusals_of(claims(refused("FSR-01", "", "no exposure of cut_in")))
    assert found.scenarios == ()


def test_nothing_refused_is_no_reason() -> None:
    assert refusals_of(claims(claim())) == ()
