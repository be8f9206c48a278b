"""A stored run executes again bit for bit, whatever the batch and the workers that made it."""

from pathlib import Path

import numpy as np
import pytest

from adeye.campaign import run as runner
from adeye.campaign.replay import replay_run
from tests.project import Project, table_hash

SAMPLE = 50


@pytest.mark.slow
def test_fifty_runs_replay_identically_from_any_batch_and_worker_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    project = Project(tmp_path)
    with project.edited_odd() as odd:
        odd["scenarios"][0]["sweep"]["parameters"]["lateral_speed"] = ["1 m/s", "2 m/s"]
    project.run(db="two.db", workers=2)
    monkeypatch.setattr(runner, "block_size", lambda _: 5)
    project.run(db="one.db", workers=1)
    assert table_hash(tmp_path / "one.db") == table_hash(tmp_path / "two.db")
    runs = [row["run"] for row in project.rows(db="two.db")]
    chosen = np.random.default_rng(7).permutation(len(runs))[:SAMPLE]
    assert len(chosen) == SAMPLE
    for index in chosen:
        done = replay_run(tmp_path / "two.db", runs[int(index)])
        assert done.identical, done
