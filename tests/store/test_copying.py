"""Chosen campaigns are copied: all that they refer to, nothing else, and the same."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from adeye.campaign.run import judge_campaign, run_campaign
from adeye.campaign.traces import altered_files, copy_campaigns
from adeye.errors import InputError, IntegrityError
from adeye.judge.verdict import Verdict
from adeye.store import ledger as inserting
from adeye.store import tables
from adeye.store.evidence.roots import folder_of
from adeye.store.evidence_tables import LEDGER
from adeye.store.location import locate
from adeye.store.plugin_metrics import plugin_tables
from adeye.store.repository import Repository
from adeye.store.write import merge as merging
from tests.project import CONCEPT, MINI, Project
from tests.tampering import unguarded

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tests.postgres import Server
    from tests.store.conftest import Example

OWN = {"ledger", "seal"}
OF_FIRST = ("fork", "half_step", "benchmark", "injection", "takeover", "uncertainty", "withdrawal",
            "certificate", "session", "campaign_root", "uid_set")  # fmt: skip


def rows_of(repository: Repository) -> dict[str, set[tuple[Any, ...]]]:
    """Read every row of every table but those that tell of transactions."""
    with repository._database.read() as connection:
        known = (*tables.metadata.sorted_tables, *plugin_tables(connection))
        return {
            table.name: {tuple(item) for item in connection.execute(table.select())}
            for table in known
            if table.name not in OWN
        }


def told(repository: Repository, campaign: str) -> list[Any]:
    """Give what people read of a campaign."""
    evidence, hindsight = repository.evidence, repository.hindsight
    return [
        repository.find_campaign(campaign),
        repository.progress(campaign),
        repository.fsr_status(campaign),
        repository.gate(campaign),
        repository.results(campaign),
        repository.never_held(campaign),
        repository.result_table_hash(campaign),
        repository.work_state(campaign),
        evidence.root(campaign),
        evidence.sums(campaign),
        evidence.sessions(campaign),
        evidence.withdrawals(campaign),
        evidence.kept_files(campaign),
        evidence.prove("0", campaign),
        hindsight.certificates.of(campaign),
        hindsight.injections(campaign),
        hindsight.takeovers(campaign),
        hindsight.half_steps.uncertainty(campaign),
        hindsight.benchmarks.comparisons(campaign),
    ]


@pytest.fixture
def two(repository: Repository, example: Example) -> tuple[str, str]:
    """Fill every table by one campaign, and add another one that shares some of its results."""
    example.decompose()
    first = example.campaign(repository)
    example.hindsight(repository, first)
    example.halved(repository, first)
    example.vouched(repository, first)
    example.repeat(0, 1)
    example.with_odd("2")
    example.verdict_of = lambda case, _fsr: Verdict.FAIL if case.ordinal == 2 else Verdict.PASS
    second = example.campaign(repository, 12)
    example.thresholds = {"FSR1": "3 m"}
    third = repository.plan_campaign(example.record(), example.cases(12), block_size=5).campaign
    block = repository.claim_block(campaign=third)
    assert block is not None
    assert repository.quarantine_block(block, "broken")
    assert repository.claim_block(campaign=third) is not None
    repository.plan_campaign(example.record(), example.cases(12), block_size=5)
    assert repository.verify() == ()
    return first, second


@pytest.fixture
def target(place: str | Path, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[str]:
    if isinstance(place, Path):
        yield str(tmp_path / "kept.db")
        return
    server: Server = request.getfixturevalue("server")
    url = server.new_database()
    yield url
    server.drop(url)


def copied(repository: Repository, to: str, *campaigns: str) -> Repository:
    into = Repository.open(to)
    into.copy(repository.location, campaigns)
    assert into.verify() == ()
    return into


@pytest.mark.slow
def test_copy_of_all_campaigns_is_all_rows(
    repository: Repository, two: tuple[str, str], target: str
) -> None:
    before = rows_of(repository)
    everyone = [item.id for item in repository.campaigns()]
    assert len(everyone) == 3
    assert set(two) < set(everyone)
    with copied(repository, target, *everyone) as into:
        found = rows_of(into)
        # A block that somebody holds here is free there.
        assert {name for name in found if found[name] != before[name]} == {"work"}
        (held,) = before["work"] - found["work"]
        (free,) = found["work"] - before["work"]
        assert (held[5], free[5:7], free[9:11]) == ("leased", ("pending", None), (None, None))
        assert held[:5] == free[:5]
        assert [item.id for item in into.campaigns()] == everyone
        for campaign in two:
            assert told(into, campaign) == told(repository, campaign)
    assert rows_of(repository) == before


@pytest.mark.slow
def test_copy_of_one_campaign_tells_what_the_original_tells(
    repository: Repository, two: tuple[str, str], target: str
) -> None:
    before = rows_of(repository)
    with copied(repository, target, two[0]) as into:
        found = rows_of(into)
        assert told(into, two[0]) == told(repository, two[0])
        assert [item.id for item in into.campaigns()] == [two[0]]
        # Everything that vouches for it or was found about it is there, and nothing of others.
        for name in OF_FIRST:
            assert found[name] == before[name] != set(), name
        assert all(found[name] <= before[name] for name in before)
        assert len(found["run"]) == 8 + 2 < len(before["run"])
        assert {item[0] for item in found["concept"]} < {item[0] for item in before["concept"]}


@pytest.mark.slow
def test_work_goes_on_in_a_copy(
    repository: Repository, two: tuple[str, str], target: str, example: Example
) -> None:
    open_one = next(item.id for item in repository.campaigns() if item.id not in two)
    example.thresholds = {"FSR1": "3 m"}
    with copied(repository, target, open_one) as into:
        state = into.work_state(open_one)
        assert (state.quarantined, state.leased) == (1, 0)
        assert into.queue.requeue_quarantined(open_one) == 1
        example.work_off(into, open_one)
        assert into.progress(open_one).accounted == 12
        # Cut blocks get numbers that are free.
        later = into.plan_campaign(example.record(), example.cases(16), block_size=9).campaign
        example.work_off(into, later)
        assert into.verify() == ()


@pytest.mark.slow
def test_database_that_has_campaigns_already_and_unknown_names_are_refused(
    repository: Repository,
    two: tuple[str, str],
    tmp_path: Path,
    make_example: Callable[[], Example],
) -> None:
    other = tmp_path / "other.db"
    with Repository.open(other) as taken:
        make_example().campaign(taken)
        before = rows_of(taken)
        with pytest.raises(InputError, match="has campaigns already"):
            taken.copy(repository.location, two)
        assert rows_of(taken) == before
    for to in (str(repository.location.path or tmp_path / "n.db"), str(tmp_path / "n.db")):
        with pytest.raises(InputError, match="there is none"):
            copy_campaigns(repository, ["9f9f9f"], to)
    assert not (tmp_path / "n.db").exists()


def test_every_table_goes_with_a_campaign_or_tells_of_transactions() -> None:
    for table in tables.metadata.sorted_tables:
        if table not in LEDGER:
            assert "IN (" in merging.kept_condition(table)
    assert {table.name for table in LEDGER} == OWN


# --- with kept traces -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two campaigns with kept traces, one with another threshold and seed."""
    folder = tmp_path_factory.mktemp("archive")
    odd = {**MINI, "scenarios": [MINI["scenarios"][1]]}
    for seed in (7, 8):
        project = Project(folder / str(seed), {**odd, "seed": seed})
        run_campaign(project.plan(), db=folder / "old.db", traces="all")
    return folder


def moved(archive: Path, folder: Path) -> Path:
    shutil.copytree(folder_of(archive / "old.db"), folder_of(folder / "old.db"))
    return Path(shutil.copy(archive / "old.db", folder / "old.db"))


def campaign_of(db: Path, name: str, to: Path) -> str:
    with Repository.open(db, create=False) as source:
        copy_campaigns(source, [name], str(to))
        return source.find_campaign(name).id


@pytest.mark.slow
def test_kept_traces_go_over_and_the_old_database_is_not_needed(
    archive: Path, tmp_path: Path
) -> None:
    old, new = moved(archive, tmp_path), tmp_path / "sub" / "new.db"
    campaign = campaign_of(old, "2", new)
    with Repository.open(old, create=False) as source:
        before = told(source, campaign)
        assert len(source.evidence.kept_files()) == 4
    old.unlink()
    shutil.rmtree(folder_of(old))
    with Repository.open(new, create=False) as into:
        assert into.verify() == ()
        assert told(into, campaign) == before
        assert tuple(altered_files(into)) == ()
        assert {path.stem for path in folder_of(new).iterdir()} == set(into.evidence.kept_files())
        assert len(into.evidence.kept_files()) == 2
    # What only a trace can judge is judged from the copy, and nothing is executed.
    project = Project(tmp_path / "again", {**MINI, "scenarios": [MINI["scenarios"][1]], "seed": 8})
    with project.edited(CONCEPT) as concept:
        item = next(item for item in concept["requirements"] if "formula" in item)
        item["formula"] = "always(any_actor.distance > 8 m or ego.speed < 11 m/s)"
    again = judge_campaign(project.plan(), db=new)
    assert (again.to_replay, again.executed) == (0, 0)
    assert "trace" in again.ways


def spoilt(folder: Path, how: str) -> None:
    old = folder / "old.db"
    files = sorted(folder_of(old).iterdir())
    with Repository.open(old, create=False) as source:
        own = source.evidence.kept_files(source.find_campaign("2").id)
    file = next(path for path in files if path.stem in own)
    if how == "gone":
        file.unlink()
    elif how == "altered":
        content = bytearray(file.read_bytes())
        content[len(content) // 2] ^= 1
        file.write_bytes(content)
    else:
        with sqlite3.connect(old) as connection, unguarded(connection):
            connection.execute("UPDATE metric SET min_distance_m = 99.0 WHERE run_number = 1")
        connection.close()


@pytest.mark.parametrize("how", ["gone", "altered", "row"])
def test_what_is_not_as_it_was_written_is_not_copied_and_nothing_is_left(
    archive: Path, tmp_path: Path, how: str
) -> None:
    old, new = moved(archive, tmp_path), tmp_path / "new.db"
    spoilt(tmp_path, how)
    with pytest.raises(IntegrityError, match=r"adeye db verify"):
        campaign_of(old, "2", new)
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith("new.db")] == []


@pytest.mark.slow
def test_copy_that_is_not_the_same_is_removed(
    archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old, new = moved(archive, tmp_path), tmp_path / "new.db"
    # As a disk would that keeps something else.
    insert = inserting.insert_rows
    monkeypatch.setattr(
        merging, "insert_rows",
        lambda on, table, rows: insert(on, table, rows[1:] if table.name == "verdict" else rows),
    )  # fmt: skip
    with pytest.raises(IntegrityError, match=r"not as"):
        campaign_of(old, "2", new)
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith("new.db")] == []
    assert locate(old).path == old
