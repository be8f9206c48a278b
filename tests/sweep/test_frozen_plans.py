"""Every design and distribution on one scenario: the points that it plans, pinned."""

from pathlib import Path
from typing import Any

import pytest

from adeye.campaign.integrity import planned_coverage
from adeye.campaign.plan import make_plan
from adeye.errors import AdeyeError
from adeye.sweep import coverage
from tests.frozen import assert_frozen, described, masked
from tests.project import ROOT, odd_of
from tests.stored import write_yaml

GAPS = {"from": "10 m", "to": "60 m", "step": "10 m"}
SPEEDS = ["80 km/h", "100 km/h", "130 km/h"]
PAIRS: dict[str, Any] = {
    "ego_speed": SPEEDS,
    "relative_speed": ["-40 km/h", "-20 km/h", "-10 km/h"],
    "gap": GAPS,
    "rain": ["0 mm/h", "5 mm/h"],
    "friction": [0.5, 0.9],
}
RELATED = ["gap >= 20 m or ego_speed <= 100 km/h", "rain <= 0 mm/h or friction < 0.6"]
ENDS: dict[str, Any] = {"gap": ["10 m", "60 m"], "ego_speed": ["80 km/h", "130 km/h"]}
DRAWN: dict[str, Any] = {
    "lateral_speed": {"uniform": ["1 m/s", "2 m/s"]},
    "ego_speed": {
        "normal": {"mean": "100 km/h", "sd": "12 km/h", "min": "60 km/h", "max": "130 km/h"}
    },
    "gap": {"lognormal": {"median": "30 m", "sigma": 0.4, "max": "60 m"}},
    "relative_speed": {"empirical": "closing.csv", "column": "v", "unit": "km/h"},
    "rain": {"choice": {"0 mm/h": 0.8, "5 mm/h": 0.2}},
    "scenario.environment.illumination": {"choice": {"day": 0.7, "night": 0.3}},
}
SWEEPS: dict[str, dict[str, Any]] = {
    "full": {"parameters": {"ego_speed": SPEEDS, "gap": GAPS}, "where": RELATED[:1]},
    "zip": {"design": "zip", "parameters": {"ego_speed": SPEEDS, "gap": ["20 m", "40 m", "50 m"]}},
    "list": {
        "design": "list",
        "points": [{"gap": "20 m", "ego_speed": "90 km/h"}, {"gap": "33 m", "friction": 0.6}],
    },
    "pairwise": {"design": "pairwise", "parameters": PAIRS, "where": RELATED},
    "t_wise 1": {"design": "t_wise", "strength": 1, "parameters": PAIRS},
    "t_wise 3": {"design": "t_wise", "strength": 3, "parameters": PAIRS, "where": RELATED},
    "random": {"design": "random", "samples": 9, "parameters": DRAWN, "where": ["gap >= 20 m"]},
    "lhs": {"design": "lhs", "samples": 7, "parameters": ENDS},
    "lhs drawn": {"design": "lhs", "samples": 7, "parameters": DRAWN},
    "sobol": {"design": "sobol", "samples": 16, "parameters": ENDS, "where": ["gap >= 20 m"]},
    "sobol drawn": {"design": "sobol", "samples": 8, "parameters": DRAWN},
    "nothing left": {"parameters": {"gap": GAPS}, "where": ["gap > 100 m"]},
    "not even": {"parameters": {"gap": {"from": "10 m", "to": "55 m", "step": "10 m"}}},
    "backwards": {"parameters": {"gap": {"from": "60 m", "to": "10 m", "step": "10 m"}}},
    "between ends": {"design": "lhs", "samples": 4, "parameters": {"gap": GAPS}},
    "twice": {"parameters": {"gap": ["20 m", "2000 cm"]}},
    "no unit": {"parameters": {"gap": [20, 30]}},
    "no axis": {"parameters": {"gapp": ["20 m"]}},
    "zip of two lengths": {"design": "zip", "parameters": {"ego_speed": SPEEDS, "gap": ["20 m"]}},
    "weights": {"design": "lhs", "samples": 3, "parameters": {"gap": {"choice": {"20 m": 0.4}}}},
    "no samples": {"design": "sobol", "parameters": ENDS},
    "samples": {"samples": 3, "parameters": {"gap": GAPS}},
}
FAULT = {
    "id": "late", "target": "sensors.front_camera", "model": "drop_out", "onset": {"at": "2 s"},
}  # fmt: skip


def planned(folder: Path, sweep: dict[str, Any], **more: Any) -> list[str]:
    use = {"use": "cut_in", "faults": ["none"], "sweep": sweep, **more.pop("use", {})}
    odd = odd_of(use, **more)
    write_yaml(folder / "odd" / "tested.yaml", odd)
    try:
        plan = make_plan(folder / "odd" / "tested.yaml")
    except AdeyeError as error:
        return [f"  {error}"]
    cases = plan.cases
    lines = [f"  {len(cases)} test cases", *(f"  {notice}" for notice in plan.notices)]
    for case in list(cases)[:40]:
        point = ", ".join(
            f"{name} {value:.9g}" if isinstance(value, float) else f"{name} {value}"
            for name, value in case.point.items()
        )
        lines.append(f"  {case.fault_entry} {case.replicate}: {point}")
    return lines


def test_points_of_each_design_are_frozen(project: Path) -> None:
    (project / "odd" / "closing.csv").write_text("site,v\nA,-12\nB,-18.5\nC,-25\n", "utf-8")
    lines = []
    for name, sweep in SWEEPS.items():
        lines += [name, *planned(project, sweep)]
    for name, more in (
        ("replicates", {"replicates": 3}),
        ("seed", {"seed": 12}),
        ("two faults at once", {"faults": [FAULT, {**FAULT, "id": "soon"}],
                                "use": {"faults": ["none", "late", ["late", "soon"]]}}),
    ):  # fmt: skip
        sweep = {"design": "random", "samples": 3, "parameters": ENDS}
        lines += [name, *planned(project, sweep, **more)]
    assert_frozen("plans.txt", masked("\n".join(lines), project))


@pytest.mark.parametrize("name", ["sensor_study", "rural_two_way", "urban_pedestrian_rain"])
def test_coverage_of_a_shipped_odd_is_frozen(name: str) -> None:
    """How many of the bins of each attribute and of each two there are, and which are not."""
    found = planned_coverage(ROOT / "odd" / f"{name}.yaml", 2)
    lines = described(found.coverage)
    kept = [line[:300] for line in lines[:120] + lines[120::23]]
    assert_frozen(f"coverage_{name}.txt", masked("\n".join(kept), ROOT))


def test_points_that_are_spread_are_frozen() -> None:
    """The first and the last of those that look for what relations exclude."""
    lines = []
    for count in (1, 2, 3, 5):
        ranges = {f"axis {at}": (float(at), 10.0 * at + 1.0) for at in range(count)}
        for name, values in coverage._spread(ranges).items():
            ends = " ".join(f"{value:.9g}" for value in (*values[:6], *values[-2:]))
            lines.append(f"{count}, {name}: {len(values)} points, {ends}")
    assert_frozen("spread.txt", "\n".join([*lines, ""]))
