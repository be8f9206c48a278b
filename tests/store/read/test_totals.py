"""One FSR for one architecture over all runs, and the gate's exit code."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import date
from functools import partial
from types import SimpleNamespace
from typing import Any

import pytest

from adeye.judge.evaluate import never_held
from adeye.judge.stl.batch import HELD, NEEDED, SPARE
from adeye.judge.uncertainty import Difference
from adeye.judge.verdict import ExitCode, Outcome, Verdict
from adeye.spec.concept import Waiver
from adeye.spec.load import shipped
from adeye.store.read.totals import (
    Total,
    explained,
    gate_code,
    preventable_by,
    standing_for,
    totals,
    without_unpreventable,
)
from adeye.store.records import ContentRecord, EventRecord
from adeye.store.repository import Repository
from adeye.store.write.half_steps import UncertaintyRecord
from tests.project import Executed
from tests.store.conftest import Store
from tests.stored import read_yaml

OPEN = (Verdict.ERROR, Verdict.INVALID, Verdict.INCONCLUSIVE, Verdict.VACUOUS)


def folded(store: Store, campaign: str | None = None) -> dict[tuple[str, str], Total]:
    """Fold every FSR of a campaign, by FSR and architecture."""
    chosen = store.repository.find_campaign(campaign or store.campaign())
    found = totals(store.repository, chosen)
    return {(item.fsr, item.architecture): item for item in found}


def assert_gate(store: Store, code: ExitCode, *words: str, campaign: str | None = None) -> str:
    """Ask the gate of a campaign, which says these words; return all that it says."""
    chosen = store.repository.find_campaign(campaign or store.campaign())
    found, message = gate_code(store.repository, chosen)
    assert found is code, message
    for word in words:
        assert word in message
    return message


def judged(fsr: str, architecture: str, verdict: Verdict = Verdict.FAIL) -> Any:
    """Judge one FSR so in every run of an architecture; all else passes."""
    at = ("legacy", "new").index(architecture)

    def verdict_of(case: Any, name: str) -> Verdict:
        return verdict if name == fsr and case.ordinal % 2 == at else Verdict.PASS

    return verdict_of


@pytest.fixture(autouse=True)
def everywhere(example: Any) -> None:
    """Judge FSR3, which is for other conditions, inside the ODD, too."""
    example.require(applies="everywhere")


def test_runs_of_all_scenarios_are_counted_together_and_those_of_one_alone(store: Store) -> None:
    told = folded(store)
    found = told["FSR1", "new"]
    assert (found.verdict, found.runs, found.exercised) == (Verdict.PASS, 4, 4)
    assert dict(found.counts) == {Verdict.PASS: 4}
    assert (found.asil, found.is_mandatory, found.is_in_gate) == ("B", True, True)
    assert told["FSR3", "new"].runs == 2


@pytest.mark.parametrize("kinds", [tuple(Verdict)[:3], tuple(Verdict)[:6], tuple(Verdict)[3:6]])
def test_all_name_the_same_worst_run(store: Store, kinds: tuple[Verdict, ...]) -> None:
    """Margins tie as often as capped ones do; what failed is below what did not."""
    store.example.verdict_of = lambda case, _fsr: kinds[(case.ordinal // 3) % len(kinds)]
    store.example.margin_of = lambda case: (10.0, 10.0, 7.0, 10.0)[case.ordinal % 4]
    campaign = store.campaign(24, block_size=5)
    rows = store.rows(
        "SELECT fsr, architecture, verdict, margin, run FROM v_verdicts "
        "WHERE verdict IN ('FAIL', 'PASS', 'INCONCLUSIVE')"
    )
    views = store.rows("SELECT fsr, architecture, worst_run FROM v_gate")
    assert views
    found = folded(store, campaign)
    for fsr, architecture, run in views:
        own = [row for row in rows if tuple(row[:2]) == (fsr, architecture)]
        least = min(own, key=lambda row: (row[2] != "FAIL", row[3], row[4]), default=None)
        total = found[fsr, architecture].worst
        assert run == (None if least is None else least[4])
        assert run == (None if total is None else total[0].result_digest)


@pytest.mark.parametrize(
    ("fsr", "architecture", "verdict", "said"),
    [
        ("FSR1", "new", Verdict.PASS, "Every mandatory requirement passes for new."),
        # The legacy architecture is not in the gate, and FSR2 is not mandatory.
        ("FSR1", "legacy", Verdict.FAIL, "Every mandatory requirement passes for new"),
        ("FSR2", "new", Verdict.FAIL, "Every mandatory requirement passes for new"),
        *(("FSR1", "new", verdict, f"FSR1 {verdict} for new") for verdict in OPEN),
        ("FSR1", "new", Verdict.FAIL, "FSR1 FAIL for new"),
    ],
)
def test_gate_is_open_for_whatever_is_mandatory_there_and_no_pass(
    store: Store, fsr: str, architecture: str, verdict: Verdict, said: str
) -> None:
    store.example.verdict_of = judged(fsr, architecture, verdict)
    campaign = store.campaign()
    code = ExitCode.FAILED if verdict is Verdict.FAIL else ExitCode.INCOMPLETE
    assert_gate(store, ExitCode.OK if "passes" in said else code, said, campaign=campaign)
    assert folded(store, campaign)[fsr, architecture].verdict is verdict


def test_gate_that_asks_for_nothing_says_so(store: Store) -> None:
    store.example.require(mandatory=False)
    assert assert_gate(store, ExitCode.INCOMPLETE) == "no FSR is mandatory for new"


def test_unfinished_campaign_is_no_success(store: Store) -> None:
    campaign = store.plan(8, block_size=4).campaign
    block = store.claim(campaign)
    store.complete(block, verdicts=store.example.judged(block))
    told = "4 of 8 test cases accounted for"
    assert_gate(store, ExitCode.INCOMPLETE, told, campaign=campaign)
    found = folded(store, campaign)["FSR1", "new"]
    assert found.verdict is Verdict.NOT_RUN
    assert dict(found.counts) == {Verdict.PASS: 2, Verdict.NOT_RUN: 2}


def test_fsr_that_the_gate_cannot_judge_is_never_green(store: Store) -> None:
    store.example.not_applicable = {"FSR1": {"new": "no sensor radar"}}
    campaign = store.campaign()
    found = folded(store, campaign)["FSR1", "new"]
    assert (found.verdict, found.note, found.worst) == (None, "no sensor radar", None)
    assert_gate(store, ExitCode.INCOMPLETE, "FSR1 ERROR for new", campaign=campaign)


def test_fsr_that_another_architecture_cannot_have_is_only_noted(store: Store) -> None:
    store.example.not_applicable = {"FSR1": {"legacy": "no sensor radar"}}
    campaign = store.campaign()
    assert folded(store, campaign)["FSR1", "legacy"].verdict is None
    assert_gate(store, ExitCode.OK, campaign=campaign)


def break_channels(example: Any, **changes: Any) -> None:
    """Let channel a fail in every run, and channel b after it."""
    fields = {
        "outcome": Outcome.CHANNEL_ERROR,
        "outcome_channel": "a",
        "outcome_detail": "at 1 s: KeyError: 1 (own.py:7)",
        "events": [
            EventRecord(1.0, "channel", "a", "channel_error: KeyError: 1 (own.py:7)"),
            EventRecord(1.0, "channel", "a", "channel a: silent"),
            EventRecord(2.0, "channel", "b", "channel_killed: by SIGKILL"),
        ],
    }
    fields.update(changes)
    run = example.run
    example.run = lambda case: run(case, **fields)


def about(example: Any, *channels: str, **changes: Any) -> None:
    """Make FSR1 an FSR about the silence of channels."""
    silent = " or ".join(f"channel.{name}.status == silent" for name in channels)
    formula = f"always(({silent}) implies x > 1)" if channels else "always(x > 1)"
    example.requirements = tuple(
        item.model_copy(update={"formula": formula, **changes}) if item.id == "FSR1" else item
        for item in example.requirements
    )


def passes_late(example: Any) -> None:
    """Let every FSR pass in the second half of the runs only."""
    about(example, "a", "b")
    example.verdict_of = lambda case, _: Verdict.PASS if case.ordinal > 1 else Verdict.VACUOUS


def allowed(example: Any) -> None:
    asked = {"architectures": ["new"], "channel_failures": "allow"}
    example.odd = ContentRecord("motorway", "1", {"odd": {"odd": "motorway", "gate": asked}})


A = "channel a in 4 runs of new (KeyError: 1 (own.py:7))"
B = "channel b in 4 runs of new (by SIGKILL)"
LEGACY = "channel_error of channel a in 4 runs of legacy (KeyError: 1 (own.py:7));"
WITH_FAILURES: dict[str, tuple[Callable[[Any], object], ExitCode, tuple[str, ...]]] = {
    # What failed after it in the same run hides behind nothing; legacy is not in the gate.
    "no FSR is about it": (about, ExitCode.INCOMPLETE,
                           (f"channel_error of {A}, refused",
                            f"channel_killed of {B}, refused", LEGACY)),
    "an FSR is about one": (lambda it: about(it, "a"), ExitCode.INCOMPLETE,
                            (f"{A}, which FSR1 is about", f"{B}, refused: in 4 runs")),
    "an FSR is about both": (lambda it: about(it, "a", "b"), ExitCode.OK,
                             (f"channel_killed of {B}, which FSR1",)),
    "it passes in some": (passes_late, ExitCode.INCOMPLETE, (f"{A}, refused: in 1 run ",)),
    "it is optional": (lambda it: about(it, "a", "b", mandatory=False), ExitCode.INCOMPLETE, ()),
    "the ODD allows it": (allowed, ExitCode.OK, (f"{A}, allowed by the ODD",)),
    "an FSR fails": (lambda it: setattr(it, "verdict_of", judged("FSR1", "new")), ExitCode.FAILED,
                     ("channel_error of channel a",)),
}  # fmt: skip


@pytest.mark.parametrize("name", WITH_FAILURES)
def test_channel_that_fails_needs_a_passing_fsr(store: Store, name: str) -> None:
    prepare, code, words = WITH_FAILURES[name]
    break_channels(store.example)
    prepare(store.example)
    assert_gate(store, code, *words)


@pytest.mark.parametrize("outcome", [item for item in Outcome if item.value[:8] == "channel_"])
def test_however_a_channel_fails_it_is_refused(store: Store, outcome: Outcome) -> None:
    break_channels(store.example, outcome=outcome, events=[])
    assert_gate(store, ExitCode.INCOMPLETE, f"{outcome} of channel a in 4 runs of new")


def test_what_happened_most_often_is_told_and_the_rest_is_counted(store: Store) -> None:
    break_channels(store.example, events=[])
    run = store.example.run
    store.example.run = lambda case: replace(
        run(case), outcome_detail=f"at {case.ordinal} s: {'one' if case.ordinal > 1 else 'two'}"
    )
    assert_gate(store, ExitCode.INCOMPLETE, "channel a in 4 runs of new (one, and 1 more)")


def test_contact_is_said_beside_a_green_answer(store: Store) -> None:
    run = store.example.run
    store.example.run = lambda case: run(
        case, end_reason="contact" if case.ordinal < 3 else "horizon"
    )
    campaign = store.campaign()
    told = "Every mandatory requirement passes for new; contact in 1 run of new"
    assert assert_gate(store, ExitCode.OK, campaign=campaign) == told
    assert store.repository.contacts(campaign) == {"legacy": 2, "new": 1}


def test_verdicts_that_hang_on_the_step_are_said_beside_the_green(store: Store) -> None:
    asked = {"gate": {"architectures": ["new"]}, "uncertainty": {"situations": 10}}
    store.example.odd = ContentRecord("motorway", "1", {"odd": asked})
    campaign = store.campaign()
    of_fsr = Difference("fsr", "FSR1", "m", 4, 0, None, None, 3, {"PASS → FAIL": 3})
    of_metric = replace(of_fsr, kind="metric", name="min_distance_m")
    few = Difference("fsr", "FSR3", "m", 12, 9, 0.1, 0.2, 0, {})
    found = [
        UncertaintyRecord("cut_in", "new", of_fsr, "f" * 64, "e" * 64),
        UncertaintyRecord("cut_in", "legacy", of_fsr, "f" * 64, "d" * 64),
        UncertaintyRecord("cut_in", "new", of_metric),
        UncertaintyRecord("cut_in", "new", few, "f" * 64, "c" * 64),
    ]
    store.repository.hindsight.half_steps.save_uncertainty(campaign, found)
    told = assert_gate(store, ExitCode.OK, campaign=campaign)
    assert told.partition("; ")[2] == (
        "FSR1 for new: half the step changes 3 of 4 verdicts of cut_in (3 PASS → FAIL); "
        "FSR3 for new: 9 of 12 margins of cut_in do not tell what the step is worth"
    )


def test_too_few_exercised_runs_are_vacuous(store: Store) -> None:
    store.example.require(min_exercised=5)
    campaign = store.campaign()
    found = folded(store, campaign)
    assert found["FSR1", "new"].verdict is Verdict.VACUOUS
    assert found["FSR2", "legacy"].verdict is Verdict.VACUOUS
    told = "FSR1 VACUOUS for new (exercised in 4 of 5 needed)"
    assert_gate(store, ExitCode.INCOMPLETE, told, campaign=campaign)


@pytest.mark.parametrize("detail", [None, "sensor lost"])
def test_run_without_a_verdict_says_why(store: Store, detail: str | None) -> None:
    store.example.verdict_of = judged("FSR1", "new", Verdict.ERROR)
    store.example.detail_of = lambda _case: detail
    campaign = store.campaign()
    message = assert_gate(store, ExitCode.INCOMPLETE, campaign=campaign)
    assert message.startswith("FSR1 ERROR for new")
    assert ("(gap, sensor lost)" in message) is bool(detail)
    worst = partial(store.repository.worst_runs, campaign, "FSR1", architecture="new")
    assert worst() == ()
    assert len(worst(verdict=Verdict.ERROR, limit=1)) == 1


def test_run_that_stands_for_a_verdict_without_a_margin_has_that_verdict(store: Store) -> None:
    store.example.verdict_of = lambda case, fsr: (
        Verdict.ERROR if fsr == "FSR1" and case.ordinal == 2 else Verdict.PASS
    )
    store.example.detail_of = lambda _case: "sensor lost"
    campaign = store.repository.find_campaign(store.campaign())
    found = [item for item in totals(store.repository, campaign) if item.fsr == "FSR1"]
    assert {item.verdict for item in found} == {Verdict.ERROR, Verdict.PASS}
    for item in found:
        ((_, record),) = standing_for(store.repository, campaign, item, item.verdict)
        assert record.verdict is item.verdict
        told = "gap, sensor lost" if item.verdict is Verdict.ERROR else ""
        assert explained(record) == told


def test_results_count_once_and_runs_as_they_are(store: Store) -> None:
    store.example.trace_of = lambda case: ("5" if case.ordinal < 6 else "6") * 32
    store.example.margin_of = lambda _case: 1.0
    campaign = store.campaign()
    found = folded(store, campaign)["FSR1", "new"]
    assert (found.runs, found.exercised, found.repeated) == (4, 2, 2)
    cells = {
        item.scenario: item.exercised
        for item in store.repository.fsr_status(campaign)
        if (item.fsr, item.architecture) == ("FSR1", "new")
    }
    # The two of one scenario are one result; so is one of the other scenario, over both.
    assert cells == {"cut_in": 1, "braking": 2}


@pytest.mark.parametrize("mandatory", [True, False])
@pytest.mark.parametrize(("asked", "verdict"), [(1, Verdict.PASS), (2, Verdict.VACUOUS)])
def test_min_exercised(store: Store, asked: int, verdict: Verdict, *, mandatory: bool) -> None:
    store.example.require(min_exercised=asked, mandatory=mandatory)
    store.example.same_result()
    campaign = store.campaign()
    assert {item.verdict for item in folded(store, campaign).values()} == {verdict}


def test_one_drive_is_one_result_whatever_margins_it_was_given(store: Store) -> None:
    store.example.trace_of = lambda _case: "5" * 32
    found = folded(store, store.campaign())["FSR1", "new"]
    assert (found.runs, found.exercised, found.repeated) == (4, 1, 3)


def test_withdrawn_results_never_count_below_what_is_left(store: Store) -> None:
    store.example.same_result()
    campaign = store.campaign()
    run = store.repository.find_run("1", campaign=campaign)
    assert store.repository.evidence.withdraw(run.result_digest, author="me", reason="wrong map")
    assert folded(store, campaign)["FSR1", "new"].exercised == 1


@pytest.mark.parametrize(
    ("kinds", "verdict"),
    [((NEEDED,), Verdict.VACUOUS), ((SPARE,), Verdict.PASS), ((HELD, HELD), Verdict.PASS)],
)
@pytest.mark.parametrize("mandatory", [True, False])
def test_nested_implication_that_no_run_asked_for(
    store: Store, kinds: tuple[int, ...], verdict: Verdict, *, mandatory: bool
) -> None:
    store.example.repeat(*kinds)
    store.example.require(mandatory=mandatory)
    campaign = store.campaign()
    found = folded(store, campaign)["FSR1", "new"]
    assert found.verdict is verdict
    named = [item.antecedent for item in found.never_held]
    assert named == (["gap >= 9"] if kinds[0] != HELD else [])
    if mandatory and named:
        code = ExitCode.OK if verdict is Verdict.PASS else ExitCode.INCOMPLETE
        assert_gate(store, code, "gap >= 9 never held", campaign=campaign)


def test_runs_that_are_waived_are_said_beside_the_green(store: Store) -> None:
    store.example.judge(Verdict.INVALID, 1)
    store.example.waivers = tuple(
        Waiver(requirement=name, reason="known", author="me", expires=date(2999, 1, 1))
        for name in ("FSR1", "FSR3")
    )
    campaign = store.campaign(8)
    assert_gate(store, ExitCode.OK, "FSR1 for new: 1 run waived", campaign=campaign)


def test_one_run_that_asks_for_it_is_enough(store: Store) -> None:
    store.example.repeat(NEEDED)
    store.example.detail_of = lambda case: None if case.ordinal == 3 else never_held([NEEDED])
    campaign = store.campaign()
    assert folded(store, campaign)["FSR1", "new"].verdict is Verdict.PASS
    assert folded(store, campaign)["FSR1", "legacy"].verdict is Verdict.VACUOUS


def repository(odd: Any, failures: Any = (), formula: str = "always(not contact)") -> Any:
    status = SimpleNamespace(
        fsr="FSR-01",
        architecture="a",
        counts={Verdict.FAIL: 1, Verdict.PASS: 2},
        min_exercised=1,
        waived_until=None,
        repeated_passes=0,
    )
    benchmarks = SimpleNamespace(failures=lambda *_: list(failures))
    concept = read_yaml(shipped("odd") / "concepts" / "motorway_chauffeur.yaml")
    concept["requirements"][0]["formula"] = formula
    return SimpleNamespace(
        content=lambda kind, _: concept if kind == "concept" else {"odd": odd},
        gate=lambda _: (status,),
        hindsight=SimpleNamespace(benchmarks=benchmarks),
    )


CAMPAIGN: Any = SimpleNamespace(id="c", number=3, odd_digest="d", concept_digest="e")


@pytest.mark.parametrize(
    ("odd", "models"),
    [
        ({"gate": {"architectures": ["a"], "preventable_by": ["cc"]}}, ("cc",)),
        ({"gate": {"architectures": ["a"]}}, ()),
        ({"gate": None}, ()),
        ({}, ()),
        ("motorway", ()),
    ],
)
def test_models_are_those_of_the_gate(odd: Any, models: tuple[str, ...]) -> None:
    assert preventable_by(repository(odd), CAMPAIGN) == models


@pytest.mark.parametrize(
    ("failures", "verdict", "note"),
    [
        ([{"cc": "neither"}], Verdict.PASS, "not blocking: unpreventable by cc (1 run)"),
        ([{"cc": "only_model"}], Verdict.FAIL, ""),
        ([{}], Verdict.FAIL, ""),
        (
            [{"": "unknown"}],
            Verdict.FAIL,
            "1 run not known to be unpreventable by cc: run `adeye preventability 3 --model cc`",
        ),
    ],
)
def test_notes(failures: Any, verdict: Verdict, note: str) -> None:
    found = without_unpreventable(repository({}, failures), CAMPAIGN, "FSR-01", "a", ["cc"])
    assert found == (verdict, note)


def test_fault_that_does_nothing_is_said_beside_what_passes(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    def idle(declared: Any, _injected: Any) -> list[tuple[str, str]]:
        return [*declared, ("quiet", "acts on a sensor that nothing is linked to")]

    monkeypatch.setattr("adeye.spec.fault.idle_faults", idle)
    monkeypatch.setattr(Repository, "injected_faults", lambda *_: [((), None)])
    assert_gate(store, ExitCode.OK, "fault quiet acts on a sensor that nothing is linked to")


@pytest.mark.parametrize(
    "formula",
    [
        "always(not contact and ego.acceleration >= -7.8 m/s^2)",
        "always(not contact) and always(any_actor.distance >= 0.5 m)",
        "always(ego.acceleration >= -7.8 m/s^2)",
    ],
)
def test_fsr_that_is_about_more_than_contacts_is_not_set_aside(formula: str) -> None:
    given = repository({}, [{"cc": "neither"}], formula)
    verdict, note = without_unpreventable(given, CAMPAIGN, "FSR-01", "a", ["cc"])
    assert verdict is Verdict.FAIL
    assert "FSR-01 is about" in note
    assert "an FSR of its own" in note


@pytest.mark.parametrize(
    ("backend", "variant", "said"),
    [
        ("batch", "reference-7", ""),
        ("batch", "fast-2", "traffic was simulated by batch fast-2, which is not the default"),
        ("highway", "highway-env-1", "by highway highway-env-1, which is not the default"),
    ],
)
def test_green_says_which_traffic_it_was_if_somebody_chose_another(
    mini: Executed, backend: str, variant: str, said: str
) -> None:
    with mini.opened() as (repository, campaign):
        other = {**campaign.provenance, "backend": backend, "variant": variant}
        code, text = gate_code(repository, replace(campaign, provenance=other))
    assert code is ExitCode.OK
    assert text.endswith(said)
    assert ("traffic" in text) is bool(said)
