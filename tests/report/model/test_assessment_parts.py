"""Records of preventability, timing and safe stops: they refuse to contradict themselves."""

from typing import Any

import pytest
from pydantic import ValidationError

from adeye.judge.verdict import Verdict
from adeye.report.model.assessment import Preventability, SafeStops
from tests.report.fake_assessment import fault_timing, preventability, stop


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"findings": 1}, "2 runs are avoided by the model only, 1 are findings"),
        ({"compared": 0}, "0 runs are compared, in 1 tallies"),
    ],
)
def test_findings_are_the_runs_that_only_the_model_avoids(
    changes: dict[str, Any], says: str
) -> None:
    told = preventability().model_dump() | changes
    with pytest.raises(ValidationError, match=says):
        Preventability.model_validate(told)


def test_tally_has_every_cell() -> None:
    told = preventability().model_dump()
    told["tallies"][0]["counts"].pop("unknown")
    with pytest.raises(ValidationError, match="does not count every cell"):
        Preventability.model_validate(told)


def test_tally_counts_its_runs() -> None:
    [tally] = preventability().tallies
    assert tally.runs == 6


@pytest.mark.parametrize(("measured", "handled"), [(3, 3), (4, 0)])
def test_what_is_not_measured_never_passes(measured: int, handled: int) -> None:
    with pytest.raises(ValidationError, match="PASS, but"):
        fault_timing(measured=measured, handled=handled)
    fault_timing(measured=measured, handled=handled, verdict=Verdict.NOT_RUN)


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [
        ({}, Verdict.FAIL),
        ({"contact": 0, "moving": 1, "places": stop().places[1:]}, Verdict.INCONCLUSIVE),
        ({"contact": 0, "asked": 3, "places": stop().places[1:]}, Verdict.PASS),
        ({"contact": 0, "asked": 3, "places": stop().places[1:], "unknown": 1},
         Verdict.INCONCLUSIVE),
        ({"contact": 0, "asked": 0, "reached": 0, "places": ()}, Verdict.VACUOUS),
    ],
)  # fmt: skip
def test_stop_is_shown_only_where_all_stand(changes: dict[str, Any], verdict: Verdict) -> None:
    assert stop(**changes).verdict is verdict


@pytest.mark.parametrize("changes", [{"asked": 5}, {"places": ()}])
def test_every_stop_has_an_end_and_a_place(changes: dict[str, Any]) -> None:
    with pytest.raises(ValidationError, match=r"do not add up|has a place"):
        stop(**changes)


def test_stops_of_a_campaign_are_those_of_its_rows() -> None:
    with pytest.raises(ValidationError, match="the rows say"):
        SafeStops(runs=9, asked=5, unknown=0, rows=(stop(),))
