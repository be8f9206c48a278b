"""What changed against a baseline, on hand-made campaigns: nothing is silently compared."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from adeye.errors import UsageError
from adeye.report.gate.baseline import Finding, Kind
from adeye.report.gate.changes import Snapshot, Tolerances, changes, check_same_odd, state_of
from tests.report.fake_baseline import BRAKING, CUT_IN, GATE, OTHER, baseline, fsr_of, key_of, sha

if TYPE_CHECKING:
    from adeye.report.gate.baseline import Baseline

FAILS = {("FSR-1", GATE, CUT_IN, 1): "F"}


def found(then: Baseline, now: Baseline, **sizes: float) -> list[Finding]:
    runs = {
        (part.architecture, row.key): f"run of {row.key}"
        for part in now.cases or ()
        for row in part.rows
    }
    return changes(then, Snapshot(now, runs), Tolerances(sizes))


def kinds(findings: list[Finding], *, decides: bool = True) -> list[Kind]:
    return [item.kind for item in findings if item.decides is decides]


def test_same_campaign_has_no_findings() -> None:
    assert found(baseline(), baseline()) == []


def test_run_that_fails_now_is_named_with_its_run() -> None:
    (finding,) = [item for item in found(baseline(), baseline(verdicts=FAILS)) if item.scenario]
    assert (finding.kind, finding.where) == (Kind.NEWLY_FAILING, f"FSR-1, {GATE}, {CUT_IN}")
    assert finding.runs == (f"run of {key_of(CUT_IN, 1)}",)
    assert finding.text == "1 of 4 runs fail that did not"


def test_turned_around_it_is_newly_passing() -> None:
    findings = found(baseline(verdicts=FAILS), baseline())
    assert set(kinds(findings)) == {Kind.NEWLY_PASSING}
    assert len(findings) == 2


@pytest.mark.parametrize(("letter", "kind"), [("E", Kind.UNDECIDED), ("?", Kind.UNDECIDED)])
def test_run_that_says_nothing_any_more_is_undecided(letter: str, kind: Kind) -> None:
    now = baseline(verdicts={("FSR-2", GATE, BRAKING, 0): letter})
    assert set(kinds(found(baseline(), now))) == {kind}


def test_other_architectures_and_optional_fsrs_do_not_decide() -> None:
    other = baseline(verdicts={("FSR-1", OTHER, CUT_IN, 1): "F"})
    optional = baseline(verdicts={("FSR-3", GATE, CUT_IN, 1): "F"})
    for now in (other, optional):
        findings = found(baseline(), now)
        assert kinds(findings) == []
        assert Kind.NEWLY_FAILING in kinds(findings, decides=False)


def test_scenario_that_is_not_exercised_any_more_is_missing() -> None:
    idle = {("FSR-1", GATE, CUT_IN, number): "V" for number in range(4)}
    findings = found(baseline(), baseline(verdicts=idle))
    assert Kind.MISSING in kinds(findings)
    assert any("in none now" in item.text for item in findings)


@pytest.mark.parametrize(
    ("changed", "kind", "said"),
    [
        ({"fsrs": ("FSR-2", "FSR-3")}, Kind.MISSING, "FSR-1: the FSR is gone"),
        ({"scenarios": (CUT_IN,)}, Kind.MISSING, f"{BRAKING}: the scenario is gone"),
        ({"numbers": range(3)}, Kind.MISSING, "1 of 4 test cases are gone"),
        ({"gate": (OTHER,)}, Kind.RELAXED, f"{GATE}: was in the gate"),
        ({"channel_failures": "allow"}, Kind.RELAXED, "were refused and are allowed"),
    ],
)
def test_evidence_that_went_is_named(changed: dict[str, Any], kind: Kind, said: str) -> None:
    findings = found(baseline(), baseline(**changed))
    assert any(item.kind is kind and item.decides and said in str(item) for item in findings)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"mandatory": False}, "was mandatory"),
        ({"min_exercised": 1}, "asks for 1 exercised runs, 2 before"),
        ({"waived_until": "2999-01-01"}, "is waived until 2999-01-01, no waiver before"),
    ],
)
def test_bar_that_was_lowered_is_named(changed: dict[str, Any], said: str) -> None:
    fsrs = {**baseline().fsrs, "FSR-1": fsr_of("FSR-1", **changed)}
    findings = found(baseline(), baseline().model_copy(update={"fsrs": fsrs}))
    assert kinds(findings) == [Kind.RELAXED]
    assert said in findings[0].text
    back = found(baseline().model_copy(update={"fsrs": fsrs}), baseline())
    assert kinds(back) == []


def test_changed_fsr_is_compared_with_nothing() -> None:
    fsrs = {**baseline().fsrs, "FSR-1": fsr_of("FSR-1", digest=sha("looser"))}
    margins = {("FSR-1", GATE, CUT_IN, 0): -5.0}
    now = baseline(verdicts=FAILS, margins=margins).model_copy(update={"fsrs": fsrs})
    assert [(item.kind, item.fsr) for item in found(baseline(), now)] == [(Kind.CHANGED, "FSR-1")]


def test_edited_content_is_a_note() -> None:
    now = baseline(architectures={GATE: sha("edited"), OTHER: sha(OTHER)}, numerics="highway")
    findings = found(baseline(), now)
    assert kinds(findings) == []
    assert [item.text for item in findings] == [
        f"architectures edited: {GATE}",
        "computed by highway, the baseline by batch reference-1 3",
    ]


def test_margin_lost_in_a_pair_counts_unless_it_is_tolerated() -> None:
    now = baseline(margins={("FSR-2", GATE, CUT_IN, 3): 0.75})
    (finding,) = found(baseline(), now)
    assert (finding.kind, finding.decides) == (Kind.MARGIN, True)
    assert "lost in 1 of 4 pairs, most \N{MINUS SIGN}0.25 m" in finding.text
    assert found(baseline(), now, m=0.3) == []
    assert found(baseline(), now, **{"FSR-2": 0.3}) == []
    assert found(baseline(), now, **{"FSR-2": 0.1, "m": 9.0}) != []


def test_margin_that_grew_is_nothing() -> None:
    assert found(baseline(), baseline(margins={("FSR-2", GATE, CUT_IN, 3): 1.5})) == []


def test_without_test_cases_counts_and_worst_cases_are_compared() -> None:
    margins = {("FSR-2", GATE, CUT_IN, 3): 0.75}
    now = baseline(verdicts=FAILS, margins=margins).model_copy(update={"cases": None})
    findings = found(baseline(), now)
    assert set(kinds(findings)) == {Kind.NEWLY_FAILING, Kind.MARGIN}
    assert any("too many test cases" in item.text for item in findings)


def test_every_fsr_of_the_gate_that_does_not_pass_is_a_finding() -> None:
    assert state_of(baseline()) == []
    (finding,) = state_of(baseline(verdicts=FAILS))
    assert (finding.kind, finding.fsr) == (Kind.FAILING, "FSR-1")
    idle = {("FSR-1", GATE, name, at): "V" for name in (CUT_IN, BRAKING) for at in range(4)}
    (finding,) = state_of(baseline(verdicts=idle))
    assert (finding.kind, finding.text) == (
        Kind.UNDECIDED,
        "VACUOUS; runs: VACUOUS 8; exercised in 0 of 2 needed",
    )


def test_baseline_of_another_odd_is_refused() -> None:
    with pytest.raises(UsageError, match="baseline of ODD 'small', the campaign is of 'other'"):
        check_same_odd(baseline(), baseline(odd="other"), "b.json")
