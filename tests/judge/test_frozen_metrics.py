"""Each metric and series on scenes made by hand, pinned in numbers."""

from collections.abc import Callable

import numpy as np
import pytest

from adeye.errors import AdeyeError
from adeye.judge.metrics import METRICS
from adeye.judge.outcome import outcomes
from adeye.judge.trace_signals import TraceSignals
from tests.frozen import assert_frozen
from tests.judge.conftest import HandMade


def following() -> HandMade:
    """Behind a slower lead, which is seen from row 2 on; beside, somebody overtakes."""
    made = HandMade(rows=41, objects=("lead", "beside"))
    made.object("lead", speed=12.0, s=30.0 + 12.0 * made.time, size=(8.0, 2.5))
    made.object("beside", speed=27.0, s=-20.0 + 27.0 * made.time, d=8.75)
    made.columns["detected"][0, 2:, 0, 0] = True
    made.columns["detections"][0, :, 0, 0] = [30.5, 0.25]
    made.columns["track_error"][0, 5:, 0, 0] = [0.5, -0.25]
    made.columns["false_tracks"][0, 8:12, 0] = 1
    return made


def braking() -> HandMade:
    """The ego brakes and steers, the lead stops."""
    made = HandMade(rows=41)
    slow = np.maximum(0.0, 20.0 - 6.0 * made.time)
    made.ego(speed=slow, s=np.cumsum(slow) * 0.1, acceleration=-6.0, heading=0.02 * made.time)
    made.columns["ego"][0, :, 6] = 0.1 * np.sin(3.0 * made.time)
    made.object("lead", speed=np.maximum(0.0, 18.0 - 8.0 * made.time), s=26.0 + 12.0 * made.time)
    return made


def contact() -> HandMade:
    """Someone cuts in and is touched, at an angle."""
    made = HandMade(rows=31, objects=("cutter", "far"))
    made.object("cutter", speed=8.0, heading=-0.3, s=22.0 + 8.0 * made.time)
    made.object("cutter", d=np.clip(8.75 - 2.0 * made.time, 5.0, 9.0))
    made.columns["foreign_contact"][0, 20] = True
    return made.touch(17, "cutter", speed=9.5)


def faulted() -> HandMade:
    """A camera fails, the safety channel takes over, brakes, and the ego stands."""
    made = HandMade(rows=61, faults=("camera_out", "radar_out"))
    made.columns["fault_active"][0, 10:30, 0] = True
    made.columns["sensor_alive"][0, 10:30, 0] = False
    made.columns["monitors"][0, 13:, 0, 1] = True
    made.columns["status"][0, 12:, 0] = 1
    made.columns["status"][0, 14:, 1] = 2
    made.columns["authority"][0, 15:] = 1
    made.columns["reason"][0, 15:] = 2
    made.columns["acceleration"][0, 15:, 1] = -4.0
    made.columns["command"][0, 15:, 0] = -4.0
    slow = np.clip(20.0 - 6.0 * (made.time - 1.5), 0.0, 20.0)
    made.ego(speed=slow, s=np.cumsum(slow) * 0.1)
    made.ego(acceleration=np.where((slow > 0.0) & (slow < 20.0), -6.0, 0.0))
    return made


def crossing() -> HandMade:
    """A walker crosses before the ego, another behind it; the ego swerves over a line."""
    made = HandMade(rows=31, objects=("walker", "late"), events=("steps",))
    made.object("walker", speed=2.0, heading=np.pi / 2, s=35.0, d=1.0 + 2.0 * made.time)
    made.object("walker", size=(0.6, 0.6))
    made.object("late", speed=1.5, heading=-np.pi / 2, s=10.0, d=12.0 - 1.5 * made.time)
    made.columns["begun"][0, 5:, 0] = 0.5
    return made.ego(d=5.25 + 0.8 * np.sin(made.time), heading=0.04 * np.cos(made.time))


def alone() -> HandMade:
    """Nobody else is there."""
    return HandMade(rows=11, objects=())


SCENES: tuple[Callable[[], HandMade], ...] = (
    following, braking, contact, faulted, crossing, alone,
)  # fmt: skip


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.__name__)
def test_metrics_of_a_scene_are_frozen(scene: Callable[[], HandMade]) -> None:
    trace = scene().trace()
    lines = []
    for name, metric in METRICS.items():
        try:
            found = metric.compute(trace)
        except AdeyeError as error:
            lines.append(f"{name}: {error}")
            continue
        lines.append(
            f"{name}: {found.value[0]:.9g} {found.status[0]} at {found.time[0]:.9g} "
            f"of {found.actor[0]}"
        )
    end = outcomes(trace)
    lines += [f"outcome {name}: {getattr(end, name)!r}" for name in sorted(end.__slots__)]
    assert_frozen(f"metrics_{scene.__name__}.txt", "\n".join([*lines, ""]))


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.__name__)
def test_signals_of_a_scene_are_frozen(scene: Callable[[], HandMade]) -> None:
    """At five rows each: what formulas are told."""
    trace = scene().trace()
    signals = TraceSignals(trace, np.ones(1, dtype=np.bool_))
    rows = np.linspace(0, int(trace.length[0]) - 1, 5).astype(int)
    lines = []
    for name in signals.dictionary:
        series = signals.series(name)
        values = " ".join(f"{float(value):.9g}" for value in series.values[0, rows])
        status = "" if series.status is None else f" {series.status[0, rows].tolist()}"
        actor = "" if series.actor is None else f" of {series.actor[0, rows].tolist()}"
        lines.append(f"{name} [{series.unit}]: {values}{status}{actor}")
    assert_frozen(f"signals_{scene.__name__}.txt", "\n".join([*lines, ""]))
