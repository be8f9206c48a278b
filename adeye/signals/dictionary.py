"""The signal dictionary: what an FSR may name, each with unit, scale and kind."""

from __future__ import annotations

from dataclasses import dataclass

from adeye.kernel.clock import TIME_SLACK
from adeye.signals.authority import REASON_LABELS
from adeye.signals.flow import STATUS_LABELS


@dataclass(frozen=True, slots=True)
class SignalType:
    """What an FSR may assume about a signal.

    Attributes:
        unit: SI unit, ``1`` for none.
        scale: Size of one unit of robustness in the signal's own unit.
        kind: ``number``, ``boolean`` or ``enumeration``.
        labels: Words of an enumeration, by code.
        text: What it means.
        cap: Margin that "no conflict" counts with, for a series that declares +inf.
        slack: Differences up to it are none [unit]: of times, which are rounded; else 0.
    """

    unit: str
    scale: float
    kind: str
    text: str
    labels: tuple[str, ...] = ()
    cap: float | None = None
    slack: float = 0.0


def scene_signals(object_ids: tuple[str, ...], lanes: int) -> dict[str, SignalType]:
    """List the signals that every run of a scenario has, whatever the architecture.

    Args:
        object_ids: Actors and static objects.
        lanes: Number of lanes.

    Returns:
        Signal types by name.
    """
    number = _number
    signals = {
        "time": _clock(1.0, "time since the start"),
        "ego.x": number("m", 10.0, "place in the map"),
        "ego.y": number("m", 10.0, "place in the map"),
        "ego.heading": number("rad", 0.1, "heading in the map"),
        "ego.speed": number("m/s", 10.0, "speed"),
        "ego.acceleration": number("m/s²", 1.0, "longitudinal acceleration"),
        "ego.steering_angle": number("rad", 0.1, "steering angle at the wheels"),
        "ego.lane": number("1", 1.0, f"lane, 0 at the right to {lanes - 1}; -1 off the lanes"),
        "ego.lane_offset": number("m", 1.0, "distance from the nearest lane's centre, left > 0"),
        "ego.on_road": _boolean("centre of the ego on a lane, shoulder, bay, rest area or verge"),
        "ego.in_refuge": _boolean("whole ego in a parking bay or rest area"),
        "contact": _boolean("the ego touches an object"),
        "standstill": _boolean("the ego stands"),
        "in_odd": _boolean("the run is inside the ODD now"),
    }
    for name in object_ids:
        signals |= {
            f"actor.{name}.x": number("m", 10.0, "place in the map"),
            f"actor.{name}.y": number("m", 10.0, "place in the map"),
            f"actor.{name}.heading": number("rad", 0.1, "heading in the map"),
            f"actor.{name}.speed": number("m/s", 10.0, "speed"),
            f"actor.{name}.acceleration": number("m/s²", 1.0, "acceleration along its heading"),
            f"actor.{name}.lane": number("1", 1.0, "lane, -1 off the lanes"),
            f"actor.{name}.distance": number("m", 10.0, "distance between the bodies"),
            f"actor.{name}.gap": number(
                "m", 10.0, "bumper-to-bumper gap along the ego's lane, ahead > 0"
            ),
        }
    signals["any_actor.distance"] = number("m", 10.0, "distance to the nearest body")
    return signals


def architecture_signals(
    sensors: tuple[str, ...],
    channels: tuple[str, ...],
    monitors: tuple[str, ...],
    faults: tuple[str, ...],
    object_ids: tuple[str, ...],
) -> dict[str, SignalType]:
    """List the signals that the runs of an architecture have, beside those of the scene.

    Args:
        sensors: Sensor ids.
        channels: Channel ids.
        monitors: Monitor ids, ``<channel>.<monitor>`` shortened to ``<monitor>``.
        faults: Fault ids of the ODD.
        object_ids: Actors and static objects.

    Returns:
        Signal types by name.
    """
    signals: dict[str, SignalType] = {}
    for name in channels:
        signals |= {
            f"channel.{name}.acceleration": _number("m/s²", 1.0, "commanded acceleration"),
            f"channel.{name}.steering_angle": _number("rad", 0.1, "commanded steering angle"),
            f"channel.{name}.status": SignalType(
                "1", 1.0, "enumeration", "state of the channel", STATUS_LABELS
            ),
            f"channel.{name}.age": _clock(0.1, "age of its newest command"),
            f"authority.{name}": _boolean("its command acts"),
        }
        for actor in object_ids:
            text = "it has a confirmed track of the actor"
            signals[f"channel.{name}.tracks.{actor}"] = _boolean(text)
    for name in sensors:
        signals |= {
            f"sensor.{name}.alive": _boolean("it delivers"),
            f"sensor.{name}.age": _clock(0.1, "age of its newest sample"),
        }
        for actor in object_ids:
            signals[f"sensor.{name}.detects.{actor}"] = _boolean("its newest sample has the actor")
    for name in monitors:
        signals[f"monitor.{name}.raw"] = _boolean("it fires at this tick")
        signals[f"monitor.{name}.confirmed"] = _boolean("it fires after debounce")
    for name in faults:
        signals[f"fault.{name}.active"] = _boolean("the fault is present")
    signals["faulted"] = _boolean("a fault is present, or was before")
    signals["switch.reason"] = SignalType(
        "1", 1.0, "enumeration", "why the switch decided so", REASON_LABELS
    )
    signals["safe_state"] = _boolean("standstill on the road, clear of every object")
    return signals


def _number(unit: str, scale: float, text: str) -> SignalType:
    return SignalType(unit, scale, "number", text)


def _clock(scale: float, text: str) -> SignalType:
    return SignalType("s", scale, "number", text, slack=TIME_SLACK)


def _boolean(text: str) -> SignalType:
    return SignalType("1", 1.0, "boolean", text)
