"""A report as a campaign would give it: three architectures, three scenarios, seven FSRs."""

import math
from dataclasses import replace
from functools import cache
from typing import Any

from adeye.analysis.dependence import ChannelPair, Dependencies, Shared
from adeye.analysis.suite.analyse import analyse
from adeye.analysis.suite.records import Suite
from adeye.judge.verdict import ExitCode, Outcome, Verdict, fold_runs
from adeye.report.model.concept import (
    Assumption,
    Decomposition,
    DependentFailure,
    Element,
    Hazard,
    IntegrityFinding,
    Realisation,
    SafetyGoal,
    Waiver,
)
from adeye.report.model.part import Binding, Command, Label, Margin, Place, RunVerdict
from adeye.report.model.report import (
    Architecture,
    Cell,
    DeadAxis,
    Extreme,
    Factors,
    Fsr,
    MetricSummary,
    Report,
    Scenario,
    WorstCase,
)
from adeye.report.page.replay import (
    ActorMotion,
    Candidate,
    ChannelView,
    EgoMotion,
    Event,
    FanView,
    FaultView,
    GridView,
    Line,
    Replay,
    RoadGeometry,
    SensorView,
    SignalPlot,
    StaticBox,
    ThresholdLine,
    Track,
)
from adeye.report.verification import open_points_of, verification_of
from adeye.spec.load import load_architecture, shipped
from tests.report.fake_assessment import assessment, impact
from tests.report.fake_evidence import coverage, some_claims, step
from tests.report.fake_faults import evidence

STEP = 0.05
SCENARIOS = ("cut_in", "cut_out_to_stopped", "lead_braking")
ARCHITECTURES = ("camera_radar", "legacy_camera", "lidar")
DIFFERENCES = {"m/s²": 1.0, "s": 1.0, "m": 1.0, "1": 1.0}

FSRS: tuple[tuple[str, str, str, Any, str, str], ...] = (
    ("FSR-01", "The vehicle shall not touch any other road user or object.", "always(not contact)",
     "D", "1", "contact"),
    ("FSR-02", "The deceleration required to stay clear of the vehicle ahead stays at or below "
     "6 m/s².", "max_required_deceleration_mps2 <= 6.0", "D", "m/s²", "required_deceleration"),
    ("FSR-03", "When the nominal channel falls silent, the safety channel shall act within 0.5 s.",
     "always(channel.nominal.status == silent implies eventually[0 s, 0.5 s](authority.safety))",
     "D", "1", "authority.safety"),
    ("FSR-04", "After it has taken over, the safety channel shall bring the vehicle to a safe "
     "stop.", "always(rise(authority.safety) implies eventually[0 s, 13 s](safe_state))", "D", "1",
     "safe_state"),
    ("FSR-05", "A safe stop without an object ahead in danger shall brake with no more than "
     "4.5 m/s².", "always((authority.safety and not monitor.object_danger.raw) implies "
     "ego.acceleration >= -4.5 m/s^2)", "C", "m/s²", "ego.acceleration"),
    ("FSR-06", "The vehicle shall keep to its lane; its centre stays within 0.6 m of the lane's "
     "centre.", "always(abs(ego.lane_offset) <= 0.6 m)", "D", "m", "ego.lane_offset"),
    ("FSR-07", "A time headway below 0.8 s shall be opened to 1 s within 6 s.",
     "always(time_headway < 0.8 s implies eventually[0 s, 6 s](time_headway >= 1 s))", "D", "s",
     "time_headway"),
)  # fmt: skip


def run_id(architecture: str, scenario: str, fsr: int) -> str:
    return f"r{ARCHITECTURES.index(architecture)}{SCENARIOS.index(scenario)}{fsr}b7e04c19"


def replay_command(run: str) -> str:
    return f"adeye replay {run}"


GAPS = {
    (3, 1): {Verdict.INCONCLUSIVE: 3, Verdict.PASS: 17, Verdict.VACUOUS: 40},
    (5, 2): {Verdict.ERROR: 1, Verdict.PASS: 59},
    (1, 0): {Verdict.INVALID: 2, Verdict.PASS: 58},
}


def counts_of(fsr: int, architecture: str, scenario: str) -> dict[Verdict, int]:
    """Decide how a requirement went; the legacy camera brakes late, the lidar has gaps."""
    scene = SCENARIOS.index(scenario)
    if architecture == "legacy_camera" and fsr in {0, 1} and scene < 2:
        return {Verdict.FAIL: 11 - 4 * scene, Verdict.PASS: 49 + 4 * scene}
    if architecture == "legacy_camera" and fsr == 6:
        return {Verdict.FAIL: 2, Verdict.VACUOUS: 30, Verdict.PASS: 28}
    if architecture == "lidar" and (fsr, scene) in GAPS:
        return GAPS[fsr, scene]
    if fsr in {2, 3} and scene == 2:
        return {Verdict.VACUOUS: 60}
    if fsr in {2, 3, 4}:
        return {Verdict.PASS: 20, Verdict.VACUOUS: 40}
    return {Verdict.PASS: 60}


def margin_of(fsr: int, architecture: str, scenario: str, verdict: Verdict) -> Margin | None:
    if verdict in {Verdict.VACUOUS, Verdict.ERROR, Verdict.NOT_RUN}:
        return None
    unit = FSRS[fsr][4]
    spread = 0.37 * (1 + SCENARIOS.index(scenario)) + 0.11 * fsr
    value = 1.0 if unit == "1" else spread
    if verdict is Verdict.FAIL:
        value = -1.0 if unit == "1" else -1.9 * spread
    if architecture == "lidar":
        value *= 1.0 if unit == "1" else 1.3
    return Margin(value=value, unit=unit, robustness=value / 2.0)


def binding_of(fsr: int, margin: Margin | None) -> Binding | None:
    if margin is None:
        return None
    _, _, formula, _, unit, signal = FSRS[fsr]
    if unit == "1":
        is_contact = fsr == 0
        return Binding(
            predicate="not contact" if is_contact else signal,
            signal=signal,
            time_s=6.15,
            obligation_time_s=5.9,
            actor="cutter" if is_contact else None,
            value=(margin.value < 0.0) if is_contact else (margin.value > 0.0),
            threshold=not is_contact,
        )
    threshold = {1: 6.0, 4: -4.5, 5: 0.6, 6: 1.0}[fsr]
    side = -1.0 if fsr in {1, 5} else 1.0
    return Binding(
        predicate=formula.removeprefix("always"),
        signal=signal,
        time_s=4.35,
        obligation_time_s=4.35,
        actor="cutter" if fsr == 6 else None,
        value=threshold + side * margin.value,
        threshold=threshold,
        difference=margin.value,
        unit=unit,
    )


def build_cells() -> tuple[Cell, ...]:
    cells: list[Cell] = []
    for number, (fsr, *_) in enumerate(FSRS):
        for architecture in ARCHITECTURES:
            total: dict[Verdict, int] = {}
            parts: list[Cell] = []
            for scenario in SCENARIOS:
                counts = counts_of(number, architecture, scenario)
                parts.append(cell_of(number, architecture, scenario, counts))
                for verdict, count in counts.items():
                    total[verdict] = total.get(verdict, 0) + count
            worst = min(parts, key=lambda part: part.margin.value if part.margin else math.inf)
            overall = Cell(
                fsr=fsr,
                architecture=architecture,
                verdict=fold_runs(total, min_exercised=30),
                counts=total,
                exercised=sum(total.values()) - total.get(Verdict.VACUOUS, 0),
                runs=sum(total.values()),
                margin=worst.margin,
                binding=worst.binding,
                worst_run=worst.worst_run,
                command=worst.command,
            )
            cells += [overall, *parts]
    return tuple(cells)


def cell_of(number: int, architecture: str, scenario: str, counts: dict[Verdict, int]) -> Cell:
    verdict = fold_runs(counts)
    margin = margin_of(number, architecture, scenario, verdict)
    run = run_id(architecture, scenario, number)
    return Cell(
        fsr=FSRS[number][0],
        architecture=architecture,
        scenario=scenario,
        verdict=verdict,
        counts=counts,
        exercised=sum(counts.values()) - counts.get(Verdict.VACUOUS, 0),
        runs=sum(counts.values()),
        margin=margin,
        binding=binding_of(number, margin),
        worst_run=run if margin is not None else None,
        command=replay_command(run),
    )


def parameters_of(text: str) -> tuple[Label, ...]:
    return (
        Label(label="ego_speed", value="120 km/h"),
        Label(label="relative_speed", value="-40 km/h"),
        Label(label="gap", value="45 m"),
        Label(label=f"lateral_speed{text}", value="2 m/s"),
    )


def build_worst_cases(cells: tuple[Cell, ...], text: str) -> tuple[WorstCase, ...]:
    found = [
        cell
        for cell in cells
        if cell.scenario is not None and cell.worst_run is not None and cell.margin is not None
    ]
    found.sort(key=lambda cell: (cell.verdict is not Verdict.FAIL, cell.margin.value))  # type: ignore[union-attr]
    return tuple(
        WorstCase(
            fsr=cell.fsr,
            architecture=cell.architecture,
            scenario=str(cell.scenario),
            run=str(cell.worst_run),
            verdict=cell.verdict or Verdict.NOT_RUN,
            outcome=Outcome.COMPLETED if index % 4 else Outcome.CHANNEL_ERROR,
            fault="none" if index % 3 else "front_camera_out",
            parameters=parameters_of(text),
            margin=cell.margin,
            binding=cell.binding,
            command=cell.command,
        )
        for index, cell in enumerate(found[:18])
    )


def drive(rows: int, *, late: bool) -> dict[str, list[float]]:
    """Drive the ego behind a vehicle that cuts in; ``late`` reacts too late and too little."""
    columns: dict[str, list[float]] = {
        name: [] for name in ("x", "v", "a", "cx", "cy", "ch", "cv", "steer", "gap", "y")
    }
    x, v, a, cutter, cutter_speed = 100.0, 33.3, 0.0, 100.0 + 62.0, 22.2
    for row in range(rows):
        time = row * STEP
        begun = 1.8
        share = min(1.0, max(0.0, (time - begun) / 3.0))
        lateral = 1.75 + 3.5 * (share - math.sin(2 * math.pi * share) / (2 * math.pi))
        rate = 3.5 / 3.0 * (1 - math.cos(2 * math.pi * share)) if 0.0 < share < 1.0 else 0.0
        gap = cutter - x - 4.8
        sees = time > begun + (2.6 if late else 1.0)
        wish = 0.0
        if sees:
            closing = v - cutter_speed
            need = max(0.0, closing) ** 2 / (2.0 * max(gap - 6.0, 1.0))
            wish = -min(4.0 if late else 8.0, 1.25 * need) if closing > 0.2 else 0.1
        a += (wish - a) * STEP / 0.15
        contact = gap <= 0.0
        values = {
            "x": x, "v": v, "a": a, "cx": cutter, "cy": lateral,
            "ch": math.atan2(rate, cutter_speed), "cv": cutter_speed,
            "steer": 0.002 * math.sin(time), "gap": gap, "y": 5.25 + 0.08 * math.sin(0.9 * time),
        }  # fmt: skip
        for name, value in values.items():
            columns[name].append(value)
        if contact:
            break
        v = max(0.0, v + a * STEP)
        x += v * STEP
        cutter += cutter_speed * STEP
    return columns


def build_fan(drive_: dict[str, list[float]], every: int = 10) -> FanView:
    """Build three candidates every half a second; the last one of each fan is chosen."""
    return FanView(
        every=every,
        fans=tuple(
            tuple(
                Candidate(
                    desirability=0.5 * rank,
                    is_chosen=rank == 2,
                    points=tuple((x + 10.0 * k, y + 1.2 * k * (2 - rank)) for k in (1, 2, 3)),
                )
                for rank in range(3)
            )
            for x, y in list(zip(drive_["x"], drive_["y"], strict=True))[::every]
        ),
    )


def build_grid(count: int, every: int = 3) -> GridView:
    """Build maps of 4 by 3 cells of 5 m: a shoulder, a lane, a car in it that comes nearer."""
    maps = -(-count // every)
    return GridView(
        every=every,
        occupied_every=1,
        view="safety",
        cell_m=5.0,
        x_m=-5.0,
        y_m=-7.5,
        columns=4,
        rows=3,
        levels=(1.0, 3.0, 7.0),
        worst=8.0,
        times_s=(0.0, 1.0, 4.0),
        number=("a4b4d4",) + ("+a12",) * (maps - 1),
        occupied=tuple("a6dca2dc" if index % 2 else "a5dcaadca" for index in range(count)),
    )


def build_replay(run: str, architecture: str, *, late: bool, rows: int, text: str) -> Replay:
    drive_ = drive(rows, late=late)
    count = len(drive_["x"])
    times = [row * STEP for row in range(count)]
    out = [late and 2.0 <= time < 5.0 for time in times]
    takes_over = [time >= 4.6 for time in times]
    road_x = tuple(float(x) for x in range(0, 1201, 1200))
    marks = ("solid", "dashed", "dashed", "solid")
    seen = [
        not blind and row > 4 and abs(drive_["cx"][row] - drive_["x"][row]) < 110.0
        for row, blind in enumerate(out)
    ]
    points = tuple(
        (((drive_["cx"][row] + 0.3 * math.sin(row), drive_["cy"][row] + 0.2)),) if seen[row] else ()
        for row in range(count)
    )
    tracks: tuple[tuple[Track, ...], ...] = tuple(
        (
            (
                drive_["cx"][row] - drive_["x"][row],
                drive_["cy"][row] - drive_["y"][row],
                drive_["cv"][row] - drive_["v"][row],
                0.4,
                4.5,
                1.8,
            ),
        )
        if row > 12
        else ()
        for row in range(count)
    )
    required = [
        None if gap <= 0 or v <= cv else min(12.0, (v - cv) ** 2 / (2.0 * gap))
        for gap, v, cv in zip(drive_["gap"], drive_["v"], drive_["cv"], strict=True)
    ]
    margin = margin_of(1, architecture, "cut_in", Verdict.FAIL if late else Verdict.PASS)
    verdicts = [
        RunVerdict(
            fsr=f"{FSRS[1][0]}",
            verdict=Verdict.FAIL if late else Verdict.PASS,
            margin=margin,
            binding=binding_of(1, margin),
        ),
        RunVerdict(
            fsr="FSR-03", verdict=Verdict.VACUOUS, note="the nominal channel never fell silent"
        ),
        RunVerdict(fsr="FSR-06", verdict=Verdict.PASS, margin=Margin(value=0.52, unit="m")),
    ]
    if late:
        contact = Margin(value=-1.0, unit="1", robustness=-1.0)
        verdicts.insert(
            0,
            RunVerdict(
                fsr="FSR-01",
                verdict=Verdict.FAIL,
                margin=contact,
                binding=Binding(
                    predicate="not contact",
                    signal="contact",
                    time_s=times[-1],
                    actor="cutter",
                    value=True,
                    threshold=False,
                ),
            ),
        )
    late_events = (
        Event(time_s=2.0, kind="fault", text="front_camera_out begins"),
        Event(time_s=5.0, kind="fault", text="front_camera_out ends"),
        Event(time_s=times[-1], kind="contact", text="contact with cutter"),
    )
    return Replay(
        run=run,
        scenario="cut_in",
        architecture=architecture,
        fault="front_camera_out" if late else "none",
        parameters=parameters_of(text),
        outcome=Outcome.COMPLETED,
        verdicts=tuple(verdicts),
        why=f"worst run of FSR-02{text}" if late else f"passing run of cut_in{text}",
        command=replay_command(run),
        trace_digest="5d1f0a6b2c9e47d38812aa50f3b7c6e1",
        step_s=STEP,
        horizon_s=12.0,
        road=RoadGeometry(
            boundaries=tuple(
                Line(marking=mark, x_m=road_x, y_m=(3.5 * lane, 3.5 * lane))  # type: ignore[arg-type]
                for lane, mark in enumerate(marks)
            ),
            shoulder=Line(marking="none", x_m=road_x, y_m=(-3.0, -3.0)),
        ),
        ego=EgoMotion(
            length_m=4.9,
            width_m=1.9,
            wheelbase_m=2.9,
            x_m=tuple(drive_["x"]),
            y_m=tuple(drive_["y"]),
            heading_rad=tuple(0.002 * math.cos(0.9 * time) for time in times),
            speed_mps=tuple(drive_["v"]),
            acceleration_mps2=tuple(drive_["a"]),
            steering_angle_rad=tuple(drive_["steer"]),
        ),
        actors=(
            ActorMotion(
                id=f"cutter{text}",
                kind="car",
                length_m=4.5,
                width_m=1.8,
                x_m=tuple(drive_["cx"]),
                y_m=tuple(drive_["cy"]),
                heading_rad=tuple(drive_["ch"]),
                speed_mps=tuple(drive_["cv"]),
            ),
            ActorMotion(
                id="truck",
                kind="truck",
                length_m=14.0,
                width_m=2.5,
                x_m=tuple(165.0 + 24.0 * time for time in times),
                y_m=tuple(8.75 for _ in times),
                heading_rad=tuple(0.0 for _ in times),
                speed_mps=tuple(24.0 for _ in times),
            ),
        ),
        boxes=(
            StaticBox(
                id=f"parked{text}",
                kind="parked_truck",
                length_m=8.0,
                width_m=2.4,
                x_m=260.0,
                y_m=-1.5,
                heading_rad=0.05,
            ),
        ),
        sensors=(
            SensorView(
                id=f"front_camera{text}",
                kind="camera",
                x_m=1.5,
                fov_rad=1.75,
                range_m=120.0,
                alive=tuple(not blind for blind in out),
                detections=points,
            ),
            SensorView(
                id="front_radar",
                kind="radar",
                x_m=2.3,
                fov_rad=0.7,
                range_m=200.0,
                alive=tuple(True for _ in times),
                detections=tuple(
                    (
                        (drive_["cx"][row] - 1.9, drive_["cy"][row]),
                        (158.5 + 24.0 * times[row], 8.75),
                    )
                    for row in range(count)
                ),
                points=tuple(
                    tuple((drive_["cx"][row // 2 * 2] - 2.2, -0.9 + 0.2 * k) for k in range(10))
                    for row in range(count)
                ),
            ),
        ),
        channels=(
            ChannelView(
                id=f"nominal{text}",
                acceleration_mps2=tuple(drive_["a"]),
                steering_angle_rad=tuple(drive_["steer"]),
                status=tuple("ok" if time < 8.0 else "silent" for time in times),
                tracks=tracks,
                fan=build_fan(drive_),
            ),
            ChannelView(
                id="safety",
                acceleration_mps2=tuple(-3.0 if time > 4.3 else 0.0 for time in times),
                steering_angle_rad=tuple(0.004 * math.sin(2.0 * time) for time in times),
                status=tuple("requests_authority" if time > 4.4 else "ok" for time in times),
            ),
        ),
        grid=build_grid(count),
        faults=(FaultView(id=f"front_camera_out{text}", text="no samples", active=tuple(out)),),
        authority=tuple(int(flag) for flag in takes_over),
        reason=tuple("request" if flag else "default" for flag in takes_over),
        events=(
            Event(time_s=0.0, kind="storyboard", text=f"start{text}"),
            Event(time_s=1.8, kind="storyboard", text="cut_in begins"),
            Event(time_s=4.6, kind="switch", text="nominal → safety (request)"),
            *(late_events if late else ()),
        ),
        signals=(
            SignalPlot(
                name=f"required_deceleration{text}",
                unit="m/s²",
                values=tuple(required),
                thresholds=(ThresholdLine(fsr="FSR-02", value=6.0, side="at_most"),),
            ),
            SignalPlot(
                name="time_headway",
                unit="s",
                values=tuple(
                    max(0.0, gap) / max(speed, 1.0)
                    for gap, speed in zip(drive_["gap"], drive_["v"], strict=True)
                ),
                thresholds=(ThresholdLine(fsr="FSR-07", value=0.8, side="at_least"),),
            ),
            SignalPlot(
                name="ego.acceleration",
                unit="m/s²",
                values=tuple(drive_["a"]),
                thresholds=(ThresholdLine(fsr="FSR-05", value=-4.5, side="at_least"),),
            ),
            SignalPlot(
                name="ego.lane_offset",
                unit="m",
                values=tuple(y - 5.25 for y in drive_["y"]),
                thresholds=(
                    ThresholdLine(fsr="FSR-06", value=0.6, side="at_most"),
                    ThresholdLine(fsr="FSR-06", value=-0.6, side="at_least"),
                ),
            ),
            SignalPlot(name="ego.speed", unit="m/s", values=tuple(drive_["v"])),
            SignalPlot(name="actor.cutter.gap", unit="m", values=tuple(drive_["gap"])),
            SignalPlot(
                name="channel.nominal.status",
                values=tuple(float(time >= 8.0) for time in times),
                labels=("ok", "silent"),
            ),
            SignalPlot(
                name="authority.safety",
                values=tuple(float(flag) for flag in takes_over),
                labels=("false", "true"),
            ),
        ),
    )


@cache
def shipped_suite() -> Suite:
    path = shipped("odd") / "architectures" / "camera_radar.yaml"
    return analyse(load_architecture(path).spec)


def suite_of(text: str) -> Suite:
    """Analyse the shipped candidate; ``text`` is put where users write."""
    suite = shipped_suite()
    first, *others = suite.sensors
    return replace(
        suite,
        title=f"{suite.title}{text}",
        sensors=(replace(first, id=f"{first.id}{text}"), *others),
        critical=f"{suite.critical}{text}",
    )


def build_report(text: str = "", *, rows: int = 300, replays: int = 3) -> Report:
    """Build the report; ``text`` is put into every name and sentence that may hold any."""
    report = _build(text, rows=rows, replays=replays)
    designs = dict.fromkeys(SCENARIOS, f"full_factorial{text}")
    table = tuple(verification_of(report, {}, designs))
    told = {"verification": table, "open_points": open_points_of(report)}
    return report.model_copy(update=told)


def _build(text: str, *, rows: int, replays: int) -> Report:
    cells = build_cells()
    runs = (
        (run_id("legacy_camera", "cut_in", 1), "legacy_camera", True),
        (run_id("camera_radar", "cut_in", 1), "camera_radar", False),
        (run_id("lidar", "cut_in", 1), "lidar", False),
    )
    return Report(
        title=f"Motorway chauffeur up to 130 km/h{text}",
        odd="motorway_chauffeur",
        odd_digest="9b1c57e0d2",
        tool_version="0.1.0",
        numerics_version="1",
        campaign="c-5e21a07f",
        database=f"sqlite:///.adeye/adeye.db{text}",
        concept="motorway_chauffeur",
        concept_title=f"Motorway chauffeur with a safety channel{text}",
        concept_digest="71b0c5d2",
        evidence_digest="55e1f0aa",
        odd_attributes=(Label(label="rain", value=f"at most 7.5 mm/h{text}"),),
        realisations=tuple(
            Realisation(
                scenario=scenario,
                design=f"full factorial{text}",
                planned=180,
                executed=180,
                outcomes={Outcome.COMPLETED: 179, Outcome.NOT_REALISED: 1},
            )
            for scenario in SCENARIOS
        ),
        decompositions=(
            Decomposition(
                fsr="FSR-01",
                into=("FSR-02", f"FSR-06{text}"),
                scheme="D = B(D) + B(D)",
                independence=f"two suppliers{text}",
                dfa=(f"DFA-01{text}",),
            ),
        ),
        dependent_failures=(
            DependentFailure(
                id="DFA-01",
                covers=(f"power_a{text}",),
                argument=f"buffered{text}",
                owner="safety engineer",
                valid_until="2027-12-31",
            ),
        ),
        integrity_rules=28,
        findings=(
            IntegrityFinding(
                rule="goal_without_fsr",
                text=f"A safety goal has no FSR.{text}",
                part="safety_goal",
                id="SG-09",
                detail=f"nothing serves it{text}",
                remedy=f"Write one.{text}",
            ),
        ),
        exit_code=ExitCode.OK,
        message=f"All 6 mandatory FSRs pass for camera_radar.{text}",
        determinism="bit-exact: every run gives the same trace digest again",
        statements=(f"A grid: coverage, worst case and boundary, no probability.{text}",),
        planned=540,
        accounted=540,
        outcomes={Outcome.COMPLETED: 531, Outcome.CHANNEL_ERROR: 6, Outcome.NOT_REALISED: 3},
        command="adeye run odd/motorway_chauffeur.yaml",
        commands=(
            Command(text="this report", command="adeye report odd/motorway_chauffeur.yaml"),
            Command(text=f"integrity of the database{text}", command="adeye db verify"),
        ),
        dependencies=(
            Dependencies(
                f"camera_radar{text}",
                "",
                (
                    ChannelPair(
                        f"safety{text}",
                        f"nominal{text}",
                        (Shared("code", f"planner.py{text}", text, (f"channels.a{text}",), text),),
                        (f"sensors.truth{text}",),
                    ),
                ),
            ),
        ),
        suites=(suite_of(text),),
        architectures=(
            Architecture(
                id="legacy_camera", title=f"Legacy camera only{text}", is_gate=False, cost=140.0
            ),
            Architecture(
                id="camera_radar",
                title="Camera and radar with safety channel",
                is_gate=True,
                cost=270.0,
                parts=(Label(label="front_camera", value=f"camera, 120 m, 100 deg{text}"),),
            ),
            Architecture(
                id="lidar", title="Roof lidar with safety channel", is_gate=False, cost=690.0
            ),
        ),
        scenarios=tuple(
            Scenario(
                id=scenario,
                title=f"{title}{text}",
                tags=(Label(label="r157", value=case),),
                exposure=exposure,
                where=Place(path="odd/motorway.yaml", line=9 + SCENARIOS.index(scenario), column=5),
            )
            for scenario, title, case, exposure in zip(
                SCENARIOS,
                ("Cut-in of a slower vehicle", "Cut-out to a stopped vehicle", "Lead brakes"),
                ("4.4.1", "4.5.1", "4.3.2"),
                ("0.6 /h", "0.05 /h", "0.3 /h"),
                strict=True,
            )
        ),
        factors=tuple(
            Factors(
                scenario=scenario,
                points=20,
                fault_entries=("none", f"front_camera_out{text}", "nominal_silent"),
                architectures=3,
                replicates=1,
                test_cases=180,
                axes=(
                    Label(label="ego_speed", value="80, 120 km/h"),
                    Label(label="gap", value=f"30, 45, 60 m{text}"),
                ),
                command=f"adeye plan odd/motorway_chauffeur.yaml --scenario {scenario}",
            )
            for scenario in SCENARIOS
        ),
        fsrs=tuple(
            Fsr(
                id=fsr,
                text=f"{sentence}{text}",
                formula=f"{formula}{text}",
                asil=asil,
                goals=("SG-01",) if fsr in {"FSR-01", "FSR-02", "FSR-07"} else ("SG-02",),
                mandatory=fsr != "FSR-07",
                allocation=("nominal_channel", "safety_channel", f"switch{text}"),
                threshold_source=f"UN R157, 5.2.5.2{text}",
                ftti_s=1.5,
                fdti_s=0.5 if fsr == "FSR-03" else None,
                min_exercised=30,
                where=Place(path="odd/concepts/motorway.yaml", line=60, column=5),
                assumptions=("AS-01",) if fsr == "FSR-01" else (),
            )
            for fsr, sentence, formula, asil, *_ in FSRS
        ),
        cells=cells,
        assessment=assessment(text),
        impact=impact(text),
        worst_cases=build_worst_cases(cells, text),
        dead_axes=(
            DeadAxis(
                scenario="lead_braking",
                axis=f"rain{text}",
                values="0, 7.5 mm/h",
                command="adeye query 'select rain_mmph from v_runs_lead_braking'",
            ),
        ),
        metrics=tuple(
            MetricSummary(
                metric=metric,
                title=f"{title}{text}",
                unit=unit,
                scenario=scenario,
                architecture=architecture,
                runs=60,
                undefined=4 if metric.startswith("min_ttc") else 0,
                minimum=Extreme(value=low, run="r1", command="adeye replay r1"),
                median=Extreme(value=2.0 * low, run="r2", command="adeye replay r2"),
                maximum=Extreme(value=5.0 * low, run="r3", command=f"adeye replay r3{text}"),
            )
            for metric, title, unit, low in (
                ("min_distance_m", "Least distance", "m", 2.31),
                ("min_ttc_s", "Least time to collision", "s", 0.84),
                ("max_required_deceleration_mps2", "Greatest required deceleration", "m/s^2", 1.2),
            )
            for scenario in SCENARIOS
            for architecture in ARCHITECTURES
        ),
        faults=evidence(text),
        confidence=some_claims(text),
        confidence_command=f"adeye confidence c-5e21a07f{text}",
        odd_coverage=coverage(text),
        step_uncertainty=step(text),
        hazards=(
            Hazard(
                id="HE-01",
                text=f"too little or no braking for a vehicle ahead{text}",
                severity="S3",
                exposure="E4",
                controllability="C3",
                asil="D",
            ),
            Hazard(
                id="HE-02",
                text="loss of the control command",
                severity="S3",
                exposure="E4",
                controllability="C3",
                asil="D",
            ),
        ),
        goals=(
            SafetyGoal(
                id="SG-01",
                text=f"The vehicle shall not hit a vehicle ahead.{text}",
                asil="D",
                hazards=("HE-01",),
                safe_state=f"standstill in the lane{text}",
                ftti_s=1.5,
            ),
            SafetyGoal(
                id="SG-02",
                text="Loss of the nominal command shall lead to a stop in the lane.",
                asil="D",
                hazards=("HE-02",),
                safe_state="standstill in the lane",
                ftti_s=1.0,
            ),
        ),
        elements=(
            Element(
                id="front_camera",
                kind="sensor",
                text=f"camera behind the windscreen{text}",
                asil_capability="B",
                legacy=True,
                realised_by=("camera_radar.front_camera", f"legacy_camera.front_camera{text}"),
            ),
        ),
        assumptions=(
            Assumption(
                id="AS-01",
                text=f"The safety channel's view of the surroundings is complete.{text}",
                owner="system architect",
                valid_until="2027-12-31",
            ),
        ),
        waivers=(
            Waiver(
                fsr="FSR-04",
                reason=f"horizon too short for the slowest stop{text}",
                author="safety engineer",
                expires="2027-01-31",
                runs=3,
            ),
        ),
        replays=tuple(
            build_replay(run, architecture, late=late, rows=rows, text=text)
            for run, architecture, late in runs[:replays]
        ),
    )
