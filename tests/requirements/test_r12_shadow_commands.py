"""R12: several channels run at once, shadow commands are kept, and FSRs judge each of them."""

from dataclasses import replace

import numpy as np
import pytest

from adeye.judge.verdict import Verdict
from adeye.signals import SILENT
from adeye.sweep.case import AuthorityOverride, TestCase
from adeye.trace import Trace
from tests.conftest import MakeProject
from tests.project import CANDIDATE, CONCEPT, Executed, odd_of, run_cases
from tests.requirements.loop import invite

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
    assert shadow.max() - shadow.min() > 0.1


@pytest.mark.slow
def test_verdicts_are_per_channel(make_project: MakeProject) -> None:
    project = make_project(odd_of("lead_braking"))
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


@pytest.mark.slow
def test_commands_of_a_program_and_of_a_planned_stop_are_kept_while_another_acts(
    make_project: MakeProject,
) -> None:
    project = make_project(odd_of("lead_braking"))
    invite(project)
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["safety"]["parameters"] = {"stop": "planned"}
    plan = project.plan()
    trace = run_cases(plan, [plan.cases[0]])
    rows = int(trace.length[0]) - 1
    nominal, guest, safety = (
        trace.layout.channels.index(name) for name in ("nominal", "guest", "safety")
    )
    assert set(trace["authority"][0, 1:rows].tolist()) <= {nominal, -1}
    for channel in (guest, safety):
        assert (trace["status"][0, 1:rows, channel] != SILENT).all()
        assert np.isfinite(trace["acceleration"][0, 1:rows, channel]).all()
    # Also what it would rate and choose is recorded for the replay.
    assert "last_safe_stop" in trace.layout.monitors


@pytest.mark.slow
def test_shadow_commands_say_what_a_fork_with_another_authority_would_have_begun_with(
    mini: Executed,
) -> None:
    """The shadow command at the fork's tick is the acting one of the fork, bit for bit."""
    case, tick = mini.case("camera_radar", "none"), 40
    origin = run_cases(mini.plan, [case])
    fork = run_cases(mini.plan, [replace(case, override=AuthorityOverride(tick, "safety"))])
    safety = origin.layout.channels.index("safety")
    assert origin["authority"][0, tick] != safety
    assert fork["authority"][0, tick] == safety
    assert fork["command"][0, tick, 0] == origin["acceleration"][0, tick, safety]
    assert fork["command"][0, tick, 1] == origin["steering_angle"][0, tick, safety]
