"""Columns of a block: their texts, their rows, and hashes that any change changes."""

import math
import pickle
import sqlite3
import unicodedata
from dataclasses import fields, is_dataclass, replace
from datetime import UTC, datetime, timedelta, timezone
from typing import Any

import numpy as np
import pytest
from sqlalchemy.dialects import sqlite
from sqlalchemy.schema import CreateTable

from adeye.errors import IntegrityError
from adeye.judge.verdict import Outcome, Verdict
from adeye.store import encoding as bulk
from adeye.store import tables
from adeye.store.block import BasisBlock, ExtremeBlock, JudgedBlock, MetricBlock, VerdictBlock
from adeye.store.encoding import (
    Column,
    Dictionary,
    Texts,
    hash_words,
    hashed_names,
    next_number,
    row,
    row_hash,
    row_hashes,
    rows_of_columns,
    run_numbers,
    stored_hashes,
    stored_words,
    table_rows,
)
from adeye.store.records import BlockCase, EventRecord, MetricValue
from adeye.store.repository import Repository
from adeye.store.texts import json_text, utc_text
from tests.refusals import refused
from tests.store.conftest import Example, Store
from tests.store.raw import on_sqlite
from tests.store.rows import RunRecord, event_block, run_block

NAN = float("nan")
EVENT = (3, 0, 1.5, "contact", None, "hit")


def test_row_is_its_values_as_a_database_keeps_them_and_their_hash() -> None:
    made = row(tables.event, EVENT)
    assert made == (*EVENT, row_hash(tables.event, EVENT))
    kept = row(tables.event, (3, 0, -0.0, "k", None, "a\x00b\ud800c"))
    assert (math.copysign(1.0, kept[2]), kept[5]) == (1.0, "a\\x00b\\ud800c")


def test_every_value_and_its_type_change_the_hash() -> None:
    others = [(*EVENT[:at], 7 if at < 3 else "other", *EVENT[at + 1 :]) for at in range(6)]
    values = [(value,) for value in (1, 1.0, "1", "i1", None, "n", "")]
    hashes = {row_hash(tables.event, item) for item in (EVENT, *others, *values)}
    assert len(hashes | {row_hash(tables.run, EVENT)}) == 1 + 6 + 7 + 1
    refused(TypeError, row_hash, tables.event, (b"blob",), says="is not what was written")


def test_rows_that_are_hashed_together_have_the_hashes_that_each_has_alone() -> None:
    columns: tuple[list[Any], ...]
    columns = ([1, 2, 3], [1.0, -2.5, 1e300], ["a", "%s", "\ud800"], [None] * 3, [1, 1.0, "1"])
    for kept in range(1, 1 << len(columns)):
        chosen = [column for place, column in enumerate(columns) if kept >> place & 1]
        rows = list(zip(*chosen, ["hash"] * 3, strict=True))
        alone = [row_hash(tables.event, values[:-1]) for values in rows]
        assert stored_hashes(tables.event, rows) == alone
    refused(TypeError, stored_hashes, tables.event, [(b"x", ""), (b"y", "")], says="was written")


def test_row_and_json_refuse_what_cannot_be_held() -> None:
    for place, value, error, match in (
        *((2, number, ValueError, "cannot be stored") for number in (NAN, math.inf, -math.inf)),
        (1, 0.5, ValueError, r"0\.5"),
        (3, 3, TypeError, "not text"),
    ):
        refused(error, row, tables.event, (*EVENT[:place], value, *EVENT[place + 1 :]), says=match)
    refused(ValueError, row, tables.event, EVENT[:-1], says="zip")
    refused(ValueError, json_text, {"a": NAN}, says="not JSON compliant")


def test_times_of_day_are_utc() -> None:
    east = timezone(timedelta(hours=2))
    assert utc_text(datetime(2026, 1, 1, 2, tzinfo=east)) == "2026-01-01T00:00:00.000+00:00"
    assert datetime.fromisoformat(utc_text(None)).utcoffset() == datetime.now(UTC).utcoffset()


CASE: list[Any] = ["d", "s", "x", "y", "no%ne", "[]", "{}", 0, 7, 0.05, "o", 3]


def test_rows_of_columns_are_the_rows_of_their_values() -> None:
    columns = [*CASE]
    columns[0], columns[6], columns[7] = ["d", "e%s"], ["{}", '{"a":"ü"}'], [0, 1]
    columns[9], columns[11] = [0.05, 0.1], range(3, 5)
    other = ["e%s", *CASE[1:6], '{"a":"ü"}', 1, 7, 0.1, "o", 4]
    made = rows_of_columns(tables.test_case, columns)
    assert made == [row(tables.test_case, CASE), row(tables.test_case, other)]
    with pytest.raises(ValueError, match="zip"):
        rows_of_columns(tables.test_case, [["d", "e"], ["s"], *CASE[2:]])


WORDS = ("a", "", None, "größer", "雪", "a\x00b", "\ud800", "b" * 64, "x%s'\"")


def events(rows: int = 40, seed: int = 1) -> list[Column]:
    """Columns of ``event`` with NULLs, zeros of both signs and texts of all kinds."""
    bits = np.random.default_rng(seed)
    times = bits.choice([0.0, -0.0, 1.5, 5e-324, -1e300], rows)
    return [
        Texts.unique([f"{run:064x}" for run in range(rows)]),
        bits.integers(0, 9, rows),
        times,
        Texts.of([WORDS[code] or "" for code in bits.integers(0, len(WORDS), rows)]),
        Texts.of([WORDS[code] for code in bits.integers(0, len(WORDS), rows)]),
        Texts.of([WORDS[code] or "" for code in bits.integers(0, len(WORDS), rows)]),
    ]


def stored(columns: list[Column], table: Any = tables.event) -> list[tuple[Any, ...]]:
    """Write rows to a database and read back what is hashed of them, and the hashes."""
    digests = columns[0]
    assert isinstance(digests, Texts)
    made = table_rows([digests.codes, *columns[1:]], hash_words(columns), table)
    connection = sqlite3.connect(":memory:")
    connection.execute(str(CreateTable(table).compile(dialect=sqlite.dialect())))
    places = ", ".join("?" * len(made[0]))
    connection.executemany(f"INSERT INTO {table.name} VALUES ({places})", made)  # noqa: S608
    found = connection.execute(f"SELECT * FROM {table.name} ORDER BY 1, 2").fetchall()  # noqa: S608
    return [(digests.dictionary.words[number], *values) for number, *values in found]


def rehashed(table: Any, rows: list[tuple[Any, ...]]) -> list[str]:
    return row_hashes(table, stored_words(table, hashed_names(table), [row[:-1] for row in rows]))


def test_texts_come_back_as_they_went_in_but_for_what_a_database_cannot_keep() -> None:
    values = ["a", None, "größer", "a", ""]
    texts = Texts.of(values)
    assert (texts.values(), len(texts)) == (values, 5)
    # Code -1 is the last word.
    actor = Texts(np.array([0, -1, 1]), Dictionary(("lead", "cutter", None)))
    for made, expected in (
        (texts[np.array([4, 1])], ["", None]),
        (Texts.same("x", 3), ["x"] * 3),
        (Texts.same(None, 2), [None, None]),
        (Texts.unique(["ab", "cd"]), ["ab", "cd"]),
        (actor, ["lead", None, "cutter"]),
        (Texts.of(["a\x00b", "\ud800", None]), ["a\\x00b", "\\ud800", None]),
    ):
        assert made.values() == expected


def test_dictionary_is_sent_without_what_can_be_calculated_again() -> None:
    words = Dictionary(("a", None))
    before = len(pickle.dumps(words))
    assert words.hashes.shape == (2, 2)
    assert words.objects.tolist() == ["a", None]
    sent = pickle.dumps(words)
    assert len(sent) == before
    assert np.array_equal(pickle.loads(sent).hashes, words.hashes)  # noqa: S301 - made here


def test_different_texts_have_different_hashes_wherever_they_stand() -> None:
    composed, apart = unicodedata.normalize("NFC", "ö"), unicodedata.normalize("NFD", "ö")
    digests = ["a" * 64, "A" * 64, "a" * 63 + "b", "b" + "a" * 63, "a" * 32, "g" * 64]
    words = (None, "", " ", "0", "a", composed, apart, *digests)
    together = Dictionary(words).hashes
    assert len({tuple(item) for item in together.tolist()}) == len(words)
    for place, word in enumerate(words):
        assert np.array_equal(Dictionary((word,)).hashes[0], together[place])
    uniform = Dictionary(("a" * 64, "b" + "a" * 63)).hashes
    assert np.array_equal(uniform[0], Dictionary(words).hashes[words.index("a" * 64)])


def test_every_digit_of_a_digest_counts() -> None:
    for size in (32, 64):
        digest = ("0123456789abcdef" * 4)[:size]
        words = {
            digest[:place] + format(int(digest[place], 16) ^ 1 << bit, "x") + digest[place + 1 :]
            for place in range(size)
            for bit in range(4)
        }
        words |= {digest, digest[size // 2 :] + digest[: size // 2]}
        hashes = Dictionary(tuple(words)).hashes
        assert len({tuple(item) for item in hashes.tolist()}) == len(words) > 4 * size


def test_hash_of_a_row_is_the_hash_of_what_the_database_returns() -> None:
    rows = stored(events())
    assert rehashed(tables.event, rows) == [row[-1] for row in rows]
    assert {row[4] for row in rows} > {None, "", "größer"}
    assert all(len(row[-1]) == 32 for row in rows)


def test_row_has_the_same_hash_alone_and_in_any_order() -> None:
    columns = events()
    together = row_hashes(tables.event, hash_words(columns))
    order = np.random.default_rng(2).permutation(40)
    mixed = row_hashes(tables.event, hash_words([column[order] for column in columns]))
    assert mixed == [together[row] for row in order]
    for at in (0, 17, 39):
        alone = hash_words([column[np.array([at])] for column in columns])
        assert row_hashes(tables.event, alone) == [together[at]]


def altered(value: Any) -> list[Any]:
    if isinstance(value, int):
        return [value ^ 1 << bit for bit in range(63)]
    if isinstance(value, float):
        (word,) = np.array([value]).view(np.uint64).tolist()
        flipped = np.array([word ^ 1 << bit for bit in range(64)], np.uint64).view(np.float64)
        # A zero has one sign in the database, and what is not finite cannot be there.
        return [item for item in flipped.tolist() if math.isfinite(item) and item != value]
    if value is None:
        return ["", "None"]
    content = value.encode()
    flipped_texts = [
        bytes([*content[:place], content[place] ^ 1 << bit, *content[place + 1 :]])
        for place in range(len(content))
        for bit in range(7)
        if content[place] < 128
    ]
    return [item.decode() for item in flipped_texts] + [f"{value} ", value[:-1]]


def test_one_changed_bit_of_any_value_changes_the_hash() -> None:
    row = stored(events(seed=3))[5]
    tried = 0
    for place, value in enumerate(row[:-1]):
        for other in altered(value):
            if other != value:
                changed = (*row[:place], other, *row[place + 1 :])
                assert rehashed(tables.event, [changed]) != [row[-1]], (place, other)
                tried += 1
    assert tried > 600


def test_values_that_change_places_change_the_hash() -> None:
    row = stored(events(seed=4))[0]
    swapped = (*row[:3], row[5], row[4], row[3], row[-1])
    assert row[3] == row[5] or rehashed(tables.event, [swapped]) != [row[-1]]
    words = hash_words(events())
    assert row_hashes(tables.event, words) != row_hashes(tables.run, words)


def test_hash_of_a_row_is_what_databases_hold() -> None:
    first, second, *_ = row_hashes(tables.event, hash_words(events()))
    assert first == "6aa2db7d7aaf4ac94e77b2f2f3dc3159"
    assert second == "9c3ae480f7875e31b2d6a4d393c144a9"


def test_minus_zero_is_stored_and_hashed_as_zero() -> None:
    columns = events(1)
    columns[2] = np.array([-0.0])
    assert np.array_equal(hash_words([columns[2]]), hash_words([np.array([0.0])]))
    (row,) = stored(columns)
    assert math.copysign(1.0, row[2]) == 1.0


def test_null_is_no_zero_and_no_empty_text_and_infinity_is_refused() -> None:
    assert not np.array_equal(hash_words([np.array([NAN])]), hash_words([np.array([0.0])]))
    assert not np.array_equal(hash_words([Texts.same(None, 1)]), hash_words([Texts.same("", 1)]))
    other = np.array([0xFFF8000000000001], dtype=np.uint64).view(np.float64)
    assert np.array_equal(hash_words([other]), hash_words([np.array([NAN])]))
    for number in (math.inf, -math.inf):
        with pytest.raises(ValueError, match="infinity cannot be stored"):
            hash_words([np.array([0.0, number])])


def test_missing_number_is_null_to_every_database() -> None:
    # PostgreSQL would keep a NaN, and no query finds that it is missing.
    columns = events(2)
    columns[2] = np.array([NAN, 1.5])
    digests = columns[0]
    assert isinstance(digests, Texts)
    made = table_rows([digests.codes, *columns[1:]], hash_words(columns), tables.event)
    assert [row[2] for row in made] == [None, 1.5]


def test_value_that_was_never_written_is_named() -> None:
    row = stored(events())[0]
    others: dict[int, Any] = {1: (1.0, "1", True), 2: (1, "1.5", b"\x00"), 3: (b"switch", 5)}
    for place, value in ((at, one) for at, values in others.items() for one in values):
        with pytest.raises(TypeError, match="is not what was written"):
            rehashed(tables.event, [(*row[:place], value, *row[place + 1 :])])
    refused(ValueError, rehashed, tables.event, [(*row[:2], math.inf, *row[3:])], says="not finite")


def test_no_rows_have_no_hashes() -> None:
    assert rehashed(tables.event, []) == []
    empty = [column[np.zeros(0, dtype=np.int64)] for column in events()]
    assert table_rows(empty, hash_words(empty), tables.event) == []


def test_runs_are_numbered_from_one_without_gaps_and_found_in_any_order(store: Store) -> None:
    with store.repository._database.read() as connection:
        assert next_number(connection) == 1
    store.campaign(8)
    stored = dict(store.rows("SELECT result_digest, number FROM run"))
    assert sorted(stored.values()) == list(range(1, 9))
    asked = sorted(stored, reverse=True)
    with store.repository._database.read() as connection:
        assert next_number(connection) == 9
        assert run_numbers(connection, asked).tolist() == [stored[digest] for digest in asked]
        assert run_numbers(connection, []).tolist() == []
        with pytest.raises(IntegrityError, match=r"run f{12} is not in the database"):
            run_numbers(connection, ["f" * 64])


@on_sqlite
def test_rows_of_one_block_lie_one_after_the_other(store: Store) -> None:
    store.campaign(8)
    for table in ("metric", "verdict", "event"):
        found = store.rows(f"SELECT DISTINCT run_number FROM {table}")  # noqa: S608
        assert [item[0] for item in found] == list(range(1, 9)), table


def indexes(raw: sqlite3.Connection) -> set[tuple[str, str]]:
    return set(raw.execute("SELECT name, sql FROM sqlite_master WHERE type = 'index'"))


def contents(raw: sqlite3.Connection) -> list[str]:
    """All rows in order, without what stands where in the schema, and without times of day."""
    dumped = [line for line in raw.iterdump() if line.startswith("INSERT")]
    timed = ('"campaign"', "'campaign'")
    return sorted(line for line in dumped if not any(word in line for word in timed))


@on_sqlite
def test_rebuilt_indexes_are_the_same(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    before = indexes(store.raw)
    monkeypatch.setattr(bulk, "MANY_ROWS", 1)
    store.plan(40)
    assert indexes(store.raw) == before
    assert store.repository.verify() == ()
    assert store.rows("PRAGMA integrity_check") == [("ok",)]


def test_rebuilding_loses_no_row(
    empty: bytes, tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = []
    for many in (1, 10**9):
        monkeypatch.setattr(bulk, "MANY_ROWS", many)
        path = tmp_path / f"{many}.db"
        path.write_bytes(empty)
        example = Example()
        with Repository.open(path, create=False) as opened:
            opened.plan_campaign(example.record(), example.cases(40))
        found.append(contents(sqlite3.connect(path)))
    assert found[0] == found[1]


@on_sqlite
def test_failed_rebuilding_leaves_indexes(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    before = indexes(store.raw)
    monkeypatch.setattr(bulk, "MANY_ROWS", 1)
    monkeypatch.setattr("adeye.store.write.planning._CHUNK", 1)

    def broken() -> Any:
        yield from store.example.cases(3)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        store.plan(broken())
    assert indexes(store.raw) == before
    assert set(store.repository.info().rows.values()) == {0}


def test_few_rows_and_rows_into_many_use_the_indexes() -> None:
    assert bulk.is_worth_rebuilding(bulk.MANY_ROWS, 0)
    assert bulk.is_worth_rebuilding(bulk.MANY_ROWS, bulk.MANY_ROWS)
    assert not bulk.is_worth_rebuilding(bulk.MANY_ROWS - 1, 0)
    assert not bulk.is_worth_rebuilding(bulk.MANY_ROWS, bulk.MANY_ROWS + 1)


@on_sqlite
def test_cache_is_large_for_a_while_only(repository: Repository) -> None:
    with repository._database.write() as connection:
        before = connection.exec_driver_sql("PRAGMA cache_size").scalar_one()
        with bulk.large_cache(connection):
            during = connection.exec_driver_sql("PRAGMA cache_size").scalar_one()
        after = connection.exec_driver_sql("PRAGMA cache_size").scalar_one()
        assert (during, after) == (-bulk.CACHE_KIB, before)
        assert bulk.size_of(connection, tables.test_case) == 0


# --- blocks of results: what goes in one by one comes out as columns, whole or in part


@pytest.fixture
def records(example: Any) -> list[RunRecord]:
    """Five runs with different numbers of verdicts and events, some with metrics of a plug-in."""
    example.verdict_of = lambda case, _: Verdict.FAIL if case.ordinal in {1, 4} else Verdict.PASS
    cases = [
        BlockCase(
            ordinal=number,
            test_case=f"{number:064x}",
            result_digest=f"{number:064x}",
            missing_fsrs=("FSR1", "FSR2")[: number % 3],
            has_result=False,
        )
        for number in range(5)
    ]
    made = []
    for case in cases:
        events = [EventRecord(0.1 * k, "fault", None, f"größer {k}") for k in range(case.ordinal)]
        own = {"ours": {"mine": MetricValue(1.0 * case.ordinal)}} if case.ordinal % 2 else {}
        made.append(example.run(case, events=events, plugin_metrics=own))
    return made


def said(part: Any) -> Any:
    """What a part of a block says, however its texts are numbered."""
    if isinstance(part, Texts):
        return part.values()
    if isinstance(part, Dictionary):
        return None
    if isinstance(part, MetricBlock):
        actors = Texts(part.actor, part.actors).codes
        names = part.actors.objects[actors].tolist()
        numbers = [repr(item) for item in (part.value.tolist(), part.time_s.tolist())]
        return part.ids, numbers, part.status.tolist(), names
    if isinstance(part, np.ndarray):
        return repr(part.tolist())
    if is_dataclass(part):
        return {item.name: said(getattr(part, item.name)) for item in fields(part)}
    return [said(item) for item in part] if isinstance(part, tuple | list) else part


@pytest.mark.parametrize("runs", [[0], [3], [1, 2], [0, 2, 4], [0, 1, 2, 3, 4], []])
def test_chosen_runs_are_those_runs_alone(records: list[RunRecord], runs: list[int]) -> None:
    chosen = said(run_block(records).take(np.array(runs, dtype=np.int64)))
    alone = said(run_block([records[run] for run in runs]))
    for part in ("engines", "plugin_metrics"):
        chosen.pop(part)
        alone.pop(part)
    assert chosen == alone


def test_metrics_of_a_plug_in_stay_with_their_runs(records: list[RunRecord]) -> None:
    (block,) = run_block(records).plugin_metrics
    assert (block.plugin, block.run.tolist()) == ("ours", [1, 3])
    part = block.take(np.array([2, 3]))
    assert (part.run.tolist(), part.metrics.value.tolist()) == ([1], [[3.0]])


def test_runs_with_a_failure_are_counted_once(records: list[RunRecord]) -> None:
    verdicts = run_block(records).verdicts
    assert verdicts.failures == 2
    assert verdicts.take(verdicts.run != 1).failures == 1
    assert VerdictBlock.of(()).failures == 0


def test_engines_are_listed_once(records: list[RunRecord]) -> None:
    other = replace(records[3].engine, variant="exact")
    mixed = [*records[:3], replace(records[3], engine=other), records[4]]
    block = run_block(mixed)
    assert (len(block), len(block.engines), block.engine.tolist()) == (5, 2, [0, 0, 0, 1, 0])
    assert block.result_digests == tuple(record.result_digest for record in mixed)
    code = list(Outcome).index(Outcome.INFRASTRUCTURE_ERROR)
    with pytest.raises(ValueError, match="no result"):
        replace(block, outcome=np.full(5, code))


def test_events_are_numbered_run_by_run(records: list[RunRecord]) -> None:
    events = run_block(records).events
    assert events.run.tolist() == [1, 2, 2, 3, 3, 3, 4, 4, 4, 4]
    assert events.seq.tolist() == [0, 0, 1, 0, 1, 2, 0, 1, 2, 3]
    assert events.subject.values() == [None] * 10
    assert event_block([[], []]).seq.tolist() == []


def test_value_of_a_metric_is_finite_and_fits_its_status() -> None:
    def metric_block(value: float, status: int) -> MetricBlock:
        values, statuses, times, actors = np.array([value, status, np.nan, -1]).reshape(4, 1, 1)
        return MetricBlock(
            ("gap_m",), values, statuses.astype(int), times, actors.astype(int), Dictionary((None,))
        )

    for value in (np.nan, np.inf, -np.inf):
        refused(ValueError, metric_block, value, status=0, says="metric gap_m")
    for value in (0.0, np.inf):
        refused(ValueError, metric_block, value, status=1, says="no_conflict")


def test_judged_verdicts_belong_to_the_place_of_their_result(records: list[RunRecord]) -> None:
    block = JudgedBlock.of({"a" * 64: records[2].verdicts, "b" * 64: records[1].verdicts})
    assert block.result_digests == ("a" * 64, "b" * 64)
    assert block.verdicts.run.tolist() == [0, 0, 1]
    assert block.verdicts.fsr_id.values() == ["FSR1", "FSR2", "FSR1"]
    assert block.trace_digests == ()


def block() -> BasisBlock:
    extremes = ExtremeBlock(
        run=np.array([0, 1, 1, 3]),
        measure=Texts.of(["least gap", "least gap", "least ttc", "least gap"]),
        value=np.array([1.0, 2.0, 3.0, 4.0]),
        time_s=np.array([0.1, 0.2, 0.3, 0.4]),
        actor=Texts.of(["lead", None, "lead", "cutter"]),
        samples=Texts.of(["a", "b", "c", "d"]),
    )
    return BasisBlock(
        version=1,
        uids={"contact": "adeye:contact@1"},
        by_contact=np.array([True, False, False, True]),
        invalid=Texts.of([None, "not realised", None, None]),
        extremes=extremes,
        files=(("t.npz", 0), None, ("t.npz", 2), ("t.npz", 3)),
    )


def test_chosen_runs_keep_their_samples_under_new_numbers() -> None:
    whole = block()
    chosen = whole.take(np.array([1, 3]))
    assert chosen.by_contact.tolist() == [False, True]
    assert chosen.invalid.values() == ["not realised", None]
    assert chosen.files == (None, ("t.npz", 3))
    assert chosen.extremes.run.tolist() == [0, 0, 1]
    assert chosen.extremes.samples.values() == ["b", "c", "d"]
    assert chosen.extremes.value.tolist() == [2.0, 3.0, 4.0]
    # A run may have no samples, and a block no traces.
    assert whole.take(np.array([2])).extremes.run.tolist() == []
    assert replace(whole, files=()).take(np.array([0, 2])).files == ()
