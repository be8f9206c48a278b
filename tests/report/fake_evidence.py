"""What a report may say of confidence, coverage of the ODD and the step."""

from typing import Any

from adeye.report.claims import Claim, Claims
from adeye.report.comparison.records import Range
from adeye.report.model.evidence import (
    AttributeCoverage,
    BinCoverage,
    Exclusion,
    OddCoverage,
    StepLine,
    StepUncertainty,
    UncoveredPair,
)


def claim(fsr: str = "FSR-01", **changes: Any) -> Claim:
    """A bound of a scenario without a failure, in the gate."""
    content: dict[str, Any] = {
        "fsr": fsr,
        "architecture": "camera_radar",
        "scenario": "cut_in",
        "is_mandatory": True,
        "is_in_gate": True,
        "points": 60,
        "exercised": 60,
        "failing": 0,
        "undecided": 0,
        "refusal": "",
        "share": 0.0,
        "interval": Range(low=0.0, high=0.0596),
        "upper": 0.0487,
    }
    return Claim(**{**content, **changes})


def refused(fsr: str, scenario: str, reason: str, **changes: Any) -> Claim:
    """No bound."""
    nothing: dict[str, Any] = {"share": None, "interval": None, "upper": None}
    return claim(fsr, scenario=scenario, refusal=reason, **{**nothing, **changes})


def claims(*found: Claim, text: str = "") -> Claims:
    """Claims of a campaign, with conditions where there is a bound."""
    return Claims(
        campaign="c-5e21a07f",
        odd="motorway_chauffeur",
        title=f"Motorway chauffeur{text}",
        level=0.95,
        method="clopper-pearson",
        target=None,
        is_joint=False,
        populations={"cut_in": f"independent draws: gap uniform from 20 m to 60 m{text}"},
        conditions=() if all(item.refusal for item in found) else (f"About this model.{text}",),
        claims=found,
    )


def some_claims(text: str = "") -> Claims:
    """A drawn scenario and a grid."""
    return claims(
        claim(),
        claim("FSR-06", failing=3, share=0.05, interval=Range(low=0.01, high=0.139), upper=0.124),
        claim(architecture="legacy_camera", is_in_gate=False, undecided=2),
        claim(
            scenario="",
            interval=None,
            upper_varied=Range(low=0.03, high=0.09),
            rate_per_h=0.02,
        ),
        refused("FSR-01", "lead_braking", f"chosen points, not a random sample{text}"),
        refused("FSR-03", "cut_in", f"its precondition never held{text}"),
        text=text,
    )


def coverage(text: str = "", **changes: Any) -> OddCoverage:
    """Two attributes: one with a gap, one with a bin that no scenario has."""
    content: dict[str, Any] = {
        "planned": 540,
        "counted": 537,
        "not_judged": 3,
        "in_no_bin": 1,
        "attributes": (
            AttributeCoverage(
                attribute="ego_speed",
                bins=(
                    BinCoverage(label=f"0 to 60 km/h{text}", state="uncovered", test_cases=0),
                    BinCoverage(label="60 to 130 km/h", state="covered", test_cases=536),
                ),
            ),
            AttributeCoverage(
                attribute=f"illumination{text}",
                bins=(
                    BinCoverage(label="day", state="covered", test_cases=535),
                    BinCoverage(label="dusk", state="covered", test_cases=2),
                    BinCoverage(label=f"night{text}", state="impossible", test_cases=0),
                ),
            ),
        ),
        "pairs": 6,
        "feasible_pairs": 4,
        "covered_pairs": 1,
        "uncovered_pairs": (
            UncoveredPair(
                attributes=("ego_speed", f"illumination{text}"), bins=(f"0 to 60 km/h{text}", "day")
            ),
            UncoveredPair(
                attributes=("ego_speed", f"illumination{text}"), bins=("60 to 130 km/h", "dusk")
            ),
        ),
        "exclusions": (Exclusion(scenario="cut_in", relations=(f"gap >= 20 m{text}",)),),
        "command": f"adeye coverage c-5e21a07f --json{text}",
    }
    return OddCoverage(**{**content, **changes})


def line(name: str = "FSR-02", **changes: Any) -> StepLine:
    """A margin with an uncertainty."""
    content: dict[str, Any] = {
        "kind": "fsr",
        "scenario": "cut_in",
        "architecture": "camera_radar",
        "name": name,
        "unit": "m/s^2",
        "sampled": 20,
        "pairs": 18,
        "uncertainty": 0.086,
        "largest": 0.11,
        "differing": 0,
        "changes": {},
    }
    return StepLine(**{**content, **changes})


def step(text: str = "", **changes: Any) -> StepUncertainty:
    """Margins that are known, not known and changed, and a metric."""
    content: dict[str, Any] = {
        "step_s": 0.05,
        "situations": 20,
        "lines": (
            line(),
            line(f"FSR-09{text}", unit="s", pairs=4, uncertainty=None, largest=0.013),
            line(
                "FSR-01",
                unit="",
                pairs=0,
                uncertainty=None,
                largest=None,
                differing=2,
                changes={f"PASS → FAIL{text}": 2},
            ),
            line("FSR-04", unit="", pairs=0, uncertainty=None, largest=None),
            line(f"min_ttc_s{text}", kind="metric", unit="s", uncertainty=0.025, largest=0.025),
        ),
        "command": f"adeye uncertainty c-5e21a07f --json{text}",
    }
    return StepUncertainty(**{**content, **changes})
