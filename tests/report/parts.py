"""Parts of a report as ``content/report.yaml`` tells them, with changes."""

from typing import Any, TypeVar

from adeye.report.claims import Claim, Claims
from adeye.report.comparison.records import Candidate, Comparison, Difference
from adeye.report.model.assessment import (
    Assessment,
    FaultEvidence,
    FaultGroup,
    FaultTiming,
    Preventability,
    SafeStop,
    SafeStops,
    TradeCurve,
    WorstInjection,
)
from adeye.report.model.evidence import Impact, OddCoverage, StepLine, StepUncertainty
from adeye.report.model.part import Part
from tests.stored import stored

MARK = "§"
CONTENT: dict[str, Any] = stored("report")

AnyPart = TypeVar("AnyPart", bound=Part)


def filled(content: Any, text: str = "", /, **names: Any) -> Any:
    """Put ``text`` in the place of each mark, and a value in that of each ``$name``."""
    if isinstance(content, dict):
        return {filled(key, text): filled(item, text, **names) for key, item in content.items()}
    if isinstance(content, list):
        return [filled(item, text, **names) for item in content]
    if not isinstance(content, str):
        return content
    return names[content[1:]] if content.startswith("$") else content.replace(MARK, text)


def part(kind: type[AnyPart], name: str, text: str = "", /, **changes: Any) -> AnyPart:
    """Make a part of a report, through its checks."""
    return kind.model_validate({**filled(CONTENT[name], text), **changes})


# --- Confidence, coverage of the ODD, the step


def claim(fsr: str = "FSR-01", **changes: Any) -> Claim:
    """A bound of a scenario without a failure, in the gate."""
    return part(Claim, "claim", fsr=fsr, **changes)


def refused(fsr: str, scenario: str, reason: str, **changes: Any) -> Claim:
    """No bound."""
    nothing = dict.fromkeys(("share", "interval", "upper"))
    return claim(fsr, scenario=scenario, refusal=reason, **nothing, **changes)


def claims(*found: Claim, text: str = "") -> Claims:
    """Claims of a campaign, with conditions where there is a bound."""
    conditions = () if all(item.refusal for item in found) else (f"About this model.{text}",)
    return part(Claims, "claims", text, conditions=conditions, claims=found)


def some_claims(text: str = "") -> Claims:
    """A drawn scenario and a grid."""
    varied = {"low": 0.03, "high": 0.09}
    failing = {"share": 0.05, "interval": {"low": 0.01, "high": 0.139}, "upper": 0.124}
    return claims(
        claim(),
        claim("FSR-06", failing=3, **failing),
        claim(architecture="legacy_camera", is_in_gate=False, undecided=2),
        claim(scenario="", interval=None, upper_varied=varied, rate_per_h=0.02),
        refused("FSR-01", "lead_braking", f"chosen points, not a random sample{text}"),
        refused("FSR-03", "cut_in", f"its precondition never held{text}"),
        text=text,
    )


def coverage(text: str = "", **changes: Any) -> OddCoverage:
    """Two attributes: one with a gap, one with a bin that no scenario has."""
    return part(OddCoverage, "coverage", text, **changes)


def line(name: str = "FSR-02", **changes: Any) -> StepLine:
    """A margin with an uncertainty."""
    return part(StepLine, "step_line", name=name, **changes)


def step(text: str = "", **changes: Any) -> StepUncertainty:
    """Margins that are known, not known and changed, and a metric."""
    return part(StepUncertainty, "step", text, **changes)


# --- Preventability, timing, safe stops, change


def preventability(text: str = "") -> Preventability:
    """Two runs of six that only the model avoids, one contact that nobody evaluated."""
    return part(Preventability, "preventability", text)


def fault_timing(**changes: Any) -> FaultTiming:
    """A fault that is handled in time in all of four runs, unless said otherwise."""
    return part(FaultTiming, "fault_timing", **changes)


def stop(text: str = "", **changes: Any) -> SafeStop:
    """Four stops of six runs: three stand, one has a contact."""
    return part(SafeStop, "stop", text, **changes)


def assessment(text: str = "") -> Assessment:
    """All three parts; the text gets into every name that a user writes."""
    return Assessment(
        preventability=preventability(text),
        timing=filled(CONTENT["timing"], text),
        safe_stops=SafeStops(runs=24, asked=4, unknown=0, rows=(stop(text),)),
    )


def impact(text: str = "", **changes: Any) -> Impact:
    """One FSR fails newly, one cause made evidence stale."""
    return part(Impact, "impact", text, **changes)


# --- Faults


def group(text: str = "", *, counts: dict[Any, int] | None = None, **worst: Any) -> FaultGroup:
    """A fault entry that is handled in time in all of four runs, unless said otherwise."""
    classes: dict[Any, int] = counts or {"detected_in_time": 4}
    return FaultGroup(
        scenario="cut_in",
        fault_entry=f"nominal_silent{text}",
        architecture="camera_radar",
        counts=classes,
        detected=classes.get("detected_in_time", 0) + classes.get("detected_late", 0),
        activated=sum(classes.values()) - classes.get("not_activated", 0),
        least_ftti_s=2.0,
        most_fhti_s=0.75,
        worst=part(WorstInjection, "injection", text, **worst),
    )


def undetected(text: str = "") -> FaultGroup:
    """A fault that nobody detects before the run ends in a violation."""
    nothing = dict.fromkeys(("fdti_s", "frti_s", "fhti_s", "margin_s"))
    counts = {"undetected_violation": 1, "not_activated": 1, "masked": 2}
    return group(text, counts=counts, class_="undetected_violation", **nothing)


def curve(*, sampled: bool = False) -> TradeCurve:
    """Three values: the longer the debounce, the fewer trips, and the later the detection."""
    points = []
    for confirm, trips in ((0.0, 12), (0.1, 10), (0.2, 2)):
        ends = {"low": 0.5 * trips, "high": 4.0 * trips + 4.0} if sampled else {}
        points.append(
            {
                "value": f"{confirm:g} s",
                "calm": {"runs": 8, "hours": 0.5, "trips": trips, "per_hour": 2.0 * trips, **ends},
                "faulty": 8,
                "detected": 8,
                "median_fdti_s": 0.15 + confirm,
                "worst_fdti_s": 0.25 + confirm,
            }
        )
    axis = "architecture.channels.safety.parameters.confirm"
    content = {"architecture": "camera_radar", "scenarios": ("cut_in",), "points": points}
    return TradeCurve.model_validate({"axis": axis, **content})


def evidence(text: str = "", **changes: Any) -> FaultEvidence:
    """Two groups, all classes of takeovers, a trade; half of the runs are measured."""
    own = {"groups": (group(text), undetected(text)), "curves": (curve(),)}
    return part(FaultEvidence, "evidence", text, **{**own, **changes})


# --- A comparison


def candidate(name: str, **changes: Any) -> Candidate:
    """A candidate of a comparison."""
    return part(Candidate, "candidate", **{"id": name, "title": name, **changes})


def difference(**changes: Any) -> Difference:
    """A difference of one FSR."""
    return part(Difference, "difference", **changes)


def comparison(**changes: Any) -> Comparison:
    """A comparison of three candidates."""
    three = tuple({**CONTENT["candidate"], **item} for item in CONTENT["candidates"])
    own = {"candidates": three, "differences": (difference(),)}
    return part(Comparison, "comparison", **{**own, **changes})
