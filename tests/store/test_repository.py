"""The repository as its users open it: made on first use, committed, shared by threads."""

import threading
from pathlib import Path

import pytest

from adeye.store import schema
from adeye.store.repository import Repository
from tests.store.conftest import Store


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


def test_info_counts_rows(store: Store) -> None:
    store.campaign(4)
    rows = store.repository.info().rows
    assert (rows["campaign_case"], rows["run"], rows["verdict"], rows["event"]) == (4, 4, 8, 8)


def test_save_methods_commit(store: Store) -> None:
    store.repository.save_content("odd", store.example.odd)
    store.repository.save_concept(store.example.concept())
    with Repository.open(store.repository.location, create=False) as other:
        assert other.info().rows["odd"] == other.info().rows["concept"] == 1


@pytest.mark.slow
def test_threads_share_a_repository(store: Store) -> None:
    plan = store.plan(40, block_size=2)
    done: list[int] = []

    def work() -> None:
        while (block := store.repository.claim_block(campaign=plan.campaign)) is not None:
            assert store.complete(block)
            done.append(block.id)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(done) == list(range(1, 21))
    assert store.repository.progress(plan.campaign).accounted == 40
