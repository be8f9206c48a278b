"""What a report may say about faults: classes, times, takeovers, trips and a trade."""

from typing import Any

from adeye.report.model.assessment import (
    Calm,
    FaultEvidence,
    FaultGroup,
    Rate,
    TakeoverRun,
    Takeovers,
    TradeCurve,
    TradePoint,
    WorstInjection,
)
from adeye.report.model.part import Command


def group(text: str = "", *, counts: dict[Any, int] | None = None, **worst: Any) -> FaultGroup:
    """A fault entry that is handled in time in all of four runs, unless said otherwise."""
    classes: dict[Any, int] = counts or {"detected_in_time": 4}
    detected = classes.get("detected_in_time", 0) + classes.get("detected_late", 0)
    times: dict[str, Any] = {"fdti_s": 0.25, "frti_s": 0.5, "fhti_s": 0.75, "ftti_s": 2.0}
    return FaultGroup(
        scenario="cut_in",
        fault_entry=f"nominal_silent{text}",
        architecture="camera_radar",
        counts=classes,
        detected=detected,
        activated=sum(classes.values()) - classes.get("not_activated", 0),
        least_ftti_s=2.0,
        most_fhti_s=0.75,
        worst=WorstInjection(
            **{
                "run": "f00d",
                "class_": "detected_in_time",
                **times,
                "margin_s": 1.25,
                "command": f"adeye replay f00d{text}",
                **worst,
            }
        ),
    )


def undetected(text: str = "") -> FaultGroup:
    """A fault that nobody detects before the run ends in a violation."""
    nothing = dict.fromkeys(("fdti_s", "frti_s", "fhti_s", "margin_s"))
    counts = {"undetected_violation": 1, "not_activated": 1, "masked": 2}
    return group(text, counts=counts, class_="undetected_violation", **nothing)


def curve(*, sampled: bool = False) -> TradeCurve:
    """Three values: the longer the debounce, the fewer trips, and the later the detection."""
    return TradeCurve(
        axis="architecture.channels.safety.parameters.confirm",
        architecture="camera_radar",
        scenarios=("cut_in",),
        points=tuple(
            TradePoint(
                value=f"{confirm:g} s",
                calm=Rate(
                    runs=8,
                    hours=0.5,
                    trips=trips,
                    per_hour=2.0 * trips,
                    low=0.5 * trips if sampled else None,
                    high=4.0 * trips + 4.0 if sampled else None,
                ),
                faulty=8,
                detected=8,
                median_fdti_s=0.15 + confirm,
                worst_fdti_s=0.25 + confirm,
            )
            for confirm, trips in ((0.0, 12), (0.1, 10), (0.2, 2))
        ),
    )


def evidence(text: str = "") -> FaultEvidence:
    """Two groups, all classes of takeovers, a trade; half of the runs are measured."""
    counts: dict[Any, int] = {
        "needed_and_done": 5, "late": 1, "spurious": 1, "missed": 1, "not_needed": 4
    }  # fmt: skip
    return FaultEvidence(
        with_fault=16,
        measured=8,
        executed=24,
        forked=12,
        commands=(
            Command(text="classes and times of faults", command=f"adeye faults c0de{text}"),
            Command(text="whether takeovers were needed", command=f"adeye forks c0de{text}"),
        ),
        groups=(group(text), undetected(text)),
        takeovers=Takeovers(
            counts=counts,
            avoidable=1,
            harmful=0,
            listed=(
                TakeoverRun(
                    run="beef",
                    fork="cafe",
                    class_="missed",
                    scenario="cut_in",
                    architecture="legacy_camera",
                    fault_entry=f"front_camera_out{text}",
                    takeover_s=None,
                    command=f"adeye replay beef{text}",
                ),
            ),
        ),
        calm=(
            Calm(
                architecture="camera_radar",
                rate=Rate(runs=8, hours=0.05, trips=2, per_hour=40.0, low=4.8, high=144.5),
                takeovers=2,
                availability=0.985,
                forked=2,
                not_needed=1,
            ),
        ),
        curves=(curve(),),
    )
