"""A second implementation of what metrics say of a run on a straight road, row by row.

From the guide and the sources of the metrics, with the second forms of this folder; nothing of the
product is used. A row gives, for each quantity, the values of all objects that it applies to; an
empty list is a row without conflict, None one that says nothing.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from tests.second import evading, following, plane, rules

Put = Callable[[str, float], None]

INF = math.inf
G = 9.80665
STEP = 0.1
HORIZON = 10.0
NEAR = 1.0
WIDER = 5e-6
LARGEST = 100.0
LATEST = -10.0
EGO_LENGTH, EGO_WIDTH = 4.0, 2.0
MOST_BRAKING, MOST_ACCELERATION = 9.0, 3.0

# Starting values of ad-rss.
RHO, OTHER_RHO, A_MAX, B_MIN, B_MAX, B_CORRECT, A_LAT, B_LAT, MU = (
    1.0, 2.0, 3.5, 4.0, 8.0, 3.0, 0.2, 0.8, 0.1,
)  # fmt: skip


class Body(NamedTuple):
    s: float
    d: float
    heading: float
    speed: float
    acceleration: float
    length: float
    width: float

    @property
    def along(self) -> float:
        return self.speed * math.cos(self.heading)

    @property
    def across(self) -> float:
        return self.speed * math.sin(self.heading)

    @property
    def half_length(self) -> float:
        return max(x - self.s for x, _ in self.box().corners())

    @property
    def half_width(self) -> float:
        return max(y - self.d for _, y in self.box().corners())

    def box(self) -> plane.Box:
        return plane.Box(self.s, self.d, self.heading, self.length, self.width)


Row = dict[str, list[float] | None]

LARGER = {"drac", "required", "mdrac", "dst", "stn", "follower"}
"""Quantities that are worse when larger."""


def road_gap(own: Body, other: Body) -> float:
    return max(0.0, abs(other.s - own.s) - own.half_length - other.half_length)


def overlap_times(own: Body, other: Body) -> tuple[float, float]:
    """When the other takes up the corridor, that is as wide as the ego: from and to."""
    beside, reach = other.d - own.d, 0.5 * own.width + other.half_width
    if other.across == 0.0:
        return (-INF, INF) if abs(beside) < reach else (INF, -INF)
    ends = sorted((side * reach - beside) / other.across for side in (-1.0, 1.0))
    return ends[0], ends[1]


def is_in_path(own: Body, other: Body) -> bool:
    """Ahead, and in the corridor or crossing it while both are side by side along the road."""
    if not other.s > own.s:
        return False
    if abs(other.d - own.d) < 0.5 * own.width + other.half_width:
        return True
    gap, closing = road_gap(own, other), own.along - other.along
    if abs(other.across) <= abs(other.along) or gap <= 0.0 or closing <= 0.0:
        return False
    first = gap / closing
    last = first + 2.0 * (own.half_length + other.half_length) / closing
    enter, leave = overlap_times(own, other)
    return enter <= last and leave >= first


def limited(demand: float) -> float:
    return demand if demand == INF else min(demand, LARGEST)


def measure(own: Body, others: list[Body], touched: int, friction: float) -> Row:
    """Measure one row."""
    row: Row = {name: [] for name in NAMES}

    def put(name: str, value: float) -> None:
        values = row[name]
        if values is not None:
            values.append(value)

    for other in others:
        put("distance", plane.distance(own.box(), other.box()))
        planar(own, other, friction, put)
        if other.s > own.s:
            rss(own, other, put)
        if is_in_path(own, other):
            gap = road_gap(own, other) or plane.distance(own.box(), other.box())
            in_path(own, other, gap, put)
            if touched < 0:
                follow(own, other, gap, put)
                evade(own, other, gap, friction, put)
        behind(own, other, put)
    if touched >= 0:
        row.update({name: [0.0] for name in ("distance", "ttc", *PLANAR, "mttc", "ettc")})
        row.update(dict.fromkeys(("mdrac", "dst", "mtc", "stn", *EVASIVE, "rear", "follower")))
        for name in ("drac", "required"):
            if INF in (row[name] or []):
                row[name] = None
    return row


PLANAR = ("planar_ttc", "wttc", "wttc_wide", "dce", "ttce")
EVASIVE = ("ttb", "tts", "ttk", "ttr")
NAMES = (
    "distance", *PLANAR, "margin", "gap", "ttc", "headway", "drac", "required", "mttc", "ettc",
    "mdrac", "dst", "mtc", *EVASIVE, "stn", "rear", "follower",
)  # fmt: skip


def planar(own: Body, other: Body, friction: float, put: Put) -> None:
    d = (other.s - own.s, other.d - own.d)
    rate = (other.along - own.along, other.across - own.across)
    put("planar_ttc", plane.ttc(own.box(), other.box(), rate))
    reach = 0.5 * (math.hypot(own.length, own.width) + math.hypot(other.length, other.width))
    put("wttc", plane.worst_ttc(d, rate, reach, 2.0 * friction * G))
    # The product's circles are wider than the bodies need by a few millionths of a metre.
    put("wttc_wide", plane.worst_ttc(d, rate, reach + WIDER, 2.0 * friction * G))
    time, apart = plane.closest(own.box(), other.box(), rate)
    if time > HORIZON:
        time, apart = 0.0, plane.distance(own.box(), other.box())
    put("dce", apart)
    if apart <= NEAR:
        put("ttce", time)


def rss(own: Body, other: Body, put: Put) -> None:
    """The gap beyond the safe one, if it is not safe beside the ego."""
    side = 1.0 if other.d >= own.d else -1.0
    lateral = rules.rss_lateral(
        side * own.across, side * other.across, RHO, OTHER_RHO, A_LAT, B_LAT, MU
    )
    if abs(other.d - own.d) - own.half_width - other.half_width >= lateral:
        return
    if other.along < 0.0:
        safe = rules.rss_opposite(own.along, other.along, RHO, A_MAX, B_CORRECT, B_MIN)
    else:
        safe = rules.rss_same(own.along, other.along, RHO, A_MAX, B_MIN, B_MAX)
    put("margin", road_gap(own, other) - safe)


def in_path(own: Body, other: Body, gap: float, put: Put) -> None:
    speed, lead = own.along, other.along
    put("gap", gap)
    if speed > lead:
        put("ttc", following.ttc(gap, speed - lead))
    put("headway", following.headway(gap, 2.0 * other.half_length, speed))
    drac = limited(following.drac(gap, speed - lead))
    put("drac", drac)
    slowing = other.acceleration * math.cos(other.heading)
    needed = following.required(gap, speed, lead, slowing) if lead >= 0.0 else drac
    put("required", limited(needed))


def follow(own: Body, other: Body, gap: float, put: Put) -> None:
    speed, lead = own.along, other.along
    a_own = own.acceleration * math.cos(own.heading)
    a_other = other.acceleration * math.cos(other.heading)
    put("mttc", following.mttc(gap, speed, lead, a_own, a_other))
    put("ettc", following.ettc(gap, speed - lead, a_own - a_other))
    put("mdrac", min(LARGEST, following.mdrac(gap, speed - lead, 1.0)))
    put("dst", limited(following.dst(gap, speed - lead, max(lead, 0.0), 1.0)))
    put("mtc", following.mtc(gap, speed, lead, 0.7 * G))


def evade(own: Body, other: Body, gap: float, friction: float, put: Put) -> None:
    """Manoeuvres against who takes up the corridor while the ego gets past."""
    closing = own.along - other.along
    enter, leave = overlap_times(own, other)
    arrival = following.ttc(gap, closing)
    way = 2.0 * (own.half_length + other.half_length)
    if closing <= 0.0 or leave < arrival or enter > (gap + way) / closing:
        put("stn", 0.0)
        return
    grip = friction * G
    offset = evading.evasive_offset(
        other.d - own.d + other.across * arrival,
        other.across * way / closing,
        0.5 * own.width + other.half_width,
    )
    brake = evading.time_to_brake(gap, closing, own.along, leave, min(MOST_BRAKING, grip))
    steer = evading.time_to_steer(arrival, offset, grip)
    kick = evading.time_to_kickdown(gap, closing, way, enter, min(MOST_ACCELERATION, grip))
    best = evading.time_to_react(brake, steer, kick)
    for name, time in zip(EVASIVE, (brake, steer, kick, best), strict=True):
        put(name, max(time, LATEST))
    put("stn", min(LARGEST, evading.steer_threat(arrival, offset, grip)))


def behind(own: Body, other: Body, put: Put) -> None:
    """Who follows: behind the ego, within its extent across the road, and driving the same way."""
    gap = own.s - other.s - own.half_length - other.half_length
    apart = abs(other.d - own.d) - own.half_width - other.half_width
    if gap <= 0.0 or apart >= 0.0 or other.along <= 0.0:
        return
    put("rear", following.ttc(gap, other.along - own.along))
    slowing = own.acceleration * math.cos(own.heading)
    put("follower", limited(following.required(gap, other.along, max(own.along, 0.0), slowing)))


# --- a whole run ----------------------------------------------------------------------------------


class Found(NamedTuple):
    """Value and status of a metric."""

    value: float
    status: str


def fold(name: str, rows: list[Row]) -> Found:
    """The worst of all rows; without any value, free if any row was without conflict."""
    values = [value for row in rows for value in row[name] or [] if abs(value) < INF]
    if values:
        return Found(max(values) if name in LARGER else min(values), "value")
    is_free = any(row[name] is not None for row in rows)
    return Found(math.nan, "no_conflict" if is_free else "undefined")


def least(values: list[float] | None) -> float:
    return min(values or [INF])


def run_metrics(
    rows: list[Row], egos: list[Body], touched: list[int], friction: float
) -> dict[str, Found]:
    """Give the metrics of a run, from its rows."""
    found = {column: fold(name, rows) for column, name in COLUMNS.items()}
    if any(INF in (row["dst"] or []) for row in rows):
        found["max_dst_mps2"] = Found(math.nan, "undefined")
    found["max_btn"] = found["max_required_deceleration_mps2"]._replace(
        value=found["max_required_deceleration_mps2"].value / min(MOST_BRAKING, friction * G)
    )
    count = len(rows)
    short = [3.0 - least(row["ttc"]) for row in rows if least(row["ttc"]) <= 3.0]
    found["tet_s"] = Found(STEP * len(short), "value")
    found["tit_s2"] = Found(STEP * math.fsum(short), "value")
    found["tet_share"] = Found(len(short) / count, "value")
    found["tit_mean_s"] = Found(math.fsum(short) / count, "value")
    demands = [INF if row["drac"] is None else max(row["drac"], default=0.0) for row in rows]
    chances = [
        rules.crash_probability(demand / friction, 8.45, 1.40, 4.23, 12.68) for demand in demands
    ]
    found["crash_potential"] = Found(math.fsum(chances) / count, "value")
    unsafe = [least(row["margin"]) < 0.0 for row in rows]
    found["rss_violation_s"] = Found(STEP * sum(unsafe), "value")
    found["min_time_gap_s"] = over_gap(
        rows, lambda row, ego: following.time_gap(row, ego.along), egos
    )
    able = min(MOST_BRAKING, friction * G)
    before = [k for k in range(count) if touched[k] < 0]
    found["min_psd"] = over_gap(
        [rows[k] for k in before],
        lambda gap, ego: following.psd(gap, ego.speed, able),
        [egos[k] for k in before],
    )
    found["time_to_accident_s"] = accident(rows, egos)
    return found


def over_gap(rows: list[Row], form: Callable[[float, Body], float], egos: list[Body]) -> Found:
    """Least of what follows from the gap to the nearest in the path."""
    if not rows:
        return Found(math.nan, "undefined")
    values = [
        form(least(row["gap"]), ego) if row["gap"] else INF
        for row, ego in zip(rows, egos, strict=True)
    ]
    worst = min(values)
    return Found(worst, "value") if worst < INF else Found(math.nan, "no_conflict")


def accident(rows: list[Row], egos: list[Body]) -> Found:
    """TTC when the ego first brakes with more than 2 m/s²; it does not swerve here."""
    for row, ego in zip(rows, egos, strict=True):
        if ego.acceleration < -2.0:
            time = least(row["ttc"])
            return Found(time, "value") if time < INF else Found(math.nan, "no_conflict")
    return Found(math.nan, "not_applicable")


COLUMNS = {
    "min_distance_m": "distance",
    "min_ttc_2d_s": "planar_ttc",
    "min_wttc_s": "wttc",
    "wide": "wttc_wide",
    "min_dce_m": "dce",
    "min_ttce_s": "ttce",
    "min_ttc_s": "ttc",
    "min_time_headway_s": "headway",
    "max_drac_mps2": "drac",
    "max_required_deceleration_mps2": "required",
    "min_mttc_s": "mttc",
    "min_ettc_s": "ettc",
    "max_mdrac_mps2": "mdrac",
    "max_dst_mps2": "dst",
    "min_mtc": "mtc",
    "max_stn": "stn",
    "min_ttb_s": "ttb",
    "min_tts_s": "tts",
    "min_ttk_s": "ttk",
    "min_ttr_s": "ttr",
    "min_rear_ttc_s": "rear",
    "max_follower_deceleration_mps2": "follower",
}
