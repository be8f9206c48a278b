"""The test cases of a plan as a sequence that makes them when they are asked for."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final, overload

from adeye.sweep.expand import CHUNK

if TYPE_CHECKING:
    from adeye.sweep.case import TestCase
    from adeye.sweep.expand import Expansion

KEPT_CHUNKS: Final = 4
"""Chunks of test cases that are kept: a block touches two, and the next begins where it ends."""


class LazyCases(Sequence["TestCase"]):
    """Test cases by ordinal; a chunk around what is asked for is made at once and kept a while.

    Asking twice may give two records, which are equal.
    """

    def __init__(self, expansion: Expansion) -> None:
        """Make nothing yet."""
        self._expansion = expansion
        self._kept: OrderedDict[int, list[TestCase]] = OrderedDict()

    def __len__(self) -> int:
        """Count the test cases, without making any."""
        return self._expansion.count

    @overload
    def __getitem__(self, index: int) -> TestCase: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[TestCase]: ...

    def __getitem__(self, index: int | slice) -> TestCase | Sequence[TestCase]:
        """Make one test case, or those of a slice.

        Raises:
            IndexError: There is no test case of this ordinal.
        """
        if isinstance(index, slice):
            return [self._at(ordinal) for ordinal in range(*index.indices(len(self)))]
        ordinal = index + len(self) if index < 0 else index
        if not 0 <= ordinal < len(self):
            msg = f"test case {index} of {len(self)}"
            raise IndexError(msg)
        return self._at(ordinal)

    def __iter__(self) -> Iterator[TestCase]:
        """Make one chunk after the other, and keep none."""
        return self._expansion.cases()

    def _at(self, ordinal: int) -> TestCase:
        number, place = divmod(ordinal, CHUNK)
        if number in self._kept:
            self._kept.move_to_end(number)
        else:
            first = number * CHUNK
            self._kept[number] = list(self._expansion.cases(first, first + CHUNK))
            if len(self._kept) > KEPT_CHUNKS:
                self._kept.popitem(last=False)
        return self._kept[number][place]
