"""Which test cases of two or more architectures are the same: situation, faults and swept axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.evaluation.pairing import number_rows, pair_up

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.signals import Ints
    from adeye.store.compared import Compared


class Matching:
    """Finds the same test cases among the planned cases of a campaign."""

    def __init__(self, compared: Compared) -> None:
        """Use cases with their verdicts."""
        self.compared = compared
        self._rows = {
            name: np.flatnonzero(compared.architecture.codes == code)
            for code, name in enumerate(compared.architecture.words)
        }

    def rows(self, name: str) -> Ints:
        """Give the cases of an architecture."""
        return self._rows.get(name, np.zeros(0, dtype=np.int64))

    def pairs(self, a: str, b: str) -> tuple[Ints, Ints]:
        """Give the cases (P,) of both on the same test cases.

        An axis of the architecture that only one of them has leaves several cases of that one for
        each of the other; all of them are pairs.
        """
        keys = self._keys((a, b))
        rows_a, rows_b = self.rows(a), self.rows(b)
        at_a, at_b = pair_up(keys[rows_a], keys[rows_b])
        return rows_a[at_a], rows_b[at_b]

    def common(self, names: Sequence[str], *, executed: bool = False) -> dict[str, Ints]:
        """Give the cases of each architecture on the test cases that all of them share.

        Args:
            names: Architectures.
            executed: Leave out a test case unless every case of all of them has its results.
        """
        keys = self._keys(names)
        shared = np.unique(keys)
        for name in names:
            own = self.rows(name)
            shared = np.intersect1d(shared, keys[own])
            if executed:
                shared = np.setdiff1d(shared, keys[own[~self.compared.is_done[own]]])
        return {name: self.rows(name)[np.isin(keys[self.rows(name)], shared)] for name in names}

    def _keys(self, names: Sequence[str]) -> Ints:
        """Number the test cases (N,) as far as these architectures have their axes in common."""
        compared = self.compared
        columns = [compared.situation, compared.fault_entry.codes]
        for axis in compared.axes.values():
            codes = axis.codes.copy()
            for scenario in range(len(compared.scenario.words)):
                here = compared.scenario.codes == scenario
                if not all(self._has_axis(axis.codes, here, name) for name in names):
                    codes[here] = -1
            columns.append(codes)
        return number_rows(*columns)

    def _has_axis(self, codes: Ints, here: Ints, name: str) -> bool:
        own = self.rows(name)
        return bool((codes[own[here[own]]] >= 0).any())
