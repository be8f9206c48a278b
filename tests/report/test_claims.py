"""Claims of confidence: bounds, refusals, strata."""

import json
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from adeye.errors import UsageError
from adeye.judge.pairing import NOT_RUN
from adeye.judge.statistics import Stratum, mcnemar_p, stratified_bound
from adeye.judge.verdict import FAIL, VERDICTS
from adeye.kernel.random import owner_id, uniform
from adeye.report import claims as claimed
from adeye.report.build import ReportBuilder
from adeye.report.comparison.candidates import Matching
from adeye.report.comparison.compare import compare
from adeye.report.comparison.records import CompareOptions
from adeye.signals import Bools, Ints
from adeye.store.read.bulk import Labels
from adeye.store.repository import Repository
from tests.project import LEGACY, Executed, Project
from tests.refusals import refused
from tests.sql import rows
from tests.stored import known, stored

CODES = {str(word): code for code, word in enumerate(VERDICTS)} | {"NOT_RUN": NOT_RUN, "-": -1}


@dataclass
class Campaign:
    """A stand-in for a stored campaign with one FSR and architecture: verdicts by point."""

    verdicts: dict[str, list[str]]
    """By scenario; one text of words a point, one word a run."""
    designs: dict[str, str] = field(default_factory=dict)
    exposures: dict[str, float] = field(default_factory=dict)
    is_in_gate: bool = True
    traces: dict[str, list[str]] = field(default_factory=dict)
    """Names of traces in the place of verdicts; all are different unless given."""

    def content(self, _kind: str, _digest: str) -> Any:
        uses = []
        for name in self.verdicts:
            design = self.designs.get(name, "random")
            size = {"samples": 4} if design == "random" else {}
            sweep = {"design": design, "parameters": {"gap": ["10 m", "20 m"]}, "where": [], **size}
            uses.append(
                {"use": name, "as": None, "sweep": sweep, "exposure": self.exposures.get(name)}
            )
        return {
            "odd": {"scenarios": uses},
            "architectures": {"one": {}},
            "scenarios": {name: {"constraints": []} for name in self.verdicts},
        }

    def compared(self, _campaign: str, _names: Any) -> Any:
        rows = [
            (name, f"{name}{number}", CODES[word])
            for name, points in self.verdicts.items()
            for number, words in enumerate(points)
            for word in words.split()
        ]
        traces = [word for points in self.traces.values() for word in " ".join(points).split()]
        return SimpleNamespace(
            trace=Labels.of(traces or range(len(rows))).codes,
            scenario=Labels.of(row[0] for row in rows),
            architecture=Labels.of("one" for _ in rows),
            point=Labels.of(row[1] for row in rows).codes,
            axes={},
            fsrs=("FSR-01",),
            verdict=np.array([[row[2]] for row in rows], dtype=np.int64).reshape(-1, 1),
        )

    def fsr_status(self, _campaign: str) -> Any:
        known = {"fsr": "FSR-01", "architecture": "one", "is_applicable": True}
        told = {**known, "is_mandatory": True, "is_in_gate": self.is_in_gate}
        return [
            SimpleNamespace(**told, scenario=name, planned=sum(word != "-" for word in points))
            for name, points in self.verdicts.items()
        ]


def claims(campaign: Campaign, **options: Any) -> claimed.Claims:
    info = SimpleNamespace(id="c", odd="odd", odd_digest="d", title="", factors=())
    return claimed.claims_of(campaign, info, claimed.ClaimOptions(**options))  # type: ignore[arg-type]


def single(verdicts: list[str], **options: Any) -> claimed.Claim:
    (found,) = claims(Campaign({"cut_in": verdicts}), **options).claims
    return found


def test_zero_failures_are_the_zero_failure_bound() -> None:
    found = single(["PASS"] * 299)
    assert (found.points, found.exercised, found.failing, found.undecided) == (299, 299, 0, 0)
    assert found.upper == pytest.approx(1.0 - 0.05 ** (1.0 / 299))
    assert known(found.interval).high == pytest.approx(1.0 - 0.025 ** (1.0 / 299))
    assert found.refusal == ""


def test_a_point_fails_if_any_of_its_runs_does_and_is_then_not_undecided() -> None:
    found = single(["PASS FAIL", "PASS PASS", "VACUOUS PASS"])
    assert (found.points, found.exercised, found.failing) == (3, 3, 1)
    assert found.share == pytest.approx(1 / 3)
    assert single(["FAIL NOT_RUN", "PASS"]).undecided == 0


def test_what_is_undecided_counts_as_failed_in_the_bound() -> None:
    for word in ("INCONCLUSIVE", "INVALID", "ERROR", "NOT_RUN"):
        found = single(["PASS"] * 9 + [f"PASS {word}"])
        assert (found.failing, found.undecided, found.share) == (0, 1, 0.0)
        assert found.upper == single(["PASS"] * 9 + ["FAIL"]).upper
        assert known(found.interval).low == 0.0


def test_vacuous_points_and_runs_that_are_not_judged_help_nothing() -> None:
    found = single(["VACUOUS"] * 500 + ["PASS"] * 3)
    assert (found.points, found.exercised) == (503, 3)
    assert found.upper == single(["PASS"] * 3).upper
    found = single(["-", "- PASS", "-"])
    assert (found.points, found.exercised) == (1, 1)


def test_points_on_the_other_side_of_the_odd_are_said_to_be_in_no_bound() -> None:
    told = "cut_in: FSR-01 only for the 2 of 3 points that lie on its side of the ODD"
    assert claims(Campaign({"cut_in": ["PASS", "-", "PASS"]})).conditions[0].startswith(told)
    every = claims(Campaign({"cut_in": ["PASS", "- PASS", "PASS"]})).conditions
    assert not any("on its side of the ODD" in text for text in every)


def test_what_was_never_exercised_and_chosen_points_are_refused() -> None:
    cases = [("random", "VACUOUS", "its precondition never held")]
    cases += [(name, "PASS", "not a random sample") for name in ("full_factorial", "list", "zip")]
    for design, word, reason in cases:
        found = claims(Campaign({"cut_in": [word] * 500}, {"cut_in": design}))
        (claim,) = found.claims
        assert reason in claim.refusal
        assert (claim.upper, claim.interval, claim.share) == (None, None, None)
        assert found.missing == (("FSR-01", "one"),)
        assert found.conditions == ()
    # Outside of the gate nothing is missing.
    assert claims(Campaign({"a": ["VACUOUS"]}, is_in_gate=False)).missing == ()


def test_points_without_any_verdict_are_no_statement() -> None:
    for word in ("INCONCLUSIVE", "INVALID", "ERROR", "NOT_RUN"):
        for points in ([word] * 6, [word] * 5 + ["VACUOUS"]):
            found = claims(Campaign({"cut_in": points}, {"cut_in": "random"}))
            assert [item.upper for item in found.claims] == [1.0]
            assert found.missing == (("FSR-01", "one"),)
        for other in ("PASS", "FAIL"):
            campaign = Campaign({"cut_in": [word, other]}, {"cut_in": "random"})
            assert claims(campaign).missing == ()
    rest = Campaign({"a": ["NOT_RUN"], "b": ["PASS"]}, exposures={"a": 1.0, "b": 1.0})
    assert claims(rest).missing == ()


def test_one_grid_among_samples_has_no_bound_and_spoils_the_sum() -> None:
    campaign = Campaign(
        {"a": ["PASS"] * 9, "b": ["PASS"] * 9}, {"b": "full_factorial"}, {"a": 1.0, "b": 1.0}
    )
    found = claims(campaign)
    assert {item.scenario: item.upper is None for item in found.claims} == {"a": False, "b": True}
    assert found.missing == ()


def test_scenarios_are_weighted_by_exposure() -> None:
    campaign = Campaign(
        {"a": ["PASS"] * 100, "b": ["PASS"] * 40 + ["VACUOUS"] * 10},
        exposures={"a": 3.0 / 3600.0, "b": 1.0 / 3600.0},
    )
    weighted = claims(campaign).claims[-1]
    strata = [Stratum(0.75, 0, 100), Stratum(0.25, 0, 50)]
    assert weighted.scenario == ""
    assert (weighted.points, weighted.exercised) == (150, 140)
    assert weighted.upper == pytest.approx(stratified_bound(strata, 0.95))
    assert weighted.rate_per_h == pytest.approx(4.0 * stratified_bound(strata, 0.95))
    assert weighted.upper_varied is not None
    assert weighted.upper is not None
    assert weighted.upper_varied.low <= weighted.upper <= weighted.upper_varied.high
    more = [Stratum(0.5, 0, 100), Stratum(0.5, 0, 50)]
    assert weighted.upper_varied.high >= stratified_bound(more, 0.95)
    assert any("a 3 /h, b 1 /h" in text for text in claims(campaign).conditions)


def test_undecided_points_count_as_failed_over_scenarios_too() -> None:
    exposures = {"a": 1.0, "b": 1.0}
    held = claims(Campaign({"a": ["PASS"] * 50, "b": ["PASS"] * 50}, exposures=exposures))
    spoilt = Campaign({"a": ["PASS"] * 50, "b": ["PASS"] * 49 + ["NOT_RUN"]}, exposures=exposures)
    found = claims(spoilt).claims[-1]
    assert found.share == 0.0
    assert found.upper is not None
    assert found.upper > (held.claims[-1].upper or 1.0)


def test_without_an_exposure_scenarios_are_not_weighted() -> None:
    campaign = Campaign({"a": ["PASS"] * 9, "b": ["PASS"] * 9}, exposures={"a": 1.0})
    assert claims(campaign).claims[-1].refusal == "no exposure of b"


def test_joint_bounds_share_the_error() -> None:
    campaign = Campaign({"a": ["PASS"] * 50, "b": ["PASS"] * 50}, exposures={"a": 1.0, "b": 1.0})
    found = claims(campaign, is_joint=True)
    assert [item.scenario for item in found.claims] == ["a", "b", ""]
    assert found.claims[0].upper == pytest.approx(1.0 - (0.05 / 3.0) ** (1.0 / 50))
    assert any("All 3 bounds hold at once" in text for text in found.conditions)


def test_level_that_cannot_be_shared_is_refused() -> None:
    campaign = Campaign({"a": ["PASS"] * 9, "b": ["FAIL"] * 9}, exposures={"a": 1.0, "b": 1.0})
    with pytest.raises(UsageError, match="a part in 6 of its error cannot be told from 0"):
        claims(campaign, is_joint=True, level=1.0 - 2.0**-53)
    upper = known(single(["PASS"] * 99, level=1.0 - 2.0**-53).upper)
    assert upper < 1.0


def test_points_that_hold_with_equal_results_count_once() -> None:
    words = ["PASS PASS"] * 4 + ["VACUOUS VACUOUS"] * 2 + ["FAIL PASS"] * 2 + ["PASS NOT_RUN"] * 2
    # The second has the traces of the first, the fourth those of the third.
    traces = ["a b", "b a", "b c", "c b", "d d", "d d", "e e", "e e", "f f", "f f"]
    (found,) = claims(Campaign({"a": words}, traces={"a": traces})).claims
    # What fails or is undecided always counts.
    assert (found.points, found.exercised, found.failing, found.undecided) == (10, 6, 2, 2)
    other = single(["PASS"] * 2 + words[6:])
    assert (found.upper, found.share) == (other.upper, other.share)
    (found,) = claims(Campaign({"a": ["PASS"] * 299}, traces={"a": ["x"] * 299})).claims
    assert (found.exercised, found.upper) == (1, single(["PASS"]).upper)


def test_one_scenario_under_several_names_is_no_more_evidence() -> None:
    names = [f"s{at}" for at in range(5)]
    exposures = dict.fromkeys(names, 1.0)
    points = {name: [str(at) for at in range(30)] for name in names}
    same = Campaign({name: ["PASS"] * 30 for name in names}, exposures=exposures, traces=points)
    found = claims(same).claims[-1]
    strata = [Stratum(0.2, 0, 30), *[Stratum(0.2, 0, 0)] * 4]
    assert (found.points, found.exercised) == (150, 30)
    assert found.upper == pytest.approx(stratified_bound(strata, 0.95))


def test_target_tells_how_many_points_it_takes() -> None:
    assert single(["PASS"], target=1e-3).needed == 2995
    assert single(["PASS"]).needed is None


def test_options_out_of_range_are_refused() -> None:
    nan = float("nan")
    for option, value in (
        ("level", 1.0),
        ("level", 0.0),
        ("level", 0.4),
        ("level", nan),
        ("target", 2.0),
    ):
        refused(UsageError, single, ["PASS"], **{option: value}, says=f"is {value:g}")
    refused(UsageError, single, ["PASS"], method="wald", says="'wald'")


def test_counts_are_those_of_the_documented_view(suites: Executed) -> None:
    with suites.opened() as (repository, campaign):
        found = claimed.claims_of(repository, campaign)
    sql = (
        "SELECT v.fsr, r.architecture, r.scenario, r.parameters, v.verdict FROM v_verdicts v "
        "JOIN v_runs r ON r.campaign = v.campaign AND r.ordinal = v.ordinal"
    )
    points: dict[tuple[str, ...], dict[str, list[str]]] = {}
    for *place, parameters, verdict in rows(suites.db, sql):
        key = json.dumps(json.loads(parameters), sort_keys=True)
        points.setdefault(tuple(place), {}).setdefault(key, []).append(verdict)
    for item in found.claims:
        own = points.get((item.fsr, item.architecture, item.scenario), {}).values()
        exercised = [words for words in own if set(words) != {"VACUOUS"}]
        assert (item.points, item.exercised) == (len(own), len(exercised))
        assert item.failing == sum("FAIL" in words for words in exercised)
        if item.scenario == "cut_in" and exercised:
            worst = item.failing + item.undecided
            test = stats.binomtest(worst, len(exercised), alternative="less")
            assert item.upper == pytest.approx(test.proportion_ci(0.95, method="exact").high)
        else:
            assert item.refusal
    assert any(item.upper is not None for item in found.claims)


def odd(*uses: tuple[str, str, str]) -> dict[str, Any]:
    scenarios = [
        {"use": use, "as": name or None, "sweep": {"design": design}} for use, name, design in uses
    ]
    return {"odd": {"scenarios": scenarios}}


def test_design_is_found_by_the_id_in_the_odd() -> None:
    content = odd(("cut_in", "", "random"), ("cut_in", "late", "full_factorial"))
    assert claimed.designs_of(content) == {"cut_in": "random", "late": "full_factorial"}


def test_only_a_random_design_is_a_sample() -> None:
    assert claimed.is_sample("random")
    assert not any(claimed.is_sample(design) for design in ("full_factorial", "zip", "list"))


def test_declared_distribution_is_spoken_of_as_such_and_not_as_uniform() -> None:
    content = odd(("cut_in", "", "random"), ("cut_out", "", "sobol"))
    law = {"gap": {"normal": {"mean": "30 m", "sd": "5 m"}}}
    for use in content["odd"]["scenarios"]:
        use["sweep"]["parameters"] = law
    designs = claimed.designs_of(content)
    assert [claimed.is_sample(designs[name]) for name in ("cut_in", "cut_out")] == [True, False]
    drawn, fixed = claimed.spoken_of(designs, designs)
    assert drawn.startswith("cut_in: points drawn from the declared distribution of each axis")
    assert "drawn uniformly" not in drawn
    assert fixed == claimed.GRID.format(scenarios="cut_out")


def test_each_kind_of_design_is_spoken_of_once() -> None:
    designs = {"a": "random", "b": "zip", "c": "random", "d": "full_factorial"}
    assert claimed.spoken_of(designs, designs) == (
        claimed.SAMPLE.format(scenarios="a, c"),
        claimed.GRID.format(scenarios="b, d"),
    )
    assert claimed.spoken_of(designs, ("b",)) == (claimed.GRID.format(scenarios="b"),)


@pytest.mark.slow
def test_report_calls_only_its_grid_no_random_sample(suites: Executed, mini: Executed) -> None:
    statements = []
    for executed in (suites, mini):
        with executed.opened() as (repository, campaign):
            report = ReportBuilder(repository, campaign, "my.db").build(lambda _: (), replays=0)
        statements.append(report.statements)
    drawn, fixed = statements[0]
    assert drawn.startswith("cut_in: points drawn uniformly")
    assert "not a random sample" not in drawn
    assert fixed.startswith("lead_braking: a designed set of points, not a random sample")
    (only,) = statements[1]
    assert only.startswith("cut_in, lead_braking: a designed set of points, not a random sample")


POINTS = 600
ODD: dict[str, Any] = stored("narrower")


def shuffled(name: str, number: int) -> Ints:
    """Return the points in an order of its own, the same for everybody."""
    owner = np.uint64(owner_id(name))
    draws = [uniform(np.uint64(7), owner, number, place) for place in range(POINTS)]
    return np.argsort(draws).astype(np.int64)


def runs_needed(find: Callable[[int, int], float]) -> int:
    """Give the fewest points at which four of five subsamples find the loss at 5 %."""
    for points in range(20, POINTS + 1, 20):
        found = [find(points, number) < 0.05 for number in range(40)]
        if np.mean(found) >= 0.8:
            return points
    return POINTS


@pytest.mark.slow
def test_loss_of_twenty_degrees_needs_less_than_half_the_runs_in_pairs(tmp_path: Path) -> None:
    project = Project(tmp_path / "project", ODD)
    content = project.read(LEGACY)
    for name, angle in (("wide", "38 deg"), ("narrow", "18 deg")):
        changed = {**deepcopy(content), "architecture": name}
        changed["sensors"]["front_camera"]["field_of_view"] = angle
        project.write(f"odd/architectures/{name}.yaml", changed)
    summary = project.run()
    with Repository.open(project.db, create=False) as repository:
        campaign = repository.find_campaign(summary.campaign)
        cases = repository.compared(campaign.id, ("wide", "narrow"))
        found = compare(repository, campaign, CompareOptions(baseline="wide"))
    (contact,) = [item for item in found.differences if item.fsr == "FSR-01"]
    assert contact.inference is not None
    assert contact.inference.p_adjusted < 0.001
    assert contact.inference.interval.low > 0.0

    rows = Matching(cases).pairs("wide", "narrow")
    column = cases.fsrs.index("FSR-01")
    wide, narrow = (cases.verdict[item, column] == FAIL for item in rows)
    paired = runs_needed(lambda points, number: p_of_pairs(wide, narrow, points, number))
    apart = runs_needed(lambda points, number: p_of_groups(wide, narrow, points, number))
    assert 2 * paired < apart


def p_of_pairs(wide: Bools, narrow: Bools, points: int, number: int) -> float:
    chosen = shuffled("paired", number)[:points]
    a, b = wide[chosen], narrow[chosen]
    return mcnemar_p(int((a & ~b).sum()), int((b & ~a).sum()))


def p_of_groups(wide: Bools, narrow: Bools, points: int, number: int) -> float:
    a = wide[shuffled("wide", number)[:points]].sum()
    b = narrow[shuffled("narrow", number)[:points]].sum()
    return float(stats.fisher_exact([[a, points - a], [b, points - b]]).pvalue)


def test_points_on_the_other_side_of_the_odd_are_told_also_where_none_is_left() -> None:
    exposures = dict.fromkeys("abc", 1.0)
    points = {"a": ["PASS"] * 9, "b": ["PASS"] * 5 + ["-"] * 2, "c": ["-"] * 4}
    found = claims(Campaign(points, exposures=exposures))
    assert [item.scenario for item in found.claims] == ["a", "b", ""]
    said = " ".join(" ".join(text.split()) for text in found.conditions)
    assert "b: FSR-01 only for the 5 of 7 points that lie on its side of the ODD" in said
    assert "c: FSR-01 for none of the 4 points" in said
    assert "over all situations of these scenarios that an FSR is judged in" in said
