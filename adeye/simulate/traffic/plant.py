"""Vehicles that an FMU moves: a command goes in, the state of the ego comes out."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NoReturn

from adeye.errors import PluginError
from adeye.kernel.boxes import wrap_to_pi
from adeye.signals import (
    EGO_ACCELERATION,
    EGO_COLUMNS,
    EGO_HEADING,
    EGO_SPEED,
    EGO_STEERING,
    EGO_X,
    EGO_Y,
    EGO_YAW_RATE,
)
from adeye.simulate.bridges.fmus import Fmus, Step, Wired, wire_each, wire_fmu
from adeye.simulate.bridges.programs import INVALID_OUTPUT, Broken
from adeye.units import Dimension, shown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from adeye.signals import Bools, Floats
    from adeye.spec.programs import Plant

INPUTS: Final = {
    "acceleration": Dimension.ACCELERATION,
    "steering_angle": Dimension.ANGLE,
    "friction": Dimension.NONE,
}
STATE: Final = {
    "x": Dimension.LENGTH,
    "y": Dimension.LENGTH,
    "heading": Dimension.ANGLE,
    "speed": Dimension.SPEED,
    "acceleration": Dimension.ACCELERATION,
    "steering_angle": Dimension.ANGLE,
    "yaw_rate": Dimension.ANGULAR_RATE,
}
"""What the state of the ego measures, in the order of ``signals.EGO_COLUMNS``."""


def wire_plant(plant: Plant, base_dir: Path) -> Wired:
    """Read the description of a vehicle's FMU and connect its variables.

    Raises:
        InputError: fmpy is not installed.
        SpecError: There is no such FMU, or its variables do not fit.
    """
    state = [(key, getattr(plant.outputs, key), what) for key, what in STATE.items()]
    poses = [
        (key, getattr(plant.initial, key), STATE[key]) for key in type(plant.initial).model_fields
    ]
    return wire_fmu(
        plant,
        base_dir,
        [(signal, name, INPUTS[signal]) for name, signal in sorted(plant.inputs.items())],
        [item for item in state if item[1] is not None],
        poses,
    )


MOST_FASTER: Final = 50.0
"""Largest change of speed that is no leap [m/s²]: five times what tyres hold. Our choice."""

SLIP: Final = 0.3
"""Share of the way by which it may differ from that of the speed: a vehicle that slides says how
fast it rolls. Our choice."""

MOST_AWAY: Final = 0.1
"""By how much more [m]: lags of what is told. Our choice."""

MOST_STEERED: Final = 0.5 * math.pi
"""Largest steering angle [rad]: wheels across the vehicle."""

MOST_TURNED: Final = 6.0
"""Largest yaw rate that is no leap [rad/s]: a turn in a second. Our choice."""


MOST_APART: Final = (0.1, 0.01)
"""By how much speed [m/s] and heading [rad] may differ, over ``MEMORY_S``, from what acceleration
and yaw rate lead to: a hundredth of what tyres do in it. Our choice."""

MOST_ASTRAY: Final = 0.1
"""How far a vehicle may come, over ``MEMORY_S``, from where its speed leads [m]: one that creeps
while it says that it stands is no faster than what counts as standing. Our choice."""

MISTOLD: Final = 0.03
"""Share of the way by which it may come farther, or less far, than its speed leads. Our choice."""

ASIDE: Final = 0.6
"""Share of the way that it may go aside of its heading: 30 degrees of slip, or wheels that are
turned all the way, for the place is that half-way between the axles. Our choice."""

MEMORY_S: Final = 1.0
"""Time after which a difference counts for a third only [s]. Our choice."""


class Plants:
    """The FMUs that move the egos of a batch, in the runs whose vehicle has one."""

    def __init__(self, plants: Mapping[int, Plant], base_dir: Path, step: float) -> None:
        """Prepare; the FMUs are read and started by the first move: worlds are made without, too.

        Args:
            plants: By run.
            base_dir: Folder of the file that names them.
            step: Of a tick [s].
        """
        self._step = step
        self._base_dir = base_dir
        self._runs = list(plants)
        self._plants = [plants[run] for run in self._runs]
        self._wired: list[Wired] = []
        self._apart = [(0.0, 0.0)] * len(self._runs)
        self._astray = [(0.0, 0.0, 0.0)] * len(self._runs)
        self._fmus: Fmus | None = None

    def move(
        self, running: Bools, command: Floats, friction: Floats, before: Floats, states: Floats
    ) -> None:
        """Advance the egos that an FMU moves by one tick.

        Args:
            running: (B,).
            command: (B, 2) acceleration [m/s²] and steering angle [rad].
            friction: (B,) of the tyres.
            before: (B, 7) states at the tick before.
            states: (B, 7) out; rows of other runs are left alone.

        Raises:
            SpecError: There is no such FMU, or its variables do not fit.
            PluginError: An FMU failed: there is no vehicle then.
        """
        fmus = self._fmus or self._start(before)
        asked: dict[int, Step] = {}
        for at, run in enumerate(self._runs):
            if not running[run]:
                fmus.end(at)
                continue
            given = {
                "acceleration": float(command[run, 0]),
                "steering_angle": float(command[run, 1]),
                "friction": float(friction[run]),
            }
            values = [given[wire.signal] for wire in self._wired[at].inputs]
            asked[at] = Step(values, fmus.ticks[at] * self._step, self._step, is_before=True)
        for at, found in fmus.step(asked).items():
            if isinstance(found, Broken):
                self._fail(at, found, asked[at].begin)
            self._write(at, found, command, before, states)
            run = self._runs[at]
            self._require_continuous(at, asked[at].begin, before[run], states[run])
            self._require_true_speed(at, asked[at].begin, before[run], states[run])
            self._require_true_rates(at, asked[at].begin, before[run], states[run])

    def close(self) -> None:
        """End every FMU and wait until they have."""
        if self._fmus is not None:
            self._fmus.close()
            self._fmus = None

    def _start(self, states: Floats) -> Fmus:
        """Read the FMUs and start them where the runs begin."""
        self._wired = wire_each(self._plants, lambda plant: wire_plant(plant, self._base_dir))
        starts = []
        for run, wired in zip(self._runs, self._wired, strict=True):
            now = dict(zip(EGO_COLUMNS, states[run].tolist(), strict=True))
            starts.append(
                {wire.variable: wire.to_variable(now[wire.signal]) for wire in wired.initial}
            )
        self._fmus = Fmus(self._plants, self._wired, starts)
        for at, broken in self._fmus.greet().items():
            self._fail(at, broken, 0.0)
        return self._fmus

    def _write(
        self, at: int, found: Sequence[float], command: Floats, before: Floats, states: Floats
    ) -> None:
        """Write the state of an ego; what its FMU does not tell follows from what it does."""
        run = self._runs[at]
        told = {w.signal: v for w, v in zip(self._wired[at].outputs, found, strict=True)}
        heading = wrap_to_pi(told["heading"])
        turned = wrap_to_pi(heading - before[run, EGO_HEADING])
        told["heading"] = heading
        told.setdefault("steering_angle", float(command[run, 1]))
        told.setdefault("acceleration", (told["speed"] - before[run, EGO_SPEED]) / self._step)
        told.setdefault("yaw_rate", turned / self._step)
        states[run] = [told[name] for name in EGO_COLUMNS]

    def _require_continuous(self, at: int, time: float, before: Floats, now: Floats) -> None:
        """Refuse a vehicle that is not where it can be a tick after it was elsewhere.

        Its first step begins where the run does: an FMU that begins elsewhere is found here, too.
        """
        step, mean = self._step, 0.5 * abs(before[EGO_SPEED] + now[EGO_SPEED])
        way = math.hypot(now[EGO_X] - before[EGO_X], now[EGO_Y] - before[EGO_Y])
        turned = wrap_to_pi(now[EGO_HEADING] - before[EGO_HEADING])
        spare = MOST_AWAY + SLIP * mean * step
        found = (
            ("changes its speed by", now[EGO_SPEED] - before[EGO_SPEED], MOST_FASTER * step, "m/s"),
            ("is away from where its speed brings it by", way - mean * step, spare, "m"),
            ("turns by", turned, MOST_TURNED * step, "rad"),
        )
        for what, change, most, unit in found:
            if abs(change) > most:
                said = (
                    f"it {what} {abs(change):.3g} {unit} in a tick, at most {most:.3g} is no leap"
                )
                self._fail(at, Broken(INVALID_OUTPUT, said), time)
        if abs(now[EGO_STEERING]) > MOST_STEERED:
            said = f"it steers by {now[EGO_STEERING]:.3g} rad, at most {MOST_STEERED:.3g}"
            self._fail(at, Broken(INVALID_OUTPUT, said), time)

    def _require_true_speed(self, at: int, time: float, before: Floats, now: Floats) -> None:
        """Refuse a vehicle that its speed does not lead to where it is.

        What is no leap in a tick may be one in many: what remains is summed up. The speed may be
        that of the place, or its part along the vehicle, which differ where it slips.
        """
        step = self._step
        x, y = now[EGO_X] - before[EGO_X], now[EGO_Y] - before[EGO_Y]
        turned = wrap_to_pi(now[EGO_HEADING] - before[EGO_HEADING])
        heading = before[EGO_HEADING] + 0.5 * turned
        along = x * math.cos(heading) + y * math.sin(heading)
        aside = y * math.cos(heading) - x * math.sin(heading)
        driven = 0.5 * (before[EGO_SPEED] + now[EGO_SPEED]) * step
        farther = min(along - driven, math.copysign(math.hypot(x, y), along) - driven, key=abs)
        kept = math.exp(-step / MEMORY_S)
        last = self._astray[at]
        way = kept * last[2] + abs(driven)
        self._astray[at] = (kept * last[0] + farther, kept * last[1] + aside, way)
        found = (("along", MISTOLD), ("aside of", ASIDE))
        for (where, share), total in zip(found, self._astray[at][:2], strict=True):
            most = MOST_ASTRAY + share * way
            if not abs(total) <= most:
                said = (
                    f"it is away from where its speed, {now[EGO_SPEED]:.3g} m/s, brings it {where} "
                    f"its heading: by {abs(total):.3g} m within about {MEMORY_S:g} s, at most "
                    f"{most:.3g} is slip"
                )
                self._fail(at, Broken(INVALID_OUTPUT, said), time)

    def _require_true_rates(self, at: int, time: float, before: Floats, now: Floats) -> None:
        """Refuse a vehicle whose acceleration or yaw rate does not lead where it is.

        A rate may change evenly over a tick or at its beginning; what fits better counts.
        """
        step = self._step
        turned = wrap_to_pi(now[EGO_HEADING] - before[EGO_HEADING])
        found = (
            ("acceleration", "speed", "m/s", now[EGO_SPEED] - before[EGO_SPEED], EGO_ACCELERATION),
            ("yaw rate", "heading", "rad", turned, EGO_YAW_RATE),
        )
        is_standing = now[EGO_SPEED] == before[EGO_SPEED] == 0.0
        sums = []
        for (rate, state, unit, change, column), last, most in zip(
            found, self._apart[at], MOST_APART, strict=True
        ):
            held, even = now[column], 0.5 * (before[column] + now[column])
            apart = min((change - item * step for item in (held, even)), key=abs)
            total = math.exp(-step / MEMORY_S) * last + (0.0 if is_standing else apart)
            sums.append(total)
            if abs(total) > most or abs(held) > MOST_FASTER:
                said = (
                    f"its {rate}, {held:.3g} {unit}/s, is not that of its {state}: they are apart "
                    f"by {total:.3g} {unit}, at most {most:g}"
                )
                self._fail(at, Broken(INVALID_OUTPUT, said.replace("m/s/s", "m/s²")), time)
        self._apart[at] = (sums[0], sums[1])

    def _fail(self, at: int, broken: Broken, time: float) -> NoReturn:
        name = shown(self._plants[at].file)
        raise PluginError(
            f"vehicle.plant {name} failed at {time:g} s: {broken.cause}: {broken.detail}. Without "
            "a vehicle no run can be judged: mend the FMU, or leave the plant away"
        )
