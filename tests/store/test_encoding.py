import math
from datetime import UTC, datetime, timedelta, timezone
from typing import Any

import pytest

from adeye.store import tables
from adeye.store.encoding import chunks, json_text, row, row_hash, rows_of_columns, utc_text

EVENT = (3, 0, 1.5, "contact", None, "hit")


def test_row_is_its_values_and_their_hash() -> None:
    made = row(tables.event, EVENT)
    assert made == (*EVENT, row_hash(tables.event, EVENT))


@pytest.mark.parametrize("place", range(len(EVENT)))
def test_every_value_changes_the_hash(place: int) -> None:
    other: list[Any] = list(EVENT)
    other[place] = 7 if isinstance(other[place], int | float) else "other"
    assert row(tables.event, other)[-1] != row(tables.event, EVENT)[-1]


def test_null_and_empty_text_hash_differently() -> None:
    empty = (3, 0, 1.5, "contact", "", "hit")
    assert row(tables.event, empty)[-1] != row(tables.event, EVENT)[-1]


def test_same_values_in_another_table_hash_differently() -> None:
    assert row_hash(tables.run, EVENT) != row_hash(tables.event, EVENT)


def test_minus_zero_is_zero_as_the_database_will_read_it() -> None:
    made = row(tables.event, (3, 0, -0.0, "k", None, "t"))
    assert math.copysign(1.0, made[2]) == 1.0


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_no_row_holds_a_number_that_is_not_finite(number: float) -> None:
    with pytest.raises(ValueError, match="cannot be stored"):
        row(tables.event, (3, 0, number, "k", None, "t"))


def test_whole_number_column_refuses_a_fraction() -> None:
    with pytest.raises(ValueError, match=r"0\.5"):
        row(tables.event, (3, 0.5, 1.0, "k", None, "t"))


def test_text_column_refuses_a_number() -> None:
    with pytest.raises(TypeError, match="not text"):
        row(tables.event, (3, 0, 1.0, 3, None, "t"))


def test_row_needs_a_value_for_every_column() -> None:
    with pytest.raises(ValueError, match="zip"):
        row(tables.event, EVENT[:-1])


def test_text_that_no_database_keeps_is_escaped() -> None:
    made = row(tables.event, (3, 0, 1.0, "k", None, "a\x00b\ud800c"))
    assert made[5] == "a\\x00b\\ud800c"


def test_json_refuses_nan() -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        json_text({"a": math.nan})


def test_times_of_day_are_utc() -> None:
    east = timezone(timedelta(hours=2))
    assert utc_text(datetime(2026, 1, 1, 2, tzinfo=east)) == "2026-01-01T00:00:00.000+00:00"
    assert datetime.fromisoformat(utc_text(None)).utcoffset() == datetime.now(UTC).utcoffset()


def test_chunks_lose_nothing() -> None:
    values = [str(number) for number in range(1201)]
    cut = list(chunks(values))
    assert [item for part in cut for item in part] == values
    assert max(len(part) for part in cut) <= 500


CASE: list[Any] = ["d", "s", "x", "y", "no%ne", "[]", "{}", 0, 7, 0.05, "o", 3]


def test_rows_of_columns_are_the_rows_of_their_values() -> None:
    columns = [*CASE]
    columns[0], columns[6], columns[7] = ["d", "e%s"], ["{}", '{"a":"ü"}'], [0, 1]
    columns[9], columns[11] = [0.05, 0.1], range(3, 5)
    other = ["e%s", *CASE[1:6], '{"a":"ü"}', 1, 7, 0.1, "o", 4]
    made = rows_of_columns(tables.test_case, columns)
    assert made == [row(tables.test_case, CASE), row(tables.test_case, other)]


def test_columns_of_different_lengths_make_no_rows() -> None:
    columns = [*CASE]
    columns[0], columns[1] = ["d", "e"], ["s"]
    with pytest.raises(ValueError, match="zip"):
        rows_of_columns(tables.test_case, columns)


def test_number_and_its_text_hash_differently() -> None:
    hashes = {row_hash(tables.event, (value,)) for value in (1, 1.0, "1", "i1", None, "n", "")}
    assert len(hashes) == 7


def test_value_of_a_type_that_is_never_written_has_no_hash() -> None:
    with pytest.raises(TypeError, match="is not what was written"):
        row_hash(tables.event, (b"blob",))
