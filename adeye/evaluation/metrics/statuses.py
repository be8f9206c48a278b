"""Status words of metrics, and a column of them held as codes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, overload

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

STATUSES: Final = ("value", "no_conflict", "not_applicable", "undefined", "incomplete", "error")
VALUE, NO_CONFLICT, NOT_APPLICABLE, UNDEFINED, INCOMPLETE, ERROR = STATUSES
CODES: Final = {word: code for code, word in enumerate(STATUSES)}
"""Code of each status; what is not among them has -1."""


class StatusColumn(Sequence[str]):
    """The statuses of B runs: words to read, codes to calculate with.

    Attributes:
        codes: (B,) index into ``STATUSES``.

    >>> column = StatusColumn(np.array([0, 5]))
    >>> column[1], column == ("value", "error")
    ('error', True)
    """

    __slots__ = ("codes",)

    def __init__(self, codes: NDArray[Any]) -> None:
        """Hold codes (B,)."""
        self.codes: NDArray[np.int8] = np.asarray(codes, dtype=np.int8)

    @overload
    def __getitem__(self, index: int) -> str: ...

    @overload
    def __getitem__(self, index: slice) -> StatusColumn: ...

    def __getitem__(self, index: int | slice) -> str | StatusColumn:
        """Give the word of a run, or those of several."""
        if isinstance(index, slice):
            return StatusColumn(self.codes[index])
        return STATUSES[self.codes[index]]

    def __len__(self) -> int:
        """Give the number of runs."""
        return len(self.codes)

    def __iter__(self) -> Iterator[str]:
        """Give the words, run by run."""
        return map(STATUSES.__getitem__, self.codes.tolist())

    def __eq__(self, other: object) -> bool:
        """Compare the words with those of another sequence."""
        return isinstance(other, Sequence) and tuple(self) == tuple(other)

    def __hash__(self) -> int:
        """Hash the words, as a tuple of them would."""
        return hash(tuple(self))

    def __repr__(self) -> str:
        """Show the words."""
        return repr(tuple(self))


def status_codes(words: Sequence[str]) -> NDArray[np.int8]:
    """Give the codes (B,) of statuses; -1 for a word that is none."""
    if isinstance(words, StatusColumn):
        return words.codes
    return np.array([CODES.get(word, -1) for word in words], dtype=np.int8)
