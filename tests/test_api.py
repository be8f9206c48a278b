"""The public functions do what the command line does."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

import adeye
from adeye.cli.entry import main
from adeye.errors import InputError
from adeye.evaluation.verdict import ExitCode

if TYPE_CHECKING:
    from tests.project import Executed


def test_exported_names_are_pinned() -> None:
    assert adeye.__all__ == [
        "CompareOptions", "__version__", "compare", "plan", "replay", "results", "run", "stl",
    ]  # fmt: skip
    for name in adeye.__all__:
        assert getattr(adeye, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'simulate'"):
        _ = adeye.simulate


def test_importing_the_package_loads_nothing_heavy() -> None:
    script = (
        "import adeye, sys; print([m for m in ('numpy', 'pandas', 'numba') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_plan_counts_without_running(mini: Executed) -> None:
    plan = adeye.plan(mini.project.odd)
    assert plan.expansion.count == len(mini.project.rows())


def test_run_takes_a_plan_and_reuses_every_result(mini: Executed) -> None:
    summary = adeye.run(mini.plan, db=mini.db)
    assert summary.executed == 0
    assert summary.exit_code is mini.summary.exit_code is ExitCode.OK


def test_replay_is_identical(mini: Executed) -> None:
    run = mini.project.rows()[0]["run"]
    done = adeye.replay(run[:12], db=mini.db)
    assert done.run == run
    assert done.identical


def test_results_are_a_typed_table(mini: Executed) -> None:
    frame = adeye.results(db=mini.db)
    assert len(frame) == mini.summary.planned
    assert str(frame["min_distance_m"].dtype) == "Float64"
    assert str(frame["scenario"].dtype) == "string" or str(frame["scenario"].dtype) == "str"
    assert frame["run"].is_unique


def test_comparison_is_the_record_that_the_command_prints(
    mini: Executed, capsys: pytest.CaptureFixture[str]
) -> None:
    found = adeye.compare("mini", adeye.CompareOptions(baseline="legacy_camera"), db=mini.db)
    assert main(
        ["compare", "mini", "--baseline", "legacy_camera", "--db", str(mini.db), "--json"]
    ) == int(ExitCode.OK)
    printed = json.loads(capsys.readouterr().out)
    assert printed.pop("schema") == "adeye/compare@1"
    assert printed == found.model_dump(mode="json")
    assert found.baseline == found.pairs[0].a == "legacy_camera"


def test_comparison_is_of_the_newest_campaign_unless_said(mini: Executed) -> None:
    found = adeye.compare(db=mini.db)
    assert found.campaign == mini.summary.campaign
    for name in ("1", mini.summary.campaign[:8], str(mini.project.odd)):
        assert adeye.compare(name, db=mini.db) == found
    with pytest.raises(InputError, match="There are: 1 "):
        adeye.compare("legacy_camera", db=mini.db)


def test_a_campaign_may_be_a_number(mini: Executed) -> None:
    assert adeye.results(1, db=mini.db).equals(adeye.results("1", db=mini.db))
    with pytest.raises(InputError, match="9"):
        adeye.results(9, db=mini.db)
    with pytest.raises(InputError, match=r"1\.0 is no campaign"):
        adeye.results(1.0, db=mini.db)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="True is no campaign"):
        adeye.compare(True, db=mini.db)  # noqa: FBT003 - what is refused
    with pytest.raises(InputError, match="1 is no run"):
        adeye.replay(1, db=mini.db)  # type: ignore[arg-type]
