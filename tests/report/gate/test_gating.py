"""A stored campaign judged: alone, against its own baseline, altered, and written down."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from adeye.errors import SpecError, UsageError
from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.gate import decide as gating
from adeye.report.gate.baseline import Finding, Kind, read_baseline
from adeye.report.gate.changes import Tolerances
from adeye.report.gate.decide import GateResult, judge_campaign, update_baseline
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from pathlib import Path

    from tests.project import Executed


def judged(
    executed: Executed,
    path: Path | None = None,
    *,
    may_lack: bool = False,
    tolerances: Tolerances | None = None,
) -> GateResult:
    with Repository.open(executed.db, create=False) as repository:
        campaign = repository.find_campaign(executed.summary.campaign)
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


@pytest.mark.slow
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
    with pytest.raises(SpecError, match="no such baseline"):
        judged(mini, tmp_path / "none.json")
    assert judged(mini, tmp_path / "none.json", may_lack=True).exit_code is ExitCode.OK


@pytest.mark.parametrize(
    ("kind", "accepts", "expected"),
    [
        (Kind.UNDECIDED, False, (3, False)),
        (Kind.UNDECIDED, True, (3, True)),
        (Kind.MISSING, False, (3, False)),
        (Kind.FAILING, False, (1, True)),
        (Kind.INTEGRITY, False, (4, False)),
        (Kind.INTEGRITY, True, (4, False)),
    ],
)
def test_only_complete_evidence_becomes_a_baseline(
    result: GateResult, tmp_path: Path, kind: Kind, accepts: Any, expected: Any
) -> None:
    path = tmp_path / "b.json"
    open_result = replace(result, own=(Finding(kind, "x"),))
    written = update_baseline(open_result, path, accepts_incomplete=accepts)
    assert (int(written.exit_code), written.is_written) == expected
    assert path.exists() is written.is_written


def test_tolerance_for_nothing_is_refused(
    mini: Executed, result: GateResult, tmp_path: Path
) -> None:
    update_baseline(result, tmp_path / "b.json", accepts_incomplete=False)
    with pytest.raises(UsageError, match="'km' is neither"):
        judged(mini, tmp_path / "b.json", tolerances=Tolerances({"km": 1.0}))


@pytest.mark.parametrize(
    ("verdict", "models", "decides"),
    [
        (Verdict.PASS, ("cc",), False),
        (Verdict.FAIL, ("cc",), True),
        (Verdict.INCONCLUSIVE, ("cc",), True),
        (Verdict.PASS, (), True),
    ],
)
def test_only_a_contact_that_no_named_driver_avoids_is_set_aside(
    suites: Executed,
    monkeypatch: pytest.MonkeyPatch,
    verdict: Verdict,
    models: tuple[str, ...],
    decides: bool,  # noqa: FBT001 - a parameter of pytest
) -> None:
    monkeypatch.setattr(gating, "preventable_by", lambda *_: models)
    monkeypatch.setattr(gating, "without_unpreventable", lambda *_: (verdict, "by cc"))
    with Repository.open(suites.db, create=False) as repository:
        campaign = repository.find_campaign(suites.summary.campaign)
        set_aside = gating._set_aside(repository, campaign)
        failing = Finding(Kind.FAILING, "FAIL", fsr="FSR-01", architecture="camera_radar")
        told = set_aside(failing)
        assert told.decides is decides
        assert told.text == ("FAIL; by cc" if models else "FAIL")
        for other in (
            replace(failing, kind=Kind.UNDECIDED),
            replace(failing, fsr="FSR-99"),
            replace(failing, decides=False),
        ):
            assert set_aside(other) == other
