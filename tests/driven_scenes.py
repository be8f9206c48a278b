"""Scenes driven by the product's reference drivers, for tests."""

import math
from typing import Any

import numpy as np

from adeye.kernel.reference_drivers import reactions as columns
from adeye.kernel.reference_drivers.drivers import SCRATCH_SIZE, drive_scenes
from adeye.kernel.reference_drivers.reactions import MODELS, named, parameters_of, vector


def scenes_of(rows: Any) -> Any:
    """Return cut-ins of (ego speed, other speed, gap, lateral speed)."""
    rows = np.asarray(rows, dtype=float)
    scenes = np.zeros((len(rows), columns.SCENE_SIZE))
    scenes[:, :4] = rows
    scenes[:, columns.S_LATERAL_OFFSET] = 3.5
    scenes[:, [columns.S_EGO_LENGTH, columns.S_OTHER_LENGTH]] = 4.3
    scenes[:, [columns.S_EGO_WIDTH, columns.S_OTHER_WIDTH]] = 1.9
    scenes[:, columns.S_LANE_WIDTH] = 3.5
    scenes[:, columns.S_LATERAL_ACCELERATION] = math.inf
    return scenes


def driven(  # noqa: PLR0913 - one scene
    scenes: Any,
    model: str,
    *,
    kind: int = columns.CUT_IN,
    variant: tuple[str, ...] = (),
    edition: str = "r157-01",
    step: float = 0.01,
    integrator: int = columns.EXACT,
    ttc_end: float = math.inf,
) -> Any:
    """Return the results of the scenes, shape (N, RESULT_SIZE)."""
    results = np.empty((len(scenes), columns.RESULT_SIZE))
    drive_scenes(
        scenes,
        kind,
        MODELS[model],
        vector(parameters_of(model, edition, variant)),
        step,
        integrator,
        ttc_end,
        np.zeros(SCRATCH_SIZE),
        results,
        "jrc-first-step" in named(variant),
    )
    return results
