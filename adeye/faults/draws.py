"""Random numbers of faults: by the samples of what fails, one stream for each fault."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.kernel.jit import compiled
from adeye.kernel.random import normal, uniform

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from adeye.faults.ports import InjectorContext
    from adeye.signals import Floats, Ints, Measurement


class Draws:
    """Draws for each sample that a sensor delivers, also those before the fault.

    A sample that is shown again has the same draws. So neither the step nor the other runs of a
    batch, nor when the fault begins, alter what a sample gets.
    """

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        self._seeds = context.scene.stream_seeds
        self._owner = context.owner
        self._number: Ints = np.zeros(len(self._seeds), dtype=np.int64)

    def count(self, measurement: Measurement) -> None:
        """Count the samples that are new at a tick."""
        self._number += measurement.fresh

    def uniforms(self, indices: Ints) -> Floats:
        """Draw from (0, 1) for each index (B, K)."""
        drawn: Floats = np.empty(indices.shape)
        _draw_uniforms(self._seeds, self._owner, self._number, indices, drawn)
        return drawn

    def normals(self, indices: Ints) -> Floats:
        """Draw standard normal numbers for each index (B, K)."""
        drawn: Floats = np.empty(indices.shape)
        _draw_normals(self._seeds, self._owner, self._number, indices, drawn)
        return drawn

    def shares(self, index: int) -> Floats:
        """Draw from (0, 1) once for each run (B,)."""
        indices: Ints = np.full((len(self._seeds), 1), index, dtype=np.int64)
        return self.uniforms(indices)[:, 0]


@compiled
def _draw_uniforms(
    seeds: NDArray[np.uint64], owner: np.uint64, numbers: Ints, indices: Ints, drawn: Floats
) -> None:
    for run in range(indices.shape[0]):
        for item in range(indices.shape[1]):
            drawn[run, item] = uniform(seeds[run], owner, numbers[run], indices[run, item])


@compiled
def _draw_normals(
    seeds: NDArray[np.uint64], owner: np.uint64, numbers: Ints, indices: Ints, drawn: Floats
) -> None:
    for run in range(indices.shape[0]):
        for item in range(indices.shape[1]):
            drawn[run, item] = normal(seeds[run], owner, numbers[run], indices[run, item])
