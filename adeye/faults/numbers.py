"""Faults of a number that a sensor measures: what becomes of it, sample by sample."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.faults.draws import Draws
from adeye.faults.lists import Seat, column
from adeye.faults.measured import Place, place_of
from adeye.faults.timing import sample_age

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from adeye.faults.ports import InjectorContext, Moment
    from adeye.signals import Floats, Ints, Measurement

Change = Any
"""What makes new values (B, K) of values (B, K), their draw indices and the moment."""


class NumberFault:
    """Changes one signal of the newest sample; what it does not change keeps every bit."""

    def __init__(self, context: InjectorContext) -> None:
        """Prepare for a batch."""
        first: Any = context.specs[0]
        self._signal: str = first.signal
        self._draws = Draws(context)
        self._change = _CHANGES[first.model](context, self._draws)
        self._road = context.scene.road
        self._objects = len(context.scene.object_ids)
        self._seat = Seat(context)

    def apply(self, measurement: Measurement, moment: Moment) -> Measurement:
        """Return the measurement with another value in the active runs."""
        self._draws.count(measurement)
        active = moment.active & (measurement.stamp >= 0.0)
        if not active.any():
            return measurement
        place: Place = place_of(measurement, self._signal, self._seat, self._objects)
        values = np.ascontiguousarray(place.values)
        age = sample_age(measurement, moment)[:, None]
        with np.errstate(all="ignore"):
            new = np.ascontiguousarray(self._change(values, place.indices, age))
            if place.least is not None:
                new = np.maximum(new, place.least)
        differs = new.view(np.int64) != values.view(np.int64)
        changed = place.there & active[:, None] & differs
        if not changed.any():
            return measurement
        return place.write(measurement, new, changed, self._road)


def _bias(context: InjectorContext, _draws: Draws) -> Change:
    size = column(context, "size")
    return lambda values, _indices, _age: _added(values, size)


def _scale(context: InjectorContext, _draws: Draws) -> Change:
    factor = column(context, "factor")
    return lambda values, _indices, _age: values * factor


def _drift(context: InjectorContext, _draws: Draws) -> Change:
    rate = column(context, "size") / column(context, "over")
    return lambda values, _indices, age: _added(values, rate * age)


def _noise(context: InjectorContext, draws: Draws) -> Change:
    size = column(context, "size")
    return lambda values, indices, _age: _added(values, size * draws.normals(indices))


def _quantise(context: InjectorContext, _draws: Draws) -> Change:
    size = column(context, "size")
    return lambda values, _indices, _age: np.where(
        size > 0.0, np.floor(values / size + 0.5) * size, values
    )


def _stuck_at(context: InjectorContext, _draws: Draws) -> Change:
    value = column(context, "value")
    return lambda values, _indices, _age: np.broadcast_to(value, values.shape)


def _spike(context: InjectorContext, draws: Draws) -> Change:
    size, probability = column(context, "size"), column(context, "probability")

    def change(values: Floats, indices: Ints, _age: Floats) -> Floats:
        return np.where(draws.uniforms(indices) < probability, _added(values, size), values)

    return change


def _bit_flip(context: InjectorContext, _draws: Draws) -> Change:
    specs: Any = context.specs
    bits = np.array([[1 << spec.bit] for spec in specs], dtype=np.uint64)
    return lambda values, _indices, _age: (values.view(np.uint64) ^ bits).view(np.float64)


def _added(values: Floats, size: Floats) -> Floats:
    # What is added nothing to keeps its sign, should it be a zero.
    return np.where(size == 0.0, values, values + size)


_CHANGES: Final[Mapping[str, Callable[[InjectorContext, Draws], Change]]] = {
    "bias": _bias,
    "scale": _scale,
    "drift": _drift,
    "noise": _noise,
    "quantise": _quantise,
    "stuck_at": _stuck_at,
    "spike": _spike,
    "bit_flip": _bit_flip,
}
