"""The gate: what fails, what regressed, and what cannot be compared any more."""

import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from adeye.errors import SpecError, UsageError
from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.gate import decide as gating
from adeye.report.gate.baseline import (
    Baseline,
    Finding,
    Kind,
    deciding,
    gate_code_of,
    read_baseline,
)
from adeye.report.gate.changes import (
    Snapshot,
    Tolerances,
    changes,
    check_same_odd,
    compared_units,
    state_of,
)
from adeye.report.gate.decide import GateResult, judge_campaign, update_baseline
from adeye.report.model.part import Margin
from adeye.store.read import totals
from adeye.store.repository import Repository
from tests.frozen import assert_frozen
from tests.project import Executed
from tests.refusals import refused
from tests.report.fake_baseline import (
    BRAKING,
    CASES,
    CUT_IN,
    GATE,
    OTHER,
    baseline,
    fsr_of,
    key_of,
    sha,
)
from tests.stored import known

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


def test_run_that_fails_now_is_named_with_its_run_and_turned_around_it_passes() -> None:
    (finding,) = [item for item in found(baseline(), baseline(verdicts=FAILS)) if item.scenario]
    assert (finding.kind, finding.where) == (Kind.NEWLY_FAILING, f"FSR-1, {GATE}, {CUT_IN}")
    assert finding.runs == (f"run of {key_of(CUT_IN, 1)}",)
    assert finding.text == "1 of 4 runs fail that did not"
    findings = found(baseline(verdicts=FAILS), baseline())
    assert kinds(findings) == [Kind.NEWLY_PASSING] * 2
    assert found(baseline(), baseline()) == []


def test_run_that_says_nothing_any_more_is_undecided() -> None:
    for letter in "E?":
        now = baseline(verdicts={("FSR-2", GATE, BRAKING, 0): letter})
        assert set(kinds(found(baseline(), now))) == {Kind.UNDECIDED}


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


def test_evidence_that_went_is_named() -> None:
    changes: tuple[tuple[dict[str, Any], Kind, str], ...] = (
        ({"fsrs": ("FSR-2", "FSR-3")}, Kind.MISSING, "FSR-1: the FSR is gone"),
        ({"scenarios": (CUT_IN,)}, Kind.MISSING, f"{BRAKING}: the scenario is gone"),
        ({"numbers": range(3)}, Kind.MISSING, "1 of 4 test cases are gone"),
        ({"gate": (OTHER,)}, Kind.RELAXED, f"{GATE}: was in the gate"),
        ({"channel_failures": "allow"}, Kind.RELAXED, "were refused and are allowed"),
        ({"uncertainty": 0}, Kind.RELAXED, "told by 0 situations, 20 before"),
    )
    for changed, kind, said in changes:
        findings = found(baseline(uncertainty=20), baseline(**{"uncertainty": 20, **changed}))
        assert any(item.kind is kind and item.decides and said in str(item) for item in findings)


def test_every_driver_more_that_has_to_fail_too_asks_for_more() -> None:
    one, two = baseline(preventable_by=("cc",)), baseline(preventable_by=("cc", "fsm"))
    assert kinds(found(baseline(), one)) == kinds(found(two, one)) == [Kind.RELAXED]
    assert kinds(found(one, two)) == kinds(found(one, baseline())) == []


def test_larger_tolerance_than_that_of_the_baseline_asks_for_less() -> None:
    plain, wide, strict = (baseline(tolerance=of) for of in ({}, {"m": 0.5}, {"m": 0.0}))
    for then, now in ((plain, wide), (strict, plain), (strict, wide)):
        (finding,) = found(then, now)
        assert (finding.kind, finding.decides) == (Kind.RELAXED, True)
        assert "is tolerated" in finding.text
        assert found(now, then) == []
    # To write down what is usual asks for as much as before.
    assert found(plain, baseline(tolerance={"m": 0.01})) == []


def test_bar_that_was_lowered_is_named() -> None:
    changes: tuple[tuple[dict[str, Any], str], ...] = (
        ({"mandatory": False}, "was mandatory"),
        ({"asil": "B(D)"}, "has ASIL B(D), D before"),
        ({"min_exercised": 1}, "asks for 1 exercised runs, 2 before"),
        ({"waived_until": "2999-01-01"}, "is waived until 2999-01-01, no waiver before"),
    )
    for changed, said in changes:
        fsrs = {**baseline().fsrs, "FSR-1": fsr_of("FSR-1", **changed)}
        lower = baseline().model_copy(update={"fsrs": fsrs})
        findings = found(baseline(), lower)
        assert kinds(findings) == [Kind.RELAXED]
        assert said in findings[0].text
        assert kinds(found(lower, baseline())) == []


def test_changed_fsr_is_compared_with_nothing() -> None:
    fsrs = {**baseline().fsrs, "FSR-1": fsr_of("FSR-1", digest=sha("looser"))}
    margins = {("FSR-1", GATE, CUT_IN, 0): -5.0}
    now = baseline(verdicts=FAILS, margins=margins).model_copy(update={"fsrs": fsrs})
    assert [(item.kind, item.fsr) for item in found(baseline(), now)] == [(Kind.CHANGED, "FSR-1")]


def test_edited_concept_is_a_note_though_nothing_of_its_fsrs_changed() -> None:
    (finding,) = found(baseline(), baseline(concept_digest=sha("another FTTI")))
    assert (finding.kind, finding.decides) == (Kind.NOTE, False)
    assert "the concept was edited; adeye check" in finding.text


def test_wider_domain_is_a_note_unless_the_baseline_is_older_than_that() -> None:
    then, now = (baseline(attributes=sha(name)) for name in ("dry", "rain"))
    (finding,) = found(then, now)
    assert (finding.kind, finding.decides) == (Kind.NOTE, False)
    assert finding.text.startswith("attributes of the ODD edited")
    assert found(baseline(), now) == found(now, now) == []


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
    for given, decides in (
        ({"m": 0.3}, False),
        ({"FSR-2": 0.3}, False),
        ({"FSR-2": 0.1, "m": 9.0}, True),
    ):
        (finding,) = found(baseline(), now, **given)
        assert (finding.kind is Kind.MARGIN) is decides
        assert ("which is tolerated: up to 0.30 m" in finding.text) is not decides
    # One that grew is nothing.
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


def variants() -> dict[str, Baseline]:
    """Baselines that differ from the first in one thing each."""
    plain = baseline(uncertainty=20)
    changed: dict[str, dict[str, Any]] = {
        "asil": {"asil": "B(D)"},
        "optional": {"mandatory": False},
        "asks for less": {"min_exercised": 1},
        "waived": {"waived_until": "2999-01-01"},
        "another FSR": {"digest": sha("looser")},
    }
    margins = {("FSR-2", GATE, CUT_IN, 3): 0.75, ("FSR-2", GATE, CUT_IN, 0): 0.5}
    idle = {("FSR-1", GATE, CUT_IN, number): "V" for number in range(CASES)}
    mixed = {
        ("FSR-1", GATE, CUT_IN, 0): "F",
        ("FSR-1", GATE, CUT_IN, 2): "E",
        ("FSR-2", GATE, BRAKING, 1): "?",
        ("FSR-2", OTHER, BRAKING, 1): "F",
        ("FSR-3", GATE, BRAKING, 3): "F",
    }
    return {
        "plain": plain,
        "some fail": baseline(verdicts=mixed, uncertainty=20),
        "idle": baseline(verdicts=idle, uncertainty=20),
        "margins": baseline(margins=margins, uncertainty=20),
        "margins, no cases": baseline(margins=margins).model_copy(update={"cases": None}),
        "fewer cases": baseline(numbers=range(1, 3)),
        "fewer scenarios": baseline(scenarios=(CUT_IN,)),
        "fewer FSRs": baseline(fsrs=("FSR-2", "FSR-3")),
        "tolerant": baseline(tolerance={"m": 0.5}),
        "another gate": baseline(gate=(OTHER,), channel_failures="allow"),
        "edited": baseline(
            architectures={GATE: sha("edited"), OTHER: sha(OTHER)},
            scenarios=(CUT_IN, BRAKING),
            numerics="highway",
            concept_digest=sha("another"),
            attributes=sha("rain"),
            designs=dict.fromkeys((CUT_IN, BRAKING), "random"),
        ),
        "drivers": baseline(preventable_by=("cc", "fsm")),
        **{
            name: plain.model_copy(
                update={"fsrs": {**plain.fsrs, "FSR-1": fsr_of("FSR-1", **change)}}
            )
            for name, change in changed.items()
        },
    }


def test_findings_are_frozen() -> None:
    """From each of some baselines to each other one: what decides, and what is a note."""
    known_ones = variants()
    lines = []
    for then in ("plain", "some fail", "margins", "fewer cases", "edited", "idle"):
        for now, content in known_ones.items():
            findings = found(known_ones[then], content, **({"m": 0.3} if now == "idle" else {}))
            lines.append(f"{then} -> {now}: {gate_code_of(findings, ExitCode.OK).name}")
            lines += [
                f"  {'!' if item.decides else ' '} {item} {list(item.runs)}" for item in findings
            ]
    for now, content in known_ones.items():
        lines += [f"{now} alone: {item}" for item in state_of(content)]
    assert_frozen("gate_findings.txt", "\n".join([*lines, ""]))


def test_baseline_of_another_odd_is_refused() -> None:
    with pytest.raises(UsageError, match="baseline of ODD 'small', the campaign is of 'other'"):
        check_same_odd(baseline(), baseline(odd="other"), "b.json")


def test_finding_says_what_it_is_about() -> None:
    finding = Finding(Kind.MARGIN, "lost", fsr="FSR-1", scenario="cut_in")
    assert str(finding) == "margin: FSR-1, cut_in: lost"
    assert str(Finding(Kind.NOTE, "edited")) == "note: edited"


def test_what_decides_is_as_bad_as_its_kind_and_nothing_else_changes_the_code() -> None:
    for kind in Kind:
        assert gate_code_of([Finding(kind, "x", decides=False)], ExitCode.OK) is ExitCode.OK
        found = [Finding(kind, "x")]
        assert gate_code_of(found, ExitCode.OK) is kind.code
        assert (deciding(found) == found) is (kind.code is not ExitCode.OK)
    # A baseline makes no campaign better.
    for code in (ExitCode.FAILED, ExitCode.INCOMPLETE, ExitCode.INTEGRITY):
        assert gate_code_of([Finding(Kind.NEWLY_PASSING, "x")], code) is code


def test_several_codes_are_combined_as_everywhere() -> None:
    kinds = (Kind.MISSING, Kind.MARGIN)
    assert gate_code_of([Finding(kind, "x") for kind in kinds], ExitCode.OK) is ExitCode.FAILED
    found = [Finding(kind, "x") for kind in (*kinds, Kind.INTEGRITY)]
    assert gate_code_of(found, ExitCode.OK) is ExitCode.INTEGRITY


def judged(
    executed: Executed,
    path: Path | None = None,
    *,
    may_lack: bool = False,
    tolerances: Tolerances | None = None,
) -> GateResult:
    with executed.opened() as (repository, campaign):
        given = tolerances or Tolerances()
        return judge_campaign(repository, campaign, path, given, may_lack=may_lack)


@pytest.fixture(scope="module")
def result(mini: Executed) -> GateResult:
    return judged(mini)


def test_without_a_baseline_the_answer_is_that_of_the_run(
    result: GateResult, mini: Executed
) -> None:
    assert result.exit_code is mini.summary.exit_code is ExitCode.OK
    assert result.message == mini.summary.message
    assert (result.own, result.changes) == ((), ())


def test_baseline_of_the_campaign_itself_finds_nothing(
    mini: Executed, result: GateResult, tmp_path: Path
) -> None:
    path = tmp_path / "b.json"
    written = update_baseline(result, path, accepts_incomplete=False)
    assert (written.is_written, written.exit_code) == (True, ExitCode.OK)
    assert read_baseline(path) == result.state
    assert judged(mini, path).changes == ()


def test_baseline_that_is_not_there_is_refused_unless_it_is_written(
    mini: Executed, tmp_path: Path
) -> None:
    refused(SpecError, judged, mini, tmp_path / "none.json", says="no such baseline")
    assert judged(mini, tmp_path / "none.json", may_lack=True).exit_code is ExitCode.OK


def test_only_complete_evidence_becomes_a_baseline(result: GateResult, tmp_path: Path) -> None:
    for kind, accepts, code, is_written in (
        (Kind.UNDECIDED, False, 3, False),
        (Kind.UNDECIDED, True, 3, True),
        (Kind.MISSING, False, 3, False),
        (Kind.FAILING, False, 1, True),
        (Kind.INTEGRITY, False, 4, False),
        (Kind.INTEGRITY, True, 4, False),
    ):
        path = tmp_path / f"{kind}_{accepts}.json"
        open_result = replace(result, own=(Finding(kind, "x"),))
        written = update_baseline(open_result, path, accepts_incomplete=accepts)
        assert (int(written.exit_code), written.is_written) == (code, is_written)
        assert path.exists() is is_written


def test_tolerance_for_nothing_is_refused(
    mini: Executed, result: GateResult, tmp_path: Path
) -> None:
    update_baseline(result, tmp_path / "b.json", accepts_incomplete=False)
    with pytest.raises(UsageError, match="'km' is neither"):
        judged(mini, tmp_path / "b.json", tolerances=Tolerances({"km": 1.0}))


def test_unit_of_what_has_none_is_one_only_where_something_has_none() -> None:
    assert compared_units(baseline(), baseline()) == {"m"}
    refused(UsageError, Tolerances({"1": 5.0}).check, ["FSR-1"], ["m"], says="'1' is neither")
    # Divided by the scale, as where the two sides measure different signals.
    now, margin = baseline(), Margin(value=0.5, unit="1", robustness=0.5)
    for measure in (None, "m distance"):
        parts = [
            part.model_copy(update={"measures": (measure, *part.measures[1:])})
            for part in known(now.cases)
        ]
        other = now.model_copy(update={"cases": tuple(parts)})
        assert compared_units(baseline(), other) == {"m", "1"}
        assert compared_units(other, other) == {"m", "1"} - ({"1"} if measure else set())
    cells = [cell.model_copy(update={"margin": margin}) for cell in now.cells]
    assert compared_units(baseline(), now.model_copy(update={"cells": tuple(cells)})) == {"m", "1"}


def test_withdrawn_results_are_said_whatever_waives_their_runs(
    mini: Executed, tmp_path: Path
) -> None:
    shutil.copy(mini.db, tmp_path / "x.db")
    with Repository.open(tmp_path / "x.db") as repository:
        campaign = repository.find_campaign()
        run = repository.find_run("0", campaign=campaign.id)
        repository.evidence.withdraw(run.result_digest, author="J. Doe", reason="wrong map")
        found = judge_campaign(repository, campaign, None, Tolerances())
    (said,) = [item for item in found.own if item.kind is Kind.MISSING]
    assert said.decides
    assert said.text == (f"1 result is withdrawn ({run.result_digest[:12]} by J. Doe: wrong map)")


def test_only_a_contact_that_no_named_driver_avoids_is_set_aside(
    suites: Executed, monkeypatch: pytest.MonkeyPatch
) -> None:
    failing = Finding(Kind.FAILING, "FAIL", fsr="FSR-01", architecture="camera_radar")
    for verdict, models, decides in (
        (Verdict.PASS, ("cc",), False),
        (Verdict.FAIL, ("cc",), True),
        (Verdict.INCONCLUSIVE, ("cc",), True),
        (Verdict.PASS, (), True),
    ):
        monkeypatch.setattr(totals, "preventable_by", lambda *_, found=models: found)
        monkeypatch.setattr(
            totals, "without_unpreventable", lambda *_, found=verdict: (found, "by cc")
        )
        with suites.opened() as (repository, campaign):
            set_aside = gating._set_aside(repository, campaign)
            told = set_aside(failing)
            assert told.decides is decides
            assert told.text == ("FAIL; by cc" if models else "FAIL")
            for other in (
                replace(failing, kind=Kind.UNDECIDED),
                replace(failing, kind=Kind.NEWLY_FAILING),
                replace(failing, fsr="FSR-99"),
                replace(failing, decides=False),
            ):
                assert set_aside(other) == other


@pytest.mark.parametrize(
    ("verdict", "kind", "decides"),
    [
        (Verdict.PASS, Kind.FAILING, False),
        (Verdict.FAIL, Kind.FAILING, True),
        (Verdict.VACUOUS, Kind.UNDECIDED, True),
        (Verdict.NOT_RUN, Kind.UNDECIDED, True),
    ],
)
def test_what_is_left_without_unpreventable_contacts_has_the_code_of_that(
    monkeypatch: pytest.MonkeyPatch, verdict: Verdict, kind: Kind, *, decides: bool
) -> None:
    monkeypatch.setattr(totals, "preventable_by", lambda *_: ("cc",))
    monkeypatch.setattr(totals, "without_unpreventable", lambda *_: (verdict, "unpreventable"))
    judged: Any = SimpleNamespace(fsr="FSR-01", architecture="a")
    repository: Any = SimpleNamespace(gate=lambda _: [judged])
    campaign: Any = SimpleNamespace(id="c")
    aside = gating._set_aside(repository, campaign)
    found = aside(Finding(Kind.FAILING, "FAIL", fsr="FSR-01", architecture="a"))
    assert (found.kind, found.decides, found.text) == (kind, decides, "FAIL; unpreventable")
    assert aside(Finding(Kind.MARGIN, "less", fsr="FSR-01", architecture="a")).text == "less"
