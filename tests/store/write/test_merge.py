"""Databases are merged: verified, whole or not at all, and the same as one database."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Iterator, Sequence
from datetime import datetime
from itertools import permutations
from pathlib import Path
from typing import Any

import pytest

import adeye
from adeye.campaign.plan import make_plan
from adeye.campaign.run import Session, judge_campaign, run_campaign
from adeye.campaign.selection import Choice, Keyword, Shard
from adeye.campaign.traces import altered_files, copy_campaigns
from adeye.errors import InputError, IntegrityError, PlatformError
from adeye.judge.verdict import ExitCode, Verdict
from adeye.store import ledger as inserting
from adeye.store import tables, texts
from adeye.store.database import Database
from adeye.store.evidence.roots import folder_of
from adeye.store.location import locate
from adeye.store.plugin_metrics import plugin_tables
from adeye.store.read.totals import gate_code
from adeye.store.repository import Repository
from adeye.store.tables import LEDGER, metadata
from adeye.store.write import merge as merging
from tests.postgres import Server
from tests.project import (
    CANDIDATE,
    CANDIDATE_ONLY,
    CONCEPT,
    MINI,
    Executed,
    Project,
    count_rows,
    one_scenario,
    table_hash,
)
from tests.sql import alter, rows
from tests.store.conftest import Example, Store
from tests.store.rows import result_table_hash
from tests.stored import known, stored


@pytest.fixture(scope="module")
def parts(mini: Executed, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Execute the shards of the mini campaign in a database each; ``cut.db`` has a part of them."""
    folder = tmp_path_factory.mktemp("parts")
    choices = {f"{place}.db": Choice(shard=Shard(place, 3)) for place in (1, 2, 3)}
    choices["cut.db"] = Choice(keyword=Keyword.parse("gap=30 or deceleration=4"))
    for name, choice in choices.items():
        run_campaign(mini.project.plan(), db=folder / name, session=Session(choice=choice))
    return folder


def merged(into: Path, *sources: Path) -> list[merging.Merged]:
    with Repository.open(into) as repository:
        return [repository.merge(source) for source in sources]


def sound(db: Path) -> None:
    with Repository.open(db, create=False) as repository:
        assert repository.verify() == ()


def copied(parts: Path, name: str, folder: Path) -> Path:
    return Path(shutil.copy(parts / name, folder / name))


def whole(mini: Executed, folder: Path) -> Path:
    """Copy the database of the mini campaign, which other tests share, as a source."""
    folder.mkdir(exist_ok=True)
    return Path(shutil.copyfile(mini.db, folder / "source.db"))


@pytest.mark.slow
def test_shards_merged_are_one_campaign(mini: Executed, parts: Path, tmp_path: Path) -> None:
    db = tmp_path / "all.db"
    found = merged(db, *(parts / f"{place}.db" for place in (1, 2, 3)))
    assert sum(item.runs for item in found) == 28
    assert {item.campaigns for item in found} == {(mini.summary.campaign,)}
    assert table_hash(db) == table_hash(mini.db)
    sound(db)
    again = run_campaign(mini.project.plan(), db=db)
    assert (again.executed, again.exit_code) == (0, mini.summary.exit_code)
    assert again.verdicts == mini.summary.verdicts


def test_who_is_planned_while_the_clock_stands_is_the_latest_after_a_merge(tmp_path: Path) -> None:
    day = "2026-01-01T00:00:00.000+00:00"
    plans = planned_at(tmp_path / "a.db", Example(), *((count, day) for count in (4, 2, 3, 4, 2)))
    merged(tmp_path / "b.db", tmp_path / "a.db")
    assert latest(tmp_path / "b.db") == latest(tmp_path / "a.db") == plans[2]


def planned_at(db: Path, example: Example, *plans: tuple[int, str]) -> dict[int, str]:
    """Plan campaigns of so many cases, each at a time of day."""
    found: dict[int, str] = {}
    written = texts.utc_text
    with Repository.open(db) as repository:
        for count, at in plans:
            now = datetime.fromisoformat(at)
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(texts, "utc_text", lambda asked, now=now: written(asked or now))
                found[count] = Store(repository, example).campaign(count)
    return found


def latest(db: Path) -> str:
    with Repository.open(db, create=False) as repository:
        return known(repository.latest_campaign()).id


def test_latest_is_who_was_planned_last_whatever_is_merged_into_what(tmp_path: Path) -> None:
    day = "2026-01-0{}T00:00:00.000+00:00".format
    example = Example()
    first = planned_at(tmp_path / "first.db", example, (4, day(1)), (2, day(3)), (4, day(5)))
    planned_at(tmp_path / "second.db", example, (3, day(2)), (2, day(4)), (3, day(3)))
    assert latest(tmp_path / "second.db") != first[2]  # the clock went back, and yet it is later
    for number, names in enumerate(permutations(("first.db", "second.db"))):
        db = tmp_path / f"{number}.db"
        merged(db, *(tmp_path / name for name in names))
        assert latest(db) == first[4]
        sound(db)
        merged(db, tmp_path / "second.db")
        assert latest(db) == first[4]


def test_merging_again_adds_nothing(parts: Path, tmp_path: Path) -> None:
    db = tmp_path / "all.db"
    merged(db, parts / "1.db")
    with Repository.open(db) as repository:
        before = repository.info().rows
    (again,) = merged(db, parts / "1.db")
    assert (again.runs, again.rows, again.blocks) == (0, 0, 0)
    with Repository.open(db) as repository:
        assert repository.info().rows == before


@pytest.mark.slow
def test_overlapping_parts_are_counted_once(mini: Executed, parts: Path, tmp_path: Path) -> None:
    db = tmp_path / "all.db"
    merged(db, parts / "1.db", parts / "cut.db")
    sound(db)
    with Repository.open(db) as repository:
        progress = repository.progress(mini.summary.campaign)
    # What has its results is counted, though it came in pieces of a block.
    assert progress.executed == progress.accounted == count_rows(db, "run")
    assert count_rows(parts / "1.db", "run") < progress.executed < 28
    summary = run_campaign(mini.project.plan(), db=db)
    assert summary.executed == 28 - progress.executed
    assert table_hash(db) == table_hash(mini.db)


@pytest.mark.slow
def test_results_of_another_campaign_are_added(parts: Path, tmp_path: Path) -> None:
    other = Project(tmp_path / "other")
    with other.edited_odd() as odd:
        odd["seed"] = 8
    summary = other.run()
    merged(other.db, parts / "1.db", parts / "2.db", parts / "3.db")
    sound(other.db)
    with Repository.open(other.db) as repository:
        newest, *rest = repository.campaigns()
        assert [item.id for item in rest] == [summary.campaign]
        # What is merged was planned before.
        assert known(repository.latest_campaign()).id == summary.campaign
        assert repository.progress(newest.id).accounted == 28


def test_what_a_block_failed_with_goes_along(mini: Executed, tmp_path: Path) -> None:
    source, into = whole(mini, tmp_path / "of"), tmp_path / "new.db"
    same = whole(mini, tmp_path / "same")
    raised = "PluginError: the sensor ./s.py:S raised ValueError: by chance"
    with sqlite3.connect(source) as raw:
        raw.execute("UPDATE work SET detail = ? WHERE id = 1", (raised,))
    raw.close()
    for db in (into, same):
        merged(db, source)
    with Repository.open(source) as repository:
        copy_campaigns(repository, [mini.summary.campaign], tmp_path / "copy.db")
    for db in (into, same, tmp_path / "copy.db"):
        sound(db)
        with Repository.open(db, create=False) as repository:
            assert list(repository.tried_again(mini.summary.campaign)) == [raised]
            campaign = repository.find_campaign(mini.summary.campaign)
            assert gate_code(repository, campaign)[0] is ExitCode.INCOMPLETE


def refused(into: Path, source: Path, error: type[Exception], words: Sequence[str]) -> None:
    with Repository.open(into) as repository:
        before = repository.info().rows
    with pytest.raises(error) as said:
        merged(into, source)
    for word in words:
        assert word in str(said.value)
    with Repository.open(into) as repository:
        assert repository.info().rows == before


def test_altered_source_is_refused_whole_and_named(parts: Path, tmp_path: Path) -> None:
    source = copied(parts, "2.db", tmp_path)
    alter(source, "UPDATE metric SET row_hash = 'x'")
    merged(tmp_path / "all.db", parts / "1.db")
    refused(tmp_path / "all.db", source, IntegrityError, ["not as it was written", "metric"])


def test_source_with_a_foreign_trigger_is_only_read(mini: Executed, tmp_path: Path) -> None:
    source = whole(mini, tmp_path)
    alter(source, "DROP VIEW v_runs", "CREATE VIEW v_runs AS SELECT randomblob(9) AS x")
    content = source.read_bytes()
    refused(tmp_path / "all.db", source, IntegrityError, ["v_runs", "not as this release"])
    assert source.read_bytes() == content


def test_view_in_the_place_of_a_table_is_refused(mini: Executed, tmp_path: Path) -> None:
    source = whole(mini, tmp_path)
    raw = sqlite3.connect(source)
    raw.execute("DROP TABLE takeover")
    raw.execute("CREATE VIEW takeover AS SELECT 1 AS fork_digest")
    raw.close()
    refused(tmp_path / "all.db", source, IntegrityError, ["takeover is not a table"])


@pytest.mark.parametrize(("table", "column"), [("run", "result_hash"), ("verdict", "margin")])
def test_another_result_of_one_test_case_contradicts(
    parts: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, table: str, column: str
) -> None:
    db = tmp_path / "all.db"
    merged(db, parts / "1.db")
    source = copied(parts, "1.db", tmp_path)
    alter(source, f"UPDATE {table} SET {column} = '7.0' WHERE {column} IS NOT NULL")  # noqa: S608
    # As if it were sound.
    monkeypatch.setattr(merging, "verify", lambda _: iter(()))
    refused(db, source, IntegrityError, [f"{table} ", f"another {column}"])


def test_verdict_that_a_deadline_of_the_machine_changed_is_not_lost(
    mini: Executed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    db, source = tmp_path / "all.db", whole(mini, tmp_path)
    merged(db, source)
    monkeypatch.setattr(merging, "verify", lambda _: iter(()))
    alter(source, "UPDATE run SET machine_dependent = 1, result_hash = 'x' WHERE number < 4")
    assert merged(db, source)[0].runs == 0
    alter(source, "UPDATE verdict SET margin = 7.0 WHERE run_number IN (2, 3)")
    ((run,),) = rows(source, "SELECT result_digest FROM run WHERE number = 2")
    refused(db, source, IntegrityError, [run[:12], "the first of 2 that depend on the machine"])


def test_database_into_itself_and_no_database_are_refused(parts: Path, tmp_path: Path) -> None:
    db, text = copied(parts, "1.db", tmp_path), tmp_path / "text.db"
    text.write_text("not a database, but long enough to look like one\n" * 99)
    refused(db, db, InputError, ["is merged into"])
    refused(db, tmp_path / "none.db", InputError, ["no such file"])
    refused(db, text, PlatformError, ["text.db"])


def test_source_is_opened_for_reading_only(mini: Executed, tmp_path: Path) -> None:
    source = whole(mini, tmp_path)
    source.chmod(0o444)
    database: Any = Database(source, is_read_only=True)
    with pytest.raises(PlatformError), database.write() as connection:
        connection.exec_driver_sql("DELETE FROM work")
    database.close()
    assert count_rows(whole(mini, tmp_path / "beside"), "run") > 0


def test_every_table_goes_over_or_is_named_as_left() -> None:
    # A new table has to be thought of: what numbers its rows, and whether they may differ.
    numbered = {table.name for table in metadata.sorted_tables if "number" in table.columns}
    appended = {"certificate", "session", "withdrawal"}
    assert numbered == {"campaign", "campaign_use", "ledger", "run", "seal"} | appended
    assert appended == merging.APPENDED
    of_runs = {table.name for table in metadata.sorted_tables if "run_number" in table.columns}
    results = {table.name for table in tables.RESULTS} - {"run"}
    assert of_runs - results == {"case_run", "seal"} <= merging.LEFT
    assert of_runs >= results
    assert set(metadata.tables) >= merging.LEFT
    assert set(metadata.tables) >= merging.OF_CAMPAIGN
    with_work = {table.name for table in metadata.sorted_tables if "work_id" in table.columns}
    assert with_work <= merging.LEFT


SMALL = one_scenario("cut_in", "nominal_silent", gap=["30 m", "50 m"])
SMALL["architectures"] = CANDIDATE_ONLY
OWN: str = stored("plugins")["own_channel"]


def with_plugin(folder: Path) -> Project:
    """Make a small project whose architecture names a file of code."""
    project = Project(folder, SMALL)
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["own"] = {
            "kind": "./own.py:Own", "rate": "20 Hz", "links": ["front_radar"],
        }  # fmt: skip
    (folder / "odd" / "architectures" / "own.py").write_text(OWN, encoding="utf-8")
    return project


def spellings(folder: Path, elsewhere: Path) -> list[tuple[Path, str]]:
    """Name the ODD of a project in ways, each with the working folder in which it holds."""
    (folder / "link").symlink_to(folder / "odd", target_is_directory=True)
    shutil.copytree(folder, elsewhere, symlinks=True)
    return [
        (folder, "odd/tested.yaml"),
        (folder, str(folder / "odd" / "tested.yaml")),
        (folder, "./odd/../odd/./tested.yaml"),
        (folder, "link/tested.yaml"),
        (folder / "odd", "tested.yaml"),
        (folder / "odd" / "concepts", "../tested.yaml"),
        (elsewhere, "odd/tested.yaml"),
    ]


CONTENT = ("odd", "scenario", "architecture", "concept", "test_case")


@pytest.mark.slow
def test_shards_of_files_by_any_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    project = with_plugin(tmp_path / "here")
    ways = spellings(project.folder, tmp_path / "there")
    contents, summaries = [], []
    for number, (folder, name) in enumerate(ways):
        monkeypatch.chdir(folder)
        db = tmp_path / f"{number}.db"
        choice = Choice(shard=Shard(1 + number % 2, 2))
        summaries.append(run_campaign(make_plan(name), db=db, session=Session(choice=choice)))
        contents.append([rows(db, f"SELECT digest FROM {table} ORDER BY 1") for table in CONTENT])  # noqa: S608
    assert all(item == contents[0] for item in contents)
    assert len({item.campaign for item in summaries}) == 1
    into = tmp_path / "all.db"
    merged(into, *(tmp_path / f"{number}.db" for number in range(len(ways))))
    sound(into)
    # And every one of them executes nothing more.
    for folder, name in ways:
        monkeypatch.chdir(folder)
        again = run_campaign(make_plan(name), db=into)
        assert (again.executed, again.reused) == (0, again.planned)
    run = str(adeye.results(db=into)["run"].iloc[0])
    monkeypatch.chdir("/")
    assert adeye.replay(run, db=into).identical


FORGERIES = {
    "scenario_digest": "scenario SET content = json_set(content, '$.horizon', 9.5)",
    "architecture_digest": "architecture SET content = json_set(content, '$.vehicle.length', 9.5)",
    "faults": "test_case SET faults = json_set(faults, '$[0].onset.at', 9.5)",
}


@pytest.mark.slow
def test_texts_are_no_contradiction(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    project = Project(tmp_path / "p", SMALL)
    plan = project.plan()
    run_campaign(plan, db=tmp_path / "1.db", session=Session(choice=Choice(shard=Shard(1, 2))))
    with project.edited(CANDIDATE) as candidate:
        candidate |= {"title": "Another", "cost": 7}
    with project.edited("scenarios_db/motorway/cut_in.yaml") as scenario:
        scenario["title"] = "Another"
    with project.edited_odd() as odd:
        odd["title"] = "Another"
        odd["faults"][0]["text"] = "Another"
    with project.edited(CONCEPT) as concept:
        concept["title"] = "Another"
    second = Session(choice=Choice(shard=Shard(2, 2)))
    run_campaign(project.plan(), db=tmp_path / "2.db", session=second)
    into = tmp_path / "all.db"
    found = merged(into, tmp_path / "1.db", tmp_path / "2.db")
    assert sum(item.runs for item in found) == plan.expansion.count
    sound(into)
    # Each text is a campaign, and both have all the results.
    with Repository.open(into) as repository:
        states = [item.state for item in repository.campaigns()]
    assert states == ["complete", "complete"]
    assert project.run(db=str(into)).executed == 0
    # As if it were sound: one identity over what would run otherwise.
    monkeypatch.setattr(merging, "verify", lambda _: iter(()))
    for column, forgery in FORGERIES.items():
        source = Path(shutil.copy(tmp_path / "2.db", tmp_path / column))
        alter(source, f"UPDATE {forgery}")
        refused(tmp_path / "1.db", source, IntegrityError, ["test_case ", f"another {column}"])


OWN_OF_COPIES = {"ledger", "seal"}
OF_FIRST = ("fork", "half_step", "benchmark", "injection", "takeover", "uncertainty", "withdrawal",
            "certificate", "session", "campaign_root", "uid_set")  # fmt: skip


def rows_of(repository: Repository) -> dict[str, set[tuple[Any, ...]]]:
    """Read every row of every table but those that tell of transactions."""
    with repository._database.read() as connection:
        known = (*tables.metadata.sorted_tables, *plugin_tables(connection))
        return {
            table.name: {tuple(item) for item in connection.execute(table.select())}
            for table in known
            if table.name not in OWN_OF_COPIES
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
        result_table_hash(repository, campaign),
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
def two(store: Store) -> tuple[str, str]:
    """Fill every table by one campaign, and add another one that shares some of its results."""
    store.example.decompose()
    first = store.campaign()
    store.hindsight(first)
    store.halved(first)
    store.vouched(first)
    store.example.repeat(0, 1)
    store.example.with_odd("2")
    store.example.judge(Verdict.FAIL, 2)
    second = store.campaign(12)
    store.example.thresholds = {"FSR1": "3 m"}
    third = store.plan(12, block_size=5).campaign
    assert store.repository.quarantine_block(store.claim(third), "broken")
    store.claim(third)
    store.plan(12, block_size=5)
    assert store.repository.verify() == ()
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


def copy_of(repository: Repository, to: str, *campaigns: str) -> Repository:
    into = Repository.open(to)
    into.copy(repository.location, campaigns)
    assert into.verify() == ()
    return into


@pytest.mark.slow
def test_copy_of_all_campaigns(repository: Repository, two: tuple[str, str], target: str) -> None:
    before = rows_of(repository)
    everyone = [item.id for item in repository.campaigns()]
    assert len(everyone) == 3
    assert set(two) < set(everyone)
    with copy_of(repository, target, *everyone) as into:
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


def test_copy_of_one_campaign(repository: Repository, two: tuple[str, str], target: str) -> None:
    before = rows_of(repository)
    with copy_of(repository, target, two[0]) as into:
        found = rows_of(into)
        assert told(into, two[0]) == told(repository, two[0])
        assert [item.id for item in into.campaigns()] == [two[0]]
        # Everything that vouches for it or was found about it is there, and nothing of others.
        for name in OF_FIRST:
            assert found[name] == before[name] != set(), name
        assert all(found[name] <= before[name] for name in before)
        assert len(found["run"]) == 8 + 2 < len(before["run"])
        assert {item[0] for item in found["concept"]} < {item[0] for item in before["concept"]}


def test_work_goes_on_in_a_copy(store: Store, two: tuple[str, str], target: str) -> None:
    open_one = next(item.id for item in store.repository.campaigns() if item.id not in two)
    store.example.thresholds = {"FSR1": "3 m"}
    with copy_of(store.repository, target, open_one) as into:
        state = into.work_state(open_one)
        assert (state.quarantined, state.leased) == (1, 0)
        assert into.queue.requeue_quarantined(open_one) == 1
        store.example.work_off(into, open_one)
        assert into.progress(open_one).accounted == 12
        # Cut blocks get numbers that are free.
        store.example.campaign(into, 16, block_size=9)
        assert into.verify() == ()


def test_database_that_has_campaigns_already_and_unknown_names_are_refused(
    repository: Repository, two: tuple[str, str], tmp_path: Path
) -> None:
    other = tmp_path / "other.db"
    with Repository.open(other) as taken:
        Example().campaign(taken)
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
    assert {table.name for table in LEDGER} == OWN_OF_COPIES


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
def test_kept_traces_go_over(archive: Path, tmp_path: Path) -> None:
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
        alter(old, "UPDATE metric SET min_distance_m = 99.0 WHERE run_number = 1")


@pytest.mark.parametrize("how", ["gone", "altered", "row"])
def test_altered_source_leaves_no_copy(archive: Path, tmp_path: Path, how: str) -> None:
    old, new = moved(archive, tmp_path), tmp_path / "new.db"
    spoilt(tmp_path, how)
    with pytest.raises(IntegrityError, match=r"adeye db verify"):
        campaign_of(old, "2", new)
    assert list(tmp_path.glob("new.db*")) == []


def test_wrong_copy_goes(archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old, new = moved(archive, tmp_path), tmp_path / "new.db"
    # As a disk would that keeps something else.
    insert = inserting.insert_rows
    cut: Any = lambda on, to, rows: insert(on, to, rows[1:] if to.name == "verdict" else rows)  # noqa: E731
    monkeypatch.setattr(merging, "insert_rows", cut)
    with pytest.raises(IntegrityError, match=r"not as"):
        campaign_of(old, "2", new)
    assert list(tmp_path.glob("new.db*")) == []
    assert locate(old).path == old
