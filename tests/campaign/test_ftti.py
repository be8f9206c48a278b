"""The measured FTTI against kinematics in closed form, and mechanisms that are just quick enough.

The ego drives by a script that is known in closed form. The fault takes the script away: what it
commanded last stands, so with the mechanism off the ego goes on as an equation of motion says until
it touches something or leaves the road. Times are read from executed campaigns.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from adeye.campaign.studies.fault_timing import campaign_injections
from adeye.campaign.summary import CampaignSummary
from adeye.judge.timeline import Injection
from tests.project import CANDIDATE, CONCEPT, MINI, Project
from tests.stored import stored

STEP = 0.05
FULL = 8.0
ONSET = 2.0
WHEELBASE, LENGTH = 2.9, 4.9

SCRIPT: str = stored("plugins")["script"]

TOWARDS: dict[str, Any] = stored("towards")
SILENT = {"id": "lost", "target": "channels.nominal", "model": "silent", "onset": {"at": "2 s"}}


def wrong(**commanded: str) -> dict[str, Any]:
    """A fault that takes the script away and commands something plausible."""
    fault = {"id": "wrong", "target": "channels.nominal", "model": "plausible_but_wrong"}
    return {**fault, **commanded, "onset": {"at": f"{ONSET} s"}}


def sizes_of(speed: float, gap: float, driven: float | None = None) -> dict[str, Any]:
    """Axes of one situation; by default the ego drives at its speed until the fault."""
    way = speed * ONSET if driven is None else driven
    return {"speed": [f"{speed} m/s"], "gap": [f"{gap} m"], "driven": [f"{way} m"]}


def brakes_at(time: float) -> dict[str, float]:
    """A script that brakes fully, so long after the onset of the fault."""
    return {"changes_at": ONSET + time, "then_acceleration": -FULL}


class Measured:
    """A campaign of the script with a fault, and what was measured."""

    def __init__(  # noqa: PLR0913 - what a test may say
        self,
        folder: Path,
        script: dict[str, float],
        parameters: dict[str, Any],
        *,
        fault: dict[str, Any] | None = None,
        vehicle: dict[str, str] | None = None,
        safety: dict[str, Any] | None = None,
        road: dict[str, Any] | None = None,
        requirements: tuple[dict[str, Any], ...] = (),
    ) -> None:
        """Execute the campaign.

        Args:
            folder: Where to.
            script: Parameters of the script.
            parameters: Axes of the sweep.
            fault: By default the channel falls silent at 2 s, and its last command stands.
            vehicle: Other data of the vehicle than without lags.
            safety: Parameters of the safety channel.
            road: Other data of the road.
            requirements: In place of those of the concept.
        """
        use = {
            "use": "towards",
            "faults": [(fault or SILENT)["id"]],
            "sweep": {"parameters": parameters},
        }
        odd = {
            **MINI,
            "scenarios": [use],
            "faults": [fault or SILENT],
            "architectures": ["architectures/camera_radar.yaml"],
        }
        project = Project(folder / "project", odd)
        world = {"road": {**TOWARDS["world"]["road"], **(road or {})}}
        project.write("scenarios_db/towards.yaml", {**TOWARDS, "world": world})
        (folder / "project/odd/architectures/script.py").write_text(SCRIPT, "utf-8")
        with project.edited(CANDIDATE) as candidate:
            lags = {"acceleration_lag": "0 s", "steering_lag": "0 s"}
            candidate["beyond_plausible"] = ["steering_rate", "acceleration", "delay"]
            candidate["vehicle"].update({**lags, "max_steering_rate": "1000 rad/s"})
            candidate["vehicle"].update(vehicle or {})
            candidate["channels"]["nominal"].update(
                kind="./script.py:Script", links=["localisation"], delay="0 s", parameters=script
            )
            candidate["channels"]["safety"]["parameters"] = {
                # Nothing but the silence of the nominal channel is to be detected.
                "danger_threshold": "1000 m/s^2",
                "max_lane_offset": "100 m",
                "stop_deceleration": "8 m/s^2",
                **(safety or {}),
            }
            # A command that is lost stands as long as nobody takes over.
            candidate["switch"]["staleness"] = "1000 s"
        with project.edited(CONCEPT) as concept:
            kept = [item for item in concept["requirements"] if item["id"] == "FSR-01"]
            like = {name: value for name, value in kept[0].items() if name != "on_contact"}
            concept["requirements"] = [*kept, *({**like, **item} for item in requirements)]
        self.project = project
        self.summary: CampaignSummary = project.run()
        found = campaign_injections(project.db).injections
        points = {row["run"]: row["point"] for row in project.rows()}
        self.injections = sorted(found, key=lambda item: sorted(points[item.run].items()))

    @property
    def one(self) -> Injection:
        """The only one."""
        (found,) = self.injections
        return found


def assert_measures(injection: Injection, closed_form: float) -> None:
    """The violation shows at the first tick at which the closed form has it."""
    assert injection.times.fault_s == pytest.approx(ONSET)
    assert injection.fault_free_violation_s is None
    assert injection.ftti_s is not None
    late = injection.ftti_s - closed_form
    assert -1e-6 <= late < STEP + 1e-6


def root(of: Callable[[float], float], high: float) -> float:
    """Find where an increasing function becomes zero, from 0 on."""
    low = 0.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if of(middle) < 0.0 else (low, middle)
    return low


def lagged(time: float, lag: float) -> float:
    """Double integral of a first-order response to a step of one: t²/2 - τt + τ²(1 - e^(-t/τ))."""
    return 0.5 * time**2 - lag * time + lag**2 * (1.0 - math.exp(-time / lag))


@pytest.mark.slow
@pytest.mark.parametrize(("speed", "gap"), [(20.0, 61.0), (33.3, 100.0), (5.0, 7.3)])
def test_without_commands_the_speed_is_constant(speed: float, gap: float, tmp_path: Path) -> None:
    """Acceleration stuck at 0 towards a standing vehicle: FTTI = d / v.

    Without the fault the script brakes with 8 m/s² at the last tick at which that is enough.
    """
    reserve = (gap - speed**2 / (2.0 * FULL)) / speed
    found = Measured(tmp_path, brakes_at(reserve - 2 * STEP), sizes_of(speed, gap)).one
    assert_measures(found, gap / speed)


@pytest.mark.slow
@pytest.mark.parametrize(("speed", "gap"), [(20.0, 90.0), (12.0, 35.0)])
def test_weak_brakes_meet_a_standing_vehicle(speed: float, gap: float, tmp_path: Path) -> None:
    """Acceleration stuck at -b: d = vt - bt²/2, so FTTI = (v - sqrt(v² - 2bd)) / b.

    Without the fault the script brakes with 8 m/s² at the last tick at which that is enough.
    """
    weak = 1.0
    fault = wrong(acceleration=f"{-weak} m/s^2")
    script = brakes_at((gap - speed**2 / (2.0 * FULL)) / speed - STEP)
    found = Measured(tmp_path, script, sizes_of(speed, gap), fault=fault).one
    assert_measures(found, (speed - math.sqrt(speed**2 - 2.0 * weak * gap)) / weak)


@pytest.mark.slow
@pytest.mark.parametrize("lag", [0.15, 0.6])
def test_acceleration_builds_up_with_the_lag_of_the_drive(lag: float, tmp_path: Path) -> None:
    """Acceleration stuck at a with a first-order lag: d = vt + a(t²/2 - τt + τ²(1 - e^(-t/τ)))."""
    speed, gap, surge = 10.0, 40.0, 2.5
    fault, vehicle = wrong(acceleration=f"{surge} m/s^2"), {"acceleration_lag": f"{lag} s"}
    sizes = sizes_of(speed, gap)
    found = Measured(tmp_path, brakes_at(1.0), sizes, fault=fault, vehicle=vehicle)
    closed = root(lambda time: speed * time + surge * lagged(time, lag) - gap, 10.0)
    assert_measures(found.one, closed)


@pytest.mark.slow
def test_lost_brakes_meet_a_lead_that_brakes(tmp_path: Path) -> None:
    """Brakes lost while a lead brakes with b: the difference of two parabolas is bt²/2.

    Both brake with b = 2 m/s² from 1 s on, the ego behind at the same speed. From the fault on the
    ego keeps its speed u; until the lead stands, after u / b, the gap shrinks by bt²/2. So
    FTTI = sqrt(2g / b) if that is less than u / b. No mechanism brakes without brakes.
    """
    speed, brake, gap = 24.0, 2.0, 30.0
    script = {"changes_at": 1.0, "then_acceleration": -brake}
    fault = {
        "id": "brakes",
        "target": "actuators.brake",
        "model": "loss",
        "share": 1.0,
        "onset": {"at": f"{ONSET} s"},
    }
    lead = {"lead_speed": [f"{speed} m/s"], "brakes_at": ["1 s"]}
    sizes = {**sizes_of(speed, gap, driven=0.0), **lead}
    found = Measured(tmp_path, script, sizes, fault=fault).one
    assert math.sqrt(2.0 * gap / brake) < (speed - brake) / brake
    assert_measures(found, math.sqrt(2.0 * gap / brake))
    assert found.class_ == "undetected_violation"


@pytest.mark.slow
def test_straight_on_in_a_curve_leaves_the_road_along_the_tangent(tmp_path: Path) -> None:
    """Steering stuck at 0 in a curve: the ego leaves its circle along the tangent.

    Until the fault the rear axle drives a circle of radius R = wheelbase / tan(δ), from where it is
    at the start, half a wheelbase behind the centre of the box, heading along the road. From the
    fault on the centre moves on straight at v. It leaves the road where its distance from the
    centre of the road's curve is the radius of the right edge plus the shoulder: a quadratic.
    Wheels that turn evenly for a time T lag by T / 2.
    """
    speed, radius, place, turning = 20.0, 400.0, 1.5 * 3.5, 2 * STEP
    start, half = radius - place, 0.5 * WHEELBASE
    angle = math.atan(WHEELBASE / start)
    fault = wrong(acceleration="0 m/s^2", steering_angle="0 rad")
    sizes = {"speed": [f"{speed} m/s"], "gap": ["500 m"]}
    road = {"kind": "curve", "radius": f"{radius} m", "length": "900 m"}
    vehicle = {"max_steering_rate": f"{angle / turning} rad/s"}
    script = {"steering_angle": angle}
    found = Measured(tmp_path, script, sizes, fault=fault, road=road, vehicle=vehicle).one
    # The centre of the road's curve is the origin, the start at (0, -start) heading along x.
    turned = speed * ONSET / start
    x = 0.5 * speed * turning - half + start * math.sin(turned) + half * math.cos(turned)
    y = -start + start * (1.0 - math.cos(turned)) + half * math.sin(turned)
    along = x * math.cos(turned) + y * math.sin(turned)
    beyond = (radius + 3.0) ** 2 - x * x - y * y
    straight = (-along + math.sqrt(along * along + beyond)) / speed
    assert_measures(found, 0.5 * turning + straight)


@pytest.mark.slow
@pytest.mark.parametrize("lag", [0.0, 0.4])
def test_wheels_that_stay_turned_leave_a_straight_road(lag: float, tmp_path: Path) -> None:
    """Steering stuck at δ on a straight road: a circle, or with lag y'' = κv²(1 - e^(-t/τ)).

    Without lag the rear axle drives a circle of radius R, and the box centre, half a wheelbase l
    ahead of it, is at y = R(1 - cos ψ) + l sin ψ with ψ = v(t - T / 2) / R, where T is the time in
    which the wheels turn; meanwhile it drives κv²T²/24 farther aside than a circle that begins at
    T / 2. With a first-order lag of the steering the angles are small: y = κv²(t²/2 - τt + …) and
    l times the heading, which is y' / v.
    """
    speed, angle, turning = 20.0, 0.004, 2 * STEP
    half, radius = 0.5 * WHEELBASE, WHEELBASE / math.tan(angle)

    def aside(time: float) -> float:
        if lag == 0.0:
            turned = speed * (time - 0.5 * turning) / radius
            before = (speed * turning) ** 2 / radius / 24.0
            return before + radius * (1.0 - math.cos(turned)) + half * math.sin(turned)
        heading = speed / radius * (time - lag * (1.0 - math.exp(-time / lag)))
        return speed**2 / radius * lagged(time, lag) + half * heading

    fault = wrong(acceleration="0 m/s^2", steering_angle=f"{angle} rad")
    sizes = {"speed": [f"{speed} m/s"], "gap": ["2000 m"]}
    vehicle = {"steering_lag": f"{lag} s"}
    if lag == 0.0:
        vehicle["max_steering_rate"] = f"{angle / turning} rad/s"
    found = Measured(tmp_path, {}, sizes, fault=fault, vehicle=vehicle).one
    assert_measures(found, root(lambda time: aside(time) - 1.5 * 3.5, 10.0))


def delayed(handovers: range) -> dict[str, Any]:
    """Sweep the handover, in ticks."""
    return {"architecture.switch.handover": [f"{50 * n} ms" for n in handovers]}


@pytest.mark.slow
def test_mechanism_is_in_time_up_to_one_tick_before_the_ftti(tmp_path: Path) -> None:
    """Delayed tick by tick, a mechanism is in time while FHTI < FTTI, and flagged from then on.

    Acceleration stuck at -b from v on, at a distance that leaves a speed of c at the contact: so
    slow that full braking one tick before it is still enough. FTTI = (v - c) / b, to the next tick.
    FHTI is the time after which a command is stale, the confirm time, and the handover, which is
    swept; without delay of the channel the link's tick is in the staleness time.
    """
    speed, weak, crawl = 2.0, 1.0, 0.3
    gap = (speed**2 - crawl**2) / (2.0 * weak)
    ticks = math.ceil((speed - crawl) / weak / STEP - 1e-9)
    detects = round(0.2 / STEP) + round(0.1 / STEP)
    handovers = range(ticks - detects + 3)
    driven = (speed + 0.5 * weak * ONSET) * ONSET
    sizes = {**sizes_of(speed + weak * ONSET, gap, driven), **delayed(handovers)}
    limit = f"{round((ticks - 1) * STEP, 3)} s"
    acts = f"eventually[0 s, {limit}](authority.safety)"
    fhti = {
        "id": "FSR-FHTI",
        "text": "The safety channel acts before the FTTI is over.",
        "formula": f"always(rise(fault.lost.active) implies {acts})",
        "threshold_source": "FTTI in closed form, less one tick.",
    }
    script = {"acceleration": -weak, **brakes_at(0.5)}
    found = Measured(tmp_path, script, sizes, requirements=(fhti,))
    rows = {row["run"]: row for row in found.project.rows()}
    classes, verdicts, handled = {}, {}, {}
    for item in found.injections:
        row = rows[item.run]
        at = round(row["point"]["architecture.switch.handover"] / STEP)
        assert item.ftti_s == pytest.approx(ticks * STEP)
        assert item.times.fdti_s == pytest.approx(detects * STEP)
        classes[at], handled[at] = item.class_, item.times.fhti_s
        verdicts[at] = {name: row["verdicts"][name] for name in ("FSR-01", "FSR-FHTI")}
    last = ticks - 1 - detects
    for at in handovers:
        is_in_time = at <= last
        assert classes[at] == ("detected_in_time" if is_in_time else "detected_late"), at
        assert set(verdicts[at].values()) == {"PASS" if is_in_time else "FAIL"}, at
    assert handled[last] == pytest.approx((ticks - 1) * STEP)


@pytest.mark.slow
def test_fast_ego_must_be_stopped_its_braking_distance_earlier(tmp_path: Path) -> None:
    """Handled within the FTTI and yet too late: v·FHTI + v² / 2B must fit into the distance.

    Commands lost at v towards a standing vehicle: FTTI = d / v. A mechanism that takes over between
    the last tick at which full braking B is enough and the FTTI has FHTI < FTTI, and the run
    touches the vehicle all the same: that is late, too.
    """
    speed, gap = 20.0, 61.5
    detects = round(0.2 / STEP) + round(0.1 / STEP)
    last = math.floor((gap - speed**2 / (2.0 * FULL)) / speed / STEP) - detects
    handovers = range(last - 3, last + 5)
    found = Measured(tmp_path, brakes_at(0.5), {**sizes_of(speed, gap), **delayed(handovers)})
    points = {row["run"]: row["point"] for row in found.project.rows()}
    for item in found.injections:
        at = round(points[item.run]["architecture.switch.handover"] / STEP)
        assert item.times.fhti_s == pytest.approx((detects + at) * STEP)
        assert item.margin_s is not None
        assert item.margin_s > 0.0
        assert item.class_ == ("detected_in_time" if at <= last else "detected_late"), at


@pytest.mark.slow
def test_ftti_of_a_situation_is_not_the_faults_doing(tmp_path: Path) -> None:
    """Of the twin without fault and without mechanism: the mechanism alone saves the other one.

    The script never brakes, and the safety channel stops the ego for the vehicle ahead, with the
    fault and without. Then the FTTI is that of the situation, and the injection says so.
    """
    speed, gap = 20.0, 90.0
    safety = {"danger_threshold": "3 m/s^2"}
    found = Measured(tmp_path, {}, sizes_of(speed, gap), safety=safety).one
    assert found.times.violation_s is None
    assert found.ftti_s is not None
    assert 0.0 <= found.ftti_s - gap / speed < STEP + 1e-6
    assert found.fault_free_violation_s == pytest.approx(ONSET + found.ftti_s)
