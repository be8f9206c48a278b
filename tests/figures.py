"""Figures made from rows like those of ``v_runs``."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from adeye.store.read.bulk import Figures, Labels, encode_points
from adeye.store.tables import METRIC_IDS


def figures_of(rows: Sequence[Mapping[str, Any]]) -> Figures:
    """Turn rows into columns; what a row does not say is the same in all of them."""
    count = len(rows)
    return Figures(
        ordinal=np.arange(count),
        scenario=Labels.of(row.get("scenario", "") for row in rows),
        architecture=Labels.of(row.get("architecture", "") for row in rows),
        fault_entry=Labels.of(row.get("fault_entry", "none") for row in rows),
        replicate=np.array([row.get("replicate", 0) for row in rows], dtype=np.int64),
        outcome=Labels.of(row.get("outcome", "completed") for row in rows),
        points=encode_points(row.get("point", {}) for row in rows),
        metrics={
            name: np.array([row.get(name) for row in rows], dtype=np.float64) for name in METRIC_IDS
        },
        duration_s=np.array([row.get("duration_s", 20.0) for row in rows], dtype=np.float64),
        machine_dependent=np.array(
            [row.get("machine_dependent", 0) == 1 for row in rows], dtype=np.bool_
        ),
        has_fault=np.array(
            [row.get("has_fault", row.get("fault_entry", "none") != "none") for row in rows],
            dtype=np.bool_,
        ),
    )
