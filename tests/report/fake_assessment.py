"""What a report may say of preventability, timing, safe stops and change."""

from typing import Any

from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.gate.baseline import Kind
from adeye.report.model.assessment import (
    Assessment,
    AvoidableRun,
    BudgetTiming,
    CellTally,
    FaultTiming,
    GoalTiming,
    Preventability,
    SafeStop,
    SafeStops,
    StopPlace,
    Timing,
)
from adeye.report.model.evidence import Change, Impact, StaleEvidence, StaleFiles


def preventability(text: str = "") -> Preventability:
    """Two runs of six that only the model avoids, one contact that nobody evaluated."""
    return Preventability(
        executed=24,
        compared=6,
        open_contacts=1,
        tallies=(
            CellTally(
                scenario="cut_in",
                architecture="legacy_camera",
                model=f"cc{text}",
                edition="r157-01",
                counts={
                    "both_avoid": 1, "only_ours": 1, "only_model": 2, "neither": 1, "unknown": 1
                },
            ),
        ),
        findings=2,
        listed=(
            AvoidableRun(
                run="f00d",
                drive="d00d",
                scenario="cut_in",
                architecture="legacy_camera",
                fault_entry=f"front_camera_out{text}",
                model="cc",
                edition="r157-01",
                impact_speed_mps=8.3,
                command="adeye replay f00d",
                drive_command="adeye replay d00d",
            ),
        ),
        command=f"adeye preventability c0de{text}",
    )  # fmt: skip


def fault_timing(**changes: Any) -> FaultTiming:
    """A fault that is handled in time in all of four runs, unless said otherwise."""
    told: dict[str, Any] = {
        "scenario": "cut_in",
        "fault_entry": "nominal_silent",
        "architecture": "camera_radar",
        "runs": 4,
        "measured": 4,
        "handled": 4,
        "fdti_s": 0.25,
        "frti_s": 0.5,
        "fhti_s": 0.75,
        "ftti_s": 2.0,
        "margin_s": 0.25,
        "verdict": Verdict.PASS,
        "run": "f00d",
        "command": "adeye replay f00d",
    }
    return FaultTiming(**told | changes)


def timing(text: str = "") -> Timing:
    """A goal, a budget, a fault in time and one that was not measured."""
    return Timing(
        assumed_s=1.0,
        goals=(
            GoalTiming(
                goal="SG-02",
                ftti_s=1.0,
                rationale=f"the lane is left later{text}",
                fsrs=("FSR-03",),
                fdti_s=0.5,
                margin_s=0.5,
                verdict=Verdict.INCONCLUSIVE,
                note=f"no FSR states a budget of the reaction{text}",
            ),
        ),
        budgets=(
            BudgetTiming(
                fsr="FSR-03",
                scenario="cut_in",
                fault_entry=f"nominal_silent{text}",
                architecture="camera_radar",
                runs=4,
                fdti_budget_s=0.5,
                fdti_s=0.75,
                margin_s=-0.25,
                verdict=Verdict.FAIL,
                note="the budget is exceeded",
                run="f00d",
                command=f"adeye replay f00d{text}",
            ),
        ),
        faults=(
            fault_timing(),
            FaultTiming(
                scenario="cut_in",
                fault_entry=f"front_camera_out{text}",
                architecture="legacy_camera",
                runs=4,
                measured=0,
                verdict=Verdict.NOT_RUN,
                note="not measured",
            ),
        ),
        command=f"adeye faults c0de{text}",
    )


def stop(**changes: Any) -> SafeStop:
    """Four stops of six runs: three stand, one has a contact."""
    told: dict[str, Any] = {
        "scenario": "cut_in",
        "fault_entry": "nominal_silent",
        "architecture": "camera_radar",
        "runs": 6,
        "asked": 4,
        "reached": 3,
        "contact": 1,
        "slowest_s": 7.35,
        "from_fault_s": 7.6,
        "deceleration_mps2": 4.0,
        "places": (
            StopPlace(rating=8, place="contact", runs=1),
            StopPlace(rating=5, place="fast lane", runs=3),
        ),
        "regret": 4.0,
        "run": "f00d",
        "command": "adeye replay f00d",
    }
    return SafeStop(**told | changes)


def assessment(text: str = "") -> Assessment:
    """All three parts; the text gets into every name that a user writes."""
    stops = (stop(fault_entry=f"nominal_silent{text}"),)
    return Assessment(
        preventability=preventability(text),
        timing=timing(text),
        safe_stops=SafeStops(runs=24, asked=4, unknown=0, rows=stops),
    )


def impact(text: str = "", **changes: Any) -> Impact:
    """One FSR fails newly, one cause made evidence stale."""
    told: dict[str, Any] = {
        "baseline": f"reports/baselines/mini{text}.json",
        "campaign": "0ddba11",
        "exit_code": ExitCode.FAILED,
        "message": f"Exit code 1{text}.",
        "changes": (
            Change(
                kind=Kind.NEWLY_FAILING,
                decides=True,
                fsr="FSR-01",
                architecture="camera_radar",
                text=f"FAIL, PASS before{text}",
                runs=("f00d",),
                command="adeye show f00d",
            ),
            Change(kind=Kind.NOTE, decides=False, text="scenario cut_in was edited"),
        ),
        "stale": StaleFiles(
            odd=f"odd/mini{text}.yaml",
            evidence=10,
            counts=6,
            causes=(
                StaleEvidence(
                    cause="scenario",
                    subject="cut_in",
                    text=f"scenario cut_in has changed{text}",
                    evidence=4,
                    runs=2,
                    fsrs=("FSR-01", "FSR-02"),
                    architectures=("camera_radar",),
                ),
            ),
            to_judge=0,
            to_replay=0,
            to_execute=2,
        ),
        "command": f"adeye gate c0de --baseline mini{text}.json",
    }
    return Impact(**told | changes)
