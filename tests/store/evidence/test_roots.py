import sqlite3
from pathlib import Path
from typing import Any

import pytest

from adeye.errors import IntegrityError
from adeye.judge.verdict import Verdict
from adeye.store.evidence import roots
from adeye.store.evidence.roots import Root
from adeye.store.repository import Repository
from tests.store.raw import unguarded


def root_of(path: Path, example: Any, **options: Any) -> str:
    with Repository.open(path) as repository:
        campaign = example.campaign(repository, 8, **options)
        found = repository.evidence.record_root(campaign)
        assert found is not None
        assert found.leaves == 8
        return str(found.root)


@pytest.mark.slow
def test_one_plan_has_one_root_whatever_the_blocks_and_what_else_is_there(
    tmp_path: Path, make_example: Any
) -> None:
    expected = root_of(tmp_path / "a.db", make_example())
    for size in (1, 4, 100):
        assert root_of(tmp_path / f"{size}.db", make_example(), block_size=size) == expected
    with Repository.open(tmp_path / "other.db") as repository:
        example = make_example()
        first = example.campaign(repository, 12)
        example.hindsight(repository, first)
    assert root_of(tmp_path / "other.db", make_example()) == expected


@pytest.mark.slow
def test_other_results_have_another_root(tmp_path: Path, make_example: Any) -> None:
    example = make_example()
    example.verdict_of = lambda case, _: Verdict.FAIL if case.ordinal == 5 else Verdict.PASS
    assert root_of(tmp_path / "b.db", example) != root_of(tmp_path / "a.db", make_example())


def test_words_of_a_predicate_are_not_in_the_root(tmp_path: Path, make_example: Any) -> None:
    path = tmp_path / "a.db"
    before = root_of(path, make_example())
    with sqlite3.connect(path) as raw:
        raw.execute("DROP TRIGGER verdict_no_update")
        raw.execute("UPDATE verdict SET predicate = 'gap >= 2.0'")
    raw.close()
    with Repository.open(path) as repository:
        campaign = repository.find_campaign().id
        assert repository.evidence.computed_root(campaign).root == before


def test_incomplete_campaign_has_none(repository: Repository, example: Any) -> None:
    plan = repository.plan_campaign(example.record(), example.cases(4))
    assert repository.evidence.record_root(plan.campaign) is None
    assert repository.evidence.computed_root(plan.campaign).leaves == 4


def test_rows_are_read_in_parts(
    repository: Repository, example: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    campaign = example.campaign(repository, 8)
    whole = repository.evidence.computed_root(campaign)
    monkeypatch.setattr(roots, "_CHUNK", 3)
    assert repository.evidence.computed_root(campaign) == whole


@pytest.mark.slow
def test_altered_evidence_of_a_complete_campaign_is_refused(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    campaign = example.campaign(repository, 8)
    known = repository.evidence.record_root(campaign)
    assert known is not None
    assert repository.evidence.record_root(campaign) == known
    with pytest.raises(IntegrityError, match="has root"):
        repository.evidence.require_root(Root(campaign, 8, "f" * 64))
    raw.execute("DROP TRIGGER verdict_no_update")
    raw.execute("UPDATE verdict SET margin = 7 WHERE run_number = 3")
    assert "campaign_root" in {item.table for item in repository.verify()}
    if not repository.location.is_server:
        # A server lets no bytes into a column of numbers.
        raw.execute("UPDATE verdict SET margin = x'00' WHERE run_number = 3")
        with pytest.raises(IntegrityError, match="damaged"):
            repository.evidence.computed_root(campaign)
    assert "campaign_root" in {item.table for item in repository.verify()}


@pytest.mark.slow
def test_root_without_its_plan_is_a_finding(
    repository: Repository, example: Any, raw: sqlite3.Connection
) -> None:
    repository.evidence.record_root(example.campaign(repository, 4))
    unguarded(raw)
    raw.execute("DELETE FROM campaign")
    assert "campaign_root" in {item.table for item in repository.verify()}
