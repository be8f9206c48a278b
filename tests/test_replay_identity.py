"""A stored run executes again bit for bit, in whatever batch of whichever worker it was made."""

from pathlib import Path

import numpy as np
import pytest

from adeye.campaign.replay import replay_run
from tests.project import Project

SAMPLE = 50


@pytest.mark.slow
def test_fifty_runs_of_two_workers_replay_identically(tmp_path: Path) -> None:
    project = Project(tmp_path)
    with project.edited_odd() as odd:
        odd["scenarios"][0]["sweep"]["parameters"]["lateral_speed"] = ["1 m/s", "2 m/s"]
    project.run(db="two.db", workers=2)
    runs = [row["run"] for row in project.rows(db="two.db")]
    chosen = np.random.default_rng(7).permutation(len(runs))[:SAMPLE]
    assert len(chosen) == SAMPLE
    for index in chosen:
        done = replay_run(tmp_path / "two.db", runs[int(index)])
        assert done.identical, done
