"""Faults of the nominal channel in the shipped scenarios: each ends in a safe stop, and when."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from adeye.judge.outcome import on_road
from adeye.judge.timeline import Timeline, timeline
from adeye.signals import EGO_SPEED
from adeye.simulate import engine
from adeye.simulate.channels.perception.pose import MAX_AGE
from adeye.trace import Trace
from tests.motorway import fault
from tests.project import CANDIDATE, CONCEPT, MINI, Project

pytestmark = pytest.mark.slow

STEP: Final = 0.05
ONSET: Final = 2.0
SCENARIOS: Final = {
    "motorway": (
        "cut_in",
        "cut_in_traffic",
        "cut_out_to_stopped",
        "lead_braking",
        "overtaken_behind_slow_lead",
    ),
    "urban": ("pedestrian_crossing", "pedestrian_crossing_night"),
    "parking": ("parking_pedestrian", "parking_post"),
}
"""All that are shipped, by folder."""
SENSORS: Final = ("front_camera", "front_radar", "localisation")
"""Of the nominal channel: the safety channel has the ground truth."""


AT: Final = f"{ONSET} s"
FAULTS: Final = [
    fault("killed", "channels.nominal", "crash", AT),
    *(fault(f"no_{name}", f"sensors.{name}", "drop_out", AT) for name in SENSORS),
    fault("frozen", "hooks.nominal", "planner_frozen", AT),
    fault("no_number", "channels.nominal", "not_a_number", AT),
    fault("too_much", "channels.nominal", "bias", AT, acceleration="20 m/s^2"),
    fault("degrees", "channels.nominal", "scale", AT, steering_angle=57.3),
]
BLINDED: Final = "+".join(f"no_{name}" for name in SENSORS)
ENTRIES: Final = [
    "killed",
    [f"no_{name}" for name in SENSORS],
    "frozen",
    "no_number",
    "too_much",
    "degrees",
]
# Which of these the channel detects when is known from its parameters, whatever happens around.
PREDICTED: Final = ("killed", BLINDED, "no_number", "too_much")
BY_BEHAVIOUR: Final = ("frozen", "degrees")

NOT_STOPPED: Final = {
    # The command that it froze with keeps the lane, and nobody is in the way.
    *(("straight", stop, "pedestrian_crossing", "frozen") for stop in ("in_lane", "planned")),
    # At walking pace the deceleration that an object ahead requires exceeds the threshold of the
    # monitor only when the object is nearer than the ego goes until its brakes act. The monitor of
    # the last safe stop counts that time.
    *(
        (road, "in_lane", name, "frozen")
        for road in ("straight", "curved")
        for name in SCENARIOS["parking"]
    ),
    # It froze while it braked for the vehicle that cuts in, and brakes to standstill itself.
    *(
        (road, stop, "cut_in_traffic", "frozen")
        for road in ("straight", "curved")
        for stop in ("in_lane", "planned")
    ),
}
"""Where the safety channel does not stop it, or not in time: road, stop, scenario, fault."""


@dataclass(frozen=True)
class Run:
    """A run with a fault beside its fault-free twin."""

    trace: Trace
    times: Timeline

    @property
    def is_safe_to_the_end(self) -> bool:
        """Whether it stands at the end, has touched nothing and was on the road throughout."""
        rows = slice(int(self.trace.length[0]))
        places = self.trace["ego_place"][:, rows].astype(np.float64)
        return bool(
            self.times.safe_s is not None
            and self.times.violation_s is None
            and self.trace["ego"][0, rows, EGO_SPEED][-1] == 0.0
            and (self.trace["contact"][0, rows] < 0).all()
            and on_road(self.trace.layout.context.road, places)[0].all()
            and self.trace["authority"][0, rows][-2] == self.trace.layout.channels.index("safety")
        )

    def confirms(self, monitor: str) -> float | None:
        """Time from the onset until a monitor is first confirmed [s]."""
        rows = slice(int(self.trace.length[0]) - 1)
        at = self.trace.layout.monitors.index(monitor)
        found = np.flatnonzero(self.trace["monitors"][0, rows, at, 1])
        return float(self.trace.time[found[0]]) - ONSET if len(found) else None


def project(folder: Path, road: str, stop: str, uses: list[dict[str, Any]]) -> Project:
    """Make a project of shipped scenarios, their roads bent if so asked."""
    odd = {
        **MINI,
        "scenarios": uses,
        "faults": FAULTS,
        "architectures": ["architectures/camera_radar.yaml"],
    }
    made = Project(folder / "project", odd)
    with made.edited(CONCEPT) as concept:
        # Nothing that looks beyond the end of a scenario.
        concept["requirements"] = concept["requirements"][:1]
    for group, names in SCENARIOS.items():
        for name in names:
            with made.edited(f"scenarios_db/{group}/{name}.yaml") as scenario:
                if road == "curved" and "world" in scenario:
                    scenario["world"]["road"].update(kind="curve", radius="900 m")
                if name == "overtaken_behind_slow_lead":
                    # Behind a slow lead a frozen planner is found late; leave the time to stop.
                    scenario["tail"] = "20 s"
    with made.edited(CANDIDATE) as candidate:
        candidate["channels"]["safety"]["parameters"] = {"stop": stop}
    return made


def executed(made: Project) -> dict[tuple[str, str], Run]:
    """Execute every test case by itself, by scenario and fault entry."""
    plan = made.plan()
    traces = {
        (case.scenario_id, case.fault_entry): engine.run([case], base_dirs=plan.folders)
        for case in plan.cases
    }
    return {
        (name, entry): Run(trace, timeline(trace, 0, traces[name, "none"], 0))
        for (name, entry), trace in traces.items()
        if entry != "none"
    }


@pytest.fixture(
    scope="module",
    params=[(road, stop) for road in ("straight", "curved") for stop in ("in_lane", "planned")],
    ids="-".join,
)
def shipped(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, str, dict[tuple[str, str], Run]]:
    """Every shipped scenario with every fault, on a kind of road, with a kind of stop."""
    road, stop = request.param
    uses = [{"use": name, "faults": ENTRIES} for names in SCENARIOS.values() for name in names]
    return road, stop, executed(project(tmp_path_factory.mktemp("stops"), road, stop, uses))


def test_every_fault_of_the_nominal_channel_ends_in_a_safe_stop(shipped: Any) -> None:
    road, stop, runs = shipped
    assert len(runs) == 9 * len(ENTRIES)
    bad = {(road, stop, *what) for what, run in runs.items() if not run.is_safe_to_the_end}
    assert bad == {item for item in NOT_STOPPED if item[:2] == (road, stop)}
    # What is predicted is mastered everywhere.
    assert not {item[3] for item in bad} & set(PREDICTED)


def test_detection_takes_what_the_monitors_parameters_say(shipped: Any) -> None:
    """Times of ``camera_radar.yaml``: a command is stale after 0.2 s, confirmed after 0.1 s.

    A dead channel's last command is of one tick before the fault, less its delay of 0.05 s; the
    link shows it a tick later, and 0.2 s must be exceeded: 0.15 s, and 0.1 s to confirm. What is
    implausible is seen through the link a tick later, and confirmed: 0.15 s. The switch never acts
    on what is no number: 0 s. Blind, the nominal channel loses its place after 0.5 s and says so,
    with its delay.
    """
    _, _, runs = shipped
    for (name, entry), run in runs.items():
        if entry not in PREDICTED:
            continue
        closed = {"killed": 0.25, "no_number": 0.0, "too_much": 0.15, BLINDED: MAX_AGE + STEP}
        assert run.times.fault_s == pytest.approx(ONSET)
        assert run.times.fdti_s == pytest.approx(closed[entry]), (name, entry)
        # Whoever detects it, the safety channel acts at once.
        assert run.times.switch_s == pytest.approx(run.times.detect_s)
        monitors = {
            "killed": ("nominal_silent", 0.25),
            "no_number": ("nominal_implausible", 0.15),
            "too_much": ("nominal_implausible", 0.15),
            BLINDED: ("nominal_silent", MAX_AGE + STEP + 0.15),
        }
        monitor, latency = monitors[entry]
        assert run.confirms(monitor) == pytest.approx(latency), (name, entry)


def test_what_only_behaviour_betrays_is_reported_where_it_is_detected(shipped: Any) -> None:
    _, _, runs = shipped
    for entry in BY_BEHAVIOUR:
        found = [run for (_, fault), run in runs.items() if fault == entry]
        detected = [run for run in found if run.times.detect_s is not None]
        assert len(detected) > len(found) // 2
        for run in detected:
            assert run.times.fdti_s is not None
            assert run.times.fdti_s > 0.15


def test_supervised_architecture_masters_all_of_them_by_its_counters(tmp_path: Path) -> None:
    """Times of ``supervised.yaml``, whose monitors are asked at every tick.

    A silent channel is confirmed at the first evaluation that finds it stale: 0.15 s, as above.
    What is implausible is counted up by 2 from -2 to 4: three evaluations, the first a tick after
    the fault by the link. A frozen plan is the same command for 0.5 s, counted from the one before
    the fault, two ticks later by computing time and link, and three evaluations: 0.65 s.
    """
    names = ("cut_in", "lead_braking", "free_driving", "motorway_bay")
    uses = [{"use": name, "faults": ENTRIES} for name in names]
    made = project(tmp_path, "straight", "in_lane", uses)
    with made.edited(CANDIDATE) as candidate:
        del candidate["channels"]["safety"]["parameters"]
    with made.edited_odd() as odd:
        odd["architectures"] = ["architectures/supervised.yaml"]
        odd["gate"] = {"architectures": ["supervised"]}
    runs = executed(made)
    assert len(runs) == len(names) * len(ENTRIES)
    assert [what for what, run in runs.items() if not run.is_safe_to_the_end] == []
    for (name, entry), run in runs.items():
        closed = {"killed": 0.15, "no_number": 0.0, "too_much": 0.15, "frozen": 0.65}.get(entry)
        if closed is not None:
            assert run.times.fdti_s == pytest.approx(closed), (name, entry)
            assert run.times.switch_s == pytest.approx(run.times.detect_s)


def swept(folder: Path, axes: dict[str, Any], entry: Any, **nominal: str) -> list[Any]:
    """Execute a sweep of a fault in a braking lead; each test case with its times."""
    use = {"use": "lead_braking", "faults": [entry], "sweep": {"parameters": axes}}
    made = project(folder, "straight", "in_lane", [use])
    with made.edited(CANDIDATE) as candidate:
        candidate["channels"]["nominal"].update(nominal)
        candidate["sensors"]["localisation"].update(rate="10 Hz", latency="0.1 s")
    plan = made.plan()
    faulty = [case for case in plan.cases if case.faults]
    sound = {case.situation_digest: case for case in plan.cases if not case.faults}
    trace = engine.run(faulty, base_dirs=plan.folders)
    # The twin has the same architecture, and no fault.
    twins = [replace(case, faults=(), fault_entry="none") for case in faulty]
    assert {case.situation_digest for case in faulty} == set(sound)
    other = engine.run(twins, base_dirs=plan.folders)
    return [(case, timeline(trace, run, other, run)) for run, case in enumerate(faulty)]


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_time_to_detect_silence_follows_staleness_delay_and_debounce(
    delay: int, tmp_path: Path
) -> None:
    """The monitor or the switch, whichever is first.

    The newest command is one tick and the delay old at the fault. The switch needs an age above its
    staleness, the monitor one above its own, of what the link shows, which is a tick older; then
    the monitor is debounced.
    """
    axes = {
        "architecture.channels.safety.parameters.staleness": ["0.3 s", "0.5 s"],
        "architecture.channels.safety.parameters.confirm": ["0 s", "0.12 s", "0.3 s"],
        "architecture.switch.staleness": ["0.4 s", "5 s"],
        "faults.killed.onset.at": ["1.5 s", "2.03 s"],
    }
    found = swept(tmp_path, axes, "killed", delay=f"{50 * delay} ms")
    assert len(found) == 24
    for case, times in found:
        safety = case.architecture.channels["safety"].parameters
        stale = round(safety.staleness / STEP) - delay
        confirm = math.ceil(safety.confirm / STEP - 1e-9)
        switch = round(case.architecture.switch.staleness / STEP) - delay
        assert times.fault_s == pytest.approx(
            math.ceil(case.faults[0].onset.at / STEP - 1e-9) * STEP
        )
        assert round(times.fdti_s / STEP) == min(stale + confirm, switch), case.point
        assert times.switch_s == pytest.approx(times.detect_s)


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0, 2])
def test_time_to_detect_a_wrong_command_is_the_links_tick_and_the_debounce(
    delay: int, tmp_path: Path
) -> None:
    """What is wrong with a command is wrong from the fault on, whatever the channel's delay."""
    axes = {
        "architecture.channels.safety.parameters.confirm": ["0 s", "0.1 s", "0.25 s", "0.31 s"],
        "faults.too_much.onset.at": ["1.5 s", "2 s"],
    }
    for case, times in swept(tmp_path, axes, "too_much", delay=f"{50 * delay} ms"):
        confirm = case.architecture.channels["safety"].parameters.confirm
        assert round(times.fdti_s / STEP) == 1 + math.ceil(confirm / STEP - 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0, 2])
def test_time_to_detect_blindness_follows_the_sensors_period_and_latency(
    delay: int, tmp_path: Path
) -> None:
    """The last sample was taken a latency and up to a period before the fault, at 10 Hz and 0.1 s.

    The nominal channel is in fault once that is older than 0.5 s, and says so after its delay; the
    switch acts on it at once. An age of 0.5 s may round to one above it: then it is a tick earlier.
    """
    onsets = [round(1.5 + STEP * n, 2) for n in range(7)]
    axes = {"faults.no_localisation.onset.at": [f"{onset} s" for onset in onsets]}
    entry = [f"no_{name}" for name in SENSORS]
    axes |= {f"faults.no_{name}.onset.at": ["1 s"] for name in SENSORS[:2]}
    for case, times in swept(tmp_path, axes, entry, delay=f"{50 * delay} ms"):
        onset = round(case.point["faults.no_localisation.onset.at"] / STEP)
        # Delivered two ticks after it was taken, every second tick, and not at the fault any more.
        newest = (onset - 1 - 2) // 2 * 2
        lost = newest + round(MAX_AGE / STEP) + 1 + delay
        assert round(times.detect_s / STEP) - lost in {-1, 0}, case.point
