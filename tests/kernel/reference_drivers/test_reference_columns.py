"""Columns of the reference drivers: each place is taken once."""

import pytest

from adeye.kernel.reference_drivers import parameters as columns


@pytest.mark.parametrize(
    ("names", "size"),
    [
        ("EGO_SPEED EGO_ACCELERATION OTHER_SPEED OTHER_ACCELERATION GAP LENGTHS LATERAL_GAP"
         " LATERAL_SPEED CUE INTRUSION OVERLAP", columns.VIEW_SIZE),
        ("PERCEIVED DELAYED DECELERATION REACTING EMERGENCY CAME_FROM_SIDE", columns.STATE_SIZE),
        (" ".join(name for name in dir(columns) if name.startswith("S_")), columns.SCENE_SIZE),
        (" ".join(name for name in dir(columns) if name.startswith("R_")), columns.RESULT_SIZE),
    ],
)  # fmt: skip
def test_places_fill_the_array(names: str, size: int) -> None:
    assert sorted(getattr(columns, name) for name in names.split()) == list(range(size))
