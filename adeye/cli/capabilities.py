"""The 23 capabilities of the platform, and how far each is proven by an executable test.

A status never runs ahead of its proof: without a test file the status is ``not yet``.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final


class Status(StrEnum):
    """How far a capability is proven."""

    PROVEN = "proven"
    PARTLY = "partly"
    NOT_YET = "not yet"


@dataclass(frozen=True, slots=True)
class Capability:
    """What the platform is able to do.

    Attributes:
        id: R1 to R23.
        text: The capability.
        status: How far it is proven.
        proof: Test file in the repository; empty while there is none.
    """

    id: str
    text: str
    status: Status = Status.NOT_YET
    proof: str = ""


CAPABILITIES: Final = (
    Capability("R1", "worlds and scenarios from several kinds of input"),
    Capability("R2", "test automation over many worlds and scenarios, resumable"),
    Capability("R3", "the same campaign from YAML, from the shell and from Python"),
    Capability("R4", "open nominal and safety logic, readable and replaceable"),
    Capability("R5", "a modular base: parts of third parties plug in without a change"),
    Capability("R6", "physics-based worlds: tyre-road limit, actuators, occlusion, weather"),
    Capability("R7", "every sensor parameter can be varied from YAML"),
    Capability("R8", "radar, lidar, GNSS, IMU, camera and ultrasonic sensors"),
    Capability("R9", "ground truth at every tick, to the channels allowed it and to the trace"),
    Capability("R10", "a channel controls the ego in closed loop"),
    Capability("R11", "vehicles, pedestrians and cyclists, scripted and reactive, together"),
    Capability("R12", "several channels run and are recorded at every tick"),
    Capability("R13", "control commands are prioritised by a declarative switch"),
    Capability("R14", "every channel gives commands of one specification"),
    Capability("R15", "commands of different channels can be told apart everywhere"),
    Capability("R16", "several sensors of one type, by name"),
    Capability("R17", "worlds and scenarios made by hand, inherited and overridden"),
    Capability("R18", "scenarios are independent of perception and control"),
    Capability("R19", "which sensor feeds which channel is configurable and swept"),
    Capability("R20", "faults injected at run time, by time or condition"),
    Capability("R21", "faults scripted and swept in the file of the sweep"),
    Capability("R22", "co-simulation standards such as FMI"),
    Capability("R23", "no tie to a hardware configuration: the same bits everywhere"),
)
"""All capabilities in order."""
