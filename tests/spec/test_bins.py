"""Bins that an ODD declares: in units, ascending, and no part of an ODD that has none."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.odd import CoverageBins
from adeye.spec.quantity import SI


def test_edges_are_read_in_their_units_and_stored_in_si() -> None:
    bins = CoverageBins.model_validate({"ego_speed": ["0 km/h", "36 km/h"]})
    assert bins.ego_speed == (0.0, 10.0)
    stored = bins.model_dump(mode="json")
    assert stored == {"ego_speed": [0.0, 10.0]}
    assert CoverageBins.model_validate(stored, context=SI) == bins


def test_kinds_of_actor_need_no_order() -> None:
    bins = CoverageBins.model_validate(
        {"actors": ["truck", "car"], "sun_elevation": ["0 deg", "10 deg"]}
    )
    assert bins.actors == ("truck", "car")
    assert bins.model_dump(mode="json")["actors"] == ["truck", "car"]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"ego_speed": ["0 km/h", "60 km/h", "60 km/h"]}, "must ascend"),
        ({"rain": ["0 mm/h"]}, "at least 2 items"),
        ({"rain": ["0 m", "1 m"]}, "is not a speed|is not a rain rate"),
        ({"radius": ["500 m", "100 m"]}, "must ascend"),
        ({"sun_elevation": ["10 m", "20 m"]}, "is not an angle"),
        ({"actors": []}, "at least 1 item"),
        ({"actors": ["car", "truck", "car"]}, "'car' occurs twice"),
        ({"actors": ["tram"]}, "pedestrian"),
        ({"colour": [1, 2]}, "not permitted"),
    ],
)
def test_edges_that_make_no_bins_are_refused(content: dict[str, Any], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        CoverageBins.model_validate(content)
