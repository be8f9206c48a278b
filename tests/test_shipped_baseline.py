"""The shipped baseline is of the shipped ODD, and the ODD still comes to it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from adeye.campaign.plan import make_plan
from adeye.cli.app import main
from adeye.judge.verdict import ExitCode
from adeye.report.gate.baseline import read_baseline
from tests.project import ROOT

if TYPE_CHECKING:
    from pathlib import Path

ODD = ROOT / "odd" / "motorway_chauffeur.yaml"
BASELINE = ROOT / "reports" / "baselines" / "motorway_chauffeur.json"


def test_baseline_is_of_the_shipped_odd() -> None:
    baseline, plan = read_baseline(BASELINE), make_plan(ODD)
    assert BASELINE.stat().st_size < 200_000
    assert (baseline.odd, baseline.gate) == (plan.files.odd.spec.odd, plan.files.gate)
    assert baseline.planned == baseline.accounted == plan.expansion.count
    assert baseline.exit_code is ExitCode.OK
    assert set(baseline.architectures) == set(plan.files.architectures)
    digests = {name: item.digest for name, item in baseline.fsrs.items()}
    assert digests == {item.requirement.id: item.digest for item in plan.requirements}


@pytest.mark.slow
def test_shipped_odd_comes_to_its_baseline(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    db = str(tmp_path / "adeye.db")
    assert main(["run", str(ODD), "--db", db, "--quiet"]) == 0
    assert main(["gate", "--db", db, "--baseline", str(BASELINE)]) == 0
    assert "Nothing differs from the baseline." in capfd.readouterr().out
