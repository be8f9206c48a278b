"""Certificates stay beside their campaigns, the newest first."""

from __future__ import annotations

import hashlib
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from adeye.errors import InputError, IntegrityError
from adeye.identity import file_digest
from adeye.judge.verdict import ExitCode, Verdict
from adeye.store.evidence import roots, vouched
from adeye.store.read.totals import gate_code
from adeye.store.repository import Repository
from tests.refusals import refused
from tests.sql import alter
from tests.store.conftest import Example, Store
from tests.store.raw import guarded, unguarded
from tests.stored import known


@pytest.fixture
def campaign(store: Store) -> str:
    store.example.requirements = store.example.requirements[:1]
    return str(store.campaign(8))


def test_run_is_proven_with_the_root_alone(repository: Repository, campaign: str) -> None:
    root = known(repository.evidence.record_root(campaign))
    proof = repository.evidence.prove("5", campaign)
    assert (proof.ordinal, proof.leaves, proof.root) == (5, 8, root.root)
    path = tuple(bytes.fromhex(item) for item in proof.path)
    assert roots.Proof(5, 8, path).root(bytes.fromhex(proof.leaf)).hex() == root.root


def test_altered_evidence_is_not_proven(repository: Repository, campaign: str, raw: Any) -> None:
    repository.evidence.record_root(campaign)
    unguarded(raw)
    digest = repository.find_run("5", campaign=campaign).result_digest
    (number,) = raw.execute("SELECT number FROM run WHERE result_digest = ?", (digest,)).fetchone()
    raw.execute("UPDATE verdict SET margin = 7.5 WHERE run_number = ?", (number,))
    for run, said in ((digest, "table verdict: rows are not"), ("4", "its evidence has root")):
        refused(IntegrityError, repository.evidence.prove, run, campaign, says=said)


def test_what_has_no_leaf_is_not_proven(store: Store) -> None:
    campaign = store.everything()
    (fork,) = store.raw.execute("SELECT result_digest FROM fork LIMIT 1").fetchone()
    with pytest.raises(InputError, match="is no result of a case of campaign"):
        store.repository.evidence.prove(fork, campaign)


def test_sessions_tell_who_and_with_what(repository: Repository, campaign: str) -> None:
    told = {
        "adeye": "9", "who": "jo", "host": "h", "cpu": {"name": "fast"}, "packages": {"numpy": "2"},
    }  # fmt: skip
    repository.evidence.add_session(campaign, told)
    repository.evidence.add_session(campaign, {"packages": {"numpy": "3"}})
    one, two = repository.evidence.sessions(campaign)
    assert (one.who, one.host, one.tool, one.cpu, one.provenance) == ("jo", "h", "9", "fast", told)
    assert one.packages_digest != two.packages_digest
    assert (one.number, two.number, two.who) == (1, 2, "")
    assert repository.evidence.sessions("none") == ()


@pytest.mark.slow
@pytest.mark.parametrize("verdict", [Verdict.PASS, Verdict.FAIL])
def test_withdrawn_result_is_no_evidence_in_any_campaign(store: Store, verdict: Verdict) -> None:
    store.example.requirements = store.example.requirements[:1]
    store.example.judge(verdict, 1)
    repository, info = store.repository, store.repository.find_campaign(store.campaign(8))
    was = ExitCode.FAILED if verdict is Verdict.FAIL else ExitCode.OK
    assert gate_code(repository, info)[0] is was
    run = repository.find_run("1", campaign=info.id).result_digest
    before = repository.run_row(run)
    assert repository.evidence.withdraw(run, author=" jo ", reason="wrong map")
    assert not repository.evidence.withdraw(run, author="jo", reason="again")
    (told,) = repository.evidence.withdrawals(info.id)
    assert (told.author, told.reason, told.result_digest) == ("jo", "wrong map", run)
    code, message = gate_code(repository, info)
    assert code is ExitCode.INCOMPLETE
    assert f"1 result is withdrawn ({run[:12]} by jo: wrong map)" in message
    (status,) = [item for item in repository.gate(info.id) if item.architecture == "new"]
    assert status.verdict is Verdict.NOT_RUN
    assert (status.counts[Verdict.PASS], status.counts[Verdict.NOT_RUN]) == (3, 1)
    assert repository.run_row(run) == before
    assert repository.verify() == ()
    wider = repository.find_campaign(store.campaign(12))
    assert gate_code(repository, wider)[0] is ExitCode.INCOMPLETE


def test_withdrawn_result_is_told_wherever_its_run_is_asked_for(
    repository: Repository, campaign: str, raw: Any, caplog: pytest.LogCaptureFixture
) -> None:
    run = repository.find_run("1", campaign=campaign)
    views = (
        "SELECT verdict, exercised FROM v_verdicts WHERE run = ?",
        "SELECT verdicts FROM v_runs WHERE run = ?",
    )
    seen = "SELECT SUM(done), SUM(exercised) FROM v_coverage"
    before = raw.execute(seen).fetchone()
    assert repository.evidence.withdraw(run.result_digest, author="jo", reason="wrong map")
    assert not caplog.messages
    assert {*raw.execute(views[0], (run.result_digest,)).fetchall()} == {("NOT_RUN", None)}
    assert raw.execute(views[1], (run.result_digest,)).fetchone() is None
    assert raw.execute(seen).fetchone() == (before[0] - 1, before[1] - 1)
    assert repository.find_run(run.result_digest[:9]).result_digest == run.result_digest
    assert caplog.messages == [
        f"run {run.result_digest[:12]} was withdrawn by jo, so it is no evidence: wrong map"
    ]
    with pytest.raises(InputError, match="was withdrawn, so it is no evidence"):
        repository.evidence.prove("1", campaign)


def test_withdrawal_that_is_gone_leaves_nothing_green(store: Store, raw: Any) -> None:
    repository, info = store.repository, store.repository.find_campaign(store.campaign(8))
    run = repository.find_run("1", campaign=info.id).result_digest
    repository.evidence.withdraw(run, author="jo", reason="wrong map")
    unguarded(raw)
    raw.execute("DELETE FROM withdrawal")
    guarded(raw)
    assert gate_code(repository, info)[0] is ExitCode.INTEGRITY
    refused(IntegrityError, repository.require_sound, info.id, says="withdrawal 1: is missing")


def test_withdrawals_are_counted_and_need_words(repository: Repository, campaign: str) -> None:
    runs = [repository.find_run(at, campaign=campaign).result_digest for at in "13570"]
    for author, reason in ((" ", "r"), ("a", "")):
        with pytest.raises(InputError, match="is empty"):
            repository.evidence.withdraw(runs[0], author=author, reason=reason)
    assert repository.evidence.withdrawals() == ()
    for run in runs:
        repository.evidence.withdraw(run, author="jo", reason="wrong map")
    assert "; 2 more)" in gate_code(repository, repository.find_campaign(campaign))[1]


def test_kept_files_name_their_runs(repository: Repository, campaign: str) -> None:
    files = repository.evidence.kept_files(campaign)
    assert files == repository.evidence.kept_files()
    assert sum(len(runs) for runs in files.values()) == 8
    assert repository.evidence.kept_files("none") == {}


def leaves(count: int) -> list[bytes]:
    return [roots.leaf_hash(str(place).encode()) for place in range(count)]


def recursive(items: list[bytes]) -> bytes:
    """RFC 6962, section 2.1, as it is written there."""
    if len(items) == 1:
        return items[0]
    split = 1
    while 2 * split < len(items):
        split *= 2
    return roots.node_hash(recursive(items[:split]), recursive(items[split:]))


def grown(items: list[bytes], watched: int | None = None) -> roots.Tree:
    tree = roots.Tree(watched)
    for item in items:
        tree.add(item)
    return tree


def test_leaf_and_node_begin_differently() -> None:
    assert roots.leaf_hash(b"ab") == hashlib.sha256(b"\x00ab").digest()
    assert roots.node_hash(b"a", b"b") == hashlib.sha256(b"\x01ab").digest()


def test_every_leaf_is_proven_and_no_other_and_the_root_is_that_of_the_definition() -> None:
    for items in map(leaves, (1, 2, 3, 4, 5, 7, 8, 9, 13, 31, 33)):
        for place, leaf in enumerate(items):
            tree = grown(items, place)
            assert tree.root() == tree.root() == recursive(items)
            proof = tree.proof()
            assert proof == tree.proof()
            assert proof.root(leaf) == tree.root()
            assert proof.root(roots.leaf_hash(b"other")) != tree.root()


def test_proof_is_of_one_place_and_size() -> None:
    items = leaves(6)
    tree = grown(items, 2)
    assert replace(tree.proof(), place=3).root(items[2]) != tree.root()
    for wrong in (
        roots.Proof(2, 60, tree.proof().path),
        roots.Proof(9, 6, ()),
        roots.Proof(0, 1, (items[0],)),
    ):
        refused(ValueError, wrong.root, items[2], says="does not fit")


def test_nothing_is_proven_of_no_leaf() -> None:
    with pytest.raises(ValueError, match="no root"):
        roots.Tree().root()
    for tree in (grown(leaves(3)), grown(leaves(3), 3)):
        refused(ValueError, tree.proof, says="there is no leaf")


def test_sums_of_a_campaign_do_not_change_with_another_one(store: Store) -> None:
    campaign = store.campaign(4)
    before = store.repository.evidence.sums(campaign)
    assert before["run"][0] == before["metric"][0] == before["campaign_case"][0] == 4
    assert all(rows for rows, _ in before.values())
    store.example.thresholds = {"FSR1": "other"}
    other = store.campaign(8)
    assert store.repository.evidence.sums(campaign) == before
    assert store.repository.evidence.sums(other) != before


def root_of(path: Path, example: Any, **options: Any) -> str:
    with Repository.open(path) as repository:
        campaign = example.campaign(repository, 8, **options)
        found = known(repository.evidence.record_root(campaign))
        assert found.leaves == 8
        return str(found.root)


@pytest.mark.slow
def test_one_plan_has_one_root_whatever_the_blocks_and_what_else_is_there(tmp_path: Path) -> None:
    expected = root_of(tmp_path / "a.db", Example())
    for size in (1, 4, 100):
        assert root_of(tmp_path / f"{size}.db", Example(), block_size=size) == expected
    with Repository.open(tmp_path / "other.db") as repository:
        example = Example()
        other = Store(repository, example)
        other.hindsight(other.campaign(12))
    assert root_of(tmp_path / "other.db", Example()) == expected
    example.judge(Verdict.FAIL, 5)
    assert root_of(tmp_path / "b.db", example) != expected


def test_words_of_a_predicate_are_not_in_the_root(tmp_path: Path) -> None:
    path = tmp_path / "a.db"
    before = root_of(path, Example())
    alter(path, "UPDATE verdict SET predicate = 'gap >= 2.0'")
    with Repository.open(path) as repository:
        campaign = repository.find_campaign().id
        assert repository.evidence.computed_root(campaign).root == before


def test_incomplete_campaign_has_none(store: Store) -> None:
    plan = store.plan(4)
    assert store.repository.evidence.record_root(plan.campaign) is None
    assert store.repository.evidence.computed_root(plan.campaign).leaves == 4


def test_rows_are_read_in_parts(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    campaign = store.campaign(8)
    whole = store.repository.evidence.computed_root(campaign)
    monkeypatch.setattr(roots, "_CHUNK", 3)
    assert store.repository.evidence.computed_root(campaign) == whole


def test_altered_evidence_of_a_complete_campaign_is_refused(store: Store) -> None:
    campaign = store.campaign(8)
    root = known(store.repository.evidence.record_root(campaign))
    assert store.repository.evidence.record_root(campaign) == root
    with pytest.raises(IntegrityError, match="has root"):
        store.repository.evidence.require_root(vouched.Root(campaign, 8, "f" * 64))
    store.raw.execute("DROP TRIGGER verdict_no_update")
    store.raw.execute("UPDATE verdict SET margin = 7 WHERE run_number = 3")
    assert "campaign_root" in {item.table for item in store.repository.verify()}
    if not store.repository.location.is_server:
        # A server lets no bytes into a column of numbers.
        store.raw.execute("UPDATE verdict SET margin = x'00' WHERE run_number = 3")
        refused(IntegrityError, store.repository.evidence.computed_root, campaign, says="damaged")
    assert "campaign_root" in {item.table for item in store.repository.verify()}


def test_root_without_its_plan_is_a_finding(store: Store) -> None:
    store.repository.evidence.record_root(store.campaign(4))
    unguarded(store.raw)
    store.raw.execute("DELETE FROM campaign")
    assert "campaign_root" in {item.table for item in store.repository.verify()}


FINDING = {"run": "ab", "first_tick": 100}


def test_certificates_come_back_the_newest_first(store: Store) -> None:
    conditions = [{"condition": "batches of 7", "runs": 3}]
    record = roots.CertificateRecord(
        store.campaign(), "0.1", "portable", 8, 1000, 3, 1, conditions, []
    )
    certificates = store.repository.hindsight.certificates
    certificates.save(record)
    certificates.save(replace(record, class_="same platform", findings=[FINDING]))
    newest, oldest = certificates.of(record.campaign)
    assert (newest.findings, newest.class_) == ([FINDING], "same platform")
    assert replace(oldest, at="") == record
    assert oldest.at.endswith("+00:00")
    assert store.repository.verify() == ()
    assert certificates.of("0" * 32) == ()
    with pytest.raises(IntegrityError):
        certificates.save(replace(record, sampled=0))


def test_executed_runs_are_each_once_in_the_order_of_the_plan(store: Store) -> None:
    executed = store.repository.hindsight.certificates.executed(store.campaign())
    assert [item.run.ordinal for item in executed] == list(range(8))
    assert len({item.run.result_digest for item in executed}) == 8
    assert {len(item.stratum) for item in executed} == {3}


NAME = "0123456789abcdef" * 4
PARTS = (
    *("..", ".", "", "\\", "..\\", "~", "-", "%2e%2e", "\x00", "\n", "\x1b[2J", "\u202e", "\udc80"),
    *("\uff0e\uff0e", "$HOME", "CON", "C:", "file:", NAME, NAME[:-1], NAME.upper(), "outside", "é"),
    *("a" * 300, "*", "?", " ", "`id`", ";id", "\r", roots.SUFFIX),
)
NAMES = {f"{first}{between}{last}" for first in PARTS for last in PARTS for between in ("", "/")}
NAMES -= {NAME}


def test_file_is_named_after_its_content(tmp_path: Path) -> None:
    path = tmp_path / f"a{roots.SUFFIX}"
    path.write_bytes(b"traces")
    assert file_digest(path) == hashlib.sha256(b"traces").hexdigest()
    path.write_bytes(b"traceS")
    assert file_digest(path) != hashlib.sha256(b"traces").hexdigest()


def test_every_database_has_a_folder_beside_it() -> None:
    names = ("x/y.db", "nightly.24", "nightly.25", "a.db", "a.sqlite", "a", "a.b")
    folders = {str(roots.folder_of(Path(name))) for name in names}
    assert folders == {f"{name}.traces" for name in names}


@pytest.mark.parametrize("folder", ["x.db.traces", "x.traces", "before.db.traces"])
def test_file_is_found_where_it_was_written(tmp_path: Path, folder: str) -> None:
    """In the folder of the database, that of earlier releases, or that of its former name."""
    (tmp_path / folder).mkdir()
    file = tmp_path / folder / f"{NAME}{roots.SUFFIX}"
    file.write_bytes(b"traces")
    assert roots.find_kept(roots.folders_of(tmp_path / "x.db"), NAME) == file
    link = tmp_path / "elsewhere" / "y.db"
    link.parent.mkdir()
    (tmp_path / "x.db").touch()
    link.symlink_to(tmp_path / "x.db")
    assert roots.folder_of(link) == tmp_path / "x.db.traces"
    assert roots.find_kept(roots.folders_of(link), NAME) == file


def test_no_name_leads_to_another_place(tmp_path: Path) -> None:
    """A file stands wherever a name leads to, inside or outside of the folder."""
    folder = tmp_path / "inside" / "a.traces"
    folder.mkdir(parents=True)
    planted = 0
    for name in sorted(NAMES):
        try:
            path = Path(os.path.normpath(f"{folder}/{name}{roots.SUFFIX}"))
            if path.is_relative_to(tmp_path):
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(b"planted")
                planted += 1
        except (OSError, ValueError):
            pass
        assert roots.kept_path(folder, name) is None, name
    assert len(NAMES) > 1_000
    assert planted > 500
    (folder / f"{NAME}{roots.SUFFIX}").write_bytes(b"traces")
    assert roots.kept_path(folder, NAME) == folder / f"{NAME}{roots.SUFFIX}"


@pytest.mark.parametrize("kind", ["link", "folder", "pipe"])
def test_only_a_file_of_its_own_is_one(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"{NAME}{roots.SUFFIX}"
    if kind == "link":
        (tmp_path / "elsewhere").write_bytes(b"traces")
        path.symlink_to(tmp_path / "elsewhere")
    elif kind == "folder":
        path.mkdir()
    else:
        os.mkfifo(path)
    assert roots.kept_path(tmp_path, NAME) is None
