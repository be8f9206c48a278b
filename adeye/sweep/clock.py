"""Check times and rates of scenarios and architectures against the master clock."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.spec.clock import period_ticks, ticks

if TYPE_CHECKING:
    from adeye.errors import SpecError
    from adeye.spec.architecture import Architecture
    from adeye.spec.scenario import LogicalScenario


def check_times(scenario: LogicalScenario, step: float) -> None:
    """Check that horizon and tail of a scenario fit the master clock.

    Raises:
        SpecError: One does not; the message begins with its name.
    """
    ticks(scenario.horizon, step, "horizon")
    ticks(scenario.tail, step, "tail")


def check_rates(architecture: Architecture, step: float) -> None:
    """Check that every rate and delay of an architecture fits the master clock.

    Raises:
        SpecError: One does not; the message begins with its dotted path.
    """
    for name, sensor in architecture.sensors.items():
        period_ticks(sensor.rate, step, f"sensors.{name}.rate")
        ticks(sensor.latency, step, f"sensors.{name}.latency")
        ticks(sensor.jitter, step, f"sensors.{name}.jitter")
    for name, channel in architecture.channels.items():
        period_ticks(channel.rate, step, f"channels.{name}.rate")
        ticks(channel.delay, step, f"channels.{name}.delay")
    ticks(architecture.switch.handover, step, "switch.handover")


def guilty_path(error: SpecError) -> tuple[str, ...]:
    """Read the dotted path that the message of an error of this module begins with."""
    return tuple(error.message.split(":")[0].split("."))
