"""Columns of a block: their texts, their rows, and hashes that any change changes."""

import math
import pickle
import sqlite3
import unicodedata
from typing import Any

import numpy as np
import pytest
from sqlalchemy.dialects import sqlite
from sqlalchemy.schema import CreateTable

from adeye.store import tables
from adeye.store.encoding import (
    Column,
    Dictionary,
    Texts,
    hash_words,
    hashed_names,
    row_hashes,
    stored_words,
    table_rows,
)

NAN = float("nan")
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


def test_texts_come_back_as_they_went_in() -> None:
    values = ["a", None, "größer", "a", ""]
    texts = Texts.of(values)
    assert texts.values() == values
    assert len(texts) == 5
    assert texts[np.array([4, 1])].values() == ["", None]
    assert Texts.same("x", 3).values() == ["x"] * 3
    assert Texts.same(None, 2).values() == [None, None]
    assert Texts.unique(["ab", "cd"]).values() == ["ab", "cd"]


def test_code_minus_one_is_the_last_word() -> None:
    actor = Texts(np.array([0, -1, 1]), Dictionary(("lead", "cutter", None)))
    assert actor.values() == ["lead", None, "cutter"]


def test_what_a_database_cannot_keep_is_escaped() -> None:
    assert Dictionary(("a\x00b", "\ud800", None)).words == ("a\\x00b", "\\ud800", None)


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


@pytest.mark.parametrize("size", [32, 64])
def test_every_digit_of_a_digest_counts(size: int) -> None:
    digest = ("0123456789abcdef" * 4)[:size]
    changed = [
        digest[:place] + format(int(digest[place], 16) ^ 1 << bit, "x") + digest[place + 1 :]
        for place in range(size)
        for bit in range(4)
    ]
    halves = digest[size // 2 :] + digest[: size // 2]
    words = Dictionary((digest, halves, *changed)).hashes
    assert len({tuple(item) for item in words.tolist()}) == len(changed) + 1 + (
        halves not in (digest, *changed)
    )


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
    for row in (0, 17, 39):
        alone = hash_words([column[np.array([row])] for column in columns])
        assert row_hashes(tables.event, alone) == [together[row]]


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


def test_minus_zero_is_stored_and_hashed_as_zero() -> None:
    minus, plus = np.array([-0.0]), np.array([0.0])
    assert np.array_equal(hash_words([minus]), hash_words([plus]))
    columns = events(1)
    columns[2] = minus
    (row,) = stored(columns)
    assert math.copysign(1.0, row[2]) == 1.0


def test_null_is_no_zero_and_no_empty_text() -> None:
    assert not np.array_equal(hash_words([np.array([NAN])]), hash_words([np.array([0.0])]))
    assert not np.array_equal(hash_words([Texts.same(None, 1)]), hash_words([Texts.same("", 1)]))
    other = np.array([0xFFF8000000000001], dtype=np.uint64).view(np.float64)
    assert np.array_equal(hash_words([other]), hash_words([np.array([NAN])]))


@pytest.mark.parametrize("number", [math.inf, -math.inf])
def test_infinity_is_refused(number: float) -> None:
    with pytest.raises(ValueError, match="infinity cannot be stored"):
        hash_words([np.array([0.0, number])])


@pytest.mark.parametrize(
    ("place", "value"),
    [(1, 1.0), (1, "1"), (2, 1), (2, "1.5"), (3, b"switch"), (3, 5), (2, b"\x00"), (1, True)],
)
def test_value_of_a_type_that_was_never_written_is_named(place: int, value: Any) -> None:
    row = stored(events())[0]
    with pytest.raises(TypeError, match="is not what was written"):
        rehashed(tables.event, [(*row[:place], value, *row[place + 1 :])])


def test_number_that_is_not_finite_was_never_written() -> None:
    row = stored(events())[0]
    with pytest.raises(ValueError, match="not finite"):
        rehashed(tables.event, [(*row[:2], math.inf, *row[3:])])


def test_no_rows_have_no_hashes() -> None:
    assert rehashed(tables.event, []) == []
    empty = [column[np.zeros(0, dtype=np.int64)] for column in events()]
    assert table_rows(empty, hash_words(empty), tables.event) == []
