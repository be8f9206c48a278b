"""What a report says about change."""

from types import SimpleNamespace
from typing import Any

from adeye.judge.verdict import ExitCode
from adeye.report.gate.baseline import Finding, Kind
from adeye.reporting import impact_of
from tests.report.parts import impact
from tests.stored import known

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
