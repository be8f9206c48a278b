"""What flows between the stages of a batch of runs, and the words for it.

Arrays have the run as leading axis. Stages read and write these types only, so any stage can be
replaced. Compiled stages work on one run's slice; the column numbers below are shared with them.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Literal, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray

from adeye.kernel.relation import TIME_SLACK
from adeye.kernel.road import GUIDE_WIDTH, MANY, PARTS, Ground, Grounds, lay_guide
from adeye.kernel.strips import (
    ENDS_WIDTH,
    LIMITS_WIDTH,
    SLAB_BEGIN,
    SLAB_LANES,
    SLAB_STRIPS,
    SLAB_WIDTH,
    STRIP_WIDTH,
    lane_ends,
    lanes_at,
    look_ahead,
    opposite_ends,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    from _typeshed import DataclassInstance

# --- What flows between the stages of a batch of B runs, and the words for it ---------------------

_Copied = TypeVar("_Copied", bound="DataclassInstance")

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Shorts = NDArray[np.int16]
Bytes = NDArray[np.int8]

# Columns of an ego state row.
EGO_COLUMNS: Final = ("x", "y", "heading", "speed", "acceleration", "steering_angle", "yaw_rate")
EGO_X, EGO_Y, EGO_HEADING, EGO_SPEED, EGO_ACCELERATION, EGO_STEERING, EGO_YAW_RATE = range(7)

# Columns of an object state row: actors first, then static objects.
OBJECT_COLUMNS: Final = ("x", "y", "heading", "speed", "acceleration")
OBJECT_X, OBJECT_Y, OBJECT_HEADING, OBJECT_SPEED, OBJECT_ACCELERATION = range(5)

# Columns of a place on the road; `d` from the right edge, `offset` from the nearest lane's centre.
PLACE_COLUMNS: Final = ("s", "d", "road_heading", "curvature", "lane", "offset")
PLACE_S, PLACE_D, PLACE_HEADING, PLACE_CURVATURE, PLACE_LANE, PLACE_OFFSET = range(6)

# Columns of a detection row, in the vehicle frame of the sample's time. Place and size are those of
# a box; a length of 0 says that the depth is unknown and the place is that of the nearest face, a
# width of 0 that nothing is known of the width, a class of -1 that nothing is known of the class.
DETECTION_COLUMNS: Final = ("x", "y", "range_rate", "has_range_rate", "length", "width", "class")
(
    DETECTION_X,
    DETECTION_Y,
    DETECTION_RANGE_RATE,
    DETECTION_HAS_RANGE_RATE,
    DETECTION_LENGTH,
    DETECTION_WIDTH,
    DETECTION_CLASS,
) = range(7)

# Columns of an ego estimate, as localisation and ground truth give it.
ESTIMATE_COLUMNS: Final = (*EGO_COLUMNS, *PLACE_COLUMNS)
ESTIMATE_PLACE: Final = len(EGO_COLUMNS)

# Columns of what a satellite receiver gives: place of its antenna in the map and the antenna's
# velocity over ground [m], [m/s]; the lever arm to the ego is left to who uses them.
GNSS_COLUMNS: Final = ("x", "y", "velocity_x", "velocity_y")
GNSS_X, GNSS_Y, GNSS_VELOCITY_X, GNSS_VELOCITY_Y = range(4)

# Columns of what an inertial unit gives: acceleration of the place where it is mounted along the
# axes of the vehicle frame, turning rate [m/s²], [rad/s].
IMU_COLUMNS: Final = ("acceleration_x", "acceleration_y", "yaw_rate")
IMU_ACCELERATION_X, IMU_ACCELERATION_Y, IMU_YAW_RATE = range(3)

# Columns of a return of a lidar's beam; a range of 0 says that there is none. Bearing and elevation
# are those of the beam in the vehicle frame about the sensor's place.
POINT_COLUMNS: Final = ("range", "bearing", "elevation")
POINT_RANGE, POINT_BEARING, POINT_ELEVATION = range(3)

# Columns of a track row, in the vehicle frame of the channel's tick.
TRACK_COLUMNS: Final = ("x", "y", "vx", "vy", "length", "width")

# Columns of a refuge, a place to stand in beside lanes and shoulder on the right: its kind, an
# index into `REFUGE_KINDS`; where its full depth begins along the road and for how long it has it;
# how far it reaches beyond the shoulder; the length of each taper before and after it [m].
REFUGE_COLUMNS: Final = ("kind", "s", "length", "depth", "taper")
REFUGE_KIND, REFUGE_S, REFUGE_LENGTH, REFUGE_DEPTH, REFUGE_TAPER = range(5)
REFUGE_KINDS: Final = ("parking_bay", "rest_area")

ObjectClass = Literal[
    "car",
    "van",
    "truck",
    "bus",
    "motorcycle",
    "cyclist",
    "pedestrian",
    "parked_truck",
    "parked_car",
    "barrier",
    "building",
]
OBJECT_CLASSES: Final[tuple[str, ...]] = get_args(ObjectClass)
FIRST_FREE: Final = OBJECT_CLASSES.index("cyclist")
LAST_FREE: Final = OBJECT_CLASSES.index("pedestrian")
"""Those from the first to the last go where they like; the others keep to lanes."""

STATUS_LABELS: Final = ("ok", "degraded", "requests_authority", "fault", "silent")
OK, DEGRADED, REQUESTS_AUTHORITY, FAULT, SILENT = range(5)


ILLUMINANCE: Final = {"day": 2e4, "dusk": 100.0, "lit_night": 10.0, "night": 0.1}
"""Horizontal illuminance of each illumination [lx]: an overcast day, soon after sunset, a lit road
(class C3 of EN 13201 asks for 15 lx, M classes for less), a night with some moon."""


ROAD_EDGE: Final = 1e-6
"""How far beyond begin and end of a road a place is still taken for one on it [m]: rounding."""


def _copied(record: _Copied) -> _Copied:
    """Copy a record with its arrays."""
    items = {field.name: getattr(record, field.name) for field in fields(record)}
    return replace(
        record, **{name: item.copy() for name, item in items.items() if hasattr(item, "copy")}
    )


MOST_LANES: Final = 8
"""Lanes that a road may have in one direction."""


@dataclass(frozen=True, slots=True, eq=False)
class RoadMap:
    """The road of each run, as channels know it from the map.

    Attributes:
        segments: Reference line (right edge), (B, K, 5): x, y, heading, length, curvature.
        lane_width: (B,) [m].
        lanes: Number of lanes, the same for the batch; of an imported road ``MOST_LANES``.
        shoulder: Width beside the right edge (B,) [m].
        speed_limit: (B,) [m/s].
        verge: Width of free ground beside the shoulder (B,) [m].
        refuges: Parking bays and rest areas in the order of their places, (B, R, 5), see
            ``REFUGE_COLUMNS``.
        length: Where the road ends (B,) [m]; the reference line may go on behind it.
        slabs: (B, S, 4), see ``kernel.strips``; (B, 0, 4) where all lanes go one way all along.
            What is said above of lanes, shoulder and limit is else a summary.
        strips: (B, J, 8).
        grades: (B, G, 2): from where on the road [m] it rises how much for each metre; (B, 0, 2) of
            roads that are flat.
        left_hand: Whether traffic keeps to the left, the same for the batch. All else, and whatever
            takes place on the road, is told of the mirror image.
    """

    segments: Floats
    lane_width: Floats
    lanes: int
    shoulder: Floats
    speed_limit: Floats
    verge: Floats
    refuges: Floats
    length: Floats
    slabs: Floats = field(default_factory=lambda: np.zeros((0, 0, SLAB_WIDTH)))
    strips: Floats = field(default_factory=lambda: np.zeros((0, 0, STRIP_WIDTH)))
    grades: Floats = field(default_factory=lambda: np.zeros((0, 0, 2)))
    left_hand: bool = False

    def __post_init__(self) -> None:
        """Give roads that have none slabs, strips and grades of no number."""
        runs = self.segments.shape[0]
        for name, width in (("slabs", SLAB_WIDTH), ("strips", STRIP_WIDTH), ("grades", 2)):
            if getattr(self, name).shape[0] != runs:
                object.__setattr__(self, name, np.zeros((runs, 0, width)))

    def covers(self, s: Floats) -> Bools:
        """Tell which places (B, ...) along the road lie between its begin and its end."""
        length = self.length.reshape(-1, *(1,) * (s.ndim - 1))
        return np.asarray((s >= -ROAD_EDGE) & (s <= length + ROAD_EDGE))

    def of(self, runs: Any) -> RoadMap:
        """Keep the roads of some runs, chosen by a slice or by their numbers."""
        columns = {item.name: getattr(self, item.name) for item in fields(self)}
        same = {name: columns.pop(name) for name in ("lanes", "left_hand")}
        return RoadMap(**{name: column[runs] for name, column in columns.items()}, **same)

    def told(self, run: int) -> dict[str, Any]:
        """Return the road of a run as guests are told it, without what fills arrays up."""
        slabs = self.slabs[run][np.isfinite(self.slabs[run, :, SLAB_BEGIN])]
        lanes = int(slabs[:, SLAB_LANES].max()) if len(slabs) else self.lanes
        told = {
            "segments": self.segments[run][self.segments[run, :, 3] > 0.0],
            "lane_width": float(self.lane_width[run]),
            "lanes": lanes,
            "shoulder": float(self.shoulder[run]),
            "speed_limit": float(self.speed_limit[run]),
            "verge": float(self.verge[run]),
            "refuges": self.refuges[run].copy(),
        }
        if len(slabs):
            count = int(slabs[:, SLAB_STRIPS].sum())
            told |= {"slabs": slabs, "strips": self.strips[run, :count].copy()}
        # Who does not care is told what it was told before.
        return told | ({"left_hand": True} if self.left_hand else {})

    def grounds(self) -> Grounds:
        """Return the roads as compiled stages ask them, in contiguous arrays that nobody shares."""
        own = {*Grounds._fields} & {item.name for item in fields(self)} - {"lanes"}
        columns = {name: np.array(getattr(self, name), order="C") for name in own}
        runs, pieces = self.segments.shape[:2]
        ends = np.zeros((*columns["strips"].shape[:2], ENDS_WIDTH))
        limits = np.zeros((*columns["slabs"].shape[:2], LIMITS_WIDTH))
        for run in range(len(limits) if limits.size else 0):
            look_ahead(columns["slabs"][run], columns["strips"][run], ends[run], limits[run])
        guides = np.zeros((runs, pieces if pieces > MANY else 0, GUIDE_WIDTH))
        for run in range(runs if pieces > MANY else 0):
            lay_guide(columns["segments"][run], guides[run])
        return Grounds(**columns, lanes=self.lanes, ends=ends, limits=limits, guide=guides)

    def ground(self, run: int) -> Ground:
        """Return the road of one run as compiled code asks it."""
        grounds = self.of([run]).grounds()
        names = [name for name in Ground._fields if name != "lanes"]
        return Ground(**{name: getattr(grounds, name)[0] for name in names}, lanes=self.lanes)

    def centers(self, lane: Floats, s: Floats, *, oncoming: bool = False) -> Floats:
        """Return d of the centre of a lane of each run (B,) [m]; NaN where it is not.

        Args:
            lane: Its number (B,) from the right of who drives there.
            s: Along the road (B,) [m].
            oncoming: Whether it is one of the other way.
        """
        if not (self.slabs.shape[1] or oncoming):
            return np.asarray((lane + 0.5) * self.lane_width)
        centers = np.full(len(lane), np.nan)
        for run in range(len(lane) if self.slabs.shape[1] else 0):
            table, number = (self.slabs[run], self.strips[run]), int(lane[run])
            if oncoming:
                ends = opposite_ends(*table, float(s[run]), number)
            elif 0 <= number < lanes_at(table[0], float(s[run])):
                ends = lane_ends(*table, float(s[run]), number)
            else:
                continue
            centers[run] = 0.5 * (ends[0] + ends[1])
        return centers


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Environmental conditions of each run (B,), constant over the run.

    Attributes:
        rain: [m/s] (7.5 mm/h is 7.5e-3 / 3600).
        fog_visibility: [m].
        friction: Tyre-road friction coefficient.
        night: Whether it is dark.
        illuminance: Of a horizontal surface by sun, sky and street lights [lx].
        sun_elevation: Of the sun above the horizon [rad], NaN where nobody looks into it.
        sun_azimuth: Where the sun stands, counter-clockwise from the map's x axis [rad].
    """

    rain: Floats
    fog_visibility: Floats
    friction: Floats
    night: Bools
    illuminance: Floats
    sun_elevation: Floats
    sun_azimuth: Floats

    @classmethod
    def clear(cls, runs: int) -> Surroundings:
        """Return a dry, overcast day without fog."""
        return cls(
            rain=np.zeros(runs),
            fog_visibility=np.full(runs, 1e5),
            friction=np.ones(runs),
            night=np.zeros(runs, dtype=np.bool_),
            illuminance=np.full(runs, ILLUMINANCE["day"]),
            sun_elevation=np.full(runs, np.nan),
            sun_azimuth=np.zeros(runs),
        )

    def of(self, runs: Any) -> Surroundings:
        """Keep the conditions of some runs, chosen by a slice or by their numbers."""
        return Surroundings(*(getattr(self, field.name)[runs] for field in fields(self)))


@dataclass(slots=True)
class Scene:
    """Ground truth at one tick for B runs with M objects (actors, then static objects).

    Attributes:
        tick: Number of the tick.
        time: Its time [s].
        ego: (B, 7), see ``EGO_COLUMNS``.
        ego_place: (B, 6), see ``PLACE_COLUMNS``.
        objects: (B, M, 5), see ``OBJECT_COLUMNS``.
        object_places: (B, M, 6), see ``PLACE_COLUMNS``.
        begun: (B, V) time at which each storyboard event began [s], NaN before, inf for one that
            lost against another of its tick.
        ended: (B, V) whether its action has come to its end or another has taken its place.
        contact: (B,) object that the ego touches, -1 for none.
        impact_speed: (B,) relative speed at contact [m/s], 0 before.
        foreign_contact: (B,) whether two other actors touch.
        running: (B,) whether the run has not ended.
    """

    tick: int
    time: float
    ego: Floats
    ego_place: Floats
    objects: Floats
    object_places: Floats
    begun: Floats
    ended: Bools
    contact: Ints
    impact_speed: Floats
    foreign_contact: Bools
    running: Bools

    def copy(self) -> Scene:
        """Copy the arrays, so that a later tick leaves this scene as it was."""
        return _copied(self)


@dataclass(frozen=True, slots=True)
class SceneContext:
    """What does not change during the runs of a batch.

    Attributes:
        step: Master clock [s].
        object_ids: M names.
        object_classes: (M,) index into ``OBJECT_CLASSES``.
        actor_count: How many of the objects are actors.
        object_sizes: (B, M, 3) length, width, height [m].
        object_reflectivity: (B, M) share of light that the surface returns, for lidar.
        ego_size: (B, 3) length, width, height [m].
        road: The road of each run.
        surroundings: Environmental conditions of each run.
        stream_seeds: (B,) uint64 seed of the random streams.
        event_ids: Storyboard events, in the order of ``Scene.begun``.
    """

    step: float
    object_ids: tuple[str, ...]
    object_classes: Ints
    actor_count: int
    object_sizes: Floats
    object_reflectivity: Floats
    ego_size: Floats
    road: RoadMap
    surroundings: Surroundings
    stream_seeds: NDArray[np.uint64]
    event_ids: tuple[str, ...]

    @property
    def runs(self) -> int:
        """Number of runs B in the batch."""
        return int(self.ego_size.shape[0])


@dataclass(slots=True)
class Measurement:
    """The newest sample that a sensor has delivered, for B runs and up to M detections.

    M is what the sensor may report, at every tick the same: fewer than there are objects, or more,
    for what is not there. Detections are packed in order of increasing distance, so a place in the
    list tells nothing about which object it is; ``source`` does, for the recorder only.

    Attributes:
        stamp: (B,) time of the sample [s], -1 before the first.
        fresh: (B,) whether it was delivered at this tick.
        alive: (B,) whether the sensor delivers at all.
        mask: (B, M) which detections are there.
        detections: (B, M, 7), see ``DETECTION_COLUMNS``.
        source: (B, M) object behind each detection, -1 for none; of a sensor from outside the
            package only whether there is one, as the recorder looks where it is.
        estimate: (B, 13) ego estimate, see ``ESTIMATE_COLUMNS``; None if it gives none.
        points: (B, P, 3) returns of a lidar's beams, see ``POINT_COLUMNS``; None of other sensors.
        hits: (B, P) object behind each return, -1 for none; for the recorder only.
        values: (B, V) what a sensor of the ego's motion gives, ``GNSS_COLUMNS`` or
            ``IMU_COLUMNS``; NaN rows while it gives nothing.
    """

    stamp: Floats
    fresh: Bools
    alive: Bools
    mask: Bools
    detections: Floats
    source: Ints
    estimate: Floats | None = None
    points: Floats | None = None
    hits: Ints | None = None
    values: Floats | None = None

    def copy(self) -> Measurement:
        """Copy the arrays, so that a later change leaves this measurement as it was."""
        return self.map(lambda array: array.copy())

    def map(self, change: Callable[[NDArray[Any]], NDArray[Any]]) -> Measurement:
        """Return a measurement made of changed arrays."""
        items = {field.name: getattr(self, field.name) for field in fields(Measurement)}
        changed = {name: change(item) for name, item in items.items() if item is not None}
        return Measurement(**changed)


@dataclass(slots=True)
class ControlCommand:
    """What one channel wants the ego to do, the same form for every channel.

    Attributes:
        channel: Id of the channel that gives it.
        acceleration: (B,) [m/s²].
        steering_angle: (B,) [rad].
        stamp: (B,) time of the observation that it answers [s], -1 before the first.
        status: (B,) index into ``STATUS_LABELS``.
        plan: (B, K, 4) x, y, heading, speed in the map, or None.
        monitors: (B, Q, 2) raw and confirmed state of the channel's monitors, or None.
        tracks: (B, K, 6) what the channel believes is there, see ``TRACK_COLUMNS``; NaN rows are
            empty; or None.
        candidates: (B, P, Q, 2) places in the map of the trajectories that it chose from, NaN rows
            are empty; or None.
        candidate_costs: (B, P) what they cost, less is better, inf for one that cannot be driven.
        chosen: (B,) which of them it chose, -1 for none.
    """

    channel: str
    acceleration: Floats
    steering_angle: Floats
    stamp: Floats
    status: Ints
    plan: Floats | None = None
    monitors: Bools | None = None
    tracks: Floats | None = None
    candidates: Floats | None = None
    candidate_costs: Floats | None = None
    chosen: Ints | None = None

    def copy(self) -> ControlCommand:
        """Copy the arrays, so that a later change leaves this command as it was."""
        return _copied(self)


@dataclass(frozen=True, slots=True)
class Observation:
    """What is linked to a channel at one of its ticks, and nothing else.

    Attributes:
        time: [s].
        measurements: Linked sensors by id; ``source`` is blanked.
        commands: Linked channels by id: their command of the previous tick, after faults.
        authority: The switch's state of the previous tick, if linked.
        running: (B,) runs that have not ended.
    """

    time: float
    measurements: Mapping[str, Measurement]
    commands: Mapping[str, ControlCommand]
    authority: Authority | None
    running: Bools


# --- Who has authority over the ego, the reasons for it, and what can be wrong with the switch ----

REASON_LABELS: Final = (
    "none",
    "default",
    "request",
    "latched",
    "staleness",
    "no_channel",
    "stuck",
    "returned",
    "voted",
    "no_majority",
    "handover",
    "override",
)
(
    REASON_NONE,
    REASON_DEFAULT,
    REASON_REQUEST,
    REASON_LATCHED,
    REASON_STALENESS,
    REASON_NO_CHANNEL,
    REASON_STUCK,
    REASON_RETURNED,
    REASON_VOTED,
    REASON_NO_MAJORITY,
    REASON_HANDOVER,
    REASON_OVERRIDE,
) = range(12)

MANOEUVRE_MONITORS: Final = ("mrm_rest_area", "mrm_roadside_parking", "mrm_stop")
"""Columns beside the monitors that tell the manoeuvre: raw where a level asks for it, confirmed
where it is in force. They detect nothing."""
NO_FAULT: Final = "none"
"""Name of the fault-free entry of a plan, the twin of every other."""
NO_CHANNEL: Final = -1
"""Authority when no channel can act: the ego coasts."""


@dataclass(slots=True)
class Authority:
    """Whose command acts, and why.

    Attributes:
        channel: (B,) index into the architecture's channels, ``NO_CHANNEL`` for none.
        reason: (B,) index into ``REASON_LABELS``.
    """

    channel: Ints
    reason: Ints


@dataclass(frozen=True, slots=True)
class SwitchFaults:
    """What is wrong with the switch itself at one tick.

    Attributes:
        stuck: (B,) it stays at the channel that it lies at, the default at the start.
        delay: (B,) a change of authority that is decided now takes effect so much later [s].
    """

    stuck: Bools
    delay: Floats

    @classmethod
    def none(cls, runs: int) -> SwitchFaults:
        """Return a sound switch."""
        return cls(np.zeros(runs, dtype=np.bool_), np.zeros(runs))


# --- The signal dictionary: what an FSR may name, each with unit, scale and kind ------------------


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
        least: No value is below it; None where that is not known.
        most: No value is above it.
        most_per: What ``most`` is of: empty for the run, ``s`` for each second that it lasts.
        is_whole: Whether it is a whole number.
        of_objects: Whether it is measured of objects: in a run without any it is +inf if it has a
            cap, else 0 or false, or there is no such signal.
        at_start: Its word at the first row of every run that is judged; empty where it may be any.
    """

    unit: str
    scale: float
    kind: str
    text: str
    labels: tuple[str, ...] = ()
    cap: float | None = None
    slack: float = 0.0
    least: float | None = None
    most: float | None = None
    most_per: str = ""
    is_whole: bool = False
    of_objects: bool = False
    at_start: str = ""


def scene_signals(object_ids: tuple[str, ...], lanes: int) -> dict[str, SignalType]:
    """List the signals that every run of a scenario has, whatever the architecture.

    Args:
        object_ids: Actors and static objects.
        lanes: Number of lanes.

    Returns:
        Signal types by name.
    """
    number, lane = _number, {"least": -1.0, "most": lanes - 1.0, "is_whole": True}
    signals = {
        "time": _clock(1.0, "time since the start"),
        "ego.x": number("m", 10.0, "place in the map"),
        "ego.y": number("m", 10.0, "place in the map"),
        "ego.heading": number("rad", 0.1, "heading in the map"),
        "ego.speed": number("m/s", 10.0, "speed"),
        "ego.acceleration": number("m/s²", 1.0, "longitudinal acceleration"),
        "ego.steering_angle": number("rad", 0.1, "steering angle at the wheels"),
        "ego.lane": number(
            "1", 1.0, f"lane, 0 at the right to {lanes - 1}; -1 off the lanes", **lane
        ),
        "ego.lane_offset": number("m", 1.0, "distance from the nearest lane's centre, left > 0"),
        "ego.speed_limit": number("m/s", 10.0, "limit of the nearest lane of its way", least=0.0),
        "ego.strip": SignalType("1", 1.0, "enumeration", "what its centre is on", PARTS),
        "ego.wrong_way": _boolean("in a lane of the other way, or against its lane"),
        "ego.on_road": _boolean("centre of the ego on a lane, shoulder, bay, rest area or verge"),
        "ego.in_refuge": _boolean("whole ego in a parking bay or rest area"),
        "ego.at_goal": _boolean("the ego has arrived at its goal in a lane, before the horizon"),
        # A run that begins with a contact is INVALID.
        "contact": _boolean("the ego touches an object", of_objects=True, at_start="false"),
        "standstill": _boolean("the ego stands"),
        "in_odd": _boolean("the run is inside the ODD now"),
    }
    number = partial(_number, of_objects=True)
    for name in object_ids:
        signals |= {
            f"actor.{name}.x": number("m", 10.0, "place in the map"),
            f"actor.{name}.y": number("m", 10.0, "place in the map"),
            f"actor.{name}.heading": number("rad", 0.1, "heading in the map"),
            f"actor.{name}.speed": number("m/s", 10.0, "speed"),
            f"actor.{name}.acceleration": number("m/s²", 1.0, "acceleration along its heading"),
            f"actor.{name}.lane": number("1", 1.0, "lane, -1 off the lanes", **lane),
            f"actor.{name}.distance": number("m", 10.0, "distance between the bodies", least=0.0),
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
    object_monitors: Collection[str] = (),
) -> dict[str, SignalType]:
    """List the signals that the runs of an architecture have, beside those of the scene.

    Args:
        sensors: Sensor ids.
        channels: Channel ids.
        monitors: Monitor ids, ``<channel>.<monitor>`` shortened to ``<monitor>``.
        faults: Fault ids of the ODD.
        object_ids: Actors and static objects.
        object_monitors: Those of the monitors that only objects make fire.

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
            signals[f"channel.{name}.tracks.{actor}"] = _boolean(text, of_objects=True)
    for name in sensors:
        signals |= {
            f"sensor.{name}.alive": _boolean("it delivers"),
            f"sensor.{name}.age": _clock(0.1, "age of its newest sample"),
        }
        for actor in object_ids:
            text = "its newest sample has the actor"
            signals[f"sensor.{name}.detects.{actor}"] = _boolean(text, of_objects=True)
    for name in monitors:
        fires = partial(_boolean, of_objects=name in object_monitors)
        signals[f"monitor.{name}.raw"] = fires("it fires at this tick")
        signals[f"monitor.{name}.confirmed"] = fires("it fires after debounce")
    for name in faults:
        signals[f"fault.{name}.active"] = _boolean("the fault is present")
    signals["faulted"] = _boolean("a fault is present, or was before")
    signals["switch.reason"] = SignalType(
        "1", 1.0, "enumeration", "why the switch decided so", REASON_LABELS
    )
    signals["safe_state"] = _boolean("standstill on the road, clear of every object")
    return signals


def _number(unit: str, scale: float, text: str, **more: Any) -> SignalType:
    return SignalType(unit, scale, "number", text, **more)


def _clock(scale: float, text: str) -> SignalType:
    return _number("s", scale, text, slack=TIME_SLACK, least=0.0, most=1.0, most_per="s")


def _boolean(text: str, *, of_objects: bool = False, at_start: str = "") -> SignalType:
    return SignalType("1", 1.0, "boolean", text, of_objects=of_objects, at_start=at_start)


# --- Numbers of many runs side by side: columns from specs, and records that compiled stages read -

_Spec = TypeVar("_Spec")


def spec_columns(
    specs: Sequence[_Spec], read: Callable[[_Spec], Mapping[str, float]]
) -> dict[str, Floats]:
    """Read numbers from the spec of every run.

    Most runs of a batch share one object, which is read once: a validated spec is slow to read.

    Args:
        specs: (B) spec of each run; at least one.
        read: Gives the numbers of a spec by name, of each the same names.

    Returns:
        (B,) columns by name.
    """
    distinct = {id(spec): spec for spec in specs}
    place = {key: index for index, key in enumerate(distinct)}
    of_run = np.array([place[id(spec)] for spec in specs])
    rows = [read(spec) for spec in distinct.values()]
    return {
        name: np.array([row[name] for row in rows], dtype=np.float64)[of_run] for name in rows[0]
    }


def parameter_record(fields: Mapping[str, Any]) -> NDArray[np.void]:
    """Pack one value or column per field into a structured array of float64, one record a run.

    Args:
        fields: Scalars or (B,) columns by name; at least one is a column.

    Returns:
        (B,) structured array; compiled stages read ``record["name"]``.
    """
    columns = {name: np.asarray(value, dtype=np.float64) for name, value in fields.items()}
    runs = max((column.shape[0] for column in columns.values() if column.ndim), default=1)
    packed = np.zeros(runs, dtype=[(name, np.float64) for name in columns])
    for name, column in columns.items():
        packed[name] = column
    return packed
