"""R3: the same campaign from YAML, from the shell and from Python gives identical results."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

import adeye
from tests.conftest import MakeProject
from tests.project import ROOT, table_hash

pytestmark = pytest.mark.requirements


def test_shell_and_python_give_identical_result_tables(make_project: MakeProject) -> None:
    project = make_project()
    shell, python = project.folder / "shell.db", project.folder / "python.db"
    command = [sys.executable, "-m", "adeye", "run", str(project.odd), "--db", str(shell)]
    done = subprocess.run(
        command,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    plan = adeye.plan(project.odd)
    summary = adeye.run(plan, db=python)
    assert done.returncode == int(summary.exit_code)
    assert table_hash(shell) == table_hash(python)
    frame = adeye.results(db=python)
    assert len(frame) == plan.expansion.count
    assert adeye.replay(str(frame["run"].iloc[0]), db=shell).identical
