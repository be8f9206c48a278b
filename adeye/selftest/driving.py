"""Masters in what drives: channels, sensors, switch and monitors."""

from __future__ import annotations

from typing import Final

from adeye.selftest.bench import Edit
from adeye.selftest.masters import Examine, Group, Master, running
from adeye.selftest.project import BARE, DRIVING, GUARDED, HANDOVER

_OBJECT: Final = """\
    kind: radar
    mount: {x: 2.3 m, y: 0 m, z: 0.5 m}
    field_of_view: 120 deg
    range: 150 m
"""
_PLUGIN: Final = "    kind: ./parts.py:Front\n    parameters: {{flaw: {flaw}}}\n"


def _channel(flaw: str, wrong: str, fsr: str, finder: str) -> Master:
    return Master(
        flaw,
        "channel",
        wrong,
        f"{fsr}: {finder}",
        1,
        f"{fsr} FAIL",
        running(Edit(BARE, "flaw: none", f"flaw: {flaw}")),
        running(),
    )


def _sensor(name: str, wrong: str, finder: str, examine: Examine, twin: Examine) -> Master:
    fsr = finder.partition(":")[0]
    return Master(name, "sensor", wrong, finder, 1, f"{fsr} FAIL", examine, twin)


def _guarded(group: Group, name: str, wrong: str, finder: str, examine: Examine) -> Master:
    fsr = finder.partition(":")[0]
    twin = running(odd=HANDOVER)
    return Master(name, group, wrong, finder, 1, f"{fsr} FAIL", examine, twin)


def _fault(what: str, at: str = "1 s") -> Examine:
    """Plant a fault of the front sensor into every run."""
    fault = f"{{id: planted, target: sensors.front, onset: {{at: {at}}}, {what}}}"
    return running(
        Edit(DRIVING, "faults: []", f"faults: [{fault}]"),
        Edit(DRIVING, "faults: [none]", "faults: [planted]"),
    )


def _handover(fault: str, silent: str = "onset: {at: 2 s}", *edits: Edit) -> Examine:
    """Plant a fault beside the silence of the nominal channel."""
    return running(
        Edit(HANDOVER, "faults: [nominal_silent]", "faults: [[nominal_silent, planted]]"),
        Edit(HANDOVER, "onset: {at: 2 s}}]", f"{silent}}}, {{id: planted, {fault}}}]"),
        *edits,
        odd=HANDOVER,
    )


def _front(flaw: str, car: str = "none") -> Examine:
    return running(
        Edit(BARE, "flaw: none", f"flaw: {car}"),
        Edit(BARE, _OBJECT, _PLUGIN.format(flaw=flaw)),
        Edit(DRIVING, "use: closing", "use: closing_curve"),
    )


CHANNELS: Final = (
    _channel("never_brakes", "the channel never brakes", "FSR-01", "contact"),
    _channel("ignores", "the channel ignores every object", "FSR-01", "contact"),
    _channel("brakes_late", "the channel brakes late and hard", "FSR-02", "bound on a metric"),
    _channel(
        "steers_off", "the channel steers 0.02 rad to the left", "FSR-03", "place in the lane"
    ),
    _channel("oscillates", "the channel steers left and right", "FSR-04", "bound on the steering"),
    _channel("degrees", "the channel steers in degrees", "FSR-04", "bound on the steering"),
)

SENSORS: Final = (
    _sensor(
        "sensor_blind",
        "the sensor delivers nothing from 1 s on",
        "FSR-06: age of the sample",
        _fault("model: drop_out"),
        _fault("model: sample_loss, probability: 0.1"),
    ),
    _sensor(
        "sensor_short_range",
        "the sensor sees 25 m far, not 150 m",
        "FSR-05: detection",
        running(Edit(BARE, "range: 150 m", "range: 25 m")),
        running(Edit(BARE, "range: 150 m", "range: 120 m")),
    ),
    _sensor(
        "sensor_late",
        "samples come 0.5 s late",
        "FSR-06: age of the sample",
        running(Edit(BARE, "latency: 0.05 s", "latency: 0.5 s")),
        running(Edit(BARE, "latency: 0.05 s", "latency: 0.1 s")),
    ),
    _sensor(
        "sensor_frozen",
        "the sensor repeats its sample with new stamps",
        "FSR-01: contact",
        _fault("model: freeze"),
        _fault("model: freeze, duration: 0.1 s"),
    ),
    _sensor(
        "sensor_ghost",
        "the sensor reports an object in the lane that is not there",
        "FSR-07: braking without a reason",
        _fault("model: ghost, x: 20 m"),
        _fault("model: ghost, x: 20 m, y: 10 m"),
    ),
    _sensor(
        "sensor_turned",
        "the sensor is turned by 8 deg",
        "FSR-01: contact",
        _fault("model: miscalibration, yaw: 8 deg", "0 s"),
        _fault("model: miscalibration, yaw: 0.1 deg", "0 s"),
    ),
    _sensor(
        "sensor_mirrored",
        "bearings have the wrong sign, in a curve",
        "FSR-01: contact",
        _front("mirrored"),
        _front("none"),
    ),
    _sensor(
        "sensor_tampers",
        "the sensor writes into the world: the steering of a car that oscillates is straight",
        "FSR-04: bound on the steering; guests are shown copies",
        _front("tampering", "oscillates"),
        _front("none"),
    ),
)

SWITCHES: Final = (
    _guarded(
        "switch",
        "switch_stuck",
        "the switch never hands over",
        "FSR-12: time to authority",
        running(Edit(GUARDED, "policy: fixed_priority", "policy: stuck"), odd=HANDOVER),
    ),
    _guarded(
        "switch",
        "switch_late",
        "each handover takes effect 1 s late",
        "FSR-12: time to authority",
        _handover("target: switch, model: late, delay: 1 s, onset: {at: 0 s}"),
    ),
    _guarded(
        "switch",
        "switch_debounce",
        "a request must stand for 1 s, and a stale command may act",
        "FSR-12: time to authority",
        running(
            Edit(GUARDED, "debounce: 0 s", "debounce: 1 s"),
            Edit(GUARDED, "staleness: 0.3 s", "staleness: 5 s"),
            odd=HANDOVER,
        ),
    ),
    _guarded(
        "switch",
        "switch_chatter",
        "authority passes back and forth",
        "FSR-13: authority is kept",
        _handover(
            "target: channels.safety, model: silent, onset: {at: 4 s}, duration: 0.5 s, every: 1 s",
            "onset: {at: 2 s}, duration: 1 s",
            Edit(GUARDED, "latch: true", "latch: false"),
        ),
    ),
)

MONITORS: Final = (
    _guarded(
        "monitor",
        "monitors_frozen",
        "the monitors of the safety channel are frozen",
        "FSR-14: the monitor is confirmed",
        _handover("target: hooks.safety, model: monitors_frozen, onset: {at: 0 s}"),
    ),
    _guarded(
        "monitor",
        "safety_dead",
        "the safety channel is dead when it is needed",
        "FSR-12: time to authority",
        _handover("target: channels.safety, model: crash, onset: {at: 1 s}"),
    ),
)
