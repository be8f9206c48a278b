"""Equal test cases give equal bits, whatever the block, its order, the threads or the database."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.campaign import run as runner
from adeye.simulate import engine
from adeye.simulate.recorder import Memory
from adeye.sweep.case import TestCase, batches, structure_key
from tests.project import Project, table_hash


@pytest.fixture(scope="module")
def many(tmp_path_factory: pytest.TempPathFactory) -> Project:
    """Seventy test cases and more of one structure, contacts and handovers among them."""
    project = Project(tmp_path_factory.mktemp("bits"))
    with project.edited_odd() as odd:
        axes = {
            "ego_speed": ["70 km/h", "130 km/h"],
            "gap": ["8 m", "15 m", "30 m", "60 m"],
            "lateral_speed": ["0.6 m/s", "1 m/s", "2 m/s"],
            "friction": [0.5, 0.9],
        }
        odd["scenarios"] = [{"use": "cut_in", "sweep": {"parameters": axes}}]
    return project


def digests(project: Project, cases: list[TestCase], size: int, **options: Any) -> dict[str, str]:
    """Trace digest by test case, in batches of a size."""
    found: dict[str, str] = {}
    folders = project.plan().folders
    for batch in batches(cases, size):
        trace = engine.run(batch, base_dirs=folders, **options)
        found |= dict(zip(trace.case_digests, trace.digests(), strict=True))
    return found


@pytest.mark.slow
def test_size_and_order_of_batches_change_no_bit(many: Project) -> None:
    cases = list(many.plan().cases)
    assert len(cases) > 200
    together = digests(many, cases, 1024)
    order = np.random.default_rng(3).permutation(len(cases))
    shuffled = sorted((cases[number] for number in order), key=structure_key)
    assert shuffled != cases
    assert digests(many, shuffled, 64) == together
    for size, tried in ((7, 70), (1, 8)):
        some = shuffled[:: len(shuffled) // tried]
        assert digests(many, some, size) == {case.digest: together[case.digest] for case in some}
    assert len(set(together.values())) > 100


@pytest.mark.slow
def test_memory_that_is_used_again_changes_no_bit(many: Project) -> None:
    cases = list(many.plan().cases)[:60]
    assert digests(many, cases, 16, memory=Memory()) == digests(many, cases, 16)


@pytest.mark.slow
def test_what_is_drawn_changes_no_digest(many: Project) -> None:
    cases = list(many.plan().cases)[:20]
    assert digests(many, cases, 20, drawn=True) == digests(many, cases, 20)


@pytest.mark.slow
@pytest.mark.parametrize("variant", ["reference", "fast"])
def test_variant_has_bits_of_its_own_that_do_not_depend_on_the_batch(
    many: Project, variant: str
) -> None:
    cases = list(many.plan().cases)[:30]
    assert digests(many, cases, 30, variant=variant) == digests(many, cases, 7, variant=variant)


@pytest.mark.slow
def test_blocks_threads_and_workers_change_no_table(
    many: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hashes = set()
    for size, threads, workers in ((1024, 1, 1), (64, 2, 1), (7, 2, 1), (33, 1, 2)):
        monkeypatch.setattr(runner, "block_size", lambda _, chosen=size: chosen)
        database = tmp_path / f"{size}.db"
        summary = many.run(db=str(database), threads=threads, workers=workers)
        assert summary.executed == summary.planned > 200
        hashes.add(table_hash(database))
    assert len(hashes) == 1
