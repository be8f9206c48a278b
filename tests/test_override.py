"""Overrides around the switch: who acts from a tick on, and what stays as the switch decides."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye.ports import SwitchContext, SwitchModel
from adeye.simulate.switch import make_switch
from adeye.simulate.switch.arbiter import overriding
from adeye.spec.architecture import Switch
from adeye.sweep.case import AuthorityOverride
from tests.motorway import make_case, make_scenario
from tests.project import Executed, run_cases

STEP = 0.05
NOMINAL, SAFETY = 0, 1
IDS = ("nominal", "safety")
SPEC = Switch.model_validate(
    {"policy": "fixed_priority", "priority": ["safety", "nominal"], "default": "nominal"}
)


def proposals(
    tick: int, *, nominal: int = signals.OK, safety: int = signals.OK, stamp: float | None = None
) -> Any:
    """Commands of both channels; the nominal one is as old as its stamp says."""
    now = tick * STEP
    return [
        signals.ControlCommand(name, *map(np.atleast_1d, (own, 0.1 * own, at, status)))
        for name, own, at, status in (
            ("nominal", 1.0, now if stamp is None else stamp, nominal),
            ("safety", -4.0, now, safety),
        )
    ]


def make(override: AuthorityOverride | None) -> SwitchModel:
    """Return an overridden switch of one run: of its test case only the override counts."""
    context = SwitchContext([SPEC], IDS, STEP)
    case = replace(make_case(make_scenario()), override=override)
    return overriding(make_switch(context), [case], context)


def decide(switch: SwitchModel, tick: int, **changes: Any) -> tuple[int, int, float, float]:
    command, authority = switch.arbitrate(tick * STEP, proposals(tick, **changes))
    acceleration, steering = map(float, command[0])
    return int(authority.channel[0]), int(authority.reason[0]), acceleration, steering


def test_without_an_override_the_switch_is_the_very_same() -> None:
    case = make_case(make_scenario())
    context = SwitchContext([SPEC], IDS, STEP)
    switch = make_switch(context)
    assert overriding(switch, [case], context) is switch


def test_override_begins_exactly_at_its_tick() -> None:
    switch = make(AuthorityOverride(3, "safety"))
    found = [decide(switch, tick) for tick in range(6)]
    assert found[:3] == [(NOMINAL, signals.REASON_DEFAULT, 1.0, 0.1)] * 3
    assert found[3:] == [(SAFETY, signals.REASON_OVERRIDE, -4.0, -0.4)] * 3


def test_original_decision_keeps_its_reason_and_command() -> None:
    plain, same = make(None), make(AuthorityOverride(2, "safety"))
    for tick in range(5):
        asks = signals.REQUESTS_AUTHORITY if tick >= 2 else signals.OK
        assert decide(same, tick, safety=asks) == decide(plain, tick, safety=asks)


def test_request_of_another_channel_is_not_heard() -> None:
    switch = make(AuthorityOverride(0, "nominal"))
    found = decide(switch, 0, safety=signals.REQUESTS_AUTHORITY)
    assert found == (NOMINAL, signals.REASON_OVERRIDE, 1.0, 0.1)


def test_channel_that_cannot_act_leaves_the_ego_coasting() -> None:
    switch = make(AuthorityOverride(2, "nominal"))
    assert decide(switch, 0)[0] == NOMINAL
    # The switch itself would hand over to the safety channel; the override does not let it.
    late = [decide(switch, tick, nominal=signals.SILENT, stamp=0.0) for tick in (2, 3, 20)]
    assert late[-1] == (signals.NO_CHANNEL, signals.REASON_OVERRIDE, 0.0, 0.1)


def test_other_runs_of_the_batch_keep_their_decisions() -> None:
    case = make_case(make_scenario())
    context = SwitchContext([SPEC, SPEC], IDS, STEP)
    cases = [case, replace(case, override=AuthorityOverride(0, "safety"))]
    both = overriding(make_switch(context), cases, context)
    names = ("acceleration", "steering_angle", "stamp", "status")
    two = [
        signals.ControlCommand(item.channel, *(np.repeat(getattr(item, name), 2) for name in names))
        for item in proposals(0)
    ]
    command, authority = both.arbitrate(0.0, two)
    assert authority.channel.tolist() == [NOMINAL, SAFETY]
    assert authority.reason.tolist() == [signals.REASON_DEFAULT, signals.REASON_OVERRIDE]
    assert command[:, 0].tolist() == [1.0, -4.0]


@pytest.mark.slow
def test_run_with_an_override_from_the_start_is_that_of_a_stuck_switch(mini: Executed) -> None:
    case = mini.case("camera_radar", "nominal_silent")
    stuck = case.architecture.switch.model_copy(update={"policy": "stuck"})
    architecture = case.architecture.model_copy(update={"switch": stuck})
    forced = run_cases(mini.plan, [replace(case, override=AuthorityOverride(0, "nominal"))])
    real = run_cases(mini.plan, [replace(case, architecture=architecture)])
    for name in ("ego", "objects", "command", "contact", "acceleration", "monitors"):
        assert forced[name].tobytes() == real[name].tobytes(), name
    decided = forced["authority"][0, : int(forced.length[0]) - 1]
    assert set(decided.tolist()) <= {NOMINAL, signals.NO_CHANNEL}


@pytest.mark.slow
def test_fork_is_the_same_for_any_batch(mini: Executed) -> None:
    case = mini.plan.cases[0]
    fork = replace(case, override=AuthorityOverride(30, case.architecture.switch.default))
    other = replace(case, override=AuthorityOverride(10, "safety"))
    alone = run_cases(mini.plan, [fork])
    together = run_cases(mini.plan, [case, other, fork])
    assert alone.chains()[0] == together.chains()[2]
