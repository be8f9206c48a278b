"""How far evidence reaches: coverage, step, repeated results."""

from types import SimpleNamespace
from typing import Any

import pytest

from adeye.campaign.integrity import executed_coverage
from adeye.judge.uncertainty import Difference
from adeye.judge.verdict import ExitCode
from adeye.report import evidence
from adeye.report.claims import claims_of, refusals_of
from adeye.report.evidence import evidence_of, exclusions_of, step_statements, step_uncertainty_of
from adeye.report.gate.baseline import Finding, Kind
from adeye.report.model.evidence import OddCoverage
from adeye.reporting import impact_of
from adeye.store.write.half_steps import UncertaintyRecord
from tests.project import Executed
from tests.report.parts import impact
from tests.stored import known


def parts(executed: Executed) -> dict[str, Any]:
    with executed.opened() as (repository, campaign):
        odd = repository.content("odd", campaign.odd_digest)
        return evidence_of(repository, campaign, odd, lambda text: f"{text} --db my.db")


@pytest.fixture(scope="module")
def mini_parts(mini: Executed) -> dict[str, Any]:
    return parts(mini)


def test_bounds_are_those_of_the_command_and_a_grid_has_none(
    mini: Executed, mini_parts: dict[str, Any]
) -> None:
    found = mini_parts["confidence"]
    with mini.opened() as (repository, campaign):
        assert found == claims_of(repository, campaign)
    assert found.claims
    assert all(claim.upper is None for claim in found.claims)
    assert [item.reason for item in refusals_of(found)] == [
        "chosen points, not a random sample: no population, no probability"
    ]


def test_coverage_is_that_of_the_command(mini: Executed, mini_parts: dict[str, Any]) -> None:
    found: OddCoverage = mini_parts["odd_coverage"]
    table = executed_coverage(mini.db, mini.summary.campaign, 2)
    assert (found.planned, found.counted) == (table.planned, table.counted)
    ones = [item for item in table.coverage.combinations if len(item.attributes) == 1]
    assert [(item.attribute, item.covered, item.feasible) for item in found.attributes] == [
        (item.attributes[0], item.covered, item.feasible) for item in ones
    ]
    for own, item in zip(found.attributes, ones, strict=True):
        counts = {label: count for (label,), count in item.counts}
        assert {b.label: b.test_cases for b in own.bins if b.state == "covered"} == counts
        uncovered = [b.label for b in own.bins if b.state == "uncovered"]
        assert uncovered == [label for (label,) in item.uncovered]
    twos = [item for item in table.coverage.combinations if len(item.attributes) == 2]
    assert found.covered_pairs == sum(item.covered for item in twos)
    assert len(found.uncovered_pairs) == sum(len(item.uncovered) for item in twos)
    assert found.feasible_pairs == found.covered_pairs + len(found.uncovered_pairs)
    assert found.command == f"adeye coverage {mini.summary.campaign[:10]} --json --db my.db"


def test_bins_stand_in_the_order_of_the_odd(mini_parts: dict[str, Any]) -> None:
    (speed,) = [i for i in mini_parts["odd_coverage"].attributes if i.attribute == "ego_speed"]
    assert [(item.label, item.state) for item in speed.bins] == [
        ("0 to 30 km/h", "uncovered"),
        ("30 to 60 km/h", "uncovered"),
        ("60 to 90 km/h", "covered"),
        ("90 to 130 km/h", "covered"),
    ]


def test_list_of_pairs_is_cut_and_their_number_is_not(
    mini: Executed, mini_parts: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(evidence, "MAX_PAIRS", 3)
    cut, whole = parts(mini)["odd_coverage"], mini_parts["odd_coverage"]
    assert cut.uncovered_pairs == whole.uncovered_pairs[:3]
    assert (cut.feasible_pairs, cut.covered_pairs) == (whole.feasible_pairs, whole.covered_pairs)


def test_large_campaign_is_not_counted_and_says_so(
    mini: Executed, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(evidence, "MAX_COUNTED", 27)
    found = parts(mini)["odd_coverage"]
    assert (found.planned, found.counted, found.attributes) == (28, 0, ())
    assert "more than 27 test cases" in found.refusal


def test_relations_of_a_plan_are_told_and_scenarios_without_any_are_not() -> None:
    uses = [
        {"use": "cut_in", "as": "late", "sweep": {"where": ["gap < 20 m", "friction > 0.5"]}},
        {"use": "cut_in", "as": None, "sweep": {"where": []}},
        {"use": "lead_braking", "as": None, "sweep": {"where": ["gap > 1 m"]}},
    ]
    assert [(item.scenario, item.relations) for item in exclusions_of({"scenarios": uses})] == [
        ("late", ("gap < 20 m", "friction > 0.5")),
        ("lead_braking", ("gap > 1 m",)),
    ]


def test_odd_that_asks_for_no_uncertainty_has_no_number_of_situations(
    mini_parts: dict[str, Any],
) -> None:
    found = mini_parts["step_uncertainty"]
    assert (found.situations, found.lines, found.step_s) == (None, (), 0.05)


def test_uncertainty_of_margins_comes_first_and_too_few_pairs_give_none() -> None:
    metric_line = Difference("metric", "gap_m", "m", 12, 12, 0.1, 0.2, 0, {})
    fsr_line = Difference("fsr", "FSR-01", "m", 12, 9, 0.3, 0.4, 1, {"PASS → FAIL": 1})
    records = [UncertaintyRecord("cut_in", "one", item) for item in (metric_line, fsr_line)]
    odd = {"step": 0.02, "uncertainty": {"situations": 12}}
    found = step_uncertainty_of(odd, records, "adeye uncertainty")
    assert (found.step_s, found.situations) == (0.02, 12)
    margin, metric = found.lines
    assert (margin.name, margin.uncertainty, margin.largest) == ("FSR-01", None, 0.4)
    assert (margin.differing, margin.changes) == (1, {"PASS → FAIL": 1})
    assert (metric.name, metric.uncertainty, metric.pairs) == ("gap_m", 0.1, 12)


def line(name: str, unit: str, p95: float | None, pairs: int, differing: int = 0) -> Difference:
    return Difference("fsr", name, unit, 12, pairs, p95, p95, differing, {})


def test_largest_of_each_fsr_and_what_is_not_known_are_said() -> None:
    found = [
        line("FSR-02", "m/s²", 0.2, 12),
        line("FSR-02", "m/s²", 0.5, 12, differing=2),
        line("FSR-01", "", None, 0),
        line("FSR-06", "m", 0.1, 9),
        Difference("metric", "min_ttc_s", "s", 12, 12, 7.0, 7.0, 3, {}),
    ]
    (text,) = step_statements(found)
    assert "Known for 2 of 4 margins" in text
    assert "at most FSR-02 0.5 m/s²." in text
    assert "2 verdicts of the sample change" in text
    assert "7" not in text


def test_no_uncertainty_is_not_taken_for_zero() -> None:
    (text,) = step_statements([line("FSR-06", "m", 0.0, 9)])
    assert "Known for 0 of 1" in text
    assert "at most" not in text
    # Who did not ask says nothing.
    assert step_statements(()) == ()


# --- What a report says about change --------------------------------------------------------------

FOUND = (
    Finding(Kind.NEWLY_FAILING, "FAIL, PASS before", fsr="F", architecture="a", runs=("r1", "r2")),
    Finding(Kind.NEWLY_PASSING, "PASS, FAIL before", fsr="G"),
    Finding(Kind.MARGIN, "lost 1 m", decides=False, fsr="F", architecture="b", scenario="s"),
)


def result(*changes: Finding) -> Any:
    return SimpleNamespace(
        baseline="b.json", exit_code=ExitCode.FAILED, message="no", changes=changes
    )


COMMANDS = ("adeye gate c0de", lambda run: f"adeye show {run}")


def test_every_difference_is_told_with_its_worst_run_and_whether_it_decides() -> None:
    told = impact_of(result(*FOUND), "c0de", "gone", COMMANDS)
    assert [item.kind for item in told.changes] == [item.kind for item in FOUND]
    assert [item.decides for item in told.changes] == [True, False, False]
    assert told.deciding == 1
    first, _, last = told.changes
    assert first.command == "adeye show r1"
    assert (last.command, last.fsr, last.architecture, last.scenario) == ("", "F", "b", "s")


def test_reason_stands_where_stale_evidence_is_not_known() -> None:
    told = impact_of(result(), "c0de", "the file is gone", COMMANDS)
    assert (told.stale, told.not_asked) == (None, "the file is gone")
    stale = known(impact().stale)
    told = impact_of(result(), "c0de", stale, COMMANDS)
    assert (told.stale, told.not_asked) == (stale, "")
