"""R3: the same campaign from the shell and from ten lines of Python, with identical results."""

import subprocess
import sys

import pytest

from adeye.kernel.jit import cache_directory
from tests.conftest import MakeProject
from tests.project import ROOT, odd_of, table_hash

pytestmark = pytest.mark.requirements

TWO = odd_of("lead_braking", architectures=("camera_radar", "legacy_camera"))

PROGRAM = """
import adeye

plan = adeye.plan("odd/tested.yaml")
assert plan.expansion.count == 2
summary = adeye.run(plan, db="python.db")
table = adeye.results(db="python.db")
worst = table.sort_values("min_distance_m").iloc[0]
replayed = adeye.replay(worst["run"], db="python.db")
assert replayed.identical
"""


@pytest.mark.slow
def test_shell_and_python_give_identical_results(make_project: MakeProject) -> None:
    project = make_project(TWO)
    # The child finds the compiled functions of this process.
    environment = {"PYTHONPATH": str(ROOT), "PATH": "", "HOME": str(project.folder.parent)}
    environment["NUMBA_CACHE_DIR"] = str(cache_directory())
    code = {}
    for name, command in {
        "shell": ["-m", "adeye", "run", "odd/tested.yaml", "--db", "shell.db", "--workers", "1"],
        "python": ["-c", PROGRAM],
    }.items():
        done = subprocess.run(
            [sys.executable, *command],
            cwd=project.folder,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert "Traceback" not in done.stderr, done.stderr
        code[name] = done.returncode
    assert code["python"] == 0
    assert len(PROGRAM.strip().splitlines()) <= 10
    assert table_hash(project.folder / "shell.db") == table_hash(project.folder / "python.db")
