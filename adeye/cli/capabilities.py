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


PROOFS: Final = "tests/requirements"

CAPABILITIES: Final = (
    Capability("R1", "worlds and scenarios from several kinds of input"),
    Capability(
        "R2",
        "test automation over many worlds and scenarios, resumable",
        Status.PARTLY,
        f"{PROOFS}/test_r02_automation_over_scenarios.py",
    ),
    Capability(
        "R3",
        "the same campaign from YAML, from the shell and from Python",
        Status.PROVEN,
        f"{PROOFS}/test_r03_yaml_shell_and_python.py",
    ),
    Capability(
        "R4",
        "open nominal and safety logic, readable and replaceable",
        Status.PROVEN,
        f"{PROOFS}/test_r04_open_control_logic.py",
    ),
    Capability(
        "R5",
        "a modular base: parts of third parties plug in without a change",
        Status.PARTLY,
        f"{PROOFS}/test_r05_third_party_parts.py",
    ),
    Capability(
        "R6",
        "physics-based worlds: tyre-road limit, actuators, occlusion, weather",
        Status.PARTLY,
        f"{PROOFS}/test_r06_physics.py",
    ),
    Capability(
        "R7",
        "every sensor parameter can be varied from YAML",
        Status.PROVEN,
        f"{PROOFS}/test_r07_modifiable_sensors.py",
    ),
    Capability(
        "R8",
        "radar, lidar, GNSS, IMU, camera and ultrasonic sensors",
        Status.PROVEN,
        f"{PROOFS}/test_r08_six_sensor_types.py",
    ),
    Capability(
        "R9",
        "ground truth at every tick, to the channels allowed it and to the trace",
        Status.PARTLY,
        f"{PROOFS}/test_r09_ground_truth.py",
    ),
    Capability(
        "R10",
        "a channel controls the ego in closed loop",
        Status.PROVEN,
        f"{PROOFS}/test_r10_channel_controls_ego.py",
    ),
    Capability(
        "R11",
        "vehicles, pedestrians and cyclists, scripted and reactive, together",
        Status.PROVEN,
        f"{PROOFS}/test_r11_several_actors.py",
    ),
    Capability(
        "R12",
        "several channels run and are recorded at every tick",
        Status.PROVEN,
        f"{PROOFS}/test_r12_shadow_commands.py",
    ),
    Capability(
        "R13",
        "control commands are prioritised by a declarative switch",
        Status.PROVEN,
        f"{PROOFS}/test_r13_prioritised_commands.py",
    ),
    Capability(
        "R14",
        "every channel gives commands of one specification",
        Status.PROVEN,
        f"{PROOFS}/test_r14_one_command_specification.py",
    ),
    Capability(
        "R15",
        "commands of different channels can be told apart everywhere",
        Status.PROVEN,
        f"{PROOFS}/test_r15_channels_told_apart.py",
    ),
    Capability(
        "R16",
        "several sensors of one type, by name",
        Status.PROVEN,
        f"{PROOFS}/test_r16_several_sensors_of_a_type.py",
    ),
    Capability(
        "R17",
        "worlds and scenarios made by hand, inherited and overridden",
        Status.PROVEN,
        f"{PROOFS}/test_r17_inherited_scenarios.py",
    ),
    Capability(
        "R18",
        "scenarios are independent of perception and control",
        Status.PROVEN,
        f"{PROOFS}/test_r18_scenarios_independent_of_control.py",
    ),
    Capability(
        "R19",
        "which sensor feeds which channel is configurable and swept",
        Status.PROVEN,
        f"{PROOFS}/test_r19_links.py",
    ),
    Capability(
        "R20",
        "faults injected at run time, by time or condition",
        Status.PROVEN,
        f"{PROOFS}/test_r20_run_time_faults.py",
    ),
    Capability(
        "R21",
        "faults scripted and swept in the file of the sweep",
        Status.PROVEN,
        f"{PROOFS}/test_r21_faults_beside_the_sweep.py",
    ),
    Capability("R22", "co-simulation standards such as FMI"),
    Capability(
        "R23",
        "no tie to a hardware configuration: the same bits everywhere",
        Status.PROVEN,
        f"{PROOFS}/test_r23_any_hardware.py",
    ),
)
"""All capabilities in order."""
