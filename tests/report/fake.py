"""A report as a campaign would give it: three architectures, three scenarios, seven FSRs."""

import math
from dataclasses import replace
from functools import cache
from typing import Any

from adeye.analysis.suite.analyse import analyse
from adeye.analysis.suite.records import Suite
from adeye.judge.verdict import Outcome, Verdict, fold_runs
from adeye.report.model.part import Binding, Margin
from adeye.report.model.report import Cell, Report, WorstCase
from adeye.report.page.replay import Replay
from adeye.report.verification import open_points_of, verification_of
from adeye.spec.load import load_architecture, shipped
from tests.report.parts import (
    CONTENT,
    assessment,
    coverage,
    evidence,
    filled,
    impact,
    some_claims,
    step,
)

STEP = 0.05
SCENARIOS = ("cut_in", "cut_out_to_stopped", "lead_braking")
ARCHITECTURES = ("camera_radar", "legacy_camera", "lidar")
FSRS: list[str] = [item["id"] for item in CONTENT["fsrs"]]
SIGNALS: list[Any] = CONTENT["signals"]

GAPS = {
    (3, 1): {Verdict.INCONCLUSIVE: 3, Verdict.PASS: 17, Verdict.VACUOUS: 40},
    (5, 2): {Verdict.ERROR: 1, Verdict.PASS: 59},
    (1, 0): {Verdict.INVALID: 2, Verdict.PASS: 58},
}


def run_id(architecture: str, scenario: str, fsr: int) -> str:
    return f"r{ARCHITECTURES.index(architecture)}{SCENARIOS.index(scenario)}{fsr}b7e04c19"


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
    unit = SIGNALS[fsr][1]
    spread = 0.37 * (1 + SCENARIOS.index(scenario)) + 0.11 * fsr
    is_truth = unit == "1"
    value = 1.0 if is_truth else spread
    if verdict is Verdict.FAIL:
        value = -1.0 if is_truth else -1.9 * spread
    if architecture == "lidar" and not is_truth:
        value *= 1.3
    return Margin(value=value, unit=unit, robustness=value / 2.0)


def binding_of(fsr: int, margin: Margin | None) -> Binding | None:
    if margin is None:
        return None
    signal, unit, threshold = SIGNALS[fsr]
    if unit == "1":
        return Binding(
            predicate="not contact" if signal == "contact" else signal,
            signal=signal,
            time_s=6.15,
            obligation_time_s=5.9,
            actor="cutter" if signal == "contact" else None,
            value=threshold is (margin.value > 0.0),
            threshold=threshold,
        )
    side = -1.0 if signal in {"required_deceleration", "ego.lane_offset"} else 1.0
    return Binding(
        predicate=filled(CONTENT["fsrs"][fsr]["formula"]).removeprefix("always"),
        signal=signal,
        time_s=4.35,
        obligation_time_s=4.35,
        actor="cutter" if signal == "time_headway" else None,
        value=threshold + side * margin.value,
        threshold=threshold,
        difference=margin.value,
        unit=unit,
    )


def cell_of(number: int, architecture: str, scenario: str) -> Cell:
    counts = counts_of(number, architecture, scenario)
    verdict = fold_runs(counts)
    margin = margin_of(number, architecture, scenario, verdict)
    run = run_id(architecture, scenario, number)
    return Cell(
        fsr=FSRS[number],
        architecture=architecture,
        scenario=scenario,
        verdict=verdict,
        counts=counts,
        exercised=sum(counts.values()) - counts.get(Verdict.VACUOUS, 0),
        runs=sum(counts.values()),
        margin=margin,
        binding=binding_of(number, margin),
        worst_run=run if margin is not None else None,
        command=f"adeye replay {run}",
    )


def total_of(parts: list[Cell]) -> Cell:
    """Fold the cells of all scenarios into one."""
    counts: dict[Verdict, int] = {}
    for part in parts:
        for verdict, count in part.counts.items():
            counts[verdict] = counts.get(verdict, 0) + count
    worst = min(parts, key=lambda part: part.margin.value if part.margin else math.inf)
    told = {"verdict": fold_runs(counts, min_exercised=30), "counts": counts, "scenario": None}
    sums = {name: sum(getattr(part, name) for part in parts) for name in ("exercised", "runs")}
    return worst.model_copy(update={**told, **sums})


def build_cells() -> tuple[Cell, ...]:
    cells: list[Cell] = []
    for number in range(len(FSRS)):
        for architecture in ARCHITECTURES:
            parts = [cell_of(number, architecture, scenario) for scenario in SCENARIOS]
            cells += [total_of(parts), *parts]
    return tuple(cells)


def worst_cases(cells: tuple[Cell, ...], text: str) -> list[WorstCase]:
    found = [cell for cell in cells if cell.scenario is not None and cell.margin is not None]
    found.sort(key=lambda cell: (cell.verdict is not Verdict.FAIL, cell.margin.value))  # type: ignore[union-attr]
    return [
        WorstCase.of(
            cell,
            run=str(cell.worst_run),
            outcome=Outcome.COMPLETED if index % 4 else Outcome.CHANNEL_ERROR,
            fault="none" if index % 3 else "front_camera_out",
            parameters=filled(CONTENT["parameters"], text),
        )
        for index, cell in enumerate(found[:18])
    ]


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
        values = {
            "x": x, "v": v, "a": a, "cx": cutter, "cy": lateral,
            "ch": math.atan2(rate, cutter_speed), "cv": cutter_speed,
            "steer": 0.002 * math.sin(time), "gap": gap, "y": 5.25 + 0.08 * math.sin(0.9 * time),
        }  # fmt: skip
        for name, value in values.items():
            columns[name].append(value)
        if gap <= 0.0:
            break
        v = max(0.0, v + a * STEP)
        x += v * STEP
        cutter += cutter_speed * STEP
    return columns


def fan_at(x: float, y: float) -> list[dict[str, Any]]:
    """Three candidates, of which the last is chosen."""
    return [
        {
            "desirability": 0.5 * rank,
            "is_chosen": rank == 2,
            "points": [(x + 10.0 * k, y + 1.2 * k * (2 - rank)) for k in (1, 2, 3)],
        }
        for rank in range(3)
    ]


def columns_of(rows: int, *, late: bool) -> dict[str, list[Any]]:
    """All that a replay has for each row, by the names in ``content/report.yaml``."""
    made: dict[str, list[Any]] = dict(drive(rows, late=late))
    x, y, v, cx, cy, cv = (made[name] for name in ("x", "y", "v", "cx", "cy", "cv"))
    count = len(x)
    times = [row * STEP for row in range(count)]
    made["out"] = [late and 2.0 <= time < 5.0 for time in times]
    made["sees"] = [not blind for blind in made["out"]]
    made["always"] = [True] * count
    made["takes_over"] = [time >= 4.6 for time in times]
    made["is_silent"] = [time >= 8.0 for time in times]
    made["zero"] = [0.0] * count
    made["heading"] = [0.002 * math.cos(0.9 * time) for time in times]
    made["offset"] = [value - 5.25 for value in y]
    made["truck_x"] = [165.0 + 24.0 * time for time in times]
    made["truck_y"] = [8.75] * count
    made["truck_v"] = [24.0] * count
    made["safety_a"] = [-3.0 if time > 4.3 else 0.0 for time in times]
    made["safety_steer"] = [0.004 * math.sin(2.0 * time) for time in times]
    made["nominal_status"] = ["ok" if time < 8.0 else "silent" for time in times]
    made["safety_status"] = ["requests_authority" if time > 4.4 else "ok" for time in times]
    made["authority"] = [int(flag) for flag in made["takes_over"]]
    made["reason"] = ["request" if flag else "default" for flag in made["takes_over"]]
    made["headway"] = [
        max(0.0, gap) / max(speed, 1.0) for gap, speed in zip(made["gap"], v, strict=True)
    ]
    made["required"] = [
        None if gap <= 0 or own <= other else min(12.0, (own - other) ** 2 / (2.0 * gap))
        for gap, own, other in zip(made["gap"], v, cv, strict=True)
    ]
    made["seen"], made["echoes"], made["returns"], made["tracks"] = [], [], [], []
    for row in range(count):
        is_seen = made["sees"][row] and row > 4 and abs(cx[row] - x[row]) < 110.0
        spot = (cx[row] + 0.3 * math.sin(row), cy[row] + 0.2)
        made["seen"].append([spot] if is_seen else [])
        made["echoes"].append([(cx[row] - 1.9, cy[row]), (158.5 + 24.0 * times[row], 8.75)])
        made["returns"].append([(cx[row // 2 * 2] - 2.2, -0.9 + 0.2 * k) for k in range(10)])
        track = (cx[row] - x[row], cy[row] - y[row], cv[row] - v[row], 0.4, 4.5, 1.8)
        made["tracks"].append([track] if row > 12 else [])
    made["fans"] = [fan_at(*place) for place in list(zip(x, y, strict=True))[::10]]
    # Maps of 4 by 3 cells of 5 m: a shoulder, a lane, a car in it that comes nearer.
    made["ratings"] = ["a4b4d4", *["+a12"] * (-(-count // 3) - 1)]
    made["occupied"] = ["a6dca2dc" if row % 2 else "a5dcaadca" for row in range(count)]
    return made


def build_replay(run: str, architecture: str, *, late: bool, rows: int, text: str) -> Replay:
    columns = columns_of(rows, late=late)
    verdict = Verdict.FAIL if late else Verdict.PASS
    margin = margin_of(1, architecture, "cut_in", verdict)
    names = {"verdict": verdict, "margin": margin, "binding": binding_of(1, margin)}
    end = (len(columns["x"]) - 1) * STEP
    told = filled(CONTENT["drives"]["late" if late else "good"], text, **names, end=end)
    events, touched = told.pop("more", []), told.pop("touched", None)
    return Replay.model_validate(
        {
            **filled(CONTENT["replay"], text, **columns),
            **told,
            "verdicts": told["verdicts"] if touched is None else [touched, *told["verdicts"]],
            "events": [*told["events"], *events],
            "run": run,
            "architecture": architecture,
            "command": f"adeye replay {run}",
            "parameters": filled(CONTENT["parameters"], text),
        }
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


def metrics_of(text: str) -> list[dict[str, Any]]:
    """Least, median and greatest value of each metric."""
    found = []
    for item in filled(CONTENT["metrics"], text):
        least = item.pop("least")
        values = {"minimum": least, "median": 2.0 * least, "maximum": 5.0 * least}
        extremes = {
            name: {"value": value, "run": f"r{at}", "command": f"adeye replay r{at}"}
            for at, (name, value) in enumerate(values.items(), 1)
        }
        extremes["maximum"]["command"] += text
        found += [
            {"scenario": scenario, "architecture": name, "runs": 60, **item, **extremes}
            for scenario in SCENARIOS
            for name in ARCHITECTURES
        ]
    return found


def build_report(text: str = "", *, rows: int = 300, replays: int = 3) -> Report:
    """Build the report; ``text`` is put into every name and sentence that may hold any."""
    cells = build_cells()
    runs = ("legacy_camera", "camera_radar", "lidar")[:replays]
    plan = "adeye plan odd/motorway_chauffeur.yaml --scenario"
    parts = {
        "fsrs": filled(CONTENT["fsrs"], text),
        "realisations": [filled(CONTENT["realisation"], text, scenario=name) for name in SCENARIOS],
        "factors": [
            filled(CONTENT["factor"], text, scenario=name, plan=f"{plan} {name}")
            for name in SCENARIOS
        ],
        "suites": (suite_of(text),),
        "cells": cells,
        "assessment": assessment(text),
        "impact": impact(text),
        "worst_cases": worst_cases(cells, text),
        "metrics": metrics_of(text),
        "failing": filled(CONTENT["failing"], text),
        "faults": evidence(text),
        "confidence": some_claims(text),
        "odd_coverage": coverage(text),
        "step_uncertainty": step(text),
        "replays": [
            build_replay(
                run_id(name, "cut_in", 1), name, late=name == "legacy_camera", rows=rows, text=text
            )
            for name in runs
        ],
    }
    report = Report.model_validate({**filled(CONTENT["report"], text), **parts})
    designs = dict.fromkeys(SCENARIOS, f"full_factorial{text}")
    table = tuple(verification_of(report, {}, designs))
    return report.model_copy(update={"verification": table, "open_points": open_points_of(report)})
