"""R12: several channels run at once, shadow commands are kept, and FSRs judge each of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from adeye.evaluation.verdict import Verdict
from tests.project import CONCEPT, MINI

if TYPE_CHECKING:
    from adeye.sweep.case import TestCase
    from adeye.trace import Trace
    from tests.conftest import MakeProject

pytestmark = pytest.mark.requirements


def test_every_channel_answers_at_every_tick_whoever_acts(
    cut_ins: tuple[list[TestCase], Trace],
) -> None:
    _, trace = cut_ins
    rows = int(trace.length[0]) - 1
    safety = trace.layout.channels.index("safety")
    ages = trace.time[:rows] - trace["stamp"][:, :rows, safety]
    assert np.abs(ages).max() < 1e-9
    without = trace["authority"][:, :rows] != safety
    assert without.any()
    shadow = trace["acceleration"][:, :rows, safety][without]
    acting = trace["command"][:, :rows, 0][without]
    assert (shadow != acting).any()


def test_verdicts_are_per_channel(make_project: MakeProject) -> None:
    project = make_project(
        {
            **MINI,
            "scenarios": [{"use": "lead_braking", "faults": ["none"]}],
            "faults": [],
            "architectures": ["architectures/camera_radar.yaml"],
        }
    )
    with project.edited(CONCEPT) as concept:
        like = next(item for item in concept["requirements"] if item["id"] == "FSR-06")
        concept["requirements"] = [
            {**like, "id": f"FSR-{name}", "formula": formula}
            for name, formula in {
                "N": "always(time >= 1 s implies channel.nominal.acceleration <= 20 m/s^2)",
                "S": "always(time >= 1 s implies channel.safety.acceleration <= -20 m/s^2)",
            }.items()
        ]
    lines = {line.fsr: line.verdict for line in project.run().verdicts}
    assert lines == {"FSR-N": Verdict.PASS, "FSR-S": Verdict.FAIL}
