"""What an analysis of a suite says, as records of plain values in SI units."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TypeVar

from adeye.analysis.suite.conditions import Condition
from adeye.analysis.suite.geometry import Zone

Record = TypeVar("Record")


def matching(records: Iterable[Record], **values: object) -> Iterator[Record]:
    """Yield the records that have these values."""
    asked = values.items()
    return (item for item in records if all(getattr(item, name) == value for name, value in asked))


@dataclass(frozen=True, slots=True)
class SuiteReach:
    """From where to where a sensor detects a target in a condition; equal for not at all."""

    condition: str
    target: str
    near_m: float
    far_m: float


@dataclass(frozen=True, slots=True)
class SuiteSensor:
    """A sensor that was analysed.

    Attributes:
        id: Its id.
        kind: Camera, radar, lidar or ultrasonic.
        fidelity: Of its model.
        x_m: Of the mount [m].
        y_m: [m].
        z_m: [m].
        yaw_rad: [rad].
        field_of_view_rad: [rad].
        body_m: What of the ego hides the outside from it: least and greatest x and y [m].
        realises: Element that it realises.
        cost: As declared.
        reaches: For each condition and target.
    """

    id: str
    kind: str
    fidelity: str
    x_m: float
    y_m: float
    z_m: float
    yaw_rad: float
    field_of_view_rad: float
    body_m: tuple[float, float, float, float] | None
    realises: str | None
    cost: float
    reaches: tuple[SuiteReach, ...]


@dataclass(frozen=True, slots=True)
class NotAnalysed:
    """A sensor that was left out, and why."""

    id: str
    kind: str
    why: str


@dataclass(frozen=True, slots=True)
class ZoneCoverage:
    """Shares of a zone's area that are seen, 0 to 1."""

    zone: str
    target: str
    condition: str
    area_m2: float
    seen_by_1: float
    seen_by_2: float
    seen_by_3: float
    seen_by_2_kinds: float
    seen_by_kind: dict[str, float]


@dataclass(frozen=True, slots=True)
class BlindSpot:
    """What nobody sees of a zone.

    Attributes:
        zone: The zone.
        target: Class that is not seen.
        condition: Weather and light.
        area_m2: [m²].
        circle_m: Diameter of the largest circle in it [m].
        hides: Largest road user that stands in it whole; empty for none.
    """

    zone: str
    target: str
    condition: str
    area_m2: float
    circle_m: float
    hides: str


@dataclass(frozen=True, slots=True)
class BlindBearing:
    """One direction from the ego.

    Attributes:
        condition: Weather and light.
        bearing_rad: To the left of straight ahead [rad].
        blind_from_m: From the body to the nearest place that nobody sees; None within the look.
        seen_until_m: From the body to the farthest place that somebody sees [m].
    """

    condition: str
    bearing_rad: float
    blind_from_m: float | None
    seen_until_m: float


@dataclass(frozen=True, slots=True)
class Chain:
    """From light or echo to brakes: a sensor and a channel that it is linked to.

    Attributes:
        sensor: The sensor.
        channel: The channel.
        sense_s: Longest wait for the first sample, with latency and jitter [s].
        confirm_s: Until the track is confirmed, with what monitors wait [s].
        decide_s: Longest wait for the channel's tick, with its delay and the switch's [s].
        act_s: Lag of the brakes [s].
        deceleration_mps2: What the channel brakes with on a dry road [m/s²].
        is_assumed: Whether a plug-in channel did not tell, and the built-in's values stand for it.
    """

    sensor: str
    channel: str
    sense_s: float
    confirm_s: float
    decide_s: float
    act_s: float
    deceleration_mps2: float
    is_assumed: bool

    @property
    def total_s(self) -> float:
        """Until the brakes act [s]."""
        return self.sense_s + self.confirm_s + self.decide_s + self.act_s


@dataclass(frozen=True, slots=True)
class Slack:
    """Range to spare at a speed.

    Attributes:
        condition: Weather, light and grip.
        case: What asks for range.
        speed_mps: Of the ego [m/s].
        need_m: From the front of the ego [m]; of the chain with the most to spare.
        slack_m: Range less the need; negative where it is short; None if nobody looks there.
        sensor: Whose range it is; empty for none.
    """

    condition: str
    case: str
    speed_mps: float
    need_m: float | None
    slack_m: float | None
    sensor: str


@dataclass(frozen=True, slots=True)
class SpeedRange:
    """Speeds that a suite supports.

    Attributes:
        condition: Weather, light and grip.
        case: What asks for range.
        lowest_mps: Down to here from the highest without a gap [m/s].
        highest_mps: None if no speed is supported [m/s].
        is_limit: Whether the search ended before the suite did.
        sensor: That allows the highest speed; empty for none.
        deceleration_mps2: That it is allowed with [m/s²].
    """

    condition: str
    case: str
    lowest_mps: float | None
    highest_mps: float | None
    is_limit: bool
    sensor: str
    deceleration_mps2: float | None


@dataclass(frozen=True, slots=True)
class ForwardRange:
    """The range straight ahead beside the table of UN R157.

    Attributes:
        condition: Weather and light.
        range_m: From the front of the ego to a car [m].
        sensor: Whose range it is; empty for none.
        speed_mps: Highest speed whose least range it has; None below the least of all [m/s].
        needed_m: For the highest speed of the ODD, if it has one in the table [m].
    """

    condition: str
    range_m: float
    sensor: str
    speed_mps: float | None
    needed_m: float | None


@dataclass(frozen=True, slots=True)
class Removal:
    """What is left without some sensors.

    Attributes:
        what: What fails.
        kind: ``sensor``, ``element`` or ``resource``.
        sensors: That go with it.
        front_seen: Share of the lane ahead that is still seen, by condition.
        seen: Share of all zones that is still seen, by condition.
        highest_mps: For a stopped car, by condition; None if no speed is supported.
        all_cases_mps: The least over all cases, by condition.
    """

    what: str
    kind: str
    sensors: tuple[str, ...]
    front_seen: dict[str, float]
    seen: dict[str, float]
    highest_mps: dict[str, float | None]
    all_cases_mps: dict[str, float | None]


@dataclass(frozen=True, slots=True)
class Suite:
    """The analysis of one architecture.

    Attributes:
        architecture: Its id.
        title: In words.
        cost: Of the architecture as declared.
        sensor_cost: Sum over all its sensors.
        length_m: Of the ego [m].
        width_m: [m].
        height_m: [m].
        odd_speed_mps: Highest speed of the ODD, if there is one [m/s].
        sensors: Analysed.
        not_analysed: Left out.
        conditions: The first is the reference.
        zones: Around the ego.
        coverage: By zone, target and condition.
        blind_spots: The same.
        bearings: By condition, for a car.
        chains: From sensors to brakes.
        slacks: By condition, case and speed.
        speeds: By condition and case.
        forward: By condition.
        whole: Nothing removed.
        removals: Each sensor, element and shared resource.
        critical: Sensor whose loss costs most; empty if none costs anything.
        notes: What is left out or assumed.
    """

    architecture: str
    title: str
    cost: float
    sensor_cost: float
    length_m: float
    width_m: float
    height_m: float
    odd_speed_mps: float | None
    sensors: tuple[SuiteSensor, ...]
    not_analysed: tuple[NotAnalysed, ...]
    conditions: tuple[Condition, ...]
    zones: tuple[Zone, ...]
    coverage: tuple[ZoneCoverage, ...]
    blind_spots: tuple[BlindSpot, ...]
    bearings: tuple[BlindBearing, ...]
    chains: tuple[Chain, ...]
    slacks: tuple[Slack, ...]
    speeds: tuple[SpeedRange, ...]
    forward: tuple[ForwardRange, ...]
    whole: Removal
    removals: tuple[Removal, ...]
    critical: str
    notes: tuple[str, ...]

    @property
    def worst(self) -> Condition:
        """The condition in which the least of the zones is seen; the reference if all are alike."""
        return min(self.conditions, key=lambda condition: self.whole.seen[condition.id])
