"""What judging runs of a block again depends on, column by column."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from adeye.signals import Bools, Floats, Ints
    from adeye.store.columns import Texts


@dataclass(frozen=True)
class ExtremeBlock:
    """E sets of samples of the runs of a block.

    Attributes:
        run: (E,) row of the block.
        measure: What decides.
        value: (E,) the extreme, NaN for none.
        time_s: (E,) its time, NaN for none [s].
        actor: Its object.
        samples: The samples as JSON, see ``samples_text``.
    """

    run: Ints
    measure: Texts
    value: Floats
    time_s: Floats
    actor: Texts
    samples: Texts

    def take(self, runs: Ints) -> ExtremeBlock:
        """Choose runs of the block and number them from 0."""
        rows = np.flatnonzero(np.isin(self.run, runs))
        return ExtremeBlock(
            np.searchsorted(runs, self.run[rows]),
            self.measure[rows],
            self.value[rows],
            self.time_s[rows],
            self.actor[rows],
            self.samples[rows],
        )


@dataclass(frozen=True)
class BasisBlock:
    """What judging B runs again depends on.

    Attributes:
        version: Of judging.
        uids: Definition of each metric by its id.
        by_contact: (B,) whether a contact ended the run.
        invalid: Why no FSR can be judged; none where they can.
        extremes: Samples of these runs.
        files: Where the trace of each run is kept: name of a file and place in it, None for
            nowhere.
    """

    version: int
    uids: Mapping[str, str]
    by_contact: Bools
    invalid: Texts
    extremes: ExtremeBlock
    files: tuple[tuple[str, int] | None, ...] = ()

    def take(self, runs: Ints) -> BasisBlock:
        """Choose runs, each at most once, in ascending order."""
        return replace(
            self,
            by_contact=self.by_contact[runs],
            invalid=self.invalid[runs],
            extremes=self.extremes.take(runs),
            files=tuple(self.files[run] for run in runs) if self.files else (),
        )
