"""Which cases of a plan are pairs: several architectures, one situation, the same faults.

Counted while the cases pass by, 16 bytes and two small numbers for each.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from typing import TYPE_CHECKING, Final

import numpy as np

from adeye.store.case_tables import case_count, case_match
from adeye.store.encoding import Row, row, rows_of_columns

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from adeye.signals import Ints

_CHUNK: Final = 8_192


class CaseGroups:
    """Counts of the cases of a campaign and what matches among them, fed in their order."""

    def __init__(self) -> None:
        """Begin with no case."""
        self._planned: Counter[tuple[str, str, str]] = Counter()
        self._keys: list[bytes] = []
        self._architectures: list[tuple[int, int]] = []
        self._faults: list[tuple[int, int]] = []
        self._codes: dict[str, int] = {}

    def add(
        self, scenario: str, architecture: str, fault_entry: str, situations: Sequence[str]
    ) -> None:
        """Add the next cases, which share names and faults, by the digests of their situations."""
        count = len(situations)
        self._planned[scenario, architecture, fault_entry] += count
        # The digest of a situation knows nothing of the name that the scenario has in the ODD.
        head = hashlib.blake2b(f"{scenario}\0{fault_entry}\0".encode(), digest_size=16)
        for situation in situations:
            key = head.copy()
            key.update(situation.encode())
            self._keys.append(key.digest())
        self._architectures.append((self._code(architecture), count))
        self._faults.append((self._code(fault_entry), count))

    def _code(self, word: str) -> int:
        return self._codes.setdefault(word, len(self._codes))

    def counts(self, campaign_id: str) -> list[Row]:
        """Make the rows of ``case_count``."""
        return [
            row(case_count, (campaign_id, *names, planned))
            for names, planned in sorted(self._planned.items())
        ]

    def matches(self, campaign_id: str) -> Iterator[list[Row]]:
        """Make the rows of ``case_match`` in the order of its key, many together."""
        first, ordinal = _matched(self._keys, _repeated(self._architectures))
        words = np.array(list(self._codes), dtype=object)
        faults = words[_repeated(self._faults)[ordinal]]
        for begin in range(0, len(ordinal), _CHUNK):
            part = slice(begin, begin + _CHUNK)
            columns = [list(item[part].tolist()) for item in (first, ordinal, faults)]
            yield rows_of_columns(case_match, (campaign_id, *columns))


def _repeated(runs: Iterable[tuple[int, int]]) -> Ints:
    """Write out run lengths: a code for each case."""
    pairs = np.array(list(runs), dtype=np.int64).reshape(-1, 2)
    return np.repeat(pairs[:, 0], pairs[:, 1])


def _matched(keys: Sequence[bytes], architectures: Ints) -> tuple[Ints, Ints]:
    """Find the cases whose key another architecture has, too.

    Args:
        keys: N digests of 16 bytes, by ordinal.
        architectures: (N,) codes.

    Returns:
        (M,) ordinal of the first case with the same key and (M,) ordinal, in the order of both.
    """
    if not keys:
        nothing = np.zeros(0, dtype=np.int64)
        return nothing, nothing
    words: NDArray[np.uint64] = np.frombuffer(b"".join(keys), dtype="<u8").reshape(-1, 2)
    order = np.lexsort((words[:, 1], words[:, 0]))
    ranked = words[order]
    begins = np.flatnonzero(np.append(True, (ranked[1:] != ranked[:-1]).any(axis=1)))
    sizes = np.diff(np.append(begins, len(order)))
    codes = architectures[order]
    is_shared = np.minimum.reduceat(codes, begins) != np.maximum.reduceat(codes, begins)
    # Sorting keeps the order of equal keys, so that the first of a group was planned first.
    first = np.repeat(order[begins], sizes)
    chosen = np.repeat(is_shared, sizes)
    first, ordinal = first[chosen], order[chosen]
    place = np.lexsort((ordinal, first))
    return first[place], ordinal[place]
