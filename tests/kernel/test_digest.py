"""The rolling digest: every bit counts, and so does its place."""

import numpy as np
import pytest

from adeye.kernel.digest import LANES, absorb_bytes, absorb_words, finish

# Words wrap around, which plain NumPy numbers say when kernels are not compiled.
pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning")

KEY = np.uint64(0x1234_5678_9ABC_DEF0)


def of_words(*rows: list[int], key: np.uint64 = KEY) -> list[str]:
    """Digest of each row of words, all of one length."""
    words = np.array(rows, dtype=np.uint64)
    lanes = np.zeros((len(rows), LANES), dtype=np.uint64)
    absorb_words(words, np.full(len(rows), words.shape[1]), key, lanes)
    return texts(lanes)


def of_bytes(*rows: bytes) -> list[str]:
    """Digest of each row of bytes, all of one length."""
    values = np.array([list(row) for row in rows], dtype=np.uint8)
    lanes = np.zeros((len(rows), LANES), dtype=np.uint64)
    absorb_bytes(values, np.full(len(rows), values.shape[1]), KEY, lanes)
    return texts(lanes)


def texts(lanes: np.ndarray[tuple[int, ...], np.dtype[np.uint64]]) -> list[str]:
    out = np.zeros((len(lanes), 2), dtype="<u8")
    finish(lanes, out)
    return [row.tobytes().hex() for row in out]


def test_digest_never_changes() -> None:
    # Stored with every result: another value is another schema of the trace.
    assert of_words(list(range(20))) == ["372c616e6bc0df0fd5c7487f2cd88ab1"]
    assert of_bytes(bytes(range(20))) == ["c7c193caed53acb30afb9b614e340a83"]


def test_every_bit_of_every_word_counts() -> None:
    for place in range(19):
        plain = list(range(19))
        changed = []
        for bit in range(64):
            row = list(plain)
            row[place] ^= 1 << bit
            changed.append(row)
        assert len({*of_words(plain, *changed)}) == 65


def test_two_signs_that_change_do_not_cancel() -> None:
    plain = [0] * 32
    found = set()
    for first in range(32):
        for second in range(first + 1, 32):
            row = list(plain)
            row[first] = row[second] = 1 << 63
            found.add(of_words(row)[0])
    assert len(found) == 32 * 31 // 2


@pytest.mark.parametrize("apart", [1, 8, 16])
def test_words_that_change_places_are_told_apart(apart: int) -> None:
    row = list(range(1, 33))
    other = list(row)
    other[0], other[apart] = other[apart], other[0]
    assert of_words(row) != of_words(other)


def test_what_comes_after_the_count_is_not_read() -> None:
    words = np.arange(40, dtype=np.uint64).reshape(2, 20)
    lanes = np.zeros((2, LANES), dtype=np.uint64)
    absorb_words(words, np.array([3, 20]), KEY, lanes)
    words[0, 3:] = 0
    again = np.zeros((2, LANES), dtype=np.uint64)
    absorb_words(words, np.array([3, 20]), KEY, again)
    assert texts(lanes) == texts(again)


def test_key_and_zeros_at_the_end_count() -> None:
    assert of_words([1, 2]) != of_words([1, 2], key=np.uint64(1))
    assert len({*of_words([0] * 7), *of_words([0] * 8), *of_words([0] * 9)}) == 3


def test_every_bit_of_every_byte_counts() -> None:
    for place in range(11):
        plain = bytes(range(11))
        changed = [
            bytes(value ^ (1 << bit) if at == place else value for at, value in enumerate(plain))
            for bit in range(8)
        ]
        assert len({*of_bytes(plain, *changed)}) == 9


def test_rows_do_not_touch_each_other() -> None:
    rows = [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    assert of_words(*rows) == [of_words(row)[0] for row in rows]
    assert of_words(*reversed(rows)) == list(reversed(of_words(*rows)))
