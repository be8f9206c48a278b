"""A wish to end a campaign: what ends it early, and how it ends then.

Three things do: somebody asks for it (Ctrl-C, SIGTERM), the time that it was given is over, or as
many runs failed as were to be seen. In each case no block is begun any more, the blocks that are
being executed are completed as far as they can be, and all that is left stays to be done.
"""

from __future__ import annotations

import math
import time
from collections import deque
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

_REMEMBERED: Final = 8
"""Blocks whose pace tells that of the next one."""


@dataclass
class Stop:
    """Whether somebody asked a campaign to end.

    Attributes:
        asked: What was asked, as the exception that it is outside of blocks; None for nothing.
        is_deferred: Whether who asks leaves it to the campaign when to end.
    """

    asked: type[BaseException] | None = None
    is_deferred: bool = False

    def ask(self, kind: type[BaseException]) -> None:
        """Ask for the end.

        Raises:
            BaseException: At once, where nothing is being executed that could be completed.
        """
        self.asked = kind
        if not self.is_deferred:
            raise kind

    @contextmanager
    def deferred(self) -> Iterator[None]:
        """Execute blocks: whoever asks for the end inside does not interrupt.

        Raises:
            BaseException: At the end, what was asked meanwhile.
        """
        self.is_deferred = True
        try:
            yield
        finally:
            self.is_deferred = False
        self.check()

    def check(self) -> None:
        """Raise what was asked.

        Raises:
            BaseException: If something was.
        """
        if self.asked is not None:
            raise self.asked


@dataclass
class Limits:
    """How long a campaign may take now, and how many failures are enough.

    Attributes:
        budget_s: Time from the moment that this is made [s].
        most_failures: Runs with a FAIL or ERROR after which no block is begun; None for no limit.
        reached: What ended it, in words; empty as long as nothing did.
    """

    budget_s: float = math.inf
    most_failures: int | None = None
    reached: str = ""
    _began: float = field(init=False)
    _paces: deque[float] = field(default_factory=lambda: deque(maxlen=_REMEMBERED))

    def __post_init__(self) -> None:
        self._began = time.monotonic()

    @property
    def left_s(self) -> float:
        """Time that is left [s]."""
        return self.budget_s - (time.monotonic() - self._began)

    def count(self, failures: int) -> None:
        """Take note of the runs with a FAIL or ERROR so far."""
        if self.most_failures is not None and failures >= self.most_failures:
            runs = f"{failures:,} run{'' if failures == 1 else 's'}"
            self.reached = self.reached or f"{runs} with a FAIL or an ERROR, as --maxfail asks"

    def measure(self, cases: int, seconds: float) -> None:
        """Take note of how long a block took from when it was given to when it was saved.

        Args:
            cases: Its test cases.
            seconds: Elapsed time [s], also what it waited for others.
        """
        if cases:
            self._paces.append(seconds / cases)

    def allow(self, cases: int) -> bool:
        """Tell whether a block may be begun: there is time for it, by the slowest of the last ones.

        As long as none is done, any may begin that has time at all.
        """
        if self.reached:
            return False
        needed = cases * max(self._paces, default=0.0)
        if self.left_s > needed:
            return True
        self.reached = "the time that --budget gives is over"
        if self.left_s > 0.0:
            self.reached = "no block would end in the time that --budget gives"
        return False
