"""Parking bays and rest areas beside a road, and where they may be."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from adeye.errors import SpecError
from adeye.signals import (
    REFUGE_COLUMNS,
    REFUGE_DEPTH,
    REFUGE_KIND,
    REFUGE_KINDS,
    REFUGE_LENGTH,
    REFUGE_S,
    REFUGE_TAPER,
)
from adeye.world.formulas import BELOW_ZERO, Formulas, Pick

if TYPE_CHECKING:
    from adeye.signals import Floats, Ints

_ROUNDING = 1e-9
"""By how much one bay may reach into the next or beyond the road [m]: rounding errors."""


def build_refuges(formulas: Formulas, length: Floats) -> Floats:
    """Build the parking bays and rest areas of each run, in the order of their places.

    Args:
        formulas: Scenarios of the batch with their parameters.
        length: Of the road of each run (B,) [m].

    Returns:
        (B, R, 5), see ``signals.REFUGE_COLUMNS``.

    Raises:
        SpecError: A length or depth is not positive, a taper is negative, a bay reaches beyond the
            road, or two of them overlap.
    """
    bays = formulas.scenario.world.road.bays
    refuges = np.zeros((formulas.runs, len(bays), len(REFUGE_COLUMNS)))
    for row, (name, bay) in enumerate(bays.items()):
        where = f"world.road.bays.{name}"
        refuges[:, row, REFUGE_KIND] = REFUGE_KINDS.index(bay.kind)
        refuges[:, row, REFUGE_S] = formulas.values(f"{where}.s", _pick(name, "s"))
        for column, field, above in (
            (REFUGE_LENGTH, "length", 0.0),
            (REFUGE_DEPTH, "depth", 0.0),
            (REFUGE_TAPER, "taper", BELOW_ZERO),
        ):
            refuges[:, row, column] = formulas.limited(
                f"{where}.{field}", _pick(name, field), above=above
            )
        _check_ends(where, refuges[:, row], length)
    order = np.argsort(refuges[:, :, REFUGE_S], axis=1, kind="stable")
    _check_overlaps(tuple(bays), refuges, order)
    ordered: Floats = np.take_along_axis(refuges, order[:, :, np.newaxis], axis=1)
    return ordered


def _pick(name: str, field: str) -> Pick:
    return lambda scenario: getattr(scenario.world.road.bays[name], field)


def _ends(refuges: Floats) -> tuple[Floats, Floats]:
    """Return where refuges (..., 5) begin and end with their tapers [m]."""
    first = refuges[..., REFUGE_S] - refuges[..., REFUGE_TAPER]
    last = refuges[..., REFUGE_S] + refuges[..., REFUGE_LENGTH] + refuges[..., REFUGE_TAPER]
    return first, last


def _check_ends(where: str, refuges: Floats, length: Floats) -> None:
    """Refuse a bay (B, 5) that is not wholly beside the road."""
    first, last = _ends(refuges)
    bad = (first < -_ROUNDING) | (last > length + _ROUNDING)
    if bad.any():
        raise SpecError(
            f"{where}.s: with its tapers it reaches from {first[bad][0]:g} m to "
            f"{last[bad][0]:g} m, but the road from 0 m to {length[bad][0]:g} m",
            remedy="Move it, or make the road longer.",
        )


def _check_overlaps(names: tuple[str, ...], refuges: Floats, order: Ints) -> None:
    """Refuse bays (B, R, 5) that overlap, their tapers included."""
    first, last = (np.take_along_axis(ends, order, axis=1) for ends in _ends(refuges))
    bad = np.argwhere(first[:, 1:] < last[:, :-1] - _ROUNDING)
    if bad.size:
        run, row = bad[0]
        one, next_one = (names[order[run, row + k]] for k in range(2))
        raise SpecError(
            f"world.road.bays.{next_one}.s: with its taper it begins at "
            f"{first[run, row + 1]:g} m, where {one} has not ended: it reaches to "
            f"{last[run, row]:g} m",
            remedy="Move one of them, or make their tapers shorter.",
        )
