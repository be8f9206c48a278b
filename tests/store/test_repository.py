import multiprocessing
import sqlite3
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from adeye.store import schema
from adeye.store.repository import Repository
from tests.store.rows import complete_block, result_table_hash


def test_database_is_made_on_first_use_where_it_is_expected(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with Repository.open() as repository:
        assert repository.location.path == Path(".adeye/adeye.db")
        info = repository.info()
    assert (info.schema, set(info.rows.values())) == (schema.head(), {0})
    assert info.size_bytes > 0
    assert Repository.open(create=False).verify() == ()


def test_info_counts_rows(repository: Repository, example: Any) -> None:
    example.campaign(repository, 4)
    rows = repository.info().rows
    assert (rows["campaign_case"], rows["run"], rows["verdict"], rows["event"]) == (4, 4, 8, 8)


def test_save_methods_commit(repository: Repository, example: Any) -> None:
    repository.save_content("odd", example.odd)
    repository.save_concept(example.concept())
    with Repository.open(repository.location, create=False) as other:
        assert other.info().rows["odd"] == other.info().rows["concept"] == 1


MOST_BLOCKS = 6
"""Blocks that a worker completes at most; then it claims another one and hangs."""


def work_until_killed(path: Path, example: Any, campaign: str, done: Any) -> None:
    with Repository.open(path) as repository:
        completed = 0
        while (block := repository.claim_block(lease_s=1e6, campaign=campaign)) is not None:
            while completed == MOST_BLOCKS:
                time.sleep(60.0)
            complete_block(repository, block, example.runs(block), example.judged(block))
            completed += 1
            done.release()


@pytest.mark.slow
def test_killed_workers_leave_the_results_of_an_undisturbed_campaign(
    tmp_path: Path, example: Any
) -> None:
    """They are killed some time after their first block, so each round gets on, on any machine."""
    with Repository.open(tmp_path / "undisturbed.db") as repository:
        expected = result_table_hash(repository, example.campaign(repository, 96, block_size=2))
    context = multiprocessing.get_context("fork")
    path = tmp_path / "killed.db"
    with Repository.open(path) as repository:
        plan = repository.plan_campaign(example.record(), example.cases(96), block_size=2)
        rounds = kills = 0
        while repository.work_state(plan.campaign).text != "complete":
            assert rounds < 48, "no progress"
            done = context.Semaphore(0)
            workers = [
                context.Process(target=work_until_killed, args=(path, example, plan.campaign, done))
                for _ in range(2)
            ]
            for worker in workers:
                worker.start()
            assert done.acquire(timeout=120.0), "no progress"
            # Anywhere in the work: before, in and after a transaction, or while it hangs.
            time.sleep(0.003 * (rounds % 7))
            for worker in workers:
                kills += worker.exitcode is None
                worker.kill()
                worker.join()
            rounds += 1
        # 48 blocks are no less than four rounds of two workers.
        assert kills >= 4
        assert repository.info().rows["run"] == 96
        assert result_table_hash(repository, plan.campaign) == expected
        assert repository.verify() == ()
        again = repository.plan_campaign(example.record(), example.cases(96))
        assert (again.to_execute, again.to_judge) == (0, 0)


@pytest.mark.slow
def test_threads_share_a_repository(repository: Repository, example: Any) -> None:
    plan = repository.plan_campaign(example.record(), example.cases(40), block_size=2)
    done: list[int] = []

    def work() -> None:
        while (block := repository.claim_block(campaign=plan.campaign)) is not None:
            assert complete_block(repository, block, example.runs(block))
            done.append(block.id)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(done) == list(range(1, 21))
    assert repository.progress(plan.campaign).accounted == 40


@pytest.mark.slow
def test_power_cut_at_any_point_of_the_log_leaves_whole_blocks(
    tmp_path: Path, example: Any
) -> None:
    with Repository.open(tmp_path / "whole.db") as repository:
        expected = result_table_hash(repository, example.campaign(repository, 12, block_size=2))
    source = tmp_path / "source.db"
    with Repository.open(source):
        pass
    keeper = sqlite3.connect(source)
    keeper.execute("SELECT count(*) FROM run").fetchone()
    with Repository.open(source) as repository:
        plan = repository.plan_campaign(example.record(), example.cases(12), block_size=2)
        example.work_off(repository, plan.campaign)
        log = source.with_name("source.db-wal").read_bytes()
        main = source.read_bytes()
    keeper.close()
    assert len(log) > 100_000
    for part in range(20):
        path = tmp_path / f"cut{part}.db"
        path.write_bytes(main)
        path.with_name(f"{path.name}-wal").write_bytes(log[: len(log) * part // 20 + part])
        with Repository.open(path) as repository:
            assert repository.verify() == ()
            again = repository.plan_campaign(example.record(), example.cases(12), block_size=2)
            released(path)
            example.work_off(repository, again.campaign)
            assert result_table_hash(repository, again.campaign) == expected


def released(path: Path) -> None:
    """After a power cut no owner lives; this process does, so its leases are ended by hand."""
    connection = sqlite3.connect(path)
    connection.execute("UPDATE work SET until_boot_s = 0 WHERE state = 'leased'")
    connection.commit()
    connection.close()
