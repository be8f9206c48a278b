"""One FSR for one architecture over all runs, and the gate's exit code."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from adeye.judge.evaluate import never_held
from adeye.judge.stl.batch import HELD, NEEDED, SPARE
from adeye.judge.verdict import ExitCode, Outcome, Verdict
from adeye.store.read.totals import Total, gate_code, preventable_by, totals, without_unpreventable
from adeye.store.records import ContentRecord, EventRecord
from adeye.store.repository import Repository
from tests.store.rows import complete_block


def folded(repository: Repository, campaign: str) -> dict[tuple[str, str], Total]:
    found = totals(repository, repository.find_campaign(campaign))
    return {(item.fsr, item.architecture): item for item in found}


def gate(repository: Repository, campaign: str) -> tuple[ExitCode, str]:
    return gate_code(repository, repository.find_campaign(campaign))


def failing(fsr: str, architecture_ordinal: int, verdict: Verdict = Verdict.FAIL) -> Any:
    """Judge one FSR so in every run of an architecture: legacy 0, new 1."""

    def verdict_of(case: Any, name: str) -> Verdict:
        is_meant = name == fsr and case.ordinal % 2 == architecture_ordinal
        return verdict if is_meant else Verdict.PASS

    return verdict_of


@pytest.fixture(autouse=True)
def everywhere(example: Any) -> None:
    """Judge FSR3, which is for other conditions, inside the ODD, too."""
    example.requirements = tuple(
        item.model_copy(update={"applies": "everywhere"}) for item in example.requirements
    )


def test_runs_of_all_scenarios_are_counted_together(repository: Repository, example: Any) -> None:
    campaign = example.campaign(repository, 8)
    found = folded(repository, campaign)["FSR1", "new"]
    assert (found.verdict, found.runs, found.exercised) == (Verdict.PASS, 4, 4)
    assert dict(found.counts) == {Verdict.PASS: 4}
    assert (found.asil, found.is_mandatory, found.is_in_gate) == ("B", True, True)


def test_fsr_of_one_scenario_counts_its_runs_only(repository: Repository, example: Any) -> None:
    assert folded(repository, example.campaign(repository, 8))["FSR3", "new"].runs == 2


@pytest.mark.slow
def test_worst_run_is_the_one_with_the_least_margin(repository: Repository, example: Any) -> None:
    found = folded(repository, example.campaign(repository, 8))["FSR1", "new"]
    assert found.worst is not None
    run, record = found.worst
    assert (run.ordinal, record.margin) == (1, 2.0)


@pytest.mark.parametrize("kinds", [tuple(Verdict)[:3], tuple(Verdict)[:6], tuple(Verdict)[3:6]])
def test_totals_views_and_rows_name_the_same_run_as_the_worst(
    repository: Repository, raw: Any, example: Any, kinds: tuple[Verdict, ...]
) -> None:
    """Margins tie as often as capped ones do; what failed is below what did not."""
    example.verdict_of = lambda case, _fsr: kinds[(case.ordinal // 3) % len(kinds)]
    example.margin_of = lambda case: (10.0, 10.0, 7.0, 10.0)[case.ordinal % 4]
    campaign = example.campaign(repository, 24, block_size=5)
    rows = raw.execute(
        "SELECT fsr, architecture, verdict, margin, run FROM v_verdicts "
        "WHERE verdict IN ('FAIL', 'PASS', 'INCONCLUSIVE')"
    ).fetchall()
    views = raw.execute("SELECT fsr, architecture, worst_run FROM v_gate").fetchall()
    assert views
    found = folded(repository, campaign)
    for fsr, architecture, run in views:
        own = [row for row in rows if tuple(row[:2]) == (fsr, architecture)]
        least = min(own, key=lambda row: (row[2] != "FAIL", row[3], row[4]), default=None)
        total = found[fsr, architecture].worst
        assert run == (None if least is None else least[4])
        assert run == (None if total is None else total[0].result_digest)


@pytest.mark.slow
def test_gate_is_green_when_every_mandatory_fsr_passes(
    repository: Repository, example: Any
) -> None:
    code, message = gate(repository, example.campaign(repository))
    assert code is ExitCode.OK
    assert message == "Every mandatory requirement passes for new."


@pytest.mark.parametrize(
    ("fsr", "architecture", "code"),
    [
        ("FSR1", 1, ExitCode.FAILED),
        ("FSR1", 0, ExitCode.OK),  # the legacy architecture is not in the gate
        ("FSR2", 1, ExitCode.OK),  # not mandatory
    ],
)
def test_only_mandatory_failures_in_the_gate_count(
    repository: Repository, example: Any, fsr: str, architecture: int, code: ExitCode
) -> None:
    example.verdict_of = failing(fsr, architecture)
    campaign = example.campaign(repository)
    found, message = gate(repository, campaign)
    assert found is code
    assert ("FSR1 FAIL for new" in message) is (code is ExitCode.FAILED)
    name = ("legacy", "new")[architecture]
    assert folded(repository, campaign)[fsr, name].verdict is Verdict.FAIL


@pytest.mark.slow
def test_gate_that_asks_for_nothing_says_so(repository: Repository, example: Any) -> None:
    example.requirements = tuple(
        item.model_copy(update={"mandatory": False}) for item in example.requirements
    )
    code, message = gate(repository, example.campaign(repository))
    assert code is ExitCode.INCOMPLETE
    assert message == "no FSR is mandatory for new"


@pytest.mark.parametrize(
    "verdict", [Verdict.ERROR, Verdict.INVALID, Verdict.INCONCLUSIVE, Verdict.VACUOUS]
)
def test_anything_but_pass_leaves_the_gate_open_and_is_named(
    repository: Repository, example: Any, verdict: Verdict
) -> None:
    example.verdict_of = failing("FSR1", 1, verdict)
    code, message = gate(repository, example.campaign(repository))
    assert code is ExitCode.INCOMPLETE
    assert f"FSR1 {verdict} for new" in message


def test_unfinished_campaign_is_no_success(repository: Repository, example: Any) -> None:
    plan = repository.plan_campaign(example.record(), example.cases(8), block_size=4)
    block = repository.claim_block(campaign=plan.campaign)
    assert block is not None
    complete_block(repository, block, example.runs(block), example.judged(block))
    code, message = gate(repository, plan.campaign)
    assert code is ExitCode.INCOMPLETE
    assert "4 of 8 test cases accounted for" in message
    found = folded(repository, plan.campaign)["FSR1", "new"]
    assert found.verdict is Verdict.NOT_RUN
    assert dict(found.counts) == {Verdict.PASS: 2, Verdict.NOT_RUN: 2}


def test_fsr_that_the_gate_cannot_judge_is_never_green(
    repository: Repository, example: Any
) -> None:
    example.not_applicable = {"FSR1": {"new": "no sensor radar"}}
    campaign = example.campaign(repository)
    found = folded(repository, campaign)["FSR1", "new"]
    assert (found.verdict, found.note, found.worst) == (None, "no sensor radar", None)
    code, message = gate(repository, campaign)
    assert code is ExitCode.INCOMPLETE
    assert "FSR1 ERROR for new" in message


def test_fsr_that_another_architecture_cannot_have_is_only_noted(
    repository: Repository, example: Any
) -> None:
    example.not_applicable = {"FSR1": {"legacy": "no sensor radar"}}
    campaign = example.campaign(repository)
    assert folded(repository, campaign)["FSR1", "legacy"].verdict is None
    assert gate(repository, campaign)[0] is ExitCode.OK


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
    asked = " and ".join(f"channel.{name}.status != silent" for name in channels)
    formula = f"always({asked} or x > 1)" if channels else "always(x > 1)"
    example.requirements = tuple(
        item.model_copy(update={"formula": formula, **changes}) if item.id == "FSR1" else item
        for item in example.requirements
    )


def allow(example: Any) -> None:
    gate = {"architectures": ["new"], "channel_failures": "allow"}
    content = {"odd": {"odd": "motorway", "gate": gate}}
    example.odd = ContentRecord("motorway", "1", content)


@pytest.mark.slow
def test_channel_that_fails_is_no_success_though_everything_passes(
    repository: Repository, example: Any
) -> None:
    break_channels(example)
    campaign = example.campaign(repository, 8)
    code, message = gate(repository, campaign)
    assert code is ExitCode.INCOMPLETE
    told = "channel_error of channel a in 4 runs of new (KeyError: 1 (own.py:7)), refused"
    assert told in message
    # What failed after it in the same run hides behind nothing.
    assert "channel_killed of channel b in 4 runs of new (by SIGKILL), refused" in message
    # The legacy architecture is not in the gate.
    assert "channel_error of channel a in 4 runs of legacy (KeyError: 1 (own.py:7));" in message


def test_every_channel_that_failed_needs_an_fsr_that_is_about_it(
    repository: Repository, example: Any
) -> None:
    break_channels(example)
    about(example, "a")
    campaign = example.campaign(repository, 8)
    code, message = gate(repository, campaign)
    assert code is ExitCode.INCOMPLETE
    assert "channel a in 4 runs of new (KeyError: 1 (own.py:7)), which FSR1 is about" in message
    assert "channel b in 4 runs of new (by SIGKILL), refused: in 4 runs" in message


def test_failure_that_a_passing_fsr_is_about_is_green_and_said(
    repository: Repository, example: Any
) -> None:
    break_channels(example)
    about(example, "a", "b")
    code, message = gate(repository, example.campaign(repository, 8))
    assert code is ExitCode.OK
    assert "channel_killed of channel b in 4 runs of new (by SIGKILL), which FSR1" in message


def test_fsr_excuses_a_failure_only_in_the_runs_that_it_passes_in(
    repository: Repository, example: Any
) -> None:
    break_channels(example)
    about(example, "a", "b")
    example.verdict_of = lambda case, _: Verdict.PASS if case.ordinal > 1 else Verdict.VACUOUS
    code, message = gate(repository, example.campaign(repository, 8))
    assert code is ExitCode.INCOMPLETE
    assert "channel a in 4 runs of new (KeyError: 1 (own.py:7)), refused: in 1 run " in message


def test_fsr_that_is_not_mandatory_excuses_no_failure(repository: Repository, example: Any) -> None:
    break_channels(example)
    about(example, "a", "b", mandatory=False)
    assert gate(repository, example.campaign(repository, 8))[0] is ExitCode.INCOMPLETE


@pytest.mark.slow
def test_failures_that_the_odd_allows_are_green_and_said(
    repository: Repository, example: Any
) -> None:
    break_channels(example)
    allow(example)
    code, message = gate(repository, example.campaign(repository, 8))
    assert code is ExitCode.OK
    assert "channel a in 4 runs of new (KeyError: 1 (own.py:7)), allowed by the ODD" in message


@pytest.mark.parametrize("outcome", [item for item in Outcome if item.value[:8] == "channel_"])
def test_however_a_channel_fails_it_is_refused(
    repository: Repository, example: Any, outcome: Outcome
) -> None:
    break_channels(example, outcome=outcome, events=[])
    code, message = gate(repository, example.campaign(repository, 8))
    assert code is ExitCode.INCOMPLETE
    assert f"{outcome} of channel a in 4 runs of new" in message


def test_failing_fsr_is_worse_than_a_failing_channel(repository: Repository, example: Any) -> None:
    break_channels(example)
    example.verdict_of = failing("FSR1", 1)
    code, message = gate(repository, example.campaign(repository, 8))
    assert code is ExitCode.FAILED
    assert "channel_error of channel a" in message


@pytest.mark.slow
def test_what_happened_most_often_is_told_and_the_rest_is_counted(
    repository: Repository, example: Any
) -> None:
    run = example.run
    example.run = lambda case: run(
        case,
        outcome=Outcome.CHANNEL_ERROR,
        outcome_channel="a",
        outcome_detail=f"at {case.ordinal} s: " + ("one" if case.ordinal > 1 else "two"),
        events=[],
    )
    message = gate(repository, example.campaign(repository, 8))[1]
    assert "channel a in 4 runs of new (one, and 1 more)" in message


def test_contact_is_said_beside_a_green_answer(repository: Repository, example: Any) -> None:
    run = example.run
    example.run = lambda case: run(case, end_reason="contact" if case.ordinal < 3 else "horizon")
    campaign = example.campaign(repository, 8)
    code, message = gate(repository, campaign)
    assert code is ExitCode.OK
    assert message == "Every mandatory requirement passes for new; contact in 1 run of new"
    assert repository.contacts(campaign) == {"legacy": 2, "new": 1}


@pytest.mark.slow
def test_too_few_exercised_runs_are_vacuous(repository: Repository, example: Any) -> None:
    example.requirements = tuple(
        item.model_copy(update={"min_exercised": 5}) for item in example.requirements
    )
    campaign = example.campaign(repository, 8)
    found = folded(repository, campaign)
    assert found["FSR1", "new"].verdict is Verdict.VACUOUS
    assert found["FSR2", "legacy"].verdict is Verdict.VACUOUS
    code, message = gate(repository, campaign)
    assert code is ExitCode.INCOMPLETE
    assert "FSR1 VACUOUS for new (exercised in 4 of 5 needed)" in message


def test_run_without_a_verdict_says_why(repository: Repository, example: Any) -> None:
    example.verdict_of = failing("FSR1", 1, Verdict.ERROR)
    told = example.campaign(repository, 8)
    assert repository.worst_runs(told, "FSR1", architecture="new") == ()
    (found,) = repository.worst_runs(
        told, "FSR1", architecture="new", verdict=Verdict.ERROR, limit=1
    )
    said = ", ".join(filter(None, (found[1].signal, found[1].detail)))
    code, message = gate(repository, told)
    assert code is ExitCode.INCOMPLETE
    assert message.startswith("FSR1 ERROR for new")
    assert (f"({said})" in message) is bool(found[1].detail)


def test_results_count_once_and_runs_as_they_are(repository: Repository, example: Any) -> None:
    example.trace_of = lambda case: ("5" if case.ordinal < 6 else "6") * 32
    example.margin_of = lambda _case: 1.0
    campaign = example.campaign(repository, 8)
    found = folded(repository, campaign)["FSR1", "new"]
    assert (found.runs, found.exercised, found.repeated) == (4, 2, 2)
    cells = {
        item.scenario: item.exercised
        for item in repository.fsr_status(campaign)
        if (item.fsr, item.architecture) == ("FSR1", "new")
    }
    # The two of one scenario are one result; so is one of the other scenario, over both.
    assert cells == {"cut_in": 1, "braking": 2}


@pytest.mark.parametrize("mandatory", [True, False])
@pytest.mark.parametrize(("asked", "verdict"), [(1, Verdict.PASS), (2, Verdict.VACUOUS)])
def test_min_exercised_asks_for_different_results(
    repository: Repository, example: Any, asked: int, verdict: Verdict, *, mandatory: bool
) -> None:
    example.requirements = tuple(
        item.model_copy(update={"min_exercised": asked, "mandatory": mandatory})
        for item in example.requirements
    )
    example.trace_of = lambda _case: "5" * 32
    example.margin_of = lambda _case: 1.0
    campaign = example.campaign(repository, 8)
    assert {item.verdict for item in folded(repository, campaign).values()} == {verdict}


def test_equal_traces_with_other_margins_are_other_results(
    repository: Repository, example: Any
) -> None:
    example.trace_of = lambda _case: "5" * 32
    found = folded(repository, example.campaign(repository, 8))["FSR1", "new"]
    assert (found.runs, found.exercised, found.repeated) == (4, 4, 0)


@pytest.mark.slow
def test_withdrawn_results_never_count_below_what_is_left(
    repository: Repository, example: Any
) -> None:
    example.trace_of = lambda _case: "5" * 32
    example.margin_of = lambda _case: 1.0
    campaign = example.campaign(repository, 8)
    run = repository.find_run("1", campaign=campaign)
    assert repository.evidence.withdraw(run.result_digest, author="me", reason="wrong map")
    assert folded(repository, campaign)["FSR1", "new"].exercised == 1


@pytest.mark.parametrize(
    ("kinds", "verdict"),
    [((NEEDED,), Verdict.VACUOUS), ((SPARE,), Verdict.PASS), ((HELD, HELD), Verdict.PASS)],
)
@pytest.mark.parametrize("mandatory", [True, False])
def test_nested_implication_that_no_run_asked_for(
    repository: Repository,
    example: Any,
    kinds: tuple[int, ...],
    verdict: Verdict,
    *,
    mandatory: bool,
) -> None:
    example.repeat(*kinds)
    example.requirements = tuple(
        item.model_copy(update={"mandatory": mandatory}) for item in example.requirements
    )
    campaign = example.campaign(repository, 8)
    found = folded(repository, campaign)["FSR1", "new"]
    assert found.verdict is verdict
    named = [item.antecedent for item in found.never_held]
    assert named == (["gap >= 9"] if kinds[0] != HELD else [])
    if mandatory and named:
        assert "gap >= 9 never held" in gate(repository, campaign)[1]


@pytest.mark.slow
def test_one_run_that_asks_for_it_is_enough(repository: Repository, example: Any) -> None:
    example.repeat(NEEDED)
    example.detail_of = lambda case: None if case.ordinal == 3 else never_held([NEEDED])
    campaign = example.campaign(repository, 8)
    assert folded(repository, campaign)["FSR1", "new"].verdict is Verdict.PASS
    assert folded(repository, campaign)["FSR1", "legacy"].verdict is Verdict.VACUOUS


def repository(odd: Any, failures: Any = (), counts: Any = None) -> Any:
    status = SimpleNamespace(
        fsr="FSR-01",
        architecture="a",
        counts=counts or {Verdict.FAIL: 1, Verdict.PASS: 2},
        min_exercised=1,
        waived_until=None,
        repeated_passes=0,
    )
    benchmarks = SimpleNamespace(failures=lambda *_: list(failures))
    return SimpleNamespace(
        content=lambda *_: {"odd": odd},
        gate=lambda _: (status,),
        hindsight=SimpleNamespace(benchmarks=benchmarks),
    )


CAMPAIGN: Any = SimpleNamespace(id="c", number=3, odd_digest="d")


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
