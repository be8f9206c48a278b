"""Samples go into the database and come out as they were."""

import json

import numpy as np

from adeye.campaign.work import _samples_texts, extremes_of
from adeye.judge.extremes import Extremes


def test_samples_come_back_bit_for_bit() -> None:
    kept = Extremes(
        run=np.array([0, 1]),
        row=np.array([[0, 2, 7, -1, -1], [3, -1, 3, 5, 6]]),
        value=np.array(
            [[0.1, 1 / 3, -0.0, np.nan, np.nan], [np.nan, np.nan, np.nan, np.nan, 1e300]]
        ),
        status=np.array([[0, 0, 0, 0, 0], [1, 0, 1, 2, 3]]),
        actor=np.array([[-1, 0, 1, -1, -1], [1, -1, 1, -1, -1]]),
        is_cut=np.array([True, False]),
    )
    texts = _samples_texts(kept, ("cutter", "lead"))
    objects: dict[str, int] = {}
    found = extremes_of([json.loads(text) for text in texts], objects)
    assert objects == {"cutter": 0, "lead": 1}
    for name in ("row", "value", "status", "actor", "is_cut"):
        np.testing.assert_array_equal(getattr(found, name), getattr(kept, name))
