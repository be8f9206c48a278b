"""Which findings decide, and with which exit code."""

import pytest

from adeye.judge.verdict import ExitCode
from adeye.report.gate.baseline import Finding, Kind, deciding, gate_code_of


def test_finding_says_what_it_is_about() -> None:
    finding = Finding(Kind.MARGIN, "lost", fsr="FSR-1", scenario="cut_in")
    assert str(finding) == "margin: FSR-1, cut_in: lost"
    assert str(Finding(Kind.NOTE, "edited")) == "note: edited"


@pytest.mark.parametrize("kind", list(Kind))
def test_what_does_not_decide_changes_no_code(kind: Kind) -> None:
    assert gate_code_of([Finding(kind, "x", decides=False)], ExitCode.OK) is ExitCode.OK


@pytest.mark.parametrize("kind", list(Kind))
def test_what_decides_is_as_bad_as_its_kind(kind: Kind) -> None:
    found = [Finding(kind, "x")]
    assert gate_code_of(found, ExitCode.OK) is kind.code
    assert (deciding(found) == found) is (kind.code is not ExitCode.OK)


def test_baseline_makes_no_campaign_better() -> None:
    for code in (ExitCode.FAILED, ExitCode.INCOMPLETE, ExitCode.INTEGRITY):
        assert gate_code_of([Finding(Kind.NEWLY_PASSING, "x")], code) is code


def test_several_codes_are_combined_as_everywhere() -> None:
    kinds = (Kind.MISSING, Kind.MARGIN)
    assert gate_code_of([Finding(kind, "x") for kind in kinds], ExitCode.OK) is ExitCode.FAILED
    found = [Finding(kind, "x") for kind in (*kinds, Kind.INTEGRITY)]
    assert gate_code_of(found, ExitCode.OK) is ExitCode.INTEGRITY
